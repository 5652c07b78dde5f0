"""The package as it is installed: run by tests/python/test_wheel.py, or by hand where `trueup` can be imported."""

import subprocess
from pathlib import Path

import pytest
import trueup as tu

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
MODELS = ("TwoMassJoint", "PlanarManipulator", "JointController")


@pytest.fixture(scope="session")
def program():
    """program(argument, ...) runs the program that the package carries."""

    def run(*arguments, **options):
        command = [tu.program(), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=True, **options)

    return run


@pytest.fixture(scope="session")
def fmus(program, tmp_path_factory):
    """Folder of packed FMUs."""
    folder = tmp_path_factory.mktemp("fmus")
    program("fmu", "pack", *MODELS, "-o", folder)
    return folder


@pytest.fixture(scope="session")
def joint(fmus):
    return tu.Fmu(fmus / "TwoMassJoint.fmi3.fmu")


@pytest.fixture(scope="session")
def backlash():
    """The folder of a case."""
    return EXAMPLES / "06-backlash"


@pytest.fixture(scope="session")
def recordings(backlash):
    """recordings(names) are those of the case as arrays, by their names."""
    import numpy as np

    def read(name):
        table = np.genfromtxt(backlash / name, delimiter=",", names=True, deletechars="", dtype=float)
        return {column: np.ascontiguousarray(table[column]) for column in table.dtype.names}

    return lambda names: {name: read(name) for name in names}


@pytest.fixture(scope="session")
def in_memory(backlash, recordings):
    """The same case from arrays."""
    import tomllib

    said = tomllib.loads((backlash / "case.toml").read_text())
    kept = {key: said[key] for key in ("model", "parameters", "uncertain", "channels")}
    return tu.Case(train=recordings(said["train"]), holdout=recordings(said["holdout"]), **kept)
