"""The ABI types of crates/fmi against the official C headers, by the C compiler."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


@pytest.fixture(scope="module")
def headers():
    fmpy = pytest.importorskip("fmpy")
    folder = Path(fmpy.__file__).parent / "c-code"
    if not (folder / "fmi3Functions.h").is_file():
        pytest.skip(f"no official FMI headers in {folder}")
    return folder


@pytest.fixture(scope="module")
def abi(example):
    """Rust's description of its types: {kind: [fields, ...]}."""
    table = {}
    for line in example("abi").splitlines():
        kind, rest = line.split(" ", 1)
        fields = rest.split(" ", 1) if kind in ("function", "type") else rest.split()
        table.setdefault(kind, []).append(fields)
    return table


def c_type(name, text):
    # Rust has one type for `char` and `int8_t`: which is meant follows from the name.
    return re.sub(r"\bint8\b", "int8_t" if "Int8" in name else "char", text)


def source(version, abi):
    """A C file that compiles only if every statement of the table is true."""
    def of(kind):
        return [fields for fields in abi[kind] if fields[0].startswith(f"fmi{version}")]

    lines = ["#include <stddef.h>", "#include <stdint.h>", "#include <stdbool.h>", f'#include "fmi{version}Functions.h"']
    for name, text in of("function"):
        pointer = c_type(name, text)
        lines.append(f"{name}TYPE* const header_{name} = ({pointer})0;")
        lines.append(f'_Static_assert(__builtin_types_compatible_p({name}TYPE*, {pointer}), "{name}");')
    for name, text in of("type"):
        lines.append(f'_Static_assert(__builtin_types_compatible_p({name}, {c_type(name, text)}), "{name}");')
    for name, size in of("size"):
        lines.append(f'_Static_assert(sizeof({name}) == {size}, "size of {name}");')
    for name, field, offset in of("offset"):
        lines.append(f'_Static_assert(offsetof({name}, {field}) == {offset}, "{name}.{field}");')
    for name, value in of("constant"):
        lines.append(f'_Static_assert({name} == {value}, "{name}");')
    return "\n".join(lines) + "\n"


def compiles(text, headers, folder):
    file = folder / "abi.c"
    file.write_text(text)
    command = [COMPILER, "-std=gnu11", "-Wall", "-Werror", "-Wno-unused", f"-I{headers}", "-c", file, "-o", folder / "abi.o"]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.parametrize("version, count", [(2, 44), (3, 75)])
def test_all_functions_are_listed_in_the_order_of_the_header(version, count, abi, headers):
    text = (headers / f"fmi{version}FunctionTypes.h").read_text()
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    official = re.findall(rf"\b(fmi{version}\w+)TYPE\s*\(", text)
    listed = [name for name, _ in abi["function"] if name.startswith(f"fmi{version}")]
    assert len(official) == count
    assert listed == official


@pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc): the ABI is not compared with the official headers")
@pytest.mark.parametrize("version", [2, 3])
def test_every_type_is_that_of_the_header(version, abi, headers, tmp_path):
    result = compiles(source(version, abi), headers, tmp_path)
    assert result.returncode == 0, result.stderr


@pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc): the comparison itself is not tried")
@pytest.mark.parametrize("kind, wrong", [
    ("function", ["fmi3SetTime", "__typeof__(fmi3Status (*)(void*, float))"]),
    ("type", ["fmi3ValueReference", "int32_t"]),
    ("size", ["fmi3Boolean", "4"]),
    ("offset", ["fmi2EventInfo", "nextEventTime", "20"]),
    ("constant", ["fmi3Fatal", "5"]),
])
def test_a_wrong_statement_is_found(kind, wrong, headers, tmp_path):
    table = dict.fromkeys(["function", "type", "size", "offset", "constant"], [])
    table[kind] = [wrong]
    assert compiles(source(int(wrong[0][3]), table), headers, tmp_path).returncode != 0
