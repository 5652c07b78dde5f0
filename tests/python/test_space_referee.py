"""SpatialFreeFlyer against engines that know nothing of it: random trees with random inertias, wrenches at base and tips."""

import numpy as np
import pytest

from referee import report

STATES = 100
# Bodies and branches of each tree.
TREES = [(1, 1), (2, 1), (6, 1), (7, 2), (12, 3), (24, 3)]


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def unit(random, n):
    v = random.normal(size=n)
    return v / np.linalg.norm(v)


def inertia(random, size):
    a, b, c = random.uniform(0.1, 1, 3) * size
    turn = rotation(unit(random, 4))
    return turn @ np.diag([b + c, a + c, a + b]) @ turn.T


class Robot:
    """Random parameters, random states, and Rust's results for them."""

    def __init__(self, bodies, branches, example):
        random = np.random.default_rng(100 * bodies + branches)
        self.n = n = bodies
        # Branches begin at the base or at a body before.
        self.parent = [k if k % max(1, n // branches) else int(random.integers(0, k + 1)) for k in range(n)]
        self.prismatic = [bool(k % 4 == 2) for k in range(n)]
        leaves = [k + 1 for k in range(n) if k + 1 not in self.parent]
        self.tips = leaves[:8]
        self.base_mass, self.base_inertia = random.uniform(50, 500), inertia(random, 50)
        self.mass, self.com = random.uniform(1, 20, n), random.uniform(-0.3, 0.3, (n, 3))
        self.inertia = np.array([inertia(random, 2.0) for _ in range(n)])
        self.position = random.uniform(-0.8, 0.8, (n, 3))
        self.orientation = np.array([unit(random, 4) for _ in range(n)])
        self.axis = np.array([unit(random, 3) for _ in range(n)])
        self.offset = random.uniform(-0.5, 0.5, (len(self.tips), 3))
        # No rotors, no springs; in the order of the variables.
        parameters = np.concatenate([
            [self.base_mass], self.base_inertia.ravel(), self.mass, self.com.ravel(), self.inertia.ravel(),
            self.position.ravel(), self.orientation.ravel(), self.axis.ravel(), self.offset.ravel(),
            np.zeros(n), np.ones(n), np.zeros(2 * n), [2.0], np.zeros(3), [1, 0, 0, 0], np.zeros(6), np.zeros(4 * n),
        ])
        self.x = random.uniform(-1, 1, (STATES, 13 + 2 * n))
        self.x[:, 3:7] = [unit(random, 4) for _ in range(STATES)]
        self.u = random.uniform(-5, 5, (STATES, n + 6 + 6 * len(self.tips)))
        lines = [self.parent, self.prismatic, self.tips, parameters]
        for x, u in zip(self.x, self.u):
            lines += [x, u]
        text = "\n".join(" ".join(repr(float(v)) for v in row) for row in lines)
        rows = [np.array(row.split(), float) for row in example("space_referee", text).splitlines()]
        assert len(rows) == 4 * STATES
        # Accelerations: of the base in inertial axes, of its rate in base axes, of the joints.
        self.acceleration = [row[7 + n :] for row in rows[0::4]]
        self.m = [row.reshape(6 + n, 6 + n) for row in rows[1::4]]
        self.bias = rows[2::4]
        self.momenta = rows[3::4]

    def split(self, k):
        """Position, attitude, angles; velocity (inertial), rate (base axes), joint rates; of state k."""
        x, n = self.x[k], self.n
        return x[:3], x[3:7], x[7 : 7 + n], x[7 + n : 10 + n], x[10 + n : 13 + n], x[13 + n :]

    def inputs(self, k):
        """Joint torques; force and torque on the base; forces and torques at the tips."""
        u, n, a = self.u[k], self.n, len(self.tips)
        tips = u[n + 6 :]
        return u[:n], u[n : n + 3], u[n + 3 : n + 6], tips[: 3 * a].reshape(a, 3), tips[3 * a :].reshape(a, 3)


@pytest.fixture(scope="module", params=TREES, ids=lambda t: f"{t[0]} bodies, {t[1]} branches")
def robot(request, example):
    return Robot(*request.param, example)


def error(ours, theirs):
    return np.max(np.abs(ours - theirs)) / max(1.0, np.max(np.abs(theirs)))


def test_mujoco(robot):
    mujoco = pytest.importorskip("mujoco")

    def numbers(values):
        return " ".join(repr(float(v)) for v in values)

    def inertial(mass, com, i):
        full = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
        return f'<inertial pos="{numbers(com)}" mass="{mass!r}" fullinertia="{numbers(full)}"/>'

    def body(k):
        """Body k (from 1) with all that it carries."""
        j = k - 1
        kind = "slide" if robot.prismatic[j] else "hinge"
        carried = "".join(body(c + 1) for c in range(robot.n) if robot.parent[c] == k)
        return (
            f'<body name="b{k}" pos="{numbers(robot.position[j])}" quat="{numbers(robot.orientation[j])}">'
            f'<joint name="j{k}" type="{kind}" axis="{numbers(robot.axis[j])}"/>'
            f"{inertial(float(robot.mass[j]), robot.com[j], robot.inertia[j])}{carried}</body>"
        )

    arms = "".join(body(c + 1) for c in range(robot.n) if robot.parent[c] == 0)
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="0 0 0"/><worldbody>'
        f'<body name="base"><freejoint/>{inertial(float(robot.base_mass), np.zeros(3), robot.base_inertia)}{arms}</body>'
        "</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    at = [model.joint(f"j{k + 1}").dofadr[0] for k in range(robot.n)]
    ids = [model.body(f"b{k + 1}").id for k in range(robot.n)]
    base = model.body("base").id
    rows = [0, 1, 2, 3, 4, 5, *at]
    mass, acceleration = [], []
    for k in range(STATES):
        r, q, angles, v, omega, rates = robot.split(k)
        data.qpos[:7], data.qvel[:6] = [*r, *q], [*v, *omega]
        for j, row in enumerate(at):
            data.qpos[row + 1], data.qvel[row] = angles[j], rates[j]
        torque, force, turning, tip_force, tip_torque = robot.inputs(k)
        data.qfrc_applied[:] = 0
        data.qfrc_applied[at] = torque
        data.xfrc_applied[:] = 0
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        data.xfrc_applied[base] = [*force, *turning]
        for a, tip in enumerate(robot.tips):
            i = ids[tip - 1]
            point = data.xpos[i] + data.xmat[i].reshape(3, 3) @ robot.offset[a]
            lever = np.cross(point - data.xipos[i], tip_force[a])
            data.xfrc_applied[i] += [*tip_force[a], *(tip_torque[a] + lever)]
        mujoco.mj_forward(model, data)
        acceleration.append(error(robot.acceleration[k], data.qacc[rows]))
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        # Their first three coordinates are in inertial axes, ours in base axes.
        turn = np.eye(model.nv)
        turn[:3, :3] = rotation(q)
        mass.append(error(robot.m[k], (turn.T @ full @ turn)[np.ix_(rows, rows)]))
    report(f"M against MuJoCo, {STATES} states", mass, 1e-12)
    report("accelerations against MuJoCo", acceleration, 1e-9)


@pytest.mark.full
def test_pinocchio(robot):
    pin = pytest.importorskip("pinocchio")
    tree = pin.Model()
    base = tree.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    tree.appendBodyToJoint(base, pin.Inertia(robot.base_mass, np.zeros(3), robot.base_inertia), pin.SE3.Identity())
    ids = [base] + [0] * robot.n
    # Its algorithms take the bodies of a branch to be numbered one after the other.
    order, rest = [], [k for k in reversed(range(robot.n)) if robot.parent[k] == 0]
    while rest:
        order.append(rest.pop())
        rest += [k for k in reversed(range(robot.n)) if robot.parent[k] == order[-1] + 1]
    for j in order:
        place = pin.SE3(rotation(robot.orientation[j]), robot.position[j])
        kind = pin.JointModelPrismaticUnaligned if robot.prismatic[j] else pin.JointModelRevoluteUnaligned
        joint = tree.addJoint(ids[robot.parent[j]], kind(robot.axis[j]), place, f"j{j + 1}")
        tree.appendBodyToJoint(joint, pin.Inertia(robot.mass[j], robot.com[j], robot.inertia[j]), pin.SE3.Identity())
        ids[j + 1] = joint
    tree.gravity.setZero()
    data = tree.createData()
    at_q = [tree.joints[i].idx_q for i in ids[1:]]
    at_v = [tree.joints[i].idx_v for i in ids[1:]]
    rows = [0, 1, 2, 3, 4, 5, *at_v]
    mass, bias, acceleration, momentum = [], [], [], []
    for k in range(STATES):
        r, quaternion, angles, velocity, omega, rates = robot.split(k)
        turn = rotation(quaternion)
        w, x, y, z = quaternion
        q, v, tau = np.zeros(tree.nq), np.zeros(tree.nv), np.zeros(tree.nv)
        q[:7], v[:6] = [*r, x, y, z, w], [*(turn.T @ velocity), *omega]
        q[at_q], v[at_v] = angles, rates
        torque, force, turning, tip_force, tip_torque = robot.inputs(k)
        tau[at_v] = torque
        pin.forwardKinematics(tree, data, q)
        outer = pin.StdVec_Force()
        outer.extend([pin.Force.Zero() for _ in range(tree.njoints)])
        outer[base] = pin.Force(turn.T @ force, turn.T @ turning)
        for a, tip in enumerate(robot.tips):
            i = ids[tip]
            own = data.oMi[i].rotation.T
            f = own @ tip_force[a]
            outer[i] += pin.Force(f, own @ tip_torque[a] + np.cross(robot.offset[a], f))
        theirs = pin.aba(tree, data, q, v, tau, outer)[rows]
        theirs[:3] = turn @ (theirs[:3] + np.cross(omega, v[:3]))
        acceleration.append(error(robot.acceleration[k], theirs))
        m = pin.crba(tree, data, q)
        m = np.triu(m) + np.triu(m, 1).T
        mass.append(error(robot.m[k], m[np.ix_(rows, rows)]))
        bias.append(error(robot.bias[k], pin.nonLinearEffects(tree, data, q, v)[rows]))
        pin.computeCentroidalMomentum(tree, data, q, v)
        h = data.hg
        about = h.angular + np.cross(data.com[0], h.linear)
        energy = pin.computeKineticEnergy(tree, data, q, v)
        momentum.append(error(robot.momenta[k], np.array([*h.linear, *about, energy])))
    report(f"M against Pinocchio, {STATES} states", mass, 1e-11)
    report("C v against Pinocchio", bias, 1e-11)
    report("accelerations against Pinocchio", acceleration, 1e-11)
    report("momenta and energy against Pinocchio", momentum, 1e-11)


@pytest.mark.full
def test_drake(robot):
    pytest.importorskip("pydrake", reason="drake is not installed")
    from pydrake.common.eigen_geometry import Quaternion
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.math import SpatialForce
    from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, PrismaticJoint, RevoluteJoint, RotationalInertia, SpatialInertia
    from pydrake.common.value import Value

    plant = MultibodyPlant(0.0)

    def inertia_of(mass, com, central):
        i = central
        about = RotationalInertia(i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        return SpatialInertia.MakeFromCentralInertia(mass, com, about)

    bodies = [plant.AddRigidBody("base", inertia_of(robot.base_mass, np.zeros(3), robot.base_inertia))]
    joints = []
    for j in range(robot.n):
        body = plant.AddRigidBody(f"b{j + 1}", inertia_of(robot.mass[j], robot.com[j], robot.inertia[j]))
        carrier = bodies[robot.parent[j]].body_frame()
        place = RigidTransform(RotationMatrix(rotation(robot.orientation[j])), robot.position[j])
        frame = plant.AddFrame(FixedOffsetFrame(f"f{j + 1}", carrier, place))
        kind = PrismaticJoint if robot.prismatic[j] else RevoluteJoint
        joints.append(plant.AddJoint(kind(f"j{j + 1}", frame, body.body_frame(), robot.axis[j])))
        bodies.append(body)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    at_v = [j.velocity_start() for j in joints]
    first = bodies[0].floating_velocities_start_in_v()
    rows = [*range(first + 3, first + 6), *range(first, first + 3), *at_v]
    mass, acceleration = [], []
    for k in range(STATES):
        r, q, angles, v, omega, rates = robot.split(k)
        turn = rotation(q)
        plant.SetFreeBodyPose(context, bodies[0], RigidTransform(Quaternion(q / np.linalg.norm(q)), r))
        velocities = np.zeros(plant.num_velocities())
        velocities[first : first + 3], velocities[first + 3 : first + 6] = turn @ omega, v
        velocities[at_v] = rates
        plant.SetVelocities(context, velocities)
        positions = plant.GetPositions(context)
        positions[[j.position_start() for j in joints]] = angles
        plant.SetPositions(context, positions)
        torque, force, turning, tip_force, tip_torque = robot.inputs(k)
        tau = np.zeros(plant.num_velocities())
        tau[at_v] = torque
        outer = []
        for body, point, f, t in [(0, np.zeros(3), force, turning)] + [
            (tip, robot.offset[a], tip_force[a], tip_torque[a]) for a, tip in enumerate(robot.tips)
        ]:
            one = ExternallyAppliedSpatialForce()
            one.body_index, one.p_BoBq_B = bodies[body].index(), point
            one.F_Bq_W = SpatialForce(tau=t, f=f)
            outer.append(one)
        plant.get_applied_generalized_force_input_port().FixValue(context, tau)
        plant.get_applied_spatial_force_input_port().FixValue(context, Value[list[ExternallyAppliedSpatialForce]](outer))
        theirs = plant.get_generalized_acceleration_output_port().Eval(context)[rows]
        theirs[3:6] = turn.T @ theirs[3:6]
        acceleration.append(error(robot.acceleration[k], theirs))
        m = plant.CalcMassMatrix(context)[np.ix_(rows, rows)]
        own = np.eye(len(rows))
        own[:3, :3] = own[3:6, 3:6] = turn
        mass.append(error(robot.m[k], own.T @ m @ own))
    report(f"M against Drake, {STATES} states", mass, 1e-11)
    report("accelerations against Drake", acceleration, 1e-11)
