"""What users of real rigs require: inputs that are off, effects that are known, recordings that deviate from a healthy model.

The drive is simulated here, by small steps and its own few lines: a mass on a guide with dry and viscous friction, a position
controller in the loop, a drive that is a constant off, forces.
"""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

MASS, COULOMB, VISCOUS, GAIN = 95.0, 20.0, 200.0, 35.0
STEP, FINE = 4e-3, 20


def program():
    found = os.environ.get("TRUEUP_BIN")
    if not found:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return found


def run(*command):
    return subprocess.run([program(), *map(str, command)], capture_output=True, text=True)


def drive(seed, seconds=8.0, offset=0.0, gravity=0.0, pushes=(), gain=1.0):
    """Recorded command (V) and angle; the drive adds `offset` V to what is recorded, times `gain`."""
    random = np.random.default_rng(seed)
    tones = random.uniform(0.15, 0.8, 3)
    phases = random.uniform(0, 2 * np.pi, 3)
    q = v = 0.0
    rows = []
    for k in range(round(seconds / STEP)):
        t = k * STEP
        wanted = 0.1 * sum(np.sin(2 * np.pi * f * t + p) - np.sin(p) for f, p in zip(tones, phases)) / 3
        command = 243.0 * (160.0 * (wanted - q) / 40 - v)
        rows.append((t, command, q + random.normal(0, 1e-7)))
        for i in range(FINE):
            at = t + i * STEP / FINE
            push = sum(size for begin, end, size in pushes if begin <= at < end)
            force = GAIN * gain * (command + offset) + push - gravity * np.sin(q - 0.3) - VISCOUS * v
            # Dry friction holds what it can within the step.
            most = v + force / MASS * STEP / FINE
            dry = COULOMB / MASS * STEP / FINE
            v = np.sign(most) * max(abs(most) - dry, 0.0)
            q += v * STEP / FINE
    return np.array(rows)


CASE = """model = "TwoMassJoint"
train = ["a.csv", "b.csv"]
holdout = ["c.csv"]
[parameters]
jointFlexible = false
gearRatio = 1.0
torqueConstant = 35.0
motorInertia = 85.0
loadInertia = 10.0
coulombFriction = 20.0
staticFriction = 20.0
viscousFriction = 200.0
[uncertain]
coulombFriction = 0.1
staticFriction = 0.1
viscousFriction = 0.1
"""
SENSORS = """[channels.motorAngle]
noise = 1e-7
[channels.motorCurrent]
interpolation = "hold"
"""


def case(folder, recordings, between="", channel=""):
    folder.mkdir()
    (folder / "case.toml").write_text(CASE + between + SENSORS + channel)
    for name, rows in zip("abc", recordings):
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="", fmt="%.10g")
    return folder


def diagnosed(folder, *more):
    done = run("diagnose", folder, "-o", folder / "out", "--verdict-only", "--json", *more)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.full
def test_a_gain_of_an_input_is_found_as_such(tmp_path):
    rows = [drive(seed, gain=0.8) for seed in (4, 5, 6)]
    found = diagnosed(case(tmp_path / "asked", rows, channel="gain = { value = 1.0, doubt = 0.3 }\n"))
    told = found["parameters"]["motorCurrent.gain"]
    # Reading = gain x what acts.
    assert found["verdict"] == "parameters" and abs(told["value"] - 1.25) < 0.05, (found["verdict"], told)


def late(rows, column, samples=3):
    """The same with a column that is read so many samples late, 4 ms each."""
    late = rows.copy()
    late[:, column] = np.concatenate([np.full(samples, rows[0, column]), rows[:-samples, column]])
    return late


# In a plain run rig.rs of the crate `hypotheses` finds delays, without the page.
@pytest.mark.full
@pytest.mark.parametrize("channel, column", [("motorAngle", 2), ("motorCurrent", 1)])
def test_how_late_a_channel_is_is_found(full, tmp_path, channel, column):
    rows = [late(drive(seed, seconds=5.0), column) for seed in (14, 15, 16)]
    folder = case(tmp_path / channel, rows)
    toml = folder / "case.toml"
    asked = f"[channels.{channel}]\n"
    toml.write_text(toml.read_text().replace(asked, asked + 'delay = "estimate"\n'))
    done = run("identify", folder, "--fast", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    value, error = found["parameters"][f"{channel}.delay"]["value"], found["fit"]["motorAngle"]["nrmse"]
    print(channel, value, error, found["nominal_fit"]["motorAngle"]["nrmse"])
    # Half a step of the integration here, 0.1 ms, is in it; recordings that were not fitted are read as late.
    assert abs(value - 0.012) < 2e-4, value
    assert error < 0.01 * found["nominal_fit"]["motorAngle"]["nrmse"], error
    if full:
        told = diagnosed(folder)
        value = told["parameters"][f"{channel}.delay"]["value"]
        assert told["verdict"] == "parameters" and abs(value - 0.012) < 2e-4, (told["verdict"], value)
        assert not any(c["id"] == "sensor-delay" and c["component"] == f"sensor:{channel}" for c in told["candidates"])


@pytest.mark.full
def test_gravity_that_is_known_is_no_gap(tmp_path):
    rows = [drive(seed, gravity=60.0) for seed in (7, 8, 9)]
    without = diagnosed(case(tmp_path / "without", rows))
    assert without["verdict"] in ("effects", "ambiguous"), without["verdict"]
    assert any(e["component"] == "load" for e in without["effects"]), without["effects"]
    known = "[effects]\ngravity-torque = { gravityTorque = 50.0, gravityAngle = 0.3, doubt = 0.3 }\n"
    found = diagnosed(case(tmp_path / "known", rows, between=known))
    told = found["parameters"]["gravityTorque"]
    assert found["verdict"] == "parameters" and not found["effects"], found["verdict"]
    assert abs(told["value"] - 60.0) < 3.0, told
    assert all(c["id"] != "gravity-torque" for c in found["candidates"])
    with_it = run("identify", tmp_path / "without", "--with", "gravity-torque", "--fast", "--json")
    fitted = json.loads(with_it.stdout)
    assert abs(fitted["parameters"]["gravityTorque"]["value"] - 60.0) < 3.0
    errors = [fitted[which]["motorAngle"]["nrmse"] for which in ("fit", "fit_without_effects")]
    assert errors[0] < 0.1 * errors[1], errors


def test_an_offset_of_the_input_is_found_and_watch_says_when_a_recording_parts_from_the_model(full, tmp_path):
    pushes = [(1.5, 2.0, 60.0), (3.2, 3.9, 60.0), (5.0, 5.35, -45.0)]
    healthy = [drive(seed, offset=-0.3, seconds=6.0) for seed in (10, 11)]
    asked = 'offset = "estimate"\n'
    suspect = drive(12, offset=-0.3, seconds=6.0, pushes=pushes)
    told = diagnosed(case(tmp_path / "suspect", [*healthy, suspect], channel=asked), "--watch")
    found = told["watch"]
    print([(w["start"], w["end"], w["component"], w["like"]) for w in found])
    assert len(found) == len(pushes)
    for w, (begin, end, size) in zip(found, pushes):
        assert w["recording"] == "c.csv" and w["component"] == "actuator"
        assert abs(w["start"] - begin) < 0.01 and abs(w["end"] - end) < 0.01, w
        assert abs(GAIN * w["like"]["value"] / size - 1) < 0.1 and w["like"]["input"] == "motorCurrent", w
    # Readings have 0.3 V too much.
    offset = told["parameters"]["motorCurrent.offset"]
    assert offset["unit"] == "A" and abs(offset["value"] - 0.3) < 0.02, offset
    assert offset["ci95"][0] < 0.3 < offset["ci95"][1], offset
    if full:
        same = drive(13, offset=-0.3, seconds=6.0)
        told = diagnosed(case(tmp_path / "healthy", [*healthy, same], channel=asked), "--watch")
        gap = told["gap"]["overall"]
        assert told["watch"] == [] and told["verdict"] == "parameters", told["verdict"]
        assert gap["tuned"] < 0.01 * gap["before"], gap


def data():
    folder = os.environ.get("TRUEUP_DATA")
    if not folder or not (Path(folder) / "real").is_dir():
        pytest.skip("TRUEUP_DATA is not set to a folder with real recordings")
    return Path(folder) / "real"


@pytest.mark.full
def test_pulses_of_emps_are_found_to_five_milliseconds(tmp_path):
    scipy = pytest.importorskip("scipy.io")
    read = lambda name: {k: np.ravel(v) for k, v in scipy.loadmat(data() / "emps" / name).items() if not k.startswith("__")}
    healthy, pulsed = read("DATA_EMPS.mat"), read("DATA_EMPS_PULSES.mat")
    folder = tmp_path / "emps"
    folder.mkdir()
    text = CASE.replace('"a.csv", "b.csv"', '"a.csv"').replace("torqueConstant = 35.0", "torqueConstant = 35.15065")
    (folder / "case.toml").write_text(text + SENSORS.replace("1e-7", "1e-6") + 'offset = "estimate"\n')
    for name, m, pulses in (("a", healthy, 0.0), ("c", pulsed, pulsed["pulses_N"])):
        rows = np.column_stack([m["t"] - m["t"][0], m["vir"] - pulses, m["qm"]])
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="", fmt="%.10g")
    found = diagnosed(folder, "--watch")["watch"]
    t = pulsed["t"] - pulsed["t"][0]
    edges = t[1:][np.diff(pulsed["pulses_N"]) != 0]
    told = np.array([x for w in found for x in (w["start"], w["end"])])
    late = np.array([np.min(np.abs(told - edge)) for edge in edges])
    sizes = [35.15065 * w["like"]["value"] for w in found]
    print(f"{len(edges)} edges, {len(found)} stretches, late by {np.median(late):.4f} s (median), {late.max():.4f} s (most), {np.mean(sizes):.1f} N")
    assert len(edges) == 49 and late.max() < 5e-3 and len(found) == 25
    assert {w["component"] for w in found} == {"actuator"}
    assert abs(np.mean(sizes) / 175.8 - 1) < 0.05
