"""An arm on the ground with a load that is not balanced: declared known, not known, and on a base that floats.

The arm is simulated here by its own few lines: two links in the plane, rigid joints, a controller in the loop.
"""

import functools
import json
import os
import subprocess

import numpy as np
import pytest

# Of each link: kg, kg.m2 about the centre, m to the centre, m to the next joint.
MASS, INERTIA, CENTER, LENGTH = (60.0, 40.0), (3.0, 1.5), (0.3, 0.28), (0.6, 0.5)
# The arm hangs, a little to the side.
ATTITUDE, STEP, FINE, NOISE = -1.4, 8e-3, 16, 2e-5


def program():
    found = os.environ.get("TRUEUP_BIN")
    if not found:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return found


def run(*command):
    return subprocess.run([program(), *map(str, command)], capture_output=True, text=True)


def rates(x, torque, gravity):
    """Of angles and speeds; `gravity` pulls at link 2, which hangs at rest at an attitude of -90 degrees."""
    (q1, q2, v1, v2), (m1, m2), (c1, c2), l1 = x, MASS, CENTER, LENGTH[0]
    across = m2 * l1 * c2
    far = INERTIA[1] + m2 * c2**2
    m11 = INERTIA[0] + m1 * c1**2 + m2 * l1**2 + far + 2 * across * np.cos(q2)
    m12 = far + across * np.cos(q2)
    whirl = across * np.sin(q2)
    pull = -gravity * np.sin(ATTITUDE + q1 + q2 + np.pi / 2)
    f1 = torque[0] + whirl * (2 * v1 * v2 + v2**2) + pull
    f2 = torque[1] - whirl * v1**2 + pull
    det = m11 * far - m12**2
    return np.array([v1, v2, (far * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det])


@functools.cache
def recorded(seed, gravity, seconds=5.0):
    """Held torques and angles as they are read."""
    random = np.random.default_rng(seed)
    tones = random.uniform(0.15, 0.9, (2, 3))
    x = np.zeros(4)
    rows = []
    for k in range(round(seconds / STEP)):
        t = k * STEP
        wanted = np.array([0.4, 0.5]) * np.sin(2 * np.pi * tones * t).mean(axis=1)
        torque = np.array([6000.0, 1500.0]) * (wanted - x[:2]) - np.array([600.0, 150.0]) * x[2:]
        rows.append((t, *torque, *(x[:2] + random.normal(0, NOISE, 2))))
        h = STEP / FINE
        for _ in range(FINE):
            a = rates(x, torque, gravity)
            b = rates(x + h / 2 * a, torque, gravity)
            c = rates(x + h / 2 * b, torque, gravity)
            d = rates(x + h * c, torque, gravity)
            x = x + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(rows)


HEAD = 'time,"jointTorque[1]","jointTorque[2]","jointAngle[1]","jointAngle[2]"'
CASE = f"""model = "PlanarManipulator"
train = ["a.csv", "b.csv"]
holdout = ["c.csv"]
[parameters]
base = "fixed"
jointFlexible = [false, false]
initialBaseAttitude = {ATTITUDE}
linkMass = {list(MASS)}
linkInertia = {list(INERTIA)}
linkLength = {list(LENGTH)}
linkCenterOfMass = {[[c, 0.0] for c in CENTER]}
motorInertia = [0.0, 0.0]
gearRatio = [100.0, 100.0]
[channels.jointAngle]
noise = {NOISE}
[channels.jointTorque]
interpolation = "hold"
"""
# As the contract has it: the angle is left out.
KNOWN = "[effects]\ngravity-torque = { gravityTorque = 100.0, doubt = 0.1, joint = 2 }\n"


def case(folder, gravity, more="", text=CASE):
    folder.mkdir()
    (folder / "case.toml").write_text(text + more)
    for k, name in enumerate("abc"):
        np.savetxt(folder / f"{name}.csv", recorded(30 + k, gravity), delimiter=",", header=HEAD, comments="", fmt="%.10g")
    return folder


def diagnosed(folder, out):
    done = run("diagnose", folder, "-o", out, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def right(told):
    low, high = told["ci95"]
    assert low < 110.0 < high and high - low < 2.0, told


def test_a_gravity_torque_that_is_known_is_refitted(full, tmp_path):
    folder = case(tmp_path / "known", 110.0, KNOWN)
    done = run("identify", folder, "--fast", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    told = found["uncertain"]["gravityTorque[2]"]
    print(told)
    right(told)
    assert told["nominal"] == 100.0 and all(f["nrmse"] < 1e-3 for f in found["fit"].values()), found["fit"]
    if full:
        found = diagnosed(folder, tmp_path / "out")
        print(found["verdict"], found["parameters"]["gravityTorque[2]"], found["gap"]["overall"])
        assert found["verdict"] == "parameters" and not found["effects"], found["verdict"]
        right(found["parameters"]["gravityTorque[2]"])
        assert not any(c["id"] == "gravity-torque" and c.get("joint") == 2 for c in found["candidates"])


@pytest.mark.full
def test_a_gravity_torque_that_is_not_known_is_found_at_its_joint(tmp_path):
    found = diagnosed(case(tmp_path / "unknown", 110.0), tmp_path / "out")
    named = [(e["id"], e.get("joint"), e["component"]) for e in found["effects"]]
    print(found["verdict"], named, found["gap"]["overall"])
    assert found["verdict"] in ("effects", "ambiguous") and ("gravity-torque", 2, "load") in named
    (name,) = [n for n in found["augmented"] if "fmi3" in n]
    info = run("fmu", "info", tmp_path / "out" / name).stdout
    assert "gravityTorque" in info and "base = fixed" in info, info


REFUSED = ["requires a fixed base", 'base = "fixed"']


def test_a_base_that_floats_refuses_it_with_the_mend(tmp_path):
    floats = CASE.replace('base = "fixed"\n', "")
    known = case(tmp_path / "known", 0.0, KNOWN, floats)
    plain = case(tmp_path / "plain", 0.0, "", floats)
    asked = case(tmp_path / "asked", 0.0, '[fit]\neffects = ["gravity-torque"]\n', floats)
    for command in (
        ["identify", known], ["diagnose", known, "-o", tmp_path / "out"],
        ["identify", plain, "--with", "gravity-torque"], ["identify", asked],
    ):
        done = run(*command)
        assert done.returncode == 1 and all(s in done.stderr for s in REFUSED), (command, done.stderr)
        assert done.stderr.count("error:") == 1 and "case.toml" in done.stderr, done.stderr
    done = run("fmu", "pack", "PlanarManipulator", "--effect", "gravity-torque", "-o", tmp_path)
    assert done.returncode == 2 and "--structure base=fixed" in done.stderr, done.stderr
