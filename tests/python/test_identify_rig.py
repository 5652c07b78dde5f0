"""`trueup identify --with` on public recordings of a real rig: DFKI's double pendulum, design A.0 (docs/real-data.md)."""

import csv
import gzip
import json

import pytest
from test_rig import data

CASE = """model = "PlanarManipulator"
train = ["055032.csv", "055640.csv"]
holdout = ["055903.csv"]
[parameters]
jointFlexible = [false, false]
base = "fixed"
gravity = [0.0, -9.81]
initialBaseAttitude = -1.5707963267948966
mountPosition = [0.0, 0.0]
linkMass = [0.608, 0.63]
linkInertia = [0.05472, 0.02522]
linkLength = [0.3, 0.2]
linkCenterOfMass = [[0.275, 0.0], [0.166, 0.0]]
[uncertain]
linkMass = 0.05
linkInertia = 0.2
[fit]
parameters = ["linkInertia"]
[channels.jointAngle]
noise = 5e-4
"""
COLUMNS = ("time", "tau1", "tau2", "pos1", "pos2")


def recording(source, to, seconds):
    """Torques as recorded, every fifth angle."""
    with gzip.open(source, "rt") as f:
        head, *rows = csv.reader(f)
    at = [[h.strip() for h in head].index(name) for name in COLUMNS]
    lines, last = ["time,jointTorque[1],jointTorque[2],jointAngle[1],jointAngle[2]"], -1.0
    for k, row in enumerate(rows):
        values = [row[i] for i in at]
        if last < float(values[0]) <= seconds:
            last = float(values[0])
            lines.append(",".join(values if k % 5 == 0 else [*values[:3], "", ""]))
    to.write_text("\n".join(lines) + "\n")


@pytest.mark.full
def test_friction_helps_on_a_recording_that_was_not_fitted(trueup, tmp_path):
    folder = data() / "dfki_double_pendulum" / "A0_20220812"
    for name in ("055032", "055640", "055903"):
        recording(folder / f"sys_id_20220812-{name}-PM_measured.csv.gz", tmp_path / f"{name}.csv", 2.0)
    (tmp_path / "case.toml").write_text(CASE)
    done = trueup("identify", tmp_path, "--fast", "--with", "motor-friction", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    error = lambda key: [found[key][f"jointAngle[{j}]"]["nrmse"] for j in (1, 2)]
    friction = found["parameters"]["coulombFriction[2]"]
    print("as published", error("nominal_fit"), "refitted", error("fit_without_effects"), "with friction", error("fit"), friction)
    assert all(a < b for a, b in zip(error("fit"), error("fit_without_effects")))
    # Between what the two published models say, 0.078 and 0.186 N.m.
    assert 0.078 < friction["value"] < 0.186
    # It says that the model lacks more.
    assert any("above its noise floor" in note for note in found["notes"])
