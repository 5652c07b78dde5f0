"""FlexibleArm through FMPy: energy, both kinds of interface, what may be chosen."""

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

# n K_t of each motor, N.m/A.
DRIVE = 0.02 * np.array([44340, 21750, 25000, 25000, 25000, 25000])


def packed(trueup, folder, *more):
    done = trueup("fmu", "pack", "FlexibleArm", "--fmi", 3, "-o", folder, *more)
    assert done.returncode == 0, done.stderr
    return folder / "FlexibleArm.fmi3.fmu"


def test_an_arm_in_a_fall_keeps_its_energy(trueup, tmp_path):
    """Model Exchange by CVode: no friction, no dampers, motors that weigh little; outputs are closer than 500 of its steps."""
    path = packed(
        trueup, tmp_path, "--set", "coulombFriction=0,0,0,0,0,0", "--set", "staticFriction=0,0,0,0,0,0",
        "--set", "viscousFriction=0,0,0,0,0,0", "--set", "jointDamping=0,0,0,0,0,0", "--set", "linkDampingRatio=0,0",
        "--set", "motorInertia=0.05,0.05,0.05,0.05,0.05,0.05",
        "--set", "initialJointAngle=0,1.4,-1.4,0.4,0,0", "--set", "initialJointVelocity=1,0,0,0,0,0",
    )
    result = simulate_fmu(
        path, fmi_type="ModelExchange", stop_time=0.1, relative_tolerance=1e-9, output_interval=1e-4,
        output=["kineticEnergy", "potentialEnergy", "tipDeflection"],
    )
    energy = result["kineticEnergy"] + result["potentialEnergy"]
    off, motion = np.max(np.abs(energy - energy[0])), np.max(result["kineticEnergy"])
    print(f"{motion:.1f} J of motion, energy off by {off:.1e} J")
    assert motion > 2 and off < 1e-5 * motion


@pytest.mark.parametrize("version", (2, 3))
def test_both_kinds_agree_and_the_description_is_valid(fmu, version):
    """Currents that carry the weight, the shoulder driven away: Co-Simulation against Model Exchange by CVode."""
    path = fmu("FlexibleArm", version)
    assert not validate_fmu(str(path))
    current = np.array([0.03, 30.9 / DRIVE[1], 25.8 / DRIVE[2], 0, 5.4 / DRIVE[4], 0])
    names = ["motorCurrent"] if version == 3 else [f"motorCurrent[{i + 1}]" for i in range(6)]
    signal = np.zeros(2, dtype=[("time", float), *((n, float, (6,)) if version == 3 else (n, float) for n in names)])
    signal["time"] = [0, 1]
    for i, name in enumerate(names):
        signal[name] = current if version == 3 else current[i]
    output = ["jointAngle", "motorAngle", "tipPosition"] if version == 3 else ["jointAngle[2]", "motorAngle[1]", "tipPosition[1,3]"]
    runs = [
        simulate_fmu(
            path, fmi_type=kind, stop_time=0.1, output_interval=1e-3, input=signal, output=output, relative_tolerance=tolerance,
        )
        for kind, tolerance in (("ModelExchange", 1e-9), ("CoSimulation", 1e-8))
    ]
    off = max(np.max(np.abs(runs[0][n] - runs[1][n])) for n in output)
    moved = np.max(np.abs(runs[0][output[0]] - runs[0][output[0]][0]))
    print(f"FMI {version}: kinds apart by {off:.1e} rad or m, joints moved by {moved:.1e} rad")
    assert off < 1e-6 and moved > 1e-4


def test_steps_of_fixed_size_stay_close(fmu, trueup, tmp_path):
    """LNK-10: steps of 1 ms, whatever tolerance is asked for, against those that the tolerance wants; the shoulder breaks away."""
    drive = np.array([(0.0, [0.03, 30.9 / DRIVE[1], 25.8 / DRIVE[2], 0, 0, 0])], dtype=[("time", float), ("motorCurrent", float, (6,))])
    fixed = packed(trueup, tmp_path, "--structure", "solver=fixed")
    tips = [
        simulate_fmu(
            path, fmi_type="CoSimulation", stop_time=0.1, output_interval=1e-3, input=drive, output=["tipPosition", "sticking"],
            relative_tolerance=1e-8,
        )
        for path in (fmu("FlexibleArm", 3), fixed)
    ]
    off = np.max(np.abs(tips[0]["tipPosition"] - tips[1]["tipPosition"]))
    moved = np.max(np.abs(tips[0]["tipPosition"] - tips[0]["tipPosition"][0]))
    print(f"tip off by {off:.1e} m of {moved:.1e} m")
    assert moved > 1e-3 and 0 < off < 3e-5
    assert np.array_equal(tips[0]["sticking"], tips[1]["sticking"]) and not tips[0]["sticking"][-1].all()


def test_what_is_packed_is_told(trueup, tmp_path):
    path = packed(trueup, tmp_path, "--structure", "drive=torque", "--structure", "links=rigid", "--structure", "axialStiffening=on")
    names = {v.name for v in read_model_description(path).modelVariables}
    assert {"jointTorque", "sticking", "tipDeflection", "transmissionTorque", "gravity"} <= names
    assert not names & {"motorCurrent", "torqueConstant", "youngsModulus", "linkModalCoordinate"}
    wrong = trueup("fmu", "pack", "FlexibleArm", "--structure", "linkShapes=9", "-o", tmp_path)
    assert wrong.returncode == 2 and "1 to 5" in wrong.stderr
    wrong = trueup("fmu", "pack", "FlexibleArm", "--set", "youngsModulus=0,1", "-o", tmp_path)
    assert wrong.returncode != 0 and "youngsModulus[1]" in wrong.stderr
