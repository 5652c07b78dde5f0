"""What of the Modelica package is compared with which FMU: classes, effects, where they act."""

import os
import subprocess
from pathlib import Path

from fmpy import read_model_description

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))


def packed(fmu, version=3):
    file = FMUS / ("effects" if "+" in fmu else "") / f"{fmu}.fmi{version}.fmu"
    assert file.is_file(), f"{file} is missing: run ./test, which packs it"
    return file


def pack(folder, model, *options):
    """Files of a model packed by the program with these options."""
    command = [os.environ["TRUEUP_BIN"], "fmu", "pack", model, "-o", folder, *options]
    subprocess.run(command, check=True, capture_output=True)
    return sorted(Path(folder).glob("*.fmu"))


def described(fmu):
    """Parameters, inputs and outputs of an FMU (its name, or a file) by name, and what was fixed when it was packed."""
    variables = read_model_description(fmu if isinstance(fmu, Path) else packed(fmu)).modelVariables
    return {v.name: v for v in variables if v.causality in ("parameter", "input", "output") or v.variability == "constant"}


def own_parameters(model):
    return {n: v.start for n, v in described(model).items() if v.causality == "parameter"}


# Effects of the joint: id, place, block, the effect's states in both, what is set in addition to the defaults.
EFFECTS = {
    "current-saturation": ("actuator", "Saturation", [], {}),
    "actuator-lag": ("actuator", "Lag", ["laggedTorque"], {"actuatorDelay": 0.008}),
    "torque-ripple": ("actuator", "Ripple", [], {"rippleOrder": 0.5, "rippleCosine": 1e-5, "rippleSine2": 1e-5}),
    "kinematic-error": ("gear", "KinematicError", [], {"kinematicErrorOrder": 0.05, "kinematicErrorCosine2": 0.2}),
    "backlash": ("spring", "Backlash", [], {}),
    "nonlinear-stiffness": ("spring", "NonlinearStiffness", [], {"kneeStiffness": 1e-5, "kneeDeflection": 2.0}),
    "transmission-hysteresis": ("spring", "Hysteresis", ["hysteresis"], {}),
    "nonlinear-damping": ("spring", "NonlinearDamping", [], {}),
    "stribeck-friction": ("friction", "Stribeck", [], {}),
    "asymmetric-friction": ("friction", "Asymmetric", [], {"viscousAsymmetry": 2e-8}),
    "load-dependent-friction": ("friction", "LoadDependent", [], {}),
    "nonlinear-viscous-friction": ("friction", "NonlinearViscous", [], {}),
    "friction-drift": ("friction", "Drift", [], {}),
    "presliding-friction": ("friction", "Presliding", ["bristle"], {"preslidingShare": 0.4}),
    "gravity-torque": ("load", "Gravity", [], {}),
    "cable-stiffness": ("load", "Cable", [], {"cableAngle": 0.05}),
    "load-friction": ("load", "BearingFriction", ["loadBristle"], {"loadViscousFriction": 3.0}),
    "flexible-link": ("load", "FlexibleLink", ["tipAngle", "tipVelocity"], {}),
    "external-force": ("load", "Push", [], {"loadPushSecondTorque": -3.0, "loadPushSecondStart": 0.83}),
}
FOLDERS = {"friction": "MotorFriction"}


def block(effect):
    """Whole name of an effect's block."""
    place, name, _, _ = EFFECTS[effect]
    return f"Trueup.Effects.{FOLDERS.get(place, place.capitalize())}.{name}"


def own_of_effect(effect):
    """Start values of the parameters that the FMU has with the effect and not without."""
    plain = own_parameters("TwoMassJoint")
    return {n: v for n, v in own_parameters(f"TwoMassJoint+{effect}").items() if n not in plain}


SENSORS = {
    # The order is at its least, 1: values about 2 are all allowed.
    "sensor-eccentricity": ("Eccentricity", {"motorAngleEccentricityCosine": 0.02, "motorAngleEccentricityOrder": 2.0}),
    "sensor-drift": ("Drift", {"motorAngleDriftStart": 0.4, "motorAngleDriftTime": 0.5}),
    "sensor-delay": ("Delay", {}),
}


def of_sensor(name):
    """A parameter's name in the block: without that of the channel."""
    short = name.removeprefix("motorAngle")
    return short[0].lower() + short[1:]


# Effects of the arm that occur once: id with its place, place in Modelica, block, states.
ARM_EFFECTS = {
    "base-drag": ("onBase", "Base.Drag", []),
    "base-thrust": ("onBase", "Base.Thrust", []),
    "cable-stiffness": ("onBase", "Base.Cable", []),
    "table-tilt": ("onBase", "Base.TableTilt", []),
    "appendage-mode": ("onBase", "Base.Appendage", ["appendageAngle", "appendageRate"]),
    "external-force:base": ("onBase", "Base.Push", []),
    "external-force:tip": ("onTip", "Tip.Push", []),
}


def arm_with(effect, folder):
    """The arm's FMU of version 2 with that effect, and the parameters that the effect brings."""
    second, third = pack(folder, "PlanarManipulator", "--effect", effect)
    plain = described("PlanarManipulator")
    return second, {n: v for n, v in described(third).items() if v.causality == "parameter" and n not in plain}
