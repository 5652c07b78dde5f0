"""A joint about to break away while its input goes on lines: its FMU, run by our own program in event mode, gets on."""

import csv

import numpy as np
import pytest

# Static friction is no higher than Coulomb's: nothing keeps a motor sliding that the next input holds.
JOINT = {
    "motorInertia": 1.7235743e-05,
    "loadInertia": 0.80724989,
    "stiffness": 0.083666484,
    "damping": 7.6777065e-05,
    "coulombFriction": 0.0052496987,
    "viscousFriction": 5.6044384e-05,
    "staticFriction": 0.0052496987,
    "gearRatio": 160,
    "torqueConstant": 0.04,
}


def columns(path):
    with open(path) as file:
        rows = list(csv.reader(file))
    return {name: np.array([float(row[i]) for row in rows[1:]]) for i, name in enumerate(rows[0])}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.full) for seed in (1, 2, 3))])
def test_runs_to_the_end_and_as_fmi_2_does(trueup, fmu, tmp_path, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(0, 30.001, 0.002)
    sines = zip(rng.uniform(0.05, 2, 12), rng.uniform(0, 2 * np.pi, 12))
    u = 0.25 * np.sin(2 * np.pi * 0.23 * t) + 0.06 * sum(np.sin(2 * np.pi * f * t + phase) for f, phase in sines)
    np.savetxt(tmp_path / "u.csv", np.column_stack([t, u]), delimiter=",", header="time,motorCurrent", comments="")
    values = [word for name, value in JOINT.items() for word in ("--set", f"{name}={value}")]
    found = []
    for version in (3, 2):
        out = tmp_path / f"{version}.csv"
        done = trueup(
            "simulate", fmu("TwoMassJoint", version), "--input", tmp_path / "u.csv",
            "--step", "1e-3", "--stop", "30", "-o", out, *values,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        found.append(columns(out))
    # Rows are at events too in event mode: compared where both have one.
    a, b = found
    assert a["time"][-1] == b["time"][-1] == 30
    last = np.searchsorted(a["time"], b["time"], side="right") - 1
    off = np.abs(a["loadAngle"][last] - b["loadAngle"]).max()
    print(f"load angle off by {off:.1e} of {np.ptp(b['loadAngle']):.1e} rad")
    assert off < 1e-3 * np.ptp(b["loadAngle"])
