"""`trueup ports` on FMUs that fail, and on Reference FMUs, which are no mechanisms."""

import json
import os
import random
import subprocess
from pathlib import Path

import pytest
from conftest import from_environment
from test_faulty_fmus import drawn
from test_faulty_fmus import fmus as faulty  # noqa: F401

INTERFACES = ("me", "cs")

# What fails, in which call. A hang ends by the deadline.
FAULTS = [
    ("me", "hang", "derivatives"), ("me", "segv", "set_states"), ("me", "error", "get"), ("me", "fatal", "enter"), ("me", "nan", "derivatives"),
    ("me", "again", "discrete"), ("cs", "hang", "step"), ("cs", "segv", "step"), ("cs", "error", "get"), ("cs", "fatal", "step"), ("cs", "nan", "get"),
]  # fmt: skip


def fails(faulty, version, interface, what, call):
    command = [from_environment("TRUEUP_BIN"), "ports", faulty / f"faulty{version}.fmu", "--interface", interface, "--json", "--deadline", "2"]
    done = subprocess.run(command, env={**os.environ, "FAULT": f"{what} {call} 1"}, capture_output=True, text=True, timeout=120)
    assert done.returncode in (0, 1), f"{what} in {call}: {done.stderr}"
    if done.returncode:
        assert f"faulty{version}.fmu" in done.stderr and not done.stdout, f"{what} in {call}: {done.stderr}"
    else:
        json.loads(done.stdout)
    return done.returncode


@pytest.mark.parametrize("interface, what, call", [pytest.param(*f, marks=[] if f in FAULTS[::4] else pytest.mark.full) for f in FAULTS])
@pytest.mark.parametrize("version", (pytest.param(2, marks=pytest.mark.full), 3))
def test_an_fmu_that_fails_is_an_error_with_its_name(faulty, version, interface, what, call):
    assert fails(faulty, version, interface, what, call) == 1


def test_where_model_exchange_fails_co_simulation_is_used(faulty):
    command = [from_environment("TRUEUP_BIN"), "ports", faulty / "faulty3.fmu", "--json", "--deadline", "5"]
    done = subprocess.run(command, env={**os.environ, "FAULT": "error derivatives 1"}, capture_output=True, text=True)
    assert done.returncode == 0 and json.loads(done.stdout)["interface"] == "Co-Simulation", done.stderr
    assert "note: Model Exchange: " in done.stderr and "faulty3.fmu" in done.stderr


@pytest.mark.full
def test_drawn_faults_end_with_a_message_or_a_result(faulty):
    """Every fault of test_faulty_fmus.py, 60 drawn."""
    seed = int(os.environ.get("TRUEUP_SEED", 88))
    dice = random.Random(seed)
    ends = [fails(faulty, *((f := drawn(dice))[0], f[1], f[3], f[4])) for _ in range(60)]
    print(f"seed {seed}: {sum(ends)} of 60 end with an error")
    assert 0 < sum(ends) < 60


@pytest.mark.parametrize("interface", INTERFACES)
def test_a_foreign_fmu_without_inputs(faulty, interface):
    command = [from_environment("TRUEUP_BIN"), "ports", faulty / "faulty3.fmu", "--interface", interface, "--json"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert not found["variables"] and "no joint and no body is drafted" in found["open"][-1]
    assert not any(e["possible"] for e in found["effects"]), "an output without a unit is no reading"


REFERENCE = os.environ.get("TRUEUP_REFERENCE_FMUS")
FILES = sorted(Path(REFERENCE).glob("[23].0/*.fmu")) if REFERENCE else [None]


@pytest.mark.parametrize("file", FILES, ids=lambda f: f and f"{f.parent.name}-{f.stem}")
@pytest.mark.parametrize("interface", INTERFACES)
def test_reference_fmus(trueup, file, interface):
    """None of them is a mechanism with inputs: nothing is drafted, or it is refused with the reason."""
    if file is None:
        pytest.skip("TRUEUP_REFERENCE_FMUS names no folder with 2.0/*.fmu and 3.0/*.fmu")
    done = trueup("ports", file, "--interface", interface, "--json")
    if done.returncode:
        assert done.returncode == 1 and file.name in done.stderr
    else:
        assert not json.loads(done.stdout)["variables"]
