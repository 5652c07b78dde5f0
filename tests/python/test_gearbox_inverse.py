"""Gearboxes of two stages and inverse dynamics: commands and FMUs; weights of times through the program."""

import csv
import json

import numpy as np
import pytest
from fmpy import simulate_fmu

from conftest import ROOT

STAGES = """motorInertia = 1.2e-7
loadInertia = 8.0
[planetary]
inertia = 3e-8
stiffness = 1e-4
damping = 2e-7
ratio = 200
[harmonic-drive]
inertia = 2e-5
stiffness = 6.0
damping = 3e-3
ratio = 160
"""


def columns(file):
    rows = list(csv.DictReader(file.open()))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def refused(done, status, *words):
    assert done.returncode == status, done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert "panicked" not in done.stderr


def test_a_gearbox_is_its_two_compliances_in_series(trueup, tmp_path):
    file = tmp_path / "gearbox.toml"
    file.write_text(STAGES)
    done = trueup("gearbox", file, "--json")
    assert done.returncode == 0, done.stderr
    found = {name: entry["value"] for name, entry in json.loads(done.stdout).items() if isinstance(entry, dict)}
    # The complex stiffness of two springs with dampers in series, motor side, at a low frequency.
    w = 1e-9
    whole = 1 / (1 / (1e-4 + 1j * w * 2e-7) + 200**2 / (6.0 + 1j * w * 3e-3))
    assert found["stiffness"] == pytest.approx(whole.real, rel=1e-12)
    assert found["damping"] == pytest.approx(whole.imag / w, rel=1e-6)
    assert found["gearRatio"] == 32000 and found["motorInertia"] == pytest.approx(1.5e-7)
    assert found["loadInertia"] == pytest.approx(8 + 2e-5 * 160**2)
    text = trueup("gearbox", file).stdout
    assert "stiffness = 6e-5" in text and "S3 prints a damping" in text


@pytest.mark.parametrize(
    "change, words",
    [
        (("ratio = 200", "ratio = 0.5"), ["[planetary] ratio = 0.5", "1 or more"]),
        (("stiffness = 6.0", "stiffness = 0"), ["[harmonic-drive] stiffness = 0", "above 0"]),
        (("stiffness = 6.0", ""), ["missing field `stiffness`", "N.m/rad"]),
        (("damping = 2e-7", "dampnig = 2e-7"), ["unknown field `dampnig`", "6 |"]),
        (("inertia = 3e-8", "inertia = -1"), ["[planetary] inertia = -1", "0 or more"]),
        (("motorInertia = 1.2e-7", "motorInertia = nan"), ["motorInertia = NaN", "leave it out"]),
        (("ratio = 160", "ratio = inf"), ["[harmonic-drive] ratio = inf"]),
    ],
)
def test_a_gearbox_that_cannot_be_is_refused(trueup, tmp_path, change, words):
    file = tmp_path / "gearbox.toml"
    file.write_text(STAGES.replace(*change))
    refused(trueup("gearbox", file), 1, "gearbox.toml", *words)


def test_a_missing_gearbox_is_refused(trueup, tmp_path):
    refused(trueup("gearbox", tmp_path / "none.toml"), 1, "none.toml", "there is no such file")


@pytest.mark.parametrize("version", (2, 3))
def test_an_fmu_of_two_stages_moves_as_its_equivalent(trueup, fmus, tmp_path, version):
    done = trueup("fmu", "pack", "TwoMassJoint", "--fmi", version, "--structure", "gearbox=two-stages", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    two, one = tmp_path / f"TwoMassJoint.fmi{version}.fmu", fmus / f"TwoMassJoint.fmi{version}.fmu"
    stages = {"planetaryStiffness": 1e-4, "planetaryDamping": 2e-7, "planetaryRatio": 200.0, "planetaryInertia": 3e-8}
    stages |= {"harmonicDriveStiffness": 6.0, "harmonicDriveDamping": 3e-3, "harmonicDriveRatio": 160.0, "harmonicDriveInertia": 2e-5}
    own = {"motorInertia": 1.2e-7, "loadInertia": 8.0, "initialMotorVelocity": 5.0}
    k = 1 / (1 / 1e-4 + 200**2 / 6.0)
    d = (6.0**2 * 2e-7 + 200**2 * 1e-4**2 * 3e-3) / (6.0 + 1e-4 * 200**2) ** 2
    as_one = own | {"motorInertia": 1.5e-7, "loadInertia": 8 + 2e-5 * 160**2, "gearRatio": 32000.0, "stiffness": k, "damping": d}
    shown = ["motorAngle", "loadAngle", "transmissionTorque", "sticking"]
    run = lambda file, start, more: simulate_fmu(file, stop_time=1, output_interval=0.01, start_values=start, output=shown + more)  # noqa: E731
    a, b = run(one, as_one, []), run(two, own | stages, ["equivalentStiffness", "equivalentDamping", "gearRatio"])
    for name in shown:
        scale = np.abs(a[name]).max()
        assert scale > 0 and np.abs(np.asarray(a[name], float) - np.asarray(b[name], float)).max() < 1e-9 * scale, name
    assert b["equivalentStiffness"][-1] == pytest.approx(k) and b["equivalentDamping"][-1] == pytest.approx(d) and b["gearRatio"][0] == 32000


def test_structures_that_cannot_be_had_are_refused(trueup, tmp_path):
    pack = lambda *arguments: trueup("fmu", "pack", *arguments, "-o", tmp_path)  # noqa: E731
    refused(pack("TwoMassJoint", "--structure", "gearbox=two-stages", "--flexible", "false"), 2, "rigid joint has no springs")
    refused(pack("TwoMassJoint", "--structure", "gearbox=three"), 2, "gearbox", "two-stages")
    refused(pack("TwoMassJoint", "--structure", "gearbox=two-stages", "--set", "stiffness=1"), 2, "no variable `stiffness`")
    refused(pack("PlanarManipulator", "--structure", "drive=acceleration", "--effect", "motor-friction"), 2, "motor-friction", "drive = torque")
    assert not list(tmp_path.iterdir())


def motion(file, stop=4.0, rate=50):
    """Quintic moves of three joints from rest to rest."""
    ways = ((0.1, 0.5), (-0.3, -0.4), (-0.4, 0.3))
    lines = ["time,jointAngle[1],jointAngle[2],jointAngle[3]"]
    for k in range(int(stop * rate) + 1):
        s = k / (stop * rate)
        path = s**3 * (10 - 15 * s + 6 * s * s)
        lines.append(",".join(repr(v) for v in (k / rate, *(start + way * path for start, way in ways))))
    file.write_text("\n".join(lines) + "\n")


def test_torques_of_a_motion_cause_it(trueup, tmp_path):
    """The rigid arm, its base free, driven by what `inverse` found, goes where it was."""
    motion(tmp_path / "motion.csv")
    done = trueup("inverse", "motion.csv", "-o", "torques.csv", cwd=tmp_path)
    assert done.returncode == 0 and "base turned by" in done.stdout, done.stderr
    found = columns(tmp_path / "torques.csv")
    assert trueup("fmu", "pack", "PlanarManipulator", "--fmi", 3, "--flexible", "false,false,false", "-o", tmp_path).returncode == 0
    (tmp_path / "drive.csv").write_text(
        "time,jointTorque[1],jointTorque[2],jointTorque[3]\n" + "".join(f"{t},{a},{b},{c}\n" for t, a, b, c in zip(found["time"], *(found[f"jointTorque[{k}]"] for k in (1, 2, 3))))
    )
    done = trueup("simulate", "PlanarManipulator.fmi3.fmu", "--input", "drive.csv", "--set", "initialJointAngle=0.1,-0.3,-0.4", "--step", 0.02, "--stop", 4, "-o", "run.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    run, asked = columns(tmp_path / "run.csv"), columns(tmp_path / "motion.csv")
    for name in ("jointAngle[1]", "jointAngle[2]", "jointAngle[3]"):
        # Torques go on lines between samples, the motion does not.
        assert np.abs(run[name] - asked[name]).max() < 2e-4, name
    for name in ("baseAttitude", "basePosition[1]"):
        assert np.abs(run[name] - found[name]).max() < 2e-4 and np.abs(found[name]).max() > 1e-3, name


def test_noise_of_angles_is_smoothed(trueup, tmp_path):
    """As the sidecar declares it, or --noise; taken as exact it is in the torques, by its second differences."""
    motion(tmp_path / "motion.csv")
    exact = columns(tmp_path / "motion.csv")
    draw = np.random.default_rng(5)
    names = list(exact)[1:]
    noisy = np.column_stack([exact["time"], *(exact[name] + 1e-4 * draw.normal(size=len(exact["time"])) for name in names)])
    np.savetxt(tmp_path / "noisy.csv", noisy, delimiter=",", header=",".join(exact), comments="")
    (tmp_path / "declared.csv").write_text((tmp_path / "noisy.csv").read_text())
    (tmp_path / "declared.toml").write_text("[channels.jointAngle]\nnoise = 1e-4\n")
    torque = {}
    for name, options in (("motion", []), ("noisy", ["--noise", 1e-4]), ("declared", []), ("rough", ["--noise", 0])):
        file = "noisy.csv" if name == "rough" else f"{name}.csv"
        done = trueup("inverse", file, "-o", f"{name}.out.csv", *options, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        torque[name] = columns(tmp_path / f"{name}.out.csv")["jointTorque[1]"]
    error = {name: np.sqrt(np.mean((t - torque["motion"]) ** 2) / np.mean(torque["motion"] ** 2)) for name, t in torque.items()}
    print(error)
    assert np.array_equal(torque["noisy"], torque["declared"])
    assert error["noisy"] < 0.1 and error["rough"] > 1


@pytest.mark.parametrize("version", (2, 3))
def test_an_fmu_has_inverse_dynamics_as_output(trueup, tmp_path, version):
    """One rigid link on a fixed base: tau = (I + m r^2) a + m g r cos(q)."""
    done = trueup("fmu", "pack", "PlanarManipulator", "--fmi", version, "--flexible", "false", "--structure", "drive=acceleration", "--structure", "base=fixed", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    start = {"linkMass[1]": 2.0, "linkInertia[1]": 0.1, "linkCenterOfMass[1,1]": 0.5, "linkCenterOfMass[1,2]": 0.0, "initialJointAngle[1]": 0.3, "motorInertia[1]": 0.02, "gravity[2]": -9.81, "motorAcceleration[1]": 1.5}
    if version == 3:
        start = {"linkMass": [2.0], "linkInertia": [0.1], "linkCenterOfMass": [0.5, 0.0], "initialJointAngle": [0.3], "motorInertia": [0.02], "gravity": [0.0, -9.81], "motorAcceleration": [1.5]}
    names = ["jointTorque[1]", "jointAngle[1]"] if version == 2 else ["jointTorque", "jointAngle"]
    result = simulate_fmu(tmp_path / f"PlanarManipulator.fmi{version}.fmu", stop_time=1, output_interval=0.1, start_values=start, output=names)
    time, torque, angle = (np.asarray(result[name], float).ravel() for name in ("time", *names))
    assert np.abs(angle - (0.3 + 0.75 * time**2)).max() < 1e-6
    expected = (0.1 + 2.0 * 0.25 + 0.02) * 1.5 + 2.0 * 9.81 * 0.5 * np.cos(angle)
    assert np.abs(torque - expected).max() < 1e-6


def test_motions_without_torques_are_refused(trueup, tmp_path):
    motion(tmp_path / "motion.csv")
    inverse = lambda *arguments: trueup("inverse", *arguments, "-o", "t.csv", cwd=tmp_path)  # noqa: E731
    refused(inverse("none.csv"), 1, "none.csv", "no such file")
    refused(inverse("motion.csv", "--flexible", "true,false,false"), 1, "no column motorAngle[1]", "joint 1")
    refused(inverse("motion.csv", "--flexible", "false,false,false,false"), 1, "no column jointAngle[4]")
    refused(inverse("motion.csv", "--set", "initialJointAngle[1]=1"), 2, "the motion is that of motion.csv")
    refused(inverse("motion.csv", "--set", "linkMass[1]=-1"), 2, "linkMass")
    refused(inverse("motion.csv", "--set", "linkMas=1,1,1"), 2, "did you mean `linkMass`")
    refused(inverse("motion.csv", "--noise", "-1"), 2, "--noise", "0 or more")
    (tmp_path / "other.csv").write_text("time,angle\n0,1\n1,2\n")
    refused(inverse("other.csv"), 1, "other.csv", "no angle of joint 1", "jointAngle[1]")
    (tmp_path / "short.csv").write_text("time,jointAngle[1]\n0,1\n1,2\n2,2\n")
    refused(inverse("short.csv"), 1, "jointAngle[1] has 3 samples", "5 or more")
    assert not (tmp_path / "t.csv").exists()


def test_weights_of_times(trueup, tmp_path):
    """`identify` uses them and states it, `diagnose` and regressions refuse them."""
    folder = ROOT / "examples/09-flexible-joint"
    for name in ("test-2.csv", "test-2.csv.toml", "weighted.toml"):
        (tmp_path / name).write_text((folder / name).read_text())
    line = next(k for k, text in enumerate((folder / "weighted.toml").read_text().splitlines(), 1) if text.startswith("weight"))
    done = trueup("diagnose", tmp_path / "weighted.toml", "-o", tmp_path / "found")
    refused(done, 1, f"weighted.toml:{line}", "`weight` of [fit] would be ignored", "trueup identify")
    assert not (tmp_path / "found").exists()
    done = trueup("identify", tmp_path / "weighted.toml", "--fast", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert any("readings from 5 s on count for 0.1 each" in note for note in found["notes"]), found["notes"]
    assert 5.7 < found["parameters"]["jointStiffness[1]"]["value"] < 5.82
    refused(trueup("identify", tmp_path / "weighted.toml", "--method", "iv"), 1, "method iv has no `weight`")
