"""A capture coupled out of three FMUs (examples/05-coupled-capture/capture-coupled.toml) against the same capture in one; benchmark_contact.py has the whole table."""

import csv
import tomllib

import numpy as np
import pytest
from conftest import ROOT
from fmpy import simulate_fmu

MASS, SPEED = 1778.7, 0.005  # of the chaser
STOP = 30.0


@pytest.fixture(scope="module")
def simulated(trueup, fmus, tmp_path_factory):
    """simulated(text) is the last row of a run of a system; simulated(text, True) are all rows."""
    folder = tmp_path_factory.mktemp("contact")

    def run(text, whole=False):
        (folder / "system.toml").write_text(text)
        done = trueup("simulate", "system.toml", "-o", "r.csv", cwd=folder)
        assert done.returncode == 0, done.stderr
        with open(folder / "r.csv") as file:
            rows = list(csv.reader(file))
        rows = [{name: float(v) for name, v in zip(rows[0], row) if v not in ("true", "false")} for row in (rows[1:] if whole else rows[-1:])]
        return rows if whole else rows[0]

    return run


@pytest.fixture(scope="module")
def in_one(simulated, fmus):
    scene = fmus / "CaptureScene.fmi3.fmu"
    return simulated(
        f'[run]\nstop = {STOP}\nstep = 0.1\ntolerance = 1e-12\n[components.scene]\nfmu = "{scene}"\ninterface = "model-exchange"\n'
    )


def coupled(fmus, algorithm, more=""):
    text = (ROOT / "examples/05-coupled-capture/capture-coupled.toml").read_text()
    assert '"extrapolate"' in text
    return text.replace('"extrapolate"', f'"{algorithm}"{more}').replace("../../out", str(fmus))


def test_three_fmus_come_to_what_one_comes_to(simulated, fmus, in_one):
    off, made = {}, {}
    wanted = [in_one[f"scene.targetVelocity[{i}]"] - in_one[f"scene.chaserVelocity[{i}]"] for i in (1, 2)]
    for algorithm in ("jacobi", "extrapolate", "adaptive"):
        row = simulated(coupled(fmus, algorithm))
        have = [row[f"target.velocity[{i}]"] - row[f"chaser.velocity[{i}]"] for i in (1, 2)]
        off[algorithm] = np.hypot(*np.subtract(have, wanted))
        stored = row["chaser.kineticEnergy"] + row["target.kineticEnergy"] + row["contact.elasticEnergy"]
        made[algorithm] = stored + row["contact.dissipatedEnergy"] - row["contact.jawWork"] - 0.5 * MASS * SPEED**2
        # What acts is as large as what acts back. (Levers move during a step: of the moment of momentum that does not hold.)
        momentum = [row[f"chaser.linearMomentum[{i}]"] + row[f"target.linearMomentum[{i}]"] for i in (1, 2)]
        assert np.allclose(momentum, [MASS * SPEED, 0.0], rtol=0, atol=1e-10 * MASS * SPEED)
        assert row["contact.outcome"] == in_one["scene.outcome"]
    print("final relative velocity off by", off, "m/s; energy that the coupling made:", made, "J")
    assert np.hypot(*wanted) > 0.02
    assert 100 * off["extrapolate"] < off["jacobi"] < 1e-4
    assert off["adaptive"] < 2e-6  # at its tolerance of 1e-4, in steps of up to 0.3 s
    # Forces that come a step late push what they should slow down.
    assert made["jacobi"] > 20 * abs(made["extrapolate"])


@pytest.mark.full
def test_an_arm_with_a_hand_in_three_fmus_is_the_one(trueup, fmus, simulated, tmp_path):
    """`chaser = planar`, its arm bent, against examples/05-coupled-capture/capture-arm.toml, which has the defaults of the scene."""
    done = trueup("fmu", "pack", "CaptureScene", "--structure", "chaser=planar", "--fmi", "3", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    example = (ROOT / "examples/05-coupled-capture/capture-arm.toml").read_text().replace("../../out", str(fmus))
    start = {name: component["start"] for name, component in tomllib.loads(example)["components"].items()}
    bent = "".join(f'"{name}" = {value}\n' for name, value in start["arm"].items() if "Angle" in name)
    assert bent.count("\n") == 3
    one = simulated(
        f'[run]\nstop = 10\nstep = 0.1\ntolerance = 1e-12\n[components.scene]\nfmu = "{tmp_path}/out/CaptureScene.fmi3.fmu"\n'
        f'interface = "model-exchange"\n[components.scene.start]\n{bent}',
        True,
    )
    for i in (1, 2):
        assert start["target"][f"initialPosition[{i}]"] == pytest.approx(one[0][f"scene.targetPosition[{i}]"], rel=0, abs=1e-15)

    def three(step):
        assert "step = 0.001" in example
        row = simulated(example.replace("step = 0.001", f"step = {step}"))
        assert row["contact.outcome"] == one[-1]["scene.outcome"]
        have = [row[f"target.velocity[{i}]"] for i in (1, 2)] + [row[f"arm.jointVelocity[{j}]"] for j in (1, 2, 3)]
        want = [one[-1][f"scene.targetVelocity[{i}]"] for i in (1, 2)] + [one[-1][f"scene.jointVelocity[{j}]"] for j in (1, 2, 3)]
        assert max(abs(v) for v in want[:2]) > 1e-3 and max(abs(v) for v in want[2:]) > 1e-2, "something has to happen"
        off = np.abs(np.subtract(have, want))
        return np.hypot(*off[:2]), off[2:].max()

    off = [three(step) for step in (0.002, 0.0005)]
    print(f"three FMUs with an arm at 2 and 0.5 ms: target off by {off[0][0]:.1e}, {off[1][0]:.1e} m/s, joints by {off[0][1]:.1e}, {off[1][1]:.1e} rad/s")
    assert off[1][0] < 1e-7 and off[1][0] < off[0][0] / 8
    assert max(joints for _, joints in off) < 1e-4  # the last link is light: when it touches depends on the step


def first_touch(rows, component):
    """Rows before and after the first contact of a ball, and the next one."""
    now = [[row[f"{component}.inContact[{i}]"] for i in (1, 2, 3)] for row in rows]
    at = next(k for k in range(1, len(rows)) if max(now[k]) > max(now[k - 1]))
    return rows[at - 1 : at + 2]


def test_a_touch_ends_the_step_of_all(simulated, fmus):
    """The chaser drifts until the touch: its final position shows when it was stopped."""
    text = coupled(fmus, "extrapolate", "\nevent-rows = true").replace("stop = 30", "stop = 3.6")
    before, after, later = first_touch(simulated(text, True), "contact")
    scene = fmus / "CaptureScene.fmi3.fmu"
    text = f'[run]\nstop = 3.6\nstep = 0.1\ntolerance = 1e-12\n[components.scene]\nfmu = "{scene}"\ninterface = "model-exchange"\n'
    _, wanted, _ = first_touch(simulated(text, True), "scene")
    assert before["time"] == after["time"] and abs(after["time"] / 0.001 - round(after["time"] / 0.001)) > 1e-3
    assert abs(after["time"] - wanted["time"]) < 1e-9
    assert abs(after["chaser.position[1]"] - SPEED * after["time"]) < 1e-14
    # The force jumps (CON-2), and both bodies have it at once.
    force = [np.hypot(row["contact.hostForce[1]"], row["contact.hostForce[2]"]) for row in (before, after)]
    assert force[0] == 0.0 and force[1] > 20.0
    lasts = later["time"] - after["time"]
    assert 0 < lasts < 0.001
    for body, sign in (("chaser", 1), ("target", -1)):
        gained = (later[f"{body}.linearMomentum[2]"] - after[f"{body}.linearMomentum[2]"]) / lasts
        assert abs(gained / after["contact.hostForce[2]"] - sign) < 0.03


def test_without_events_a_force_begins_in_the_middle_of_a_step(simulated, fmus):
    """FMI 2.0 does not report when within a step a touch begins: the force is spread over the step, so that the impulse is off by what it
    has between the touch and the step's middle. FMI 3.0 reports it."""
    stop, of_step = 3.8, (0.0, 0.25, 0.5, 0.75)
    scene = fmus / "CaptureScene.fmi3.fmu"
    text = f'[run]\nstop = {stop}\nstep = 0.1\ntolerance = 1e-12\nevent-rows = true\n[components.scene]\nfmu = "{scene}"\ninterface = "model-exchange"\n'
    one = simulated(text, True)
    _, touch, _ = first_touch(one, "scene")
    wanted = [one[-1][f"scene.targetVelocity[{i}]"] - one[-1][f"scene.chaserVelocity[{i}]"] for i in (1, 2)]
    assert sum(one[-1][f"scene.inContact[{i}]"] for i in (1, 2, 3)) == 0, "the one touch is over"

    def off(version, share):
        """Error of the relative velocity at the end, the first touch at this share of a step of about 4 ms."""
        step = touch["time"] / (round(touch["time"] / 0.004) + share)
        text = coupled(fmus, "extrapolate").replace("step = 0.001", f"step = {step!r}").replace("stop = 30", f"stop = {stop}")
        row = simulated(text.replace("fmi3", f"fmi{version}"))
        return np.subtract([row[f"target.velocity[{i}]"] - row[f"chaser.velocity[{i}]"] for i in (1, 2)], wanted)

    second, third = (np.array([off(version, share) for share in of_step]) for version in (2, 3))
    largest = np.hypot(*second[0])
    along = second @ second[0] / largest**2
    print(f"FMI 2.0 off by {largest:.1e} m/s where the touch begins a step, by {along.round(3)} of that at {of_step} of it; FMI 3.0 by {np.hypot(*third.T)} m/s")
    # 1 at the beginning, 0 in the middle; what else extrapolation is off by is of second order in the step.
    assert np.abs(along - (1 - 2 * np.array(of_step))).max() < 0.1
    assert 10 * np.hypot(*third.T).max() < largest


def test_a_long_step_is_told(trueup, fmus, tmp_path):
    """A fifth of 2 pi sqrt(mu / k) with the reduced mass of chaser and target (CON-5)."""
    mass = 1 / (1 / MASS + 1 / 7900.0)
    fifth = 2 * np.pi * np.sqrt(mass / 20000.0) / 5
    for host, step, told in ((MASS, 1.01 * fifth, True), (MASS, 0.99 * fifth, False), (0.0, 1.01 * fifth, False)):
        text = coupled(fmus, "jacobi").replace("step = 0.001", f"step = {step}").replace("stop = 30", "stop = 1")
        (tmp_path / "system.toml").write_text(text + f"\n[components.contact.start]\nhostMass = {host}\n")
        done = trueup("simulate", "system.toml", "-o", "r.csv", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert ("contact warns: the communication step of" in done.stderr) == told, done.stderr
        assert (f"longer than {fifth:.9g} s, a fifth" in done.stderr) == told, done.stderr


def test_a_central_impact_through_fmpy_has_the_closed_form_s_times(fmus):
    """CON-4 by Co-Simulation with event mode: touch, turn and release (C36-C38); C15's jaws are out of the way."""
    stiffness, damping, gap = 20000.0, 900.0, 0.005
    mass = 1 / (1 / MASS + 1 / 7900.0)
    omega, zeta = np.sqrt(stiffness / mass), damping / (2 * np.sqrt(stiffness * mass))
    turn = np.arccos(zeta) / (omega * np.sqrt(1 - zeta**2))
    wanted = np.cumsum([gap / SPEED, turn, np.pi / 2 / omega])
    assert abs(turn - 0.402094) < 1e-6 and abs(np.pi / 2 / omega - 0.423215) < 1e-6
    result = simulate_fmu(
        str(fmus / "CaptureScene.fmi3.fmu"),
        fmi_type="CoSimulation",
        stop_time=2.0,
        step_size=0.05,
        output_interval=0.05,
        relative_tolerance=1e-10,
        start_values={"targetCenterOfMass": [5.0, 0.0], "initialPortOffset": [0.1 + gap, 0.0]},
        output=["inContact", "approachSpeed"],
        early_return_allowed=True,
        use_event_mode=True,
        record_events=True,
    )
    time = result["time"]
    events = time[1:][np.diff(time) == 0.0]
    off = [float(abs(np.asarray(events) - t).min()) for t in wanted]
    print("touch, turn and release off by", off, "s")
    assert max(off) < 1e-7
