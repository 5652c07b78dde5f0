"""`trueup identify --fmu`: the parameters of an FMU, ours or a third party's, from recordings that something else made:
an exact solution, SciPy, or FMPy running another copy of the FMU."""

import json
import os
import re
import resource
import shutil
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from low_level import Opened
from scipy.integrate import solve_ivp

JOINT = {
    "motorInertia": 1.7e-5, "loadInertia": 0.8, "gearRatio": 160.0, "torqueConstant": 0.04, "stiffness": 0.084,
    "damping": 7.7e-5, "coulombFriction": 5.2e-3, "staticFriction": 5.2e-3, "viscousFriction": 5.6e-5,
}
WRONG = {"stiffness": 1.3, "damping": 0.7, "coulombFriction": 0.8, "viscousFriction": 1.2}


def write(folder, name, columns):
    names, values = list(columns), np.column_stack(list(columns.values()))
    rows = "\n".join(",".join(f"{v:.12g}" for v in row) for row in values)
    (folder / name).write_text(",".join(names) + "\n" + rows + "\n")


def case(folder, model, parameters, channels, fit=None, train=("a.csv",)):
    text = [f'model = "{model}"', f"train = {json.dumps(list(train))}", "[parameters]"]
    text += [f"{name} = {value!r}" for name, value in parameters.items()]
    text += ["[fit]", f"parameters = {json.dumps(list(fit))}"] if fit else []
    for name, settings in channels.items():
        text += [f"[channels.{name}]", *(f"{key} = {json.dumps(value)}" for key, value in settings.items())]
    (folder / "case.toml").write_text("\n".join(text) + "\n")


def identified(trueup, folder, *arguments):
    done = trueup("identify", folder, "--json", "--fast", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def near(found, name, truth, sure):
    e = found["parameters"][name]
    print(f"{name}: {e['value']:.6g} +- {e['standard_error']:.2g}, truth {truth}")
    assert abs(e["value"] - truth) < 4 * e["standard_error"]
    assert e["standard_error"] < sure * abs(truth)


@pytest.fixture(scope="module")
def recorded_joint(fmus, tmp_path_factory):
    """Two runs of the joint in FMPy, from rest and moving, with sensor noise and a load sensor that is late and slow."""
    folder = tmp_path_factory.mktemp("joint")
    rng = np.random.default_rng(4)
    t = np.arange(0, 1.2, 2e-3)
    for name, phase, start in (("a.csv", 0.3, 0.0), ("b.csv", 1.9, 12.0)):
        current = np.round(0.3 * np.sin(9 * t + phase) + 0.2 * np.sin(41 * t), 4)
        with Opened(fmus / "TwoMassJoint.fmi2.fmu", "CS", tolerance=1e-12) as f:
            begin = JOINT | {"initialMotorVelocity": start, "initialLoadVelocity": start / JOINT["gearRatio"]}
            f.initialize(begin, stop=2.0)
            motor, load = np.empty_like(t), np.empty_like(t)
            for k, time in enumerate(t):
                motor[k], load[k] = f.get("motorAngle"), f.get("loadAngle")
                f.set("motorCurrent", float(current[k]))
                if k + 1 < len(t):
                    f.fmu.doStep(currentCommunicationPoint=float(time), communicationStepSize=float(t[k + 1] - time))
        motor += rng.normal(0, 2e-3, len(t))
        load += rng.normal(0, 2e-5, len(t))
        write(folder, name, {"time": t, "motorCurrent": current, "motorAngle": motor, "loadAngle": load})
    channels = {
        "motorCurrent": {"interpolation": "hold"}, "motorAngle": {"noise": 2e-3}, "loadAngle": {"noise": 2e-5},
    }
    wrong = {name: value * WRONG.get(name, 1) for name, value in JOINT.items()}
    case(folder, "TwoMassJoint", wrong, channels, fit=WRONG, train=("a.csv", "b.csv"))
    return folder


@pytest.mark.full
@pytest.mark.parametrize("version", [2, 3])
def test_our_fmu_gives_what_the_model_gives(trueup, fmu, recorded_joint, version):
    """What is fitted is what is shipped: the estimates differ by a small share of their standard errors."""
    native = identified(trueup, recorded_joint)
    shipped = identified(trueup, recorded_joint, "--fmu", fmu("TwoMassJoint", version))
    assert shipped["fmu"].endswith(f"TwoMassJoint.fmi{version}.fmu") and native["fmu"] is None
    for name in WRONG:
        a, b = native["parameters"][name], shipped["parameters"][name]
        off, wider = (b["value"] - a["value"]) / a["standard_error"], b["standard_error"] / a["standard_error"]
        print(f"FMI {version} {name}: off by {off:+.4f} standard errors, which are {wider:.4f} times the model's")
        assert abs(off) < 0.02 and abs(wider - 1) < 0.02
        near(shipped, name, JOINT[name], 0.2)


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def reference(request):
    """reference(name) is a Reference FMU."""
    folder = os.environ.get("TRUEUP_REFERENCE_FMUS")
    if not folder:
        pytest.skip("TRUEUP_REFERENCE_FMUS is not set: no third party's FMU is identified")
    return lambda name: Path(folder) / request.param / f"{name}.fmu"


def test_dahlquist(trueup, reference, tmp_path):
    """x = x0 exp(-k t), exactly."""
    t = np.arange(0, 2, 0.01)
    x = 1.4 * np.exp(-2.3 * t) + np.random.default_rng(1).normal(0, 1e-3, len(t))
    write(tmp_path, "a.csv", {"time": t, "x": x})
    case(tmp_path, "Dahlquist", {"k": 1.0}, {"x": {"noise": 1e-3}}, fit=["k"])
    found = identified(trueup, tmp_path, "--fmu", reference("Dahlquist"))
    near(found, "k", 2.3, 2e-3)
    assert 0.85 < found["residuals"][0]["above_noise_floor"] < 1.15
    assert abs(found["nuisance"]["a.csv"]["x"]["value"] - 1.4) < 2e-3


def test_van_der_pol(trueup, reference, tmp_path):
    """SciPy's Radau at 1e-11."""
    t = np.arange(0, 15, 0.05)
    mu = 2.6
    solved = solve_ivp(lambda _, x: (x[1], mu * (1 - x[0] ** 2) * x[1] - x[0]), (0, 15), (1.5, 0.3), "Radau", t,
                       rtol=1e-11, atol=1e-11)
    noise = np.random.default_rng(2).normal(0, 0.01, (2, len(t)))
    write(tmp_path, "a.csv", {"time": t, "x0": solved.y[0] + noise[0], "x1": solved.y[1] + noise[1]})
    case(tmp_path, "VanDerPol", {"mu": 1.8}, {"x0": {"noise": 0.01}, "x1": {"noise": 0.01}}, fit=["mu"])
    near(identified(trueup, tmp_path, "--fmu", reference("VanDerPol")), "mu", mu, 2e-3)


def test_bouncing_ball(trueup, reference, tmp_path):
    """Flights are parabolas, every bounce leaves e of the speed: the events carry what is known of e."""
    g, e, h0 = 9.3, 0.82, 1.1
    t = np.arange(0, 2.0, 0.01)
    h, begin, speed, height = np.empty_like(t), 0.0, 0.0, h0
    ends = [np.sqrt(2 * h0 / g)]
    starts = [(0.0, h0, 0.0)]
    speed = g * ends[0]
    for _ in range(5):
        speed *= e
        starts.append((ends[-1], 0.0, speed))
        ends.append(ends[-1] + 2 * speed / g)
    assert ends[-1] > t[-1]
    for k, time in enumerate(t):
        begin, height, speed = starts[np.searchsorted(ends, time)]
        h[k] = height + speed * (time - begin) - 0.5 * g * (time - begin) ** 2
    h += np.random.default_rng(3).normal(0, 2e-3, len(t))
    write(tmp_path, "a.csv", {"time": t, "h": h})
    case(tmp_path, "BouncingBall", {"g": -9.81, "e": 0.75}, {"h": {"noise": 2e-3}}, fit=["g", "e"])
    found = identified(trueup, tmp_path, "--fmu", reference("BouncingBall"))
    near(found, "g", -g, 1e-2)
    near(found, "e", e, 1e-2)
    assert 0.85 < found["residuals"][0]["above_noise_floor"] < 1.15


def copied(folder, to, **changes):
    for file in folder.iterdir():
        shutil.copy(file, to)
    text = (to / "case.toml").read_text()
    for old, new in changes.get("case", ()):
        assert old in text
        text = text.replace(old, new)
    (to / "case.toml").write_text(text)


@pytest.mark.parametrize(
    "change, model, arguments, message",
    [
        (("[fit]\nparameters = [\"stiffness\"", "[fit]\nparameters = [\"stifness\""), "TwoMassJoint", (), "stifness"),
        (("gearRatio = 160.0", "gearRatio = 160.0\njointFlexible = false"), "TwoMassJoint", (), "fixed when it was made"),
        (("gearRatio = 160.0", "gearRatio = -160.0"), "TwoMassJoint", (), "gearRatio"),
        (("gearRatio = 160.0", "gearRation = 160.0"), "TwoMassJoint", (), "did you mean `gearRatio`?"),
        (("[channels.loadAngle]", "[channels.loadAngel]"), "TwoMassJoint", (), "loadAngel"),
        (("[fit]", "[fit]"), "TwoMassJoint", ("--method", "ls"), "not through an FMU"),
    ],
)
def test_mistakes(trueup, fmu, recorded_joint, tmp_path, change, model, arguments, message):
    copied(recorded_joint, tmp_path, case=[change])
    done = trueup("identify", tmp_path, "--fmu", fmu(model, 2), *arguments)
    assert done.returncode == 1 and message in done.stderr, done.stderr


def test_co_simulation_alone(trueup, fmu, recorded_joint, tmp_path):
    with ZipFile(fmu("TwoMassJoint", 3)) as whole, ZipFile(tmp_path / "cs.fmu", "w") as less:
        for name in whole.namelist():
            data = whole.read(name)
            if name == "modelDescription.xml":
                data, count = re.subn(rb"<ModelExchange.*?/>", b"", data, flags=re.DOTALL)
                assert count == 1
            less.writestr(name, data)
    done = trueup("identify", recorded_joint, "--fmu", tmp_path / "cs.fmu")
    assert done.returncode == 1 and "offers CoSimulation, not Model Exchange" in done.stderr, done.stderr


def test_an_array_that_no_memory_holds(trueup, fmu, recorded_joint, tmp_path):
    with ZipFile(fmu("PlanarManipulator", 3)) as whole, ZipFile(tmp_path / "huge.fmu", "w") as huge:
        for name in whole.namelist():
            data = whole.read(name)
            if name == "modelDescription.xml":
                data, count = re.subn(rb'<Dimension start="3"', b'<Dimension start="1000000000000"', data)
                assert count > 1
            huge.writestr(name, data)
    done = trueup("identify", recorded_joint, "--fmu", tmp_path / "huge.fmu", preexec_fn=at_most_4_gib)
    assert done.returncode == 1, done.stderr
    assert "huge.fmu: `" in done.stderr and "has 1000000000000 elements" in done.stderr, done.stderr


def at_most_4_gib():
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


def test_no_fmu_there(trueup, recorded_joint, tmp_path):
    done = trueup("identify", recorded_joint, "--fmu", tmp_path / "nothing.fmu")
    assert done.returncode == 1 and "nothing.fmu" in done.stderr
