"""`CaptureScene` with a robot in space: through FMPy by both versions and both interfaces, against MuJoCo's bodies and distances, bad input."""

import csv
import time

import numpy as np
import pytest
from conftest import ROOT
from fmpy import simulate_fmu
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from test_gripper import refused

STOP = 8.0
SHAPES = ("ball", "plate", "bar", "cylinder", "ring")


@pytest.fixture(scope="module")
def packed(trueup, tmp_path_factory):
    """packed(shape, *effects) is the folder of the FMUs of both versions."""
    folder, ready = tmp_path_factory.mktemp("space"), {}

    def pack(shape, *effects):
        out = folder / "-".join((shape, *effects)).replace(":", "-")
        if out not in ready:
            options = [a for e in effects for a in ("--effect", e)]
            done = trueup("fmu", "pack", "CaptureScene", "--structure", "chaser=spatial", "--structure", f"against={shape}", *options, "-o", out)
            assert done.returncode == 0, done.stderr
            ready[out] = {int(file.name.split(".fmi")[1][0]): file for file in out.iterdir()}
        return ready[out]

    return pack


# A target that turns about all axes, and touches within the run.
TARGET = {
    "targetMass": 200.0, "targetInertia": [40.0, 1.0, 0.0, 1.0, 50.0, -2.0, 0.0, -2.0, 60.0], "targetCenterOfMass": [0.06, 0.01, 0.02],
    "initialTargetAngularVelocity": [0.02, -0.015, 0.01],
}  # fmt: skip


OPEN, CLOSED = np.array([0.25, 0.2, 0.0]), np.array([0.06, 0.085, 0.0])


def starts(shape, version):
    # Jaws that are closed already: open ones draw back faster than the plate follows.
    values = dict(TARGET, ballPositionOpen=[0, 0, 0, *CLOSED, *(CLOSED * [1, -1, 1])], initialPortOffset=[0.12, 0.0, 0.0]) if shape == "plate" else TARGET
    if shape in ("bar", "cylinder", "ring"):
        values = dict(values, portBallRadius=0.05)
    if version == 3:
        return values
    shapes = {"targetInertia": (3, 3), "ballPositionOpen": (3, 3)}
    return {
        name + (f"[{','.join(str(i + 1) for i in index)}]" if index else ""): float(value)
        for name, given in values.items()
        for index, value in np.ndenumerate(np.reshape(given, shapes.get(name, -1)) if np.ndim(given) else np.array(given))
    }


def run(fmus, shape, version, interface):
    names = ["targetPosition", "targetVelocity", "linearMomentum", "tipPosition", "contactForce"]
    dims = {"tipPosition": (1, 3)}
    wanted = names if version == 3 else [
        f"{n}[{','.join(str(k + 1) for k in index)}]" for n in names for index in np.ndindex(dims.get(n, (3,)))
    ]  # fmt: skip
    began = time.perf_counter()
    result = simulate_fmu(
        str(fmus[version]), fmi_type=interface, stop_time=STOP, output_interval=0.05, relative_tolerance=1e-8,
        start_values=starts(shape, version), output=["kineticEnergy", "elasticEnergy", "dissipatedEnergy", "jawWork", "outcome", *wanted],
    )  # fmt: skip
    seconds = time.perf_counter() - began
    columns = {n: np.asarray(result[n], float) for n in result.dtype.names}
    if version == 2:
        columns |= {n: np.column_stack([columns[w] for w in wanted if w.startswith(n + "[")]) for n in names}
    columns["tipPosition"] = columns["tipPosition"].reshape(len(columns["time"]), 3)
    return columns, STOP / seconds


@pytest.mark.parametrize("shape", [SHAPES[0]] + [pytest.param(s, marks=pytest.mark.full) for s in SHAPES[1:]])
def test_fmpy_runs_it_by_both_versions_and_interfaces(packed, shape):
    ends = {}
    for version in (3, 2):
        for interface in ("CoSimulation", "ModelExchange"):
            columns, factor = run(packed(shape), shape, version, interface)
            energy = columns["kineticEnergy"] + columns["elasticEnergy"] + columns["dissipatedEnergy"] - columns["jawWork"]
            momentum = columns["linearMomentum"]
            print(
                f"{shape}, FMI {version} {interface}: real-time factor {factor:.0f}, energy within {np.ptp(energy):.1e} J, "
                f"momentum within {np.ptp(momentum, axis=0).max():.1e} N.s, largest force {columns['contactForce'].max():.2f} N"
            )
            # CVode's steps do not keep a momentum of 8 N.s to the last digit.
            assert np.ptp(momentum, axis=0).max() < 1e-6 and np.ptp(energy) < 1e-5
            assert columns["contactForce"].max() > 0.05, "something has to happen"
            ends[version, interface] = np.concatenate([columns[n][-1] for n in ("targetPosition", "targetVelocity", "tipPosition")])
    first = ends[3, "CoSimulation"]
    off = max(np.abs(end - first).max() for end in ends.values())
    print(f"{shape}: ends within {off:.1e} of each other")
    assert off < 1e-5


def recorded(trueup, packed, folder, shape, stop=STOP, step=0.002, **more):
    """Every row of a run by Model Exchange at a tight tolerance."""
    start = "".join(f'"{name}" = {value}\n' for name, value in (starts(shape, 2) | more).items())
    text = (
        f'[run]\nstop = {stop}\nstep = {step}\ntolerance = 1e-12\nevent-rows = true\n[components.scene]\nfmu = "{packed(shape)[3]}"\n'
        f'interface = "model-exchange"\n[components.scene.start]\n{start}'
    )
    (folder / "s.toml").write_text(text)
    done = trueup("simulate", "s.toml", "-o", "r.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    with open(folder / "r.csv") as lines:
        rows = list(csv.reader(lines))
    table = {n: np.array(c, float) for n, *c in zip(*rows) if n == "time" or c[0] not in ("true", "false")}
    return {n.removeprefix("scene."): c for n, c in table.items()}


def vector(table, name, n=3):
    return np.column_stack([table[f"{name}[{i + 1}]"] for i in range(n)])


def rotations(q):
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]  # fmt: skip
    return np.moveaxis(np.array(rows), 2, 0)


def test_mujoco_moves_the_target_as_we_do(trueup, packed, tmp_path):
    """Its free body under our wrench at the port, by its accelerations."""
    mujoco = pytest.importorskip("mujoco")
    # Weakly damped, and until contacts are shorter than a few rows: between events forces are polynomials to far below the tolerance.
    stop = 4.0
    table = recorded(trueup, packed, tmp_path, "ball", stop, step=0.001, normalDamping=90.0)
    inertia = np.reshape(TARGET["targetInertia"], (3, 3))
    full = " ".join(repr(float(inertia[i, j])) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/><inertial pos="0 0 0" mass="200" fullinertia="{full}"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    t, center = table["time"], np.array(TARGET["targetCenterOfMass"])
    pose = np.hstack([vector(table, "targetPosition"), vector(table, "targetQuaternion", 4)])
    twist = np.hstack([vector(table, "targetVelocity"), vector(table, "targetAngularVelocity")])
    wrench = np.hstack([vector(table, "portForce"), vector(table, "portTorque")])
    state, off = np.concatenate([pose[0], twist[0]]), 0.0
    cuts = [0, *(np.flatnonzero(np.diff(t) == 0.0) + 1), len(t)]
    for a, b in zip(cuts, cuts[1:]):
        if t[b - 1] == t[a]:
            continue
        acting = make_interp_spline(t[a:b], wrench[a:b], k=min(5, b - a - 1))

        def rates(at, y):
            w, x, yy, z = y[3:7]
            p, q, r = y[10:13]
            turn = rotations(y[None, 3:7] / np.linalg.norm(y[3:7]))[0]
            force, torque = np.split(acting(at), 2)
            data.qpos[:], data.qvel[:] = y[:7], y[7:]
            data.xfrc_applied[1] = (*force, *(torque + np.cross(turn @ -center, force)))
            mujoco.mj_forward(model, data)
            spin = 0.5 * np.array([-x * p - yy * q - z * r, w * p + yy * r - z * q, w * q + z * p - x * r, w * r + x * q - yy * p])
            return np.concatenate([y[7:10], spin, data.qacc])

        done = solve_ivp(rates, (t[a], t[b - 1]), state, "DOP853", t_eval=t[a:b], rtol=1e-11, atol=1e-13)
        assert done.success
        state = done.y[:, -1]
        off = max(off, np.abs(done.y[:7].T - pose[a:b]).max(), np.abs(done.y[7:].T - twist[a:b]).max())
    changed = np.abs(twist - twist[0]).max()
    print(f"MuJoCo: target off by {off:.1e} over {stop} s with {len(cuts) - 2} events; contacts changed its rates by {changed:.1e}")
    assert off < 1e-10 and changed > 1e-4


@pytest.mark.parametrize("shape", [SHAPES[0]] + [pytest.param(s, marks=pytest.mark.full) for s in ("plate", "bar", "cylinder")])
def test_distances_are_mujocos(trueup, packed, tmp_path, shape):
    """MuJoCo has no torus; of the others its distance between two solids is our depth with the other sign."""
    mujoco = pytest.importorskip("mujoco")
    table = recorded(trueup, packed, tmp_path, shape, 4.0)
    geom = {
        "ball": 'type="sphere" size="0.05"', "plate": 'type="plane" size="0 0 1" zaxis="-1 0 0"', "bar": 'type="capsule" size="0.05 0.09"',
        "cylinder": 'type="cylinder" size="0.05 0.09"',
    }[shape]  # fmt: skip
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody><body mocap="true"><geom name="port" {geom}/></body><body mocap="true"><geom name="hand" type="sphere" size="0.05"/></body></worldbody></mujoco>'
    )
    data, segment = mujoco.MjData(model), np.zeros(6)
    center, first = np.array(TARGET["targetCenterOfMass"]), CLOSED if shape == "plate" else OPEN
    turn, hand = rotations(vector(table, "targetQuaternion", 4)), rotations(np.column_stack([table[f"tipQuaternion[1,{i}]"] for i in (1, 2, 3, 4)]))
    tip = np.column_stack([table[f"tipPosition[1,{i}]"] for i in (1, 2, 3)])
    worst, rows = 0.0, range(0, len(table["time"]), 97)
    for k in rows:
        for ball, side in ((1, 0), (2, 1), (3, -1)):
            local = (first + table["jawPosition"][k] * (CLOSED - first)) * [1, side, 1] if side else np.zeros(3)
            data.mocap_pos[0] = vector(table, "targetPosition")[k] - turn[k] @ center
            data.mocap_quat[0] = vector(table, "targetQuaternion", 4)[k]
            data.mocap_pos[1] = tip[k] + hand[k] @ local
            mujoco.mj_kinematics(model, data)
            distance = mujoco.mj_geomDistance(model, data, 1, 0, 10.0, segment)
            worst = max(worst, abs(distance + table[f"penetration[{ball}]"][k]))
    print(f"{shape}: depths within {worst:.1e} m of MuJoCo's at {3 * len(rows)} places")
    # Cylinders go through its iteration, whose tolerance is 1e-6.
    assert worst < (1e-12 if shape != "cylinder" else 1e-5)


def test_effects_act_in_it(packed):
    """A drive that saturates: a command above its limit moves the arm as the limit does."""
    fmu = packed("ball", "current-saturation")[3]
    ends = []
    # EF-10 at twice the limit: T / (1 + 2^p)^(1/p).
    for torque, most in ((0.1 / (1 + 2.0**8) ** (1 / 8), 1e6), (0.1, 0.05), (0.1, 1e6)):
        command = np.array([(0.0, np.full(6, torque)), (STOP, np.full(6, torque))], dtype=[("time", float), ("jointTorque", float, 6)])
        limit = {"saturationTorque": np.full(6, most)}
        result = simulate_fmu(str(fmu), stop_time=1.0, input=command, start_values=limit, output=["jointAngle"])
        ends.append(np.asarray(result["jointAngle"][-1], float))
    print(f"saturated: {np.abs(ends[1] - ends[0]).max():.1e} rad from the limit's, {np.abs(ends[2] - ends[0]).max():.1e} without")
    assert np.abs(ends[1] - ends[0]).max() < 1e-9 < 1e-3 < np.abs(ends[2] - ends[0]).max()


def test_effects_that_do_not_act_are_refused(trueup, tmp_path):
    for structure, effect, message in (
        ("spatial", "backlash", "joint-flexibility"), ("spatial", "table-tilt", "there is no table"), ("body", "backlash", "chaser=planar"),
    ):  # fmt: skip
        done = trueup("fmu", "pack", "CaptureScene", "--structure", f"chaser={structure}", "--effect", effect, "-o", tmp_path)
        assert done.returncode != 0 and message in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert not list(tmp_path.iterdir())


def test_the_chaser_in_space_is_a_robot_of_a_file(trueup, tmp_path):
    """Of a file with two arms: it begins with its hand before the port, and comes nearer along the hand's x; without chaser=spatial it is refused."""
    robot = ("--robot", ROOT / "examples/10-attitude/two-arms.toml")
    done = trueup("fmu", "pack", "CaptureScene", "--structure", "chaser=spatial", *robot, "--fmi", "3", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    (fmu,) = tmp_path.iterdir()
    near = {"initialPortOffset": [0.106, 0.0, 0.0]}
    result = simulate_fmu(str(fmu), stop_time=3.0, start_values=near, output=["tipPosition", "baseVelocity", "tipQuaternion", "portOffset", "linearMomentum", "contactForce", "jointAngle"])
    tip, velocity, w = (np.asarray(result[n][0], float) for n in ("tipPosition", "baseVelocity", "tipQuaternion"))
    along = rotations(w.reshape(-1, 4)[:1])[0][:, 0]
    momentum = np.array([np.asarray(m, float) for m in result["linearMomentum"]])
    force = max(np.asarray(f, float).max() for f in result["contactForce"])
    print(f"{tip.shape[0]} tips, {len(result['jointAngle'][0])} joints; comes nearer by {np.linalg.norm(velocity):.4f} m/s, up to {force:.1f} N, momentum within {np.ptp(momentum, axis=0).max():.1e} N.s")
    assert tip.shape == (1, 3) and len(result["jointAngle"][0]) == 12 and np.allclose(velocity, np.linalg.norm(velocity) * along, atol=1e-12) and np.linalg.norm(velocity) > 1e-3
    assert force > 0.01 and np.ptp(momentum, axis=0).max() < 1e-5
    done = trueup("fmu", "pack", "CaptureScene", *robot, "-o", tmp_path / "none")
    assert done.returncode != 0 and "chaser=spatial" in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr


@pytest.mark.full
def test_effects_of_an_arm_act_with_the_planar_chaser(trueup, tmp_path):
    """Inside the arm: they change its motion, and no momentum; a thrust of the base does."""

    def ends(folder, *effects):
        options = [a for e in effects for a in ("--effect", e)]
        done = trueup("fmu", "pack", "CaptureScene", "--structure", "chaser=planar", *options, "--flexible", "true,true,true", "-o", tmp_path / folder)
        assert done.returncode == 0, done.stderr
        (third,) = (tmp_path / folder).glob("*.fmi3.fmu")
        assert third.name == "+".join(("CaptureScene", *effects)).replace(":", "-") + ".fmi3.fmu" or not effects, third.name
        found = []
        for interface in ("CoSimulation", "ModelExchange"):
            result = simulate_fmu(str(third), fmi_type=interface, stop_time=1.5, output=["jointAngle", "linearMomentum"], relative_tolerance=1e-8)
            momentum = np.array([np.asarray(m, float) for m in result["linearMomentum"]])
            found.append((np.asarray(result["jointAngle"][-1], float), np.ptp(momentum, axis=0).max()))
        return found

    plain, inner, pushed = ends("plain"), ends("inner", "motor-friction", "backlash"), ends("pushed", "base-thrust")
    for (angle, drift), (other, inside), (_, outside) in zip(plain, inner, pushed):
        print(f"momentum changes by {drift:.1e} without, {inside:.1e} with effects inside, {outside:.1e} N.s by a thrust; joints by {np.abs(angle - other).max():.1e} rad")
        assert max(drift, inside) < 1e-7 < 1e-5 < outside and np.abs(angle - other).max() > 1e-7


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("targetMass", -1.0, "targetMass"), ("portAxis", [0.0, 0.0, 0.0], "no direction"), ("initialPortQuaternion", [2.0, 0, 0, 0], "length 1"),
        ("targetInertia", [-1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0], "targetInertia"), ("portRingRadius", 0.005, "no ring"),
        ("initialPortOffset", [0.0, 0.6, 0.0], "deep"),
    ],  # fmt: skip
)
def test_bad_input_is_one_clear_error(trueup, packed, tmp_path, name, value, message):
    with pytest.raises(Exception):  # noqa: B017
        simulate_fmu(str(packed("ring")[3]), stop_time=1.0, start_values={name: value})
    refused(trueup, packed("ring")[3], tmp_path, {name: value}, message)


@pytest.mark.parametrize("choices, message", [(("endBallMount=carriages",), "in the plane"), (("closing=motor",), "no motor"), (("against=star",), "against")])
def test_structures_that_cannot_be_had_are_refused(trueup, tmp_path, choices, message):
    options = [a for c in ("chaser=spatial", *choices) for a in ("--structure", c)]
    done = trueup("fmu", "pack", "CaptureScene", *options, "-o", tmp_path)
    assert done.returncode != 0 and message in done.stderr and not list(tmp_path.iterdir()), done.stderr


def test_it_is_drawn(trueup, packed, tmp_path):
    (tmp_path / "s.toml").write_text(f'[run]\nstop = 0.2\nstep = 0.1\n[components.scene]\nfmu = "{packed("ring")[3]}"\n')
    done = trueup("simulate", "s.toml", "-o", "r.csv", "--plot", "r.html", cwd=tmp_path)
    page = (tmp_path / "r.html").read_text()
    assert done.returncode == 0 and all(part in page for part in ("scene.ball P3", "scene.target", "scene.link 6")), done.stderr
