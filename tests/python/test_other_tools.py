"""ecos and libcosim run the Co-Simulation FMUs of the versions that they know (2.0 and 3.0; 2.0)."""

import ctypes.util
import os
from pathlib import Path

import pytest
from fmpy import simulate_fmu

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))
CASES = [
    ("TwoMassJoint", {"motorCurrent": 0.02}, "motorAngle"),
    ("PlanarManipulator", {"jointTorque[1]": 0.1}, "jointAngle[1]"),
    ("JointController", {"positionReference": 1e-4}, "motorCurrent"),
    ("ManipulatorController", {"positionReference[1]": 0.01}, "jointTorque[1]"),
]
STEP, STOP = 1e-3, 0.5

if not list(FMUS.glob("*.fmu")):
    pytest.skip(f"no packed FMUs in {FMUS}: run ./test, which packs them", allow_module_level=True)


def with_fmpy(model, drive, watched):
    r = simulate_fmu(
        str(FMUS / f"{model}.fmi2.fmu"), fmi_type="CoSimulation", stop_time=STOP, step_size=STEP, output_interval=STEP,
        output=[watched], start_values=drive,
    )
    return r[watched][-1]


@pytest.mark.parametrize("model,drive,watched", CASES)
def test_libcosim(model, drive, watched):
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(int(STEP * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(str(FMUS / f"{model}.fmi2.fmu"), "it"))
    info = {v.name.decode() if isinstance(v.name, bytes) else v.name: v for v in execution.slave_variables(slave)}
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    for name, value in drive.items():
        execution.real_initial_value(slave, info[name].reference, value)
    assert execution.simulate_until(int(STOP * 1e9))
    have = observer.last_real_values(slave, [info[watched].reference])[0]
    want = with_fmpy(model, drive, watched)
    assert want != 0.0
    assert abs(have - want) <= 1e-9 * abs(want) + 1e-15


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model,drive,watched", CASES)
def test_ecos(model, drive, watched, version):
    if version == 3 and "[" in watched:
        pytest.skip("ecos 0.7.2 has no arrays of FMI 3.0")
    if ctypes.util.find_library("tbb") is None:
        pytest.skip("ecospy needs the system library libtbb.so.12 (Debian: libtbb12), which is not installed")
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    structure.add_model("it", str(FMUS / f"{model}.fmi{version}.fmu"))
    structure.add_parameter_set("start", {f"it::{name}": float(value) for name, value in drive.items()})
    with EcosSimulation(structure=structure, step_size=STEP) as simulation:
        simulation.init(parameter_set="start")
        simulation.step(num_steps=int(round(STOP / STEP)))
        have = simulation.get_real(f"it::{watched}")
        simulation.terminate()
    want = with_fmpy(model, drive, watched)
    assert want != 0.0
    assert abs(have - want) <= 1e-6 * abs(want)
