"""An arm of two links that bend, against engines that know rigid bodies alone: there a link is N pieces on springs.

Every hinge is in the middle of one Nth of the link and as compliant as that Nth, E J N / length; pieces are rods from hinge
to hinge. What that is off falls by 1/N^2, so the beam comes by extrapolation. Springs are the referee's own: engines are used
for mass matrices and for what gravity and rates do.
"""

import numpy as np
import pytest

from referee import report

LENGTH = np.array([0.6, 0.5])
STIFFNESS = np.array([1985.0, 375.0])
MASS_PER_LENGTH = np.array([0.8, 0.5])
SPRING = np.array([10400.0, 18500.0])
# At the elbow and at the tip.
MASS = np.array([1.0, 2.5])
GRAVITY = np.array([1.5, -9.81])
# Angles and rates of both joints.
STATES = [
    [0.3, 0.0, 1.0, -0.5],
    [1.2, np.pi / 4, -2.0, 1.5],
    [-0.7, np.pi / 2, 1.0, 4.0],
    [2.0, 3 * np.pi / 4, 3.0, -2.0],
    [0.0, -np.pi / 3, -1.5, -3.0],
]
PIECES = np.array([20, 40, 80])
SHAPES = 5


def chain(n):
    """Length, mass, centre of mass from the hinge, inertia about it of the 2 (n + 1) pieces, from root to tip."""
    pieces = []
    for length, density, end in zip(LENGTH, MASS_PER_LENGTH, MASS):
        h = length / n
        for k in range(n + 1):
            own = h if 0 < k < n else h / 2
            parts = [(density * own, own / 2, density * own**3 / 12), (end if k == n else 0.0, own, 0.0)]
            mass = sum(m for m, _, _ in parts)
            centre = sum(m * x for m, x, _ in parts) / mass
            pieces.append((own, mass, centre, sum(i + m * (x - centre) ** 2 for m, x, i in parts)))
    return np.array(pieces)


def springs(n):
    bending = [np.full(n, e * n / length) for e, length in zip(STIFFNESS, LENGTH)]
    return np.concatenate([SPRING[:1], bending[0], SPRING[1:], bending[1]])


def straight(n, values):
    """Of all hinges: those of the two joints, 0 of the others."""
    all_hinges = np.zeros(2 * (n + 1))
    all_hinges[[0, n + 1]] = values
    return all_hinges


def pinocchio(n):
    pin = pytest.importorskip("pinocchio")
    tree = pin.Model()
    body, end = 0, 0.0
    for k, (length, mass, centre, inertia) in enumerate(chain(n)):
        place = pin.SE3(np.eye(3), np.array([end, 0.0, 0.0]))
        body = tree.addJoint(body, pin.JointModelRZ(), place, f"q{k}")
        own = pin.Inertia(mass, np.array([centre, 0.0, 0.0]), np.diag([0.0, 0.0, inertia]))
        tree.appendBodyToJoint(body, own, pin.SE3.Identity())
        end = length
    tree.gravity.linear = np.array([*GRAVITY, 0.0])
    data = tree.createData()

    def at(q, v):
        m = np.triu(pin.crba(tree, data, q))
        return m + np.triu(m, 1).T, pin.nonLinearEffects(tree, data, q, v)

    return at


def mujoco(n):
    mujoco = pytest.importorskip("mujoco")
    opened, closed, end = "", "", 0.0
    for length, mass, centre, inertia in map(lambda row: map(float, row), chain(n)):
        # Inertias across the plane are of no account.
        opened += (
            f'<body pos="{end!r} 0 0"><joint type="hinge" axis="0 0 1"/>'
            f'<inertial pos="{centre!r} 0 0" mass="{mass!r}" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>'
        )
        closed += "</body>"
        end = length
    gravity = " ".join(repr(float(g)) for g in GRAVITY)
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" inertiafromgeom="false"/><option gravity="{gravity} 0"/>'
        f"<worldbody>{opened}{closed}</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)

    def at(q, v):
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        return full, data.qfrc_bias.copy()

    return at


def frequencies(mass, stiffness):
    root = 1 / np.sqrt(stiffness)
    slow = np.linalg.eigvalsh(root[:, None] * mass * root)[::-1]
    return 1 / np.sqrt(slow[:3])


def allowed(n, shapes):
    """What hinges do per unit of the joints' angles and of as many polynomials per link: links that bend by the powers 2, 3 ..
    of the place alone. A hinge turns by as much as the slope changes over its Nth."""
    z = np.arange(n + 1) / n
    powers = np.arange(2, 2 + shapes)
    # Powers are much alike; what they span is what counts.
    bending, _ = np.linalg.qr(np.diff(powers * z[:, None] ** (powers - 1), axis=0))
    half, full = n + 1, shapes + 1
    columns = np.zeros((2 * half, 2 * full))
    for k in range(2):
        columns[k * half, k * full] = 1.0
        columns[k * half + 1 : (k + 1) * half, k * full + 1 : (k + 1) * full] = bending
    return columns


def accelerations(n, shapes, mass, forces, q, v):
    """Of both joints and of the tip (x, y), links straight and slack, bending by so many shapes."""
    columns = allowed(n, shapes)
    y = np.linalg.solve(columns.T @ mass @ columns, -columns.T @ forces)
    angle, rate, turn = np.cumsum(q), np.cumsum(v), np.cumsum(columns @ y)
    length = chain(n)[:, 0]
    tip = [
        np.sum(length * (-np.sin(angle) * turn - np.cos(angle) * rate**2)),
        np.sum(length * (np.cos(angle) * turn - np.sin(angle) * rate**2)),
    ]
    return np.array([y[0], y[shapes + 1], *tip])


def limit(coarse, middle, fine):
    """Where values off by a / N^2 + b / N^4 go, and the order that they show."""
    first, second = (4 * middle - coarse) / 3, (4 * fine - middle) / 3
    return (16 * second - first) / 15, np.log2(np.abs((coarse - middle) / (middle - fine)))


def ours(example, shapes):
    lines = [LENGTH, STIFFNESS, MASS_PER_LENGTH, SPRING, MASS, GRAVITY, [shapes], *STATES]
    text = "\n".join(" ".join(repr(float(v)) for v in row) for row in lines)
    rows = [np.array(row.split(), float) for row in example("flexible_arm_referee", text).splitlines()]
    assert len(rows) == 2 * len(STATES)
    return np.array([row[:3] for row in rows[0::2]]), np.array(rows[1::2])


@pytest.fixture(params=[mujoco, pytest.param(pinocchio, marks=pytest.mark.full)], ids=lambda e: e.__name__)
def engine(request):
    return request.param


def test_frequencies_with_motors_held(engine, example):
    found = []
    for n in PIECES:
        at, stiffness = engine(n), springs(n)
        found.append([frequencies(at(straight(n, s[:2]), straight(n, [0, 0]))[0], stiffness) for s in STATES])
    exact, order = limit(*np.array(found))
    plain = np.max(np.abs(found[-1] / exact - 1))
    print(f"\norder in 1/N: {order.min():.3f} to {order.max():.3f}; {PIECES[-1]} pieces off by {plain:.1e}")
    assert np.all(np.abs(order - 2) < 0.1)
    for row in exact / (2 * np.pi):
        print("Hz:", " ".join(f"{f:.4f}" for f in row))
    for shapes, bound in [(2, 0.2), (3, 0.01), (SHAPES, 1e-4)]:
        off = ours(example, shapes)[0] / exact - 1
        print(f"{shapes} shapes, by mode:", " ".join(f"{e:.1e}" for e in np.max(np.abs(off), axis=0)))
        # Shapes can but stiffen.
        assert np.all(off > -1e-6)
        report(f"three frequencies at {len(STATES)} postures against {engine.__name__}, {shapes} shapes", np.abs(off), bound)


def test_accelerations_under_gravity(engine, example):
    for shapes in [2, 3, SHAPES]:
        found = []
        # The nearer to the root hinges are, the more they count here, so there are more of them than above.
        for n in 2 * PIECES:
            at = engine(n)
            one = []
            for s in STATES:
                q, v = straight(n, s[:2]), straight(n, s[2:])
                one.append(accelerations(n, shapes, *at(q, v), q, v))
            found.append(one)
        exact, _ = limit(*np.array(found))
        off = [np.abs(a - b) / np.max(np.abs(b)) for a, b in zip(ours(example, shapes)[1], exact)]
        plain = np.max([np.abs(a - b) / np.max(np.abs(b)) for a, b in zip(found[-1], exact)])
        print(f"\n{2 * PIECES[-1]} pieces off by {plain:.1e}")
        report(f"accelerations at large angles and rates against {engine.__name__}, {shapes} shapes", off, 1e-5)
