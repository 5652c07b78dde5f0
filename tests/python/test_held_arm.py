"""Trials of a held arm: their simulator, which shares no code with the models, against a packed `SpatialFreeFlyer`."""

import csv
import tomllib

import numpy as np
import pytest
from low_level import Opened

SEED = 900
# Of --split none, by number: rigid joints; springs in some, in a posture that leaves itself in 0.4 s, so that any
# difference grows by exp(t / 0.4 s), and a light arm in such a posture: the first seconds. Relative to the largest way.
CASES = [pytest.param(0, np.inf, 1e-8, id="rigid"), pytest.param(1, 4.0, 1e-6, id="springs"), pytest.param(2, 2.0, 1e-8, id="light")]


def done(process):
    assert process.returncode == 0, process.stderr
    return process


def table(path):
    with path.open(newline="") as file:
        names, *rows = csv.reader(file)
    values = np.array(rows, float)
    return {name: values[:, i] for i, name in enumerate(names)}


def vector(columns, name):
    return np.column_stack([columns[f"{name}[{j}]"] for j in range(1, 7)])


def matrices(key):
    """Vectors and matrices of the key's elements."""
    found = {}
    for name, value in key["parameters"].items():
        variable, indices = name.rstrip("]").split("[")
        found.setdefault(variable, {})[tuple(int(i) - 1 for i in indices.split(","))] = value
    shapes = {"bodyCenterOfMass": (6, 3), "bodyInertia": (6, 3, 3)}
    whole = {}
    for variable, elements in found.items():
        whole[variable] = np.zeros(shapes.get(variable, 6))
        for at, value in elements.items():
            whole[variable][at] = value
    return whole


@pytest.mark.full
@pytest.mark.parametrize("index, until, limit", CASES)
def test_its_motion_is_that_of_the_packed_robot(trueup, tmp_path, index, until, limit):
    order = ("--plant", "held-arm", "--split", "none", "--seed", SEED, "--count", index + 1, "--shard", f"{index + 1}/{index + 1}")
    done(trueup("trial", "generate", "-o", tmp_path / "t", *order, "--truth", tmp_path / "truth"))
    (case,) = (tmp_path / "t" / "cases").iterdir()
    key = tomllib.loads((tmp_path / "t" / "keys" / f"{case.name}.toml").read_text())
    declared = tomllib.loads((case / "case.toml").read_text())
    assert key["verdict"] == "no-gap" and declared["model"] == "SpatialFreeFlyer"
    # Nothing is off: friction that the case declares is that of the key.
    for name, values in declared["effects"]["motor-friction"].items():
        assert name == "doubt" or values == [key["parameters"][f"{name}[{j}]"] for j in range(1, 7)]
    done(trueup("fmu", "pack", "SpatialFreeFlyer", "--robot", case / "robot.toml", "--effect", "motor-friction", "--fmi", "3", "-o", tmp_path))
    true = table(tmp_path / "truth" / case.name / "train-1.csv")
    read = table(case / "train-1.csv")
    start = {name: values.ravel() for name, values in matrices(key).items()} | {"gravity": declared["parameters"]["gravity"]}
    for kind in ("Joint", "Motor"):
        for what in ("Angle", "Velocity"):
            start[f"initial{kind}{what}"] = vector(true, f"{kind.lower()}{what}")[0]
    time, torque = true["time"], vector(true, "jointTorque")
    assert np.array_equal(time, read["time"])
    angles, stuck = [], 0
    with Opened(tmp_path / "SpatialFreeFlyer+motor-friction.fmi3.fmu", "CS", tolerance=1e-10) as fmu:
        fmu.initialize(start)
        for k, t in enumerate(time):
            angles.append(np.concatenate([fmu.get("motorAngle"), fmu.get("jointAngle")]))
            if k + 1 < len(time):
                fmu.set("jointTorque", torque[k])
                fmu.fmu.doStep(t, time[k + 1] - t)
                stuck += sum(fmu.fmu.getBoolean([fmu.variables["sticking"].valueReference], nValues=6))
    expected = np.hstack([vector(true, "motorAngle"), vector(true, "jointAngle")])
    off = np.abs(np.array(angles) - expected).max(axis=1)
    moved = np.ptp(expected, axis=0).max()
    compared = off[time <= until].max()
    print(f"{key['drive']}, to {min(until, time[-1]):.1f} s: angles within {compared:.1e} rad of {moved:.2f} rad ({compared / moved:.1e}), {off.max():.1e} rad in all; {stuck} samples of a joint stuck")
    assert stuck > 0 and compared < limit * moved
    # What is recorded is that with the noise that the case declares.
    for j in range(1, 7):
        noise = declared["channels"][f"jointTorque[{j}]"]["noise"]
        assert np.std(read[f"jointTorque[{j}]"] - torque[:, j - 1]) == pytest.approx(noise, rel=0.1)
        sensor = declared["channels"][f"motorAngle[{j}]"]
        error = read[f"motorAngle[{j}]"] - expected[:, j - 1]
        assert np.nanstd(error) == pytest.approx(np.hypot(sensor["noise"], sensor["resolution"] / 12**0.5), rel=0.1)
