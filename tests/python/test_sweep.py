"""`trueup sweep` and `trueup scale` as users of Python see them: tables by pyarrow, Sobol's sequence by SciPy, an arm at another size."""

import numpy as np
import pyarrow.parquet as pq
import pytest
from conftest import ROOT
from scipy.stats import qmc


@pytest.fixture
def run(trueup, tmp_path):
    """The program in a folder of its own, where it does its work."""

    def run(*arguments):
        process = trueup(*arguments, cwd=tmp_path)
        assert process.returncode == 0, process.stdout + process.stderr

    return run


def sweep(run, fmus, folder, text, model="TwoMassJoint"):
    (folder / f"{model}.fmu").symlink_to(fmus / f"{model}.fmi3.fmu")
    (folder / "s.toml").write_text(f'system = "{model}.fmu"\n{text}')
    run("sweep", "s.toml")
    run("sweep", "merge", "s.toml")
    return pq.read_table(folder / "s.parquet")


def test_a_table_is_read_as_it_is_described(run, fmus, tmp_path):
    table = sweep(
        run,
        fmus,
        tmp_path,
        """design = "grid"
[run]
stop = 0.01
step = 0.001
[factors]
motorInertia = { values = [1e-7, -1.0] }
motorCurrent = { from = 0, to = 0.1, points = 3 }
[outputs]
speed = { variable = "motorVelocity" }
sliding = { variable = "sticking", take = "time", below = 0.5 }
""",
    )
    assert table.column_names == ["run", "motorInertia", "motorCurrent", "speed", "sliding", "reason"]
    assert table["run"].to_pylist() == [1, 2, 3, 4, 5, 6]
    assert table["motorCurrent"].to_pylist() == [0, 0.05, 0.1] * 2
    assert table["speed"].null_count == 3 and table["reason"].null_count == 3
    assert all("below its minimum" in why for why in table["reason"].to_pylist()[3:])
    # Without a current it sticks for ever.
    assert table["sliding"].to_pylist()[0] is None and table["speed"].to_pylist()[0] == 0.0
    metadata = {k.decode(): v.decode() for k, v in table.schema.metadata.items()}
    assert metadata["unit.motorCurrent"] == "A" and metadata["unit.sliding"] == "s"


def test_sobol_is_that_of_scipy_to_the_bit(run, fmus, tmp_path):
    factors = "\n".join(f'f{i} = {{ variable = "initialMotorAngle", from = 0, to = 1 }}' for i in range(32))
    head = 'design = "sobol"\nruns = 500\n[run]\nstop = 0.001\nstep = 0.001\n'
    outputs = '[outputs]\nangle = { variable = "motorAngle", take = "min" }\n'
    table = sweep(run, fmus, tmp_path, f"{head}[factors]\n{factors}\n{outputs}")
    ours = np.column_stack([table[f"f{i}"].to_numpy() for i in range(32)])
    theirs = qmc.Sobol(32, scramble=False, bits=32).random(512)[:500]
    assert np.array_equal(ours, theirs)


def columns(file):
    with open(file) as lines:
        names = lines.readline().strip().split(",")
    return names, np.loadtxt(file, delimiter=",", skiprows=1)


def test_an_arm_at_another_size_says_what_the_full_one_does(run, fmus, tmp_path):
    text = (ROOT / "examples" / "arm.toml").read_text().replace("../out/", f"{fmus}/").replace("stop = 60", "stop = 10")
    (tmp_path / "arm.toml").write_text(text)
    run("simulate", "arm.toml", "-o", "full.csv")
    run("scale", "arm.toml", "--lambda", "0.3")
    run("simulate", "arm.scaled.toml", "-o", "small.csv")
    run("scale", "small.csv", "--lambda", "0.3", "--back", "--units", "arm.toml", "-o", "back.csv")
    (names, full), (again, back) = columns(tmp_path / "full.csv"), columns(tmp_path / "back.csv")
    _, small = columns(tmp_path / "small.csv")
    assert names == again and full.shape == back.shape
    for i, name in enumerate(names):
        if "Momentum" in name:  # 0 up to rounding
            continue
        size = np.abs(full[:, i]).max()
        assert np.abs(full[:, i] - back[:, i]).max() < 1e-8 * size, name
    # Scaled, it is another motion: energies are 0.3^3 of the full ones.
    energy = names.index("arm.kineticEnergy")
    assert small[:, energy].max() == pytest.approx(0.027 * full[:, energy].max(), rel=1e-8)
