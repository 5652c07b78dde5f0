"""`CaptureScene` with a robot in space against Drake, which moves robot and target by itself: bodies, joints, nearest points and law of contact."""

import csv

import numpy as np
import pytest
from fmpy import read_model_description

pytestmark = pytest.mark.full

STOP, RADIUS, STIFFNESS, DAMPING, REFERENCE = 6.0, 0.05, 20000.0, 900.0, 1e-3
MASS, CENTER = 200.0, np.array([0.06, 0.01, 0.02])
INERTIA = np.array([[40.0, 1.0, 0.0], [1.0, 50.0, -2.0], [0.0, -2.0, 60.0]])
# Where a ball of the hand meets the port: the jaws stay open.
SHAPES = ("ball", "plate", "bar", "cylinder")


def ours(trueup, folder, shape):
    """Start values by name, and the columns of a run."""
    done = trueup("fmu", "pack", "CaptureScene", *(a for s in ("chaser=spatial", "closing=command", f"against={shape}") for a in ("--structure", s)), "-o", folder)
    assert done.returncode == 0, done.stderr
    (fmu,) = folder.glob("*.fmi3.fmu")
    set_ = {"damping": '"hunt-crossley"', "stiffness": STIFFNESS, "normalDamping": DAMPING, "referencePenetration": REFERENCE, "frictionCoefficient": 0.0}
    set_ |= {"targetMass": MASS, "initialPortOffset": [0.31 if shape == "plate" else 0.106, 0.004, -0.006], "initialTargetAngularVelocity": [0.02, -0.015, 0.01]}
    set_ |= {"targetInertia": INERTIA.ravel().tolist(), "targetCenterOfMass": CENTER.tolist()}
    if shape in ("bar", "cylinder"):
        set_ |= {"portBallRadius": RADIUS}
    lines = "".join(f"{name} = {value}\n" for name, value in set_.items())
    (folder / "s.toml").write_text(
        f'[run]\nstop = {STOP}\nstep = 0.01\ntolerance = 1e-11\n[components.scene]\nfmu = "{fmu}"\ninterface = "model-exchange"\n[components.scene.start]\n{lines}'
    )
    done = trueup("simulate", "s.toml", "-o", "r.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    with open(folder / "r.csv") as rows:
        columns = {n: c for n, *c in zip(*csv.reader(rows))}
    table = {n.removeprefix("scene."): np.array(c, float) for n, c in columns.items() if c[0] not in ("true", "false")}
    start = {}
    for v in read_model_description(str(fmu)).modelVariables:
        if v.start is not None and v.causality in ("parameter", "structuralParameter"):
            start[v.name] = np.array(str(v.start).split(), float)
    return start, table


def vector(table, name, n=3):
    return np.column_stack([table[f"{name}[{i + 1}]"] for i in range(n)])


def simulated(start, table, shape):
    """The same by Drake: poses and velocities of base, joints and target at our times, and the largest contact force."""
    from pydrake.common.eigen_geometry import Quaternion
    from pydrake.geometry import AddContactMaterial, Capsule, Cylinder, HalfSpace, ProximityProperties, Sphere
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RotationalInertia, SpatialInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder

    def central(mass, center, inertia):
        i = np.reshape(inertia, (3, 3))
        return SpatialInertia.MakeFromCentralInertia(mass, center, RotationalInertia(i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]))

    def touches(body, pose, geometry, name):
        properties = ProximityProperties()
        # Two materials in series: of twice the stiffness each, the dissipation is theirs.
        AddContactMaterial(
            dissipation=DAMPING / (STIFFNESS * REFERENCE), point_stiffness=2 * STIFFNESS, friction=CoulombFriction(0, 0), properties=properties
        )
        return plant.RegisterCollisionGeometry(body, pose, geometry, name, properties)

    def attitude(q):
        return RotationMatrix(Quaternion(np.asarray(q, float) / np.linalg.norm(q)))

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    plant.set_contact_model(ContactModel.kPoint)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    assert not start["motorInertia"].any(), "rotors are left out"
    carrier = base = plant.AddRigidBody("base", central(start["baseMass"][0], np.zeros(3), start["baseInertia"]))
    n = len(start["bodyMass"])
    of = {name: start[name].reshape(n, -1) for name in ("bodyCenterOfMass", "bodyInertia", "jointPosition", "jointOrientation", "jointAxis")}
    joints = []
    for k in range(n):
        body = plant.AddRigidBody(f"body {k}", central(start["bodyMass"][k], of["bodyCenterOfMass"][k], of["bodyInertia"][k]))
        frame = RigidTransform(attitude(of["jointOrientation"][k]), of["jointPosition"][k])
        joints.append(plant.AddJoint(RevoluteJoint(f"joint {k}", plant.AddFrame(FixedOffsetFrame(f"joint {k}", carrier.body_frame(), frame)), body.body_frame(), of["jointAxis"][k])))
        carrier = body
    for k, place in enumerate(start["ballPositionOpen"].reshape(-1, 3)):
        touches(carrier, RigidTransform(start["tipOffset"].ravel()[:3] + place), Sphere(start["ballRadius"][k]), f"ball {k}")
    # The target's frame is at its port.
    target = plant.AddRigidBody("target", central(MASS, CENTER, INERTIA))
    along = RigidTransform()
    if shape != "ball":
        along = RigidTransform(RotationMatrix.MakeFromOneVector(start["portAxis"], 2))
    half = 2 * start["portHalfLength"][0] if shape in ("bar", "cylinder") else 0.0
    radius = RADIUS if half else start.get("portBallRadius", [0.0])[0]
    solid = {"ball": lambda: Sphere(radius), "plate": HalfSpace, "bar": lambda: Capsule(radius, half), "cylinder": lambda: Cylinder(radius, half)}
    touches(target, along, solid[shape](), "port")
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    ApplySimulatorConfig(
        SimulatorConfig(integration_scheme="runge_kutta5", accuracy=1e-11, max_step_size=2e-3, use_error_control=True), simulator
    )
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    first = {name: vector(table, name, k)[0] for name, k in (
        ("basePosition", 3), ("baseQuaternion", 4), ("baseVelocity", 3), ("baseAngularVelocity", 3), ("jointAngle", n), ("jointVelocity", n),
        ("targetPosition", 3), ("targetQuaternion", 4), ("targetVelocity", 3), ("targetAngularVelocity", 3),
    )}  # fmt: skip
    from pydrake.multibody.math import SpatialVelocity

    def place(body, pose, spin, velocity):
        plant.SetFreeBodyPose(context, body, pose)
        plant.SetFreeBodySpatialVelocity(context=context, body=body, V_PB=SpatialVelocity(spin, velocity))

    turn = attitude(first["baseQuaternion"])
    place(base, RigidTransform(turn, first["basePosition"]), turn @ first["baseAngularVelocity"], first["baseVelocity"])
    turn = attitude(first["targetQuaternion"])
    spin = turn @ first["targetAngularVelocity"]
    port = turn @ -CENTER
    place(target, RigidTransform(turn, first["targetPosition"] + port), spin, first["targetVelocity"] + np.cross(spin, port))
    for joint, angle, rate in zip(joints, first["jointAngle"], first["jointVelocity"]):
        joint.set_angle(context, angle)
        joint.set_angular_rate(context, rate)
    rows, forces = [], []
    for t in table["time"]:
        simulator.AdvanceTo(t)
        results = plant.get_contact_results_output_port().Eval(context)
        forces.append(sum(np.linalg.norm(results.point_pair_contact_info(i).contact_force()) for i in range(results.num_point_pair_contacts())))
        found = plant.EvalBodySpatialVelocityInWorld(context, target)
        pose = plant.EvalBodyPoseInWorld(context, target)
        arm = pose.rotation() @ CENTER
        of_base = plant.EvalBodySpatialVelocityInWorld(context, base)
        rows.append(np.concatenate([
            plant.EvalBodyPoseInWorld(context, base).translation(), of_base.translational(),
            [j.get_angle(context) for j in joints], [j.get_angular_rate(context) for j in joints],
            pose.translation() + arm, found.translational() + np.cross(found.rotational(), arm), pose.rotation().inverse() @ found.rotational(),
        ]))  # fmt: skip
    return np.array(rows), np.array(forces)


@pytest.mark.parametrize("shape", SHAPES)
def test_drake_moves_robot_and_target_as_we_do(trueup, tmp_path, shape):
    pytest.importorskip("pydrake", reason="drake is not installed")
    start, table = ours(trueup, tmp_path, shape)
    theirs, forces = simulated(start, table, shape)
    n = len(start["bodyMass"])
    parts = (("basePosition", 3), ("baseVelocity", 3), ("jointAngle", n), ("jointVelocity", n), ("targetPosition", 3), ("targetVelocity", 3), ("targetAngularVelocity", 3))
    own = np.hstack([vector(table, name, k) for name, k in parts])
    off = np.abs(own - theirs)
    force = vector(table, "contactForce").sum(axis=1)
    changed = np.abs(vector(table, "targetVelocity") - vector(table, "targetVelocity")[0]).max()
    print(
        f"Drake, {shape}: motion within {off.max():.1e} (m, rad, m/s, rad/s) over {STOP} s, force of up to {forces.max():.3f} N within {np.abs(force - forces).max():.1e} N, "
        f"the target's velocity changed by {changed:.1e} m/s"
    )
    assert forces.max() > 0.05 and changed > 1e-4
    assert off.max() < 1e-6 and np.abs(force - forces).max() < 1e-3 * forces.max()
