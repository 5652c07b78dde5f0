"""SpaceController through FMPy and the master: its rates against Pinocchio's generalized Jacobian, the straight line of a hand."""

import os
import random
import resource

import numpy as np
import pyarrow.parquet
import pytest

from conftest import ROOT
from low_level import Opened

WAY = np.array([-0.3, 0.6, -0.4])
# A joint of URDF without it has no single angle in Pinocchio.
LIMIT = '<limit lower="-9" upper="9" effort="9" velocity="9"/>'


def robot(dice, arms, joints):
    """A random URDF: a base with arms of revolute joints, a hand without mass at each end."""

    def vector(size):
        return " ".join(repr(dice.uniform(-size, size)) for _ in range(3))

    def body(name, mass, size):
        ixx, iyy = (mass * size**2 * dice.uniform(0.5, 1) for _ in range(2))
        izz = dice.uniform(abs(ixx - iyy), ixx + iyy)
        return (
            f'<link name="{name}"><inertial><origin xyz="{"0 0 0" if name == "base" else vector(size)}" rpy="{vector(3)}"/>'
            f'<mass value="{mass}"/><inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )

    def joint(name, kind, parent, child, axis=""):
        return (
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{vector(0.5)}" rpy="{vector(3)}"/>{axis}</joint>'
        )

    parts = [body("base", dice.uniform(20, 80), 0.6)]
    for arm in range(arms):
        before = "base"
        for k in range(joints):
            name = f"a{arm}l{k}"
            parts.append(body(name, dice.uniform(1, 6), 0.3))
            parts.append(joint(f"a{arm}j{k}", "revolute", before, name, f'<axis xyz="{vector(1)}"/>{LIMIT}'))
            before = name
        parts.append(f'<link name="hand{arm}"/>')
        parts.append(joint(f"a{arm}hand", "fixed", before, f"hand{arm}"))
    return '<robot name="drawn">' + "".join(parts) + "</robot>"


@pytest.mark.parametrize("arms, joints", ((1, 6), pytest.param(1, 7, marks=pytest.mark.full), pytest.param(2, 6, marks=pytest.mark.full)))
def test_rates_are_those_of_pinocchios_generalized_jacobian(trueup, tmp_path, arms, joints):
    pin = pytest.importorskip("pinocchio")
    seed = int(os.environ.get("TRUEUP_SEED", random.randrange(1 << 32)))
    print(f"TRUEUP_SEED={seed}")
    dice, rng = random.Random(seed), np.random.default_rng(seed)
    file = tmp_path / "robot.urdf"
    file.write_text(robot(dice, arms, joints))
    done = trueup("fmu", "pack", "SpaceController", "--fmi", 3, "--robot", file, "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    data, n = model.createData(), arms * joints
    order = [model.joints[model.getJointId(f"a{a}j{k}")].idx_v for a in range(arms) for k in range(joints)]
    tried, worst = 0, 0.0
    with Opened(tmp_path / "SpaceController.fmi3.fmu", "ME") as f:
        f.initialize({"jointVelocityLimit": np.full(n, 1e9), "singularityThreshold": 0.001})
        for _ in range(20):
            q, rates, reference = rng.uniform(-3, 3, n), rng.uniform(-1, 1, n), rng.uniform(-1, 1, (arms, 6))
            quaternion, velocity, omega = rng.normal(size=4), rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
            quaternion /= np.linalg.norm(quaternion)
            place = np.concatenate((np.zeros(3), quaternion[[1, 2, 3, 0]], np.zeros(n)))
            place[np.array(order) + 1] = q
            pin.computeJointJacobians(model, data, place)
            pin.updateFramePlacements(model, data)
            mass = pin.crba(model, data, place)
            mass = np.triu(mass) + np.triu(mass, 1).T
            turn = pin.Quaternion(place[3:7]).matrix()
            base = np.concatenate((turn.T @ velocity, omega))
            hands = [
                pin.getFrameJacobian(model, data, model.getFrameId(f"hand{a}"), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED) for a in range(arms)
            ]
            whole = np.vstack(hands)
            momentum = mass[:6, :6] @ base + mass[:6][:, order] @ rates
            generalized = whole[:, order] - whole[:, :6] @ np.linalg.solve(mass[:6, :6], mass[:6][:, order])
            if np.linalg.svd(generalized, compute_uv=False).min() < 0.01:
                continue
            tried += 1
            left = reference.ravel() - whole[:, :6] @ np.linalg.solve(mass[:6, :6], momentum)
            expected = np.linalg.pinv(generalized) @ left
            measured = {
                "jointAngle": q, "jointVelocity": rates, "tipVelocityReference": reference.ravel(), "baseQuaternion": quaternion,
                "baseVelocity": velocity, "baseAngularVelocity": omega,
            }
            for name, value in measured.items():
                f.set(name, value)
            got, smallest = np.array(f.get("jointVelocityCommand")), f.get("smallestSingularValue")
            error = np.array(f.get("tipVelocityError"))
            # Rows of the base's axes: the same singular values.
            assert smallest == pytest.approx(np.linalg.svd(generalized, compute_uv=False).min(), rel=1e-9)
            worst = max(worst, np.abs(got - expected).max() / np.abs(expected).max())
            assert np.abs(error).max() < 1e-9 * np.abs(expected).max(), f"TRUEUP_SEED={seed}"
    print(f"{tried} poses, {worst:.1e} relative")
    assert tried > 2 and worst < 1e-9, f"TRUEUP_SEED={seed}: {tried} {worst}"


def simulated(trueup, fmus, tmp_path, *changes):
    """Columns of examples/07-space-arm/space-arm.toml with those changes of its text."""
    text = (ROOT / "examples/07-space-arm/space-arm.toml").read_text().replace("../../out", str(fmus)).replace('"reference.csv"', f"'{ROOT}/examples/07-space-arm/reference.csv'")
    file = tmp_path / "system.toml"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    done = trueup("simulate", file, "-o", tmp_path / "r.parquet")
    assert done.returncode == 0, done.stderr
    return pyarrow.parquet.read_table(tmp_path / "r.parquet")


def straight(trueup, fmus, tmp_path, base="free"):
    """Tip positions and momenta of the example."""
    table = simulated(trueup, fmus, tmp_path, ('baseControl = "free"', f'baseControl = "{base}"'))
    read = lambda name: np.column_stack([table[f"robot.{name}[{i}]"].to_numpy() for i in (1, 2, 3)])  # noqa: E731
    tip = np.column_stack([table[f"robot.tipPosition[1,{i}]"].to_numpy() for i in (1, 2, 3)])
    return tip, read("linearMomentum"), read("angularMomentum")


def test_the_example_runs_faster_than_real_time(trueup, fmus, tmp_path):
    """Robot and controller at 200 Hz, by processor time, the start of the program and the table of results included."""
    used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])  # noqa: E731
    before = used()
    seconds = simulated(trueup, fmus, tmp_path)["time"].to_numpy()[-1]
    factor = seconds / (used() - before)
    print(f"{factor:.0f} times real time")
    assert factor > 5


def test_thrusters_hold_the_attitude_by_pulses(trueup, fmus, tmp_path):
    table = simulated(
        trueup, fmus, tmp_path,
        ('baseControl = "free"', 'baseControl = "attitude", baseActuator = "thrusters"'),
        ("connections = [", 'connections = [\n    "controller.thrusterForce -> robot.thrusterForce",'),
    )  # fmt: skip
    read = lambda name, k: table[f"{name}[{k}]"].to_numpy()  # noqa: E731
    turned = 2 * np.max([np.abs(read("robot.baseQuaternion", k)) for k in (2, 3, 4)])
    pulses = sum(read("controller.thrusterPulses", k)[-1] for k in range(1, 13))
    forces = np.array([read("controller.thrusterForce", k) for k in range(1, 13)])
    propellant = table["controller.propellant"].to_numpy()
    print(f"turned by {turned:.1e} rad, {pulses:.0f} pulses, {1e3 * propellant[-1]:.1f} g")
    assert set(np.unique(forces)) == {0.0, 10.0}
    assert turned < 1e-3 and pulses > 100
    # 10 N for 0.005 s a sample; the last row's sample is not over.
    impulse = forces[:, :-1].sum() * 0.005
    assert propellant[-1] == pytest.approx(impulse / (9.80665 * 220), abs=1e-4)
    assert np.all(np.diff(propellant) >= 0)


def test_the_example_goes_straight_where_the_arms_jacobian_misses(trueup, fmus, tmp_path):
    along = WAY / np.linalg.norm(WAY)
    figures = {}
    for base in ("free", "fixed"):
        tip, p, angular = straight(trueup, fmus, tmp_path, base)
        moved = tip - tip[0]
        across = np.linalg.norm(moved - np.outer(moved @ along, along), axis=1).max()
        figures[base] = across, np.linalg.norm(moved[-1] - WAY), np.abs(p).max(), np.abs(angular).max()
        print(base, "off the line {:.1e} m, off the end {:.1e} m, P {:.1e}, L {:.1e}".format(*figures[base]))
    assert max(figures["free"][:2]) < 1e-3 and max(figures["free"][2:]) < 1e-9
    assert figures["fixed"][0] > 0.01 and figures["fixed"][1] > 0.03


@pytest.mark.parametrize(
    "options, words",
    (
        (("--robot", "empty.toml"), "no such"),
        (("--preset", "table-9"), "table-9"),
        (("--effect", "backlash"), "does not act in SpaceController"),
        (("--set", "baseControl=7"), "baseControl"),
        (("--set", "baseActuator=3"), "baseActuator"),
        (("--set", "contactNormal[1,1]=0"), "which is no direction"),
        (("--set", "samplePeriod=0.1"), "samplePeriod 0.1 s is too long"),
    ),
)
def test_bad_input_is_refused(trueup, tmp_path, options, words):
    done = trueup("fmu", "pack", "SpaceController", "-o", tmp_path / "out", *options, cwd=tmp_path)
    assert done.returncode in (1, 2) and words.lower() in done.stderr.lower(), done.stderr
    assert not list(tmp_path.glob("out/*.fmu"))
