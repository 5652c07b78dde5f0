"""identify and diagnose end: at a deadline, by Ctrl-C and by SIGTERM, wherever they are; nothing is written then."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

# s: from a deadline or a signal to the end. A look every 0.05 s; the rest is for busy machines.
ENDS = 2.0


def program():
    found = os.environ.get("TRUEUP_BIN")
    if not found:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return found


@pytest.fixture(scope="module")
def long_case(tmp_path_factory):
    """Recordings that take a minute and more: 40 s of an arm at 500 Hz, three for fitting, of noise that no model explains."""
    folder = tmp_path_factory.mktemp("long")
    random = np.random.default_rng(35)
    t = np.arange(0, 40, 0.002)
    names = ["jointTorque[1]", "jointTorque[2]", "jointTorque[3]", "baseAttitude"]
    names += [f"jointAngle[{k}]" for k in (1, 2, 3)] + ["motorAngle[1]"]
    header = "time," + ",".join(f'"{n}"' for n in names)
    for name in ("a", "b", "c"):
        tones = [a * np.sin(2 * np.pi * random.uniform(0.2, 0.7) * t) for a in (0.4, 0.28, 0.12)]
        seen = [np.cumsum(random.normal(0, 1e-4, t.size)) for _ in names[3:]]
        np.savetxt(folder / f"{name}.csv", np.column_stack([t, *tones, *seen]), delimiter=",", header=header, comments="", fmt="%.9g")
    (folder / "case.toml").write_text(
        'model = "PlanarManipulator"\ntrain = ["a.csv", "b.csv", "c.csv"]\n[parameters]\njointFlexible = [true, false, false]\n')
    return folder


def started(*command):
    return subprocess.Popen([program(), *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def commands(case, out):
    return {"diagnose": ("diagnose", case, "-o", out, "--all-readings"), "identify": ("identify", case, "--plot", out.with_suffix(".html"))}


@pytest.mark.parametrize("what", ["diagnose", "identify"])
def test_a_deadline_ends_it_with_what_was_done(long_case, tmp_path, what):
    begun = time.monotonic()
    child = started(*commands(long_case, tmp_path / "out")[what], "--deadline", "1")
    said = child.communicate(timeout=60)
    took = time.monotonic() - begun
    assert child.returncode == 1 and not said[0], said
    end = said[1].splitlines()[-1]
    assert re.fullmatch(r"error: not done within --deadline 1 s: after 1\.\d s(, at \d+ %)? it was .+; nothing is written", end), said[1]
    assert took < 1 + ENDS, took
    assert not list(tmp_path.rglob("*.*")), list(tmp_path.rglob("*"))


@pytest.mark.parametrize("what", ["diagnose", "identify"])
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_what_was_done(long_case, tmp_path, what, sent):
    child = started(*commands(long_case, tmp_path / "out")[what])
    # The handler is set before the first recording is read; a moment for the program to start.
    time.sleep(0.5)
    child.send_signal(sent)
    begun = time.monotonic()
    said = child.communicate(timeout=60)
    took = time.monotonic() - begun
    assert child.returncode == 1 and not said[0], said
    assert re.search(r"error: interrupted: after \d\.\d s(, at \d+ %)? it was .+; nothing is written$", said[1].strip()), said[1]
    assert took < ENDS, took
    assert not list(tmp_path.rglob("*.*")), list(tmp_path.rglob("*"))


@pytest.mark.full
def test_work_that_says_nothing_says_that_it_goes_on(long_case, tmp_path):
    child = started(*commands(long_case, tmp_path / "out")["diagnose"], "--deadline", "14")
    lines = child.communicate(timeout=60)[1].splitlines()
    still = [line for line in lines if re.search(r"still .+: \d+ simulations and fits, \d+ s so far", line)]
    assert still, lines


@pytest.mark.full
def test_a_case_that_is_done_in_time_is_as_without_a_deadline(tmp_path):
    case = Path(__file__).resolve().parents[2] / "examples/06-backlash"
    told = []
    for more in ((), ("--deadline", "600")):
        done = subprocess.run([program(), "identify", case, "--method", "ls", "--json", *more], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        told.append(done.stdout)
    assert told[0] == told[1]


@pytest.mark.full
def test_of_a_long_recording_it_is_said_how_long_it_takes(tmp_path):
    random = np.random.default_rng(36)
    t = np.arange(0, 600, 0.002)
    i = 0.3 * np.sin(2 * t)
    q = np.cumsum(np.cumsum(0.05 / 3e-2 * i * 0.002) * 0.002)
    rows = np.column_stack([t, i, q + random.normal(0, 1e-4, t.size)])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="", fmt="%.9g")
    (tmp_path / "case.toml").write_text(
        'model = "TwoMassJoint"\ntrain = ["a.csv"]\n[parameters]\njointFlexible = false\ngearRatio = 1.0\ntorqueConstant = 0.05\n'
        "motorInertia = 3e-2\nloadInertia = 1e-8\ncoulombFriction = 1e-6\nstaticFriction = 1e-6\nviscousFriction = 1e-6\n"
        "[channels.motorAngle]\nnoise = 1e-4\n")
    said = started("identify", tmp_path, "--deadline", "40").communicate(timeout=100)[1]
    assert re.search(r"one simulation of 300000 readings with its derivatives takes \d+\.\d s here; .+ --deadline", said), said
