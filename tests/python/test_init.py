"""From logs with names, units and clocks of their own to a verdict: `trueup init`, `check` and `diagnose`.

The logs are the recordings of examples/06-backlash, written as other people's loggers write them. `pytest -s` prints the seconds.
"""

import csv
import json
import math
import os
import pty
import re
import select
import shutil
import struct
import subprocess
import time

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from conftest import ROOT, from_environment

BEGIN = 1_767_225_600_000_000_000  # 2026-01-01, ns
RUNS = ["train-1", "train-2", "train-3", "holdout-1"]
DEG = 180 / math.pi

JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
ARRAY = """std_msgs/MultiArrayLayout layout
float64[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
"""


def readings(run):
    """Time in s, current in A, angles of motor and load in rad."""
    with open(ROOT / "examples" / "06-backlash" / f"{run}.csv", newline="") as file:
        return [[float(x) for x in row] for row in list(csv.reader(file))[1:]]


def milliseconds_and_degrees(folder):
    for run in RUNS:
        rows = [f"{1e3 * t:.3f},{1e3 * i:.5f},{m * DEG:.5f},{load * DEG:.6f}" for t, i, m, load in readings(run)]
        (folder / f"{run}.csv").write_text("\n".join(["t_ms,current_mA,motor_pos_deg,load_pos_deg", *rows]) + "\n")


def german_table(folder):
    def cell(x):
        return f"{x:.7f}".replace(".", ",")

    for run in RUNS:
        rows = [";".join(map(cell, (t, i, m, 1e3 * load))) for t, i, m, load in readings(run)]
        head = "Time [s];Iq [A];Encoder Motor [rad];Encoder Load [mrad]"
        (folder / f"{run}.csv").write_text("\n".join([head, *rows]) + "\n")


def dates_in_parquet(folder):
    for run in RUNS:
        t, i, m, load = zip(*readings(run), strict=True)
        stamps = pa.array([BEGIN + round(1e9 * x) for x in t], pa.timestamp("ns"))
        table = pa.table({"stamp": stamps, "temperature": [20.0] * len(t), "theta_m": m, "theta_l": load, "i": i})
        pq.write_table(table, folder / f"{run}.parquet")


class Cdr:
    def __init__(self):
        self.data = bytearray([0, 1, 0, 0])

    def put(self, form, *values):
        size = struct.calcsize(form)
        for value in values:
            self.data += bytes(-(len(self.data) - 4) % size) + struct.pack("<" + form, value)
        return self

    def text(self, text):
        self.put("I", len(text) + 1)
        self.data += text.encode() + b"\0"
        return self

    def numbers(self, values):
        return self.put("I", len(values)).put("d", *values)


def mcap(file, topics, messages):
    """`topics`: name, schema, definition; `messages`: topic, time in ns, bytes."""

    def text(value):
        return struct.pack("<I", len(value)) + value.encode()

    def record(kind, content):
        return struct.pack("<BQ", kind, len(content)) + content

    magic = b"\x89MCAP0\r\n"
    out = magic + record(1, text("ros2") + text("test"))
    for k, (topic, schema, definition) in enumerate(topics, 1):
        out += record(3, struct.pack("<H", k) + text(schema) + text("ros2msg") + text(definition))
        out += record(4, struct.pack("<HH", k, k) + text(topic) + text("cdr") + struct.pack("<I", 0))
    for k, (topic, at, data) in enumerate(messages):
        out += record(5, struct.pack("<HIQQ", topic, k, at, at) + bytes(data))
    out += record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic
    file.write_bytes(out)


def ros_bag(folder):
    topics = [("/joint_states", "sensor_msgs/msg/JointState", JOINT_STATE), ("/motor_current", "std_msgs/msg/Float64MultiArray", ARRAY)]
    for run in RUNS:
        messages = []
        for t, i, m, load in readings(run):
            at = BEGIN + round(1e9 * t)
            state = Cdr().put("i", at // 10**9).put("I", at % 10**9).text("").put("I", 2).text("load_link").text("motor")
            messages.append((1, at, state.numbers([load, m]).numbers([]).numbers([]).data))
            messages.append((2, at, Cdr().put("I", 0).put("I", 0).numbers([i]).data))
        mcap(folder / f"{run}.mcap", topics, messages)


def lerobot(folder):
    names = {"observation.state": {"names": ["motor_pos", "load_pos"]}, "action": {"names": {"motors": ["motor_current_A"]}}}
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0", "features": names}))
    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    tables = []
    for k, run in enumerate(RUNS):
        t, i, m, load = zip(*readings(run), strict=True)
        n = len(t)
        tables.append(
            pa.table(
                {
                    "observation.state": pa.array([[a, b] for a, b in zip(m, load, strict=True)], pa.list_(pa.float64(), 2)),
                    "action": pa.array([[x] for x in i], pa.list_(pa.float64(), 1)),
                    "timestamp": pa.array(t, pa.float32()),
                    "frame_index": pa.array(range(n), pa.int64()),
                    "episode_index": pa.array([k] * n, pa.int64()),
                    "index": pa.array(range(n), pa.int64()),
                    "task_index": pa.array([0] * n, pa.int64()),
                }
            )
        )
    # Two episodes in one file, two in files of their own.
    pq.write_table(pa.concat_tables(tables[:2]), data / "file-000.parquet")
    pq.write_table(tables[2], data / "file-001.parquet")
    pq.write_table(tables[3], data / "file-002.parquet")


LOGS = [milliseconds_and_degrees, german_table, dates_in_parquet, ros_bag, lerobot]


def trueup(*arguments):
    began = time.monotonic()
    command = [from_environment("TRUEUP_BIN"), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, env={**os.environ, "NO_COLOR": "1"})
    print(f"{time.monotonic() - began:8.2f} s  trueup {' '.join(map(str, arguments[:2]))}")
    return done


def drafted(logs, folder):
    """The case that `init` writes, with what logs do not contain: the parameters and the sensors' data of the example."""
    folder.mkdir()
    logs(folder)
    done = trueup("init", folder, "--model", "TwoMassJoint")
    assert done.returncode == 0, done.stderr
    (case,) = folder.rglob("case.toml")
    example = (ROOT / "examples" / "06-backlash" / "case.toml").read_text()
    known = example[example.index("[parameters]") :]
    text = case.read_text()
    case.write_text(re.split(r"^\[channels|^\[parameters", text, flags=re.M)[0] + known)
    return case, text


@pytest.mark.parametrize("logs", LOGS, ids=lambda f: f.__name__)
def test_a_log_becomes_a_case_that_can_be_diagnosed(logs, tmp_path):
    case, text = drafted(logs, tmp_path / "logs")
    variables = re.findall(r'^".*?" = (?:\{ variable = )?"(\w+)"', text, re.M)
    assert sorted(v for v in variables if v != "time") == ["loadAngle", "motorAngle", "motorCurrent"], text
    assert "TODO" not in text
    done = trueup("check", case, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [f for f in found["findings"] if f["severity"] == "grave"] == []
    # Each reading is what the example has.
    example = json.loads(trueup("check", ROOT / "examples" / "06-backlash", "--json").stdout)

    def ranges(check):
        channels = [c for r in check["recordings"] for c in r["channels"]]
        return sorted((c["name"], c["readings"], *c["range"]) for c in channels)

    assert len(found["recordings"]) == 4
    for a, b in zip(ranges(found), ranges(example), strict=True):
        assert a[:2] == b[:2]
        assert a[2:] == pytest.approx(b[2:], rel=1e-4, abs=1e-6), (a, b)
    stiffness = next(p for p in found["parameters"] if p["name"] == "stiffness")
    assert 0 < stiffness["standard_error"] < 0.1 * stiffness["value"]


@pytest.mark.full
@pytest.mark.parametrize("logs", LOGS, ids=lambda f: f.__name__)
def test_its_diagnosis_names_the_play(logs, tmp_path):
    case, _ = drafted(logs, tmp_path / "logs")
    done = trueup("diagnose", case, "-o", tmp_path / "found", "--verdict-only")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "found" / "diagnosis.json").read_text())
    assert (found["verdict"], [e["id"] for e in found["effects"]]) == ("effects", ["backlash"])


def test_a_case_that_is_there_stays(tmp_path):
    milliseconds_and_degrees(tmp_path)
    (tmp_path / "case.toml").write_text("mine")
    done = trueup("init", tmp_path)
    assert done.returncode == 1 and "case.toml" in done.stderr and "stays as it is" in done.stderr
    assert (tmp_path / "case.toml").read_text() == "mine"
    assert 'model = "TwoMassJoint"' in trueup("init", tmp_path, "--print").stdout


def one_error(done, *parts):
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    assert done.returncode == 1 and len(lines) == 1, done.stderr
    assert all(part in lines[0] for part in parts), lines[0]


def test_bad_logs_are_one_error_each(tmp_path):
    def folder(name, logs=milliseconds_and_degrees):
        made = tmp_path / name
        made.mkdir()
        logs(made)
        return made

    words = folder("words")
    lines = (words / "train-1.csv").read_text().splitlines()
    lines[100] = lines[100].split(",")[0] + ",0.5,overrange,0.1"
    (words / "train-1.csv").write_text("\n".join(lines))
    one_error(trueup("init", words / "train-1.csv"), "train-1.csv:101", "overrange")

    clocks = folder("clocks")
    rows = [f"{t},{t * (1 + 0.1 * t)},{i},{m}" for t, i, m, _ in readings("train-1")]
    (clocks / "run.csv").write_text("\n".join(["t,timestamp,i_A,motor_rad", *rows]))
    one_error(trueup("init", clocks / "run.csv"), "run.csv", "two clocks", "`t`", "`timestamp`", "--time")
    assert trueup("init", clocks / "run.csv", "--time", "t").returncode == 0

    cut = folder("cut", ros_bag)
    whole = (cut / "train-1.mcap").read_bytes()
    (cut / "train-1.mcap").write_bytes(whole[: len(whole) // 2])
    one_error(trueup("init", cut), "train-1.mcap", "truncated")
    assert not (cut / "case.toml").exists()

    empty = folder("empty", lerobot)
    for file in empty.rglob("*.parquet"):
        file.unlink()
    one_error(trueup("init", empty), str(empty), "LeRobot", ".parquet")

    back = folder("back")
    lines = (back / "train-1.csv").read_text().splitlines()
    lines[7] = "1.0" + lines[7][lines[7].index(",") :]
    (back / "train-1.csv").write_text("\n".join(lines))
    one_error(trueup("init", back / "train-1.csv"), "train-1.csv:8", "t_ms", "jumps back")

    one_error(trueup("init", tmp_path / "nowhere.csv"), "nowhere.csv", "no such file")


def test_check_stops_before_what_is_wrong(tmp_path):
    case, _ = drafted(milliseconds_and_degrees, tmp_path / "logs")
    text = (case.parent / "train-2.csv").read_text().splitlines()
    rows = [line.split(",") for line in text[1:]]
    swapped = [",".join([t, str(-float(i)), m, load]) for t, i, m, load in rows]
    (case.parent / "train-2.csv").write_text("\n".join([text[0], *swapped]))
    done = trueup("check", case, "--plot", tmp_path / "check.html")
    assert done.returncode == 0, done.stderr
    grave = [line for line in done.stdout.splitlines() if line.startswith("grave: ")]
    assert len(grave) == 1 and "train-2.csv" in grave[0] and "motorCurrent" in grave[0] and "opposite sign" in grave[0]
    page = (tmp_path / "check.html").read_text()
    assert "opposite sign" in page and page.count("<svg") >= 12


def answered(program, answers, *arguments):
    """The program in a terminal of its own, and what it wrote there; each question that ends so gets its answer."""
    ours, theirs = pty.openpty()
    done = subprocess.Popen([program, *map(str, arguments)], stdin=theirs, stdout=subprocess.PIPE, stderr=theirs, text=True)
    os.close(theirs)
    shown = ""
    for question, answer in answers:
        while not shown.rstrip().endswith(question):
            assert select.select([ours], [], [], 20)[0], f"no question {question!r} in {shown!r}"
            shown += os.read(ours, 4096).decode()
        os.write(ours, f"{answer}\n".encode())
        shown += "\n"
    out, _ = done.communicate(timeout=20)
    while select.select([ours], [], [], 0)[0]:
        try:
            shown += os.read(ours, 4096).decode()
        except OSError:
            break
    os.close(ours)
    return done.returncode, out, shown


def test_in_a_terminal_it_asks(trueup, tmp_path):
    """For the model, and for the column of an input that was not recognised; what is answered is no guess."""
    rows = [f"{t},{i},{m},{load}" for t, i, m, load in readings("train-1")]
    (tmp_path / "a.csv").write_text("\n".join(["time,u,motorAngle,loadAngle", *rows]) + "\n")
    answers = [("[TwoMassJoint]:", ""), ("Enter)?", "u"), ("Enter)?", "")]
    status, out, shown = answered(trueup.program, answers[:2], "init", tmp_path / "a.csv", "--print")
    assert status == 0, shown
    assert "Which column is motorCurrent" in shown and "u, motorAngle, loadAngle" in shown
    assert '"u" = "motorCurrent"' in out and "TODO" not in out
    # An answer that is no model is a wrong use; nothing is written.
    status, out, shown = answered(trueup.program, [("[TwoMassJoint]:", "TwoMasJoint")], "init", tmp_path / "a.csv")
    assert status == 2 and "TwoMassJoint" in shown and not (tmp_path / "case.toml").exists()


def test_readings_of_several_joints_propose_the_arm(trueup, tmp_path):
    names = ["positionReference[1]", "positionReference[2]", "jointAngle[1]", "jointAngle[2]"]
    rows = [",".join([f"{0.01 * k:.2f}", *(f"{math.sin(0.05 * k + j):.5f}" for j in range(4))]) for k in range(400)]
    (tmp_path / "run.csv").write_text("\n".join([",".join(["time", *names]), *rows]) + "\n")
    done = trueup("init", tmp_path / "run.csv", "--print")
    assert done.returncode == 0, done.stderr
    first = next(line for line in done.stdout.splitlines() if line.startswith("model"))
    assert first.startswith('model = "PlanarManipulator"') and "GUESS" in first
    assert "TwoMassJoint" not in done.stdout and '"jointAngle[2]" = "motorAngle"' not in done.stdout
    assert "position-servo" in done.stdout


def test_check_prints_the_gain_of_each_input(trueup, tmp_path):
    for run in RUNS:
        scale = 1e3 if run == "train-2" else 1.0
        rows = [f"{t},{scale * i},{m},{load}" for t, i, m, load in readings(run)]
        (tmp_path / f"{run}.csv").write_text("\n".join(["time,motorCurrent,motorAngle,loadAngle", *rows]) + "\n")
    shutil.copy(ROOT / "examples" / "06-backlash" / "case.toml", tmp_path)
    checked = trueup("check", tmp_path, "--json")
    assert checked.returncode == 0, checked.stdout
    gains = {g["recording"]: g["gain"] for g in json.loads(checked.stdout)["gains"] if g["input"] == "motorCurrent"}
    assert set(gains) == {f"{run}.csv" for run in RUNS}
    usual = gains["train-1.csv"]
    assert abs(gains["train-2.csv"] * 1e3 / usual - 1) < 0.5, gains
    text = trueup("check", tmp_path).stdout
    assert "Gain of each input" in text and re.search(r"motorCurrent +train-2\.csv", text)
    # A draft has the parameters of the preset: that comes before what is computed with them.
    draft = tmp_path / "draft"
    draft.mkdir()
    shutil.copy(tmp_path / "train-1.csv", draft)
    assert trueup("init", draft / "train-1.csv").returncode == 0
    text = trueup("check", draft).stdout
    preset = text.index("left out, so of the preset")
    assert preset < text.index("Gain of each input"), text
    grave = text.find("grave: ")
    assert grave < 0 or preset < grave, text
