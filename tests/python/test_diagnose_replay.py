"""The augmented FMUs of a diagnosis, played by FMPy on held-out recordings, give the gap that the report gives.

Contract, section 4: a free run over the whole recording, driven by the measured inputs, only the first state estimated, by least
squares over the sensors' noise. The estimation here is SciPy's.
"""

import json
import os
import subprocess
import tomllib

import numpy as np
import pytest
from scipy.optimize import least_squares

from low_level import Opened

STATES = ["initialMotorAngle", "initialMotorVelocity", "initialLoadAngle", "initialLoadVelocity"]
CHANNELS = ["motorAngle", "loadAngle"]


def run(*command):
    program = os.environ.get("TRUEUP_BIN")
    if not program:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    done = subprocess.run([program, *map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """A joint with play that its model does not know."""
    folder = tmp_path_factory.mktemp("replay")
    run("trial", "generate", "-o", folder, "--plant", "joint", "--split", "single", "--count", "8", "--seed", "100")
    keys = [tomllib.loads(p.read_text()) for p in sorted((folder / "keys").iterdir())]
    key = next(k for k in keys if k["effects"] == ["backlash"])
    case = folder / "cases" / key["case"]
    return case, folder / "out", json.loads(run("diagnose", case, "-o", folder / "out", "--json"))


def play(opened, start, time, current):
    """Outputs at `time`, the current held between its samples, as the case declares it."""
    opened.fmu.reset()
    opened.initialize(start, float(time[-1]))
    shown = np.empty((len(time), len(CHANNELS)))
    for k, t in enumerate(time):
        shown[k] = [opened.get(c) for c in CHANNELS]
        if k + 1 < len(time):
            opened.set("motorCurrent", float(current[k]))
            opened.fmu.doStep(currentCommunicationPoint=float(t), communicationStepSize=float(time[k + 1] - t))
    return shown


@pytest.mark.parametrize("version", [2, 3])
def test_the_replay_gives_the_figures_of_the_report(diagnosed, version):
    case, out, diagnosis = diagnosed
    told = tomllib.loads((case / "case.toml").read_text())
    assert told["channels"]["motorCurrent"]["interpolation"] == "hold"
    sensors = [told["channels"][c] for c in CHANNELS]
    sigma = np.array([np.hypot(s.get("noise", 0), s.get("resolution", 0) / np.sqrt(12)) for s in sensors])
    assert diagnosis["augmented"] == [f"TwoMassJoint.augmented.fmi{v}.fmu" for v in (2, 3)]
    squares, variation = np.zeros(2), np.zeros(2)
    with Opened(out / f"TwoMassJoint.augmented.fmi{version}.fmu", "CS") as opened:
        opened.initialize()
        for name in told["holdout"]:
            rows = np.genfromtxt(case / name, delimiter=",", names=True)
            time = rows["time"] - rows["time"][0]
            measured = np.column_stack([rows[c] for c in CHANNELS])
            first = [np.polyfit(time[:25], measured[:25, c], 2) for c in range(2)]
            start = np.array([first[0][2], first[0][1], first[1][2], first[1][1]])
            scale = np.array([sigma[0], 100 * sigma[0], sigma[1], 100 * sigma[1]])

            def residual(x):
                shown = play(opened, dict(zip(STATES, start + scale * x)), time, rows["motorCurrent"])
                return ((shown - measured) / sigma).ravel()

            found = least_squares(residual, np.zeros(4), diff_step=0.05, x_scale=1.0, max_nfev=12)
            error = found.fun.reshape(-1, 2) * sigma
            squares += (error**2).sum(axis=0)
            variation += ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
    gaps = np.sqrt(squares / variation)
    report = diagnosis["gap"]
    for channel, gap in zip(CHANNELS, gaps):
        print(f"FMI {version} {channel}: replay {gap:.6f}, report {report['channels'][channel]['after']:.6f}")
    overall = np.sqrt((gaps**2).mean())
    print(f"FMI {version} overall: replay {overall:.6f}, report {report['overall']['after']:.6f}")
    assert overall == pytest.approx(report["overall"]["after"], rel=0.01)
    for channel, gap in zip(CHANNELS, gaps):
        assert gap == pytest.approx(report["channels"][channel]["after"], rel=0.01)
