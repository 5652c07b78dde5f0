"""A body that a link of an arm carries, with little known of it: [payload] of a case.

The truth is simulated with the link and what it carries as one body, put together here by Steiner.
"""

import csv
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

TORQUES = ["jointTorque[1]", "jointTorque[2]", "jointTorque[3]"]
NOISE = {"basePosition[1]": 2e-5, "basePosition[2]": 2e-5} | {
    name: 5e-5 for name in ("baseAttitude", "jointAngle[1]", "jointAngle[2]", "jointAngle[3]", "motorAngle[1]")
}
# Link 3 of the preset: kg, m, kg.m2; its length.
LINK, LENGTH = (4.64, (0.1511, 0.0004), 0.0515), 0.31


def need(name):
    found = os.environ.get(name)
    if not found:
        pytest.skip(f"{name} is not set: run ./test")
    return found


def run(*command):
    return subprocess.run([need("TRUEUP_BIN"), *map(str, command)], capture_output=True, text=True)


def in_one(link, carried):
    (m, c, i), (mass, center, inertia) = link, carried
    apart = [a - b for a, b in zip(center, c)]
    whole = m + mass
    middle = [b + mass / whole * d for b, d in zip(c, apart)]
    return whole, middle, i + inertia + m * mass / whole * sum(d * d for d in apart)


def recorded(folder, fmu, seed, carried, values=(), stop=8.0):
    """Seconds of an arm that is driven by three tones."""
    random = np.random.default_rng(seed)
    t = np.arange(0, stop + 0.001, 0.02)
    u = [a * np.sin(2 * np.pi * f * t) * np.minimum(1, t) for f, a in zip(random.uniform(0.2, 0.7, 3), (0.4, 0.28, 0.12))]
    driven, shown = folder / "driven.csv", folder / "shown.csv"
    quoted = lambda names: ",".join(f'"{n}"' for n in names)
    np.savetxt(driven, np.column_stack([t, *u]), delimiter=",", header="time," + quoted(TORQUES), comments="", fmt="%.17g")
    mass, (along, across), inertia = in_one(LINK, carried)
    one = {"linkMass[3]": mass, "linkCenterOfMass[3,1]": along, "linkCenterOfMass[3,2]": across, "linkInertia[3]": inertia}
    sets = [x for pair in (one | dict(values)).items() for x in ("--set", "{}={!r}".format(*pair))]
    names = list(NOISE)
    done = run("simulate", fmu, "--input", driven, "--stop", stop, "--step", 0.02, "--interface", "me",
               "--outputs", ",".join(names), "-o", shown, *sets)
    assert done.returncode == 0, done.stderr
    rows = [[float(r[n]) for n in ["time", *names]] for r in csv.DictReader(open(shown))]
    rows = np.array(rows)
    rows = rows[[np.argmin(np.abs(rows[:, 0] - x)) for x in t]]
    rows[:, 1:] += random.normal(0, 1, rows[:, 1:].shape) * list(NOISE.values())
    return np.column_stack([t, *u, rows[:, 1:]]), "time," + quoted(TORQUES + names)


def case(folder, fmu, carried, payload, values=(), stop=8.0):
    folder.mkdir()
    for k, name in enumerate("abc"):
        rows, header = recorded(folder, fmu, 20 + k, carried, values, stop)
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=header, comments="", fmt="%.10g")
    sensors = {n.split("[")[0]: noise for n, noise in NOISE.items()}
    (folder / "case.toml").write_text(
        'model = "PlanarManipulator"\ntrain = ["a.csv", "b.csv"]\nholdout = ["c.csv"]\n'
        "[parameters]\njointFlexible = [true, false, false]\n"
        + payload + "".join(f"[channels.{n}]\nnoise = {v}\n" for n, v in sensors.items()))
    return folder


ALL = """[payload]
link = 3
mass = { value = 0.0, doubt = 2.0 }
centerOfMass = { value = [0.31, 0.0], doubt = 0.05 }
inertia = { value = 0.0, doubt = 0.02 }
"""
TRUTH = {"mass": 0.8, "centerOfMass[1]": 0.31, "centerOfMass[2]": 0.02, "inertia": 0.01}


def test_a_payload_is_found_and_is_no_gap(tmp_path):
    fmu = Path(need("TRUEUP_FMUS")) / "PlanarManipulator.fmi3.fmu"
    folder = case(tmp_path / "all", fmu, (0.8, (0.31, 0.02), 0.01), ALL, stop=5.0)
    done = run("identify", folder, "--fast", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for name, truth in TRUTH.items():
        told = found["parameters"][f"payload.{name}"]
        print(name, told["value"], told["standard_error"])
        assert abs(told["value"] - truth) < 4 * told["standard_error"] < 0.02 * truth + 1e-4, (name, told)


@pytest.mark.full
def test_a_payload_of_a_diagnosis_is_what_it_is(tmp_path):
    fmu = Path(need("TRUEUP_FMUS")) / "PlanarManipulator.fmi3.fmu"
    folder = case(tmp_path / "all", fmu, (0.8, (0.31, 0.02), 0.01), ALL)
    done = run("diagnose", folder, "-o", tmp_path / "out", "--verdict-only", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["verdict"] == "parameters" and not told["effects"], told["verdict"]
    for name, truth in TRUTH.items():
        value = told["parameters"][f"payload.{name}"]["value"]
        assert abs(value - truth) < 0.02 * truth + 1e-3, (name, value)


@pytest.mark.full
def test_of_a_payload_its_mass_alone_is_needed_and_an_augmented_fmu_has_it_in_its_link(tmp_path):
    effect = Path(need("TRUEUP_FMUS")) / "effects" / "PlanarManipulator+base-drag.fmi3.fmu"
    mass = "[payload]\nlink = 3\nmass = { value = 0.0, doubt = 2.0 }\n"
    folder = case(tmp_path / "drag", effect, (0.8, (LENGTH, 0.0), 0.0), mass, {"baseDrag": 3.0}.items())
    done = run("diagnose", folder, "-o", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["verdict"] == "effects" and [e["id"] for e in told["effects"]] == ["base-drag"], told["effects"]
    assert told["gap"]["overall"]["after"] < 2 * told["gap"]["overall"]["floor"], told["gap"]["overall"]
    (name,) = [n for n in told["augmented"] if "fmi3" in n]
    info = run("fmu", "info", tmp_path / "out" / name).stdout
    (line,) = [l for l in info.splitlines() if l.strip().startswith("linkMass")]
    last = float(line.split("=")[1].split("kg")[0].split(",")[2])
    assert abs(last - 4.64 - 0.8) < 0.02, line


@pytest.mark.parametrize("text, message", [
    ("link = 0\nmass = 1.0\n", "`link` of [payload] is 0"),
    ("mass = 1.0\n", "[payload] has no `link`"),
    ('link = 3\nmass = "estimate"\n', "write mass = { value = 0.0, doubt = 2.0 } in kg"),
    ("link = 3\nmass = { value = -1.0, doubt = 1.0 }\n", "`mass` of [payload] is -1"),
    ("link = 4\nmass = 1.0\n", "there is no link 4; the model has 3"),
    ("link = 3\nmass = 1.0\ncenterOfMass = 0.3\n", "has 1 numbers, not 2"),
])
def test_what_is_wrong_with_a_payload_is_said_with_its_mend(tmp_path, text, message):
    folder = tmp_path / "case"
    folder.mkdir()
    rows = "".join(f"{k * 0.01},{k * 0.01}\n" for k in range(60))
    (folder / "a.csv").write_text('time,"jointAngle[1]"\n' + rows)
    (folder / "case.toml").write_text('model = "PlanarManipulator"\ntrain = ["a.csv"]\n[payload]\n' + text)
    done = run("identify", folder)
    assert done.returncode == 1 and message in done.stderr and "case.toml" in done.stderr, done.stderr
