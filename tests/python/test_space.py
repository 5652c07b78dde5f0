"""SpatialFreeFlyer through FMPy: what must not drift."""

import ctypes

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException

from low_level import Opened

AMPLITUDE = np.array([2.0, 3.0, -1.5, 0.02, 0.02, 0.004])
PERIOD = np.array([20.0, 10.0, 20.0, 5.0, 4.0, 2.5])
ANGLES = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5]
TUMBLING = {
    "initialBaseAngularVelocity": [0.1, 0.2, 0.15],
    "initialJointVelocity": [0.05, -0.04, 0.03, 0.1, -0.08, 0.06],
    "initialJointAngle": ANGLES,
}


def flat(version, values):
    """Start values by the names that the version has."""
    if version == 3:
        return values
    return {f"{name}[{i + 1}]": v for name, row in values.items() for i, v in enumerate(row)}


def column(result, name, i):
    """Element i (from 0) of an output."""
    data = result[name] if name in result.dtype.names else result[f"{name}[{i + 1}]"]
    return data if data.ndim == 1 else data[:, i]


def torques(version, stop, step):
    """Steps of the torques, each an input event for FMPy, which holds inputs between its output points."""
    edges = np.arange(0, stop + step / 2, step)
    t = np.repeat(edges, 2)[1:-1]
    rows = np.repeat(AMPLITUDE * np.sin(2 * np.pi * edges[:-1, None] / PERIOD), 2, axis=0)
    if version == 3:
        signal = np.zeros(len(t), dtype=[("time", float), ("jointTorque", float, (6,))])
        signal["jointTorque"] = rows
    else:
        signal = np.zeros(len(t), dtype=[("time", float), *((f"jointTorque[{i + 1}]", float) for i in range(6))])
        for i in range(6):
            signal[f"jointTorque[{i + 1}]"] = rows[:, i]
    signal["time"] = t
    return signal


def outputs(version, **lengths):
    return list(lengths) if version == 3 else [f"{n}[{i + 1}]" for n, k in lengths.items() for i in range(k)]


MOMENTA = {"linearMomentum": 3, "angularMomentum": 3}


def largest(result, lengths):
    return max(np.max(np.abs(column(result, n, i) - column(result, n, i)[0])) for n, k in lengths.items() for i in range(k))


@pytest.mark.parametrize("version", (2, 3))
def test_the_chaser_moves_its_arm_and_nothing_drifts(fmu, version):
    result = simulate_fmu(
        # At 1e-12 CVode leaves 3e-9.
        fmu("SpatialFreeFlyer", version), fmi_type="ModelExchange", stop_time=20.0, relative_tolerance=1e-13,
        output_interval=0.05, start_values=flat(version, {"initialJointAngle": ANGLES}), input=torques(version, 20.0, 0.5),
        output=[*outputs(version, jointAngle=6, **MOMENTA), "kineticEnergy"],
    )
    drift = largest(result, MOMENTA)
    # The torques are constant for half a second at a time: their work is torque times way.
    t, work = np.asarray(result["time"]), 0.0
    for k in range(40):
        here, there = np.flatnonzero(t <= 0.5 * k + 1e-9)[-1], np.flatnonzero(t <= 0.5 * (k + 1) + 1e-9)[-1]
        held = AMPLITUDE * np.sin(2 * np.pi * 0.5 * k / PERIOD)
        work += sum(held[i] * (column(result, "jointAngle", i)[there] - column(result, "jointAngle", i)[here]) for i in range(6))
    energy = result["kineticEnergy"][-1]
    print(f"FMI {version}: P, L drift {drift:.1e}; energy {energy:.3f} J, less work {energy - work:.1e} J")
    assert energy > 0.1 and drift < 1e-9 and abs(energy - work) < 1e-9


def stepped(path, values, stop, step, at=lambda t: {}, tolerance=None, watch=("linearMomentum", "angularMomentum", "kineticEnergy")):
    """Outputs at the steps of a run in Co-Simulation."""
    rows = []
    with Opened(path, "CS", tolerance=tolerance) as f:
        f.initialize(values, stop=stop)
        for k in range(round(stop / step)):
            rows.append(np.concatenate([np.atleast_1d(f.get(name)) for name in watch]))
            for name, value in at(k * step).items():
                f.set(name, value)
            f.fmu.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
    return np.array(rows)


def test_co_simulation_at_its_default_tolerance(fmu):
    rows = stepped(
        fmu("SpatialFreeFlyer", 3), {"initialJointAngle": ANGLES}, 20.0, 0.01,
        lambda t: {"jointTorque": list(AMPLITUDE * np.sin(2 * np.pi * t / PERIOD))},
    )
    drift = np.max(np.abs(rows[:, :6]))
    print(f"P, L drift {drift:.1e}, energy at most {rows[:, 6].max():.2f} J")
    assert drift < 1e-6 and rows[:, 6].max() > 0.1


def test_tumbling_keeps_its_energy(fmu):
    rows = stepped(fmu("SpatialFreeFlyer", 3), TUMBLING, 30.0, 0.05, tolerance=1e-12)
    energy = np.max(np.abs(rows[:, 6] / rows[0, 6] - 1))
    momenta = np.max(np.abs(rows[:, :6] - rows[0, :6])) / np.max(np.abs(rows[0, :6]))
    print(f"energy {energy:.1e}, momenta {momenta:.1e}, relative")
    assert energy < 1e-10 and momenta < 1e-10


@pytest.mark.full
def test_tumbling_for_an_orbit(fmu):
    """5400 s at the default tolerance."""
    rows = stepped(fmu("SpatialFreeFlyer", 3), TUMBLING, 5400.0, 0.1)
    drift = np.max(np.abs(rows[:, 3:6] - rows[0, 3:6])) / np.linalg.norm(rows[0, 3:6])
    energy = np.max(np.abs(rows[:, 6] / rows[0, 6] - 1))
    print(f"over an orbit: L {drift:.1e}, energy {energy:.1e}, relative")
    assert drift < 1e-6


@pytest.mark.parametrize("version", (2, 3))
def test_an_attitude_of_nothing_is_an_error(fmu, version):
    """A tool that sets the quaternion among the states to 0 gets no derivatives."""
    with Opened(fmu("SpatialFreeFlyer", version), "ME") as f:
        f.initialize({}, stop=1.0)
        x, dx = (ctypes.c_double * 25)(), (ctypes.c_double * 25)()
        with pytest.raises(FMICallException):
            f.fmu.setContinuousStates(x, 25)
            f.fmu.getContinuousStateDerivatives(dx, 25) if version == 3 else f.fmu.getDerivatives(dx, 25)


def test_panels_swing_and_nothing_drifts(trueup, tmp_path):
    """S1's arm on a bus with panels, packed from its preset, through CVode."""
    done = trueup("fmu", "pack", "SpatialFreeFlyer", "--preset", "table-1-with-panels", "--fmi", 3, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    edges = np.arange(0, 3.01, 0.25)
    t = np.repeat(edges, 2)[1:-1]
    signal = np.zeros(len(t), dtype=[("time", float), ("jointTorque", float, (3,))])
    signal["time"] = t
    signal["jointTorque"] = np.repeat(np.outer(np.sin(2 * np.pi * edges[:-1] / 3), [2.0, 6.0, -1.5]), 2, axis=0)
    result = simulate_fmu(
        tmp_path / "SpatialFreeFlyer.fmi3.fmu", fmi_type="ModelExchange", stop_time=3.0, relative_tolerance=1e-12,
        output_interval=0.01, input=signal, start_values={"initialJointAngle": list(np.radians([20, 40, -60]))},
        output=[*MOMENTA, "modalCoordinate"],
    )
    drift, swing = largest(result, MOMENTA), np.max(np.abs(result["modalCoordinate"]))
    print(f"P, L drift {drift:.1e}, panels swing by {1e3 * swing:.0f} mm")
    assert drift < 1e-8 and swing > 1e-3


@pytest.mark.parametrize(
    "version, kind",
    [
        (3, "ModelExchange"), (2, "CoSimulation"),
        pytest.param(2, "ModelExchange", marks=pytest.mark.full), pytest.param(3, "CoSimulation", marks=pytest.mark.full),
    ],
)
def test_a_base_that_spins_too_fast_is_told_once(trueup, tmp_path, version, kind):
    """Panels do not stiffen when they spin: a warning where a run begins above a fifth of their first frequency (3.1077 rad/s)
    or comes there, once, and none below."""
    done = trueup("fmu", "pack", "SpatialFreeFlyer", "--preset", "table-1-with-panels", "--fmi", version, "-o", tmp_path)
    assert done.returncode == 0, done.stderr

    def told(rate, torque):
        said = []
        names = ["baseTorque[1]", "baseTorque[2]", "baseTorque[3]"]
        columns = [("baseTorque", float, (3,))] if version == 3 else [(n, float) for n in names]
        signal = np.zeros(2, dtype=[("time", float), *columns])
        signal["time"] = [0.0, 1.0]
        if version == 3:
            signal["baseTorque"][:, 2] = torque
        else:
            signal["baseTorque[3]"] = torque
        simulate_fmu(
            tmp_path / f"SpatialFreeFlyer.fmi{version}.fmu", fmi_type=kind, stop_time=1.0, output_interval=0.01, input=signal,
            start_values=flat(version, {"initialBaseAngularVelocity": [0.0, 0.0, rate]}), debug_logging=True,
            # FMI 3.0 leaves out the name of the instance.
            logger=lambda *of: said.append(" ".join(part.decode() if isinstance(part, bytes) else str(part) for part in of[1:])),
        )
        return [s for s in said if "above a fifth of the first frequency of appendage 1 (3.1077" in s]

    assert told(0.5, 0.0) == []
    at_first, under_way = told(0.7, 0.0), told(0.6, 20.0)
    print(under_way)
    assert len(at_first) == 1 and "0.7000 rad/s at time 0.0 s" in at_first[0]
    assert len(under_way) == 1 and "at time 0.0 s" not in under_way[0] and "logStatusWarning" in under_way[0]
