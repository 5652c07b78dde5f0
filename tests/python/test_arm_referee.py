"""M, C and C v of the manipulator against Pinocchio and MuJoCo, which know nothing of its closed form.

The manipulator is a tree there: two prismatic joints and a revolute one carry the satellite, revolute joints
carry the links; a motor is a mass-less disc on a revolute joint of its own.
"""

import numpy as np
import pytest

from referee import report

STATES = 250
FLEXIBILITY = [[0], [0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0, 1, 0], [1, 0, 1, 1, 0, 1]]


class Arm:
    """Random parameters, random states, and Rust's results for them."""

    def __init__(self, flexible, example):
        random = np.random.default_rng(len(flexible) * 10 + sum(flexible))
        self.flexible = flexible
        self.n = n = len(flexible)
        self.base_mass, self.base_inertia = random.uniform(5, 60), random.uniform(1, 5)
        self.mount = random.uniform(-0.4, 0.4, 2)
        self.mass, self.inertia = random.uniform(1, 5, n), random.uniform(0.02, 0.5, n)
        self.length, self.com = random.uniform(0.1, 0.8, n), random.uniform(-0.3, 0.3, (n, 2))
        # Rotors of rigid joints are left out: they have no angle of their own.
        self.rotor = random.uniform(0.1, 6, n) * flexible
        parameters = np.concatenate([
            [self.base_mass, self.base_inertia], self.mount, self.mass, self.inertia, self.length, self.com.ravel(),
            self.rotor, np.full(n, 100.0), np.ones(2 * n), np.zeros(6 + 4 * n), [1.0],
        ])
        self.dofs = 3 + n + sum(flexible)
        self.q = random.uniform(-3, 3, (STATES, self.dofs))
        self.v = random.uniform(-2, 2, (STATES, self.dofs))
        lines = [flexible, parameters, *np.hstack([self.q, self.v])]
        text = "\n".join(" ".join(repr(float(x)) for x in row) for row in lines)
        rows = [np.array(row.split(), float) for row in example("arm_referee", text).splitlines()]
        assert len(rows) == 3 * STATES
        self.m = [row.reshape(self.dofs, self.dofs) for row in rows[0::3]]
        self.bias = rows[1::3]
        self.c = [row.reshape(3 + n, 3 + n) for row in rows[2::3]]


@pytest.fixture(scope="module", params=FLEXIBILITY, ids=lambda f: "".join("F" if x else "R" for x in f))
def arm(request, example):
    return Arm(request.param, example)


def error(ours, theirs):
    return np.max(np.abs(ours - theirs)) / np.max(np.abs(theirs))


@pytest.mark.full
def test_pinocchio(arm):
    pin = pytest.importorskip("pinocchio")
    n = arm.n
    tree = pin.Model()
    still = pin.SE3.Identity()

    def at(xy):
        return pin.SE3(np.eye(3), np.array([xy[0], xy[1], 0.0]))

    def disc(inertia, mass=0.0, com=(0.0, 0.0)):
        return pin.Inertia(mass, np.array([com[0], com[1], 0.0]), np.diag([0.0, 0.0, inertia]))

    # Coordinates in Pinocchio's order, each with its row here.
    rows = [0, 1, 2]
    body = tree.addJoint(0, pin.JointModelPX(), still, "x")
    body = tree.addJoint(body, pin.JointModelPY(), still, "y")
    body = tree.addJoint(body, pin.JointModelRZ(), still, "q0")
    tree.appendBodyToJoint(body, disc(arm.base_inertia, arm.base_mass), still)
    end, motors = arm.mount, 0
    for j in range(n):
        if arm.flexible[j]:
            motor = tree.addJoint(body, pin.JointModelRZ(), at(end), f"m{j}")
            tree.appendBodyToJoint(motor, disc(arm.rotor[j]), still)
            rows.append(3 + n + motors)
            motors += 1
        body = tree.addJoint(body, pin.JointModelRZ(), at(end), f"q{j + 1}")
        tree.appendBodyToJoint(body, disc(arm.inertia[j], arm.mass[j], arm.com[j]), still)
        rows.append(3 + j)
        end = (arm.length[j], 0.0)
    tree.gravity.setZero()
    data = tree.createData()
    order = [rows.index(k) for k in range(arm.dofs)]  # theirs -> ours
    chain = order[: 3 + n]
    mass, bias, coriolis = [], [], []
    for q, v, m, b, c in zip(arm.q, arm.v, arm.m, arm.bias, arm.c):
        q, v = q[rows], v[rows]
        theirs = pin.crba(tree, data, q)
        theirs = np.triu(theirs) + np.triu(theirs, 1).T
        mass.append(error(m, theirs[np.ix_(order, order)]))
        nle = pin.nonLinearEffects(tree, data, q, v)[order]
        bias.append(error(b, nle[: 3 + n]))
        assert np.all(np.abs(nle[3 + n :]) < 1e-10)  # no effect on rotors
        coriolis.append(error(c, pin.computeCoriolisMatrix(tree, data, q, v)[np.ix_(chain, chain)]))
    report(f"M + J* against Pinocchio, {STATES} states", mass, 1e-13)
    report("C v against Pinocchio", bias, 1e-12)
    report("C against Pinocchio", coriolis, 1e-12)


def test_mujoco(arm):
    mujoco = pytest.importorskip("mujoco")
    n = arm.n
    # Across the plane inertias are of no account, but MuJoCo requires a body that can exist.
    def inertial(mass, inertia, com=(0.0, 0.0)):
        return (f'<inertial pos="{com[0]!r} {com[1]!r} 0" mass="{mass!r}" '
                f'diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>')

    hinge = '<joint type="hinge" axis="0 0 1" name="{}"/>'
    opened, closed = "", ""
    end = arm.mount
    for j in range(n):
        opened += f'<body pos="{float(end[0])!r} {float(end[1])!r} 0">' + hinge.format(f"q{j + 1}")
        opened += inertial(float(arm.mass[j]), float(arm.inertia[j]), [float(c) for c in arm.com[j]])
        closed += "</body>"
        end = (arm.length[j], 0.0)
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="0 0 0"/><worldbody><body>
        <joint type="slide" axis="1 0 0" name="x"/><joint type="slide" axis="0 1 0" name="y"/>{hinge.format("q0")}
        {inertial(float(arm.base_mass), float(arm.base_inertia))}{opened}{closed}</body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    chain = 3 + n
    # MuJoCo has no mass-less bodies: the rotors as printed (S0 eq. 17-20), row by row from their rates.
    rotors, motor = np.zeros((arm.dofs, arm.dofs)), chain
    for j in range(n):
        if arm.flexible[j]:
            rate = np.zeros(arm.dofs)
            rate[2 : 3 + j] = 1.0
            rate[motor] = 1.0
            motor += 1
            rotors += arm.rotor[j] * np.outer(rate, rate)
    mass, bias = [], []
    full = np.zeros((chain, chain))
    for q, v, m, b in zip(arm.q, arm.v, arm.m, arm.bias):
        data.qpos[:], data.qvel[:] = q[:chain], v[:chain]
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        theirs = rotors.copy()
        theirs[:chain, :chain] += full
        mass.append(error(m, theirs))
        bias.append(error(b, data.qfrc_bias))
    report(f"M + J* against MuJoCo, {STATES} states", mass, 1e-12)
    report("C v against MuJoCo", bias, 1e-11)
