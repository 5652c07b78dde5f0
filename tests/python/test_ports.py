"""`trueup ports`: our own FMUs as those of others, with their own names and with drawn ones, FMUs made by PythonFMU, and files with
mistakes. What is right comes from the models' tables of variables. FMUs that fail: test_faulty_ports.py."""

import json
import os
import random
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from collections import defaultdict
from pathlib import Path

import jsonschema
import pytest
from conftest import MODELS, from_environment

INTERFACES = ("me", "cs")


def joints(n, drive, **roles):
    return {f"joint.{k}": {drive[0]: [f"{drive[1]}[{k}]"], **{r: [f"{v}[{k}]"] for r, v in roles.items()}} for k in range(1, n + 1)}


MOTION = dict(motorAngle="motorAngle", motorVelocity="motorVelocity", linkAngle="jointAngle", linkVelocity="jointVelocity")


def vector(name, n):
    return [f"{name}[{k}]" for k in range(1, n + 1)]


# What each variable is, by the models' tables. Models that are not here have no ports: controllers and a contact.
TRUTH = {
    "TwoMassJoint": {
        "joint.1": {
            "current": ["motorCurrent"], "motorAngle": ["motorAngle"], "motorVelocity": ["motorVelocity"], "linkAngle": ["loadAngle"],
            "linkVelocity": ["loadVelocity"], "externalTorque": ["externalTorque"], "transmissionTorque": ["transmissionTorque"],
            "stiffness": ["stiffness"], "damping": ["damping"],
        }
    },
    "PlanarManipulator": {
        **joints(3, ("torque", "jointTorque"), **MOTION),
        "base": {
            "force": vector("baseForce", 2), "torque": ["baseTorque"], "position": vector("basePosition", 2), "velocity": vector("baseVelocity", 2),
            "attitude": ["baseAttitude"], "rate": ["baseRate"],
        },
        "tip": {
            "force": vector("tipForce", 2), "torque": ["tipTorque"], "position": vector("tipPosition", 2), "velocity": vector("tipVelocity", 2),
            "attitude": ["tipAttitude"], "rate": ["tipRate"],
        },
    },
    "SpatialFreeFlyer": {
        **joints(6, ("torque", "jointTorque"), **MOTION),
        "base": {"force": vector("baseForce", 3), "position": vector("basePosition", 3), "velocity": vector("baseVelocity", 3)},
        "tip": {"force": [f"tipForce[1,{k}]" for k in (1, 2, 3)], "velocity": [f"tipVelocity[1,{k}]" for k in (1, 2, 3)]},
    },
    "FlexibleArm": {
        **joints(6, ("current", "motorCurrent"), **MOTION),
        "tip": {"force": [f"tipForce[1,{k}]" for k in (1, 2, 3)], "torque": [f"tipTorque[1,{k}]" for k in (1, 2, 3)]},
    },
    "FreeBody": {
        "base": {"force": ["portForce[1,1]", "portForce[1,2]"], "torque": ["portTorque[1]"], "velocity": ["portVelocity[1,1]", "portVelocity[1,2]"]}
    },
    "CaptureScene": {"base": {"force": vector("chaserForce", 2), "torque": ["chaserTorque"], "velocity": vector("chaserVelocity", 2), "rate": ["chaserRate"]}},
}


def drafted(trueup, file, interface="me", *options):
    done = trueup("ports", file, "--interface", interface, "--json", *options)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    roles = defaultdict(lambda: defaultdict(list))
    for v in found["variables"]:
        roles[v["place"]][v["role"]].append(v["variable"])
    return found, roles


def differences(roles, truth):
    """Roles that are wrong, and those of the truth that are missing."""
    flat = lambda all: {(p, r): v for p, of in all.items() for r, v in of.items()}  # noqa: E731
    found, right = flat(roles), flat(truth)
    wrong = {k: (v, right[k]) for k, v in found.items() if k in right and v != right[k]}
    return wrong, {k: v for k, v in right.items() if k not in found}


def contradicted(found):
    return [c for c in found["checks"] if c["outcome"] == "contradicted"]


SHORT = [("TwoMassJoint", 2, "me"), ("TwoMassJoint", 3, "cs"), ("PlanarManipulator", 3, "me"), ("FlexibleArm", 3, "me"), ("JointController", 3, "me")]
EVERY = [(model, version, interface) for model in MODELS for version in (2, 3) for interface in INTERFACES]


@pytest.mark.parametrize("model, version, interface", [pytest.param(*of, marks=[] if of in SHORT else pytest.mark.full) for of in EVERY])
def test_our_own_as_those_of_others(trueup, fmu, model, version, interface):
    found, roles = drafted(trueup, fmu(model, version), interface)
    wrong, missing = differences(roles, TRUTH.get(model, {}))
    print(model, version, interface, "missing:", missing, "open:", found["open"])
    assert not wrong and not contradicted(found)
    assert set(roles) == set(TRUTH.get(model, {})), found["open"]


def figures(found):
    return {(f["place"], f["key"]): f["value"] for f in found["figures"]}


def effects(found):
    """Ids that can act, by port."""
    can = defaultdict(set)
    for e in found["effects"]:
        if e["possible"]:
            can[e["port"]].add(e["id"])
    return can


def test_ratio_torque_constant_and_effects_of_a_joint(trueup, fmu):
    found, _ = drafted(trueup, fmu("TwoMassJoint", 3))
    assert figures(found) == {("joint.1", "gearRatio"): 44340.0, ("joint.1", "torqueConstant"): pytest.approx(0.02, rel=1e-9)}
    never = {"joint-flexibility", "flexible-link"}
    listed = trueup("fmu", "list").stdout.split("Effects (--effect)")[1]
    ids = set(re.findall(r"^  ([a-z-]+) ", listed, re.M))
    assert {e["id"].split(":")[0] for e in found["effects"]} == ids
    of_base = {"external-force:tip", "external-force:base", "cable-stiffness:base", "table-tilt", "base-drag", "base-thrust", "appendage-mode"}
    sensors = {"sensor-eccentricity", "sensor-drift", "sensor-delay"}
    expected = {e["id"] for e in found["effects"]} - never - of_base - sensors
    assert effects(found)["joint.1"] == expected
    assert effects(found)["sensors.loadAngle"] == sensors
    assert effects(found)["sensors.loadVelocity"] == sensors - {"sensor-eccentricity"}
    assert all(e["why_not"] for e in found["effects"] if not e["possible"])
    forces = [(p["name"], p["unit"]) for p in found["insertion_points"] if p["acts"] == "force"]
    assert forces == [("motor of joint 1", "N.m"), ("link of joint 1", "N.m")] and not found["unreached"]
    assert {p["name"] for p in found["insertion_points"] if p["acts"] == "error of a reading"} == set(found["sensors"])


def test_places_without_a_force_have_their_reason(trueup, fmu):
    """Joints 2 and 3 are rigid: motor and link are one coordinate. On the link of joint 1 no input acts; the tip is no state."""
    found = drafted(trueup, fmu("PlanarManipulator", 2))[0]
    forces = [p["name"] for p in found["insertion_points"] if p["acts"] == "force"]
    assert forces == [*(f"motor of joint {k}" for k in (1, 2, 3)), *(f"base along `{n}`" for n in ("baseForce[1]", "baseForce[2]", "baseTorque"))]
    of = {line.split(":")[0]: line for line in found["unreached"]}
    assert set(of) == {"link of joint 1", *(f"tip along `{n}`" for n in ("tipForce[1]", "tipForce[2]", "tipTorque"))}, of
    assert "no input acts on it" in of["link of joint 1"] and "is no state" in of["tip along `tipTorque`"]


def test_effects_of_an_arm(trueup, fmu):
    """Joint 1 has a spring and no torque on its link; joints 2 and 3 are rigid, so that the motor's torque is on the link."""
    can = effects(drafted(trueup, fmu("PlanarManipulator", 3))[0])
    of_link = {"load-friction", "gravity-torque", "cable-stiffness:load", "external-force:load"}
    assert not can["joint.1"] & of_link and of_link <= can["joint.2"]
    assert not any("backlash" in can[f"joint.{k}"] for k in (1, 2, 3))
    assert {"stribeck-friction", "torque-ripple", "current-saturation"} <= can["joint.1"] & can["joint.3"]
    assert {"base-drag", "base-thrust", "appendage-mode", "cable-stiffness:base", "external-force:base"} == can["base"]
    assert can["tip"] == {"external-force:tip"}


def renamed(file, folder, seed):
    """The FMU with drawn names of letters that mean nothing, and what each was. An odd seed gives elements of FMI 2.0 names of their
    own, without indices."""
    dice, names = random.Random(seed), {}
    of_its_own = seed % 2 == 1 and "fmi2" in file.name

    def new(name):
        base, index = (name, "") if of_its_own else re.fullmatch(r"(.*?)((?:\[[\d,]+\])?)", name).groups()
        if base not in names:
            word = ""
            while not word or word in names.values():
                word = "".join(dice.choice("bcdghjknpqrsvxz") for _ in range(6))
            names[base] = word
        return names[base] + index

    target = folder / f"renamed-{seed}.fmu"
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(target, "w") as into:
        for item in old.infolist():
            if item.filename == "modelDescription.xml":
                text = old.read(item).decode()
                begin, end = text.index("<ModelVariables>"), text.index("</ModelVariables>")
                part = text[begin:end]
                part = re.sub(r'(<(?:ScalarVariable|Float64|Int32|UInt64|Boolean|Enumeration)\b[^>]*? name=)"([^"]+)"', lambda m: f'{m[1]}"{new(m[2])}"', part)
                into.writestr(item, text[:begin] + part + text[end:])
            elif item.filename.startswith("binaries/"):
                into.writestr(item, old.read(item))
    return target, {v: k for k, v in names.items()}


def back(roles, names):
    """Roles with the names that the variables had."""
    old = lambda v: re.sub(r"^[a-z]+", lambda m: names[m[0]], v)  # noqa: E731
    return {p: {r: [old(v) for v in list] for r, list in of.items()} for p, of in roles.items()}


def kept(file, interface, trueup, tmp_path, seed):
    other, names = renamed(file, tmp_path, seed)
    found, roles = drafted(trueup, other, interface)
    return found, back(roles, names)


@pytest.mark.parametrize("version", (2, 3))
def test_drawn_names_of_a_joint(trueup, fmu, tmp_path, version):
    """Units and structure are enough: current, motor, link, torque on the link, gear ratio."""
    seed = 101 + version
    found, roles = kept(fmu("TwoMassJoint", version), "me", trueup, tmp_path, seed)
    by_name = ("stiffness", "damping", "transmissionTorque")
    truth = {p: {r: v for r, v in of.items() if r not in by_name} for p, of in TRUTH["TwoMassJoint"].items()}
    wrong, missing = differences(roles, truth)
    assert not wrong and not missing, f"seed {seed}: {wrong} {missing}"
    assert figures(found)["joint.1", "gearRatio"] == 44340.0 and not contradicted(found)


@pytest.mark.full
@pytest.mark.parametrize("interface", INTERFACES)
@pytest.mark.parametrize("model", TRUTH)
@pytest.mark.parametrize("version", (2, 3))
def test_drawn_names(trueup, fmu, tmp_path, model, version, interface):
    """What is drafted is right, or it is open: nothing is wrong. Motor and link of a rigid joint are one."""
    for seed in range(3):
        found, roles = kept(fmu(model, version), interface, trueup, tmp_path, seed)
        placed = {v: (p.split(".")[0], r) for p, of in TRUTH[model].items() for r, list in of.items() for v in list}
        twins = {"motorAngle": "linkAngle", "motorVelocity": "linkVelocity", "linkAngle": "motorAngle", "linkVelocity": "motorVelocity"}
        wrong = []
        for place, of in roles.items():
            for role, variables in of.items():
                for v in variables:
                    right = placed.get(v)
                    rigid = right and model != "TwoMassJoint" and right[1] == twins.get(role)
                    if right and right != (place.split(".")[0], role) and not rigid:
                        wrong.append((place, role, v, right))
        print(f"seed {seed}: {sum(len(v) for of in roles.values() for v in of.values())} roles, open: {len(found['open'])}")
        assert not wrong and not contradicted(found), f"seed {seed}: {wrong}"


def check(trueup, fmu_file, folder, text):
    (folder / "ports.toml").write_text(text)
    return trueup("ports", fmu_file, "--ports", folder / "ports.toml", "--json")


JOINT = """fmu = "TwoMassJoint.fmi3.fmu"
[joint.1]
current = "motorCurrent"
torqueConstant = 0.02
motorAngle = "motorAngle"
motorVelocity = "motorVelocity"
linkAngle = "loadAngle"
linkVelocity = "loadVelocity"
externalTorque = "externalTorque"
gearRatio = 44340
"""


@pytest.mark.parametrize(
    "old, new, line, words",
    [
        ('"motorAngle"', '"motorAngel"', 5, "did you mean `motorAngle`?"),
        ('"motorAngle"', '"motorCurrent"', 5, "`motorCurrent` is current of [joint.1] already, in line 3"),
        ('current = "motorCurrent"', 'current = "motorAngle"', 3, "`motorAngle` is an output, and `current` of [joint.1] is an input"),
        ('"motorVelocity"', '"motorAcceleration"', 6, "`motorAcceleration` is an angular acceleration (rad/s2)"),
        ('"loadAngle"', '"state.motorAngle"', 7, "`state.motorAngle` is a local variable"),
        ('current = "motorCurrent"', 'torque = "motorCurrent"', 3, "is a current (A)"),
        ("gearRatio", "gearratio", 10, "did you mean `gearRatio`?"),
        ("TwoMassJoint.fmi3", "Other", None, "name the same FMU in both"),
    ],
)
def test_mistakes_of_a_file(trueup, fmu, tmp_path, old, new, line, words):
    done = check(trueup, fmu("TwoMassJoint", 3), tmp_path, JOINT.replace(old, new, 1))
    place = f"ports.toml:{line}: " if line else "ports.toml: "
    lines = [part for part in done.stderr.splitlines() if place in part and words in part]
    assert done.returncode == 1 and len(lines) == 1, done.stderr


@pytest.mark.parametrize(
    "changes, checked, words",
    [
        ({}, None, None),
        ({"44340": "100"}, "gear ratio", "gearRatio 100 against 44340 measured"),
        ({'motorVelocity = "motorVelocity"': 'motorVelocity = "loadVelocity"', 'linkVelocity = "loadVelocity"': 'linkVelocity = "motorVelocity"'}, "acceleration", "it acts on another output"),
        ({'motorAngle = "motorAngle"': 'motorAngle = "loadAngle"', 'linkAngle = "loadAngle"': 'linkAngle = "motorAngle"'}, "derivative", "it is not so"),
        ({"torqueConstant = 0.02": "torqueConstant = 0.2"}, "torque constant", "0.2 against 0.02"),
    ],
)
def test_what_an_experiment_contradicts(trueup, fmu, tmp_path, changes, checked, words):
    text = JOINT
    for old, new in changes.items():
        text = text.replace(old, new)
    done = check(trueup, fmu("TwoMassJoint", 3), tmp_path, text)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    wrong = contradicted(found)
    assert bool(wrong) == bool(checked)
    if checked:
        assert any(c["check"] == checked and words in c["text"] for c in wrong), wrong
        assert not effects(found)["joint.1"], "nothing is inserted where a role is contradicted"


def test_the_draft_is_written_once_and_read_back(trueup, fmu, tmp_path):
    file = tmp_path / "arm.fmu"
    file.symlink_to(fmu("PlanarManipulator", 3).resolve())
    done = trueup("ports", file)
    draft = tmp_path / "ports.toml"
    assert done.returncode == 0 and "GUESS" in draft.read_text(), done.stderr
    before = draft.read_text()
    again = trueup("ports", file)
    assert again.returncode == 1 and "ports.toml: it is there already" in again.stderr and draft.read_text() == before
    assert trueup("ports", file, "--force").returncode == 0 and draft.read_text() == before
    read, roles = drafted(trueup, file, "me", "--ports", draft)
    assert not contradicted(read) and roles == drafted(trueup, file)[1]
    assert all(v["guess"] is None for v in read["variables"])
    printed = trueup("ports", file, "--print")
    assert printed.stdout == before


# The inverted pendulum on a motor, in Python: input without a unit, and a name of another language for each variable.
PENDULUM = """
from math import sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Arm({base}):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.tau_cmd, self.q, self.qd, self.extra = 0.0, 0.1, 0.0, 0.0
        of = dict(variability=Fmi2Variability.continuous)
        self.register_variable(Real("tau_cmd", causality=Fmi2Causality.input, **of))
        for name in ("q", "qd", "extra"):
            self.register_variable(Real(name, causality=Fmi2Causality.output, **of))

    def do_step(self, time, step):
        for _ in range(10):
            self.qd += step / 10 * {sign}(self.tau_cmd - 0.4 * sin(self.q) - 0.05 * self.qd) / 0.3
            self.q += step / 10 * self.qd
        self.extra = 2.0 * self.q
        {fault}
        return True
"""


def python_fmu(folder, trueup, sign="", fault="pass"):
    pytest.importorskip("pythonfmu", reason="pythonfmu is not installed: run ./test")
    (folder / "arm.py").write_text(PENDULUM.format(base="Fmi2Slave", sign=sign, fault=fault))
    subprocess.run([sys.executable, "-m", "pythonfmu", "build", "-f", "arm.py", "-d", "."], cwd=folder, check=True)
    done = trueup("ports", folder / "Arm.fmu", "--json", "--deadline", "5")
    if "needs Python's library" in done.stderr:
        pytest.skip(f"PythonFMU needs Python's shared library: {done.stderr.strip()}")
    return done


def test_an_fmu_in_python_without_units(trueup, tmp_path):
    done = python_fmu(tmp_path, trueup)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    roles = {v["role"]: v["variable"] for v in found["variables"]}
    assert roles == {"torque": "tau_cmd", "motorAngle": "q", "motorVelocity": "qd"}, found
    assert found["interface"] == "Co-Simulation" and not contradicted(found)
    can = effects(found)["joint.1"]
    assert {"current-saturation", "nonlinear-viscous-friction", "gravity-torque"} <= can
    # Without an FMU state no trial step can be taken back.
    assert "stribeck-friction" not in can


# Two links under gravity in MuJoCo, with dry friction: no units, outputs in an order of its own.
MUJOCO = """
import mujoco
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

XML = \'\'\'<mujoco><option timestep="1e-4" gravity="0 -9.81 0"/><worldbody>
<body><joint name="a" axis="0 0 1" armature="0.02" damping="0.1"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="2"/>
<body pos="0.4 0 0"><joint name="b" axis="0 0 1" damping="0.05" frictionloss="0.2"/><geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
</body></body></worldbody><actuator><motor joint="a"/><motor joint="b"/></actuator></mujoco>\'\'\'
NAMES = {names}


class Arm(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.model = mujoco.MjModel.from_xml_string(XML)
        self.data = mujoco.MjData(self.model)
        self.values = [0.0] * 6
        for k, name in enumerate(NAMES):
            causality = Fmi2Causality.input if k < 2 else Fmi2Causality.output
            reader, writer = self.access(k)
            self.register_variable(Real(name, causality=causality, variability=Fmi2Variability.continuous, getter=reader, setter=writer))

    def access(self, k):
        return lambda: self.values[k], lambda v: self.values.__setitem__(k, v)

    def do_step(self, time, step):
        self.data.ctrl[:] = self.values[:2]
        for _ in range(max(1, round(step / 1e-4))):
            mujoco.mj_step(self.model, self.data)
        q, v = map(float, self.data.qpos), map(float, self.data.qvel)
        self.values[3], self.values[5] = q
        self.values[4], self.values[2] = v
        return True
"""


def mujoco_fmu(trueup, folder, names):
    pytest.importorskip("pythonfmu")
    pytest.importorskip("mujoco")
    (folder / "arm.py").write_text(MUJOCO.format(names=names))
    subprocess.run([sys.executable, "-m", "pythonfmu", "build", "-f", "arm.py", "-d", "."], cwd=folder, check=True)
    # The Python within the FMU finds packages where this one does.
    done = trueup("ports", folder / "Arm.fmu", "--json", env={**os.environ, "PYTHONPATH": sysconfig.get_paths()["purelib"]})
    if "needs Python's library" in done.stderr:
        pytest.skip(f"PythonFMU needs Python's shared library: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.full
def test_an_arm_of_mujoco(trueup, tmp_path):
    """What moves most is the last link, whatever the torque: reciprocity finds the pairs also where numbers are exchanged."""
    found = mujoco_fmu(trueup, tmp_path, ["tau_b", "tau_a", "qd_x", "q_y", "qd_z", "q_u"])
    pairs = {tuple(v["variable"] for v in found["variables"] if v["place"] == p and v["role"] in r) for p in ("joint.1", "joint.2") for r in [("torque", "motorAngle", "motorVelocity")]}
    assert pairs == {("tau_b", "q_y", "qd_z"), ("tau_a", "q_u", "qd_x")}, found
    assert not contradicted(found) and not found["open"]
    reciprocity = next(c["figure"] for c in found["checks"] if c["check"] == "reciprocity")
    assert reciprocity < 1e-6


@pytest.mark.full
def test_an_arm_whose_names_and_units_give_nothing(trueup, tmp_path):
    found = mujoco_fmu(trueup, tmp_path, ["aa", "bb", "cc", "dd", "ee", "ff"])
    assert not found["variables"] and "no joint and no body is drafted" in found["open"][-1]


def test_power_that_comes_out_is_contradicted(trueup, tmp_path):
    python_fmu(tmp_path, trueup, sign="-")
    text = 'fmu = "Arm.fmu"\n[joint.1]\ntorque = "tau_cmd"\nmotorAngle = "q"\nmotorVelocity = "qd"\n'
    found = json.loads(check(trueup, tmp_path / "Arm.fmu", tmp_path, text).stdout)
    assert any("power is taken out" in c["text"] for c in contradicted(found)), found["checks"]


def test_an_fmu_in_python_that_raises(trueup, tmp_path):
    done = python_fmu(tmp_path, trueup, fault='raise RuntimeError("broken")')
    assert done.returncode == 1 and "Arm.fmu" in done.stderr and "DoStep" in done.stderr, done.stderr


def test_the_schema_takes_a_draft(trueup, fmu):
    found, _ = drafted(trueup, fmu("SpatialFreeFlyer", 3))
    schema = json.loads(trueup("schema", "ports").stdout)
    jsonschema.Draft202012Validator(schema).validate(tomllib.loads(found["toml"]))
