"""FMPy with nothing set but the input: sampled sines, which Model Exchange holds within a step of CVode."""

import numpy as np
import pytest
from conftest import MODELS
from fmpy import simulate_fmu

T = np.arange(0, 5.0001, 0.01)


def columns(model, amplitude, w):
    """Inputs by name; those of arms as one row per joint."""

    def wave(a, harmonic=1, late=0.0, slope=False):
        phase = harmonic * w * (T - late)
        return a * amplitude * (harmonic * w * np.cos(phase) if slope else np.sin(phase))

    if model == "TwoMassJoint":
        return {"motorCurrent": wave(0.3)}
    if model == "PlanarManipulator":
        return {"jointTorque": [wave(0.3), wave(-0.2, 2), wave(0.1, 3)]}
    if model == "SpatialFreeFlyer":
        return {"jointTorque": [wave(a, k + 1) for k, a in enumerate((2, 3, -1.5, 0.02, 0.02, 0.004))]}
    if model == "FlexibleArm":
        return {"motorCurrent": [wave(a, k + 1) for k, a in enumerate((0.1, 0.3, -0.2, 0.02, 0.02, 0.02))]}
    if model == "FreeBody":
        return {"portTorque": [wave(50)]}
    if model == "GripperContact":  # the target's port comes and goes between the balls
        return {"portPosition": [0.12 + wave(0.02), 0.01 + wave(0.01)]}
    if model == "CaptureScene":
        return {"chaserForce": [wave(20), wave(-5, 2)]}
    if model == "SpaceController":
        return {"jointVelocityReference": [wave(a, k + 1) for k, a in enumerate((0.1, 0.1, -0.1, 0.1, 0.05, 0.05))]}
    n = 44340 if model == "JointController" else 1
    signals = {
        "positionReference": (1, 0, False),
        "velocityFeedforward": (1, 0, True),
        "motorAngle": (n, 0.01, False),
        "motorVelocity": (n, 0.01, True),
        "loadAngle" if n > 1 else "jointAngle": (1, 0.01, False),
        "loadVelocity" if n > 1 else "jointVelocity": (1, 0.01, True),
    }
    made = {name: wave(0.1 * a, 1, late, slope) for name, (a, late, slope) in signals.items()}
    return made if n > 1 else {name: [row, 0.5 * row, 0.2 * row] for name, row in made.items()}


def table(model, version, amplitude, w):
    kinds, data = [("time", float)], {"time": T}
    for name, value in columns(model, amplitude, w).items():
        if isinstance(value, list) and version == 2:
            for i, row in enumerate(value):
                kinds.append((f"{name}[{i + 1}]", float))
                data[f"{name}[{i + 1}]"] = row
        elif isinstance(value, list):
            kinds.append((name, float, (len(value),)))
            data[name] = np.stack(value, axis=1)
        else:
            kinds.append((name, float))
            data[name] = value
    out = np.zeros(len(T), dtype=kinds)
    for name, values in data.items():
        out[name] = values
    return out


# Those that events and a stiff loop make hard; the others with --full.
SHORT = ("TwoMassJoint", "GripperContact", "JointController")


@pytest.mark.parametrize(
    "model, version",
    [pytest.param(m, v, marks=[] if m in SHORT and v == 3 else pytest.mark.full) for m in MODELS for v in (2, 3)],
)
def test_sampled_sines(fmu, full, model, version):
    shown = {
        "TwoMassJoint": "motorAngle", "PlanarManipulator": "jointAngle", "SpatialFreeFlyer": "jointAngle",
        "FlexibleArm": "jointAngle",
        "FreeBody": "rate", "GripperContact": "hostForce", "CaptureScene": "chaserVelocity", "JointController": "motorCurrent",
    }
    array = version == 2 and model not in ("TwoMassJoint", "FreeBody", "JointController")
    name = shown.get(model, "jointTorque") + ("[1]" if array else "")
    # Amplitude as a factor, and frequency in Hz: from slow to what one period of 100 ms makes of 10 samples.
    for amplitude, hz in ((1, 0.16), (10, 2), (0.3, 2), (3, 0.5), (3, 10))[: 5 if full else 2]:
        inputs = table(model, version, amplitude, 2 * np.pi * hz)
        runs = []
        for kind in ("ModelExchange", "CoSimulation"):
            result = simulate_fmu(
                fmu(model, version), fmi_type=kind, stop_time=5, output_interval=0.01, input=inputs, output=[name]
            )
            assert abs(result["time"][-1] - 5) < 1e-9, (kind, amplitude, hz)
            value = np.asarray(result[name], dtype=float)
            value = value[:, 0] if value.ndim > 1 else value
            runs.append((np.asarray(result["time"], dtype=float), value))
        # Both hold the inputs within a step, each from another point: the same where they are slow against it.
        if hz == 0.16:
            (t, exchanged), (s, simulated) = runs
            last = np.searchsorted(t, s, side="right") - 1
            off = np.abs(exchanged[last] - simulated).max() / np.ptp(simulated)
            print(f"{model}: {off:.1e} of the range")
            assert off < 0.1, (amplitude, hz, off)
