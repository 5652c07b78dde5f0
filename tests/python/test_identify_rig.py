"""`trueup identify --with` on public recordings of a real rig: DFKI's double pendulum, design A.0 (docs/real-data.md)."""

import csv
import gzip
import json

import pytest
from test_rig import data

CASE = """model = "PlanarManipulator"
train = ["055032.csv", "055640.csv", "060245.csv", "060440.csv"]
holdout = ["055903.csv"]
[parameters]
jointFlexible = [false, false]
base = "fixed"
gravity = [0.0, -9.81]
initialBaseAttitude = -1.5707963267948966
mountPosition = [0.0, 0.0]
linkMass = [0.608, 0.63]
linkInertia = [0.00874, 0.00786]
motorInertia = [0.00219, 0.00219]
linkLength = [0.3, 0.2]
linkCenterOfMass = [[0.275, 0.0], [0.166, 0.0]]
[uncertain]
linkMass = 0.05
linkCenterOfMass = 0.1
linkInertia = 0.5
[fit]
parameters = ["linkInertia"]
[channels.jointTorque]
offset = { value = 0.0, doubt = 0.05 }
[channels.jointAngle]
noise = 0.02
offset = { value = 0.0, doubt = 0.03 }
"""
# Published inertias are about the joints, 0.05472 and 0.02522 kg.m2, and 6.07e-5 kg.m2 of a rotor turns six times as fast;
# what a free run of 5 s leaves, most by torques that are not as recorded, is some 20 mrad.
PUBLISHED = {
    "linkMass[1]": (0.559, 0.608),
    "linkMass[2]": (0.604, 0.630),
    "linkCenterOfMass[1,1]": (0.275, 0.300),
    "linkCenterOfMass[2,1]": (0.166, 0.184),
    "linkInertia[2]": (0.0035, 0.00786),
    "coulombFriction[2]": (0.078, 0.186),
    "viscousFriction[2]": (0.0, 0.001),
}
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
def test_published_parameters_and_a_recording_that_was_not_fitted(trueup, tmp_path):
    folder = data() / "dfki_double_pendulum" / "A0_20220812"
    for name in ("055032", "055640", "060245", "060440", "055903"):
        recording(folder / f"sys_id_20220812-{name}-PM_measured.csv.gz", tmp_path / f"{name}.csv", 5.0)
    (tmp_path / "case.toml").write_text(CASE)
    done = trueup("identify", tmp_path, "--fast", "--with", "motor-friction", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    error = lambda key: [found[key][f"jointAngle[{j}]"]["nrmse"] for j in (1, 2)]
    print("as published", error("nominal_fit"), "refitted", error("fit_without_effects"), "with friction", error("fit"))
    assert all(a < b for a, b in zip(error("fit"), error("fit_without_effects")))
    assert all(3.0 * a < b for a, b in zip(error("fit"), error("nominal_fit")))
    values = found["parameters"] | found["uncertain"]
    for name, (low, high) in PUBLISHED.items():
        (least, most), value = values[name]["ci95"], values[name]["value"]
        print(f"{name} {value:.4g} [{least:.4g}, {most:.4g}], published {low} to {high}")
        assert least <= high and low <= most, name
    # It reports that the model lacks more: joint 1's inertia and friction are not as published (docs/real-data.md).
    assert any("above its noise floor" in note for note in found["notes"])
