"""Every Reference FMU of the Modelica Association that is there, through the program: in Co-Simulation against the output
that it brings along, to rounding; in Model Exchange against FMPy with CVode (what they bring was made by Euler's method).

TRUEUP_REFERENCE_FMUS names a folder with 2.0/<Model>.fmu and 3.0/<Model>.fmu, as their releases are laid out."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

FOLDER = os.environ.get("TRUEUP_REFERENCE_FMUS")
FILES = sorted(Path(FOLDER).glob("[23].0/*.fmu")) if FOLDER else []
named = pytest.mark.parametrize("file", FILES or [None], ids=[f"{f.parent.name}-{f.stem}" for f in FILES] or ["none"])


@pytest.fixture(autouse=True)
def there(file):
    if file is None:
        pytest.skip("TRUEUP_REFERENCE_FMUS names no folder with 2.0/*.fmu and 3.0/*.fmu")


def columns(text):
    """Names and cells of each column."""
    rows = [[cell.strip('"') for cell in line.split(",")] for line in text.splitlines()]
    return dict(zip(rows[0], zip(*rows[1:])))


def brought(file, what):
    with zipfile.ZipFile(file) as z:
        name = f"extra/org.fmi-standard.fmi-ls-ref/{file.stem}_{what}.csv"
        return z.read(name).decode() if name in z.namelist() else None


def run(trueup, file, tmp_path, interface, *options):
    given = brought(file, "in")
    if given:
        (tmp_path / "in.csv").write_text(given)
        options = (*options, "--input", tmp_path / "in.csv")
    done = trueup("simulate", file, "--interface", interface, "-o", tmp_path / "r.csv", *options)
    assert done.returncode == 0, done.stderr
    return columns((tmp_path / "r.csv").read_text())


@named
def test_co_simulation(trueup, file, tmp_path):
    description = read_model_description(file, validate=False)
    if description.coSimulation is None:
        pytest.skip("offers no Co-Simulation")
    expected = columns(brought(file, "out") or "time")
    outputs = {v.name for v in description.modelVariables if v.causality == "output" and v.type != "Binary"} & set(expected)
    if not outputs:
        # Roberts: what it brings is another model's. It runs, without the event mode that it declares and refuses.
        table = run(trueup, file, tmp_path, "cs", "--start", 0, "--stop", 0.4, "--step", 0.1)
        assert len(table["time"]) == 5
        return
    time = [float(t) for t in expected["time"]]
    stop = max(time[-1], float(description.defaultExperiment.stopTime or 0))
    table = run(trueup, file, tmp_path, "cs", "--stop", repr(stop), "--step", repr(time[1] - time[0]))
    compared = equal(table, expected, outputs)
    print(f"\n{file.parent.name} {file.stem}: {compared} values of {len(outputs)} outputs")
    assert compared >= len(time)


def equal(table, expected, names):
    """Compares every number to rounding; an array is one column there, one for each element here."""
    last = {round(float(t), 9): row for row, t in enumerate(table["time"])}  # of two rows at an event the last one
    compared = 0
    for name in names:
        own = [name] if name in table else [n for n in table if n.startswith(f"{name}[")]
        assert own, f"{name} is not there"
        for t, cell in zip(expected["time"], expected[name]):
            for n, text in zip(own, cell.split() if len(own) > 1 else [cell], strict=True):
                try:
                    want = float(text)
                except ValueError:
                    continue  # texts and bytes
                have = float(table[n][last[round(float(t), 9)]])
                assert abs(have - want) <= 1e-12 * max(1.0, abs(want)), (n, t, have, want)
                compared += 1
    return compared


# Events at the very end are not everybody's.
STOP = {"BouncingBall": 2.4, "Roberts": 40.0, "Stair": 8.9}


@named
def test_model_exchange(trueup, file, tmp_path):
    description = read_model_description(file, validate=False)
    if description.modelExchange is None:
        pytest.skip("offers no Model Exchange")
    outputs = [v for v in description.modelVariables if v.causality == "output" and v.type != "Binary"]
    expected = columns(brought(file, "out") or "time")
    if not any(v.derivative for v in description.modelVariables):
        # Nothing is integrated, so what it brings holds to rounding.
        names = {v.name for v in outputs} & set(expected)
        step = float(expected["time"][1]) - float(expected["time"][0])
        table = run(trueup, file, tmp_path, "me", "--stop", expected["time"][-1], "--step", repr(step))
        assert equal(table, expected, names) >= len(expected["time"])
        return
    names = [v.name for v in outputs if v.type in ("Real", "Float64")]
    stop = STOP.get(file.stem, float(description.defaultExperiment.stopTime or 1))
    step = stop / 100
    table = run(trueup, file, tmp_path, "me", "--start", 0, "--stop", stop, "--step", repr(step), "--tolerance", 1e-9)
    other = simulate_fmu(
        str(file), fmi_type="ModelExchange", solver="CVode", start_time=0.0, stop_time=stop, output_interval=step,
        relative_tolerance=1e-9, output=names,
    )
    assert abs(float(table["time"][-1]) - other["time"][-1]) < 1e-9
    compared = 0
    for name, element in ((name, n) for name in names for n in table if n == name or n.startswith(f"{name}[")):
        every = other[name].reshape(len(other), -1)[:, 0 if element == name else int(element.split("[")[1][:-1]) - 1]
        ours, theirs, scale = float(table[element][-1]), float(every[-1]), np.max(np.abs(every))
        compared += 1
        print(f"\n{file.parent.name} {file.stem} {element}: {ours!r}, CVode {theirs!r}")
        assert abs(ours - theirs) <= 1e-6 * scale, (element, ours, theirs)
    assert compared
