"""MJCF is read as MuJoCo reads it: drawn models, what contradicts itself, what is not used."""

import os

import numpy as np
import pytest
from robot_matrices import Robot
from test_public_robots import as_text, of_mjcf

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")

SEED = int(os.environ.get("TRUEUP_SEED", "6701"))


def numbers(values):
    return " ".join(repr(float(v)) for v in values)


class Drawn:
    """A model with what MJCF has: classes, frames, all ways to turn, joints in frames, welded and static bodies, sites."""

    def __init__(self, dice):
        self.dice = dice
        self.sequence = "".join(dice.permutation(list("xyz")))
        self.sequence = "".join(c.upper() if dice.random() < 0.5 else c for c in self.sequence)
        self.unit = dice.choice(["radian", "degree"])
        self.count = 0

    def angle(self, low=-1.5, high=1.5):
        value = self.dice.uniform(low, high)
        return np.degrees(value) if self.unit == "degree" else value

    def turn(self):
        dice = self.dice
        kind = dice.integers(6)
        return [
            "",
            f'quat="{numbers(dice.normal(size=4))}"',
            f'euler="{numbers([self.angle() for _ in range(3)])}"',
            f'axisangle="{numbers([*dice.normal(size=3), self.angle()])}"',
            f'xyaxes="{numbers(dice.normal(size=6))}"',
            f'zaxis="{numbers(dice.normal(size=3))}"',
        ][kind]

    def place(self):
        return f'pos="{numbers(self.dice.uniform(-0.4, 0.4, 3))}" {self.turn()}'

    def inertial(self):
        dice = self.dice
        mass, moments = dice.uniform(0.3, 3), dice.uniform(0.05, 0.09, 3)
        at = f'pos="{numbers(dice.uniform(-0.2, 0.2, 3))}" mass="{mass!r}"'
        if dice.random() < 0.5:
            return f'<inertial {at} {self.turn()} diaginertia="{numbers(moments)}"/>'
        return f'<inertial {at} fullinertia="{numbers([*moments, *dice.uniform(-0.01, 0.01, 3)])}"/>'

    def framed(self, text):
        if self.dice.random() < 0.6:
            return text
        inner = self.framed(text)
        return f'<frame {self.place()}{self.dice.choice(["", " childclass=" + chr(34) + "b" + chr(34)])}>{inner}</frame>'

    def joint(self):
        dice = self.dice
        own = [f'name="j{self.count}"', f'pos="{numbers(dice.uniform(-0.1, 0.1, 3))}"']
        own += [f'axis="{numbers(dice.normal(size=3))}"'] if dice.random() < 0.7 else []
        own += [str(dice.choice(['type="slide"', 'type="hinge"', 'class="a"', 'class="c"', ""]))]
        own += [f'armature="{dice.uniform(0, 0.1)!r}"'] if dice.random() < 0.5 else []
        return self.framed(f"<joint {' '.join(own)}/>")

    def body(self, depth, moving):
        dice = self.dice
        self.count += 1
        name = f"b{self.count}"
        child = str(dice.choice(["", 'childclass="a"', 'childclass="c"']))
        inside = [self.framed(self.inertial()) if dice.random() < 0.3 else self.inertial()]
        inside += [self.joint()] if moving else []
        inside += [self.framed(f'<site name="b{dice.integers(1, 9)} s{self.count}"/>'), f'<site name="{name}"/>'] if dice.random() < 0.5 else []
        dice.shuffle(inside)
        for _ in range(dice.integers(1, 3) if depth else 0):
            inside.append(self.framed(self.body(depth - 1, dice.random() < 0.75)))
        return f'<body name="{name}" {self.place()} {child}>{"".join(inside)}</body>'

    def text(self):
        dice = self.dice
        free = dice.random() < 0.4
        robot = self.body(3, False)
        if free:
            at = robot.index(">") + 1
            robot = robot[:at] + str(dice.choice(["<freejoint/>", '<joint type="free" class="main"/>'])) + robot[at:]
        else:
            # A foot without inertia that is bolted down; its mass does not matter.
            robot = f'<body name="foot" {self.place()}><geom size="0.1"/>{robot}</body>'
        support = f'<body name="support" {self.place()}><geom size="0.1"/><inertial pos="0 0 0" mass="3"/></body>' if dice.random() < 0.5 else ""
        site = '<site name="mark" pos="1 2 3"/>' if dice.random() < 0.5 else ""
        return f"""<mujoco model="drawn"><compiler angle="{self.unit}" eulerseq="{self.sequence}"/>
<default><joint armature="0.02"/><default class="a"><joint axis="1 0.2 -0.4" armature="0.05"/><default class="c"><joint type="slide"/><site pos="0 0 0.1"/></default></default>
<default class="b"><joint axis="0 1 0.3"/></default></default>
<worldbody>{site}{support}{robot}</worldbody></mujoco>"""


def compare(trueup, tmp_path, count):
    loaded = 0
    for k in range(count):
        file = tmp_path / f"drawn{k}.xml"
        file.write_text(Drawn(np.random.default_rng([SEED, k])).text())
        text, reason = as_text(trueup, file)
        if reason:
            # Nothing else is refused here.
            assert "at most" in reason, (SEED, k, reason)
            continue
        robot = Robot(text)
        worst = of_mjcf(file, robot, np.random.default_rng(k))
        assert worst < 1e-9, (SEED, k, worst)
        loaded += 1
    print(f"seed {SEED}: {loaded} of {count} models as MuJoCo reads them")
    assert loaded >= 0.6 * count


def test_drawn_models_are_read_as_by_mujoco(trueup, tmp_path):
    compare(trueup, tmp_path, 12)


@pytest.mark.full
def test_many_drawn_models_are_read_as_by_mujoco(trueup, tmp_path):
    compare(trueup, tmp_path, 300)


INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def model(body="", *, before="", after="", joint="<joint name='j'/>", inertial=INERTIAL, of=""):
    return f"<mujoco>{before}<worldbody>\n<body name='b'{of}>{joint}{inertial}{body}</body></worldbody>{after}</mujoco>"


# What contradicts itself or has no meaning; MuJoCo refuses all of it.
WRONG = {
    "two inertias": (model(inertial='<inertial pos="0 0 0" mass="1" diaginertia="1 1 1" fullinertia="1 1 1 0 0 0"/>'), ":2: ", "`b`", "diaginertia and fullinertia"),
    "no inertia": (model(inertial='<inertial pos="0 0 0" mass="1"/>'), ":2: ", "`b`", "neither diaginertia nor fullinertia"),
    "turned fullinertia": (model(inertial='<inertial pos="0 0 0" quat="1 1 0 0" mass="1" fullinertia="1 1 1 0 0 0"/>'), ":2: ", "fullinertia", "quat"),
    "two inertials": (model(INERTIAL), ":2: ", "two <inertial>"),
    "inertial without pos": (model(inertial='<inertial mass="1" diaginertia="1 1 1"/>'), ":2: ", "`pos`"),
    "inertial without mass": (model(inertial='<inertial pos="0 0 0" diaginertia="1 1 1"/>'), ":2: ", "`mass`"),
    "two orientations": (model(of=" quat='1 1 0 0' euler='1 0 0'"), ":2: ", "quat and euler"),
    "no length": (model(of=" quat='0 0 0 0'"), ":2: ", "quat"),
    "parallel axes": (model(of=" xyaxes='1 0 0 2 0 0'"), ":2: ", "xyaxes"),
    "no axis": (model(joint="<joint axis='0 0 0'/>"), "axis"),
    "unknown class": (model(joint="<joint class='arm'/>", before="<default><default class='arms'/></default>"), ":2: ", "no class `arm`", "`arms`"),
    "unknown childclass": (model(of=" childclass='x'"), ":2: ", "no class `x`"),
    "a class twice": (model(before="<default><default class='x'/><default class='x'/></default>"), "class `x`", "already"),
    "unknown attribute": (model(joint="<joint dampign='1'/>"), ":2: ", "<joint> has no attribute `dampign`", "`damping`"),
    "unknown attribute of an inertial": (model(inertial='<inertial pos="0 0 0" mass="1" diaginertai="1 1 1"/>'), ":2: ", "`diaginertai`", "`diaginertia`"),
    "unknown attribute of a default": (model(before="<default><joint armatur='1'/></default>"), ":1: ", "`armatur`", "`armature`"),
    "unknown element": (model("<jiont/>"), ":2: ", "no element <jiont>", "`joint`"),
    "unknown section": (model(after="<actuators/>"), "no element <actuators>", "`actuator`"),
    "global coordinates": (model(before="<compiler coordinate='global'/>"), ":1: ", "global"),
    "no inertia from shapes": (model("<geom size='1'/>", inertial="", before="<compiler inertiafromgeom='false'/>"), ":2: ", "`b`", "no mass"),
    "too few numbers": (model(of=" pos='1 0'"), ":2: ", "pos", "3 finite"),
    "a joint's name twice": (model(f"<body><joint name='j'/>{INERTIAL}</body>"), ":2: ", "joint `j`"),
    "a body's name twice": (model(f"<body name='b'>{INERTIAL}</body>"), ":2: ", "`b`"),
    "a body named world": (model(f"<body name='world'>{INERTIAL}</body>"), ":2: ", "`world`"),
    "a negative moment": (model(inertial='<inertial pos="0 0 0" mass="1" diaginertia="-0.1 1 1"/>'), "`b`", "principal moments"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_mujoco_refuses_is_one_clear_error(trueup, tmp_path, kind):
    text, *words = WRONG[kind]
    with pytest.raises(ValueError):
        mujoco.MjModel.from_xml_string(text)
    file = tmp_path / "wrong.xml"
    file.write_text(text)
    done = trueup("robot", file, "--toml")
    assert done.returncode == 1 and not done.stdout, done.stderr
    assert done.stderr.count("error:") == 1 and "wrong.xml" in done.stderr, done.stderr
    assert all(word in done.stderr for word in words), done.stderr


# What MuJoCo uses and no model here has.
UNREAD = {
    "range": (model(joint="<joint name='j' range='-1 1'/>"), "range", "(j)"),
    "force range": (model(joint="<joint name='j' actuatorfrcrange='-1 1'/>"), "actuatorfrcrange", "(j)"),
    "stiffness": (model(joint="<joint name='j' stiffness='3' springref='1'/>"), "stiffness", "(j)"),
    "spring by a class": (model(before="<default><joint stiffness='3'/></default>"), "stiffness", "(j)"),
    "springdamper": (model(joint="<joint name='j' springdamper='0.1 1' damping='2'/>"), "springdamper", "(j)"),
    "ref": (model(joint="<joint name='j' ref='10'/>"), "ref of 1 joint", "(j)"),
    "losses of a free base": (model(joint="<joint type='free' name='j' damping='1'/>"), "free base", "(j)"),
    "gravcomp": (model(of=" gravcomp='1'"), "gravcomp", "b"),
    "mocap": (model("", joint="", of=" mocap='true'") .replace("</worldbody>", f"<body><joint/>{INERTIAL}</body></worldbody>"), "mocap", "b"),
    "gravity": (model(before="<option gravity='0 0 -3'/>"), "gravity"),
    "fluid": (model(before="<option viscosity='0.1' gravity='0 0 0'/>"), "viscosity"),
    "actuator": (model(after="<actuator><motor joint='j' gear='30'/></actuator>"), "<actuator>", "gear"),
    "tendon": (model(after="<tendon><fixed stiffness='3'><joint joint='j' coef='1'/></fixed></tendon>"), "<tendon>", "stiffness"),
    "tendon equality": (model(after="<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><equality><tendon tendon1='t'/></equality>"), "<equality> of tendon"),
    "joint equality": (model(f"<body name='c'><joint name='k'/>{INERTIAL}</body>", after="<equality><joint joint1='j' joint2='k'/></equality>"), "<equality> of 1 joint (j)"),
}


@pytest.mark.parametrize("kind", UNREAD)
def test_what_is_not_used_is_named(trueup, tmp_path, kind):
    text, *words = UNREAD[kind]
    mujoco.MjModel.from_xml_string(text)
    file = tmp_path / "unread.xml"
    file.write_text(text)
    done = trueup("robot", file, "--toml")
    assert done.returncode == 0, done.stderr
    notes = [line for line in done.stderr.splitlines() if line.startswith("note:")]
    assert any(all(word in note for word in words) for note in notes), done.stderr


def test_a_joint_that_follows_is_fixed_at_its_offset(trueup, tmp_path):
    tail = f"<body name='c' pos='0.3 0 0'><joint name='k' axis='0 1 0'/>{INERTIAL}</body>"
    file = tmp_path / "offset.xml"
    file.write_text(model(tail, joint="<joint name='j' axis='1 0 0'/>", after="<equality><joint joint1='k' polycoef='0.4 0 0 0 0'/></equality>"))
    text, reason = as_text(trueup, file)
    assert not reason, reason
    (body,) = Robot(text).bodies
    read = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(read)
    data.qpos[1] = 0.4
    mujoco.mj_forward(read, data)
    center = (data.xipos[1] + data.xipos[2]) / 2
    assert np.allclose(body["center-of-mass"], center, atol=1e-12) and body["mass"] == pytest.approx(2)


def test_a_default_switches_equalities_off(trueup, tmp_path):
    file = tmp_path / "off.xml"
    file.write_text(model(before="<default><equality active='false'/></default>", after="<equality><weld body1='b'/></equality>"))
    text, reason = as_text(trueup, file)
    assert not reason and Robot(text).names == ["b"]


def test_losses_are_those_of_the_joint(trueup, tmp_path):
    file = tmp_path / "losses.xml"
    classes = "<default><joint damping='0.3'/><default class='dry'><joint frictionloss='0.1'/></default></default>"
    file.write_text(model(f"<body name='c' childclass='dry'><joint name='k'/>{INERTIAL}</body>", before=classes))
    text, _ = as_text(trueup, file)
    found = [b["friction"] for b in Robot(text).bodies]
    assert found == [{"viscous": 0.3, "coulomb": 0.0}, {"viscous": 0.3, "coulomb": 0.1}]
