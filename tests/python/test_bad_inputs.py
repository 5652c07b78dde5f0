"""Files as people write them: good ones, changed in a way that is drawn. Each way has its expected outcome:

- refused: exit status 1, one error that names the file (and the line, or the name at fault), nothing under the name of the results;
- the same: exit status 0 and the same results as of the unchanged file;
- noted: exit status 0, the same results unless noted otherwise, and a note that names what is not used or was chosen.

Whatever is drawn: no panic, no silence, no hang. The seed is printed; TRUEUP_SEED chooses another one.
"""

import os
import random
import subprocess
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT, from_environment

FEW, ALL = 40, 300
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


def csv_lines(rng):
    lines = CSV.splitlines()
    row = rng.randrange(2, len(lines))
    return lines, row, lines[row].split(",")


def csv_put(desk, lines, row, cells):
    lines[row] = ",".join(cells)
    desk.write("in.csv", "\n".join(lines) + "\n")
    return f"in.csv: line {row + 1}", f":{row + 1}:"


@way
def a_word_among_numbers(desk, rng):
    lines, row, cells = csv_lines(rng)
    column = rng.randrange(0, 3)
    cells[column] = rng.choice(["oops", "1.2.3", "--5", "12a", "0x1F", "one"])
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", str(row + 1), cells[column])


@way
def a_row_of_another_length(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells = cells[:-1] if rng.random() < 0.5 else [*cells, "7"]
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f":{row + 1}:", f"{len(cells)} cells under 3 names")


@way
def time_that_falls(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells[0] = str(float(cells[0]) - rng.uniform(0.06, 0.5))
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f":{row + 1}:", "jumps back")


@way
def a_time_three_times(desk, rng):
    lines, row, _ = csv_lines(rng)
    lines[row:row] = [lines[row], lines[row]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return refused("input", "in.csv", f":{row + 2}:", "3 rows share it", "rate = N")


@way
def a_value_that_is_infinite(desk, rng):
    lines, row, cells = csv_lines(rng)
    cells[rng.randrange(1, 3)] = rng.choice(["inf", "-inf", "1e999"])
    csv_put(desk, lines, row, cells)
    return refused("input", "in.csv", f"line {row + 1}", "infinite")


@way
def a_name_twice(desk, rng):
    desk.write("in.csv", CSV.replace("externalTorque", "motorCurrent"))
    return refused("input", "in.csv", ":1:", "`motorCurrent`")


@way
def a_name_misspelled(desk, rng):
    name = rng.choice(["motorCurrent", "externalTorque"])
    at = rng.randrange(1, len(name) - 1)
    wrong = name[:at] + name[at + 1] + name[at] + name[at + 2:]
    if wrong == name:
        wrong = name + "x"
    desk.write("in.csv", CSV.replace(name, wrong))
    return refused("input", "in.csv", f"`{wrong}`", f"did you mean `{name}`?")


@way
def nothing_in_it(desk, rng):
    desk.write("in.csv", rng.choice(["", CSV.splitlines()[0] + "\n"]))
    return refused("input", "in.csv", "export")


@way
def no_text(desk, rng):
    at = rng.randrange(0, 20)
    desk.write("in.csv", CSV.encode()[:at] + b"\0" + CSV.encode()[at:])
    return refused("input", "in.csv", "zero bytes")


@way
def no_time(desk, rng):
    desk.write("in.csv", CSV.replace("time", rng.choice(["t", "Time", "zeit"])))
    return refused("input", "in.csv", "no column `time`")


@way
def other_separators(desk, rng):
    separator = rng.choice([";", "\t", "|"])
    text = CSV.replace(",", separator)
    if rng.random() < 0.5:
        text = text.replace(".", ",")
    desk.write("in.csv", text)
    return noted("input", "in.csv", "separated by")


@way
def other_line_ends_and_quotes(desk, rng):
    text = CSV
    if rng.random() < 0.5:
        head, rest = text.split("\n", 1)
        text = ",".join(f'"{name}"' for name in head.split(",")) + "\n" + rest
    if rng.random() < 0.5:
        text = text.replace("\n", "\r\n")
    if rng.random() < 0.5:
        text = "\ufeff" + text
    desk.write("in.csv", text)
    return same("input")


@way
def units_in_the_head(desk, rng):
    factor, unit = rng.choice([(1e3, "mA"), (1e6, "uA")])
    rows = "".join(f"{t * 1e3:.0f},{i * factor},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", f"time [ms],motorCurrent ({unit}),externalTorque\n" + rows)
    return noted("input", "`motorCurrent`", f"{unit} converted to A")


@way
def a_unit_of_something_else(desk, rng):
    unit = rng.choice(["V", "rad", "N.m", "kg"])
    desk.write("in.csv", CSV.replace("motorCurrent", f"motorCurrent [{unit}]"))
    return refused("input", "in.csv", "`motorCurrent`", unit)


@way
def columns_that_drive_nothing(desk, rng):
    name, why = rng.choice([("motorAngle", "an output"), ("transmissionTorque", "an output"), ("initialMotorAngle", "fixed")])
    lines = CSV.splitlines()
    lines = [f"{lines[0]},{name}"] + [f"{line},7" for line in lines[1:]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return noted("input", "in.csv", "drive nothing", f"`{name}`", why)


@way
def a_tunable_parameter_as_it_is(desk, rng):
    lines = CSV.splitlines()
    lines = [f"{lines[0]},stiffness"] + [f"{line},3.07e-5" for line in lines[1:]]
    desk.write("in.csv", "\n".join(lines) + "\n")
    return same("input")


@way
def a_clock_of_the_calendar(desk, rng):
    start = rng.randrange(1_000_000_000, 2_000_000_000)
    digits = rng.choice([0, 3, 6, 9])
    rows = "".join(f"{int(round((start + t) * 100)) * 10**(digits - 2) if digits else f'{start + t:.2f}'},{i},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", "time,motorCurrent,externalTorque\n" + rows)
    return noted("input", "in.csv", "Unix time", "from the first row")


@way
def a_clock_of_milliseconds(desk, rng):
    rows = "".join(f"{t * 1e3:.0f},{i},{e:.3f}\n" for t, i, e in ROWS)
    desk.write("in.csv", "time,motorCurrent,externalTorque\n" + rows)
    return noted("input", "in.csv", "1000 s", "run ends at 1 s", 'unit = "ms"', results=False)


@way
def inputs_that_end_early(desk, rng):
    keep = rng.randrange(4, 18)
    desk.write("in.csv", "\n".join(CSV.splitlines()[: keep + 1]) + "\n")
    return noted("input", "in.csv", "held from there on", results=False)


@way
def a_sidecar_that_fits(desk, rng):
    lines = CSV.splitlines()
    rows = [line.split(",") for line in lines[1:]]
    desk.write("in.csv", "time,I,angle\n" + "".join(f"{t},{float(i) * 2},{e}\n" for t, i, e in rows))
    desk.write("in.toml", SIDECAR)
    return same("input")


@way
def a_sidecar_with_a_mistake(desk, rng):
    desk.write("in.csv", CSV.replace("motorCurrent", "I").replace("externalTorque", "angle"))
    old, new, words = rng.choice([
        ("[columns]", "[colums]", ("`colums`", "`columns`")),
        ("I =", "J =", ("no column `J`",)),
        ("scale = 0.5", "scale = 0", ("`scale` is 0",)),
        ("scale = 0.5", 'scale = "x"', ("`scale`",)),
        ('unit = "N.m"', 'unit = "Newtons"', ("`Newtons`",)),
        ("[columns]", "rate = -5\n[columns]", ("`rate` is -5",)),
        ('"linear"', '"cubic"', ("`interpolation`",)),
        ("scale = 0.5 }", "scale = 0.5", ()),
    ])
    desk.write("in.toml", SIDECAR.replace(old, new))
    return refused("input", "in.toml:", *words)


@way
def a_case_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("[parameters]", "[parameter]", ("`parameters`",)),
        ("stiffness = 3.07e-5", "stifness = 3.07e-5", ("`stiffness`",)),
        ('["hold.csv"]', '["gone.csv"]', ("gone.csv",)),
        ("3.07e-5", '"3.07e-5"', ("stiffness",)),
        ('["hold.csv"]', '["run.csv"]', ("`run.csv`", "holdout")),
        ("TwoMassJoint", "TwoMasJoint", ("TwoMassJoint",)),
        ("noise = 1e-3", "noise = -1", ("`noise` is -1",)),
        ("motorAngle]", "motorAngel]", ("`motorAngle`",)),
        ("gearRatio = 160", "gearRatio = inf", ("gearRatio",)),
        ("[fit]", "[fit", ("case.toml:",)),
        ("[fit]", "[recordings]\nrate = 0\n[fit]", ("`rate` is 0",)),
        ('train = ["run.csv"]\n', "", ("train",)),
    ])
    desk.write("case/case.toml", CASE.replace(old, new, 1))
    return refused("case", "case", *words)


@way
def a_recording_with_a_mistake(desk, rng):
    path = desk.folder / "case" / "run.csv"
    lines = path.read_text().splitlines()
    row = rng.randrange(3, len(lines))
    cells = lines[row].split(",")
    words, change = rng.choice([
        (("is no number",), lambda: cells.__setitem__(2, "bad")),
        (("jumps back",), lambda: cells.__setitem__(0, "-1")),
        (("cells under 3 names",), lambda: cells.pop()),
        (("an infinite value",), lambda: cells.__setitem__(1, "inf")),
    ])
    change()
    lines[row] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    return refused("case", f"run.csv:{row + 1}:", *words)


@way
def a_system_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("c.motorCurrent ->", "c.motorCurent ->", ("system.toml:1", "`motorCurrent`")),
        ('-> c.motorAngle"', '-> c.motorAngle", "p.loadAngle -> c.motorAngle"', ("system.toml:1", "driven twice")),
        ("stop = 0.2", "stopp = 0.2", ("system.toml:5", "`stop`")),
        ("step = 0.01", 'step = "x"', ("system.toml:6", "`step`")),
        ("stiffness = 3.07e-5", 'stiffness = "x"', ("system.toml:10", "stiffness")),
        ("stiffness = 3.07e-5", "stiffnes = 3.07e-5", ("system.toml:10", "`stiffness`")),
        ("stiffness = 3.07e-5", 'stiffness = { value = 1, unit = "furlong" }', ("system.toml:10", "furlong")),
        ("stiffness = 3.07e-5", 'stiffness = { value = 1, unit = "kg" }', ("system.toml:10", "kg")),
        ('"P_PI"', '"PPI"', ("system.toml:14", "P_PI")),
        ("JointController.fmi3", "JointControler.fmi3", ("system.toml:12", "JointController.fmi3.fmu")),
        ('record = ["p.motorAngle"]', 'record = ["p.motorAngel"]', ("system.toml:2", "motorAngle")),
        ("[components.c]", "[components.c", ("system.toml:12",)),
        ("-> p.motorCurrent", "-> p.motorAngle", ("system.toml:1", "output")),
    ])
    desk.write("system.toml", SYSTEM.replace(old, new, 1))
    return refused("system", *words)


@way
def parameters_in_a_unit_of_everybody(desk, rng):
    value, unit = rng.choice([("3.07e-2", "N.mm/rad"), ("3.07e-3", "N.cm/rad"), ("3.07e-8", "kN.m/rad"), ("30.7", "uN.m/rad")])
    package(desk, (value, unit))
    return same("ssp")


@way
def parameters_in_a_unit_of_nobody(desk, rng):
    unit = rng.choice(["furlong", "N.m/foo", "blob", "kg"])
    package(desk, ("3.07e-5", unit))
    return refused("ssp", "p.ssv:4", unit)


@way
def a_mapping_that_leaves_something_out(desk, rng):
    left = rng.choice(["k", "n"])
    package(desk, entries=[e for e in (("k", "stiffness"), ("n", "gearRatio")) if e[0] != left])
    # What is left out has its start value in the run.
    return noted("ssp", "m.ssm", "left out", left, results=False)


@way
def a_mapping_without_entries(desk, rng):
    package(desk, entries=())
    return noted("ssp", "m.ssm", "left out", "k, n", results=False)


@way
def a_mapping_of_what_is_not_there(desk, rng):
    package(desk, entries=(("k", "stiffness"), ("n", "gearRatio"), (rng.choice(["kk", "K", "q"]), "damping")))
    return noted("ssp", "m.ssm", "does not have")


@way
def a_target_that_is_not_there(desk, rng):
    wrong = rng.choice(["stifness", "k", "spring"])
    package(desk, entries=(("k", wrong), ("n", "gearRatio")))
    return noted("ssp", "left out", wrong, results=False)


@way
def an_archive_that_is_damaged(desk, rng):
    path = package(desk)
    bytes_ = path.read_bytes()
    path.write_bytes(bytes_[: rng.randrange(10, len(bytes_) - 30)])
    return refused("ssp", "system.ssp")


@way
def xml_that_is_none(desk, rng):
    old = rng.choice(["</ssd:Elements>", '<ssd:System name="root">', "</ssd:ParameterBindings>"])
    package(desk, ssd=SSD.replace(old, "", 1))
    return refused("ssp", "SystemStructure.ssd:", "XML")


@way
def a_sweep_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ('"c.positionReference"', '"p.stiffness"', ("sweep.toml:6", "varied by `k` already", "sweep.toml:5")),
        ('"c.positionReference"', '["c.positionReference", "p.stiffness"]', ("sweep.toml:6", "varied by `k` already")),
        ("points = 2", "points = 1", ("sweep.toml:6", "points")),
        ('design = "grid"', 'design = "gird"', ("sweep.toml:2", "grid")),
        ("[outputs]", "[output]", ("sweep.toml", "output")),
        ('"p.stiffness"', '"p.stifness"', ("sweep.toml:5", "stiffness")),
        ('"p.motorAngle"', '"p.motorAngel"', ("sweep.toml:9", "motorAngle")),
        ("[1e-5, 3e-5]", "[]", ("sweep.toml",)),
        ('"system.toml"', '"sytem.toml"', ("sytem.toml",)),
    ])
    desk.write("sweep.toml", SWEEP.replace(old, new, 1))
    return refused("sweep", *words)


@way
def a_urdf_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ('link name="fore"', 'link name="upper"', ("arm.urdf:4", "`upper` is defined in line 3 already")),
        ('joint name="elbow"', 'joint name="shoulder"', ("arm.urdf:6", "`shoulder` is defined in line 5 already")),
        ('<mass value="3"/>', "", ("arm.urdf:3", "<mass>")),
        ('<mass value="3"/>', '<mass value="three"/>', ("arm.urdf:3", "three")),
        ('<mass value="3"/>', '<mass value="0"/>', ("arm.urdf:3", "`upper`", "mass")),
        ('<parent link="upper"/>', '<parent link="uper"/>', ("arm.urdf:6", "`upper`")),
        ('<parent link="foot"/>', '<parent link="fore"/>', ("arm.urdf:5", "loop")),
        ('<origin xyz="0 0 0.4"/>', '<origin xyz="0 0"/>', ("arm.urdf:5", "3 finite")),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', ("arm.urdf", "`upper`", "axis")),
        ('iyy="0.03"', 'iyy="-0.03"', ("arm.urdf", "`base`", "above 0")),
        ('type="revolute"', 'type="planar"', ("arm.urdf:5", "planar")),
        ("</robot>", "", ("arm.urdf",)),
    ])
    desk.write("arm.urdf", URDF.replace(old, new, 1))
    return refused("urdf", *words)


@way
def a_urdf_with_more_than_is_read(desk, rng):
    old, new, words = rng.choice([
        ("<axis", '<limit lower="-1" upper="1" effort="1" velocity="1"/><axis', ("<limit> of 1 joint (shoulder)",)),
        ("<axis", '<calibration rising="0"/><axis', ("<calibration> of 1 joint (shoulder)",)),
        ('izz="0.02"', 'izz="0.9"', ("`base`", "larger than the sum", "used as it is")),
    ])
    desk.write("arm.urdf", URDF.replace(old, new, 1))
    return noted("urdf", "arm.urdf", *words, results=False)


@way
def a_robot_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("position = [0.3", "positions = [0.3", ("robot.toml:10", "positions")),
        ("mass = 2.0", 'mass = "2"', ("robot.toml:7",)),
        ("mass = 2.0", "mass = 0.0", ("robot.toml", "`upper`", "mass")),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 0.0]", ("robot.toml", "`upper`", "axis")),
        ('name = "upper"', 'name = "upper"\nparent = "lower"', ("robot.toml", "`lower`")),
        ('name = "hand"', 'name = "hand"\nbody = "uper"', ("robot.toml", "`upper`")),
        ("[[5.0,", "[[-5.0,", ("robot.toml", "`base`", "above 0")),
        ("[[tip]]", "[[tip]", ("robot.toml",)),
    ])
    desk.write("robot.toml", ROBOT.replace(old, new, 1))
    return refused("robot", *words)


@way
def parquet_of_every_kind(desk, rng):
    parquet(desk, compression=rng.choice(["none", "snappy", "zstd", "gzip"]), use_dictionary=rng.random() < 0.5)
    return same("parquet")


@way
def parquet_with_times_by_their_type(desk, rng):
    import pyarrow as pa

    unit = rng.choice(["ms", "us", "ns"])
    per_second = {"ms": 1_000, "us": 1_000_000, "ns": 1_000_000_000}[unit]
    counts = [round(t * per_second) for t, *_ in ROWS]
    if rng.random() < 0.5:
        parquet(desk, {"time": pa.array(counts, pa.duration(unit))})
        return same("parquet")
    start = rng.randrange(1_000_000_000, 2_000_000_000) * per_second
    parquet(desk, {"time": pa.array([start + n for n in counts], pa.timestamp(unit))})
    return noted("parquet", "in.parquet", "Unix time", "from the first row")


@way
def parquet_without_rows(desk, rng):
    import pyarrow as pa
    import pyarrow.parquet as pq

    empty = pa.table({name: pa.array([], pa.float64()) for name in ("time", "motorCurrent")})
    pq.write_table(empty, desk.folder / "in.parquet")
    if rng.random() < 0.3:
        desk.write("in.parquet", b"")
    return refused("parquet", "in.parquet", "export the recording again")


@way
def parquet_that_is_damaged(desk, rng):
    path = desk.folder / "in.parquet"
    bytes_ = path.read_bytes()
    path.write_bytes(bytes_[: rng.randrange(1, len(bytes_) - 1)])
    return refused("parquet", "in.parquet", "Parquet")


@way
def parquet_with_a_column_that_drives_nothing(desk, rng):
    parquet(desk, {"motorAngle": [rng.random() for _ in ROWS]})
    return noted("parquet", "in.parquet", "drive nothing", "`motorAngle`")


@way
def an_array_in_a_cell(desk, rng):
    blank = rng.choice([" ", "  "])
    rows = "".join(f"{t:.2f},{blank.join(map(repr, values))}\n" for t, values in TORQUES)
    desk.write("arm.csv", "time,jointTorque\n" + rows)
    return same("arm")


@way
def an_array_that_is_too_short(desk, rng):
    row = rng.randrange(1, len(TORQUES))
    rows = [[f"{t:.2f}", " ".join(map(repr, values))] for t, values in TORQUES]
    rows[row][1] = " ".join(rows[row][1].split()[:2])
    desk.write("arm.csv", "time,jointTorque\n" + "".join(",".join(r) + "\n" for r in rows))
    return refused("arm", f"arm.csv:{row + 2}:", "2 values in the cell, 3 in the rows before")


@way
def lists_that_are_not_of_one_length(desk, rng):
    values = [list(v) for _, v in TORQUES]
    values[rng.randrange(1, len(values))].append(1.0)
    lists(desk, values)
    return noted("lists", "arm.parquet", "`jointTorque`", "not all of one length", results=False)


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


@pytest.fixture
def desk(tmp_path):
    return Desk(tmp_path)


def drawn(desk, count):
    pytest.importorskip("pyarrow")
    good(desk)
    for command, arguments in COMMANDS.items():
        if command == "case":
            continue
        done = desk.run(*arguments)
        assert done.returncode == 0 and "error" not in done.stderr, f"{command}, unchanged: {done.stderr}"
        assert "error" not in done.stderr, done.stderr
        if (desk.folder / "out.csv").exists():
            desk.unchanged[command] = desk.results()
            (desk.folder / "out.csv").unlink()
    assert near(desk.unchanged["lists"], desk.unchanged["arm"])
    tried(desk, WAYS, count)


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


def test_what_is_drawn_is_the_same_named_or_refused(desk):
    drawn(desk, FEW)


@pytest.mark.full
def test_three_hundred_are_the_same_named_or_refused(desk):
    drawn(desk, ALL)


def test_ways_are_found():
    assert len(WAYS) >= 40 and ROOT.is_dir()
