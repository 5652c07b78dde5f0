"""Results as Python reads them: CSV through FMPy, Parquet through pyarrow, the same bits in both."""

import csv as csv_module
import json
import os
import pty
import re
import signal
import subprocess
import time

import numpy as np
import pyarrow.parquet
import pytest
from conftest import BY_VERSION, from_environment
from fmpy.util import read_csv


def columns(file):
    """What FMPy's reader, which has no quotes, does not read: names with commas, as of arrays of two dimensions."""
    with open(file, newline="") as f:
        names, *rows = csv_module.reader(f)
    return np.array([tuple(map(float, row)) for row in rows], dtype=[(name, float) for name in names])


@pytest.mark.parametrize("model, version", BY_VERSION)
def test_csv_and_parquet_hold_the_same_bits(trueup, fmu, tmp_path, model, version):
    for name in ("r.csv", "r.parquet"):
        done = trueup("simulate", fmu(model, version), "--stop", 0.5, "--step", 0.001, "-o", tmp_path / name)
        assert done.returncode == 0, done.stderr
    csv = columns(tmp_path / "r.csv") if model in ("SpatialFreeFlyer", "FreeBody", "FlexibleArm", "SpaceController") else read_csv(tmp_path / "r.csv")
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    assert tuple(table.column_names) == csv.dtype.names
    # In FMI 3.0 balls of the capture that part and come back are two events, each a row before and one after it; three motors of the arm
    # break away or come to rest.
    events = {("CaptureScene", 3): 4, ("FlexibleArm", 3): 6}.get((model, version), 0)
    assert len(csv) == table.num_rows == 501 + events
    for name in table.column_names:
        column = table[name].to_numpy()
        assert np.array_equal(column.astype(float).view(np.int64), csv[name].view(np.int64)), name

    info = json.loads(trueup("fmu", "info", "--json", fmu(model, version)).stdout)
    metadata = table.schema.metadata
    assert metadata[b"unit.time"] == b"s"
    units = {v["name"]: v["unit"] for v in info["variables"] if v.get("unit")}
    for name in table.column_names[1:]:
        unit = units.get(name, units.get(name.split("[")[0]))
        assert metadata.get(f"unit.{name}".encode(), b"").decode() == (unit or ""), name


def test_a_plot_opens_without_anything_else(trueup, fmu, tmp_path):
    page = tmp_path / "plot.html"
    done = trueup("simulate", fmu("TwoMassJoint", 3), "--plot", page, "-o", tmp_path / "r.csv")
    assert done.returncode == 0, done.stderr
    html = page.read_text()
    assert html.count("<svg ") >= 5
    for variable in read_csv(tmp_path / "r.csv").dtype.names[1:]:
        assert variable in html
    assert not any(elsewhere in html for elsewhere in (" src=", "href=", "@import"))


def test_ctrl_c_keeps_what_was_computed(fmu, tmp_path):
    program = from_environment("TRUEUP_BIN")
    arguments = ["simulate", fmu("TwoMassJoint", 2), "--stop", "1e6", "--step", "1e-4", "-o", tmp_path / "r.parquet"]
    run = subprocess.Popen([program, *map(str, arguments)], stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob(".r.parquet.*.part")):  # it has begun
        time.sleep(0.01)
    time.sleep(0.5)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert run.returncode == 1 and "interrupted" in said and "r.partial.parquet" in said
    assert [file.name for file in tmp_path.iterdir()] == ["r.partial.parquet"]
    times = pyarrow.parquet.read_table(tmp_path / "r.partial.parquet")["time"].to_numpy()
    assert len(times) > 1 and times[0] == 0 and np.allclose(np.diff(times), 1e-4)


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_tells_how_far_the_run_is_and_what_is_left(fmu, tmp_path, terminal):
    program, stop = from_environment("TRUEUP_BIN"), 3e4
    arguments = ["simulate", fmu("TwoMassJoint", 2), "--stop", stop, "--step", "1e-3", "-o", tmp_path / "r.parquet"]
    # A terminal gets it by default; a pipe only if requested.
    here, there = pty.openpty() if terminal else os.pipe()
    run = subprocess.Popen([program, *map(str, arguments), *([] if terminal else ["--progress"])], stderr=there)
    os.close(there)
    told, said = {}, ""
    line = re.compile(r"(\d+) %  t = ([0-9.]+) s, (\d+)([a-z]+) left")
    while len(told) < 2:
        said += os.read(here, 4096).decode()
        told = {float(t): (int(percent), left, unit) for percent, t, left, unit in line.findall(said)}
        assert run.poll() is None, said
    run.send_signal(signal.SIGINT)
    while True:  # so that the program does not wait for us
        try:
            if not os.read(here, 4096):
                break
        except OSError:  # the terminal is gone with the program
            break
    os.close(here)
    assert run.wait(timeout=60) == 1
    for t, (percent, left, unit) in told.items():
        assert 0 < t < stop and abs(percent - 100 * t / stop) <= 2, said
        assert int(left) > 0 and unit in ("s", "m", "h"), said


def test_a_pipe_hears_no_progress_unless_asked_for(fmu, tmp_path):
    program = from_environment("TRUEUP_BIN")
    arguments = ["simulate", fmu("TwoMassJoint", 2), "--stop", "1e6", "--step", "1e-3", "-o", tmp_path / "r.parquet"]
    run = subprocess.Popen([program, *map(str, arguments)], stderr=subprocess.PIPE, text=True)
    time.sleep(2)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert run.returncode == 1 and "interrupted" in said and " left" not in said
