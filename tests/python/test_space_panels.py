"""Panels by assumed modes against chains of rigid segments with springs in MuJoCo, which has no shapes."""

import mujoco
import numpy as np

LENGTH, MASS, STIFFNESS, BASE, SIDE = 4.0, 1.0, 200.0, (120.0, (12.0, 14.0, 10.0)), 0.6
# Exact: a base with two such panels at (0, +-0.6, 0), free; soft bending with the base moving along z, turning about x.
EXACT = {"translation": [3.1690343594217785, 19.596235217521812], "rotation": [6.64420648976283, 21.810103018166224]}


def chain(n):
    """The two lowest free frequencies of soft bending (about x) of a base with two panels of `n` elements each, rad/s. The bending of an
    element is a hinge in its middle; its matter stays where it is along the panel."""
    h = LENGTH / n

    def rod(begin, end, inner):
        """The stretch of the panel between two hinges, in the axes of the first."""
        m, length = MASS * (end - begin), end - begin
        i = m * length**2 / 12
        return (
            f'<inertial pos="0 {length / 2!r} 0" mass="{m!r}" diaginertia="{i!r} {1e-6 * m!r} {i!r}"/>{inner}'
        )

    def hinges(k):
        """From hinge k to the tip."""
        if k == n:
            return ""
        begin, end = (k + 0.5) * h, min((k + 1.5) * h, LENGTH)
        step = h if k else 0.5 * h
        return (
            f'<body pos="0 {step!r} 0"><joint type="hinge" axis="1 0 0" stiffness="{STIFFNESS / h!r}"/>'
            f"{rod(begin, end, hinges(k + 1))}</body>"
        )

    def panel(quaternion, side):
        root = f'<inertial pos="0 {h / 4!r} 0" mass="{MASS * h / 2!r}" diaginertia="{MASS * h**3 / 96!r} 1e-9 {MASS * h**3 / 96!r}"/>'
        return f'<body pos="0 {side!r} 0" quat="{quaternion}">{root}{hinges(0)}</body>'

    mass, inertia = BASE
    xml = (
        '<mujoco><compiler angle="radian" balanceinertia="false"/><option gravity="0 0 0"/><worldbody><body><freejoint/>'
        f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>'
        f'{panel("1 0 0 0", SIDE)}{panel("0 0 0 1", -SIDE)}</body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    m = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, m)
    k = np.zeros(model.nv)
    k[6:] = model.jnt_stiffness[1:]
    half = np.linalg.inv(np.linalg.cholesky(m))
    values, vectors = np.linalg.eigh(half @ np.diag(k) @ half.T)
    shapes = half.T @ vectors
    found = {"translation": [], "rotation": []}
    for value, shape in zip(values, shapes.T):
        if value < 1e-3:
            continue  # the base with all that it carries
        found["translation" if abs(shape[2]) > abs(shape[3]) else "rotation"].append(np.sqrt(value))
    return {name: np.array(list_[:2]) for name, list_ in found.items()}


def test_chains_come_to_the_exact_frequencies_as_one_over_the_square():
    coarse, fine = chain(12), chain(24)
    for name, exact in EXACT.items():
        one, two = coarse[name] / exact - 1, fine[name] / exact - 1
        richardson = (4 * fine[name] - coarse[name]) / 3 / exact - 1
        print(f"{name}: 12 elements {one}, 24 {two}, by both {richardson}")
        assert np.all(np.abs(one / two - 4) < 0.3)
        assert np.max(np.abs(richardson)) < 1e-4
