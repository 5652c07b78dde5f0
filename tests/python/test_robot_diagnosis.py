"""A robot from its file under `identify` and `diagnose`.

The rig is an FMU of another configuration, simulated by the master, its readings with noise. Robots of another simulator: the trials
(`--plant held-arm`), with --full.
"""

import csv
import json

import numpy as np
import pytest

from test_payload import run

ARM = """[base]
mass = 5.0
inertia = [[0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]]
held = true

[[body]]
name = "upper"
mass = 2.0
center-of-mass = [0.2, 0, 0]
inertia = [[0.004, 0, 0], [0, 0.03, 0], [0, 0, 0.03]]
position = [0, 0, 0.3]
axis = [0, -1, 0]
motor = { inertia = 0.2, gear-ratio = 50 }

[[body]]
name = "lower"
mass = 1.0
center-of-mass = [0.15, 0, 0]
inertia = [[0.002, 0, 0], [0, 0.01, 0], [0, 0, 0.01]]
position = [0.4, 0, 0]
axis = [0, -1, 0]
motor = { inertia = 0.1, gear-ratio = 50 }

[[tip]]
offset = [0.3, 0, 0]
"""
FRICTION = {"coulombFriction": [0.6, 0.3], "staticFriction": [0.6, 0.3], "viscousFriction": [0.4, 0.2]}
CASE = """model = "SpatialFreeFlyer"
robot = "arm.toml"
train = ["train-1.csv", "train-2.csv"]
holdout = ["holdout.csv"]

[parameters]
gravity = [0, 0, -9.81]

[uncertain]
bodyMass = 0.05

[effects]
motor-friction = { coulombFriction = [0.6, 0.3], staticFriction = [0.6, 0.3], viscousFriction = [0.4, 0.2], doubt = 0.1 }
"""
NOISE = 5e-5
NAMES = [f"{name}[{j}]" for name in ("jointTorque", "motorAngle") for j in (1, 2)]


def recording(folder, fmu, file, seed, sets):
    """Six seconds at 100 Hz of an arm that swings about where it hangs."""
    random = np.random.default_rng(seed)
    t = np.arange(0, 6.001, 0.01)
    tones = [sum(a * np.sin(2 * np.pi * f * t + p) for f, p in random.uniform([0.3, 0], [1.2, 6.28], (3, 2))) for a in (3.0, 1.2)]
    drive, shown = folder / "drive.csv", folder / "shown.csv"
    np.savetxt(drive, np.column_stack([t, *tones]), delimiter=",", header='time,"jointTorque[1]","jointTorque[2]"', comments="", fmt="%.9g")
    start = ["--set", "gravity=0,0,-9.81", "--set", "initialJointAngle=-1.5708,0"]
    done = run("simulate", fmu, "--input", drive, "--stop", 6, "--step", 0.01, "--outputs", "motorAngle", *start, *sets, "-o", shown)
    assert done.returncode == 0, done.stderr
    at = {round(float(row["time"]), 6): row for row in csv.DictReader(shown.open())}
    with (folder / file).open("w") as out:
        out.write("time," + ",".join(f'"{name}"' for name in NAMES) + "\n")
        for k, x in enumerate(t):
            angles = [float(at[round(x, 6)][name]) + random.normal(0, NOISE) for name in NAMES[2:]]
            out.write(",".join(f"{v:.9g}" for v in (x, tones[0][k], tones[1][k], *angles)) + "\n")


def made(folder, seed, effect=None, sets=(), case=CASE):
    """A case whose rig has an effect more, and other values."""
    folder.mkdir(exist_ok=True)
    (folder / "arm.toml").write_text(ARM)
    channels = "".join(f'\n[channels."{name}"]\nnoise = {NOISE}\n' for name in NAMES[2:])
    (folder / "case.toml").write_text(case + channels)
    effects = [x for e in ("motor-friction", effect) if e for x in ("--effect", e)]
    work = folder.parent / "rig"
    done = run("fmu", "pack", "SpatialFreeFlyer", "--robot", folder / "arm.toml", *effects, "--fmi", 3, "-o", work)
    assert done.returncode == 0, done.stderr
    values = [f"{name}={','.join(map(str, value))}" for name, value in FRICTION.items()] + list(sets)
    sets = [x for value in values for x in ("--set", value)]
    fmu = next(work.glob("*.fmu"))
    for k, file in enumerate(["train-1.csv", "train-2.csv", "holdout.csv"]):
        recording(folder, fmu, file, 10 * seed + k, sets)
    return folder


def diagnosed(case, *more):
    done = run("diagnose", case, "-o", case.parent / "out", *more)
    assert done.returncode == 0, done.stderr
    return json.loads((case.parent / "out/diagnosis.json").read_text()), done.stdout


def test_an_effect_of_a_joint_is_named_and_ships(tmp_path):
    case = made(tmp_path / "case", 1, "asymmetric-friction", ["coulombAsymmetry=0,0.06"])
    found, text = diagnosed(case)
    assert found["verdict"] == "effects", text
    [effect] = found["effects"]
    assert (effect["id"], effect["component"], effect["joint"]) == ("asymmetric-friction", "motor-friction", 2)
    assert effect["parameters"]["coulombAsymmetry"]["value"] == pytest.approx(0.06, rel=0.1)
    window = found["gap"]["overall"]["window"]
    assert window["after"] < 0.3 * window["tuned"], window
    # The augmented FMU is the robot with the effect and the values that are reported.
    [fmu] = [name for name in found["augmented"] if "fmi3" in name]
    info = run("fmu", "info", tmp_path / "out" / fmu, "--json")
    assert info.returncode == 0, info.stderr
    assert "coulombAsymmetry" in info.stdout
    again = run("fmu", "pack", "--from", tmp_path / "out/diagnosis.json", "--fmi", 3, "-o", tmp_path / "again")
    assert again.returncode == 0, again.stderr


@pytest.mark.full
def test_nothing_and_other_masses(tmp_path):
    found, text = diagnosed(made(tmp_path / "none", 2), "--verdict-only")
    assert found["verdict"] == "no-gap" and found["effects"] == [], text
    found, text = diagnosed(made(tmp_path / "mass", 3, sets=["bodyMass=2,1.3"]), "--verdict-only")
    assert found["verdict"] == "parameters", text
    assert found["parameters"]["bodyMass[2]"]["value"] == pytest.approx(1.3, rel=0.05)


@pytest.mark.full
def test_identify_by_innovations(tmp_path):
    fit = '\n[fit]\nparameters = ["bodyMass[2]", "coulombFriction[2]"]\n'
    case = made(tmp_path / "case", 4, sets=["bodyMass=2,1.3", "coulombFriction=0.6,0.4", "staticFriction=0.6,0.4"], case=CASE + fit)
    done = run("identify", case, "--method", "innovations", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["parameters"]
    for name, truth in (("bodyMass[2]", 1.3), ("coulombFriction[2]", 0.4)):
        assert abs(found[name]["value"] - truth) < 4 * found[name]["standard_error"], found[name]


def test_mistakes_about_the_robot(tmp_path):
    case = tmp_path / "case"
    case.mkdir()
    (case / "arm.toml").write_text(ARM)
    (case / "train-1.csv").write_text("time,jointTorque[1],motorAngle[1]\n0,0,0\n")
    for text, expected in [
        (CASE.replace('robot = "arm.toml"\n', "").replace("[uncertain]\nbodyMass = 0.05\n", ""), 'write robot = "arm.urdf" with the file of your robot'),
        (CASE.replace("arm.toml", "gone.toml"), "gone.toml: there is no such file"),
        (CASE.replace("SpatialFreeFlyer", "PlanarManipulator"), 'take the line out, or write model = "SpatialFreeFlyer"'),
        (CASE.replace("bodyMass = 0.05", "bodyMas = 0.05"), "did you mean `bodyMass"),
        (CASE.replace("viscousFriction = [0.4, 0.2]", "viscous = 0.4"), "viscous is no parameter of this effect, which has coulombFriction, viscousFriction, staticFriction"),
    ]:
        (case / "case.toml").write_text(text)
        done = run("diagnose", case, "-o", tmp_path / "out")
        assert done.returncode == 1 and expected in done.stderr, (expected, done.stderr)
        assert not (tmp_path / "out").exists()


@pytest.mark.full
def test_arms_of_another_simulator(tmp_path):
    """Six joints of the trials: no effect is named where there is none. One of these two is `unknown` (decision 115), which is wrong, too."""
    done = run("trial", "generate", "--plant", "held-arm", "--split", "none", "--count", 2, "--seed", 900, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    for case in sorted((tmp_path / "cases").iterdir()):
        done = run("diagnose", case, "-o", tmp_path / case.name, "--verdict-only")
        assert done.returncode == 0, done.stderr
        found = json.loads((tmp_path / case.name / "diagnosis.json").read_text())
        assert found["effects"] == [] and found["verdict"] in ("no-gap", "unknown"), (case.name, found["verdict"])
