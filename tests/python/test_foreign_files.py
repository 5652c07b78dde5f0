"""Files as other tools write them, in addition to those of test_bad_inputs.py: spreadsheets, loggers, pandas, ROS, other SSP tools, xacro, FMUs
that were damaged on their way. Drawn by a seed that is printed (TRUEUP_SEED); each has to be the same, noted or refused, by name."""

import re
import zipfile

import pytest
from input_desk import (
    COMMANDS, CSV, ENTRY, ROWS, SSM, SSV, URDF, Desk, archived, good, near, noted, package, parquet, refused, same, tried,
)

FEW, ALL = 12, 200
LINES = CSV.splitlines()
WAYS = []


def way(function):
    WAYS.append(function)
    return function


def current(text):
    """The input with the current written by `text`, and no other column."""
    return "time,motorCurrent\n" + "".join(f"{t:.2f},{text(i)}\n" for t, i, _ in ROWS)


@way
def an_encoding_of_windows(desk, rng):
    encoding = rng.choice(["utf-16", "utf-16-le", "utf-16-be"])
    desk.write("in.csv", CSV.encode(encoding))
    return refused("input", "in.csv:1:", "UTF-8")


@way
def a_unit_in_latin_1(desk, rng):
    desk.write("in.csv", CSV.replace("motorCurrent", "motorCurrent [µA]").encode("latin-1"))
    return refused("input", "in.csv:1:", "UTF-8")


@way
def thousands_are_marked(desk, rng):
    number = rng.choice(['"1,234.5"', "1'234.5", '"1.234.5"'])
    desk.write("in.csv", current(lambda i: number if i else "0"))
    return refused("input", "in.csv", number.strip('"'), "is no number")


@way
def a_word_of_a_spreadsheet(desk, rng):
    word = rng.choice(["#N/A", "#DIV/0!", "#VALUE!", "NULL", "2%", "0.02 A", "−0.02", "2D-2"])
    desk.write("in.csv", current(lambda i: word if i else "0"))
    return refused("input", "in.csv", word, "is no number")


@way
def nan_is_an_empty_cell(desk, rng):
    row = rng.randrange(3, len(LINES))
    cells = LINES[row].split(",")
    cells[2] = rng.choice(["nan", "NaN", "NAN"])
    desk.write("in.csv", "\n".join([*LINES[:row], ",".join(cells), *LINES[row + 1:]]) + "\n")
    return noted("input", "in.csv", f":{row + 1}:", "empty cell", results=False)


@way
def line_ends_that_are_mixed(desk, rng):
    kind = rng.randrange(3)
    ends = ["\r\n" if rng.random() < 0.5 else "\n" for _ in LINES] if kind == 0 else ["\r" if kind == 1 else "\n\n"] * len(LINES)
    desk.write("in.csv", "".join(line + end for line, end in zip(LINES, ends, strict=True)))
    return same("input")


@way
def a_comma_behind_each_line(desk, rng):
    desk.write("in.csv", "".join(f"{line},\n" for line in LINES))
    return same("input")


@way
def a_name_on_two_lines(desk, rng):
    desk.write("in.csv", CSV.replace("motorCurrent", '"motorCurrent\n(A)"'))
    return same("input")


@way
def a_column_without_values(desk, rng):
    name = rng.choice(["Unnamed: 3", "comment"])
    desk.write("in.csv", f"{LINES[0]},{name}\n" + "".join(f"{line},\n" for line in LINES[1:]))
    return refused("input", "in.csv", name, "has no value")


@way
def the_index_of_pandas(desk, rng):
    desk.write("in.csv", f",{LINES[0]}\n" + "".join(f"{k},{line}\n" for k, line in enumerate(LINES[1:])))
    return refused("input", "in.csv:1:", "index column")


@way
def a_stamp_of_ros(desk, rng):
    start = rng.randrange(10**9, 2 * 10**9)
    name, stamp = rng.choice([("t_ns", lambda t: f"{start * 10**9 + round(t * 1e9)}"), ("header.stamp.secs", lambda t: f"{start + t:.2f}")])
    desk.write("in.csv", f"{name},motorCurrent\n" + "".join(f"{stamp(t)},{i}\n" for t, i, _ in ROWS))
    return refused("input", "in.csv", "no column `time`", name)


@way
def dates_of_one_instant_in_two_zones(desk, rng):
    hours = rng.choice([1, 2, 5])

    def stamp(t):
        whole, rest = divmod(round(t * 1000), 1000)
        return f"2026-03-29T{12 + hours:02d}:00:{whole:02d}.{rest:03d}+{hours:02d}:00" if t < 0.5 else f"2026-03-29T12:00:{whole:02d}.{rest:03d}Z"

    desk.write("in.csv", f"{LINES[0]}\n" + "".join(f"{stamp(t)},{i},{e:.3f}\n" for t, i, e in ROWS))
    return noted("input", "in.csv", "Unix time")


@way
def a_date_of_another_country(desk, rng):
    date = rng.choice(["29.03.2026 12:00:0{}", "03/04/2026 12:00:0{} PM", "00:00:0{}.500"])
    desk.write("in.csv", "time,motorCurrent\n" + "".join(f"{date.format(k)},{k}\n" for k in range(4)))
    return refused("input", "in.csv:2:", "neither a number nor a date")


@way
def a_name_that_differs_by_a_capital(desk, rng):
    desk.write("in.csv", CSV.replace("externalTorque", "MotorCurrent"))
    return refused("input", "in.csv", "`MotorCurrent`", "did you mean `motorCurrent`?")


@way
def parquet_of_narrow_numbers(desk, rng):
    import decimal

    import numpy as np
    import pyarrow as pa

    # 0 and 1/64 are exact in all of them.
    values = [i and 0.015625 for _, i, _ in ROWS]
    parquet(desk, {"motorCurrent": values})
    desk.unchanged["parquet"] = ran(desk, "parquet")
    digits = rng.choice([9, 18, 30, 50])
    kind = pa.decimal256(digits, 6) if digits > 38 else pa.decimal128(digits, 6)
    narrow = rng.choice([
        pa.array([decimal.Decimal(str(x)) for x in values], kind), pa.array(np.array(values, dtype="float16")),
        pa.array(values, pa.float32()),
    ])
    parquet(desk, {"motorCurrent": narrow})
    return same("parquet")


@way
def parquet_of_texts(desk, rng):
    import pyarrow as pa

    texts = pa.array([str(i) for _, i, _ in ROWS])
    parquet(desk, {"motorCurrent": texts.dictionary_encode() if rng.random() < 0.5 else texts})
    return refused("parquet", "in.parquet", "`motorCurrent`", "is no number")


@way
def parquet_without_values(desk, rng):
    import pyarrow as pa

    empty = rng.choice([pa.nulls(len(ROWS)), pa.array([None] * len(ROWS), pa.float64())])
    parquet(desk, {"motorCurrent": empty})
    return refused("parquet", "in.parquet", "motorCurrent", "has no value")


@way
def parquet_compressed_otherwise(desk, rng):
    how = rng.choice(["lz4", "brotli"])
    parquet(desk, compression=how)
    return refused("parquet", "in.parquet", how)


@way
def a_parameter_twice(desk, rng):
    again = '<ssv:Parameter name="k"><ssv:Real value="1e-3"/></ssv:Parameter>\n</ssv:Parameters>'
    archived(desk, SSV.format("3.07e-5", "N.m/rad").replace("</ssv:Parameters>", again))
    return refused("ssp", "p.ssv:6", "`k`", "already")


@way
def two_entries_for_one_target(desk, rng):
    package(desk, entries=(("k", "stiffness"), ("n", "stiffness")))
    return refused("ssp", "m.ssm", "`p.stiffness`", "entry before")


@way
def a_map_without_entries(desk, rng):
    kind = rng.choice(["Boolean", "Integer", "Enumeration"])
    inner = f'<ssc:{kind}MappingTransformation xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"/>'
    entry = f'<ssm:MappingEntry source="k" target="p.stiffness">{inner}</ssm:MappingEntry>\n'
    archived(desk, SSV.format("3.07e-5", "N.m/rad"), SSM.format(entry + ENTRY.format("n", "gearRatio")))
    return refused("ssp", "m.ssm", f"{kind}MappingTransformation", "MapEntry")


@way
def a_factor_of_the_mapping(desk, rng):
    factor = rng.choice([2.0, 0.5, 10.0])
    inner = f'<ssc:LinearTransformation xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" factor="{factor}"/>'
    entry = f'<ssm:MappingEntry source="k" target="p.stiffness">{inner}</ssm:MappingEntry>\n'
    archived(desk, SSV.format(repr(3.07e-5 / factor), "N.m/rad"), SSM.format(entry + ENTRY.format("n", "gearRatio")))
    return same("ssp")


@way
def a_unit_that_the_set_defines(desk, rng):
    factor = rng.choice([1000.0, 0.01])
    unit = (
        '<ssv:Units><ssc:Unit xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" name="own"><ssc:BaseUnit kg="1" m="2" s="-2" '
        f'rad="-1" factor="{factor}"/></ssc:Unit></ssv:Units>'
    )
    archived(desk, SSV.format(repr(3.07e-5 / factor), "own").replace("</ssv:Parameters>", "</ssv:Parameters>" + unit))
    return same("ssp")


@way
def macros_that_nobody_expanded(desk, rng):
    space = ' xmlns:xacro="http://www.ros.org/wiki/xacro">'
    old, new, words = rng.choice([
        ('name="arm">', 'name="arm"' + space + '<xacro:property name="m" value="3"/>', ("xacro:property", "xacro FILE")),
        ('name="arm">', 'name="arm"' + space + '<xacro:include filename="a.xacro"/>', ("xacro:include", "xacro FILE")),
        ('name="arm">', 'name="arm"' + space + '<xacro:leg side="left"/>', ("xacro:leg", "xacro FILE")),
        ('<mass value="3"/>', '<mass value="${2*m}"/>', ("arm.urdf:3", "${2*m}")),
        ("</robot>", '<xacro:leg side="left"/></robot>', ("arm.urdf:7", "xacro")),
    ])
    desk.write("arm.urdf", URDF.replace(old, new, 1))
    return refused("urdf", "arm.urdf:", *words)


@way
def an_element_twice(desk, rng):
    old, line, name = rng.choice([
        ('<mass value="3"/>', 3, "mass"), ('<axis xyz="0 1 0"/>', 5, "axis"), ('<origin xyz="0 0 0.4"/>', 5, "origin"),
        ('<parent link="foot"/>', 5, "parent"),
    ])
    desk.write("arm.urdf", URDF.replace(old, old + old, 1))
    return refused("urdf", f"arm.urdf:{line}", f"<{name}> is there twice")


@way
def a_joint_that_hangs_on_itself(desk, rng):
    desk.write("arm.urdf", URDF.replace('<parent link="foot"/>', f'<parent link="{rng.choice(["upper", "fore"])}"/>', 1))
    return refused("urdf", "arm.urdf:", "loop")


@way
def a_transmission(desk, rng):
    name = rng.choice(["shoulder", "elbow"])
    desk.write("arm.urdf", URDF.replace("</robot>", f'<transmission name="t"><joint name="{name}"/></transmission></robot>'))
    return noted("urdf", "arm.urdf", "<transmission>", name, results=False)


@way
def a_link_of_a_mesh_alone(desk, rng):
    mesh = '<visual><geometry><mesh filename="package://x/f.stl"/></geometry></visual>'
    desk.write("arm.urdf", re.sub(r'(<link name="fore">).*(</link>)', rf"\1{mesh}\2", URDF))
    return refused("urdf", "arm.urdf:4", "`fore`", "mass")


LIBRARY = "binaries/x86_64-linux/TwoMassJoint.so"


def changed(desk, change):
    """The FMU of the system with its files changed: `change` takes them by name."""
    with zipfile.ZipFile(desk.fmus / "TwoMassJoint.fmi3.fmu") as archive:
        files = change({name: archive.read(name) for name in archive.namelist()})
    with zipfile.ZipFile(desk.folder / "changed.fmu", "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    desk.write("system.toml", '[run]\nstop = 0.2\nstep = 0.05\n[components.p]\nfmu = "changed.fmu"\n')


@way
def a_library_that_is_cut_off(desk, rng):
    share = rng.uniform(0.0, 0.99)
    changed(desk, lambda files: {**files, LIBRARY: files[LIBRARY][: int(share * len(files[LIBRARY]))]})
    return refused("system", "changed.fmu")


@way
def a_library_of_something_else(desk, rng):
    head = rng.choice([
        lambda b: b[:4] + b"\1" + b[5:], lambda b: b[:18] + b"\xb7\0" + b[20:], lambda b: b"version https://git-lfs.github.com/spec/v1\n",
    ])
    changed(desk, lambda files: {**files, LIBRARY: head(files[LIBRARY])})
    return refused("system", "changed.fmu", "cannot be loaded")


@way
def an_fmu_without_a_part(desk, rng):
    part, words = rng.choice([("binaries/", ("no binary",)), ("modelDescription.xml", ("modelDescription.xml",))])
    changed(desk, lambda files: {n: c for n, c in files.items() if not n.startswith(part)})
    return refused("system", "changed.fmu", *words)


@way
def an_fmu_of_another_token(desk, rng):
    token = lambda text: re.sub(rb'instantiationToken="[^"]*"', b'instantiationToken="{0}"', text)  # noqa: E731
    changed(desk, lambda files: {n: token(c) if n == "modelDescription.xml" else c for n, c in files.items()})
    return refused("system", "gave no instance")


@way
def an_fmu_that_leaves_its_folder(desk, rng):
    name = rng.choice(["../../evil.txt", "/evil.txt"])
    changed(desk, lambda files: {**files, name: b"x"})
    return refused("system", "changed.fmu", "outside")


def ran(desk, command):
    done = desk.run(*COMMANDS[command])
    assert done.returncode == 0, done.stderr
    results = desk.results()
    (desk.folder / "out.csv").unlink()
    return results


def drawn(desk, count):
    pytest.importorskip("pyarrow")
    good(desk)
    desk.unchanged = {command: ran(desk, command) for command in ("input", "parquet", "ssp")}
    # A stiffness that does not arrive would show.
    package(desk, ("3.0701e-5", "N.m/rad"))
    assert not near(ran(desk, "ssp"), desk.unchanged["ssp"])
    tried(desk, WAYS, count)


@pytest.mark.parametrize("count", [FEW, pytest.param(ALL, marks=pytest.mark.full)])
def test_files_of_others_are_the_same_named_or_refused(tmp_path, count):
    drawn(Desk(tmp_path), count)
