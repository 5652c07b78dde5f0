"""What the whole is for, in small: plant and controller, two FMUs, are co-simulated by the master; from the recorded
angles and currents alone, least squares give back the plant's stiffness, damping and friction."""

import numpy as np
import pyarrow.parquet
import pytest
from fmpy.util import read_csv

H = 1e-3
# Joint 1 of the DELIAN arm, motor side, in the order of the columns of the regression.
TRUTH = {"stiffness": 3.07e-5, "damping": 8.07e-8, "coulombFriction": 7.37e-5, "viscousFriction": 7.2e-8}
KNOWN = {"motorInertia": 1.2e-7, "gearRatio": 44340.0, "torqueConstant": 0.02}
# Velocities of the load in rad/s, half a second each: friction needs both directions and several speeds, the damping
# needs the vibration that the steps excite.
VELOCITIES = (0.004, 0.016, -0.008, 0.012, -0.018, 0.006, -0.012, 0.009, -0.005, -0.016)
RECORD = ("controller.motorCurrent", "plant.motorAngle", "plant.loadAngle")

SYSTEM = """
connections = [
    "controller.motorCurrent -> plant.motorCurrent",
    "plant.motorAngle -> controller.motorAngle",
    "plant.motorVelocity -> controller.motorVelocity",
    "plant.loadAngle -> controller.loadAngle",
    "plant.loadVelocity -> controller.loadVelocity",
]
record = [{record}]
inputs = "drive.csv"

[run]
stop = {stop}
step = {step}
tolerance = 1e-10
algorithm = "jacobi"

[components.plant]
fmu = '{plant}'

[components.plant.start]
{parameters}

[components.controller]
fmu = '{controller}'
start = {{ samplePeriod = {step}, positionGain = 0.0 }}
"""


def identify(time, current, motor, load):
    """K_eq, D_eq, tau_c, D_m of J_m q'' = K_t I - K (q - n p) - D (q' - n p') - tau_c sign(q') - D_m q'.

    The current is held between samples, so the second difference of the angle sees the mean of two neighbours. Only
    samples at which the motor moves without turning round count.
    """
    n, steps = KNOWN["gearRatio"], np.diff(motor) / H
    acceleration = np.diff(steps) / H
    velocity = (motor[2:] - motor[:-2]) / (2 * H)
    twist_rate = velocity - n * (load[2:] - load[:-2]) / (2 * H)
    twist = (motor - n * load)[1:-1]
    applied = KNOWN["torqueConstant"] * (current[1:-1] + current[:-2]) / 2
    moving = (steps[1:] * steps[:-1] > 0) & (np.minimum(abs(steps[1:]), abs(steps[:-1])) > 20)
    columns = np.column_stack((twist, twist_rate, np.sign(velocity), velocity))[moving]
    scale = np.linalg.norm(columns, axis=0)
    right = (applied - KNOWN["motorInertia"] * acceleration)[moving]
    return np.linalg.lstsq(columns / scale, right, rcond=None)[0] / scale, moving.sum()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mission")
    rows = ["time,controller.velocityFeedforward"]
    for k, velocity in enumerate(VELOCITIES):
        rows += [f"{0.5 * k!r},{velocity!r}", f"{0.5 * k + 0.499!r},{velocity!r}"]
    (folder / "drive.csv").write_text("\n".join(rows) + "\n")
    return folder


@pytest.mark.parametrize("plant, controller, file", ((2, 2, "csv"), (3, 3, "parquet"), (2, 3, "parquet"), (3, 2, "csv")))
def test_least_squares_on_the_master_s_results_give_the_plant_s_parameters(
    trueup, fmu, folder, plant, controller, file
):
    system = folder / f"{plant}{controller}.toml"
    system.write_text(
        SYSTEM.format(
            record=", ".join(f'"{name}"' for name in RECORD),
            stop=0.5 * len(VELOCITIES),
            step=H,
            parameters="\n".join(f"{name} = {value!r}" for name, value in (TRUTH | KNOWN).items()),
            plant=fmu("TwoMassJoint", plant),
            controller=fmu("JointController", controller),
        )
    )
    results = folder / f"{plant}{controller}.{file}"
    done = trueup("simulate", system, "-o", results)
    assert done.returncode == 0, done.stderr
    table = read_csv(results) if file == "csv" else pyarrow.parquet.read_table(results)
    columns = [np.asarray(table[name], float) for name in ("time", *RECORD)]
    assert np.allclose(np.diff(columns[0]), H, rtol=0, atol=1e-12)

    found, samples = identify(*columns)
    errors = found / list(TRUTH.values()) - 1
    print(f"\nplant FMI {plant}, controller FMI {controller}, {file}, {samples} moving samples:")
    for (name, true), value, error in zip(TRUTH.items(), found, errors):
        print(f"  {name:16} {value:.6e}, true {true:.6e}, {100 * error:+.4f} %")
    assert samples > 4000
    assert np.all(abs(errors) < 0.002), errors
