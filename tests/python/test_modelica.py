"""The Modelica package against the FMUs: names, units and defaults; and run by a compiler of others, states and events."""

import os
import subprocess
from pathlib import Path

import modelica
import numpy as np
import pytest
from fmpy import read_model_description
from hybrid_run import Signal, run

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))
SETS = 20
# States and outputs relative to their largest magnitude, and times of events in s.
STATES, EVENTS = 1e-7, 1e-8


@pytest.fixture(scope="module")
def tree():
    pytest.importorskip("pymoca", reason="not installed: see tools/python/requirements-full.txt")
    return modelica.parsed()


@pytest.fixture(scope="module")
def rumoca():
    return pytest.importorskip("rumoca", reason="not installed: see tools/python/requirements-full.txt")


def packed(fmu, version=3):
    file = FMUS / ("effects" if "+" in fmu else "") / f"{fmu}.fmi{version}.fmu"
    assert file.is_file(), f"{file} is missing: run ./test, which packs it"
    return file


def described(fmu):
    """Parameters, inputs and outputs of an FMU (its name, or a file) by name, and what was fixed when it was packed."""
    variables = read_model_description(fmu if isinstance(fmu, Path) else packed(fmu)).modelVariables
    return {v.name: v for v in variables if v.causality in ("parameter", "input", "output") or v.variability == "constant"}


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
        if kind in ("constant", "parameter"):
            if v.declaredType and v.declaredType.items:
                start = v.declaredType.items[int(v.start) - 1].name
            else:
                start = [float({"true": 1, "false": 0}.get(s, s)) for s in v.start.split()]
            if default(name, have) != start:
                yield f"{name}: default {default(name, have)}, in the FMU {start}"
    for name in want.keys() - have.keys():
        yield f"{name}: not in the Modelica class"


def test_every_class_parses_and_flattens(tree):
    """By pymoca, and package.order names what there is."""
    for file in modelica.files():
        if file.name == "package.mo":
            listed = (file.parent / "package.order").read_text().split()
            there = {f.stem for f in file.parent.iterdir() if f.suffix == ".mo" or f.is_dir()} - {"package"}
            assert sorted(listed) == sorted(there), file.parent
        else:
            assert modelica.flattened(tree, modelica.class_of(file)).equations is not None


ADAPTIVE = ("adaptation", "adaptationRate", "waveFrequencyMin", "waveFrequencyMax", "waveFrequencyRatio", "excitationThreshold",
            "scheduleAngle", "scheduleFrequency", "waveFrequencyUsed", "adaptationActive")  # fmt: skip
NO_ADAPTATION = [f"{name}: not in the Modelica class" for name in ADAPTIVE]
# What differs from the FMU, and has to.
KNOWN = {
    "JointController": ["samplePeriod: constant, in the FMU parameter", *NO_ADAPTATION],
    "JointControllerSampled": ["samplePeriod: default [0.001], in the FMU [0.0]", *NO_ADAPTATION],
}


@pytest.mark.parametrize("model", ["TwoMassJoint", "PlanarManipulator", "JointController", "JointControllerSampled"])
def test_names_units_and_defaults_are_those_of_the_fmu(tree, model):
    flat = modelica.flattened(tree, f"Trueup.{model}")
    fmu = model.removesuffix("Sampled")
    assert sorted(complaints(own(flat.symbols), described(fmu))) == sorted(KNOWN.get(model, []))


def test_a_wrong_name_unit_or_default_is_found(tree):
    """The check itself: three mistakes, three complaints."""
    have = own(modelica.flattened(tree, "Trueup.TwoMassJoint").symbols)
    want = described("TwoMassJoint")
    want["damping"].start, want["stiffness"].unit = "8.08e-8", "N.m"
    want["motorTorque2"] = want.pop("motorTorque")
    found = sorted(c.split(":")[0] for c in complaints(have, want))
    assert found == ["damping", "motorTorque", "motorTorque2", "stiffness"]


def varied(parameters, seed, more=()):
    """Values about the defaults; of those that are 0 only `more`: (name, size)."""
    random = np.random.default_rng(seed)
    values = {n: float(v) * random.uniform(0.75, 1.35) for n, v in parameters.items() if float(v) != 0.0}
    return values | {name: size * random.uniform(-1.0, 1.0) for name, size in more}


def modifiers(values):
    """Values of parameters as Modelica: elements `a[1]`, `a[2,1]` as arrays."""
    arrays = {}
    for name, value in values.items():
        base, _, index = name.rstrip("]").partition("[")
        arrays.setdefault(base, {})[tuple(map(int, index.split(","))) if index else ()] = value

    def text(elements):
        if () in elements:
            return str(elements[()])
        rest = lambda i: {k[1:]: v for k, v in elements.items() if k[0] == i}  # noqa: E731
        return "{" + ", ".join(text(rest(i)) for i in sorted({k[0] for k in elements})) + "}"

    return [f"{name} = {text(elements)}" for name, elements in arrays.items()]


def compare(model, fmu, values, inputs, grid, names, watch=(), more=(), codes=None, times=(), beside=("", "")):
    """Runs the class and the FMU (a file) and compares; the FMU's values and times of events.

    `names` are outputs, or (name in Modelica, name in the FMU); `values` go to both, `more` are modifiers of the class alone,
    `codes` values of the FMU alone, `beside` declarations and equations around the class, which is `it` there."""
    pairs = [n if isinstance(n, tuple) else (n, n) for n in names]
    given = sorted(v.name for v in read_model_description(fmu).modelVariables if v.causality == "input")
    equations = "".join(f"  it.{n} = {inputs[n].modelica() if n in inputs else '0.0'};\n" for n in given)
    it = f"Trueup.{model} it({', '.join([*modifiers(values), *more])});"
    source = f"model T\n  {it}\n{beside[0]}\nequation\n{equations}{beside[1]}\nend T;\n"
    whole = [n.removeprefix("beside.") if n.startswith("beside.") else f"it.{n}" for n, _ in pairs]
    want, events = run(fmu, values | (codes or {}), inputs, grid, [n for _, n in pairs], watch, times)
    have, found = modelica.run(source, grid, whole, [f"it.{n}" for n in watch])
    scale = np.abs(want).max(axis=0)
    error = np.abs(have - want).max(axis=0) / np.where(scale > 0, scale, 1.0)
    assert max(error) < STATES, dict(zip((n for n, _ in pairs), error, strict=True))
    assert len(found) == len(events), (found, events)
    assert not len(events) or np.abs(found - events).max() < EVENTS, (found, events)
    return want, events


JOINT = ["motorAngle", "motorVelocity", "loadAngle", "loadVelocity", ("twist", "state.twist"),
         "motorAcceleration", "loadAcceleration", "motorTorque", "transmissionTorque", "frictionTorque"]  # fmt: skip
JOINT_STARTS = [("initialMotorVelocity", 30.0), ("initialLoadVelocity", 1e-3)]
GRID = np.round(np.arange(0.0, 2.0 + 1e-9, 0.02), 12)


def joint_inputs(seed):
    """Current that breaks the joint away and lets it rest, both ways, and a push on the load."""
    a = np.random.default_rng(seed).uniform(0.8, 1.2, 4)
    current = Signal((0, 0), (0.31, 0.022 * a[0]), (0.61, -0.02 * a[1]), (1.01, 0.018 * a[2]), (1.41, 0), (2, 0))
    return {"motorCurrent": current, "externalTorque": Signal((0, 0), (0.55, 0), (0.77, 4 * a[3]), (1.3, -2), (1.5, 0))}


def controller_inputs(seed):
    """Motions of motor and load that ask for torques within and beyond the limit."""
    a = np.random.default_rng(100 + seed).uniform(0.7, 1.3, 6)
    return {
        "positionReference": Signal((0, 0), (0.1, 0.3 * a[0]), (1, 0.3)),
        "velocityFeedforward": Signal((0, 0), (1, 0.01 * a[1])),
        "motorAngle": Signal((0, 300 * a[2]), (0.4, 4000), (1, 9000)),
        "motorVelocity": Signal((0, 100), (0.3, 9000 * a[3]), (1, -3000)),
        "loadAngle": Signal((0, 0.01), (0.5, 0.15 * a[4]), (1, 0.25)),
        "loadVelocity": Signal((0, 0), (0.25, 0.3 * a[5]), (1, -0.2)),
    }


def own_parameters(model):
    return {n: v.start for n, v in described(model).items() if v.causality == "parameter"}


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """The joint packed without its spring."""
    folder = tmp_path_factory.mktemp("rigid")
    command = [os.environ["TRUEUP_BIN"], "fmu", "pack", "TwoMassJoint", "--fmi", "3", "--flexible", "false", "-o", folder]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "TwoMassJoint.fmi3.fmu"


full = pytest.mark.full


@full
@pytest.mark.parametrize("seed", range(SETS))
def test_joint_runs_like_the_fmu(rumoca, seed):
    """Checks TMJ-1, TMJ-2, TMJ-3, TMJ-4 as Modelica."""
    values = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS)
    _, events = compare("TwoMassJoint", packed("TwoMassJoint"), values, joint_inputs(seed), GRID, JOINT, ["sticking"])
    assert len(events)


def test_rigid_joint_has_the_names_of_the_fmu(tree, rigid):
    flat = modelica.flattened(tree, "Trueup.TwoMassJointRigid")
    assert list(complaints(own(flat.symbols), described(rigid))) == []


@full
@pytest.mark.parametrize("seed", range(SETS))
def test_rigid_joint_runs_like_the_fmu(rumoca, rigid, seed):
    """Checks TMJ-4, TMJ-5 as Modelica."""
    values = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS[:1])
    names = [n for n in JOINT if isinstance(n, str)]
    _, events = compare("TwoMassJointRigid", rigid, values, joint_inputs(seed), GRID, names, ["sticking"])
    assert len(events)


@full
def test_gearbox_is_two_springs_with_dampers_in_series(rumoca):
    """Checks GB-1 as Modelica: compliances add, and so does the slope of the complex ones at frequency 0."""
    stages = {"planetary": (3.0, 0.02, 5.0, 0.5), "harmonicDrive": (40.0, 0.7, 100.0, 0.25)}
    parts = ("Stiffness", "Damping", "Ratio", "Inertia")
    given = {f"{s}{part}": v for s, values in stages.items() for part, v in zip(parts, values, strict=True)}
    text = ", ".join(modifiers(given | {"ownMotorInertia": 1.0, "ownLoadInertia": 2.0}))
    names = ["gearRatio", "stiffness", "damping", "motorInertia", "loadInertia"]
    equation = f"y = {{{', '.join(f'g.{n}' for n in names)}}};"
    source = f"model T\n  parameter Trueup.Joint.Gearbox g({text});\n  Real y[5];\nequation\n  {equation}\nend T;\n"
    values, _ = modelica.run(source, np.array([0.0, 0.1]), [f"y[{i + 1}]" for i in range(5)])
    series = lambda w: 1 / (1 / (3.0 + 0.02j * w) + 25.0 / (40.0 + 0.7j * w))  # noqa: E731
    want = [500.0, series(0.0).real, series(1e-6).imag / 1e-6, 1.5, 2.0 + 0.25 * 1e4]
    assert np.allclose(values[-1], want, rtol=1e-9)


SENSORS = {
    "sensor-eccentricity": ("Eccentricity", {"motorAngleEccentricityCosine": 0.02}),
    "sensor-drift": ("Drift", {"motorAngleDriftStart": 0.4, "motorAngleDriftTime": 0.5}),
    "sensor-delay": ("Delay", {}),
}


def of_sensor(name):
    """A parameter's name in the block: without that of the channel."""
    short = name.removeprefix("motorAngle")
    return short[0].lower() + short[1:]


@pytest.mark.parametrize("effect", SENSORS)
def test_parameters_of_sensors_are_those_of_the_fmu(tree, effect):
    flat = modelica.flattened(tree, f"Trueup.Effects.Sensor.{SENSORS[effect][0]}")
    have = {n: s for n, s in own(flat.symbols).items() if s[0] == "parameter"}
    all_of_it = described(f"TwoMassJoint+{effect}")
    assert list(complaints(have, {of_sensor(n): all_of_it[n] for n in own_of_effect(effect)})) == []


@full
@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", SENSORS)
def test_sensors_read_like_the_fmu(rumoca, effect, seed):
    """Checks EF-30, EF-31, EF-32 as Modelica."""
    name, more = SENSORS[effect]
    of_effect = varied({n: float(v) for n, v in own_of_effect(effect).items()} | more, 50 + seed)
    text = ", ".join(modifiers({of_sensor(n): v for n, v in of_effect.items()}))
    compare(
        "TwoMassJoint",
        packed(f"TwoMassJoint+{effect}"),
        varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS),
        joint_inputs(seed),
        GRID[:51],
        [("beside.s.reading", "motorAngle")],
        ["sticking"],
        codes=of_effect,
        beside=(f"  Trueup.Effects.Sensor.{name} s({text});", "  s.actual = it.motorAngle;"),
    )


# Effects of the joint: id, place, block, the effect's states in both, what is set beside the defaults.
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


@pytest.mark.parametrize("effect", EFFECTS)
def test_parameters_of_effects_are_those_of_the_fmu(tree, effect):
    have = {n: s for n, s in own(modelica.flattened(tree, block(effect)).symbols).items() if s[0] == "parameter"}
    all_of_it = described(f"TwoMassJoint+{effect}")
    assert list(complaints(have, {n: all_of_it[n] for n in own_of_effect(effect)})) == []


@full
@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", EFFECTS)
def test_effects_run_like_the_fmu(rumoca, effect, seed):
    """Checks EF-2 to EF-7, EF-10 to EF-19, EF-21, EF-22 and EF-25 on the joint as Modelica."""
    place, _, states, more = EFFECTS[effect]
    of_joint = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS)
    of_effect = varied({n: float(v) for n, v in own_of_effect(effect).items()} | more, 50 + seed)
    modifiers_of_effect = ", ".join(modifiers(of_effect))
    times = []
    for push in ("", "Second"):
        if f"loadPush{push}Start" in of_effect:
            begin, duration, edge = (of_effect[f"loadPush{push}{n}"] for n in ("Start", "Duration", "Edge"))
            times += [begin, begin + edge, begin + duration, begin + duration + edge]
    outputs = {v for v in described(f"TwoMassJoint+{effect}") if v in states}
    compare(
        "TwoMassJoint",
        packed(f"TwoMassJoint+{effect}"),
        of_joint,
        joint_inputs(seed),
        GRID[:51],
        [*JOINT, *((f"{place}.{s}", s if s in outputs else f"state.{s}") for s in states)],
        ["sticking"],
        more=[f"redeclare {block(effect)} {place}({modifiers_of_effect})"],
        codes=of_effect,
        times=times,
    )


STRATEGIES = ["P_PI", "WBC", "VWBC", "VWBC_WASHOUT"]
TUNED = ["positionGain", "velocityIntegralTime", "currentLimit", "waveFrequency", "washoutFrequency", "torqueConstant"]


@full
@pytest.mark.parametrize("sampled", [False, True], ids=["continuous", "sampled"])
@pytest.mark.parametrize("seed", range(SETS))
def test_controller_runs_like_the_fmu(rumoca, seed, sampled):
    """Checks CTL-1 to CTL-8 as Modelica."""
    starts = own_parameters("JointController")
    number = seed % len(STRATEGIES)
    values = varied({n: starts[n] for n in TUNED}, seed) | {"velocityGain": 300.0 + 20 * seed}
    grid = np.round(np.linspace(0.0, 0.1 if sampled else 1.0, 101), 12)
    current, _ = compare(
        "JointControllerSampled" if sampled else "JointController",
        packed("JointController"),
        values,
        controller_inputs(seed),
        grid,
        ["motorCurrent"],
        more=[f"strategy = Trueup.Control.Strategy.{STRATEGIES[number]}"] + ["samplePeriod = 1e-3"] * sampled,
        codes={"strategy": number + 1, "samplePeriod": 1e-3 if sampled else 0.0},
        times=grid if sampled else (),
    )
    limited = np.abs(current) >= values["currentLimit"] * (1 - 1e-12)
    assert not limited.all()
    assert sampled or limited.any()


ARM_GRID = np.round(np.arange(0.0, 3.0 + 1e-9, 0.05), 12)


def arm_inputs(seed, links):
    random = np.random.default_rng(200 + seed)
    names = [f"jointTorque[{j + 1}]" for j in range(links)] + ["baseForce[1]", "baseTorque", "tipForce[2]", "tipTorque"]
    sizes = [0.3, 0.1, 0.05][:links] + [0.5, 0.05, 0.1, 0.02]
    return {
        name: Signal((0, 0), (0.7, s * random.uniform(0.5, 1.5)), (1.9, -s * random.uniform(0.5, 1.5)), (2.6, 0), (3, 0))
        for name, s in zip(names, sizes, strict=True)
    }


def arm_outputs(file):
    """All continuous outputs, by element."""
    return [v.name for v in read_model_description(file).modelVariables if v.causality == "output"]


# Which joints are flexible, what becomes of the base, how rotors are coupled.
ARMS = [
    ((True, False, False), "free", "paper"),
    ((True, True, True), "free", "geared"),
    ((False, False), "free", "paper"),
    ((False, True), "fixed", "geared"),
]


@full
@pytest.mark.parametrize("seed", range(SETS))
def test_arm_runs_like_the_fmu(rumoca, trueup, tmp_path, seed):
    """Checks ARM-1 to ARM-7, ARM-10, ARM-12, ARM-13, ARM-15, wrenches and gravity of ARM-8 as Modelica."""
    flexible, base, coupling = ARMS[seed % len(ARMS)]
    n = len(flexible)
    words = [str(f).lower() for f in flexible]
    options = ["--fmi", 2, "--flexible", ",".join(words), *(["--structure", "base=fixed"] if base == "fixed" else [])]
    done = trueup("fmu", "pack", "PlanarManipulator", "-o", tmp_path, *options)
    assert done.returncode == 0, done.stderr
    file = tmp_path / "PlanarManipulator.fmi2.fmu"
    starts = {
        v.name: v.start
        for v in read_model_description(file).modelVariables
        if v.causality == "parameter" and v.name != "motorCoupling"
    }
    values = {name: 0.0 for name in starts} | varied(starts, seed)
    random = np.random.default_rng(seed)
    for j in range(n):
        values[f"motorInertia[{j + 1}]"] = random.uniform(0.2, 3.0)
        values[f"initialJointAngle[{j + 1}]"] = random.uniform(-1.0, 1.0)
        values[f"initialJointVelocity[{j + 1}]"] = random.uniform(-0.1, 0.1)
        values[f"initialMotorAngle[{j + 1}]"] = values[f"initialJointAngle[{j + 1}]"] + random.uniform(-0.05, 0.05)
        values[f"initialMotorVelocity[{j + 1}]"] = random.uniform(-0.1, 0.1)
    for name in starts:
        if name.startswith("initialBase"):
            values[name] = random.uniform(-0.1, 0.1)
        if name.startswith("gravity") and base == "fixed":
            values[name] = random.uniform(-3.0, 3.0)
    more = [
        f"numberOfLinks = {n}",
        f"jointFlexible = {{{', '.join(words)}}}",
        f"base = Trueup.Arm.Base.{base}",
        f"motorCoupling = Trueup.Arm.MotorCoupling.{coupling}",
    ]
    codes = {"motorCoupling": 1 + (coupling == "geared")}
    compare("PlanarManipulator", file, values, arm_inputs(seed, n), ARM_GRID, arm_outputs(file), more=more, codes=codes)


# Effects of the arm that stand once: id with its place, place in Modelica, block, states.
ARM_EFFECTS = {
    "base-drag": ("onBase", "Base.Drag", []),
    "base-thrust": ("onBase", "Base.Thrust", []),
    "cable-stiffness": ("onBase", "Base.Cable", []),
    "table-tilt": ("onBase", "Base.TableTilt", []),
    "appendage-mode": ("onBase", "Base.Appendage", ["appendageAngle", "appendageRate"]),
    "external-force:base": ("onBase", "Base.Push", []),
    "external-force:tip": ("onTip", "Tip.Push", []),
}


@pytest.fixture(scope="module")
def arm_with(tmp_path_factory):
    """arm_with(effect) is the arm's FMU of version 2 with that effect, and the start values of what the effect brings."""
    plain = {v.name for v in read_model_description(packed("PlanarManipulator", 2)).modelVariables}

    def pack(effect):
        folder = tmp_path_factory.mktemp("arm")
        command = [os.environ["TRUEUP_BIN"], "fmu", "pack", "PlanarManipulator", "--effect", effect, "-o", folder]
        subprocess.run(command, check=True, capture_output=True)
        (file,) = folder.glob("*.fmi2.fmu")
        (third,) = folder.glob("*.fmi3.fmu")
        return file, {n: v for n, v in described(third).items() if v.causality == "parameter" and n not in plain_arrays}

    plain_arrays = {name.partition("[")[0] for name in plain}
    return pack


@pytest.mark.parametrize("effect", ARM_EFFECTS)
def test_parameters_of_arm_effects_are_those_of_the_fmu(tree, arm_with, effect):
    symbols = own(modelica.flattened(tree, f"Trueup.Effects.{ARM_EFFECTS[effect][1]}").symbols)
    assert list(complaints({n: s for n, s in symbols.items() if s[0] == "parameter"}, arm_with(effect)[1])) == []


@full
@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", ARM_EFFECTS)
def test_arm_effects_run_like_the_fmu(rumoca, arm_with, effect, seed):
    """Checks EF-8, EF-9, EF-22 to EF-25 on the arm as Modelica."""
    place, name, states = ARM_EFFECTS[effect]
    file, brought = arm_with(effect)
    random = np.random.default_rng(seed)
    # None of them at 0, so that each counts.
    of_effect = {n: (float(v.start) or 0.3) * random.uniform(0.6, 1.4) for n, v in brought.items()}
    starts = {v.name: v.start for v in read_model_description(file).modelVariables if v.causality == "parameter"}
    own_values = varied({n: s for n, s in starts.items() if n not in of_effect and n != "motorCoupling"}, seed)
    for j in range(3):
        own_values[f"motorInertia[{j + 1}]"] = random.uniform(0.2, 3.0)
        own_values[f"initialJointAngle[{j + 1}]"] = random.uniform(-1.0, 1.0)
    for i in range(2):
        own_values[f"initialBaseVelocity[{i + 1}]"] = random.uniform(-0.1, 0.1)
    times = []
    for begin in [n for n in of_effect if n.endswith("Start")]:
        at, lasts, edge = (of_effect[begin.removesuffix("Start") + n] for n in ("Start", "Duration", "Edge"))
        times += [at, at + edge, at + lasts, at + lasts + edge]
    modifiers_of_effect = ", ".join(modifiers(of_effect))
    compare(
        "PlanarManipulator",
        file,
        own_values,
        arm_inputs(seed, 3),
        ARM_GRID,
        [*arm_outputs(file), *((f"{place}.{s}", f"state.{s}") for s in states)],
        more=[f"redeclare Trueup.Effects.{name} {place}({modifiers_of_effect})"],
        codes=of_effect,
        times=times,
    )
