"""FMUs for all platforms, packed from the template libraries of tools/release: what is in them, and that they compute the same.

A small host in C (fmu_host.c) runs a joint with stick-slip for 2,000 steps: on this machine, for ARM under qemu, for Windows
under wine. Nothing here runs what is for macOS; its signatures are checked."""

import hashlib
import re
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest
from conftest import MODELS, ROOT, from_environment
from fmpy import read_model_description
from fmpy.validation import validate_fmu

pytestmark = pytest.mark.full

PLATFORMS = ("x86_64-linux", "aarch64-linux", "x86_64-windows", "aarch64-darwin", "x86_64-darwin")
# Target for zig, folder in an FMU of FMI 2.0, ending of libraries, of programs.
TARGETS = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", "linux64", ".so", ""),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "aarch64-linux", ".so", ""),
    "x86_64-windows": ("x86_64-windows-gnu", "win64", ".dll", ".exe"),
}
STEPS, STEP = 2000, 1e-3
OUTPUTS = ("motorAngle", "motorVelocity", "loadAngle", "loadVelocity", "transmissionTorque")


@pytest.fixture(scope="module")
def archives(trueup, tmp_path_factory):
    """Folder of all models, both versions, with the libraries of all platforms."""
    templates = Path(trueup.program).parent / "templates"
    missing = [p for p in PLATFORMS if not (templates / p).is_dir()]
    if missing:
        pytest.skip(f"no template libraries for {', '.join(missing)}: run tools/release")
    folder = tmp_path_factory.mktemp("platforms")
    done = trueup("fmu", "pack", "--platform", "all", "-o", folder)
    assert done.returncode == 0, done.stderr
    return folder


def library(archive, version, platform, folder):
    """The library of an FMU for a platform, as a file in the folder."""
    at, ending = (TARGETS[platform][1] if version == 2 else platform), TARGETS[platform][2]
    with zipfile.ZipFile(archive) as z:
        file = folder / f"TwoMassJoint{version}{ending}"
        file.write_bytes(z.read(f"binaries/{at}/TwoMassJoint{ending}"))
    return file


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model", MODELS)
def test_archives_are_valid_and_have_a_library_for_each_platform(model, version, archives, trueup):
    archive = archives / f"{model}.fmi{version}.fmu"
    assert validate_fmu(archive) == []
    done = trueup("fmu", "validate", archive)
    assert done.returncode == 0 and "0 errors, 0 warnings" in done.stdout, done.stdout
    with zipfile.ZipFile(archive) as z:
        have = {name.removeprefix("binaries/") for name in z.namelist() if name.startswith("binaries/")}
    if version == 3:
        endings = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
        assert have == {f"{p}/{model}{endings[p.split('-')[1]]}" for p in PLATFORMS}
    else:
        assert have == {f"linux64/{model}.so", f"aarch64-linux/{model}.so", f"win64/{model}.dll", f"darwin64/{model}.dylib"}


@pytest.mark.parametrize("platform", ["x86_64-linux", "aarch64-linux"])
def test_linux_libraries_want_no_glibc_above_2_17(platform, archives, tmp_path):
    if shutil.which("readelf") is None:
        pytest.skip("readelf (Debian: binutils) is not installed")
    file = library(archives / "TwoMassJoint.fmi3.fmu", 3, platform, tmp_path)
    said = subprocess.run(["readelf", "-W", "--dyn-syms", file], capture_output=True, text=True, check=True).stdout
    versions = {tuple(map(int, v.split("."))) for v in re.findall(r"@GLIBC_([0-9.]+)", said)}
    assert versions and max(versions) <= (2, 17), versions


@pytest.fixture(scope="module")
def zig():
    """zig(argument, ...) runs the compiler that tools/release installed."""
    python = from_environment("TRUEUP_BIN").parents[1] / "release-tools" / "bin" / "python"
    if not python.is_file():
        pytest.skip(f"{python} is missing: tools/release makes it, with zig in it")

    def run(*arguments):
        done = subprocess.run([python, "-m", "ziglang", *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    return run


@pytest.fixture(scope="module")
def run(archives, zig, tmp_path_factory):
    """run(platform, version, before=()) has the outputs of each step: lists of whether it sticks, and of OUTPUTS."""
    folder = tmp_path_factory.mktemp("hosts")
    headers = Path(fmpy.__file__).parent / "c-code"

    def it(platform, version, before=()):
        target, _, _, ending = TARGETS[platform]
        host = folder / f"host-{platform}{ending}"
        if not host.exists():
            source = ROOT / "tests" / "python" / "fmu_host.c"
            zig("cc", "-target", target, "-O1", "-I", headers, source, "-o", host, *([] if ending else ["-ldl"]))
        archive = archives / f"TwoMassJoint.fmi{version}.fmu"
        description = read_model_description(archive)
        number = {v.name: str(v.valueReference) for v in description.modelVariables}
        token = description.guid if version == 2 else description.instantiationToken
        # A triangle of 0.03 A, which is twice what breaks the joint loose, of two periods a second.
        wave = [0.12 * (abs((k / 500 + 0.25) % 1 - 0.5) - 0.25) for k in range(STEPS)]
        done = subprocess.run(
            [*before, host, library(archive, version, platform, folder), str(version), token, STEP.hex(),
             number["motorCurrent"], number["sticking"], *(number[name] for name in OUTPUTS)],
            input="\n".join(value.hex() for value in wave), capture_output=True, text=True,
        )
        assert done.returncode == 0, done.stderr
        rows = [line.split() for line in done.stdout.splitlines()]
        assert len(rows) == STEPS
        return [int(row[0]) for row in rows], [list(map(float.fromhex, row[1:])) for row in rows]

    return it


def difference(one, other):
    """The largest difference of an output, as a share of what it reaches; whether all is equal bit by bit."""
    assert one[0] == other[0], "sticking differs"
    largest = [max(abs(x) for x in column) for column in zip(*one[1])]
    share = max(abs(a - b) / m for x, y in zip(one[1], other[1]) for a, b, m in zip(x, y, largest))
    return share, one == other


def compared(have, want, what):
    assert 100 < sum(want[0]) < STEPS - 100 and sum(a != b for a, b in zip(want[0], want[0][1:])) >= 8, "it does not stick and slip"
    share, equal = difference(want, have)
    print(f"\n{what}: largest difference {share:.1e} of an output's range, {'bit-equal' if equal else 'not bit-equal'}")
    assert share <= 1e-12


@pytest.mark.parametrize("version", [2, 3])
def test_arm_computes_what_x86_does(version, run):
    qemu = shutil.which("qemu-aarch64")
    root = Path("/usr/aarch64-linux-gnu")
    if qemu is None or not root.is_dir():
        pytest.skip("qemu-aarch64 and a C library for it (Debian: qemu-user, libc6-arm64-cross) are not installed")
    have = run("aarch64-linux", version, before=[qemu, "-L", str(root)])
    compared(have, run("x86_64-linux", version), f"aarch64-linux under qemu, FMI {version}.0")
