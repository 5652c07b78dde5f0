"""Parts of tools/baselines against what is known exactly: motions made by hand, and accelerations of the packed FMU."""

import ctypes
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from low_level import Opened

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "baselines"))


def need(module):
    try:
        return __import__(module)
    except ImportError:
        pytest.skip(f"{module} is not installed: ./test --full installs it")


def test_smoothing_keeps_parabolas_and_balances():
    from signals import Smoother

    t = np.arange(400) / 100
    smooth = Smoother(100, 0.3)
    inside = slice(smooth.half, -smooth.half)
    value, slope, bend = smooth(1 - 2 * t + 3 * t**2)[:, inside]
    spread = np.ptp(smooth(3 * t**2)[0, inside] - 3 * t[inside] ** 2)
    assert spread < 1e-10, "a parabola is moved by a constant only"
    assert np.allclose(slope, -2 + 6 * t[inside]) and np.allclose(bend, 6)
    # dd(x) + 25 x = 0 stays so, although the window is a quarter of the period.
    x, _, a = smooth(np.sin(5 * t))[:, inside]
    assert np.max(np.abs(a + 25 * x)) < 1e-3 * np.max(np.abs(a))


@pytest.mark.parametrize("coupling", ["paper", "geared"])
def test_balances_of_the_arm_are_those_of_the_fmu(fmu, coupling):
    from arm import Arm

    random = np.random.default_rng(1)
    q, v, torque, base, tip = (random.uniform(-1, 1, k) for k in (7, 7, 3, 3, 2))
    with Opened(fmu("PlanarManipulator", 3), "ME") as f:
        # Coordinates: base, joints, the motor of joint 1.
        f.initialize({
            "initialBasePosition": q[:2], "initialBaseAttitude": q[2], "initialJointAngle": q[3:6],
            "initialMotorAngle": [q[6], *q[4:6]], "initialBaseVelocity": v[:2], "initialBaseRate": v[2],
            "initialJointVelocity": v[3:6], "initialMotorVelocity": [v[6], *v[4:6]],
            "motorCoupling": ["paper", "geared"].index(coupling) + 1,
        })
        for name, value in (("jointTorque", torque), ("baseForce", base[:2]), ("baseTorque", base[2]), ("tipForce", tip)):
            f.set(name, value)
        derivatives = (ctypes.c_double * 14)()
        f.fmu.getContinuousStateDerivatives(derivatives, 14)
        parameters = {"motorCoupling": coupling}
        vectors = ("mountPosition", "linkMass", "linkInertia", "linkLength", "motorInertia", "gearRatio")
        for name in vectors + ("jointStiffness", "jointDamping"):
            parameters |= {f"{name}[{i}]": x for i, x in enumerate(f.get(name), 1)}
        for i, x in enumerate(f.get("linkCenterOfMass")):
            parameters[f"linkCenterOfMass[{i // 2 + 1},{i % 2 + 1}]"] = x
        parameters |= {name: f.get(name) for name in ("baseMass", "baseInertia")}
    channels = ["basePosition[1]", "basePosition[2]", "baseAttitude"]
    channels += [f"jointAngle[{i}]" for i in (1, 2, 3)] + ["motorAngle[1]"]
    arm = Arm(SimpleNamespace(parameters=parameters), channels)
    sample = lambda *x: np.array([*x, 0, 0])[:3, None]
    y = {c: sample(*x) for c, x in zip(channels, zip(q, v, derivatives[7:]))}
    y |= {f"jointTorque[{i}]": sample(x) for i, x in enumerate(torque, 1)} | {"rate": 1.0}
    ports = dict(zip(("base x", "base y", "base torque", "tip x", "tip y"), map(sample, (*base, *tip))))
    assert len(arm.rows) == 7
    assert np.max(np.abs(arm.balances(arm.p, y, ports))) < 1e-11
    assert np.max(np.abs(arm.balances(arm.p, y))) > 0.1


N, JM, JL, K, D, DM, KT = 100.0, 2e-5, 0.3, 0.05, 3e-5, 2e-4, 0.05
CASE = f"""model = "TwoMassJoint"
train = ["train-1.csv", "train-2.csv", "train-3.csv"]
holdout = ["holdout-1.csv"]
[parameters]
motorInertia = {JM}
loadInertia = {JL}
gearRatio = {N}
torqueConstant = {KT}
stiffness = {K}
damping = {D}
coulombFriction = 0.0
staticFriction = 0.0
viscousFriction = {DM}
[channels.motorCurrent]
noise = 1e-4
interpolation = "hold"
[channels.motorAngle]
noise = 1e-4
[channels.loadAngle]
noise = 3e-6
"""


def write_case(folder, gravity):
    """A joint without dry friction under a held current, its load hanging with this torque."""
    random, rate, parts = np.random.default_rng(3), 200, 4
    folder.mkdir()
    (folder / "case.toml").write_text(CASE)

    def rates(x, drive):
        spring = K * (x[0] - N * x[2]) + D * (x[1] - N * x[3])
        return np.array([x[1], (drive - DM * x[1] - spring) / JM, x[3], (N * spring - gravity * np.sin(x[2])) / JL])

    for name in ("train-1", "train-2", "train-3", "holdout-1"):
        t = np.arange(6 * rate) / rate
        lines = zip((0.3, 0.7, 1.3, 2.9), random.uniform(0, 6, 4))
        current = sum(0.1 * np.sin(2 * np.pi * f * t + phase) for f, phase in lines)
        x, h = np.zeros((len(t), 4)), 1 / rate / parts
        for k in range(1, len(t)):
            z, drive = x[k - 1], KT * current[k - 1]
            for _ in range(parts):
                a = rates(z, drive)
                b = rates(z + h / 2 * a, drive)
                c = rates(z + h / 2 * b, drive)
                z = z + h / 6 * (a + 2 * b + 2 * c + rates(z + h * c, drive))
            x[k] = z
        read = np.column_stack([current, x[:, 0], x[:, 2]]) + [1e-4, 1e-4, 3e-6] * random.standard_normal((len(t), 3))
        header = "time,motorCurrent,motorAngle,loadAngle"
        np.savetxt(folder / f"{name}.csv", np.column_stack([t, read]), "%.9f", ",", header=header, comments="")
    return folder


@pytest.mark.full
@pytest.mark.parametrize("gravity, verdict", [(0.0, "no-gap"), (2.0, "effects")])
def test_sparse_regression_names_a_term_that_is_missing(tmp_path, gravity, verdict):
    need("pandas"), need("pysindy")
    import sparse
    from reduced import reduced

    folder = write_case(tmp_path / "case", gravity)
    problem = reduced(folder, tmp_path / "cache")
    answer = sparse.answer(problem)
    assert answer.verdict == verdict
    if gravity:
        assert answer.effects[0] == "gravity-torque"
    kept = reduced(folder, tmp_path / "cache")
    assert all(np.array_equal(kept[k], problem[k]) for k in ("train", "holdout"))


@pytest.mark.full
def test_forest_says_what_it_was_taught():
    need("sklearn"), need("pandas")
    from cases import Key
    from forest import Forest

    random = np.random.default_rng(0)
    splits = [("none", []), ("parameters", []), ("single", ["backlash"]), ("single", ["gravity-torque"]), ("outside", ["x"])]
    keys = [Key("joint", split, effects, 5.0) for split, effects in splits for _ in range(12)]
    features = [{f"feature {i}": random.normal(5.0 * (i == k // 12)) for i in range(5)} for k in range(60)]
    answers = Forest(features, keys).answers([*features[::12], None])
    assert [a.verdict for a in answers] == ["no-gap", "parameters", "effects", "effects", "unknown", "unknown"]
    assert [a.effects for a in answers[2:4]] == [["backlash"], ["gravity-torque"]]
