"""FMPy as the reference for how often an FMU is called: one that makes a sample of its law per `doStep` gives the same values at every
time, over steps, lengths and inputs that are drawn (`TRUEUP_SEED`)."""

import csv
import os
import random
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

TRUEUP = os.environ.get("TRUEUP_BIN")
XML = """<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="one" guid="g">
<CoSimulation modelIdentifier="one" canHandleVariableCommunicationStepSize="{variable}"/>
<DefaultExperiment startTime="0" stopTime="1" stepSize="0.1"/><ModelVariables>
<ScalarVariable name="e" valueReference="0" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
<ScalarVariable name="u" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
<ScalarVariable name="calls" valueReference="4" causality="output" variability="discrete"><Integer/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="2"/><Unknown index="3"/></Outputs>
<InitialUnknowns><Unknown index="2"/><Unknown index="3"/></InitialUnknowns></ModelStructure></fmiModelDescription>"""


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    library = folder / "one.so"
    source = Path(__file__).with_name("one_sample.c")
    subprocess.run(["cc", "-O1", "-w", "-fPIC", "-shared", source, "-o", library], check=True)
    made = []
    for variable in ("true", "false"):
        made.append(folder / f"one-{variable}.fmu")
        with zipfile.ZipFile(made[-1], "w") as archive:
            archive.writestr("modelDescription.xml", XML.format(variable=variable))
            archive.write(library, "binaries/linux64/one.so")
    return made


@pytest.mark.skipif(not TRUEUP, reason="TRUEUP_BIN is not set")
def test_fmpy_calls_a_sampled_law_as_often(fmus, tmp_path):
    seed = int(os.environ.get("TRUEUP_SEED", 1))
    print("seed", seed)
    dice = random.Random(seed)
    for case in range(4):
        fmu, step, count = dice.choice(fmus), dice.choice([0.001, 0.01, 0.02, 0.1, 0.25]), dice.randrange(5, 60)
        stop = round(step * count, 9)
        knots = sorted({0.0, stop, *(round(dice.uniform(0, stop), 4) for _ in range(6))})
        values = [dice.uniform(-2, 2) for _ in knots]
        file, out = tmp_path / f"in{case}.csv", tmp_path / f"out{case}.csv"
        file.write_text("time,e\n" + "".join(f"{t},{x}\n" for t, x in zip(knots, values)))
        run = [TRUEUP, "simulate", fmu, "--input", file, "--step", str(step), "--stop", str(stop), "-o", out]
        subprocess.run(run, check=True, capture_output=True, text=True)
        signal = np.array(list(zip(knots, values)), dtype=[("time", float), ("e", float)])
        witness = simulate_fmu(str(fmu), stop_time=stop, step_size=step, output_interval=step, input=signal, output=["u", "calls"])
        with open(out) as lines:
            ours = list(csv.DictReader(lines))
        assert [float(row["calls"]) for row in ours] == [float(k) for k in range(count + 1)]
        assert list(witness["calls"]) == list(range(count + 1))
        assert np.allclose([float(row["u"]) for row in ours], witness["u"], rtol=0, atol=1e-9), (seed, case)
