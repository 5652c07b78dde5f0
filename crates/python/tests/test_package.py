"""Types, the program in the wheel, how long an import takes."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import trueup as tu

USE = """
import numpy as np
import trueup as tu

model = tu.Model("TwoMassJoint", effects=["backlash"])
t = np.linspace(0, 1, 101)
run: tu.Result = model.simulate(t, {"motorCurrent": 0.02 * np.sin(t)}, {"stiffness": 2e-5})
reveal: float = float(run["loadAngle"][-1])
fit: tu.Fit = tu.identify(tu.Case("case"))
verdict: str = tu.diagnose("case", progress=True).verdict
"""


def mypy(*arguments):
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", *arguments], capture_output=True, text=True)


def test_the_package_is_typed(tmp_path):
    done = mypy("-p", "trueup")
    assert done.returncode == 0, done.stdout
    (tmp_path / "use.py").write_text(USE)
    done = mypy(str(tmp_path / "use.py"))
    assert done.returncode == 0, done.stdout
    (tmp_path / "wrong.py").write_text(USE + 'model.simulate(step="a")\n')
    assert mypy(str(tmp_path / "wrong.py")).returncode == 1


def test_the_program_is_the_packages():
    done = subprocess.run([tu.program(), "--help"], capture_output=True, text=True)
    assert done.returncode == 0 and "diagnose" in done.stdout
    if "TRUEUP_BIN" not in os.environ:
        assert Path(tu.program()).parent == Path(sys.prefix) / "bin"


def test_an_import_is_quick():
    """Processor time; most of it is NumPy's."""

    def seconds(code):
        def once():
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", code], check=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

        return min(once() for _ in range(5))

    assert seconds("import trueup") - seconds("import numpy") < 0.1
    # What is imported on use is not imported before.
    code = "import sys, trueup; print({'pandas', 'xarray', 'arviz', 'matplotlib', 'dask'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "set()"
