"""S2's gripper with carriages (section 3.1) as an FMU: through FMPy by both versions and interfaces, and bad input."""

import re
import time
import tomllib

import numpy as np
import pytest
from conftest import ROOT
from fmpy import simulate_fmu

STOP = 25.0  # s: by then the ring has turned through the play that carriages leave
STRUCTURE = ("numberOfBalls=7", "endBallMount=carriages", "against=bar")


@pytest.fixture(scope="module")
def gripper(trueup, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gripper")
    done = trueup("fmu", "pack", "CaptureScene", *(a for s in STRUCTURE for a in ("--structure", s)), "-o", folder)
    assert done.returncode == 0, done.stderr
    return {version: folder / f"CaptureScene.fmi{version}.fmu" for version in (2, 3)}


def starts(version):
    """Those of the example, an array at once for FMI 3.0."""
    example = tomllib.loads((ROOT / "examples/04-capture/gripper.toml").read_text())["components"]["scene"]["start"]
    if version == 2:
        return example
    whole = {"endEffectorPosition": [1.26, 0.0], "initialChaserVelocity": [0.0, 0.0], "targetCenterOfMass": [0.4, 0.0], "initialPortOffset": [0.07, 0.01]}
    for name, values in whole.items():
        for i, value in enumerate(values):
            assert example.get(f"{name}[{i + 1}]", value) == value
    return {name: value for name, value in example.items() if "[" not in name} | whole


def test_fmpy_runs_it_by_both_versions_and_interfaces(gripper):
    ends = {}
    for version in (3, 2):
        for interface in ("CoSimulation", "ModelExchange"):
            energies = ["kineticEnergy", "elasticEnergy", "dissipatedEnergy", "jawWork"]
            began = time.perf_counter()
            result = simulate_fmu(
                str(gripper[version]), fmi_type=interface, stop_time=STOP, output_interval=0.25, relative_tolerance=1e-8,
                start_values=starts(version), output=["portAngle", "operationMode", "outcome", *energies],
            )  # fmt: skip
            factor = STOP / (time.perf_counter() - began)
            kinetic, elastic, lost, work = (np.asarray(result[n]) for n in energies)
            balance = np.ptp(kinetic + elastic + lost - work)
            angle, mode = np.degrees(result["portAngle"]), np.asarray(result["operationMode"], float)
            print(f"FMI {version} {interface}: real-time factor {factor:.0f}, energy within {balance:.1e} J, {angle[0]:.2f} to {angle[-1]:.4f} deg")
            # Carriages on their springs while the jaws close, locked from then on.
            assert list(np.unique(mode)) == [1.0, 2.0] and (mode[result["time"] < 4.9] == 1).all() and (mode[result["time"] > 5.1] == 2).all()
            assert balance < 1e-5
            ends[version, interface] = angle
    first = ends[3, "CoSimulation"]
    assert abs(first[0] + 5) < 1e-9 and abs(first[-1]) < 0.5 * abs(first[0]), "it turns the ring"
    assert max(abs(end[-1] - first[-1]) for end in ends.values()) < 1e-3


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("carriageDirection", [0.0, 0.0], "a carriage requires a way"), ("carriageTravel", 0.0, "carriageTravel"), ("carriageDamping", 0.0, "carriageDamping"),
        ("frictionCoefficient", 0.1, "have no friction"), ("portBarHalfLength", -1.0, "portBarHalfLength"),
        ("initialPortOffset", [0.0, 0.0], "concentric|meet|deep"),
    ],  # fmt: skip
)
def test_bad_input_is_one_clear_error(trueup, gripper, tmp_path, name, value, message):
    with pytest.raises(Exception):  # noqa: B017
        simulate_fmu(str(gripper[3]), stop_time=0.1, start_values={name: value})
    refused(trueup, gripper[3], tmp_path, {name: value}, message)


def refused(trueup, fmu, folder, start, message):
    """By the program, in one line that names the remedy, without a result."""
    lines = "".join(f'"{name}" = {list(value) if np.ndim(value) else value}\n' for name, value in start.items())
    (folder / "s.toml").write_text(f'[run]\nstop = 0.1\nstep = 0.1\n[components.scene]\nfmu = "{fmu}"\n[components.scene.start]\n{lines}')
    done = trueup("simulate", "s.toml", "-o", "r.csv", cwd=folder)
    assert done.returncode == 1 and done.stderr.count("error") == 1 and re.search(message, done.stderr), done.stderr
    assert not (folder / "r.csv").exists()


@pytest.mark.parametrize(
    "choices, message",
    [(("endBallMount=carriages", "numberOfBalls=2"), "numberOfBalls=3"), (("against=ring",), "chaser=spatial"), (("against=cylinder", "chaser=planar"), "chaser=spatial")],
)
def test_structures_that_cannot_be_had_are_refused(trueup, tmp_path, choices, message):
    done = trueup("fmu", "pack", "CaptureScene", *(a for c in choices for a in ("--structure", c)), "-o", tmp_path)
    assert done.returncode != 0 and message in done.stderr and not list(tmp_path.iterdir()), done.stderr
