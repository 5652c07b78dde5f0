"""Static friction from slow current ramps, Young's modulus from deflections, the first mode of an arm."""

import json

import numpy as np
import pytest
from low_level import Opened

MOTOR = {"gearRatio": 21750.0, "loadInertia": 6.0, "stiffness": 2.2e-5, "damping": 3.18e-8, "coulombFriction": 1.2e-4,
         "staticFriction": 2.6e-4, "viscousFriction": 2.5e-8, "motorInertia": 1.2e-7, "torqueConstant": 0.02}
COUNT = 2 * np.pi / 16


def ramp(fmu, slope, lifted=0.0):
    t = np.arange(0, 20, 0.01)
    with Opened(fmu("TwoMassJoint", 2), "CS", tolerance=1e-10) as f:
        f.initialize(MOTOR, stop=21.0)
        angle = np.empty_like(t)
        for k, time in enumerate(t):
            angle[k] = f.get("motorAngle")
            f.set("motorCurrent", float(slope * time))
            f.fmu.doStep(currentCommunicationPoint=float(time), communicationStepSize=0.01)
    return t, slope * t, np.round(angle / COUNT) * COUNT


def test_break_away_of_slow_ramps(trueup, fmu, tmp_path):
    """The ramps of S3 section 4.2 in FMPy, both ways, read by 16 counts per turn at 100 Hz."""
    names = []
    for k, slope in enumerate((1e-3, -2e-3, 4e-3)):
        names.append(f"ramp-{k}.csv")
        rows = np.column_stack(ramp(fmu, slope))
        np.savetxt(tmp_path / names[-1], rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="")
    text = ['model = "TwoMassJoint"', f"train = {json.dumps(names)}", "[parameters]"]
    text += [f"{name} = {value!r}" for name, value in MOTOR.items() if name != "staticFriction"]
    text += ["[channels.motorAngle]", f"resolution = {COUNT!r}", "[channels.motorCurrent]", 'interpolation = "hold"']
    (tmp_path / "case.toml").write_text("\n".join(text) + "\n")
    done = trueup("identify", tmp_path, "--method", "break-away", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    e = found["parameters"]["staticFriction"]
    print(f"staticFriction {e['value']:.6g} +- {e['standard_error']:.2g}, truth {MOTOR['staticFriction']}")
    assert abs(e["value"] / MOTOR["staticFriction"] - 1) < 0.02
    # Each ramp by itself: late by a few samples of its slope at most.
    for name, slope in zip(names, (1e-3, -2e-3, 4e-3)):
        own = found["nuisance"][name]["staticFriction"]["value"]
        assert abs(own - MOTOR["staticFriction"]) < 6 * 0.02 * abs(slope) * 0.01, name


def test_a_ramp_that_never_breaks_away(trueup, tmp_path):
    t = np.arange(0, 2, 0.01)
    rows = np.column_stack((t, 1e-3 * t, np.zeros_like(t)))
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="time,motorCurrent,motorAngle", comments="")
    (tmp_path / "case.toml").write_text(
        'model = "TwoMassJoint"\ntrain = ["a.csv"]\n[channels.motorAngle]\nresolution = 0.4\n'
    )
    done = trueup("identify", tmp_path, "--method", "break-away")
    assert done.returncode == 1 and "a.csv" in done.stderr and "never breaks away" in done.stderr, done.stderr


def test_youngs_modulus(trueup, tmp_path):
    """A tube of 70 GPa as a cantilever: d = F L^3 / (3 E J)."""
    modulus, length, moment = 70e9, 1.2, 3e-8
    file = tmp_path / "loads.toml"
    tables = []
    for load in (10.0, 20.0, -40.0):
        d = load * length**3 / (3 * modulus * moment)
        tables.append(f"[[deflection]]\nload = {load}\nlength = {length}\nareaMoment = {moment}\n"
                      f"deflection = {d!r}\ndeflectionError = 1e-5\n")
    file.write_text("\n".join(tables))
    found = json.loads(trueup("statics", file, "--json").stdout)
    assert found["youngsModulus"]["value"] == pytest.approx(modulus, rel=1e-12)
    first = found["deflections"][0]
    assert first["standard_error"] == pytest.approx(modulus * 1e-5 / (10 * length**3 / (3 * modulus * moment)), rel=1e-9)
    file.write_text(tables[0].replace("load =", "force ="))
    done = trueup("statics", file)
    assert done.returncode == 1 and "lacks the number `load`" in done.stderr


def test_first_mode_of_an_arm(trueup, tmp_path):
    """Two flexible joints of a free-floating arm, against the frequency of the reduced system made here in NumPy."""
    # Rotors move with the bodies that carry them; here they weigh nothing.
    base, link, length, com, inertia = 10.0, 2.0, 0.8, 0.4, 0.15
    k = np.array([40.0, 25.0])
    q = np.array([0.3, -0.7])
    lines = ['model = "PlanarManipulator"', 'train = ["none.csv"]', "[parameters]", "numberOfLinks = 2",
             "jointFlexible = [true, true]", f"baseMass = {base}", "baseInertia = 1.5", "mountPosition = [0.2, 0.1]",
             f"linkLength = [{length}, {length}]", f"linkCenterOfMass = [[{com}, 0.0], [{com}, 0.0]]",
             f"linkMass = [{link}, {link}]", f"linkInertia = [{inertia}, {inertia}]",
             "motorInertia = [1e-12, 1e-12]", "gearRatio = [100.0, 100.0]", f"jointStiffness = [{k[0]}, {k[1]}]",
             f"initialJointAngle = [{q[0]}, {q[1]}]"]
    (tmp_path / "case.toml").write_text("\n".join(lines) + "\n")
    done = trueup("statics", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)

    def positions(x):
        """Centres of mass of base and links, and their attitudes."""
        r, a = np.array(x[:2]), x[2]
        turn = lambda v, a: np.array([v[0] * np.cos(a) - v[1] * np.sin(a), v[0] * np.sin(a) + v[1] * np.cos(a)])
        all_, at = [(r, a)], r + turn((0.2, 0.1), a)
        for joint in range(2):
            a = a + x[3 + joint]
            all_.append((at + turn((com, 0.0), a), a))
            at = at + turn((length, 0.0), a)
        return all_

    x0, eps = np.array([0.0, 0.0, 0.0, *q]), 1e-6
    mass = np.zeros((5, 5))
    for body, (m, i) in enumerate(((base, 1.5), (link, inertia), (link, inertia))):
        columns = []
        for j in range(5):
            step = eps * np.eye(5)[j]
            (p1, a1), (p0, a0) = positions(x0 + step)[body], positions(x0 - step)[body]
            columns.append(np.append((p1 - p0), a1 - a0) / (2 * eps))
        jacobian = np.array(columns).T
        mass += jacobian.T @ np.diag([m, m, i]) @ jacobian
    reduced = mass[3:, 3:] - mass[3:, :3] @ np.linalg.solve(mass[:3, :3], mass[:3, 3:])
    first = lambda k: np.sqrt(np.linalg.eigvals(np.linalg.solve(reduced, np.diag(k))).real.min())
    assert found["firstMode"]["value"] == pytest.approx(first(k) / (2 * np.pi), rel=1e-6)
    springs = found["springs"]
    for j, name in enumerate(("jointStiffness[1]", "jointStiffness[2]")):
        stiffer = k * (1 + 0.2 * np.eye(2)[j])
        assert springs[name]["rise"] == pytest.approx(first(stiffer) / first(k) - 1, rel=1e-5)
        share = np.log(first(k * np.exp(1e-5 * np.eye(2)[j])) / first(k)) * 2 / 1e-5
        assert springs[name]["share"] == pytest.approx(share, rel=1e-3)
    assert sum(s["share"] for s in springs.values()) == pytest.approx(1, rel=1e-9)
    assert found["withinRayleighBound"] is True
    done = trueup("statics", tmp_path / "nothing.toml")
    assert done.returncode == 1 and "nothing.toml" in done.stderr
