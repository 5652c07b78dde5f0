"""Inputs from files compared with FMPy: jumps and tunable parameters, drawn."""

import random
import subprocess

import pytest
from conftest import from_environment

fmpy = pytest.importorskip("fmpy")
np = pytest.importorskip("numpy")

SEED = 7


def drawn(rng, parameter):
    """Steps of the current, each a jump at a whole step; of the parameter, too. FMPy holds inputs over a step: of lines it would be late."""
    current, stiffness = rng.uniform(0.0, 0.02), 3.07e-5
    rows = [(0.0, current, stiffness)]
    for corner in sorted(rng.sample(range(1, 100), 6)):
        rows.append((corner / 100, current, stiffness))
        current = rng.uniform(-0.03, 0.03)
        stiffness = 3.07e-5 * rng.uniform(0.5, 2.0) if parameter else stiffness
        rows.append((corner / 100, current, stiffness))
    rows.append((1.0, current, stiffness))
    names = ["time", "motorCurrent"] + ["stiffness"] * parameter
    return names, [row[: len(names)] for row in rows]


@pytest.mark.parametrize("version, parameter", [(2, False), (3, True), pytest.param(3, False, marks=pytest.mark.full),
                                                pytest.param(2, True, marks=pytest.mark.full)])
def test_fmpy_reads_the_same(tmp_path, version, parameter):
    fmu = from_environment("TRUEUP_FMUS") / f"TwoMassJoint.fmi{version}.fmu"
    rng = random.Random(SEED + version)
    names, rows = drawn(rng, parameter)
    file = tmp_path / "in.csv"
    file.write_text(",".join(names) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows))
    out = tmp_path / "out.csv"
    done = subprocess.run(
        [from_environment("TRUEUP_BIN"), "simulate", fmu, "--input", file, "--stop", "1", "--step", "0.01", "-o", out],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stderr
    ours = np.genfromtxt(out, delimiter=",", names=True)
    inputs = np.array(rows, dtype=[(name, float) for name in names])
    theirs = fmpy.simulate_fmu(
        str(fmu), input=inputs, stop_time=1.0, step_size=0.01, output_interval=0.01, fmi_type="CoSimulation",
        output=["motorAngle", "loadAngle", "transmissionTorque"],
    )
    for name in ("motorAngle", "loadAngle", "transmissionTorque"):
        # FMPy's row at a jump shows what was there before it, ours what is there after it.
        jumps = {round(t, 9) for t, *_ in rows[1:-1]}
        last = {round(t, 9): x for t, x in zip(ours["time"], ours[name], strict=True)}
        scale = max(abs(x) for x in theirs[name])
        compared = [abs(last[round(t, 9)] - x) for t, x in zip(theirs["time"], theirs[name], strict=True) if round(t, 9) not in jumps]
        assert len(compared) >= 90 and max(compared) <= 1e-9 * scale, (SEED, name, max(compared) / scale)


@pytest.mark.parametrize("algorithm", ["jacobi", "iterative", pytest.param("adaptive", marks=pytest.mark.full)])
def test_a_jump_is_no_line(tmp_path, algorithm):
    """Whatever couples: a step ends before a jump with the value before it. The load's speed is the integral of what acts on it: a line over one step of
    0.01 s to a jump would be off by half a step's share of it, 5e-3."""
    fmu = from_environment("TRUEUP_FMUS") / "TwoMassJoint.fmi3.fmu"
    file, out = tmp_path / "in.csv", tmp_path / "out.csv"
    file.write_text("time,externalTorque\n0,0\n0.5,0\n0.5,0.001\n1,0.001\n")
    free = [f"--set={name}=0" for name in ("damping", "viscousFriction", "coulombFriction", "staticFriction")] + ["--set=stiffness=1e-30"]
    done = subprocess.run(
        [from_environment("TRUEUP_BIN"), "simulate", fmu, "--input", file, "--stop", "1", "--step", "0.01", "--algorithm", algorithm,
         "--set", "loadInertia=1e-3", *free, "-o", out],
        capture_output=True, text=True,
    )
    assert done.returncode == 0, done.stderr
    found = np.genfromtxt(out, delimiter=",", names=True)
    assert found["loadVelocity"][-1] == pytest.approx(0.5, rel=1e-6)
