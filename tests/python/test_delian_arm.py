"""DELIAN with its controller (examples/08-delian/delian.toml): what each strategy leaves of the hand's vibration, and where it ends; Figure 12 of the paper."""

import numpy as np
import pyarrow.parquet
import pytest

from conftest import ROOT

STRATEGIES = ("P_PI", "WBC", "VWBC", "VWBC_WASHOUT")
MOVE, STOP = 4.0, 14.0


@pytest.fixture(scope="module")
def packed(trueup, tmp_path_factory):
    folder = tmp_path_factory.mktemp("delian-arm")
    for options in (("FlexibleArm", "--structure", "drive=torque", "--structure", "solver=fixed"), ("ManipulatorController", "--preset", "delian")):
        done = trueup("fmu", "pack", *options, "--fmi", 3, "-o", folder)
        assert done.returncode == 0, done.stderr
    return folder


def run(trueup, packed, strategy, weight=True, stop=STOP, **control):
    """Times and places of the hand, from the beginning of its move."""
    text = (ROOT / "examples/08-delian/delian.toml").read_text().replace("../../delian", str(packed))
    text = text.replace('"reference.csv"', f"'{ROOT}/examples/08-delian/reference.csv'").replace("stop = 14", f"stop = {stop}")
    more = "".join(f", {name} = {value!r}" for name, value in control.items())
    text = text.replace('strategy = "VWBC_WASHOUT"', f'strategy = "{strategy}"{more}')
    if not weight:
        text = text.replace("gravity = [0, 0, -9.81]", "gravity = [0, 0, 0]")
    (packed / "system.toml").write_text(text)
    done = trueup("simulate", packed / "system.toml", "-o", packed / "r.parquet")
    assert done.returncode == 0, done.stderr
    table = pyarrow.parquet.read_table(packed / "r.parquet")
    time = table["time"].to_numpy()
    tip = np.column_stack([table[f"arm.tipPosition[1,{i}]"].to_numpy() for i in (1, 2, 3)])
    return time[time >= MOVE] - MOVE, tip[time >= MOVE]


def vibration(time, x, first_mode, after=0.0):
    """Root mean square about the centred mean over one period of the first mode."""
    half = round(1 / first_mode / (time[1] - time[0])) // 2
    filled = np.concatenate((np.full(half, x[0]), x, np.full(half, x[-1])))
    mean = np.convolve(filled, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid")
    return np.sqrt(np.mean((x - mean)[time >= after] ** 2))


def peak(time, x):
    """Frequency of the largest vibration after the first second, Hz."""
    x = x[time >= 1.0] - np.mean(x[time >= 1.0])
    spectrum = np.abs(np.fft.rfft(x * np.hanning(len(x)), 8 * len(x)))
    frequency = np.fft.rfftfreq(8 * len(x), time[1] - time[0])
    return frequency[frequency > 1.0][np.argmax(spectrum[frequency > 1.0])]


def test_the_example_moves_six_joints(trueup, packed):
    """The short case: the preset has six joints, and after 1.5 s the hand is near its goal."""
    time, tip = run(trueup, packed, "VWBC_WASHOUT", stop=5.5)
    moved = np.linalg.norm(tip - tip[0], axis=1)
    print(f"moved by {1e3 * moved[-1]:.1f} mm")
    assert time[-1] == pytest.approx(1.5) and 0.05 < moved[-1] < 0.5


def goal(trueup, packed, weight):
    """Where the hand is to come to rest: where P/PI, which leaves no static error, holds it."""
    time, tip = run(trueup, packed, "P_PI", weight, stop=24)
    return tip[time > time[-1] - 2.0].mean(axis=0)


@pytest.mark.full
@pytest.mark.parametrize("weight", (True, False))
def test_figure_12_on_the_arm(trueup, packed, weight):
    rest = goal(trueup, packed, weight)
    left, late, ends = {}, {}, {}
    for strategy in STRATEGIES:
        time, tip = run(trueup, packed, strategy, weight)
        if strategy == "P_PI":
            first = peak(time, tip[:, 0])
            print(f"\nweight {weight}: vibration of P/PI at {first:.2f} Hz")
        left[strategy], late[strategy] = (vibration(time, tip[:, 0], first, after) for after in (0.0, 1.0))
        ends[strategy] = 1e3 * np.linalg.norm(tip[-1] - rest)
        less = [100 * (1 - of[strategy] / of["P_PI"]) for of in (left, late)]
        print(f"{strategy}: {less[0]:.1f} % less over the move, {less[1]:.1f} % after 1 s, {ends[strategy]:.1f} mm from the goal after 10 s")
    assert ends["VWBC_WASHOUT"] < 0.5
    if weight:
        assert left["WBC"] < 0.4 * left["P_PI"] and left["VWBC_WASHOUT"] < 0.5 * left["P_PI"]
        assert late["VWBC_WASHOUT"] < 0.15 * late["P_PI"] and late["VWBC"] < 0.15 * late["P_PI"]
        assert ends["WBC"] > 500 and ends["VWBC"] > 30
    else:
        # Dry friction alone takes what P/PI leaves; without a load all arrive.
        assert max(ends.values()) < 0.5
