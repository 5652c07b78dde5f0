"""What the Python tests share: the packed FMUs, the program, witnesses that need more than a Python package."""

import ctypes
import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODELS = ("TwoMassJoint", "PlanarManipulator", "JointController", "ManipulatorController")


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
