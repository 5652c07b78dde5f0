"""A capture coupled out of three FMUs (examples/capture-coupled.toml) against the same capture in one; benchmark_contact.py has the whole table."""

import csv

import numpy as np
import pytest
from conftest import ROOT

MASS, SPEED = 1778.7, 0.005  # of the chaser
STOP = 30.0


@pytest.fixture(scope="module")
def simulated(trueup, fmus, tmp_path_factory):
    """simulated(text) is the last row of a run of a system."""
    folder = tmp_path_factory.mktemp("contact")

    def run(text):
        (folder / "system.toml").write_text(text)
        done = trueup("simulate", "system.toml", "-o", "r.csv", cwd=folder)
        assert done.returncode == 0, done.stderr
        with open(folder / "r.csv") as file:
            rows = list(csv.reader(file))
        return {name: float(v) for name, v in zip(rows[0], rows[-1]) if v not in ("true", "false")}

    return run


@pytest.fixture(scope="module")
def in_one(simulated, fmus):
    scene = fmus / "CaptureScene.fmi3.fmu"
    return simulated(
        f'[run]\nstop = {STOP}\nstep = 0.1\ntolerance = 1e-12\n[components.scene]\nfmu = "{scene}"\ninterface = "model-exchange"\n'
    )


def coupled(simulated, fmus, algorithm):
    text = (ROOT / "examples/capture-coupled.toml").read_text()
    assert '"extrapolate"' in text
    return simulated(text.replace('"extrapolate"', f'"{algorithm}"').replace("../out", str(fmus)))


def test_three_fmus_come_to_what_one_comes_to(simulated, fmus, in_one):
    off, made = {}, {}
    wanted = [in_one[f"scene.targetVelocity[{i}]"] - in_one[f"scene.chaserVelocity[{i}]"] for i in (1, 2)]
    for algorithm in ("jacobi", "extrapolate"):
        row = coupled(simulated, fmus, algorithm)
        have = [row[f"target.velocity[{i}]"] - row[f"chaser.velocity[{i}]"] for i in (1, 2)]
        off[algorithm] = np.hypot(*np.subtract(have, wanted))
        stored = row["chaser.kineticEnergy"] + row["target.kineticEnergy"] + row["contact.elasticEnergy"]
        made[algorithm] = stored + row["contact.dissipatedEnergy"] - row["contact.jawWork"] - 0.5 * MASS * SPEED**2
        # What acts is as large as what acts back. (Levers move during a step: of the moment of momentum that does not hold.)
        momentum = [row[f"chaser.linearMomentum[{i}]"] + row[f"target.linearMomentum[{i}]"] for i in (1, 2)]
        assert np.allclose(momentum, [MASS * SPEED, 0.0], rtol=0, atol=1e-10 * MASS * SPEED)
        assert row["contact.outcome"] == in_one["scene.outcome"]
    print("final relative velocity off by", off, "m/s; energy that the coupling made:", made, "J")
    assert np.hypot(*wanted) > 0.02
    assert 10 * off["extrapolate"] < off["jacobi"] < 1e-4
    # Forces that come a step late push what they should slow down.
    assert made["jacobi"] > 20 * abs(made["extrapolate"])
