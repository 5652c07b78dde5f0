"""FMPy as the user's tool: every FMU x {2.0, 3.0} x {Model Exchange, Co-Simulation}."""

import csv
import io
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from conftest import MODELS
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))
ALL = sorted(FMUS.rglob("*.fmu"))  # with effects in a folder below
EFFECTS = sorted({f.name.split(".")[0].partition("+")[2] for f in ALL if "+" in f.name})

if not ALL:
    pytest.skip(f"no packed FMUs in {FMUS}: run ./test, which packs them", allow_module_level=True)


def kept(fmu, kind=None):
    """Runs without --full: each model in one version by one kind, from model to model another pair of them; every eighth effect, one plant by
    one kind, in FMI 3.0. Controllers of many joints in FMI 3.0: FMPy takes seconds for thousands of scalars."""
    plant, _, effect = fmu.name.split(".")[0].partition("+")
    if not effect:
        version, which = divmod(MODELS.index(plant) % 4, 2)
        version = 1 if plant in ("ManipulatorController", "SpaceController") else version
        return f"fmi{version + 2}" in fmu.name and kind in (None, ("ModelExchange", "CoSimulation")[which])
    plants = sorted({f.name.split("+")[0] for f in ALL if f"+{effect}.fmi" in f.name})
    turn, which = divmod(EFFECTS.index(effect) // 8, len(plants))
    if EFFECTS.index(effect) % 8 or "fmi2" in fmu.name:
        return False
    return plant == plants[which] and kind in (None, ("ModelExchange", "CoSimulation")[turn % 2])


def cases(*kinds):
    full = pytest.mark.full
    return [
        pytest.param(fmu, *kind, id="-".join((fmu.name, *kind)), marks=() if kept(fmu, *kind) else full)
        for fmu in ALL
        for kind in ([(k,) for k in kinds] or [()])
    ]


def path(model, version):
    return str(FMUS / f"{model}.fmi{version}.fmu")


def member(fmu, name):
    with zipfile.ZipFile(fmu) as z:
        return z.read(name).decode()


def table(text):
    """CSV with a header line as a dictionary of columns."""
    rows = list(csv.reader(io.StringIO(text)))
    data = np.array([[float(v) for v in row] for row in rows[1:]])
    return {name: data[:, i] for i, name in enumerate(rows[0])}


def elements(result, description):
    """Columns of a result by element name: FMI 3.0 arrays become name[i] and name[i,j]."""
    columns = {"time": np.asarray(result["time"], dtype=float)}
    for v in description.modelVariables:
        if v.name not in result.dtype.names or v.name == "time":
            continue
        data = np.asarray(result[v.name], dtype=float)
        if data.ndim == 1:
            columns[v.name] = data
            continue
        shape = data.shape[1:]
        for index in np.ndindex(*shape):
            label = ",".join(str(i + 1) for i in index)
            columns[f"{v.name}[{label}]"] = data[(slice(None), *index)]
    return columns


def signals(fmu, description):
    """The reference experiment's inputs as FMPy takes them."""
    inputs = table(member(fmu, f"documentation/{description.coSimulation.modelIdentifier}_in.csv"))
    version = int(description.fmiVersion[0])
    columns = [("time", float)]
    values = {"time": inputs["time"]}
    for v in description.modelVariables:
        if v.causality != "input":
            continue
        if version == 3 and v.dimensions:
            names = [n for n in inputs if n.startswith(v.name + "[")]
            if any(np.ptp(inputs[n]) > 0.0 for n in names):  # FMPy takes arrays of one shape only; others stay as they start
                columns.append((v.name, float, (len(names),)))
                values[v.name] = np.stack([inputs[n] for n in names], axis=1)
        elif v.name in inputs and (version == 2 or inputs[v.name].any()):
            columns.append((v.name, float))
            values[v.name] = inputs[v.name]
    out = np.zeros(len(inputs["time"]), dtype=columns)
    for name, data in values.items():
        out[name] = data
    return out


def run(fmu, kind, tolerance, points=1, **more):
    """`points`: output points per step of the default experiment."""
    description = read_model_description(fmu)
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    result = simulate_fmu(
        fmu,
        fmi_type=kind,
        stop_time=float(description.defaultExperiment.stopTime),
        step_size=float(description.defaultExperiment.stepSize),
        output_interval=float(description.defaultExperiment.stepSize) / points,
        relative_tolerance=tolerance,
        input=signals(fmu, description),
        output=outputs,
        **more,
    )
    return elements(result, description)


@pytest.mark.parametrize("fmu", cases())
def test_validate_finds_no_problem(fmu):
    assert validate_fmu(str(fmu)) == []


STILL = ("Momentum", "centerOfMass", "Quaternion")


def error_against(result, reference, jumps, still=STILL):
    """Error of each output relative to its largest magnitude, over the times both have but those at which an
    input jumps: there a sample may show either side."""
    worst = {}
    keep = np.array([min(abs(t - j) for j in jumps) > 1e-9 for t in reference["time"]])
    reference = {name: column[keep] for name, column in reference.items()}
    t_ref = reference["time"]
    # Events give several rows at one time; the last one is the value from there on.
    t, last = np.unique(result["time"][::-1], return_index=True)
    last = len(result["time"]) - 1 - last
    for name, want in reference.items():
        if name == "time" or name not in result:
            continue
        have = np.full(len(t_ref), np.nan)
        index = np.searchsorted(t, t_ref)
        for k, i in enumerate(index):
            for j in (i, i - 1):
                if 0 <= j < len(t) and abs(t[j] - t_ref[k]) < 1e-9:
                    have[k] = result[name][last[j]]
                    break
        ok = ~np.isnan(have)
        assert ok.mean() > 0.95, f"{name}: only {ok.mean():.0%} of the reference times are there"
        # `still`: momenta stay at 0, the centre of mass where it is: their error is one of kg.m/s, kg.m2/s and m; that of an attitude
        # is one of its length.
        plain = any(part in name for part in still)
        scale = 1.0 if plain else max(np.max(np.abs(want)), 1e-12)
        worst[name] = np.abs(have - want)[ok] / scale
    return worst


@pytest.mark.parametrize("fmu, kind", cases("ModelExchange", "CoSimulation"))
def test_matches_the_native_run(fmu, kind, full):
    model = fmu.name.split(".")[0].split("+")[0]
    reference = table(member(fmu, f"documentation/{model}_ref.csv"))
    times = table(member(fmu, f"documentation/{model}_in.csv"))["time"]
    jumps = times[:-1][np.diff(times) == 0.0]
    assert len(jumps) > 0
    # Every bounce, in the play or of balls, falling friction and a mode of little damping amplify the error of the solver.
    amplified = kind == "ModelExchange" and ("+" in fmu.name or model in ("GripperContact", "CaptureScene"))
    # CVode gives up after 500 steps between two output points, which FMPy cannot change. A jump of the command goes
    # through a memory of 5 ms: at 1e-12 that takes more than 500 steps of CVode, and half a default step's time.
    points = 4 if "actuator-lag" in fmu.name else 1
    bounds = [(1e-12, 1e-7), (1e-8, 1e-3)] if amplified else [(1e-12, 1e-9), (1e-8, 1e-6)]
    if model == "SpatialFreeFlyer":
        # CVode leaves 1.2e-6 at a tip 4 m out. Its relative tolerance does that (at 1e-9: 1.4e-7): nominals of attitude and
        # rates a tenth or a four-hundredth as large leave the same.
        bounds[1] = (1e-8, 3e-6)
    if model == "SpaceController":
        # Torques are 400/s2 times the inertia times what CVode leaves of the integrals.
        bounds[1] = (1e-8, 3e-6)
    if model == "FlexibleArm" and kind == "ModelExchange":
        # Light roll joints with dampers: CVode takes 500 steps in 0.3 ms, and what it leaves (3.7e-5 at 1e-10, 1.1e-6 at 1e-12) is
        # the friction of joint 4, whose motor hardly moves.
        bounds, points = [(1e-12, 3e-6)], 20
    if not full and ("+" in fmu.name or model != MODELS[0]):
        bounds = bounds[:1]  # what a looser tolerance costs is the solver's affair, which one model shows
    # Momenta of bodies that are pushed are large; balls without friction leave no torque about the port's centre.
    still = ("portTorque",) if model in ("FreeBody", "GripperContact", "CaptureScene") else STILL
    for tolerance, bound in bounds:
        worst = error_against(run(str(fmu), kind, tolerance, points), reference, jumps, still)
        assert len(worst) >= 1
        largest = {name: error.max() for name, error in worst.items()}
        name = max(largest, key=largest.get)
        print(f"{fmu.name} {kind} at {tolerance:.0e}: largest error {largest[name]:.1e} of {name}")
        assert largest[name] < bound, name


def test_momentum_does_not_drift():
    n = 3
    # Steps of the torques, each an input event for FMPy; it holds inputs between its output points.
    edges = np.arange(0.0, 10.5, 0.5)
    t = np.repeat(edges, 2)[1:-1]
    signal = np.zeros(len(t), dtype=[("time", float)] + [(f"jointTorque[{i + 1}]", float) for i in range(n)])
    signal["time"] = t
    signal["jointTorque[1]"] = np.repeat(0.3 * np.sin(edges[:-1]), 2)
    signal["jointTorque[2]"] = np.repeat(-0.2 * np.cos(2 * edges[:-1]), 2)
    signal["jointTorque[3]"] = np.repeat(0.1 * np.sin(3 * edges[:-1]), 2)
    # The default is 1e-5, so that sampled inputs run at all (test_fmpy_defaults.py); more exact momenta require a smaller one.
    for tolerance, bound in [(1e-12, 1e-9), (1e-9, 1e-6), (None, 1e-3)]:
        r = simulate_fmu(
            path("PlanarManipulator", 2),
            fmi_type="ModelExchange",
            stop_time=10.0,
            relative_tolerance=tolerance,
            input=signal,
            output=["linearMomentum[1]", "linearMomentum[2]", "angularMomentum", "kineticEnergy"],
        )
        assert np.max(r["kineticEnergy"]) > 1e-2, "the arm has to move for this to mean anything"
        drift = max(np.max(np.abs(r[c])) for c in ["linearMomentum[1]", "linearMomentum[2]", "angularMomentum"])
        print(f"momentum drift over 10 s at tolerance {tolerance}: {drift:.2e}")
        assert drift < bound


def exact_run(full):
    """Current pulses of both signs, and forces on the load that make the stuck motor break away."""
    from exact_joint import ExactJoint

    joint = ExactJoint(1.2e-7, 8.0, 44340.0, 0.02, 3.07e-5, 8.07e-8, 7.37e-5, 2.99e-4, 7.2e-8)
    schedule = [(0.0, 0.0, 0.0)]
    for k in range(6 if full else 4):
        current = 0.016 * (-1) ** k
        schedule += [(0.1 + 0.25 * k, current, 0.0), (0.13 + 0.25 * k, 0.0, 0.0)]
    begin, pushes = (1.7, 4) if full else (1.2, 2)
    for k in range(pushes):
        sign = (-1) ** k
        schedule += [(begin + 0.4 * k, 0.0145 * sign, 0.35 * sign), (begin + 0.2 + 0.4 * k, 0.0, 0.0)]
    stop = begin + 0.2 + 0.4 * pushes
    for here, after in zip(schedule, schedule[1:] + [(stop, 0.0, 0.0)]):
        joint.set(here[1], here[2])
        joint.advance(after[0])
    return schedule, joint, stop


@pytest.mark.parametrize("version", [pytest.param(2, marks=pytest.mark.full), 3])
def test_event_times_of_a_stick_slip_run(version, full):
    schedule, joint, stop = exact_run(full)
    times = np.repeat([t for t, _, _ in schedule] + [stop], 2)[1:-1]
    signal = np.zeros(len(times), dtype=[("time", float), ("motorCurrent", float), ("externalTorque", float)])
    signal["time"] = times
    signal["motorCurrent"] = np.repeat([c for _, c, _ in schedule], 2)
    signal["externalTorque"] = np.repeat([f for _, _, f in schedule], 2)
    starts = {
        "motorInertia": 1.2e-7, "loadInertia": 8.0, "gearRatio": 44340.0, "torqueConstant": 0.02, "stiffness": 3.07e-5,
        "damping": 8.07e-8, "coulombFriction": 7.37e-5, "staticFriction": 2.99e-4, "viscousFriction": 7.2e-8,
    }
    r = simulate_fmu(
        path("TwoMassJoint", version), fmi_type="ModelExchange", stop_time=stop, relative_tolerance=1e-12,
        input=signal, start_values=starts, output=["sticking", "motorAngle", "motorVelocity", "loadAngle"], output_interval=1e-3,
    )
    stick = np.asarray(r["sticking"]).astype(bool)
    change = np.flatnonzero(np.diff(stick.astype(int)) != 0)
    found = [(r["time"][i + 1], stick[i + 1]) for i in change]
    wanted = [(t, mode == 0) for t, mode in joint.events]
    assert len(wanted) >= (16 if full else 10)
    previous, wanted_changes = True, []
    for t, s in wanted:
        if s != previous:
            wanted_changes.append((t, s))
            previous = s
    assert [s for _, s in found] == [s for _, s in wanted_changes]
    errors = np.array([abs(a - b) for (a, _), (b, _) in zip(found, wanted_changes)])
    print(f"{len(errors)} stick-slip events, largest error of their times {errors.max():.1e} s")
    assert errors.max() < 1e-6
    assert abs(r["motorAngle"][-1] - joint.x[0]) < 1e-9 * max(1, np.max(np.abs(r["motorAngle"])))
