"""Bad inputs through the built program: each ends with status 1 or 2 and one error that names a file and the remedy; never a panic, a
hang, or memory without bound."""

import itertools
import json
import random
import resource
import subprocess

import pytest
from test_identify_mistakes import CASE, HEALTHY, lay

# s of processor time, bytes of address space.
SECONDS, MEMORY = 60, 4 << 30

PARAMETERS = ("motorInertia", "loadInertia", "gearRatio", "torqueConstant", "stiffness", "damping", "coulombFriction", "staticFriction")
# What no parameter can be.
VALUES = ("[0.083]", "[[1, 2]]", "[]", "true", '"much"', "nan", "-inf", "1e300", "2024-01-01", "{ value = 1 }", "0x10")


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))


def case_files():
    """Cases with keys of wrong types and values."""
    for name, value in itertools.product(PARAMETERS, VALUES):
        yield f"{name} = {value}", {"case.toml": f"{CASE}[parameters]\n{name} = {value}\n"}
    for name in ("motorInertia", "loadInertia", "gearRatio"):
        for value in ("0", "-1.0", "-1e20"):
            yield f"{name} = {value}", {"case.toml": f"{CASE}[parameters]\n{name} = {value}\n"}
    for value in (*VALUES, "-0.1"):
        yield f"uncertainty {value}", {"case.toml": f"{CASE}[parameters]\nstiffness = 1.0\n[uncertain]\nstiffness = {value}\n"}
    for key in ("train", "holdout", "rest"):
        for value in ('"run.csv"', "1", "[1]", '[["run.csv"]]', "[true]", '["gone.csv"]', "{ a = 1 }"):
            base = 'model = "TwoMassJoint"\n' if key == "train" else CASE
            yield f"{key} = {value}", {"case.toml": f"{base}{key} = {value}\n"}
    for value in ('["run.csv"]', '"run.csv"', '[["run.csv"]]', "[[]]", "[1]", "[[1, 2]]", "true"):
        yield f"repeats = {value}", {"case.toml": f"{CASE}repeats = {value}\n"}
    for value in ("[]", '"stiffness"', "[1]", '["mass"]', '[["stiffness"]]', "true"):
        yield f"fit {value}", {"case.toml": f"{CASE}[fit]\nparameters = {value}\n"}
    for key, value in itertools.product(("noise", "resolution", "delay"), ("-1e40", "nan", "true", '"1"', "[1]", "1e-200", "1e9")):
        if (key, value) not in (("delay", "1e-200"), ("noise", "1e9"), ("resolution", "1e9")):
            yield f"{key} = {value}", {"case.toml": f"{CASE}[channels.motorAngle]\n{key} = {value}\n"}
    for value in ("1", '"spline"', "true", "[]"):
        yield f"interpolation {value}", {"case.toml": f"{CASE}[channels.motorAngle]\ninterpolation = {value}\n"}
        yield f"offset {value}", {"case.toml": f"{CASE}[channels.motorAngle]\noffset = {value}\n"}
    for value in ("1", "true", "[]", '"ThreeMassJoint"', '""'):
        yield f"model = {value}", {"case.toml": f'model = {value}\ntrain = ["run.csv"]\n'}
    for text in ("", "=", "[", "a = ", "\x00", "model", '"' * 99, "[[[[", "[parameters]\n[parameters]\n", "x = " + "[" * 500):
        yield f"text {text[:9]!r}", {"case.toml": text}
    for table in ("parameters", "uncertain", "fit", "channels"):
        for value in ("1", '"x"', "[1]"):
            yield f"{table} = {value}", {"case.toml": f"{table} = {value}\n{CASE}"}


def recordings():
    """Recordings with broken rows, clocks and headers."""
    header, *rows = HEALTHY.split()
    draw = random.Random(5)
    for cell in ("oops", "1,5", "--1", "0x10", "1e", "inf", "-inf", "1e999", "1 2", "\xb0"):
        for column in range(4):
            at = draw.randrange(len(rows))
            cells = rows[at].split(",")
            cells[column] = cell
            yield f"{cell} in column {column}", {"run.csv": "\n".join([header, *rows[:at], ",".join(cells), *rows[at + 1 :]])}
    for time in ("", "nan", "-1", "0.00", "1e9", "1e300", "-1e9"):
        yield f"time {time}", {"run.csv": "\n".join([header, *rows[:100], f"{time},0,1,1", *rows[100:]])}
    yield "a jump to 1e9", {"run.csv": "\n".join([header, *rows, "1e9,0,1,1"])}
    for n in range(3):
        yield f"{n} rows", {"run.csv": "\n".join([header, *rows[:n]]) + "\n"}
    for head in ("", "0,1,2,3", "time;motorCurrent;motorAngle;loadAngle", "t,motorCurrent,motorAngle,loadAngle", "time,,motorAngle,loadAngle",
                 "time,motorAngle,motorAngle,loadAngle", "time,motorCurrent", "time,a,b,c", "time,motorCurrent,a,b", "time,a,motorAngle,b"):
        yield f"header {head}", {"run.csv": "\n".join([head, *rows])}
    yield "nothing moves", {"run.csv": "\n".join([header, *(f"{r.split(',')[0]},0,1,1" for r in rows)])}
    yield "all beyond", {"run.csv": "\n".join([header, *(f"{r.split(',')[0]},0,{k}e160,1" for k, r in enumerate(rows))])}


def sidecars():
    """The sidecar of a recording."""
    for value in ("1", "true", "[]", '"nobody"', "{ scale = 0 }", '{ scale = "1" }', "{ scale = 1e300 }", '{ unit = "kg" }', "{ unit = 1 }",
                  "{ factor = 2 }", "{ offset = nan }", "{ variable = 1 }"):
        yield f"column {value}", {"run.toml": f"[columns]\nmotorAngle = {value}\n"}
    for name, value in itertools.product(("gearRatio", "initialMotorAngle"), VALUES):
        yield f"sidecar {name} = {value}", {"run.toml": f"[parameters]\n{name} = {value}\n"}
    for text in ("[", "[colums]\n", "columns = 1\n", "channels = 1\n", "[channels.other]\nnoise = 1\n", "\x00"):
        yield f"sidecar {text!r}", {"run.toml": text}
    yield "two sidecars", {"run.toml": "", "run.csv.toml": ""}
    for text in (b"PAR1", b"PAR1" * 9, b"", b"x" * 1000):
        yield f"parquet {text[:9]}", {"case.toml": CASE.replace("csv", "parquet"), "run.parquet": text}
    for text in (b"MATLAB 5.0", b"", b"\x89HDF\r\n\x1a\n" * 20, b"MATLAB 7.3 " + bytes(600)):
        yield f"mat {text[:12]}", {"case.toml": CASE.replace("csv", "mat"), "run.mat": text}


ALL = [*case_files(), *recordings(), *sidecars()]


def refused(program, folder, files, command):
    for name, content in files.items():
        if isinstance(content, bytes):
            (folder / name).write_bytes(content)
    lay(folder, {n: c for n, c in files.items() if isinstance(c, str)})
    arguments = [program, command, str(folder)]
    arguments += ["--json", "--fast"] if command == "identify" else ["-o", str(folder / "out"), "--verdict-only"]
    done = subprocess.run(arguments, capture_output=True, text=True, errors="replace", preexec_fn=limits)
    said = [line for line in done.stderr.splitlines() if line.startswith(("trueup: ", "error: ", str(folder)))]
    assert done.returncode in (1, 2), (done.returncode, done.stderr[-2000:])
    assert "panicked" not in done.stderr, done.stderr[-2000:]
    assert said and not done.stdout and not (folder / "out").exists(), done.stderr[-2000:]
    # A file or the folder, then what is wrong, then what to do.
    errors = [line for line in said if str(folder) in line and not "left out, so of the preset" in line]
    assert errors and all(";" in line or "write" in line for line in errors), done.stderr[-2000:]


def run_all(trueup_program, tmp_path, chosen):
    failed = []
    for k, (name, files) in enumerate(chosen):
        folder = tmp_path / str(k)
        folder.mkdir()
        try:
            refused(trueup_program, folder, files, ("identify", "diagnose")[k % 2])
        except AssertionError as e:
            failed.append(f"{name}: {e}")
    assert not failed, "\n\n".join(failed)


@pytest.fixture(scope="module")
def program():
    from conftest import from_environment

    return from_environment("TRUEUP_BIN")


def test_some_bad_inputs_are_refused(program, tmp_path):
    run_all(program, tmp_path, ALL[:: len(ALL) // 30])


@pytest.mark.full
def test_300_bad_inputs_are_refused(program, tmp_path):
    assert len(ALL) >= 300, len(ALL)
    run_all(program, tmp_path, ALL)


def test_mends_are_right(trueup, tmp_path):
    """The remedy of a mistake works."""
    lay(tmp_path, {"empty.toml": ""})
    for arguments, parts in (
        (("diagnose", tmp_path / "run.csv", "-o", tmp_path / "out"), ("a recording, no case", 'train = ["run.csv"]')),
        (("identify", tmp_path / "run.csv"), ("a recording, no case", "case.toml")),
        (("identify", tmp_path / "nowhere"), ("nowhere", "a case is a folder")),
        (("statics", tmp_path / "empty.toml"), ("the file is empty", "[[deflection]]")),
    ):
        done = trueup(*arguments)
        assert done.returncode == 1 and all(part in done.stderr for part in parts), done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr


def test_parameters_of_the_preset_are_named_first(trueup, tmp_path):
    lay(tmp_path, {"case.toml": CASE + "[parameters]\nstiffness = 3.07e-5\ngearRatio = 160.0\n"})
    done = trueup("identify", tmp_path, "--json", "--fast", "--method", "ls")
    first = done.stderr.splitlines()[0]
    assert "left out, so of the preset (joint 1 of DELIAN): motorInertia, loadInertia, torqueConstant, damping" in first, done.stderr
    assert "stiffness" not in first and "initial" not in first


def spoiled(folder, spoil):
    """The healthy recording, row by row by `spoil`, which gets and returns time, current, motor angle and load angle; None: no reading."""
    header, *rows = HEALTHY.split()
    made = [spoil(k, list(map(float, row.split(",")))) for k, row in enumerate(rows)]
    cells = (",".join("" if x is None else repr(x) for x in row) for row in made)
    lay(folder, {"run.csv": "\n".join([header, *cells]) + "\n", "case.toml": CASE})


def test_one_wild_reading_of_any_size_is_as_none(trueup, tmp_path):
    def identified(folder, size):
        folder.mkdir()

        def spoil(k, row):
            row[2] = size if k == 77 else row[2]
            return row

        spoiled(folder, spoil)
        done = trueup("identify", folder, "--json", "--fast", "--method", "ls")
        assert done.returncode == 0, done.stderr
        return [p["value"] for p in json.loads(done.stdout)["parameters"].values()], done.stderr

    plain, _ = identified(tmp_path / "plain", None)
    for size in (1e5, 1e10, 1e160):
        values, said = identified(tmp_path / f"{size}", size)
        assert "run.csv: motorAngle at 0.77 s: 1 spike" in said and "left out" in said, said
        assert values == plain


@pytest.mark.full
def test_grave_findings_cap_the_verdict_unless_forced(trueup, tmp_path):
    """A load angle of the opposite sign, in a recording that is not fitted, so that the search for its causes does not take long."""
    made = trueup("trial", "generate", "-o", tmp_path, "--plant", "joint", "--split", "none", "--count", "1", "--seed", "7")
    assert made.returncode == 0, made.stderr
    case = next((tmp_path / "cases").iterdir())
    header, *rows = (case / "train-1.csv").read_text().split()
    at = header.split(",").index("loadAngle")
    turned = (",".join(f"-{x}" if k == at and x else x for k, x in enumerate(row.split(","))) for row in rows)
    (case / "turned.csv").write_text("\n".join([header, *turned]).replace("--", "") + "\n")
    text = (case / "case.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith(("rest", "repeats"))]
    (case / "case.toml").write_text("\n".join([lines[0], 'rest = ["turned.csv"]', *lines[1:]]) + "\n")
    found = {}
    for force in ((), ("--force",)):
        out = tmp_path / f"out{len(force)}"
        done = trueup("diagnose", case, "-o", out, "--verdict-only", *force)
        assert done.returncode == 0, done.stderr
        assert "grave: " in done.stderr and "opposite sign" in done.stderr, done.stderr
        # After a grave finding nothing is searched.
        assert ("looking at every cause" in done.stderr) == bool(force), done.stderr
        found[bool(force)] = json.loads((out / "diagnosis.json").read_text())
    capped, forced = found[False], found[True]
    assert capped["verdict"] == "unknown" and capped["capped"] and not capped["effects"] and capped["augmented"] is None
    first = capped["findings"][0]
    assert (first["severity"], first["file"], first["channel"]) == ("grave", "turned.csv", "motorAngle"), first
    assert "opposite sign" in first["text"]
    assert forced["verdict"] != "unknown" and "capped" not in forced and forced["findings"] == capped["findings"]


@pytest.mark.full
def test_a_current_in_milliamperes_is_no_effect(trueup, tmp_path):
    """In all recordings, so that they agree with each other."""
    made = trueup("trial", "generate", "-o", tmp_path, "--plant", "joint", "--split", "single", "--count", "1", "--seed", "7")
    assert made.returncode == 0, made.stderr
    case = next((tmp_path / "cases").iterdir())
    for file in case.glob("*.csv"):
        header, *rows = file.read_text().split()
        at = header.split(",").index("motorCurrent")
        rows = [",".join(f"{float(x) * 1e3!r}" if k == at and x else x for k, x in enumerate(row.split(","))) for row in rows]
        file.write_text("\n".join([header, *rows]) + "\n")
    done = trueup("diagnose", case, "-o", tmp_path / "out", "--verdict-only")
    assert done.returncode == 0, done.stderr
    assert "grave: case.toml: motorCurrent: it looks as if thousandths were interpreted as units" in done.stderr, done.stderr
    found = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert found["verdict"] == "unknown" and found["capped"] and not found["effects"], found
    assert (found["findings"][0]["kind"], found["findings"][0]["channel"]) == ("input-scale", "motorCurrent")


@pytest.mark.full
def test_a_doubt_of_0_is_a_known_value(tmp_path, trueup):
    """Next to uncertain values of an array, as in linkCenterOfMass = [[0.02, 0], ...]: figures are finite, and those of a case without it."""
    made = trueup("trial", "generate", "-o", tmp_path, "--plant", "manipulator", "--split", "none", "--count", "1", "--seed", "3")
    assert made.returncode == 0, made.stderr
    case = next((tmp_path / "cases").iterdir())
    text = (case / "case.toml").read_text()
    lines = [line for line in text.splitlines() if not line.startswith('"linkCenterOfMass')]
    at = lines.index("[uncertain]") + 1
    lines.insert(at, "linkCenterOfMass = [[0.02, 0], [0.02, 0], [0.02, 0]]")
    (case / "case.toml").write_text("\n".join(lines) + "\n")
    done = trueup("diagnose", case, "-o", tmp_path / "out", "--verdict-only", "--json")
    assert done.returncode == 0, done.stderr
    diagnosis = json.loads(done.stdout)
    assert diagnosis["verdict"] in ("no-gap", "parameters"), diagnosis["verdict"]
    assert diagnosis["gap"]["overall"]["after"] < 1.05 * diagnosis["gap"]["overall"]["floor"], diagnosis["gap"]["overall"]
    assert diagnosis["unknown"]["probability"] < 0.5
