"""A joint with a torque sensor in its drive train, whose gain and offset are not known.

The joint is simulated here by its own few lines: motor and load with a linear spring and damper between them.
"""

import json
import os
import subprocess

import numpy as np
import pytest

MOTOR, LOAD, GEAR, CONSTANT, STIFFNESS, DAMPING, VISCOUS = 3e-5, 0.6, 100.0, 0.06, 0.1, 4e-5, 6e-5
STEP, FINE = 4e-3, 8
NOISE = {"motorAngle": 2e-4, "loadAngle": 3e-6, "transmissionTorque": 2e-5}
TOO_LARGE, TOO_MUCH = 1.15, 2e-3


def program():
    found = os.environ.get("TRUEUP_BIN")
    if not found:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return found


def run(*command):
    return subprocess.run([program(), *map(str, command)], capture_output=True, text=True)


def spring(x):
    return STIFFNESS * (x[0] - GEAR * x[1]) + DAMPING * (x[2] - GEAR * x[3])


def rates(x, current):
    carried = spring(x)
    return np.array([x[2], x[3], (CONSTANT * current - carried - VISCOUS * x[2]) / MOTOR, GEAR * carried / LOAD])


def recorded(seed, seconds=6.0):
    random = np.random.default_rng(seed)
    tones, phases = random.uniform(0.4, 3.0, 3), random.uniform(0, 2 * np.pi, 3)
    x, rows, h = np.zeros(4), [], STEP / FINE
    for k in range(round(seconds / STEP)):
        t = k * STEP
        current = 0.25 * np.sin(2 * np.pi * tones * t + phases).sum()
        shown = np.array([x[0], x[1], TOO_LARGE * spring(x) + TOO_MUCH])
        rows.append((t, current, *(shown + random.normal(0, 1, 3) * list(NOISE.values()))))
        for _ in range(FINE):
            a = rates(x, current)
            b = rates(x + h / 2 * a, current)
            c = rates(x + h / 2 * b, current)
            d = rates(x + h * c, current)
            x = x + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(rows)


CASE = f"""model = "TwoMassJoint"
train = ["a.csv", "b.csv"]
holdout = ["c.csv"]
[parameters]
gearRatio = {GEAR}
torqueConstant = {CONSTANT}
motorInertia = {MOTOR}
loadInertia = {LOAD}
stiffness = {0.95 * STIFFNESS}
damping = {DAMPING}
coulombFriction = 0.0
staticFriction = 0.0
viscousFriction = {VISCOUS}
[uncertain]
stiffness = 0.1
damping = 0.2
viscousFriction = 0.1
[channels.motorCurrent]
interpolation = "hold"
""" + "".join(f"[channels.{name}]\nnoise = {noise}\n" for name, noise in NOISE.items())


def test_gain_and_offset_of_a_torque_sensor_are_found(full, tmp_path):
    folder = tmp_path / "joint"
    folder.mkdir()
    (folder / "case.toml").write_text(CASE + 'gain = "estimate"\noffset = "estimate"\n')
    for k, name in enumerate("abc"):
        header = "time,motorCurrent," + ",".join(NOISE)
        np.savetxt(folder / f"{name}.csv", recorded(40 + k), delimiter=",", header=header, comments="", fmt="%.10g")
    done = run("identify", folder, "--fast", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    gain = found["parameters"]["transmissionTorque.gain"]
    assert abs(gain["value"] - TOO_LARGE) < 4 * gain["standard_error"] < 0.01, gain
    for run_of in found["nuisance"].values():
        offset = run_of["transmissionTorque.offset"]
        assert abs(offset["value"] - TOO_MUCH) < 4 * offset["standard_error"] < 0.01 * TOO_MUCH, offset
    if full:
        done = run("diagnose", folder, "-o", tmp_path / "out", "--verdict-only", "--json")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        print(found["verdict"], found["parameters"]["transmissionTorque.gain"], found["gap"]["overall"])
        assert found["verdict"] == "parameters" and not found["effects"], found["verdict"]
        gain = found["parameters"]["transmissionTorque.gain"]
        assert gain["ci95"][0] < TOO_LARGE < gain["ci95"][1] < 1.02 * TOO_LARGE, gain
        offset = found["parameters"]["transmissionTorque.offset"]
        assert offset["ci95"][0] < TOO_MUCH < offset["ci95"][1] < 1.02 * TOO_MUCH and offset["unit"] == "N.m", offset
