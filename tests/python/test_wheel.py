"""The Python package as its users get it: a wheel in an environment of its own, and there its tests (crates/python/tests).

TRUEUP_WHEEL names a wheel that is there already."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

pytestmark = pytest.mark.full

REQUIREMENTS = ROOT / "tools" / "python" / "requirements-wheel.txt"


@pytest.fixture(scope="module")
def wheel(trueup, tmp_path_factory):
    """The wheel, with the program under test inside."""
    named = os.environ.get("TRUEUP_WHEEL")
    if named:
        return Path(named)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    begun = {file: file.stat().st_mtime for file in (target / "wheels").glob("*.whl")}
    subprocess.run([ROOT / "tools" / "wheel", trueup.program], check=True, env={**os.environ, "PATH": tools})
    (made,) = (f for f in (target / "wheels").glob("*.whl") if f.stat().st_mtime != begun.get(f))
    return made


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Python of an environment that has the wheel and what its tests need."""
    folder = tmp_path_factory.mktemp("wheel") / "venv"
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / "bin" / "python"
    pip = [python, "-m", "pip", "install", "--quiet", "--no-input", "--disable-pip-version-check"]
    subprocess.run([*pip, wheel, "-r", REQUIREMENTS], check=True)
    return python


def clean():
    """The environment without what leads to another package or program."""
    left_out = ("PYTHONPATH", "TRUEUP_BIN", "TRUEUP_FMUS")
    return {name: value for name, value in os.environ.items() if name not in left_out}


def test_the_wheel_serves_python_from_3_11_on(wheel):
    assert "-cp311-abi3-" in wheel.name


def test_the_program_is_on_the_path(installed, tmp_path):
    program = installed.parent / "trueup"
    run = lambda *arguments: subprocess.run([program, *arguments], capture_output=True, text=True, env=clean())
    assert "identify" in run("--help").stdout
    packed = run("fmu", "pack", "TwoMassJoint", "-o", tmp_path)
    assert packed.returncode == 0, packed.stderr
    assert sorted(f.name for f in tmp_path.iterdir()) == ["TwoMassJoint.fmi2.fmu", "TwoMassJoint.fmi3.fmu"]


def test_the_package_passes_its_tests(installed, tmp_path):
    tests = [installed, "-m", "pytest", "-q", "-p", "no:cacheprovider", ROOT / "crates" / "python" / "tests"]
    done = subprocess.run(tests, env=clean(), cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-8000:] + done.stderr[-2000:]
