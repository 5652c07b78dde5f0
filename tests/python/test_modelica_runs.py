"""The Modelica package as rumoca runs it against the FMUs: states and times of events, 20 sets of parameters each."""

import modelica
import numpy as np
import pytest
from fmpy import read_model_description
from hybrid_run import Signal, run
from modelica_cases import (
    ARM_EFFECTS,
    EFFECTS,
    SENSORS,
    arm_with,
    block,
    described,
    of_sensor,
    own_of_effect,
    own_parameters,
    pack,
    packed,
)

pytestmark = pytest.mark.full
rumoca = pytest.importorskip("rumoca", reason="not installed: see tools/python/requirements-full.txt")

SETS = 20
# States and outputs relative to their largest magnitude, and times of events in s.
STATES, EVENTS = 1e-7, 1e-8


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
        rows = {k[0]: {} for k in sorted(elements)}
        for k, v in elements.items():
            rows[k[0]][k[1:]] = v
        return "{" + ", ".join(map(text, rows.values())) + "}"

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
    """Current that breaks the joint away and lets it rest, both ways, and a push on the load; of some at once."""
    a = np.random.default_rng(seed).uniform(0.8, 1.2, 4)
    current = Signal(
        (0, 0.021 if seed % 4 == 3 else 0), (0.31, 0.022 * a[0]), (0.61, -0.02 * a[1]), (1.01, 0.018 * a[2]), (1.41, 0), (2, 0)
    )
    return {"motorCurrent": current, "externalTorque": Signal((0, 0), (0.55, 0), (0.77, 4 * a[3]), (1.3, -2), (1.5, 0))}


def controller_inputs(seed):
    """Motions of motor and load that require torques within and beyond the limit; the load swings behind its spring."""
    a = np.random.default_rng(100 + seed).uniform(0.7, 1.3, 6)
    t = np.linspace(0.0, 1.0, 41)
    load = 0.1 * a[4] * t + 2e-3 * np.sin(30 * t)
    motor = 0.1 * a[4] * t + 3e-3 * np.sin(30 * t + 0.1 * a[2])
    return {
        "positionReference": Signal((0, 0), (0.1, 0.3 * a[0]), (1, 0.3)),
        "velocityFeedforward": Signal((0, 0), (1, 0.01 * a[1])),
        "motorAngle": Signal(*zip(t, 44340.0 * motor, strict=True)),
        "motorVelocity": Signal((0, 100), (0.3, 9000 * a[3]), (1, -3000)),
        "loadAngle": Signal(*zip(t, load, strict=True)),
        "loadVelocity": Signal((0, 0), (0.25, 0.3 * a[5]), (1, -0.2)),
    }


@pytest.fixture(scope="module")
def rigid(tmp_path_factory):
    """The joint packed without its spring."""
    return pack(tmp_path_factory.mktemp("rigid"), "TwoMassJoint", "--fmi", "3", "--flexible", "false")[0]


@pytest.mark.parametrize("seed", range(SETS))
def test_joint_runs_like_the_fmu(seed):
    """Checks TMJ-1, TMJ-2, TMJ-3, TMJ-4 as Modelica."""
    values = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS if seed % 2 == 0 else ())
    _, events = compare("TwoMassJoint", packed("TwoMassJoint"), values, joint_inputs(seed), GRID, JOINT, ["sticking"])
    # What slides from the start on may go on to the end.
    assert len(events) or seed % 4 == 3


@pytest.mark.parametrize("seed", range(SETS))
def test_rigid_joint_runs_like_the_fmu(rigid, seed):
    """Checks TMJ-4, TMJ-5 as Modelica."""
    values = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS[:1] if seed % 2 == 0 else ())
    names = [n for n in JOINT if isinstance(n, str)]
    _, events = compare("TwoMassJointRigid", rigid, values, joint_inputs(seed), GRID, names, ["sticking"])
    # What slides from the start on may go on to the end.
    assert len(events) or seed % 4 == 3


def test_gearbox_is_two_springs_with_dampers_in_series():
    """Checks GB-1 as Modelica: compliances add, and so does the slope of the complex ones at frequency 0."""
    stages = {"planetary": (3.0, 0.02, 5.0, 0.5), "harmonicDrive": (40.0, 0.7, 100.0, 0.25)}
    parts = ("Stiffness", "Damping", "Ratio", "Inertia")
    given = {f"{s}{part}": v for s, values in stages.items() for part, v in zip(parts, values, strict=True)}
    text = ", ".join(modifiers(given | {"ownMotorInertia": 1.0, "ownLoadInertia": 2.0}))
    names = ["gearRatio", "stiffness", "damping", "motorInertia", "loadInertia"]
    equation = f"y = {{{', '.join(f'g.{n}' for n in names)}}};"
    source = f"model T\n  parameter Trueup.Joint.Gearbox g({text});\n  Real y[5];\nequation\n  {equation}\nend T;\n"
    values, _ = modelica.run(source, np.array([0.0, 0.1]), [f"y[{i + 1}]" for i in range(5)])
    slow = 1e-6
    series = 1 / (1 / (3.0 + 0.02j * slow) + 25.0 / (40.0 + 0.7j * slow))
    want = [500.0, series.real, series.imag / slow, 1.5, 2.0 + 0.25 * 1e4]
    assert np.allclose(values[-1], want, rtol=1e-9)


@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", SENSORS)
def test_sensors_read_like_the_fmu(effect, seed):
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


def joint_with(effect, seed):
    """The joint with an effect: its values, the effect's, times at which the effect has a corner, names to compare."""
    place, _, states, more = EFFECTS[effect]
    of_joint = varied(own_parameters("TwoMassJoint"), seed, JOINT_STARTS)
    of_effect = varied({n: float(v) for n, v in own_of_effect(effect).items()} | more, 50 + seed)
    times = []
    for push in ("", "Second"):
        if f"loadPush{push}Start" in of_effect:
            begin, duration, edge = (of_effect[f"loadPush{push}{n}"] for n in ("Start", "Duration", "Edge"))
            times += [begin, begin + edge, begin + duration, begin + duration + edge]
    outputs = {v for v in described(f"TwoMassJoint+{effect}") if v in states}
    return of_joint, of_effect, times, [*JOINT, *((f"{place}.{s}", s if s in outputs else f"state.{s}") for s in states)]


@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", EFFECTS)
def test_effects_run_like_the_fmu(effect, seed):
    """Checks EF-2 to EF-7, EF-10 to EF-19, EF-21, EF-22 and EF-25 on the joint as Modelica."""
    of_joint, of_effect, times, names = joint_with(effect, seed)
    compare(
        "TwoMassJoint",
        packed(f"TwoMassJoint+{effect}"),
        of_joint,
        joint_inputs(seed),
        GRID[:51],
        names,
        ["sticking"],
        more=[f"redeclare {block(effect)} {EFFECTS[effect][0]}({', '.join(modifiers(of_effect))})"],
        codes=of_effect,
        times=times,
    )


@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", ["load-friction", "presliding-friction", "transmission-hysteresis"])
def test_the_runs_of_the_fmu_are_exact_enough_to_judge(effect, seed):
    """Where bristles yield: a run that stops at each time of the grid, and tighter, differs by a tenth of the tolerance."""
    of_joint, of_effect, _, names = joint_with(effect, seed)
    file = packed(f"TwoMassJoint+{effect}")
    names = [n if isinstance(n, str) else n[1] for n in names]
    given = (of_joint | of_effect, joint_inputs(seed), GRID[:51], names, ["sticking"])
    have, events = run(file, *given)
    want, at = run(file, *given, times=GRID[:51], rtol=1e-13)
    scale = np.abs(want).max(axis=0)
    error = np.abs(have - want).max(axis=0) / np.where(scale > 0, scale, 1.0)
    assert max(error) < 0.1 * STATES, dict(zip(names, error, strict=True))
    assert len(at) == len(events) and (not len(at) or np.abs(at - events).max() < 0.1 * EVENTS)


STRATEGIES = ["P_PI", "WBC", "VWBC", "VWBC_WASHOUT", "WBC_ADAPTIVE", "VWBC_ADAPTIVE"]
TUNED = ["positionGain", "velocityIntegralTime", "currentLimit", "waveFrequency", "washoutFrequency", "torqueConstant"]


@pytest.mark.parametrize("sampled", [False, True], ids=["continuous", "sampled"])
@pytest.mark.parametrize("seed", range(SETS))
def test_controller_runs_like_the_fmu(seed, sampled):
    """Checks CTL-1 to CTL-15 as Modelica."""
    starts = own_parameters("JointController")
    number = seed % len(STRATEGIES)
    by_estimate = seed // len(STRATEGIES) % 2 == 0
    values = varied({n: starts[n] for n in TUNED}, seed)
    values |= {"velocityGain": 300.0 + 20 * seed, "adaptationRate": 3.0 + 0.2 * seed, "excitationThreshold": 2e-4}
    frequencies = [(20.0 + 7 * k) * (1 + 0.01 * seed) for k in range(9)]
    grid = np.round(np.linspace(0.0, 0.1 if sampled else 1.0, 101), 12)
    outputs, events = compare(
        "JointControllerSampled" if sampled else "JointController",
        packed("JointController"),
        values,
        controller_inputs(seed),
        grid,
        ["motorCurrent", "waveFrequencyUsed"],
        ["adaptationActive"],
        more=[
            f"strategy = Trueup.Control.Strategy.{STRATEGIES[number]}",
            f"adaptation = Trueup.Control.Adaptation.{'estimate' if by_estimate else 'schedule'}",
            f"scheduleFrequency = {{{', '.join(map(str, frequencies))}}}",
        ]
        + ["samplePeriod = 1e-3"] * sampled,
        codes={
            "strategy": number + 1,
            "adaptation": 2 if by_estimate else 1,
            "scheduleFrequency": frequencies,
            "samplePeriod": 1e-3 if sampled else 0.0,
        },
        times=grid if sampled else (),
    )
    adapts = STRATEGIES[number].endswith("ADAPTIVE")
    limited = np.abs(outputs[:, 0]) >= values["currentLimit"] * (1 - 1e-12)
    assert not limited.all()
    assert sampled or limited.any()
    assert np.ptp(outputs[:, 1]) > 0.1 if adapts else np.ptp(outputs[:, 1]) == 0.0
    assert len(events) == (1 if adapts and by_estimate else 0)


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


@pytest.mark.parametrize("seed", range(SETS))
def test_arm_runs_like_the_fmu(tmp_path, seed):
    """Checks ARM-1 to ARM-7, ARM-10, ARM-12, ARM-13, ARM-15, wrenches and gravity of ARM-8 as Modelica."""
    flexible, base, coupling = ARMS[seed % len(ARMS)]
    n = len(flexible)
    words = [str(f).lower() for f in flexible]
    options = ["--fmi", "2", "--flexible", ",".join(words), *(["--structure", "base=fixed"] if base == "fixed" else [])]
    (file,) = pack(tmp_path, "PlanarManipulator", *options)
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


@pytest.fixture(scope="module")
def arms(tmp_path_factory):
    """The arm with each of its effects, and what the effect brings."""
    return {effect: arm_with(effect, tmp_path_factory.mktemp("arm")) for effect in ARM_EFFECTS}


@pytest.mark.parametrize("seed", range(SETS))
@pytest.mark.parametrize("effect", ARM_EFFECTS)
def test_arm_effects_run_like_the_fmu(arms, effect, seed):
    """Checks EF-8, EF-9, EF-22 to EF-25 on the arm as Modelica."""
    place, name, states = ARM_EFFECTS[effect]
    file, brought = arms[effect]
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


def test_the_example_of_the_readme_runs():
    """A joint with play under its sampled controller comes to its reference."""
    text = (modelica.PACKAGE.parent / "README.md").read_text()
    source = (
        text.partition("```modelica\n")[2].partition("```")[0].replace("model Drive", "model T").replace("end Drive", "end T")
    )
    angle, _ = modelica.run(source, np.linspace(0.0, 2.0, 21), ["joint.loadAngle"], tolerance=1e-9)
    assert abs(angle[-1, 0] - 0.1) < 1e-3
