"""FMUs written in Python, made here by PythonFMU (FMI 2.0) and PythonFMU3 (FMI 3.0), in the master: alone, fed from a file,
coupled with each other and with ours, and failing."""

import subprocess
import sys

import numpy as np
import pytest

# x' = u - x / tau, stepped exactly for inputs that are held.
LAG = """
from math import exp

from {package} import {fmi}Causality, {fmi}Slave, {fmi}Variability, Boolean, {integer}, {real}, String


class {name}({fmi}Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.u, self.x, self.tau, self.steps, self.late, self.word, self.fault = 0.0, 0.0, 1.0, 0.5, 0, False, "none", 0
        continuous = dict(variability={fmi}Variability.continuous)
        discrete = dict(causality={fmi}Causality.output, variability={fmi}Variability.discrete)
        {time}
        self.register_variable({real}("u", causality={fmi}Causality.input, **continuous))
        self.register_variable({real}("x", causality={fmi}Causality.output, **continuous))
        self.register_variable({real}("tau", causality={fmi}Causality.parameter, variability={fmi}Variability.fixed))
        self.register_variable({integer}("fault", causality={fmi}Causality.parameter, variability={fmi}Variability.fixed))
        self.register_variable({integer}("steps", **discrete))
        self.register_variable(Boolean("late", **discrete))
        self.register_variable(String("word", **discrete))

    def do_step(self, time, step):
        if self.fault == 1 and time > 0.45:
            raise RuntimeError("the lag is broken")
        if self.fault == 2 and time > 0.45:
            return False
        if self.fault == 3 and time > 0.45:
            self.x = float("nan")
            return True
        rest = self.u * self.tau
        self.x = rest + (self.x - rest) * exp(-step / self.tau)
        self.steps += 1
        self.late = time + step > 0.5
        self.word = "step %d" % self.steps
        return True
"""
PACKAGES = {2: ("pythonfmu", "Fmi2", "Integer", "Real"), 3: ("pythonfmu3", "Fmi3", "Int32", "Float64")}
TIME = {2: "", 3: 'self.register_variable(Float64("time", causality=Fmi3Causality.independent, **continuous))'}
H = 0.1


@pytest.fixture(scope="module")
def folder(tmp_path_factory, trueup):
    folder = tmp_path_factory.mktemp("pythonfmu")
    for version, (package, fmi, integer, real) in PACKAGES.items():
        pytest.importorskip(package, reason=f"{package} is not installed: run ./test")
        text = LAG.format(name=f"Lag{version}", package=package, fmi=fmi, integer=integer, real=real, time=TIME[version])
        (folder / f"lag{version}.py").write_text(text)
        subprocess.run([sys.executable, "-m", package, "build", "-f", f"lag{version}.py", "-d", "."], cwd=folder, check=True)
        assert (folder / f"Lag{version}.fmu").is_file()
    done = trueup("simulate", folder / "Lag2.fmu", "-o", folder / "probe.csv")
    if "needs Python's library" in done.stderr:
        pytest.skip(f"PythonFMU needs Python's shared library: {done.stderr.strip()}")
    return folder


def read(file):
    """The columns that are numbers."""
    head, *rows = (line.split(",") for line in file.read_text().splitlines())
    return {n: np.array([float(row[k]) for row in rows]) for k, n in enumerate(head) if not n.endswith("word")}


def lag(x, u, h=H, tau=0.5):
    return u * tau + (x - u * tau) * np.exp(-h / tau)


@pytest.mark.parametrize("version", PACKAGES)
def test_alone(trueup, folder, version):
    (folder / "in.csv").write_text("time,u\n0,1\n0.45,1\n0.46,3\n1,3\n")
    results = folder / f"alone{version}.csv"
    done = trueup("simulate", folder / f"Lag{version}.fmu", "--stop", 1, "--step", H, "--input", folder / "in.csv", "-o", results, "--algorithm", "jacobi")
    assert done.returncode == 0, done.stderr
    rows = [line.split(",") for line in results.read_text().splitlines()]
    assert rows[0] == ["time", "x", "steps", "late", "word"]
    assert [row[2] for row in rows[1:]] == [str(k) for k in range(11)]
    assert [row[3] for row in rows[1:]] == ["0"] * 6 + ["1"] * 5
    assert [row[4] for row in rows[1:]] == ["none"] + [f"step {k}" for k in range(1, 11)]
    x = 1.0
    for k in range(11):
        assert abs(float(rows[1 + k][1]) - x) < 1e-14, k
        x = lag(x, 1.0 if k < 5 else 3.0)


SYSTEM = """
connections = ["a.x -> b.u", "b.x -> a.u"]
[run]
stop = 1
step = {h}
algorithm = "{algorithm}"
[components.a]
fmu = "Lag{a}.fmu"
[components.b]
fmu = "Lag{b}.fmu"
start = {{ tau = 2.0, fault = {fault} }}
"""


def coupled(trueup, folder, a, b, algorithm="jacobi", fault=0, h=H):
    (folder / "system.toml").write_text(SYSTEM.format(a=a, b=b, algorithm=algorithm, fault=fault, h=h))
    results = folder / "system.csv"
    results.unlink(missing_ok=True)
    return trueup("simulate", folder / "system.toml", "-o", results), results


@pytest.mark.parametrize(
    "a, b", [pytest.param(a, b, marks=[] if (a, b) == (3, 2) else pytest.mark.full) for a in PACKAGES for b in PACKAGES]
)
def test_coupled_with_each_other(trueup, folder, a, b):
    done, results = coupled(trueup, folder, a, b)
    assert done.returncode == 0, done.stderr
    table, x, y = read(results), 1.0, 1.0
    for k in range(11):
        assert abs(table["a.x"][k] - x) < 1e-14 and abs(table["b.x"][k] - y) < 1e-14, k
        x, y = lag(x, y), lag(y, x, tau=2.0)
    # Held inputs are of first order, lines (in two parts of a step) of second.
    exact = np.array([[-2.0, 1.0], [1.0, -0.5]])
    values, vectors = np.linalg.eigh(exact)
    exact = vectors @ np.diag(np.exp(values)) @ vectors.T @ [1.0, 1.0]
    for algorithm, order in (("jacobi", 1), ("extrapolate", 2)):
        errors = []
        for h in (0.02, 0.01):
            done, results = coupled(trueup, folder, a, b, algorithm, h=h)
            assert done.returncode == 0, done.stderr
            table = read(results)
            errors.append(np.hypot(table["a.x"][-1] - exact[0], table["b.x"][-1] - exact[1]))
        print(f"\nFMI {a} and {b}, {algorithm}: {errors}")
        assert abs(np.log2(errors[0] / errors[1]) - order) < 0.15, errors


@pytest.mark.parametrize("version", PACKAGES)
def test_with_ours(trueup, fmu, folder, version):
    """By itself the master holds the inputs of an FMU that declares nothing, and calls it as often as requested; with lines requested, it makes some."""
    system = f"""
connections = ["plant.motorVelocity -> lag.u"]
[run]
stop = 0.5
step = 0.001
[components.plant]
fmu = '{fmu("TwoMassJoint", 5 - version)}'
start = {{ initialMotorVelocity = 100.0 }}
[components.lag]
fmu = "Lag{version}.fmu"
"""
    tables = []
    for text in (system, system.replace("[run]", '[run]\nalgorithm = "gauss-seidel"')):
        (folder / "ours.toml").write_text(text)
        done = trueup("simulate", folder / "ours.toml", "-o", folder / "ours.csv")
        assert done.returncode == 0, done.stderr
        tables.append(read(folder / "ours.csv"))
    held, lines = tables
    x = 1.0
    for u in held["plant.motorVelocity"][:-1]:
        x = lag(x, u, 0.001)
    assert abs(held["lag.x"][-1] - x) < 1e-12 * abs(x) and held["lag.steps"][-1] == 500
    time, u = lines["time"], lines["plant.motorVelocity"]
    # The lag's own equation, integrated over what was recorded.
    weight = np.exp((time - time[-1]) / 0.5)
    expected = weight[0] + np.trapezoid(weight * u, time)
    assert abs(lines["lag.x"][-1] - expected) < 1e-4 * abs(expected)


@pytest.mark.parametrize("version", PACKAGES)
@pytest.mark.parametrize("fault, words", ((1, ("DoStep", '"b"')), (3, ("NaN", "x of instance \"b\""))))
def test_what_goes_wrong_is_said(trueup, folder, version, fault, words):
    done, results = coupled(trueup, folder, 2, version, fault=fault)
    assert done.returncode == 1, done.stderr
    assert not results.exists() and (folder / "system.partial.csv").is_file()
    for word in ("system.toml", "t = 0.", *words):
        assert word.lower() in done.stderr.lower(), done.stderr


def test_a_step_that_returns_false(trueup, folder):
    """PythonFMU then requests the end of the run, PythonFMU3 reports that no step is short enough."""
    done, results = coupled(trueup, folder, 2, 2, fault=2)
    assert done.returncode == 0 and "`b` ended the run" in done.stderr and read(results)["time"][-1] == 0.5
    done, results = coupled(trueup, folder, 2, 3, fault=2)
    assert done.returncode == 1 and "Discard" in done.stderr and '"b"' in done.stderr and not results.exists()
