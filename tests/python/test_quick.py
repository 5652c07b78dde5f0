"""Motions above 3 Hz behind coarse encoders: accelerations have no information there, free runs over stretches of a second do. And friction that goes
on changing from one recording to the next.

The joints are simulated here by their own few lines.
"""

import csv
import math

import numpy as np
import pytest
from fmpy import read_model_description

MOTOR, LOAD, STIFFNESS, DAMPING, FRICTION, VISCOUS = 0.02, 0.05, 200.0, 0.1, 0.10, 0.02
COUNT = 2 * math.pi / 4096
RATE, FINE = 500, 20


def quick(seed, constant=1.0, gravity=0.0, cable=0.0, seconds=8.0):
    """Time, current, angles of motor and load in counts: sines of 3 to 8 Hz, the load on its spring, dry friction at the motor."""
    random = np.random.default_rng(seed)
    tones, phases = random.uniform(3, 8, 5), random.uniform(0, 2 * np.pi, 5)
    size = 2.0 * random.uniform(0.6, 1.2) * 1.4 / math.sqrt(5)
    motor = load = motor_speed = load_speed = 0.0
    h, rows = 1 / RATE / FINE, []
    for k in range(int(seconds * RATE)):
        # Held in the middle by a weak spring, so that friction does not let it wander.
        current = size * float(np.sin(2 * np.pi * tones * k / RATE + phases).sum()) - 0.3 * motor
        rows.append((k / RATE, current, COUNT * round(motor / COUNT), COUNT * round(load / COUNT)))
        for _ in range(FINE):
            spring = STIFFNESS * (motor - load) + DAMPING * (motor_speed - load_speed)
            drive = constant * current - spring - VISCOUS * motor_speed
            if motor_speed != 0.0 or abs(drive) > FRICTION:
                sign = math.copysign(1.0, motor_speed or drive)
                after = motor_speed + h / MOTOR * (drive - FRICTION * sign)
                # Friction stops it and does not turn it round.
                motor_speed = 0.0 if motor_speed * after < 0 else after
            load_speed += h / LOAD * (spring - gravity * math.sin(load) - cable * load)
            motor += h * motor_speed
            load += h * load_speed
    return np.array(rows)


QUICK = f"""model = "TwoMassJoint"
train = ["a.csv", "b.csv", "c.csv"]
holdout = ["d.csv"]
[parameters]
gearRatio = 1.0
torqueConstant = 1.0
motorInertia = {MOTOR}
loadInertia = {LOAD}
stiffness = {STIFFNESS}
damping = {DAMPING}
coulombFriction = {FRICTION}
staticFriction = {FRICTION}
viscousFriction = {VISCOUS}
[uncertain]
torqueConstant = 0.1
loadInertia = 0.1
stiffness = 0.05
damping = 0.3
coulombFriction = 0.1
staticFriction = 0.1
viscousFriction = 0.2
[channels.motorAngle]
resolution = {COUNT}
[channels.loadAngle]
resolution = {COUNT}
[channels.motorCurrent]
interpolation = "hold"
"""


def write_quick(folder, seed, **truth):
    for k, name in enumerate("abcd"):
        header = "time,motorCurrent,motorAngle,loadAngle"
        np.savetxt(folder / f"{name}.csv", quick(7 * k + seed, **truth), delimiter=",", header=header, comments="", fmt="%.9g")
    (folder / "case.toml").write_text(QUICK)


@pytest.mark.full
def test_gravity_in_quick_motions(diagnosed, tmp_path):
    write_quick(tmp_path, 1310, gravity=1.0)
    said = diagnosed(tmp_path, "--verdict-only")
    assert "gravity-torque" in [e["id"] for e in said["effects"]]
    size = next(e for e in said["effects"] if e["id"] == "gravity-torque")["parameters"]["gravityTorque"]["value"]
    assert abs(size - 1.0) < 0.05


@pytest.mark.full
def test_in_a_small_motion_a_cable_and_gravity_are_alike(diagnosed, tmp_path):
    write_quick(tmp_path, 1067, cable=3.0)
    said = diagnosed(tmp_path, "--verdict-only")
    assert said["verdict"] == "ambiguous" and {"cable-stiffness", "gravity-torque"} == {e["id"] for e in said["effects"]}


@pytest.mark.full
def test_a_torque_constant_in_quick_motions(diagnosed, tmp_path):
    write_quick(tmp_path, 1428, constant=0.85)
    said = diagnosed(tmp_path, "--verdict-only")
    assert said["verdict"] == "parameters"
    assert abs(said["parameters"]["torqueConstant"]["value"] / 0.85 - 1) < 0.05


INERTIA, NOISE, STEP = 0.02, 2e-4, 0.01


def session(seed, begin, rate, seconds=8.0):
    """Time, current, angle of a rigid joint whose friction grows by `rate` a second, and has done so for `begin` seconds."""
    random = np.random.default_rng(seed)
    tones, phases = random.uniform(0.2, 1.5, 4), random.uniform(0, 2 * np.pi, 4)
    angle = speed = 0.0
    h, rows = STEP / 100, []
    for k in range(round(seconds / STEP)):
        t = k * STEP
        current = 0.3 * np.sin(2 * np.pi * tones * t + phases).sum() - 0.3 * angle
        rows.append((t, current, angle + random.normal(0, NOISE)))
        grown = 1 + rate * (begin + t)
        friction = 0.1 * grown
        for _ in range(100):
            torque = current - VISCOUS * grown * speed
            if speed == 0.0 and abs(torque) <= friction:
                continue
            after = speed + h / INERTIA * (torque - friction * (np.sign(speed) or np.sign(torque)))
            speed = 0.0 if speed * after < 0 else after
            angle += h * speed
    return np.array(rows)


def test_friction_goes_on_changing_from_one_recording_to_the_next(diagnosed, tmp_path):
    rate, begins = 0.02, [0.0, 8.0, 16.0, 24.0]
    for seed, (name, begin) in enumerate(zip("abcd", begins)):
        rows = session(40 + seed, begin, rate)
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="", fmt="%.9g")
    (tmp_path / "case.toml").write_text(f"""model = "TwoMassJoint"
train = ["a.csv", "b.csv", "c.csv"]
holdout = ["d.csv"]
[parameters]
jointFlexible = false
gearRatio = 1.0
torqueConstant = 1.0
motorInertia = {INERTIA / 2}
loadInertia = {INERTIA / 2}
coulombFriction = 0.1
staticFriction = 0.1
viscousFriction = {VISCOUS}
[uncertain]
coulombFriction = 0.1
staticFriction = 0.1
[channels.motorCurrent]
interpolation = "hold"
[channels.motorAngle]
noise = {NOISE}
""")
    said = diagnosed(tmp_path)
    assert said["verdict"] == "effects" and [e["id"] for e in said["effects"]] == ["friction-drift"]
    with (tmp_path / "out" / "first-states.csv").open() as f:
        first = {r["variable"]: float(r["value"]) for r in csv.DictReader(f)}
    begun = first["initialFrictionDriftTime"]
    description = read_model_description(tmp_path / "out" / said["augmented"][0])
    start = {v.name: float(v.start) for v in description.modelVariables if v.causality == "parameter" and v.type == "Real"}
    assert start["initialFrictionDriftTime"] == begun, "the FMU begins where the recording held out begins"
    # When it began and how fast it went can be traded; how much it is while the recording held out runs cannot.
    grows, settles = start["frictionDriftRate"], start["frictionDriftTime"]
    level = start["coulombFriction"] * (1 + grows * settles * (1 - math.exp(-(4.0 + begun) / settles)))
    truth = 0.1 * (1 + rate * (begins[-1] + 4.0))
    print(f"friction in the middle of the recording held out: {level:.4f} N.m of {truth:.4f}, at the start {start['coulombFriction']:.4f}")
    assert abs(level / truth - 1) < 0.02
