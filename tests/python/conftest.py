"""What the Python tests share: the packed FMUs, the program, references that need more than a Python package."""

import ctypes
import json
import os
import subprocess
import time
from pathlib import Path

import pytest

# Matrices are small, and pytest has a process per core already: more threads of BLAS wait for each other, busily.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parents[2]
MODELS = (
    "TwoMassJoint", "PlanarManipulator", "SpatialFreeFlyer", "FlexibleArm", "FreeBody", "GripperContact", "CaptureScene",
    "JointController", "ManipulatorController", "SpaceController",
)

# Each model by FMI 3.0, the first one by FMI 2.0, too: of the others that repeats, with --full.
BY_VERSION = [(model, 3) for model in MODELS] + [
    pytest.param(model, 2, marks=[] if model == MODELS[0] else pytest.mark.full) for model in MODELS
]


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="also tests marked `full`, which take long")


@pytest.fixture(autouse=True)
def mujoco_logs_elsewhere(request, monkeypatch):
    """MuJoCo writes its warnings into MUJOCO_LOG.TXT of the working folder."""
    if "mujoco" in Path(request.module.__file__).read_text():
        monkeypatch.chdir(request.getfixturevalue("tmp_path"))


def pytest_collection_modifyitems(config, items):
    if config.getoption("--full"):
        return
    left_out = [item for item in items if item.get_closest_marker("full")]
    items[:] = [item for item in items if not item.get_closest_marker("full")]
    config.hook.pytest_deselected(items=left_out)
    config.stash[LEFT_OUT] = len(left_out)


LEFT_OUT = pytest.StashKey[int]()


def pytest_sessionfinish(session):
    # A worker of pytest-xdist reports to its controller, which collects nothing itself.
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash.get(LEFT_OUT, 0)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node, error):
    node.config.stash[LEFT_OUT] = getattr(node, "workeroutput", {}).get("left_out", 0)


def pytest_terminal_summary(terminalreporter, config):
    left_out = config.stash.get(LEFT_OUT, 0)
    if left_out:
        terminalreporter.write_line(f"{left_out} long tests left out: ./test --full runs them")
    began = os.environ.get("TRUEUP_TEST_BEGAN")
    if began:
        used = os.times()
        busy = float(os.environ.get("TRUEUP_TEST_BUSY", 0)) + sum(used[:4])
        passed = time.time() - float(began)
        terminalreporter.write_line(f"{passed:.0f} s since ./test began, {busy:.0f} s busy (user + sys)")


def from_environment(variable):
    path = os.environ.get(variable)
    if not path:
        pytest.skip(f"{variable} is not set: run ./test, or set it (see CONTRIBUTING.md)")
    path = Path(path)
    assert path.exists(), f"{variable} names {path}, which does not exist: run ./test"
    return path


@pytest.fixture(scope="session")
def fmus():
    """Folder of the packed FMUs."""
    return from_environment("TRUEUP_FMUS")


@pytest.fixture(scope="session")
def fmu(fmus):
    """fmu(model, version) is the path of a packed default FMU."""

    def path(model, version):
        file = fmus / f"{model}.fmi{version}.fmu"
        assert file.is_file(), f"{file} was not packed"
        return file

    return path


@pytest.fixture(scope="session")
def trueup():
    """trueup(argument, ...) runs the program and returns the finished process, whatever its exit status."""
    program = from_environment("TRUEUP_BIN")

    def run(*arguments, **options):
        return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, **options)

    run.program = program
    return run


@pytest.fixture(scope="session")
def diagnosed(trueup):
    """diagnosed(folder, option, ...) runs `trueup diagnose` and returns diagnosis.json, whose verdict and gap it prints."""

    def run(folder, *options):
        done = trueup("diagnose", folder, "-o", folder / "out", "--seed", 1, *options)
        assert done.returncode == 0, done.stderr
        said = json.loads((folder / "out" / "diagnosis.json").read_text())
        print(said["verdict"], [(e["id"], round(e["probability"], 2)) for e in said["effects"]], said["gap"]["overall"])
        return said

    return run


@pytest.fixture(scope="session")
def full(request):
    """Whether long tests run."""
    return request.config.getoption("--full")


@pytest.fixture(scope="session")
def example():
    """example(name, text, arguments) runs an example program, which cargo built next to the program, and returns what it prints."""
    folder = from_environment("TRUEUP_BIN").parent / "examples"

    def run(name, text=None, arguments=()):
        program = folder / name
        assert program.is_file(), f"{program} is missing: ./test builds it, or cargo build --release --workspace --example {name}"
        done = subprocess.run([program, *arguments], input=text, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def ecospy():
    """The module ecospy. Its library links to TBB, which its wheel does not carry."""
    try:
        ctypes.CDLL("libtbb.so.12")
    except OSError as error:
        pytest.skip(f"ecospy needs the shared library of Debian's package libtbb12: {error}")
    import ecospy

    return ecospy
