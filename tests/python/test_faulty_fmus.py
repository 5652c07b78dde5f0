"""FMUs that break, drawn by a seed: what x call x moment x FMI version x kind x process. A run of one either gives the right
result, or fails with one message that names the FMU: it never looks like a good run, never ends without a message, never lasts for ever, and
leaves no process behind. `TRUEUP_SEED` repeats a draw; `--full` draws 200."""

import csv
import os
import random
import signal
import subprocess
import time
import zipfile
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("faulty.c")
TRUEUP = os.environ.get("TRUEUP_BIN")
# Wall-clock seconds after which a run counts as one without end: machines are busy.
END = 120

INSTANCE = ["instantiate", "enter", "exit_initialization", "terminate", "free", "get"]
CALLS = {
    "cs": INSTANCE + ["step", "step", "step"],
    "me": INSTANCE
    + ["event_mode", "discrete", "continuous_mode", "completed", "set_time", "set_states", "get_states", "derivatives", "indicators"]
    + ["nominals", "states", "number"],
}
# What happens to the process, in whatever call.
PROCESS = ["_exit", "exit_group", "exit", "quick_exit", "exec", "daemon", "thread_exits", "thread_crashes", "segv", "abort", "trap", "kill"]
HANGS = ["hang", "sleep", "stop", "deaf", "atexit_hangs"]
# What it does to the process around it, and returns.
AROUND = [
    "chdir", "close1", "close2", "closes", "nowhere", "ignores", "defaults", "blocks", "alarm", "atexit_exits", "atexit_crashes",
    "file_size", "files", "memory", "traps", "rounds", "forks", "session_of_its_own", "mask", "environment", "slow", "prints", "prints2",
    "no_text", "escapes", "empty", "thread_aborts", "overflow",
]
HARMLESS = ["child", "session", "long", "null", "many", "warning"]
STATUS = ["discard", "error", "fatal", "status42", "status-1"]
VALUES = {
    "get": ["nan", "inf", "writes", "keeps"], "set_states": ["writes"], "derivatives": ["nan", "inf", "chatter", "noise", "keeps"], "step": ["nan", "pending", "ends", "event", "early", "last_nan", "last_back", "last_far", "ends_nan", "ends_back", "ends_far"],
    "get_states": ["nan", "keeps"], "indicators": ["nan", "chatter", "zero", "keeps"], "discrete": ["again", "past", "now", "next", "often", "nan", "ends"],
    "nominals": ["nan", "zero", "negative"], "states": ["none", "two", "huge"], "number": ["none", "two", "huge"],
}
NO_STATUS = {"free"}

XML = {
    2: """<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="f" guid="g" numberOfEventIndicators="1">
<ModelExchange modelIdentifier="f"/><CoSimulation modelIdentifier="f" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<ScalarVariable name="x" valueReference="0" initial="exact" causality="local" variability="continuous"><Real start="1"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="1" causality="local" variability="continuous"><Real derivative="1"/></ScalarVariable>
<ScalarVariable name="y" valueReference="4" causality="output" variability="continuous"><Real/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="3"/></Outputs><Derivatives><Unknown index="2"/></Derivatives></ModelStructure>
</fmiModelDescription>""",
    3: """<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="f" instantiationToken="g">
<ModelExchange modelIdentifier="f"/><CoSimulation modelIdentifier="f" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
<Float64 name="time" valueReference="9" causality="independent" variability="continuous"/>
<Float64 name="x" valueReference="0" initial="exact" causality="local" variability="continuous" start="1"/>
<Float64 name="der(x)" valueReference="1" causality="local" variability="continuous" derivative="0"/>
<Float64 name="y" valueReference="4" causality="output" variability="continuous"/>
</ModelVariables><ModelStructure><Output valueReference="4"/><ContinuousStateDerivative valueReference="1"/>
<EventIndicator valueReference="0"/></ModelStructure></fmiModelDescription>""",
}


def drawn(dice):
    """One fault: version, kind, isolated, what, call, count. Hangs are drawn with a deadline, so with processes of their own."""
    version, kind = dice.choice([2, 3]), dice.choice(["cs", "me"])
    call = dice.choice(CALLS[kind])
    fitting = PROCESS + AROUND + HANGS + HARMLESS + VALUES.get(call, []) * 3 + ([] if call in NO_STATUS else STATUS)
    what = dice.choice(fitting)
    isolated = what in HANGS + ["pending"] or dice.random() < 0.5
    return version, kind, isolated, what, call, dice.choice([1, 1, 2, 7])


def rows(file):
    number = lambda cell: float(cell) if cell.lstrip("-")[:1].isdigit() else float("nan")  # noqa: E731
    with open(file) as lines:
        return [[number(cell) for cell in row] for row in list(csv.reader(lines))[1:]]


def left(mark):
    """Processes that were started with this mark in their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if mark.encode() in (process / "environ").read_bytes():
                found.append(int(process.name))
        except OSError:
            pass
    return found


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faulty")
    for version in (2, 3):
        library = folder / f"v{version}.so"
        compiler = ["cc", "-O1", f"-DV={version}", "-shared", "-fPIC", SOURCE, "-o", library, "-lm", "-lpthread"]
        try:
            subprocess.run(compiler, check=True, capture_output=True)
        except FileNotFoundError:
            pytest.skip("no C compiler (cc)")
        platform = "linux64" if version == 2 else "x86_64-linux"
        with zipfile.ZipFile(folder / f"faulty{version}.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", XML[version])
            archive.write(library, f"binaries/{platform}/f.so")
    return folder


def run(fmus, folder, fault):
    """What is wrong with how the program ends with this fault; and whether it failed."""
    version, kind, isolated, what, call, count = fault
    folder.mkdir()
    mark = f"TRUEUP_TEST_MARK={folder}"
    environment = {**os.environ, "FAULT": f"{what} {call} {count}", "TRUEUP_TEST_MARK": str(folder)}
    command = [TRUEUP, "simulate", fmus / f"faulty{version}.fmu", "--interface", kind, "--stop", "1", "--step", "0.05", "-o", "r.csv"]
    command += ["--isolate"] if isolated else []
    command += ["--deadline", "2"] if what in HANGS + ["pending"] else []
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=open(folder / "said", "wb"))
    try:
        status = process.wait(END)
    except subprocess.TimeoutExpired:
        process.kill()
        status = None
    said = (folder / "said").read_text(errors="replace")
    time.sleep(0.05)
    wrong = []
    for pid in left(mark):
        wrong.append(f"process {pid} lives on")
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    if status is None:
        wrong.append("no end")
    elif status == 0:
        expected = [[0.05 * k, 2.718281828459045 ** (-0.05 * k)] for k in range(21)]
        if "r.csv: " not in said:
            wrong.append("it reports nothing of the results")
        if "where `faulty" in said and "ended the run" in said:
            expected = [e for e in expected if e[0] <= rows(folder / "r.csv")[-1][0] + 1e-9]
        # Where events are recorded there are more rows than communication points.
        got = {round(row[0], 9): row[1] for row in rows(folder / "r.csv")} if (folder / "r.csv").exists() else {}
        if any(abs(got.get(round(t, 9), 9.0) - x) > 1e-5 for t, x in expected):
            wrong.append("status 0 with another result than that of x' = -x")
    elif status != 1:
        wrong.append(f"status {status}")
    else:
        if f"faulty{version}" not in said:
            wrong.append("the message does not name the FMU")
        if (folder / "r.csv").exists():
            wrong.append("results of a failed run have their name")
    # What the FMU prints itself is not the program's.
    if len(said.replace("error: nothing\n", "")) > 200_000:
        wrong.append(f"{len(said)} characters of messages")
    return wrong, status, said


def draws(request):
    seed = int(os.environ.get("TRUEUP_SEED", random.randrange(1 << 32)))
    return seed, 200 if request.config.getoption("--full") else 6


def tried(fmus, folder, seed, number):
    dice, bad, failed = random.Random(seed), [], 0
    for at in range(number):
        fault = drawn(dice)
        wrong, status, said = run(fmus, folder / str(at), fault)
        failed += status == 1
        if wrong:
            bad.append(f"{fault}: {'; '.join(wrong)}: {said[:300]!r}")
    print(f"seed {seed}: {number} faults, {failed} ended with a message, {len(bad)} wrong")
    return bad


@pytest.mark.skipif(os.uname().sysname != "Linux", reason="processes are watched through /proc")
def test_no_lie_no_silence_no_hang(fmus, tmp_path, request):
    seed, number = draws(request)
    bad = tried(fmus, tmp_path, seed, number)
    assert not bad, f"TRUEUP_SEED={seed}\n" + "\n".join(bad)


# What ended the program without a message, or never ended: always the same ones.
KNOWN = [
    (2, "cs", False, "_exit", "step", 7), (3, "cs", False, "exec", "step", 2), (2, "me", False, "daemon", "derivatives", 7),
    (3, "me", False, "writes", "set_states", 2), (2, "cs", True, "pending", "step", 2), (2, "me", False, "chatter", "derivatives", 1), (3, "me", False, "noise", "derivatives", 1),
    (2, "cs", False, "session", "step", 2), (3, "cs", True, "session", "step", 2), (2, "cs", False, "long", "step", 2),
    (3, "me", True, "atexit_hangs", "derivatives", 1),
    (2, "cs", False, "memory", "enter", 1), (3, "me", False, "file_size", "exit_initialization", 1), (3, "cs", False, "files", "terminate", 1),
    (2, "cs", False, "close2", "instantiate", 1), (3, "me", False, "huge", "states", 1), (3, "me", True, "huge", "number", 1),
    (3, "me", True, "none", "states", 2), (3, "me", False, "two", "states", 1), (3, "me", False, "none", "number", 1),
    (2, "cs", False, "ends_nan", "step", 7), (2, "cs", True, "ends_far", "step", 2), (3, "cs", False, "ends_back", "step", 7), (3, "cs", False, "ends_nan", "step", 2),
    (2, "cs", True, "forks", "instantiate", 1), (3, "cs", True, "forks", "step", 2), (2, "me", True, "forks", "derivatives", 7),
    (2, "cs", False, "keeps", "get", 7), (3, "cs", False, "keeps", "get", 2), (3, "cs", True, "keeps", "get", 7), (2, "cs", True, "keeps", "get", 2),
    (2, "me", True, "keeps", "derivatives", 7), (3, "me", False, "keeps", "derivatives", 1), (3, "me", False, "keeps", "get_states", 2),
    (2, "me", False, "forks", "exit_initialization", 1), (3, "cs", False, "forks", "step", 2),
]


@pytest.mark.parametrize("fault", KNOWN, ids=lambda fault: "-".join(map(str, fault)))
def test_what_once_ended_in_silence(fmus, tmp_path, fault):
    wrong, _, said = run(fmus, tmp_path / "run", fault)
    assert not wrong, f"{wrong}: {said[:300]}"


def test_an_fmu_that_is_had_once_per_process_runs_twice_in_processes_of_their_own(fmus, tmp_path):
    with zipfile.ZipFile(fmus / "faulty2.fmu") as whole, zipfile.ZipFile(tmp_path / "once.fmu", "w") as once:
        for name in whole.namelist():
            flag = b'<CoSimulation canBeInstantiatedOnlyOncePerProcess="true" '
            once.writestr(name, whole.read(name).replace(b"<CoSimulation ", flag))
    system = "[run]\nstop = 1\nstep = 0.5\n[components.left]\nfmu = 'once.fmu'\n[components.right]\nfmu = 'once.fmu'\n"
    (tmp_path / "pair.toml").write_text(system)
    run = lambda *more: subprocess.run([TRUEUP, "simulate", "pair.toml", *more], cwd=tmp_path, capture_output=True, text=True)  # noqa: E731
    refused = run()
    assert refused.returncode == 1 and "once per process" in refused.stderr and "--isolate" in refused.stderr, refused
    done = run("--isolate", "-o", "pair.csv")
    assert done.returncode == 0, done.stderr
    last = rows(tmp_path / "pair.csv")[-1]
    assert last[1:] == pytest.approx([0.36787944117144233] * 2)


@pytest.mark.parametrize("isolated", [False, True])
def test_one_interrupt_ends_what_does_not_come_forward(fmus, tmp_path, isolated):
    """Pending for ever in this process, a hang in one of its own: one SIGINT, then the message."""
    folder = tmp_path / "run"
    folder.mkdir()
    environment = {**os.environ, "FAULT": f"{'hang' if isolated else 'pending'} step 2"}
    command = [TRUEUP, "simulate", fmus / "faulty2.fmu", "--interface", "cs", "--stop", "1", "--step", "0.05", "-o", "r.csv"]
    command += ["--isolate"] * isolated
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    time.sleep(0.7)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=END)[1]
    assert process.returncode == 1 and "faulty2" in said and "interrupted" in said, said
    assert (folder / "r.partial.csv").exists()


@pytest.mark.skipif(os.uname().sysname != "Linux", reason="elsewhere no process waits for the one of the FMU")
@pytest.mark.parametrize("what", ["hang", "stop", "deaf"])
def test_two_interrupts_end_any_fmu(fmus, tmp_path, what):
    """In this process, without a deadline, also where the FMU has stopped it or has it ignore signals."""
    environment = {**os.environ, "FAULT": f"{what} step 2", "TRUEUP_TEST_MARK": str(tmp_path)}
    command = [TRUEUP, "simulate", fmus / "faulty2.fmu", "--interface", "cs", "--stop", "1", "--step", "0.05", "-o", "r.csv"]
    process = subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    for _ in range(2):
        time.sleep(0.7)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
    try:
        process.communicate(timeout=10)
    finally:
        alive = left(str(tmp_path))
        for pid in alive:
            os.kill(pid, signal.SIGKILL)
    assert process.returncode in (1, 130) and not (tmp_path / "r.csv").exists() and not alive
