"""`trueup sweep` and `trueup scale` as users of Python see them: tables by pyarrow, Sobol's sequence by SciPy, an arm at another size."""

import json
import re
import shutil
import subprocess
import time

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
    # Two factors may not vary one variable, so there are as many as an arm has that may be anything from 0 to 1.
    each = {"linkCenterOfMass[{},1]": 3, "linkCenterOfMass[{},2]": 3, "initialJointAngle[{}]": 3, "initialJointVelocity[{}]": 3,
            "mountPosition[{}]": 2, "initialBasePosition[{}]": 2, "initialBaseVelocity[{}]": 2}
    names = [name.format(k + 1) for name, count in each.items() for k in range(count)] + ["initialBaseAttitude", "initialBaseRate"]
    factors = "\n".join(f'f{i} = {{ variable = "{name}", from = 0, to = 1 }}' for i, name in enumerate(names))
    head = 'design = "sobol"\nruns = 500\n[run]\nstop = 0.001\nstep = 0.001\n'
    outputs = '[outputs]\nangle = { variable = "baseAttitude", take = "min" }\n'
    table = sweep(run, fmus, tmp_path, f"{head}[factors]\n{factors}\n{outputs}", "PlanarManipulator")
    ours = np.column_stack([table[f"f{i}"].to_numpy() for i in range(len(names))])
    theirs = qmc.Sobol(len(names), scramble=False, bits=32).random(512)[:500]
    assert len(names) == 20 and np.array_equal(ours, theirs)


def columns(file):
    with open(file) as lines:
        names = lines.readline().strip().split(",")
    return names, np.loadtxt(file, delimiter=",", skiprows=1)


def test_an_arm_at_another_size_says_what_the_full_one_does(run, fmus, tmp_path):
    text = (ROOT / "examples/02-arm/arm.toml").read_text().replace("../../out/", f"{fmus}/").replace("stop = 60", "stop = 10")
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
        assert np.abs(full[:, i] - back[:, i]).max() <= 1e-8 * size, name
    # Scaled, it is another motion: energies are 0.3^3 of the full ones.
    energy = names.index("arm.kineticEnergy")
    assert small[:, energy].max() == pytest.approx(0.027 * full[:, energy].max(), rel=1e-8)


def capture(fmus, folder, name, **instead):
    """One of the captures of examples/, next to its FMU; `instead` replaces the values of factors."""
    (folder / "scene.fmu").symlink_to(fmus / "CaptureScene.fmi3.fmu")
    system = (ROOT / "examples/04-capture/capture.toml").read_text().replace("../../out/CaptureScene.fmi3.fmu", "scene.fmu")
    (folder / "capture.toml").write_text(system)
    lines = (ROOT / "examples/04-capture" / f"{name}.toml").read_text().splitlines()
    for at, line in enumerate(lines):
        factor = line.split(" = ")[0]
        if factor in instead:
            variable = line.split('"')[1]
            lines[at] = f'{factor} = {{ variable = "{variable}", values = {instead.pop(factor)} }}'
    assert not instead
    (folder / f"{name}.toml").write_text("\n".join(lines))


@pytest.fixture
def map_of(run, fmus, tmp_path):
    """map_of(name, ...) does the runs of a capture, draws them, and gives the page's data and the table of runs."""

    def map_of(name, *options, **instead):
        capture(fmus, tmp_path, name, **instead)
        run("sweep", f"{name}.toml")
        run("sweep", "merge", f"{name}.toml")
        run("sweep", "map", f"{name}.toml", *options)
        page = (tmp_path / f"{name}.html").read_text()
        (data,) = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
        return json.loads(data), pq.read_table(tmp_path / f"{name}.parquet").to_pydict(), page

    return map_of


def test_a_map_has_a_tile_a_run_and_their_time_lines(map_of):
    data, table, page = map_of("capture-map", x=[0.12, 0.3], y=[-0.15, 0.0, 0.15])
    assert data["kinds"] == ["held", "held-turned", "one-jaw", "jammed", "pushed-away", "open"]
    assert [cell["kind"] for cell in data["cells"]] == [int(o) - 1 for o in table["outcome"]]
    assert [cell["at"][1:] for cell in data["cells"]] == [[x, y] for y in range(3) for x in range(2)]
    for k, cell in enumerate(data["cells"]):
        lines = dict(zip(data["lines"], cell["lines"]))
        assert lines["outcome"][-1] == table["outcome"][k]
        # When each ball first touched is when its line first rises.
        for ball in ("P1", "P2", "P3"):
            first = [t for t, v in zip(lines[ball][::2], lines[ball][1::2]) if v]
            assert (first[0] if first else None) == pytest.approx(table[ball][k], abs=1e-5)
    held = data["cells"][2]
    assert held["name"].endswith("y = 0 m, x = 0.12 m") and data["kinds"][held["kind"]] == "held"
    assert page.count("<rect data-k=") == 6


def test_what_others_say_stands_beside_and_decides_nothing(map_of, tmp_path):
    (tmp_path / "letters.csv").write_text("x,y,angle,bench\n0.12,0,0,A\n0.13,0.01,0,C\n")
    some = {"x": [0.12, 0.13], "y": [0.0, 0.01], "angle": [0.0]}
    plain, *_ = map_of("capture-cells", **some)
    (tmp_path / "scene.fmu").unlink()
    beside, _, page = map_of("capture-cells", "--beside", "letters.csv", **some)
    assert [c["remark"] for c in beside["cells"]] == ["bench: A", "", "", "bench: C"]
    assert [c["kind"] for c in beside["cells"]] == [c["kind"] for c in plain["cells"]]
    assert "bench: A" in page


@pytest.mark.parametrize(
    "change, letters, message",
    [
        (("outcome = {", "# outcome = {"), None, "outcome = { variable"),
        (('design = "grid"', 'design = "sobol"\nruns = 2'), None, "a grid or a list"),
        (None, "x,bench\n0.12,A\n", "the factor `y` has no column"),
        (None, "y,x,bench\n0.0,0.12,A\n0.0,7,C\n", "line 3: no run has y = 0.0, x = 7"),
    ],
)
def test_maps_that_cannot_be_drawn_say_why(trueup, fmus, tmp_path, change, letters, message):
    capture(fmus, tmp_path, "capture-map", x=[0.12], y=[0.0])
    file = tmp_path / "capture-map.toml"
    if change:
        text = file.read_text()
        assert change[0] in text
        file.write_text(text.replace(*change))
    options = []
    if letters:
        (tmp_path / "letters.csv").write_text(letters)
        options = ["--beside", "letters.csv"]
    done = trueup("sweep", "map", "capture-map.toml", *options, cwd=tmp_path)
    assert done.returncode != 0 and message in done.stderr, done.stderr
    assert not (tmp_path / "capture-map.html").exists()


@pytest.mark.full
def test_a_hundred_thousand_runs_survive_fifty_kills(run, trueup, fmus, tmp_path):
    """Killed at random times, resumed, in changing shares: the merged file has the bytes of an undisturbed sweep."""
    text = """design = "sobol"
runs = 100000
[run]
stop = 0.01
step = 0.01
[factors]
x = { variable = "initialPortOffset[1]", from = 0.1, to = 0.3 }
y = { variable = "initialPortOffset[2]", from = -0.15, to = 0.15 }
damping = { variable = "normalDamping", from = -10, to = 1000 }
[outputs]
speed = { variable = "chaserVelocity[1]" }
outcome = { variable = "outcome" }
"""
    began = time.monotonic()
    table = sweep(run, fmus, tmp_path, text, "CaptureScene")
    took = time.monotonic() - began
    whole = (tmp_path / "s.parquet").read_bytes()
    failed = table["reason"].null_count
    assert table.num_rows == 100_000 and 0 < 100_000 - failed < 2000  # a damping below 0 is refused
    shutil.rmtree(tmp_path / "s.runs")
    rng, kills = np.random.default_rng(50), 0
    for share in rng.choice(["1/1", "1/2", "2/2", "2/3"], 400):
        process = subprocess.Popen([trueup.program, "sweep", "s.toml", "--shard", share], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(rng.uniform(0, took / 50))
        kills += process.poll() is None
        process.kill()
        process.wait()
        if kills == 50:
            break
    run("sweep", "s.toml")
    run("sweep", "merge", "s.toml", "-o", "again.parquet")
    print(f"{kills} kills of a sweep that takes {took:.1f} s undisturbed")
    assert kills == 50
    assert (tmp_path / "again.parquet").read_bytes() == whole
