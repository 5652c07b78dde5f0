"""A serialized FMU state, restored in a fresh process, goes on bit by bit as the first one did."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from low_level import Opened

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))
CASES = [
    ("TwoMassJoint", {"motorCurrent": 0.017}),
    ("PlanarManipulator", {"jointTorque": 0.1}),
    ("JointController", {"positionReference": 1e-4}),
    ("ManipulatorController", {"positionReference": 0.1}),
]
STEP = 1e-3


def inputs(f, name, value):
    if name in f.variables and f.version == 3 and f.variables[name].dimensions:
        f.set(name, [value] * f._size(f.variables[name]))
    elif name in f.variables:
        f.set(name, value)
    else:
        for n in [n for n in f.variables if n.startswith(name + "[")]:
            f.set(n, value)


def go_on(f, first, count):
    out = []
    for k in range(first, first + count):
        f.fmu.doStep(k * STEP, STEP) if f.version == 2 else f.fmu.doStep(k * STEP, STEP)
        for v in f.description.modelVariables:
            if v.causality == "output" and v.type in ("Real", "Float64"):
                value = f.get(v.name)
                out += [float(x).hex() for x in (value if hasattr(value, "__len__") else [value])]
    return out


def restored(fmu, file):
    """What the fresh process runs."""
    with Opened(fmu, "CS") as f:
        f.initialize()
        blob = Path(file).read_bytes()
        state = f.fmu.deSerializeFMUstate(blob, *(() if f.version == 3 else ())) if f.version == 2 else f.fmu.deserializeFMUState(blob)
        f.fmu.setFMUstate(state) if f.version == 2 else f.fmu.setFMUState(state)
        print("\n".join(go_on(f, 137, 60)))


# One plant and one controller, each by another version; all of them with --full.
SHORT = {("TwoMassJoint", 2), ("ManipulatorController", 3)}


@pytest.mark.parametrize(
    "model, drive, version",
    [pytest.param(m, d, v, marks=[] if (m, v) in SHORT else pytest.mark.full) for m, d in CASES for v in (2, 3)],
)
def test_continues_bit_equal_in_a_fresh_process(model, drive, version, tmp_path):
    fmu = FMUS / f"{model}.fmi{version}.fmu"
    with Opened(fmu, "CS") as f:
        f.initialize()
        for name, value in drive.items():
            inputs(f, name, value)
        go_on(f, 0, 137)
        if version == 2:
            state = f.fmu.getFMUstate()
            blob = f.fmu.serializeFMUstate(state)
            f.fmu.freeFMUstate(state)
        else:
            state = f.fmu.getFMUState()
            blob = f.fmu.serializeFMUState(state)
            f.fmu.freeFMUState(state)
        file = tmp_path / "state.bin"
        file.write_bytes(bytes(blob))
        want = go_on(f, 137, 60)
    code = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import test_fmu_state as t; t.restored({str(fmu)!r}, {str(file)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "TRUEUP_FMUS": str(FMUS)})
    assert done.returncode == 0, done.stderr
    have = done.stdout.split()
    assert len(set(want)) > 50 and have == want


if not list(FMUS.glob("*.fmu")):
    pytest.skip(f"no packed FMUs in {FMUS}: run ./test, which packs them", allow_module_level=True)
