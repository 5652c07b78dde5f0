"""`trueup identify --fmu` of FMUs that are not ours, in FMI 2.0 and 3.0 alike: parameters, start values of states, logs of two formats; and
our own joint with names that mean nothing. Both versions give one result: to the last bit where they are differentiated in one way,
else to what an estimate is converged to."""

import subprocess
import zipfile

import numpy as np
import pytest
import scipy.io
from low_level import Opened
from test_faulty_fmus import SOURCE, XML
from test_identify_fmu import JOINT, WRONG, case, identified, near, write
from test_ports import renamed

# x' = -k x with y = x: a parameter, and a state whose start value can be set.
PARAMETER = {
    2: '<ScalarVariable name="k" valueReference="3" causality="parameter" variability="fixed" initial="exact"><Real start="1"/></ScalarVariable>',
    3: '<Float64 name="k" valueReference="3" causality="parameter" variability="fixed" initial="exact" start="1"/>',
}
K, STARTS = 2.3, (1.4, -0.6)


@pytest.fixture(scope="module")
def decays(tmp_path_factory):
    """The FMU by version."""
    folder, made = tmp_path_factory.mktemp("decay"), {}
    for version, place in ((2, "linux64"), (3, "x86_64-linux")):
        library = folder / f"f{version}.so"
        subprocess.run(["cc", "-O1", "-w", "-fPIC", "-shared", f"-DV={version}", SOURCE, "-o", library, "-lm"], check=True)
        made[version] = folder / f"decay{version}.fmu"
        with zipfile.ZipFile(made[version], "w") as archive:
            text = XML[version].replace("</ModelVariables>", PARAMETER[version] + "</ModelVariables>")
            archive.writestr("modelDescription.xml", text)
            archive.write(library, f"binaries/{place}/f.so")
    return made


def shared(results):
    """What two results have in common is equal bit by bit; one of them."""
    for found in results:
        del found["fmu"]
    assert results[0] == results[1]
    return results[0]


def decay(t, start, seed):
    return start * np.exp(-K * t) + np.random.default_rng(seed).normal(0, 1e-3, len(t))


def test_parameter_and_recorded_state(trueup, decays, tmp_path):
    """Recordings as CSV and as MAT; the state is recorded, so that its start is estimated in each."""
    t = np.arange(0, 1.2, 0.04)
    write(tmp_path, "a.csv", {"time": t, "x": decay(t, STARTS[0], 1)})
    scipy.io.savemat(tmp_path / "b.mat", {"time": t, "x": decay(t, STARTS[1], 2)})
    case(tmp_path, "f", {"k": 1.0}, {"x": {"noise": 1e-3}}, fit=["k"], train=("a.csv", "b.mat"))
    found = shared([identified(trueup, tmp_path, "--in-process", "--fmu", decays[v]) for v in (2, 3)])
    near(found, "k", K, 0.01)
    for run, start in zip(("a.csv", "b.mat"), STARTS, strict=True):
        e = found["nuisance"][run]["x"]
        assert abs(e["value"] - start) < 4 * e["standard_error"] < 0.01


def test_start_value_as_a_parameter(trueup, decays, tmp_path):
    """An output is recorded that is no state: the state's start value is given and estimated by its name."""
    t = np.arange(0, 1.2, 0.02)
    write(tmp_path, "a.csv", {"time": t, "y": decay(t, STARTS[0], 3)})
    case(tmp_path, "f", {"k": 1.0, "x": 1.0}, {"y": {"noise": 1e-3}}, fit=["k", "x"])
    found = shared([identified(trueup, tmp_path, "--in-process", "--fmu", decays[v]) for v in (2, 3)])
    near(found, "k", K, 0.01)
    near(found, "x", STARTS[0], 0.01)


@pytest.mark.full
def test_a_joint_with_names_that_mean_nothing(trueup, fmu, tmp_path):
    """FMI 3.0 is differentiated along the way by its tunable parameters, FMI 2.0 by differences of whole runs."""
    t, rng = np.arange(0, 0.6, 2e-3), np.random.default_rng(4)
    current = np.round(0.3 * np.sin(9 * t + 0.3) + 0.2 * np.sin(41 * t), 4)
    with Opened(fmu("TwoMassJoint", 2), "CS", tolerance=1e-12) as f:
        f.initialize(JOINT, stop=2.0)
        motor, load = np.empty_like(t), np.empty_like(t)
        for k, time in enumerate(t):
            motor[k], load[k] = f.get("motorAngle"), f.get("loadAngle")
            f.set("motorCurrent", float(current[k]))
            if k + 1 < len(t):
                f.fmu.doStep(currentCommunicationPoint=float(time), communicationStepSize=float(t[k + 1] - time))
    motor += rng.normal(0, 2e-3, len(t))
    load += rng.normal(0, 2e-5, len(t))
    results = []
    for version in (2, 3):
        folder = tmp_path / str(version)
        folder.mkdir()
        other, old = renamed(fmu("TwoMassJoint", version), folder, 2)
        new = {name: drawn for drawn, name in old.items()}
        columns = {"motorCurrent": current, "motorAngle": motor, "loadAngle": load}
        write(folder, "a.csv", {"time": t} | {new[n]: v for n, v in columns.items()})
        wrong = {new[name]: value * WRONG.get(name, 1) for name, value in JOINT.items()}
        channels = {"motorCurrent": {"interpolation": "hold"}, "motorAngle": {"noise": 2e-3}, "loadAngle": {"noise": 2e-5}}
        case(folder, "TwoMassJoint", wrong, {new[n]: c for n, c in channels.items()}, fit=[new[n] for n in WRONG])
        found = identified(trueup, folder, "--in-process", "--fmu", other)
        results.append({old[name]: e for name, e in found["parameters"].items()})
    for name in WRONG:
        a, b = results[0][name], results[1][name]
        off = abs(a["value"] - b["value"]) / a["standard_error"]
        print(f"{name}: {a['value']:.12g} and {b['value']:.12g}, {off:.1e} standard errors apart")
        assert off < 1e-4 and abs(b["standard_error"] / a["standard_error"] - 1) < 1e-4
        assert abs(a["value"] - JOINT[name]) < 4 * a["standard_error"]
