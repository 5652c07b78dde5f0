"""From a robot's file to a robot: what URDF and MJCF cannot have, laid over them; TOML written; what cannot be is refused once, clearly."""

import json

import numpy as np
import pytest
from robot_matrices import Robot, rotation

SOLID = '<inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/>'


def link(name, mass=2.0, inertia=SOLID):
    return f'<link name="{name}"><inertial><origin xyz="0.1 0 0.2"/><mass value="{mass}"/>{inertia}</inertial></link>'


def joint(name, parent, child, more="", kind="revolute"):
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="0 0.1 0.5" rpy="0.2 0 0.4"/><axis xyz="0 1 0"/>{more}</joint>'


ARM = (
    '<robot name="arm">' + link("foot", 10.0) + link("upper") + link("fore") + '<link name="tool0"/>' + joint("shoulder", "foot", "upper", '<dynamics damping="0.5" friction="0.2"/>')
    + joint("elbow", "upper", "fore") + joint("flange", "fore", "tool0", kind="fixed") + "</robot>"
)
OVERLAY = """
[robot]
urdf = "arm.urdf"
[satellite]
mass = 100.0
inertia = [[20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]]
mount = [0.0, 0.0, 0.6]
orientation = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
[joint.shoulder]
motor = { flexible = true, inertia = 0.8, gear-ratio = 100, stiffness = 4000.0, damping = 4.0 }
[[tip]]
link = "tool0"
offset = [0.0, 0.0, 0.1]
[[thruster]]
position = [0.5, 0.0, 0.0]
direction = [0.0, 1.0, 0.0]
"""


def read(trueup, folder, text, name="robot.toml", *options):
    (folder / "arm.urdf").write_text(ARM)
    (folder / name).write_text(text)
    done = trueup("robot", folder / name, "--toml", *options)
    assert "panicked" not in done.stderr
    return done


def test_a_satellite_under_an_arm_has_the_masses_and_places_of_both(trueup, tmp_path):
    done = read(trueup, tmp_path, OVERLAY)
    assert done.returncode == 0, done.stderr
    robot = Robot(done.stdout)
    base = robot.file["base"]
    # The root link's centre of mass, turned and moved to the mount, with the satellite's.
    turn, mount = rotation([1, 0, 0, 1]), np.array([0, 0, 0.6])
    root = mount + turn @ [0.1, 0, 0.2]
    center = 10 * root / 110
    assert base["mass"] == pytest.approx(110) and "held" not in base
    about = lambda mass, place, inertia: np.eye(3) * inertia + mass * (place @ place * np.eye(3) - np.outer(place, place))
    assert np.allclose(base["inertia"], about(100, -center, 20) + about(10, root - center, 0.2), rtol=1e-12, atol=1e-12)
    assert np.allclose(robot.bodies[0]["position"], mount + turn @ [0, 0.1, 0.5] - center, atol=1e-12)
    plain = Robot(read(trueup, tmp_path, ARM, "arm.urdf").stdout)
    assert np.allclose(rotation(robot.bodies[0]["orientation"]), turn @ rotation(plain.bodies[0]["orientation"]), atol=1e-12)
    assert robot.bodies[0]["motor"] == {"flexible": True, "inertia": 0.8, "gear-ratio": 100.0, "stiffness": 4000.0, "damping": 4.0}
    assert robot.bodies[0]["friction"] == {"viscous": 0.5, "coulomb": 0.2}
    (tip,) = robot.file["tip"]
    along = rotation_of_rpy(0.2, 0.4)
    assert np.allclose(tip["offset"], np.array([0, 0.1, 0.5]) + along @ [0, 0, 0.1], atol=1e-12) and tip["body"] == "fore"
    assert np.allclose(robot.file["thruster"][0]["position"], np.array([0.5, 0, 0]) - center, atol=1e-12)


def rotation_of_rpy(roll, yaw):
    return rotation([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]) @ rotation([np.cos(roll / 2), np.sin(roll / 2), 0, 0])


def test_what_is_written_reads_back_as_the_same_robot(trueup, tmp_path):
    for text, name in ((ARM, "arm.urdf"), (OVERLAY, "over.toml")):
        once = read(trueup, tmp_path, text, name)
        again = read(trueup, tmp_path, once.stdout, "again.toml")
        assert once.returncode == again.returncode == 0 and once.stdout == again.stdout, again.stderr


def test_an_overlay_holds_an_arm_under_gravity(trueup, tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "held.toml").write_text('[robot]\nurdf = "arm.urdf"\nheld = true\ngravity = [0.0, 0.0, -9.81]\n')
    done = trueup("fmu", "pack", "SpatialFreeFlyer", "--robot", tmp_path / "held.toml", "--fmi", 3, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    info = json.loads(trueup("fmu", "info", tmp_path / "SpatialFreeFlyer.fmi3.fmu", "--json").stdout)
    (gravity,) = [v for v in info["variables"] if v["name"] == "gravity"]
    assert [float(x) for x in gravity["start"]] == [0.0, 0.0, -9.81]


def test_a_mimicked_joint_is_fixed_with_a_note(trueup, tmp_path):
    text = ARM.replace('<axis xyz="0 1 0"/></joint><joint name="flange"', '<axis xyz="0 1 0"/><mimic joint="shoulder" offset="0.3"/></joint><joint name="flange"')
    done = read(trueup, tmp_path, text, "mimic.urdf")
    assert done.returncode == 0 and "<mimic> of 1 joint (elbow) is not read: they are fixed" in done.stderr, done.stderr
    robot = Robot(done.stdout)
    assert robot.names == ["upper"] and robot.bodies[0]["mass"] == pytest.approx(4)
    # The fore link is fixed at 0.3 rad: its centre of mass is part of the upper one's.
    turn = rotation_of_rpy(0.2, 0.4) @ rotation([np.cos(0.15), 0, np.sin(0.15), 0])
    center = (np.array([0.1, 0, 0.2]) + np.array([0, 0.1, 0.5]) + turn @ [0.1, 0, 0.2]) / 2
    assert np.allclose(robot.bodies[0]["center-of-mass"], center, atol=1e-12)


def test_inertias_that_no_body_has_are_repaired_and_reported(trueup, tmp_path):
    flat = SOLID.replace('izz="0.2"', 'izz="0.9"')
    wrong = SOLID.replace('iyy="0.2"', 'iyy="-0.2"')
    text = ARM.replace(link("upper"), link("upper", 2.0, flat)).replace(link("fore"), link("fore", 2.0, wrong))
    refused = read(trueup, tmp_path, text, "bad.urdf")
    assert refused.returncode == 1 and "`fore`: its principal moments" in refused.stderr
    done = read(trueup, tmp_path, text, "bad.urdf", "--repair-inertia")
    assert done.returncode == 0, done.stderr
    for name in ("upper", "fore"):
        assert f"`{name}`: its principal moments" in done.stderr
    assert "`foot`" not in done.stderr and "base`: its" not in done.stderr
    for body in Robot(done.stdout).bodies:
        moments = np.linalg.eigvalsh(np.array(body["inertia"]))
        assert moments[0] > 0 and moments[0] + moments[1] >= moments[2] * (1 - 1e-12), body["name"]


@pytest.mark.parametrize("text, name, words", [
    (ARM.replace('<parent link="foot"/>', '<parent link="fore"/>'), "a.urdf", ("a.urdf:1", "loop")),
    (ARM.replace("</robot>", link("second root") + "</robot>"), "a.urdf", ("a.urdf:1", "`foot` and `second root` both hang on nothing")),
    (ARM.replace('iyy="0.2"', 'iyy="nan"', 1), "a.urdf", ("a.urdf:1", "iyy=\"nan\"", "finite")),
    ('<mujoco><worldbody><body name="b"><joint/><geom type="mesh" mesh="absent"/></body></worldbody></mujoco>', "a.xml", ("a.xml:1", "`b`", "meshes")),
    ('<mujoco><worldbody><body name="b"><joint/><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>', "a.xml", ("`b` has 2 joints",)),
    ('<mujoco><worldbody/><equality><weld body1="a"/></equality></mujoco>', "a.xml", ("a.xml:1", "loop")),
    (OVERLAY.replace("arm.urdf", "absent.urdf"), "a.toml", ("a.toml:3", "absent.urdf")),
    (OVERLAY.replace("joint.shoulder", "joint.shouldr"), "a.toml", ("a.toml:9", "did you mean `shoulder`")),
    (OVERLAY.replace("motor = {", "friction = { viscous = -0.1 }\nmotor = {"), "a.toml", ("a.toml:9", "`shoulder`: friction")),
    (OVERLAY.replace("mass = 100.0", "mass = -1.0"), "a.toml", ("a.toml:", "[satellite]: mass = -1")),
    (OVERLAY.replace('link = "tool0"', 'link = "tool1"'), "a.toml", ("a.toml", "`tool1`", "did you mean `tool0`")),
    (OVERLAY.replace('link = "tool0"', 'link = "foot"'), "a.toml", ("`foot` is part of the base",)),
    (OVERLAY.replace("[satellite]", "gravity = [0.0, 0.0, -9.81]\n[satellite]"), "a.toml", ("gravity needs a base that is held",)),
    (OVERLAY.replace("[satellite]", "held = true\n[satellite]"), "a.toml", ("[satellite] moves",)),
    (OVERLAY.replace('urdf = "arm.urdf"', ""), "a.toml", ("one of urdf and mjcf",)),
])
def test_what_cannot_be_is_one_clear_error(trueup, tmp_path, text, name, words):
    done = read(trueup, tmp_path, text, name)
    assert done.returncode == 1 and not done.stdout, done.stderr
    assert done.stderr.count("error:") == 1 and all(word in done.stderr for word in words), done.stderr


def test_a_missing_mesh_of_a_urdf_is_not_missed(trueup, tmp_path):
    """Shapes are not read."""
    shape = '<visual><geometry><mesh filename="absent.stl"/></geometry></visual>'
    done = read(trueup, tmp_path, ARM.replace("</inertial></link>", "</inertial>" + shape + "</link>"), "mesh.urdf")
    assert done.returncode == 0 and "error" not in done.stderr


def test_a_controller_has_as_many_joints_as_its_arm(trueup, tmp_path):
    done = trueup("fmu", "pack", "ManipulatorController", "--joints", 7, "--fmi", 2, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    info = json.loads(trueup("fmu", "info", tmp_path / "ManipulatorController.fmi2.fmu", "--json").stdout)
    names = [v["name"] for v in info["variables"]]
    assert "jointTorque[7]" in names and "jointTorque[8]" not in names
    for arguments in (("ManipulatorController", "--joints", 0), ("PlanarManipulator", "--joints", 3), ("--joints", 3)):
        assert trueup("fmu", "pack", *arguments, "-o", tmp_path).returncode == 2
