"""The desk of test_bad_inputs.py: good files, how they are run, and how an outcome is compared with the expected one."""

import os
import random
import subprocess
import zipfile
from pathlib import Path

from conftest import from_environment


SECONDS = 60

ROWS = [(k * 0.05, 0.02 if k > 4 else 0.0, 0.001 * k) for k in range(21)]
CSV = "time,motorCurrent,externalTorque\n" + "".join(f"{t:.2f},{i},{e:.3f}\n" for t, i, e in ROWS)
CASE = (
    'model = "TwoMassJoint"\ntrain = ["run.csv"]\nholdout = ["hold.csv"]\n\n[parameters]\nstiffness = 3.07e-5\ngearRatio = 160\n\n'
    '[uncertain]\nstiffness = 0.1\n\n[fit]\nparameters = ["stiffness"]\n\n[channels.motorAngle]\nnoise = 1e-3\n'
)
SIDECAR = (
    '[columns]\nI = { variable = "motorCurrent", scale = 0.5 }\nangle = { variable = "externalTorque", unit = "N.m" }\n\n'
    '[channels.motorCurrent]\ninterpolation = "linear"\n'
)
SYSTEM = (
    'connections = ["c.motorCurrent -> p.motorCurrent", "p.motorAngle -> c.motorAngle"]\nrecord = ["p.motorAngle"]\n\n'
    '[run]\nstop = 0.2\nstep = 0.01\n\n[components.p]\nfmu = "TwoMassJoint.fmi3.fmu"\nstart = { stiffness = 3.07e-5 }\n\n'
    '[components.c]\nfmu = "JointController.fmi3.fmu"\nstart = { positionReference = 0.1, strategy = "P_PI" }\n'
)
SWEEP = (
    'system = "system.toml"\ndesign = "grid"\n\n[factors]\nk = { variable = "p.stiffness", values = [1e-5, 3e-5] }\n'
    'r = { variable = "c.positionReference", from = 0.1, to = 0.2, points = 2 }\n\n[outputs]\nangle = { variable = "p.motorAngle" }\n'
)
LINK = '<link name="{0}"><inertial><mass value="{1}"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.02"/></inertial></link>\n'
JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/></joint>\n'
)
URDF = (
    '<robot name="arm">\n' + LINK.format("foot", 4) + LINK.format("upper", 3) + LINK.format("fore", 1.5)
    + JOINT.format("shoulder", "foot", "upper") + JOINT.format("elbow", "upper", "fore") + "</robot>\n"
)
ROBOT = (
    'name = "arm"\n[base]\nmass = 100.0\ninertia = [[5.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 7.0]]\n[[body]]\nname = "upper"\n'
    "mass = 2.0\ncenter-of-mass = [0.1, 0.0, 0.0]\ninertia = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]]\n"
    'position = [0.3, 0.0, 0.0]\naxis = [0.0, 0.0, 1.0]\n[[tip]]\nname = "hand"\noffset = [0.4, 0.0, 0.0]\n'
)
SSV = (
    '<?xml version="1.0"?>\n<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
    'name="p">\n<ssv:Parameters>\n<ssv:Parameter name="k"><ssv:Real value="{0}" unit="{1}"/></ssv:Parameter>\n'
    '<ssv:Parameter name="n"><ssv:Real value="160"/></ssv:Parameter>\n</ssv:Parameters>\n</ssv:ParameterSet>\n'
)
SSM = (
    '<?xml version="1.0"?>\n<ssm:ParameterMapping xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" version="1.0">\n'
    "{0}</ssm:ParameterMapping>\n"
)
ENTRY = '<ssm:MappingEntry source="{0}" target="p.{1}"/>\n'
SSD = (
    '<?xml version="1.0"?>\n<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" name="s" version="1.0">\n<ssd:System name="root">\n'
    '<ssd:ParameterBindings><ssd:ParameterBinding source="resources/p.ssv"><ssd:ParameterMapping source="resources/m.ssm"/>'
    '</ssd:ParameterBinding></ssd:ParameterBindings>\n<ssd:Elements>\n<ssd:Component name="p" type="application/x-fmu-sharedlibrary" '
    'source="resources/p.fmu"><ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="q"><ssv:Parameters>'
    '<ssv:Parameter name="initialMotorAngle"><ssv:Real value="0.1"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
    '</ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings></ssd:Component>\n</ssd:Elements>\n</ssd:System>\n<ssd:DefaultExperiment startTime="0" stopTime="0.2"/>\n'
    "</ssd:SystemStructureDescription>\n"
)


TORQUES = [(0.05 * k, (0.1 * k, -0.05 * k, 0.02)) for k in range(5)]
ARM = 'time,"jointTorque[1]","jointTorque[2]","jointTorque[3]"\n' + "".join(f"{t:.2f},{a!r},{b!r},{c!r}\n" for t, (a, b, c) in TORQUES)


class Desk:
    """A folder with the program, the FMUs, and results of what is unchanged."""

    def __init__(self, folder):
        self.folder = folder
        self.bin = from_environment("TRUEUP_BIN")
        self.fmus = Path(from_environment("TRUEUP_FMUS"))
        for name in ("TwoMassJoint", "JointController", "PlanarManipulator"):
            (folder / f"{name}.fmi3.fmu").symlink_to((self.fmus / f"{name}.fmi3.fmu").resolve())
        self.unchanged = {}

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    def clear(self):
        for path in self.folder.iterdir():
            if path.is_dir():
                for inner in path.iterdir():
                    inner.unlink()
                path.rmdir()
            elif not path.is_symlink():
                path.unlink()

    def run(self, *arguments):
        done = subprocess.run([self.bin, *arguments], cwd=self.folder, capture_output=True, text=True, timeout=SECONDS)
        assert "panicked" not in done.stderr, done.stderr
        return done

    def results(self):
        path = self.folder / "out.csv"
        return [[float(x) for x in row.split(",")] for row in path.read_text().splitlines()[1:]]


def driven(name="in.csv"):
    return ["simulate", "TwoMassJoint.fmi3.fmu", "--input", name, "--stop", "1", "--step", "0.05", "-o", "out.csv"]


COMMANDS = {
    "input": driven(),
    "parquet": driven("in.parquet"),
    "arm": ["simulate", "PlanarManipulator.fmi3.fmu", "--input", "arm.csv", "--stop", "0.2", "--step", "0.05", "-o", "out.csv"],
    "lists": ["simulate", "PlanarManipulator.fmi3.fmu", "--input", "arm.parquet", "--stop", "0.2", "--step", "0.05", "-o", "out.csv"],
    "case": ["identify", "case"],
    "system": ["simulate", "system.toml", "-o", "out.csv"],
    "ssp": ["simulate", "system.ssp", "--step", "0.01", "-o", "out.csv"],
    "sweep": ["sweep", "sweep.toml", "--shard", "1/1000"],
    "urdf": ["robot", "arm.urdf"],
    "robot": ["robot", "robot.toml"],
}


MAPPED = (("k", "stiffness"), ("n", "gearRatio"))


def package(desk, values=("3.07e-5", "N.m/rad"), entries=MAPPED, ssd=SSD):
    return archived(desk, SSV.format(*values), SSM.format("".join(ENTRY.format(*e) for e in entries)), ssd)


def archived(desk, ssv, ssm=SSM.format("".join(ENTRY.format(*e) for e in MAPPED)), ssd=SSD):
    """A package with these texts of its parameter set and of its mapping."""
    path = desk.folder / "system.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", ssd)
        archive.writestr("resources/p.ssv", ssv)
        archive.writestr("resources/m.ssm", ssm)
        archive.write(desk.fmus / "TwoMassJoint.fmi3.fmu", "resources/p.fmu")
    return path


def parquet(desk, columns=None, **options):
    import pyarrow as pa
    import pyarrow.parquet as pq

    t, i, e = zip(*[(round(t, 2), i, e) for t, i, e in ROWS], strict=True)
    table = {"time": t, "motorCurrent": i, "externalTorque": [round(x, 3) for x in e], **(columns or {})}
    pq.write_table(pa.table({k: v for k, v in table.items() if v is not None}), desk.folder / "in.parquet", **options)


def good(desk):
    desk.write("in.csv", CSV)
    desk.write("system.toml", SYSTEM)
    desk.write("sweep.toml", SWEEP)
    desk.write("arm.urdf", URDF)
    desk.write("robot.toml", ROBOT)
    desk.write("case/case.toml", CASE)
    for name, factor in (("run", 1.0), ("hold", 0.7)):
        rows = "".join(f"{0.01 * k:.2f},{factor * (k % 7) * 1e-3},{factor * k * k * 1e-3}\n" for k in range(30))
        desk.write(f"case/{name}.csv", "time,motorCurrent,motorAngle\n" + rows)
    desk.write("arm.csv", ARM)
    package(desk)
    parquet(desk)
    lists(desk)


def lists(desk, values=None, times=None):
    import pyarrow as pa
    import pyarrow.parquet as pq

    times = times or [round(t, 2) for t, _ in TORQUES]
    table = pa.table({"time": times, "jointTorque": values or [list(v) for _, v in TORQUES]})
    pq.write_table(table, desk.folder / "arm.parquet", compression="zstd")


# What comes of a change: how it is run, the expected message, whether the results stay, and the exit status.
def refused(command, *words, status=1):
    return command, words, False, status


def same(command):
    return command, (), True, 0


def noted(command, *words, results=True):
    return command, words, results, 0


WAYS = []


def way(function):
    WAYS.append(function)
    return function


def near(a, b):
    return len(a) == len(b) and all(
        len(r) == len(s) and all(abs(x - y) <= 1e-9 * max(1.0, abs(x)) for x, y in zip(r, s, strict=True)) for r, s in zip(a, b, strict=True)
    )


def look(desk, seed, function):
    rng = random.Random(seed)
    desk.clear()
    good(desk)
    command, words, results, status = function(desk, rng)
    done = desk.run(*COMMANDS[command])
    told = f"seed {seed}, {function.__name__} ({command}): status {done.returncode}\n{done.stderr}"
    assert done.returncode == status, told
    for word in words:
        assert word in done.stderr, f"no {word!r}: {told}"
    if status != 0:
        errors = [line for line in done.stderr.splitlines() if line.startswith("error:")]
        assert len(errors) == 1 and not (desk.folder / "out.csv").exists(), told
    else:
        assert "error" not in done.stderr, told
    if results:
        assert near(desk.results(), desk.unchanged[command]), f"other results: {told}"


def tried(desk, ways, count):
    """So many inputs, each way as often as the others, in an order that is drawn."""
    seed = int(os.environ.get("TRUEUP_SEED", "1"))
    rng = random.Random(seed)
    order = ways * (count // len(ways) + 1)
    rng.shuffle(order)
    failures, unchanged = [], desk.unchanged
    for number, function in enumerate(order[:count]):
        # A way may have results of its own to compare with.
        desk.unchanged = dict(unchanged)
        try:
            look(desk, seed * 1_000_003 + number, function)
        except (AssertionError, subprocess.TimeoutExpired) as failure:
            failures.append(str(failure).split("\nassert ")[0])
    print(f"seed {seed}: {count} inputs of {len(ways)} ways, {len(failures)} with another outcome than the expected one")
    assert not failures, "\n\n".join(failures[:20])
