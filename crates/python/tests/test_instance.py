"""A running FMU step by step, its derivatives, and the environment of Gymnasium."""

import threading

import numpy as np
import pytest
import trueup as tu


@pytest.fixture(scope="module")
def arm(fmus):
    return tu.Fmu(fmus / "PlanarManipulator.fmi3.fmu")


@pytest.mark.parametrize("version", [2, 3])
def test_steps_with_held_inputs_are_those_of_a_run(fmus, version):
    """Inputs hold over a step: the master's run with the same held inputs is the reference."""
    fmu = tu.Fmu(fmus / f"TwoMassJoint.fmi{version}.fmu")
    dt, steps = 0.01, 200
    current = 0.03 * np.sin(0.2 * np.arange(steps))
    with fmu.instance({"stiffness": 2.2e-5}) as joint:
        stepped = []
        for i in current:
            joint["motorCurrent"] = i
            joint.step(dt)
            stepped.append((joint.time, joint["motorAngle"], joint["loadAngle"]))
    time, motor, load = np.array(stepped).T
    # A jump at each step: the value on its left, then on its right.
    edges = np.repeat(np.arange(steps + 1) * dt, 2)[1:-1]
    edges[1::2] -= 1e-12
    run = fmu.simulate(
        np.arange(steps + 1) * dt,
        {"time": edges, "motorCurrent": np.repeat(current, 2)},
        {"stiffness": 2.2e-5},
        interface="model-exchange",
        tolerance=1e-9,
    )
    np.testing.assert_allclose(time, run.time[1:], rtol=1e-12)
    np.testing.assert_allclose(motor, run["motorAngle"][1:], atol=2e-4 * np.abs(motor).max())
    np.testing.assert_allclose(load, run["loadAngle"][1:], atol=2e-4 * np.abs(load).max())
    assert np.abs(motor).max() > 1


def test_an_array_is_set_whole_or_by_element(arm):
    with arm.instance({"initialJointAngle": [0.3, 0.2, 0.1]}) as one, arm.instance({"initialJointAngle": [0.3, 0.2, 0.1]}) as other:
        np.testing.assert_allclose(one["jointAngle"], [0.3, 0.2, 0.1])
        assert one["jointAngle[2]"] == 0.2 and isinstance(one["kineticEnergy"], float)
        one.set("jointTorque", [0.1, -0.2, 0.3])
        for k, torque in enumerate([0.1, -0.2, 0.3], 1):
            other[f"jointTorque[{k}]"] = torque
        for instance in (one, other):
            instance.step(0.05)
        np.testing.assert_array_equal(one["jointAngle"], other["jointAngle"])
        assert np.abs(one["jointVelocity"]).max() > 1e-3


def test_derivatives_are_those_of_differences(arm):
    """Accelerations are linear in torques: outputs are read after one short step, at the same state by states and inputs as they are."""
    start = {"initialJointAngle": [0.4, -0.3, 0.8], "initialJointVelocity": [0.2, 0.1, -0.3]}
    with arm.instance(start) as running:
        running.set("jointTorque", [0.2, 0.1, -0.1])
        running.step(0.02)
        about = running.linearize()
        assert about.A.shape == (len(about.states),) * 2
        np.testing.assert_allclose([about.u[about.inputs.index(f"jointTorque[{k}]")] for k in (1, 2, 3)], [0.2, 0.1, -0.1])
        states = {name: running[name] for name in about.states}
        np.testing.assert_allclose(about.x, list(states.values()), rtol=1e-12, atol=1e-15)
        found = running.derivatives(["jointVelocity", "jointAngle"], "jointTorque")
        assert found.matrix.shape == (6, 3) and found.of[0] == "jointVelocity[1]" and found.by[2] == "jointTorque[3]"
        h = 1e-6
        for name in about.states[:3]:
            up, down = (arm.linearize(running.time, states={**states, name: states[name] + s * h}, inputs={"jointTorque": [0.2, 0.1, -0.1]}) for s in (1, -1))
            column = about.A[:, about.states.index(name)]
            np.testing.assert_allclose((up.f - down.f) / (2 * h), column, rtol=1e-4, atol=1e-6 * np.abs(about.A).max())


def test_instances_run_side_by_side(joint):
    """Threads share the FMU, not its instances."""

    def run(current, out):
        with joint.instance() as one:
            one["motorCurrent"] = current
            for _ in range(50):
                one.step(0.01)
            out.append(one["motorAngle"])

    results = {}
    threads = []
    for current in (0.02, 0.03, 0.04):
        results[current] = []
        threads.append(threading.Thread(target=run, args=(current, results[current])))
    [t.start() for t in threads]
    [t.join() for t in threads]
    alone = []
    run(0.03, alone)
    assert results[0.03] == alone and results[0.02][0] < results[0.03][0] < results[0.04][0]


@pytest.mark.parametrize(
    "wrong, message, variable",
    [
        (lambda one: one["motorAngel"], "did you mean `motorAngle`", "motorAngel"),
        (lambda one: one.set("motorCurrent", [1, 2]), "1 elements, not 2", "motorCurrent"),
        (lambda one: one.set("motorCurrent", np.nan), "finite", "motorCurrent"),
        (lambda one: one.set("motorAngle", 1), "is calculated", "motorAngle"),
        (lambda one: one.set("gearRatio", 10), "stays as it is during a run", "gearRatio"),
        (lambda one: one.step(0), "leads nowhere", None),
        (lambda one: one.derivatives("nothing", "motorCurrent"), "no variable `nothing`", "nothing"),
        (lambda one: (one.close(), one.close(), one.step(0.1)), "is closed", None),
    ],
)
def test_mistakes_name_the_variable_and_the_remedy(joint, wrong, message, variable):
    with joint.instance() as one:
        with pytest.raises(tu.Error) as caught:
            wrong(one)
    assert message in str(caught.value) and (variable is None or caught.value.variable == variable)
    with pytest.raises(tu.Error, match="did you mean `stiffness`"):
        joint.instance({"stifness": 1})


def test_an_environment_follows_the_rules_of_gymnasium(arm):
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env
    from trueup.gymnasium import Environment

    env = Environment(
        arm,
        actions={"jointTorque": (-0.5, 0.5)},
        observations=["jointAngle", "jointVelocity", "baseAttitude"],
        reward=lambda values: -float(np.sum(np.square(values["jointAngle"]))),
        step=0.01,
        seconds=0.2,
        randomize=lambda rng: {"initialJointAngle": rng.uniform(-1, 1, 3)},
    )
    check_env(env, skip_render_check=True)
    first, info = env.reset(seed=3)
    assert first.shape == (7,) and env.action_space.shape == (3,) and info["time"] == 0
    again, _ = env.reset(seed=3)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, env.reset(seed=4)[0])
    ends = [env.step(np.zeros(3))[2:4] for _ in range(20)]
    assert [truncated for _, truncated in ends] == [False] * 19 + [True] and not any(t for t, _ in ends)
    assert env.reset(options={"initialJointAngle": [0.1, 0.2, 0.3]})[0][2] == 0.3
    with pytest.raises(tu.Error, match="give 3 values"):
        env.step(np.zeros(2))
    with pytest.raises(tu.Error, match="no input `jointTork`"):
        Environment(arm, actions={"jointTork": (-1, 1)}, observations=["jointAngle"], reward=lambda v: 0.0)
    env.close()
    assert isinstance(env, gymnasium.Env)
