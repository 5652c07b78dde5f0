"""Robots as their makers publish them: read as Pinocchio and MuJoCo read them, or refused with a reason; packed in seconds."""

import os
import re
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from robot_matrices import Robot

# Seconds to pack, the build under test being optimised and the machine not loaded.
MOST = 3.0
# Robots at least; Debian and PyPI have more in example-robot-data.
LEAST = 30


def published():
    """Files of URDF of example-robot-data: below TRUEUP_DATA, else as pip installed it."""
    pinocchio = pytest.importorskip("pinocchio", reason="Pinocchio is not installed (tools/python/requirements-full.txt)")
    places = [Path(os.environ.get("TRUEUP_DATA", "/nonexistent")), Path(pinocchio.__file__).parents[4] / "share/example-robot-data"]
    files = sorted(file for place in places if place.is_dir() for file in place.rglob("*.urdf"))
    if not files:
        pytest.skip("no public robots: pip install example-robot-data, or set TRUEUP_DATA to a folder with their files")
    return files


def as_text(trueup, file):
    """TOML of a robot, or why it is refused."""
    done = trueup("robot", file, "--toml")
    assert done.returncode in (0, 1, 2) and "panicked" not in done.stderr, done.stderr
    if done.returncode == 0:
        return done.stdout, None
    reason = done.stderr.strip()
    assert reason.startswith("error: ") and Path(file).name in reason, reason
    return None, reason


def off(found, wanted):
    """Relative to the largest element."""
    return np.max(np.abs(found - wanted), initial=0.0) / max(np.max(np.abs(wanted), initial=0.0), 1e-300)


def of_urdf(file, robot, dice):
    """Largest difference to Pinocchio's reading: mass matrices with the base held, places of the bodies, the base's inertia."""
    import pinocchio as pin

    tree = ET.parse(file).getroot()
    child = {j.get("name"): j.find("child").get("link") for j in tree.findall("joint")}
    model = pin.buildModelFromUrdf(str(file))
    mimics = {j.get("name"): float(j.find("mimic").get("offset") or 0) for j in tree.findall("joint") if j.find("mimic") is not None}
    locked = [model.getJointId(name) for name in mimics if model.existJointName(name)]
    if locked:
        at = pin.neutral(model)
        for k in locked:
            at[model.joints[k].idx_q] = mimics[model.names[k]]
        model = pin.buildReducedModel(model, locked, at)
    assert model.nv == len(robot.bodies), (model.nv, len(robot.bodies))
    names = [name if name != "base link" else "base" for name in robot.names]
    places = [(names.index(child[model.names[k]]), model.joints[k]) for k in range(1, model.njoints)]
    order = np.array([at for at, _ in places], int)
    data, worst = model.createData(), 0.0
    shift = None
    for _ in range(3 if places else 0):
        q = dice.uniform(-1, 1, model.nv)
        full = np.zeros(model.nq)
        for at, joint in places:
            # Pinocchio writes a continuous joint as cosine and sine.
            full[joint.idx_q : joint.idx_q + joint.nq] = q[at] if joint.nq == 1 else (np.cos(q[at]), np.sin(q[at]))
        pin.forwardKinematics(model, data, full)
        wanted = pin.crba(model, data, full).copy()
        wanted = np.triu(wanted) + np.triu(wanted, 1).T
        worst = max(worst, off(robot.mass_matrix(q)[np.ix_(order, order)], wanted))
        frames = robot.frames(q)
        # Our base axes are in the base's centre of mass.
        moved = np.array([frames[at][1] - data.oMi[k + 1].translation for k, at in enumerate(order)])
        shift = moved[0] if shift is None else shift
        worst = max(worst, off(moved - shift + 1.0, np.ones_like(moved)))
    if not robot.file["base"].get("held"):
        free = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
        if locked:
            at = pin.neutral(free)
            for name, value in mimics.items():
                if free.existJointName(name):
                    at[free.joints[free.getJointId(name)].idx_q] = value
            free = pin.buildReducedModel(free, [free.getJointId(n) for n in mimics if free.existJointName(n)], at)
        worst = max(worst, off(np.array(robot.file["base"]["inertia"]), free.inertias[1].inertia))
        worst = max(worst, abs(robot.file["base"]["mass"] / free.inertias[1].mass - 1))
    return worst


@pytest.mark.full
def test_robots_are_read_as_by_pinocchio(trueup, tmp_path):
    files, dice = published(), np.random.default_rng(67)
    loaded, refused, slow = 0, 0, []
    for k, file in enumerate(files):
        text, reason = as_text(trueup, file)
        if reason:
            refused += 1
            print(f"{file.stem} | refused | {reason.splitlines()[0].split(file.name, 1)[1][:150]}")
            continue
        worst = of_urdf(file, Robot(text), dice)
        begin = time.monotonic()
        done = trueup("fmu", "pack", "SpatialFreeFlyer", "--robot", file, "--fmi", 3, "-o", tmp_path / str(k))
        spent = time.monotonic() - begin
        if done.returncode:
            refused += 1
            assert done.stderr.startswith(("error: ", "note: ")), done.stderr
            print(f"{file.stem} | read to {worst:.1e} | not packed: {done.stderr.strip().splitlines()[-1][:150]}")
            continue
        loaded += 1
        slow += [(file.stem, spent)] if spent > MOST else []
        print(f"{file.stem} | {worst:.1e} | {len(Robot(text).bodies)} bodies | {spent:.2f} s")
        assert worst < 1e-9, file
    print(f"{loaded} loaded, {refused} refused")
    assert loaded >= LEAST
    assert not slow, slow


def mjcf_of(file, folder):
    """A robot as MuJoCo writes it."""
    import mujoco

    tree = ET.parse(file).getroot()
    for link in tree.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    text = ET.tostring(tree, encoding="unicode")
    model = mujoco.MjModel.from_xml_string(text)
    target = folder / (file.stem + ".xml")
    mujoco.mj_saveLastXML(str(target), model)
    return target


def of_mjcf(file, robot, dice):
    """Largest difference to MuJoCo's reading: mass matrices of the joints that are read, places of their bodies, a free base."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    name = lambda kind, k: mujoco.mj_id2name(model, kind, k)
    kinds = [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)]
    moving = [k for k in range(model.njnt) if int(model.jnt_type[k]) in kinds]
    free = [int(model.jnt_bodyid[k]) for k in range(model.njnt) if int(model.jnt_type[k]) == int(mujoco.mjtJoint.mjJNT_FREE)]
    assert bool(free) == (not robot.file["base"].get("held")), "a base is free where its joint is"
    bodies = {name(mujoco.mjtObj.mjOBJ_BODY, model.jnt_bodyid[k]): k for k in moving}
    known = [b if b != "base link" else "base" for b in robot.names]
    joints = [bodies[b] for b in known]
    # Our axes are those of a base that is free, else those of the world.
    base = free[0] if free else 0
    worst, shift = 0.0, None
    for _ in range(3):
        q = dice.uniform(-1, 1, len(joints))
        data.qpos[:] = model.qpos0
        for angle, joint in zip(q, joints):
            data.qpos[model.jnt_qposadr[joint]] += angle
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        rows = [model.jnt_dofadr[joint] for joint in joints]
        worst = max(worst, off(robot.mass_matrix(q), full[np.ix_(rows, rows)]))
        axes = data.xmat[base].reshape(3, 3)
        places = [data.xpos[body] + data.xmat[body].reshape(3, 3) @ model.jnt_pos[joint] for joint in joints for body in [model.jnt_bodyid[joint]]]
        moved = np.array([frame[1] - axes.T @ place for frame, place in zip(robot.frames(q), places)])
        if joints:
            shift = moved[0] if shift is None else shift
            worst = max(worst, off(moved - shift + 1.0, np.ones_like(moved)))
    if free:
        # What is welded to the base is part of it.
        parts = [k for k in range(model.nbody) if model.body_weldid[k] == base]
        mass = sum(model.body_mass[k] for k in parts)
        center = sum(model.body_mass[k] * data.xipos[k] for k in parts) / mass
        inertia = np.zeros((3, 3))
        for k in parts:
            turn, arm = data.ximat[k].reshape(3, 3), data.xipos[k] - center
            inertia += turn @ np.diag(model.body_inertia[k]) @ turn.T + model.body_mass[k] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        worst = max(worst, off(np.array(robot.file["base"]["inertia"]), axes.T @ inertia @ axes), abs(robot.file["base"]["mass"] / mass - 1))
    return worst


@pytest.mark.full
def test_robots_are_read_as_by_mujoco(trueup, tmp_path):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    import mujoco

    dice, loaded, refused = np.random.default_rng(68), 0, 0
    given = Path(os.environ.get("TRUEUP_DATA", "/nonexistent"))
    makers = sorted(f for f in given.rglob("*.xml") if "<mujoco" in f.read_text(errors="ignore")) if given.is_dir() else []
    for file in [*makers, *published()]:
        try:
            source = file if file.suffix == ".xml" else mjcf_of(file, tmp_path)
            mujoco.MjModel.from_xml_path(str(source))
        except ValueError as why:
            print(f"{file.stem} | MuJoCo refuses it | {re.sub(chr(10), ' ', str(why))[:100]}")
            continue
        text, reason = as_text(trueup, source)
        if reason:
            refused += 1
            print(f"{file.stem} | refused | {reason.splitlines()[0].split(source.name, 1)[1][:150]}")
            continue
        robot = Robot(text)
        worst = of_mjcf(source, robot, dice)
        loaded += 1
        print(f"{file.stem} | {worst:.1e} | {len(robot.bodies)} bodies")
        assert worst < 1e-9, file
    print(f"{loaded} loaded, {refused} refused")
    assert loaded >= LEAST
