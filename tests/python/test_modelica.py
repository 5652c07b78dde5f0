"""The Modelica package as it is written: it parses, and names, units, bounds and defaults are those of the FMUs."""

import zipfile

import modelica
import numpy as np
import pytest
from modelica_cases import ARM_EFFECTS, EFFECTS, SENSORS, arm_with, block, described, of_sensor, own_of_effect, pack, packed


@pytest.fixture(scope="module")
def tree():
    pytest.importorskip("pymoca", reason="not installed: see tools/python/requirements.txt")
    return modelica.parsed()


def own(symbols):
    """Constants, parameters, inputs and outputs of a flattened class by name; not those of its components."""
    kinds = ("constant", "parameter", "input", "output")
    return {
        s.name: (kind, s)
        for s in symbols.values()
        for kind in kinds
        if kind in s.prefixes and "." not in s.name and s.visibility.name != "PROTECTED"
    }


def default(name, have):
    """What a parameter begins with: numbers, or the name of an item; another parameter's where it is bound to that."""
    value = modelica.literal(have[name][1].value)
    if isinstance(value, str):
        return default(value, have) if value in have else value
    return np.array(value, dtype=float).ravel().tolist()


def complaints(have, want):
    """What differs of (kind, symbol) by name from the variables of an FMU."""
    for name, (kind, symbol) in have.items():
        v = want.get(name)
        if v is None:
            yield f"{name}: the FMU has no such variable"
            continue
        # What is fixed when packed may be a parameter in Modelica.
        if v.variability != "constant" and v.causality != kind:
            yield f"{name}: {kind}, in the FMU {v.causality}"
        if (modelica.literal(symbol.unit) or None) != (v.unit or None):
            yield f"{name}: unit {modelica.literal(symbol.unit)}, in the FMU {v.unit}"
        for bound in ("min", "max"):
            here, there = modelica.literal(getattr(symbol, bound)), getattr(v, bound)
            if here != (None if there is None else float(there)):
                yield f"{name}: {bound} {here}, in the FMU {there}"
        if kind in ("constant", "parameter"):
            if v.declaredType and v.declaredType.items:
                start = v.declaredType.items[int(v.start) - 1].name
            else:
                start = [float({"true": 1, "false": 0}.get(s, s)) for s in v.start.split()]
            if default(name, have) != start:
                yield f"{name}: default {default(name, have)}, in the FMU {start}"
    for name in want.keys() - have.keys():
        yield f"{name}: not in the Modelica class"


def test_package_order_names_what_there_is():
    for file in (f for f in modelica.files() if f.name == "package.mo"):
        listed = (file.parent / "package.order").read_text().split()
        there = {f.stem for f in file.parent.iterdir() if f.suffix == ".mo" or f.is_dir()} - {"package"}
        assert sorted(listed) == sorted(there), file.parent


@pytest.mark.full
@pytest.mark.parametrize("file", [f for f in modelica.files() if f.name != "package.mo"], ids=modelica.class_of)
def test_every_class_flattens(tree, file):
    """By pymoca; a type has no equations, all others have what their text has."""
    flat = modelica.flattened(tree, modelica.class_of(file))
    kind = file.read_text().splitlines()[1].split()[0]
    assert kind == "type" or flat.symbols


# What differs from the FMU, and has to.
KNOWN = {
    "JointController": ["samplePeriod: constant, in the FMU parameter", "samplePeriod: min None, in the FMU 0.0"],
    "JointControllerSampled": ["samplePeriod: default [0.001], in the FMU [0.0]"],
}


@pytest.mark.parametrize("model", ["TwoMassJoint", "PlanarManipulator", "JointController", "JointControllerSampled"])
def test_names_units_bounds_and_defaults_are_those_of_the_fmu(tree, model):
    flat = modelica.flattened(tree, f"Trueup.{model}")
    fmu = model.removesuffix("Sampled")
    assert sorted(complaints(own(flat.symbols), described(fmu))) == sorted(KNOWN.get(model, []))


def test_rigid_joint_has_the_names_of_the_fmu(tree, tmp_path):
    (fmu,) = pack(tmp_path, "TwoMassJoint", "--fmi", "3", "--flexible", "false")
    flat = modelica.flattened(tree, "Trueup.TwoMassJointRigid")
    assert list(complaints(own(flat.symbols), described(fmu))) == []


def test_a_wrong_name_unit_bound_or_default_is_found(tree):
    """The check itself: four mistakes, each in the complaints."""
    have = own(modelica.flattened(tree, "Trueup.TwoMassJoint").symbols)
    want = described("TwoMassJoint")
    want["damping"].start, want["stiffness"].unit, want["gearRatio"].min = "8.08e-8", "N.m", "1.0"
    want["motorTorque2"] = want.pop("motorTorque")
    found = sorted(c.split(":")[0] for c in complaints(have, want))
    assert found == ["damping", "gearRatio", "motorTorque", "motorTorque2", "stiffness"]


@pytest.mark.parametrize("effect", EFFECTS)
def test_parameters_of_effects_are_those_of_the_fmu(tree, effect):
    have = {n: s for n, s in own(modelica.flattened(tree, block(effect)).symbols).items() if s[0] == "parameter"}
    all_of_it = described(f"TwoMassJoint+{effect}")
    assert list(complaints(have, {n: all_of_it[n] for n in own_of_effect(effect)})) == []


@pytest.mark.parametrize("effect", SENSORS)
def test_parameters_of_sensors_are_those_of_the_fmu(tree, effect):
    flat = modelica.flattened(tree, f"Trueup.Effects.Sensor.{SENSORS[effect][0]}")
    have = {n: s for n, s in own(flat.symbols).items() if s[0] == "parameter"}
    all_of_it = described(f"TwoMassJoint+{effect}")
    assert list(complaints(have, {of_sensor(n): all_of_it[n] for n in own_of_effect(effect)})) == []


@pytest.mark.full
@pytest.mark.parametrize("effect", ARM_EFFECTS)
def test_parameters_of_arm_effects_are_those_of_the_fmu(tree, effect, tmp_path):
    symbols = own(modelica.flattened(tree, f"Trueup.Effects.{ARM_EFFECTS[effect][1]}").symbols)
    have = {n: s for n, s in symbols.items() if s[0] == "parameter"}
    assert list(complaints(have, arm_with(effect, tmp_path)[1])) == []


CLASSES = {"TwoMassJoint": "TwoMassJoint", "PlanarManipulator": "PlanarManipulator", "JointController": "JointController",
           "ManipulatorController": "JointController"}  # fmt: skip


@pytest.mark.parametrize("model", CLASSES)
def test_an_fmu_has_its_equations_as_modelica(tree, model):
    """In one file, with all that the class needs."""
    with zipfile.ZipFile(packed(model)) as archive:
        text = archive.read("documentation/Trueup.mo").decode()
    name = f"Trueup.{CLASSES[model]}"
    alone, whole = (modelica.flattened(t, name) for t in (modelica.parsed(text), tree))
    assert list(alone.symbols) == list(whole.symbols)
    assert len(alone.equations) == len(whole.equations)
