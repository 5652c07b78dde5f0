"""FMUs for Model Exchange as plants of this library (HybridFmu: event mode, indicators, completed steps, time events) through their
events, against FMPy's CVode at a tight tolerance: times of events and states at the end, over drawn parameters and inputs.

`EVENT_SEED` chooses other parameters; the seed is printed. A short run against our own driver is in crates/fmi-import/tests."""

import os

import numpy as np
import pytest
from fmpy import extract, read_model_description, simulate_fmu
from test_event_integrators import arm, capture, joint

SEED = int(os.environ.get("EVENT_SEED", "63"))
SETS, TOLERANCE = 10, 1e-11
# FMU, effect, what is drawn, s, limits of times in s and of states relative to their range: see the table in decision 95.
CASES = {
    "TwoMassJoint": ("TwoMassJoint", None, joint, 2.0, 1e-7, 1e-6),
    "PlanarManipulator+motor-friction": ("PlanarManipulator", "motor-friction", arm, 4.0, 1e-7, 1e-6),
    "CaptureScene": ("CaptureScene", None, capture, 15.0, 1e-7, 1e-6),
}


def held(inputs, stop):
    """Inputs that are held between jumps: (time, values by name)."""
    if inputs is None:
        return [(0.0, {})]
    # Of two rows at a jump the later one.
    rows = {float(row["time"]): {n: float(row[n]) for n in inputs.dtype.names[1:]} for row in inputs}
    return sorted((t, u) for t, u in rows.items() if t < stop)


def as_plant(example, file, start, inputs, stop):
    """Events and last states of our run."""
    lines = [f"p {name} {value!r}" for name, value in start.items()]
    lines += [" ".join(["u", repr(t), *(f"{n} {v!r}" for n, v in u.items())]) for t, u in held(inputs, stop)]
    shown = example("hybrid_run", "\n".join(lines), (file, str(stop), str(TOLERANCE)))
    words = [line.split() for line in shown.splitlines()]
    return [float(w[1]) for w in words if w[0] == "event"], [float(w[2]) for w in words if w[0] == "state"]


def by_cvode(folder, description, start, inputs, stop):
    """Events (two rows at one time) and last states of FMPy's run, and the range of each state."""
    states = [v.derivative.name for v in description.modelVariables if v.derivative]
    flags = [v.name for v in description.modelVariables if v.causality == "output" and v.type == "Boolean"]
    result = simulate_fmu(
        folder, model_description=description, validate=False, fmi_type="ModelExchange", stop_time=stop, output_interval=stop / 200,
        relative_tolerance=TOLERANCE, start_values=start, input=inputs, output=[*states, *flags],
    )  # fmt: skip
    t = np.asarray(result["time"])
    jumps = [] if inputs is None else np.unique(inputs["time"])
    events = [x for x in np.unique(t[1:][t[1:] == t[:-1]]) if 0 < x and all(abs(x - jumps) > 1e-12)]
    return events, [float(result[n][-1]) for n in states], [float(np.ptp(result[n])) for n in states]


@pytest.mark.full
@pytest.mark.parametrize("name", CASES)
def test_events_of_a_plant_are_those_of_cvode(trueup, example, fmu, tmp_path, name):
    model, effect, make, stop, late_limit, off_limit = CASES[name]
    files = [fmu(model, version) for version in (2, 3)]
    if effect:
        done = trueup("fmu", "pack", model, "--effect", effect, "-o", tmp_path)
        assert done.returncode == 0, done.stderr
        files = sorted(tmp_path.glob("*.fmu"))
    # Elements of arrays have names of their own in FMI 2.0, so that FMPy can set and read them.
    folder, description = extract(str(files[0])), read_model_description(str(files[0]))
    found = [([], []), ([], [])]
    counts = []
    for k in range(SETS):
        start, inputs = make(np.random.default_rng([SEED, k]), description)
        events, there, ranges = by_cvode(folder, description, start, inputs, stop)
        counts.append(len(events))
        for file, (late, off) in zip(files, found, strict=True):
            ours, last = as_plant(example, file, start, inputs, stop)
            assert len(ours) == len(events), f"seed {SEED}, set {k}, {file.name}: {ours}, {events}"
            late += [abs(a - b) for a, b in zip(ours, events, strict=True)]
            off += [abs(a - b) / max(size, 1e-3) for a, b, size in zip(last, there, ranges, strict=True)]
    assert sum(counts) >= SETS, f"seed {SEED}: too few events to compare: {counts}"

    def quantiles(values):
        return " | ".join(f"{q:.1e}" for q in np.quantile(values, [0.5, 0.9, 1.0]))

    for version, (late, off) in zip((2, 3), found, strict=True):
        print(f"| {name}, FMI {version}.0 | {sum(counts)} | {quantiles(late)} | {quantiles(off)} |")
        assert max(late) < late_limit and max(off) < off_limit, f"seed {SEED}"
