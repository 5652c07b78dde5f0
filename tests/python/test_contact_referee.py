"""A capture seen by engines: the bodies under the forces that we say (MuJoCo, Pinocchio), and the contact itself by Hunt and Crossley's
law, which Drake has too. S2's own law (20) is in no engine: closed forms are its referee (crates/models/tests/contact)."""

import csv

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

STOP = 30.0
CHASER, TARGET = (1778.7, 762.0), (7900.0, 129112.2)  # kg, kg.m2


def table(file):
    with open(file) as lines:
        rows = list(csv.reader(lines))
    return {name: np.array(column, float) for name, *column in zip(*rows) if name == "time" or column[0] not in ("true", "false")}


@pytest.fixture(scope="module")
def sim2(trueup, fmus, tmp_path_factory):
    """S2's SIM2 with all events, at intervals in which forces are polynomials to far below the tolerance."""
    folder = tmp_path_factory.mktemp("engines")
    scene = fmus / "CaptureScene.fmi3.fmu"
    (folder / "s.toml").write_text(
        f'[run]\nstop = {STOP}\nstep = 0.002\ntolerance = 1e-12\n[components.scene]\nfmu = "{scene}"\ninterface = "model-exchange"\n'
    )
    done = trueup("simulate", "s.toml", "-o", "r.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    return {name.removeprefix("scene."): column for name, column in table(folder / "r.csv").items()}


def pieces(time):
    """Between events, where two rows have one time."""
    cuts = [0, *(np.flatnonzero(np.diff(time) == 0.0) + 1), len(time)]
    return [slice(a, b) for a, b in zip(cuts, cuts[1:]) if time[b - 1] > time[a]]


def driven(sim2, body, arm, accelerations):
    """Largest differences of place and velocity from ours: `accelerations(q, v, force, torque)` is the engine's, under the force and the
    torque about the centre of mass that our contact puts out at a point `arm` from it."""
    side = {"chaser": "host", "target": "port"}[body]
    time = sim2["time"]
    pose = np.column_stack([sim2[f"{body}Position[1]"], sim2[f"{body}Position[2]"], sim2[f"{body}Attitude"]])
    twist = np.column_stack([sim2[f"{body}Velocity[1]"], sim2[f"{body}Velocity[2]"], sim2[f"{body}Rate"]])
    wrench = np.column_stack([sim2[f"{side}Force[1]"], sim2[f"{side}Force[2]"], sim2[f"{side}Torque"]])
    state, off = np.concatenate([pose[0], twist[0]]), np.zeros(2)
    for piece in pieces(time):
        t = time[piece]
        acting = make_interp_spline(t, wrench[piece], k=min(5, len(t) - 1))

        def rates(at, y):
            fx, fy, torque = acting(at)
            c, s = np.cos(y[2]), np.sin(y[2])
            lever = (c * arm[0] - s * arm[1], s * arm[0] + c * arm[1])
            return np.concatenate([y[3:], accelerations(y[:3], y[3:], (fx, fy), torque + lever[0] * fy - lever[1] * fx)])

        run = solve_ivp(rates, (t[0], t[-1]), state, "DOP853", t_eval=t, rtol=1e-12, atol=1e-14)
        assert run.success
        state = run.y[:, -1]
        off = np.maximum(off, [np.abs(run.y[:3].T - pose[piece]).max(), np.abs(run.y[3:].T - twist[piece]).max()])
    return off


def moved(sim2, name, engine):
    for body, (mass, inertia), arm in (("chaser", CHASER, (3.32, 0.0)), ("target", TARGET, (-5.0, -1.3))):
        off = driven(sim2, body, arm, engine(mass, inertia))
        way = np.abs(sim2[f"{body}Velocity[1]"] - sim2[f"{body}Velocity[1]"][0]).max()
        print(f"{name}, {body}: off by {off[0]:.1e} m or rad, {off[1]:.1e} m/s or rad/s over {STOP:g} s; the contact changed {way:.1e} m/s")
        assert way > 1e-3 and (off < 1e-9).all()


def test_mujoco_moves_the_bodies_as_we_do(sim2):
    mujoco = pytest.importorskip("mujoco")

    def engine(mass, inertia):
        model = mujoco.MjModel.from_xml_string(
            '<mujoco><option gravity="0 0 0"/><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
            f'<joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>'
            "</body></worldbody></mujoco>"
        )
        data = mujoco.MjData(model)

        def accelerations(q, v, force, torque):
            data.qpos[:], data.qvel[:] = q, v
            data.xfrc_applied[1] = (*force, 0, 0, 0, torque)
            mujoco.mj_forward(model, data)
            return data.qacc.copy()

        return accelerations

    moved(sim2, "MuJoCo", engine)


def test_pinocchio_moves_the_bodies_as_we_do(sim2):
    pin = pytest.importorskip("pinocchio")

    def engine(mass, inertia):
        model, at = pin.Model(), 0
        for joint in (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRZ()):
            at = model.addJoint(at, joint, pin.SE3.Identity(), f"j{at}")
        model.appendBodyToJoint(at, pin.Inertia(mass, np.zeros(3), inertia * np.eye(3)), pin.SE3.Identity())
        model.gravity.setZero()
        data = model.createData()

        def accelerations(q, v, force, torque):
            c, s = np.cos(q[2]), np.sin(q[2])
            own = np.array([c * force[0] + s * force[1], -s * force[0] + c * force[1], 0.0])  # in the last joint's axes
            outer = pin.StdVec_Force()
            outer.extend([pin.Force.Zero()] * at + [pin.Force(own, np.array([0, 0, torque]))])
            return pin.aba(model, data, q, v, np.zeros(3), outer).copy()

        return accelerations

    moved(sim2, "Pinocchio", engine)


@pytest.mark.full
def test_drake_has_the_same_impact_by_hunt_and_crossley(trueup, tmp_path):
    """A central impact of two balls: force, depth and what is left of the speed within 1 %."""
    pytest.importorskip("pydrake", reason="drake is not installed")
    from pydrake.geometry import AddContactMaterial, ProximityProperties, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import PrismaticJoint, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    stiffness, damping, reference, speed, radius = 20000.0, 900.0, 1e-3, 0.05, 0.05
    done = trueup("fmu", "pack", "CaptureScene", "--structure", "numberOfBalls=1", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (fmu,) = (tmp_path / "out").glob("*.fmi3.fmu")
    (tmp_path / "s.toml").write_text(
        f'[run]\nstop = 2.0\nstep = 0.001\ntolerance = 1e-11\n[components.scene]\nfmu = "{fmu}"\ninterface = "model-exchange"\n'
        f'[components.scene.start]\ndamping = "hunt-crossley"\nreferencePenetration = {reference}\nnormalDamping = {damping}\nstiffness = {stiffness}\n'
        f'targetCenterOfMass = [5.0, 0.0]\ninitialPortOffset = [{2 * radius + 0.005}, 0.0]\ninitialChaserVelocity = [{speed}, 0.0]\n'
    )
    done = trueup("simulate", "s.toml", "-o", "r.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    ours = {name.removeprefix("scene."): column for name, column in table(tmp_path / "r.csv").items()}

    builder = DiagramBuilder()
    plant, scene = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    plant.set_contact_model(ContactModel.kPoint)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    for name, mass in (("chaser", CHASER[0]), ("target", TARGET[0])):
        body = plant.AddRigidBody(name, SpatialInertia(mass, [0, 0, 0], UnitInertia.SolidSphere(radius)))
        plant.AddJoint(PrismaticJoint(name, plant.world_frame(), body.body_frame(), [1, 0, 0]))
        properties = ProximityProperties()
        # Two materials in series: of twice the stiffness each, the dissipation is theirs.
        AddContactMaterial(
            dissipation=damping / (stiffness * reference), point_stiffness=2 * stiffness, friction=CoulombFriction(0, 0), properties=properties
        )
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(radius), name, properties)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    simulator.get_mutable_integrator().set_maximum_step_size(1e-3)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, [0, 2 * radius + 0.005])
    plant.SetVelocities(context, [speed, 0])
    depths, forces, speeds = [], [], []
    for t in np.arange(0.0, 2.0005, 0.001):
        simulator.AdvanceTo(t)
        q, v = plant.GetPositions(context), plant.GetVelocities(context)
        results = plant.get_contact_results_output_port().Eval(context)
        forces.append(sum(np.linalg.norm(results.point_pair_contact_info(i).contact_force()) for i in range(results.num_point_pair_contacts())))
        depths.append(2 * radius - (q[1] - q[0]))
        speeds.append(v[1] - v[0])
    theirs = (max(forces), max(depths), speeds[-1])
    ours = (ours["contactForce[1]"].max(), ours["penetration[1]"].max(), (ours["targetVelocity[1]"] - ours["chaserVelocity[1]"])[-1])
    print("largest force N, largest depth m, speed of parting m/s: Drake", theirs, "ours", ours)
    assert theirs[0] > 100 and theirs[2] > 0
    assert np.allclose(ours, theirs, rtol=0.01, atol=0)
