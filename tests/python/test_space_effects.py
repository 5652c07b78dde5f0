"""Effects in `SpatialFreeFlyer` through FMPy: what friction and forces do to energy and momentum, and what is refused."""

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu

STOP = 4.0
EFFECTS = ("motor-friction", "load-friction", "external-force:tip", "sensor-drift:baseAngularVelocity")


@pytest.fixture(scope="module")
def packed(trueup, tmp_path_factory):
    folder = tmp_path_factory.mktemp("effects")
    done = trueup("fmu", "pack", "SpatialFreeFlyer", *(a for e in EFFECTS for a in ("--effect", e)), "-o", folder)
    assert done.returncode == 0, done.stderr
    return {int(file.name.split(".fmi")[1][0]): file for file in folder.iterdir()}


def starts(version, values):
    if version == 3:
        return values
    return {name + (f"[{i + 1}]" if np.ndim(given) else ""): float(v) for name, given in values.items() for i, v in enumerate(np.atleast_1d(given))}


@pytest.mark.parametrize(
    "version, interface",
    [(3, "ModelExchange"), pytest.param(3, "CoSimulation", marks=pytest.mark.full), pytest.param(2, "ModelExchange", marks=pytest.mark.full), pytest.param(2, "CoSimulation", marks=pytest.mark.full)],
)
def test_friction_takes_its_work_and_a_force_its_impulse(packed, version, interface):
    values = {
        "initialJointAngle": [0.3, -0.9, 1.4, 0.2, -0.6, 0.5], "coulombFriction": np.full(6, 2.0), "staticFriction": np.full(6, 3.0), "viscousFriction": np.full(6, 1.0),
        "loadFriction": np.zeros(6), "loadViscousFriction": np.full(6, 0.5), "initialJointVelocity": [0.2, -0.15, 0.25, -0.3, 0.15, 0.35],
        "tipPushForceX": 6.0, "tipPushForceY": 0.0, "tipPushForceZ": -4.0, "tipPushStart": 1.0, "tipPushDuration": 0.5, "baseAngularVelocityDriftRate": np.full(3, 0.01),
    }  # fmt: skip
    vectors = {"linearMomentum": 3, "frictionTorque": 6, "motorVelocity": 6, "jointVelocity": 6, "sticking": 6}
    names = list(vectors) if version == 3 else [f"{n}[{k + 1}]" for n, count in vectors.items() for k in range(count)]
    result = simulate_fmu(
        str(packed[version]), fmi_type=interface, stop_time=STOP, output_interval=0.002, relative_tolerance=1e-9, start_values=starts(version, values),
        output=["kineticEnergy", "potentialEnergy", *names],
    )  # fmt: skip
    table = {n: np.array([np.asarray(v, float) for v in result[n]]) for n in result.dtype.names}
    if version == 2:
        table |= {n: np.column_stack([table[f"{n}[{k + 1}]"] for k in range(count)]) for n, count in vectors.items()}
    t, before = table["time"], table["time"] <= 1.0
    lost = (table["frictionTorque"] * table["motorVelocity"]).sum(axis=1) + 0.5 * (table["jointVelocity"] ** 2).sum(axis=1)
    work = np.concatenate([[0.0], np.cumsum(np.diff(t) * (lost[1:] + lost[:-1]) / 2)])
    energy = table["kineticEnergy"] + table["potentialEnergy"] + work
    off = np.ptp(energy[before])
    impulse = table["linearMomentum"][-1] - table["linearMomentum"][0]
    print(
        f"FMI {version} {interface}: friction took {work[before][-1]:.3f} J, energy within {off:.1e} J of it; impulse within {np.abs(impulse - [3.0, 0.0, -2.0]).max():.1e} N.s; "
        f"{int(table['sticking'].any(axis=0).sum())} joints stuck"
    )
    # By trapezoids, which jump where a joint comes to rest.
    assert work[before][-1] > 0.3 and off < 2e-3 and np.abs(impulse - [3.0, 0.0, -2.0]).max() < 1e-6
    assert np.ptp(table["linearMomentum"][before], axis=0).max() < 1e-7 and table["sticking"].any()


@pytest.mark.parametrize(
    "effects, message",
    [
        (["flexible-link"], "[body.link]"), (["gravity-torque"], "`gravity` of a base that is held"), (["backlash"], "add joint-flexibility"),
        (["sensor-drift:baseRate"], "sensor-drift:baseAngularVelocity"),
    ],  # fmt: skip
)
def test_what_cannot_act_is_refused_in_one_line_with_the_reason(trueup, tmp_path, effects, message):
    done = trueup("fmu", "pack", "SpatialFreeFlyer", *(a for e in effects for a in ("--effect", e)), "-o", tmp_path)
    assert done.returncode != 0 and message in done.stderr and effects[0] in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert not list(tmp_path.iterdir())


URDF = """<robot name="arm"><link name="hub"><inertial><mass value="50"/><inertia ixx="4" iyy="4" izz="4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="boom"><inertial><origin xyz="0.5 0 0"/><mass value="3"/><inertia ixx="0.1" iyy="0.3" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="hub"/><child link="boom"/><axis xyz="0 0 1"/><dynamics damping="0.3" friction="0.2"/></joint></robot>"""


def test_friction_of_a_robots_file_is_that_of_its_effect(trueup, tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    pack = ("fmu", "pack", "SpatialFreeFlyer", "--robot", "arm.urdf", "--fmi", "3", "-o", "out")
    done = trueup(*pack, "--effect", "motor-friction", cwd=tmp_path)
    assert done.returncode == 0 and "friction" not in done.stderr, done.stderr
    (fmu,) = (tmp_path / "out").iterdir()
    start = {v.name: v.start for v in read_model_description(str(fmu)).modelVariables}
    assert [float(start[n]) for n in ("coulombFriction", "staticFriction", "viscousFriction")] == [0.2, 0.2, 0.3]
    done = trueup(*pack, cwd=tmp_path)
    assert done.returncode == 0 and "shoulder" in done.stderr or "boom" in done.stderr, "what is left out is reported"
