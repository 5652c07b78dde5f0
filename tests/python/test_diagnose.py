"""trueup diagnose on blind trials: a small part of what docs/blind-trials.md describes."""

import html
import json
import os
import re
import resource
import shutil
import subprocess
import tomllib
from pathlib import Path

import fmpy
import numpy as np
import pytest

from test_diagnose_replay import replay_from_first_states_told
from test_scene import scene_of

VERDICTS = {"no-gap", "parameters", "effects", "ambiguous", "unknown"}
# Plant, split, how many, seed, which of them. Seeds are not those of any scorecard.
PARTS = [("joint", "none", 3, 100, "1/1"), ("joint", "parameters", 2, 100, "1/1")]
# Without --full: one case without a gap.
SHORT = [("joint", "none", 2, 100, "2/2")]


def program():
    found = os.environ.get("TRUEUP_BIN")
    if not found:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return found


def run(*command, **more):
    return subprocess.run([program(), *map(str, command)], capture_output=True, text=True, **more)


@pytest.fixture(scope="module")
def trials(full, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials")
    for plant, split, count, seed, shard in PARTS if full else SHORT:
        order = ("--plant", plant, "--split", split, "--count", count, "--seed", seed, "--shard", shard)
        made = run("trial", "generate", "-o", folder, *order)
        assert made.returncode == 0, made.stderr
    return folder


@pytest.fixture(scope="module")
def found(trials, tmp_path_factory):
    out = tmp_path_factory.mktemp("found")
    all = {}
    for case in sorted((trials / "cases").iterdir()):
        done = run("diagnose", case, "-o", out / case.name, "--json")
        assert done.returncode == 0, done.stderr
        all[case.name] = out / case.name, json.loads(done.stdout), tomllib.loads((trials / "keys" / f"{case.name}.toml").read_text())
    return all


# By default test_trials.py has the verdict of the short case, and what follows the files of another one.
@pytest.mark.full
def test_verdicts(found):
    wrong = []
    for name, (_, diagnosis, key) in found.items():
        print(name, key["split"], key["effects"], "->", diagnosis["verdict"], [e["id"] for e in diagnosis["effects"]])
        if diagnosis["verdict"] != key["verdict"]:
            wrong.append(name)
    assert not wrong


def check_files(folder, diagnosis):
    assert diagnosis == json.loads((folder / "diagnosis.json").read_text())
    assert diagnosis["schema"] == "trueup.diagnosis/1" and diagnosis["verdict"] in VERDICTS
    page = (folder / "report.html").read_text()
    assert page.startswith("<!") and not re.search(r"""(src|href)\s*=\s*["']?\s*(https?:)?//""", page)


@pytest.mark.full
def test_files(found):
    for folder, diagnosis, _ in found.values():
        check_files(folder, diagnosis)


BACKLASH = Path(__file__).resolve().parents[2] / "examples/06-backlash"


def of_a_trial(folder):
    # The second of the eight cases, which test_diagnose_replay.py has in all.
    order = ("--plant", "joint", "--split", "single", "--count", "8", "--seed", "100", "--shard", "2/8")
    made = run("trial", "generate", "-o", folder, *order)
    assert made.returncode == 0, made.stderr
    (key,) = [tomllib.loads(p.read_text()) for p in (folder / "keys").iterdir()]
    assert key["effects"] == ["backlash"]
    return folder / "cases" / key["case"]


@pytest.fixture(scope="module", params=["example", pytest.param("trial", marks=pytest.mark.full)])
def sealed(request, tmp_path_factory):
    """Play behind a gear that the model assumes tight: case, files, diagnosis, progress messages."""
    folder = tmp_path_factory.mktemp("sealed")
    case = BACKLASH if request.param == "example" else of_a_trial(folder)
    done = run("diagnose", case, "-o", folder / "found", "--json")
    assert done.returncode == 0, done.stderr
    return case, folder / "found", json.loads(done.stdout), done.stderr


def test_a_sealed_effect_is_named_and_shrinks_the_gap(sealed):
    case, found, diagnosis, told = sealed
    overall = diagnosis["gap"]["overall"]
    print(case.name, overall)
    assert diagnosis["verdict"] == "effects"
    (effect,) = diagnosis["effects"]
    assert effect["id"] == "backlash" and effect["probability"] > 0.9
    assert overall["after"] < overall["tuned"] and overall["after"] < overall["before"]
    # The only effect closes alone what all of them close.
    assert effect["closed_alone"] == pytest.approx(min(1.0, overall["closed"]), abs=1e-12)
    assert len(diagnosis["augmented"]) == 2
    assert all((found / name).exists() for name in diagnosis["augmented"])
    check_files(found, diagnosis)
    # Measured, before and after are laid over each other; play is in the joint, which is lit.
    scene = scene_of(found / "report.html")
    assert scene["layers"] == ["measured", "before", "with the effects"]
    assert [part["name"] for part in scene["parts"] if part["look"] == "lit"] == ["joint"]
    described = fmpy.read_model_description(str(found / diagnosis["augmented"][0]))
    assert described.modelName == "TwoMassJoint.augmented"
    assert case.name in described.description and "backlash" in described.description
    # Tied to its data: sha256sum case.toml *.csv | sha256sum
    assert set(diagnosis["inputs"]["files"]) == {p.name for p in case.iterdir() if p.suffix in (".csv", ".toml")}
    assert len(diagnosis["inputs"]["sha256"]) == 64
    # Progress is in words: no label of the search, no long numbers.
    assert "excess" not in told and "[\"" not in told
    shares = [float(line.split("%")[0]) for line in told.splitlines() if "%  " in line[:8]]
    assert shares and shares == sorted(shares), told


def test_the_example_is_what_its_document_says(sealed):
    """Play is sized, and all of the gap that it makes closed."""
    case, _, diagnosis, _ = sealed
    if case != BACKLASH:
        return
    gap = diagnosis["effects"][0]["parameters"]["backlashGap"]
    assert gap["ci95"][0] < 0.08 < gap["ci95"][1] and abs(gap["value"] - 0.08) < 0.004
    overall = diagnosis["gap"]["overall"]
    assert overall["after"] < 2 * overall["floor"] < overall["tuned"]


def shipped_is_reported(found, diagnosis):
    """Every value that `diagnosis.json` has is the start value of both FMUs, and is in its interval."""
    told = dict(diagnosis["parameters"])
    for effect in diagnosis["effects"]:
        told |= effect["parameters"]
    assert len(told) > 1
    for file in diagnosis["augmented"]:
        start = {v.name: v.start for v in fmpy.read_model_description(str(found / file)).modelVariables}
        for name, amount in told.items():
            low, high = amount["ci95"]
            value = float(start[name])
            print(f"{file} {name}: {value}, reported {amount['value']} [{low}, {high}]")
            assert value == pytest.approx(amount["value"], rel=1e-12)
            assert (low is None or low <= value) and (high is None or value <= high)


def test_what_is_shipped_is_what_is_reported(sealed):
    _, found, diagnosis, _ = sealed
    shipped_is_reported(found, diagnosis)
    for gap in (diagnosis["gap"]["overall"], *diagnosis["gap"]["channels"].values()):
        window = gap["window"]
        assert set(window) == {"seconds", "before", "tuned", "after", "floor", "closed"}
        assert 0 < window["after"] < window["tuned"] < window["before"]
    page = (found / "report.html").read_text()
    assert "Over windows" in page and "begins again every" in page


def test_yours_and_found_are_in_the_report(sealed):
    """The user's values, the change in percent and in standard deviations of them, both sides of the gear, correlations."""
    case, found, diagnosis, _ = sealed
    said = tomllib.loads((case / "case.toml").read_text())
    ratio = said["parameters"]["gearRatio"]
    for name, amount in diagnosis["parameters"].items():
        assert amount["nominal"] == said["parameters"][name]
        doubt = said["uncertain"].get(name)
        assert amount.get("nominal_deviation") == (pytest.approx(doubt * abs(amount["nominal"])) if doubt else None)
    stiffness = diagnosis["parameters"]["stiffness"]
    assert stiffness["sides"]["load"] == pytest.approx(stiffness["value"] * ratio**2)
    gap = diagnosis["effects"][0]["parameters"]["backlashGap"]
    assert "nominal" not in gap and gap["sides"]["load"] == pytest.approx(gap["value"] / ratio)
    correlation = diagnosis["correlation"]
    assert "stiffness" in correlation["names"] and any(n.startswith("backlashGap") for n in correlation["names"])
    for i, row in enumerate(correlation["matrix"]):
        assert row[i] == 1 and all(abs(x) <= 1 for x in row)
        assert row == [other[i] for other in correlation["matrix"]]
    page = html.unescape((found / "report.html").read_text()).replace("\u00a0", " ")
    change = 100 * (stiffness["value"] / stiffness["nominal"] - 1)
    digits = 0 if abs(change) >= 100 else 1 if abs(change) >= 10 else 2
    assert f">{change:+.{digits}f}<" in page and "in standard deviations of yours" in page and "seen from the load" in page


def test_rms_and_twist_are_those_of_the_recordings(sealed):
    _, _, diagnosis, _ = sealed
    for name, gap in diagnosis["gap"]["channels"].items():
        # The gap is the RMS over one figure of the recording.
        rms = gap["rms"]
        assert rms["unit"] == "rad" and rms["before"] > rms["after"] > 0, name
        for stage in ("tuned", "after", "floor"):
            assert rms[stage] / rms["before"] == pytest.approx(gap[stage] / gap["before"], rel=1e-9)
    twist = diagnosis["gap"]["derived"]["twist"]
    assert twist["after"] < 0.5 * twist["before"], "play shows in the twist"


def test_the_budget_is_made_by_taking_parts_out(sealed):
    """Shares are the whole, in proportion to what the complete model misses without a part; a claimed effect has one."""
    _, _, diagnosis, _ = sealed
    overall, parts = diagnosis["gap"]["overall"], {part["part"]: part for part in diagnosis["budget"]}
    print({name: (part.get("gap_without"), part["share"]) for name, part in parts.items()})
    assert sum(part["share"] for part in parts.values()) == pytest.approx(1)
    own = [parts["backlash"], parts["parameters"]]
    assert all(part["gap_without"] > overall["after"] for part in own)
    added = [part["gap_without"] ** 2 - overall["after"] ** 2 for part in own]
    assert own[0]["share"] / own[1]["share"] == pytest.approx(added[0] / added[1], rel=1e-9)
    # Without the effect the model misses many times what it misses with it.
    assert own[0]["gap_without"] > 4 * overall["after"] and own[0]["share"] > 0.05


def commands(page, begin):
    """Commands of a page that begin so."""
    found = (html.unescape(code) for code in re.findall(r"<code>(.*?)</code>", page, re.S))
    return [command for command in found if command.startswith(begin)]


def test_printed_commands_run_as_printed(sealed, tmp_path):
    """In the folder of the page. The replay has the gap of the report."""
    case, found, diagnosis, _ = sealed
    page = (found / "report.html").read_text()
    folder = shutil.copytree(found, tmp_path / "found")
    path = f"{Path(program()).parent}{os.pathsep}{os.environ['PATH']}"
    (look,), (simulate,), (pack,) = (commands(page, f"trueup {begin}") for begin in ("fmu info", "simulate", "fmu pack Two"))
    for command in (look, simulate, pack, "trueup fmu pack --from diagnosis.json -o again"):
        done = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, env={**os.environ, "PATH": path})
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert {"TwoMassJoint+backlash.fmi2.fmu", "TwoMassJoint+backlash.fmi3.fmu"} <= {p.name for p in folder.iterdir()}
    assert sorted(p.name for p in (folder / "again").iterdir()) == sorted(diagnosis["augmented"])
    recording = re.search(r"<figcaption>twist, (\S+?\.csv):", page).group(1)
    table = lambda file: np.genfromtxt(file, delimiter=",", names=True)
    measured, replayed = table(case / recording), table(folder / "run.csv")
    for channel, gap in diagnosis["gap"]["channels"].items():
        inside = measured["time"] <= replayed["time"][-1]
        shown = np.interp(measured["time"], replayed["time"], replayed[channel])
        missed = np.std((shown - measured[channel])[inside]) / np.std(measured[channel])
        print(channel, missed, gap["after"])
        assert missed < 2 * gap["after"] + gap["floor"]


def pasted(case, found, folder):
    """A copy of the case with the lines of the page in place of the user's."""
    shutil.copytree(case, folder)
    blocks = [html.unescape(b) for b in re.findall(r'<pre class="paste"><code>(.*?)</code>', (found / "report.html").read_text(), re.S)]
    values = next(b for b in blocks if not b.startswith(("[", "trueup")))
    before, _, rest = (folder / "case.toml").read_text().partition("[parameters]\n")
    own, bracket, behind = rest.partition("\n[")
    named = {line.split(" = ")[0] for line in values.splitlines()}
    kept = [line for line in own.splitlines() if line.split("=")[0].strip() not in named]
    text = "\n".join([before + "[parameters]", *kept, values]) + bracket + behind
    effects = [b for b in blocks if b.startswith("[effects]")]
    (folder / "case.toml").write_text(text + "\n" + "\n".join(effects) + "\n")
    return folder


def test_pasted_lines_are_a_case(sealed, full, tmp_path):
    case, found, diagnosis, _ = sealed
    folder = pasted(case, found, tmp_path / "pasted")
    said = tomllib.loads((folder / "case.toml").read_text())
    gap = diagnosis["effects"][0]["parameters"]["backlashGap"]
    assert said["effects"]["backlash"]["backlashGap"] == gap["value"]
    assert said["parameters"]["stiffness"] == diagnosis["parameters"]["stiffness"]["value"]
    checked = run("check", folder, "--json")
    assert checked.returncode == 0, checked.stdout
    assert not [f for f in json.loads(checked.stdout)["findings"] if f["severity"] == "grave"]
    if full:
        again = run("diagnose", folder, "-o", tmp_path / "again", "--json", "--verdict-only")
        assert json.loads(again.stdout)["verdict"] == "no-gap", again.stdout


@pytest.mark.parametrize("version", [2, 3])
def test_fmpy_plays_the_augmented_fmu_with_the_gap_of_the_report(sealed, version):
    """The short one of test_diagnose_replay.py: first states as reported, not estimated again."""
    case, found, diagnosis, _ = sealed
    replay_from_first_states_told("joint", case, found, diagnosis, version)


@pytest.mark.full
def test_a_cause_that_hides_behind_another(tmp_path):
    """Of a late encoder and a little gravity the equations of motion see the first only; the residual of the free run shows the second."""
    made = run("trial", "generate", "-o", tmp_path, "--plant", "joint", "--split", "pairs", "--count", "3", "--seed", "100")
    assert made.returncode == 0, made.stderr
    keys = [tomllib.loads(p.read_text()) for p in (tmp_path / "keys").iterdir()]
    (key,) = [k for k in keys if sorted(k["effects"]) == ["gravity-torque", "sensor-delay"]]
    done = run("diagnose", tmp_path / "cases" / key["case"], "-o", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    diagnosis = json.loads(done.stdout)
    overall = diagnosis["gap"]["overall"]
    print(key["case"], [(e["id"], e["component"]) for e in diagnosis["effects"]], overall)
    assert diagnosis["verdict"] == "effects"
    assert {(e["id"], e["component"]) for e in diagnosis["effects"]} == set(zip(key["effects"], key["components"]))
    assert overall["after"] < 2 * overall["floor"] < overall["before"]


@pytest.mark.full
def test_an_effect_of_one_joint_of_an_arm_is_packed_there(tmp_path):
    """Play in joint 1 of a manipulator: its FMUs have it there and in no other joint."""
    made = run("trial", "generate", "-o", tmp_path, "--plant", "manipulator", "--split", "single", "--count", "3", "--seed", "100")
    assert made.returncode == 0, made.stderr
    keys = [tomllib.loads(p.read_text()) for p in (tmp_path / "keys").iterdir()]
    (key,) = [k for k in keys if k["effects"] == ["backlash"]]
    done = run("diagnose", tmp_path / "cases" / key["case"], "-o", tmp_path / "found", "--json")
    assert done.returncode == 0, done.stderr
    diagnosis = json.loads(done.stdout)
    (effect,) = diagnosis["effects"]
    assert (effect["id"], effect["joint"]) == ("backlash", key["joints"][0])
    assert len(diagnosis["augmented"]) == 2
    description = fmpy.read_model_description(str(tmp_path / "found" / diagnosis["augmented"][0]))
    gaps = {v.name: float(v.start) for v in description.modelVariables if v.name.startswith("backlashGap")}
    assert gaps.pop(f"backlashGap[{effect['joint']}]") == pytest.approx(effect["parameters"]["backlashGap"]["value"], rel=0.05)
    assert len(gaps) == 2 and all(gap == 0 for gap in gaps.values()), gaps


# Shorter: crates/diagnosis/tests/innovations.rs.
@pytest.mark.full
def test_the_innovations_engine_makes_a_whole_diagnosis(tmp_path, trials):
    keys = {case: tomllib.loads((trials / "keys" / f"{case.name}.toml").read_text()) for case in (trials / "cases").iterdir()}
    joints = [case for case in keys if 'model = "TwoMassJoint"' in (case / "case.toml").read_text()]
    assert any(keys[case]["verdict"] == "no-gap" for case in joints)
    for case in joints:
        out = tmp_path / case.name
        made = run("diagnose", case, "-o", out)
        assert made.returncode == 0, made.stderr
        told = json.loads((out / "diagnosis.json").read_text())
        decided = json.loads((out / "decision.json").read_text())
        assert "innovations" in decided and "instead" not in decided
        assert (out / "report.html").is_file()
        assert (told["augmented"] is not None) == bool(told["effects"])
        if keys[case]["verdict"] == "no-gap":
            assert told["verdict"] == "no-gap" and not told["effects"] and told["unknown"]["probability"] <= 0.05
        for fmu in told["augmented"] or []:
            description = fmpy.read_model_description(str(out / fmu))
            start = {v.name: float(v.start) for v in description.modelVariables if v.type in ("Real", "Float64") and v.start is not None}
            for values in [told["parameters"], told["effects"][0]["parameters"]]:
                assert all(start[n] == pytest.approx(v["value"], rel=1e-9) for n, v in values.items() if n in start)


def test_mistakes(tmp_path):
    wrong = run("diagnose", tmp_path / "nowhere", "-o", tmp_path / "out")
    assert wrong.returncode != 0 and "nowhere" in wrong.stderr and not (tmp_path / "out").exists()


def test_an_output_that_cannot_be_made_is_said_before_the_work(tmp_path, trials):
    (tmp_path / "out").write_text("")
    case = next((trials / "cases").iterdir())
    wrong = run("diagnose", case, "-o", tmp_path / "out")
    assert wrong.returncode == 1 and "it is a file; name another one with --output" in wrong.stderr
    assert "comparing" not in wrong.stderr


def at_most_a_kilobyte():
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))


def test_a_folder_that_takes_no_file_is_said_before_the_work(tmp_path, trials):
    case = next((trials / "cases").iterdir())
    # A process that ignores the signal gets the error that the file is too large, as by a full disk.
    wrong = run("diagnose", case, "-o", tmp_path / "out", preexec_fn=at_most_a_kilobyte, restore_signals=False)
    assert wrong.returncode == 1 and "nothing can be written there: File too large" in wrong.stderr, wrong.stderr
    assert "name another folder with --output" in wrong.stderr
    assert "comparing" not in wrong.stderr and not (tmp_path / "out").exists()


def test_the_verdict_is_said_even_if_it_cannot_be_written(tmp_path, trials):
    case, out = next((trials / "cases").iterdir()), tmp_path / "out"
    command = [program(), "diagnose", str(case), "-o", str(out), "--verdict-only"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        for line in running.stderr:
            if "%" in line:
                break
        out.write_text("in the way")
        said, wrong = running.communicate()
    assert running.returncode == 1 and "it is a file" in wrong, wrong
    assert said.startswith("no gap"), said


@pytest.mark.full
@pytest.mark.parametrize("index", range(1, 25))
def test_what_is_found_of_every_effect_is_shipped(tmp_path, index):
    """Effects of single cases come in turn: the files of each contain what is reported, also where an effect's parameter has the name of one of the plant's."""
    made = run("trial", "generate", "-o", tmp_path, "--plant", "joint", "--split", "single", "--count", 24, "--seed", 88003, "--shard", f"{index}/24")
    assert made.returncode == 0, made.stderr
    (case,) = (tmp_path / "cases").iterdir()
    done = run("diagnose", case, "-o", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    diagnosis = json.loads(done.stdout)
    check_files(tmp_path / "out", diagnosis)
    if diagnosis["verdict"] == "effects":
        shipped_is_reported(tmp_path / "out", diagnosis)
