"""FlexibleArm through FMPy: energy, both kinds of interface, what may be chosen."""

import re

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

# n K_t of each motor, N.m/A.
DRIVE = 0.02 * np.array([44340, 21750, 25000, 25000, 25000, 25000])


def packed(trueup, folder, *more):
    done = trueup("fmu", "pack", "FlexibleArm", "--fmi", 3, "-o", folder, *more)
    assert done.returncode == 0, done.stderr
    return folder / "FlexibleArm.fmi3.fmu"


@pytest.mark.full  # by the native steps: lnk3_a_falling_arm_keeps_its_energy
def test_an_arm_in_a_fall_keeps_its_energy(trueup, tmp_path):
    """Model Exchange by CVode: no friction, no dampers, motors that weigh little; outputs are closer than 500 of its steps."""
    path = packed(
        trueup, tmp_path, "--set", "coulombFriction=0,0,0,0,0,0", "--set", "staticFriction=0,0,0,0,0,0",
        "--set", "viscousFriction=0,0,0,0,0,0", "--set", "jointDamping=0,0,0,0,0,0", "--set", "linkDampingRatio=0,0",
        "--set", "motorInertia=0.05,0.05,0.05,0.05,0.05,0.05",
        "--set", "initialJointAngle=0,1.4,-1.4,0.4,0,0", "--set", "initialJointVelocity=1,0,0,0,0,0",
    )
    result = simulate_fmu(
        path, fmi_type="ModelExchange", stop_time=0.1, relative_tolerance=1e-9, output_interval=1e-4,
        output=["kineticEnergy", "potentialEnergy", "tipDeflection"],
    )
    energy = result["kineticEnergy"] + result["potentialEnergy"]
    off, motion = np.max(np.abs(energy - energy[0])), np.max(result["kineticEnergy"])
    print(f"{motion:.1f} J of motion, energy off by {off:.1e} J")
    assert motion > 2 and off < 1e-5 * motion


@pytest.mark.parametrize("version", (pytest.param(2, marks=pytest.mark.full), 3))
def test_both_kinds_agree_and_the_description_is_valid(fmu, version):
    """Currents that carry the weight, the shoulder driven away: Co-Simulation against Model Exchange by CVode."""
    path = fmu("FlexibleArm", version)
    assert not validate_fmu(str(path))
    current = np.array([0.03, 30.9 / DRIVE[1], 25.8 / DRIVE[2], 0, 5.4 / DRIVE[4], 0])
    names = ["motorCurrent"] if version == 3 else [f"motorCurrent[{i + 1}]" for i in range(6)]
    signal = np.zeros(2, dtype=[("time", float), *((n, float, (6,)) if version == 3 else (n, float) for n in names)])
    signal["time"] = [0, 1]
    for i, name in enumerate(names):
        signal[name] = current if version == 3 else current[i]
    output = ["jointAngle", "motorAngle", "tipPosition"] if version == 3 else ["jointAngle[2]", "motorAngle[1]", "tipPosition[1,3]"]
    runs = [
        simulate_fmu(
            path, fmi_type=kind, stop_time=0.1, output_interval=1e-3, input=signal, output=output, relative_tolerance=tolerance,
        )
        for kind, tolerance in (("ModelExchange", 1e-9), ("CoSimulation", 1e-8))
    ]
    off = max(np.max(np.abs(runs[0][n] - runs[1][n])) for n in output)
    moved = np.max(np.abs(runs[0][output[0]] - runs[0][output[0]][0]))
    print(f"FMI {version}: kinds apart by {off:.1e} rad or m, joints moved by {moved:.1e} rad")
    assert off < 1e-6 and moved > 1e-4


@pytest.mark.full
def test_steps_of_fixed_size_stay_close(fmu, trueup, tmp_path):
    """LNK-10: steps of 1 ms, whatever tolerance is requested, against those that the tolerance requires; the shoulder breaks away."""
    drive = np.array([(0.0, [0.03, 30.9 / DRIVE[1], 25.8 / DRIVE[2], 0, 0, 0])], dtype=[("time", float), ("motorCurrent", float, (6,))])
    fixed = packed(trueup, tmp_path, "--structure", "solver=fixed")
    tips = [
        simulate_fmu(
            path, fmi_type="CoSimulation", stop_time=0.1, output_interval=1e-3, input=drive, output=["tipPosition", "sticking"],
            relative_tolerance=1e-8,
        )
        for path in (fmu("FlexibleArm", 3), fixed)
    ]
    off = np.max(np.abs(tips[0]["tipPosition"] - tips[1]["tipPosition"]))
    moved = np.max(np.abs(tips[0]["tipPosition"] - tips[0]["tipPosition"][0]))
    print(f"tip off by {off:.1e} m of {moved:.1e} m")
    assert moved > 1e-3 and 0 < off < 3e-5
    assert np.array_equal(tips[0]["sticking"], tips[1]["sticking"]) and not tips[0]["sticking"][-1].all()


BODY = """
[[body]]
mass = {mass}
center-of-mass = [0.0, 0.0, 0.0]
inertia = [[2e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 2e-3]]
position = {position}
axis = [0.0, -1.0, 0.0]
motor = {{ flexible = true, inertia = 0.05, gear-ratio = 100, stiffness = 2000.0 }}
"""


def robot(link):
    """A link of 0.6 m between two joints, 2 kg on the second one."""
    base = "[base]\nmass = 10.0\ninertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n"
    turned = "[body.link]\norientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]\n"
    bodies = [BODY.format(mass=mass, position=position) for mass, position in ((0.6, [0.0, 0.0, 0.0]), (2.0, [0.6, 0.0, 0.0]))]
    return base + bodies[0] + turned + link + bodies[1] + "[[tip]]\noffset = [0.2, 0.0, 0.0]\n"


def reduced(length, mass_per_length, bending, twist, polar):
    """Of a beam of one finite element its end's coordinates: along x, about y; along y, about x; about z."""
    mass = mass_per_length * length
    bent = mass / 420 * np.array([[156, -22 * length], [-22 * length, 4 * length**2]])
    stiff = bending / length**3 * np.array([[12, -6 * length], [-6 * length, 4 * length**2]])
    other = np.diag([1.0, -1.0])
    momentum, about = mass * np.array([0.5, -length / 12]), mass * length * np.array([0.35, -length / 20])
    matrices = {name: np.zeros((5, 5)) for name in ("mass-matrix", "stiffness-matrix")}
    for matrix, plane, end in zip(matrices.values(), (bent, stiff), (polar * length / 3, twist / length)):
        matrix[:2, :2], matrix[2:4, 2:4], matrix[4, 4] = plane, other @ plane @ other, end
    participation, shift, turn = np.zeros((5, 6)), np.zeros((5, 3)), np.zeros((5, 3))
    participation[:2, 0], participation[:2, 4] = momentum, about
    participation[2:4, 1], participation[2:4, 3] = other @ momentum, -other @ about
    participation[4, 5] = polar * length / 2
    shift[0, 0] = shift[2, 1] = turn[1, 1] = turn[3, 0] = turn[4, 2] = 1
    across = mass * length**2 / 12
    rows = {**matrices, "participation": participation, "end-shift": shift, "end-turn": turn}
    return "\n".join([
        f"mass = {mass}", f"center-of-mass = [0.0, 0.0, {length / 2}]", f"end = [0.0, 0.0, {length}]",
        f"inertia = {np.diag([across, across, polar * length]).tolist()}",
        "[body.link.reduced]", *(f"{name} = {rows.tolist()}" for name, rows in rows.items()),
    ])


@pytest.mark.full
def test_a_link_by_a_table_keeps_its_energy_and_is_the_beam(trueup, tmp_path):
    """A fall by CVode: a reduced set of the beam that two shapes make is that beam, but for terms of second order in its bending."""
    modulus, moment, polar = 70e9, 4e-9, 2e-4
    beam = f"length = 0.6\nmass-per-length = 0.8\nyoungs-modulus = {modulus}\narea-moment = [{moment}, {moment}]\n"
    beam += f"poisson-ratio = 0.25\ntorsion-constant = {2 * moment}\npolar-inertia-per-length = {polar}\n"
    table = reduced(0.6, 0.8, modulus * moment, modulus / 2.5 * 2 * moment, polar)
    results = []
    for name, link in (("beam", beam), ("table", table)):
        (tmp_path / f"{name}.toml").write_text(robot(link))
        (tmp_path / name).mkdir()
        # The table does not give the shortening of the link by bending, so the beam must do without that, too.
        robots = "--robot", tmp_path / f"{name}.toml", "--structure", "axialStiffening=off"
        path = packed(trueup, tmp_path / name, *robots, "--set", "gravity=0,0,-9.81")
        assert not validate_fmu(str(path))
        results.append(simulate_fmu(
            path, fmi_type="ModelExchange", stop_time=0.1, relative_tolerance=1e-9, output_interval=1e-3,
            start_values={"initialJointVelocity": [-1.0, 0.0]},
            output=["kineticEnergy", "potentialEnergy", "tipPosition", "tipDeflection"],
        ))
    beam, table = results
    energy = table["kineticEnergy"] + table["potentialEnergy"]
    off, motion = np.max(np.abs(energy - energy[0])), np.max(table["kineticEnergy"])
    apart, bent = (np.max(np.abs(v)) for v in (table["tipPosition"] - beam["tipPosition"], beam["tipDeflection"]))
    print(f"{motion:.1f} J of motion, energy off by {off:.1e} J; bent by {bent:.1e} m, table and beam apart by {apart:.1e} m")
    assert motion > 1 and off < 1e-5 * motion
    assert bent > 5e-4 and apart < 0.01 * bent


def test_what_is_packed_is_told(trueup, tmp_path):
    path = packed(trueup, tmp_path, "--structure", "drive=torque", "--structure", "links=rigid", "--structure", "axialStiffening=on")
    names = {v.name for v in read_model_description(path).modelVariables}
    assert {"jointTorque", "sticking", "tipDeflection", "transmissionTorque", "gravity"} <= names
    assert not names & {"motorCurrent", "torqueConstant", "youngsModulus", "linkModalCoordinate"}
    wrong = trueup("fmu", "pack", "FlexibleArm", "--structure", "linkShapes=9", "-o", tmp_path)
    assert wrong.returncode == 2 and "1 to 5" in wrong.stderr
    wrong = trueup("fmu", "pack", "FlexibleArm", "--set", "youngsModulus=0,1", "-o", tmp_path)
    assert wrong.returncode != 0 and "youngsModulus[1]" in wrong.stderr


def test_a_sampled_controller_needs_no_lines(fmu, trueup, tmp_path):
    """Six controllers at 1 kHz: the master's own choice steps the arm as often as `jacobi` does, and comes to the same."""
    links, parts = [], [f"[components.arm]\nfmu = '{fmu('FlexibleArm', 3)}'"]
    for i, drive in enumerate(DRIVE, 1):
        links.append(f'"c{i}.motorCurrent -> arm.motorCurrent[{i}]"')
        for output, to in (("motorAngle", "motorAngle"), ("motorVelocity", "motorVelocity"), ("jointAngle", "loadAngle"), ("jointVelocity", "loadVelocity")):
            links.append(f'"arm.{output}[{i}] -> c{i}.{to}"')
        # The arm's motors are on the joint's side, so that the controller's gear is 1.
        start = f"samplePeriod = 0.001, gearRatio = 1.0, torqueConstant = {drive}, positionReference = 0.05"
        parts.append(f"[components.c{i}]\nfmu = '{fmu('JointController', 3)}'\nstart = {{ {start} }}")
    angles = {}
    for algorithm in ("", 'algorithm = "jacobi"'):
        text = f"connections = [{', '.join(links)}]\n[run]\nstop = 0.02\nstep = 0.001\n{algorithm}\n" + "\n".join(parts)
        (tmp_path / "loop.toml").write_text(text)
        done = trueup("simulate", tmp_path / "loop.toml", "-o", tmp_path / "loop.csv", "--log", tmp_path / "loop.log")
        assert done.returncode == 0, done.stderr
        # In the summary and in the log, apart from events of the arm's own.
        for told in (done.stderr, (tmp_path / "loop.log").read_text()):
            counts = re.search(r"^`arm`.*: (.*)$", told, re.M)[1]
            assert re.match("(19|20) calls of 0.001 s", counts) and "0.0005 s" not in counts, told
        head, *rows = (tmp_path / "loop.csv").read_text().splitlines()
        column = head.split(",").index("arm.jointAngle[2]")
        angles[algorithm] = np.array([float(row.split(",")[column]) for row in rows])
    own, held = angles.values()
    moved = np.max(np.abs(held - held[0]))
    print(f"the choice and jacobi apart by {np.max(np.abs(own - held)):.1e} rad of {moved:.1e} rad")
    assert moved > 1e-4 and np.max(np.abs(own - held)) < 1e-6 * moved
