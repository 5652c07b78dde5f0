"""Exact derivatives as matrices."""

import numpy as np
import pytest
import trueup as tu

K, D, N, J, KT = 2.2e-5, 3e-8, 44340.0, 9.0, 0.02
VALUES = {"stiffness": K, "damping": D, "gearRatio": N, "loadInertia": J, "torqueConstant": KT}


def test_matrices_are_those_of_the_equations(joint):
    """TMJ-1 to TMJ-3: sliding forward, so that friction is its level and its slope."""
    own = {"motorInertia": 1.2e-7, "viscousFriction": 4e-8}
    at = {"state.motorVelocity": 20.0, "state.twist": 0.3}
    linear = joint.linearize(0.5, states=at, inputs={"motorCurrent": 0.01}, parameters=VALUES | own)
    assert linear.states == ("state.motorAngle", "state.motorVelocity", "state.twist", "state.loadVelocity")
    assert linear.inputs == ("motorCurrent", "externalTorque")
    np.testing.assert_array_equal(linear.x, [0.0, 20.0, 0.3, 0.0])
    np.testing.assert_array_equal(linear.u, [0.01, 0.0])
    i, d = own["motorInertia"], own["viscousFriction"]
    a, b, c, through = linear
    np.testing.assert_allclose(
        a, [[0, 1, 0, 0], [0, -(D + d) / i, -K / i, N * D / i], [0, 1, 0, -N], [0, N * D / J, N * K / J, -N * N * D / J]]
    )
    np.testing.assert_allclose(b, [[0, 0], [KT / i, 0], [0, 0], [0, 1 / J]])
    row = linear.outputs.index("loadAngle")
    np.testing.assert_allclose(c[row], [1 / N, 0, -1 / N, 0])
    torque = linear.outputs.index("motorTorque")
    np.testing.assert_allclose(through[torque], [KT, 0])
    assert linear.y[torque] == KT * 0.01
    assert linear.f[0] == 20.0
    frame = linear.to_pandas()
    assert frame.loc["der(state.twist)", "state.loadVelocity"] == -N
    assert frame.loc["motorTorque", "motorCurrent"] == KT


def test_a_joint_that_rests_sticks(joint):
    linear = joint.linearize(parameters=VALUES)
    np.testing.assert_array_equal(linear.A[1], 0.0)
    np.testing.assert_array_equal(linear.B[1], 0.0)


@pytest.mark.parametrize("version", [2, 3])
def test_matrices_of_an_arm_are_those_of_differences(fmus, version):
    arm = tu.Fmu(fmus / f"PlanarManipulator.fmi{version}.fmu")
    given = {"state.jointAngle[2]": 0.7, "state.jointVelocity[1]": 0.2, "state.baseRate": -0.1}
    torque = {"jointTorque[1]": 0.3}
    there = arm.linearize(states=given, inputs=torque)
    columns, h = [], 1e-6
    for k, name in enumerate(there.states):
        two = [arm.linearize(states=given | {name: there.x[k] + s * h}, inputs=torque) for s in (1, -1)]
        columns.append(np.concatenate([two[0].f - two[1].f, two[0].y - two[1].y]) / (2 * h))
    exact = np.vstack([there.A, there.C])
    np.testing.assert_allclose(exact, np.array(columns).T, rtol=0, atol=1e-6 * np.abs(exact).max())


def test_what_linearize_cannot_do_is_said(joint):
    with pytest.raises(tu.Error, match="did you mean `state.twist`"):
        joint.linearize(states={"state.twst": 0.1})
    with pytest.raises(tu.Error, match="motorCurrent"):
        joint.linearize(inputs={"motorCurent": 0.1})
