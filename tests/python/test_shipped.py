"""What `trueup diagnose` ships for a joint with play in closed loop, 20 s long: the numbers of its page, and the true ones.

A free run of 20 s through stick and slip diverges even with the true parameters, by decisions to stick alone; windows do not.
The joint is simulated by lines of this file's own.
"""

import json
import math
import os
import random
import subprocess

import numpy as np
import pytest

from low_level import Opened
from test_diagnose import shipped_is_reported

pytestmark = pytest.mark.full

GEAR, LIMIT, STEP = 160.0, 1.2, 1e-4
COUNT = 2 * math.pi / 4096
TRUE = {
    "motorInertia": 8e-5, "loadInertia": 1.2, "torqueConstant": 0.11, "stiffness": 6000 / GEAR**2, "damping": 8 / GEAR**2,
    "coulombFriction": 0.03, "viscousFriction": 1.5e-4,
}
STICKS, PLAY = 0.034, 0.64  # N.m, rad at the motor
SINES = {
    "train-1.csv": [(0.15, 0.2, 0.0), (0.6, 0.06, 1.0), (1.7, 0.015, 2.0)],
    "train-2.csv": [(0.3, 0.12, 0.2), (0.9, 0.05, 0.7), (1.3, 0.02, 1.6)],
    "holdout.csv": [(0.22, 0.15, 0.5), (0.45, 0.08, 0.0), (2.3, 0.01, 1.0)],
}
CASE = """model = "TwoMassJoint"
train = ["train-1.csv", "train-2.csv"]
holdout = ["holdout.csv"]
[parameters]
gearRatio = 160
motorInertia = 8e-5
loadInertia = 1.2
torqueConstant = 0.11
stiffness = 0.27
damping = 2e-4
coulombFriction = 0.025
staticFriction = 0.025
viscousFriction = 1e-4
[uncertain]
stiffness = 0.2
damping = 0.5
coulombFriction = 0.3
staticFriction = 0.3
viscousFriction = 0.5
[channels.motorAngle]
resolution = 0.00153398
[channels.loadAngle]
resolution = 1.745e-5
noise = 1e-5
[channels.motorCurrent]
noise = 0.004
interpolation = "hold"
"""


def recorded(sines, seed, seconds=20):
    """A position loop on the motor's counts, current held for 1 ms; also the true states at every reading."""
    chance = random.Random(seed)
    q = w = l = v = current = gathered = slow = 0.0
    before, rows, states = None, [], []
    for i in range(round(seconds / STEP) + 1):
        t = i * STEP
        if i % 10 == 0:
            counts = math.floor(q / COUNT + 0.5)
            seen = counts * COUNT / GEAR
            slow += 0.2 * ((seen - (seen if before is None else before)) / 1e-3 - slow)
            before = seen
            wanted = sum(a * (math.sin(2 * math.pi * f * t + p) - math.sin(p)) for f, a, p in sines)
            rate = sum(2 * math.pi * f * a * math.cos(2 * math.pi * f * t + p) for f, a, p in sines)
            error = rate + 8 * (wanted - seen) - slow
            gathered += error * 1e-3
            current = max(-LIMIT, min(LIMIT, (180 * error + 900 * gathered) / GEAR / TRUE["torqueConstant"]))
            load = math.radians(round(math.degrees(l) + chance.gauss(0, 6e-4), 3))
            rows.append((round(t, 3), current + chance.gauss(0, 0.004), counts * COUNT, load))
            states.append((q, w, l, v))
        twist = q - GEAR * l
        bent = twist - max(-PLAY / 2, min(PLAY / 2, twist))
        spring = TRUE["stiffness"] * bent + (TRUE["damping"] * (w - GEAR * v) if bent else 0.0)
        drive = TRUE["torqueConstant"] * current - spring
        if abs(w) < 1e-3 and abs(drive) < STICKS:
            w = 0.0
        else:
            side = math.copysign(1, w) if abs(w) > 1e-9 else math.copysign(1, drive)
            slides = TRUE["coulombFriction"] * side + TRUE["viscousFriction"] * w
            new = w + STEP * (drive - slides) / TRUE["motorInertia"]
            w = 0.0 if w * new < 0 and abs(drive) < STICKS else new
        v += STEP * GEAR * spring / TRUE["loadInertia"]
        q, l = q + STEP * w, l + STEP * v
    return rows, np.array(states)


def test_the_model_that_is_shipped_is_the_one_on_the_page(tmp_path):
    program = os.environ.get("TRUEUP_BIN")
    if not program:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    case, out = tmp_path / "case", tmp_path / "out"
    case.mkdir()
    for seed, (name, sines) in enumerate(SINES.items()):
        rows, states = recorded(sines, seed)
        text = "\n".join(",".join(f"{x!r}" for x in row) for row in rows)
        (case / name).write_text(f"time,motorCurrent,motorAngle,loadAngle\n{text}\n")
    (case / "case.toml").write_text(CASE)
    done = subprocess.run([program, "diagnose", case, "-o", out, "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert [e["id"] for e in said["effects"]] == ["backlash"], said["verdict"]
    shipped_is_reported(out, said)
    for name, true in TRUE.items():
        assert said["parameters"][name]["value"] == pytest.approx(true, rel=0.05), name
    window = said["gap"]["overall"]["window"]
    print(window)
    assert window["after"] < 2 * window["floor"] and window["after"] < 0.1 * window["tuned"]
    # The FMU as delivered, through windows of 200 ms from true states of the recording held out (the last one made).
    rows = np.array(rows)
    twist = states[:, 0] / GEAR - states[:, 2]
    wrong = []
    with Opened(out / said["augmented"][0], "CS", tolerance=1e-8) as opened:
        opened.initialize()
        for begin in range(1000, 19000, 900):
            names = ("initialMotorAngle", "initialMotorVelocity", "initialLoadAngle", "initialLoadVelocity")
            opened.fmu.reset()
            opened.initialize(dict(zip(names, map(float, states[begin]))), 1.0)
            for k in range(200):
                opened.set("motorCurrent", float(rows[begin + k, 1]))
                opened.fmu.doStep(currentCommunicationPoint=k * 1e-3, communicationStepSize=1e-3)
                shown = opened.get("motorAngle") / GEAR - opened.get("loadAngle")
                wrong.append(shown - twist[begin + k + 1])
    left = np.sqrt(np.mean(np.square(wrong))) / np.sqrt(np.mean(twist**2))
    print(f"twist over windows of 200 ms from true states: {left:.4f} of itself")
    assert left < 0.05
