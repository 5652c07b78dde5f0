"""FMUs for all platforms, packed from the template libraries of tools/release: what is in them, and that they compute the same.

A small host in C (fmu_host.c) runs a joint with stick-slip, and an arm, for 2,000 steps: on this machine, for ARM under qemu, for
Windows under wine. Nothing here runs what is for macOS; its signatures are checked."""

import hashlib
import os
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
# Model, version, what is driven, a Boolean variable, outputs that are compared: stick-slip, and an arm, whose equations have sines.
JOINT = ("motorCurrent", "sticking", ("motorAngle", "motorVelocity", "loadAngle", "loadVelocity", "transmissionTorque"))
ARM = ("jointTorque[1]", "jointFlexible[1]", ("basePosition[1]", "baseAttitude", "jointAngle[1]", "jointVelocity[3]", "tipPosition[2]"))
SCENES = [("TwoMassJoint", 2, *JOINT), ("TwoMassJoint", 3, *JOINT), ("PlanarManipulator", 2, *ARM)]


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
    model = archive.name.split(".")[0]
    with zipfile.ZipFile(archive) as z:
        file = folder / f"{model}-{version}-{platform}{ending}"
        file.write_bytes(z.read(f"binaries/{at}/{model}{ending}"))
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
    """run(scene, platform, before=()) has what comes of each step: lists of the Boolean, and of the outputs."""
    folder = tmp_path_factory.mktemp("hosts")
    headers = Path(fmpy.__file__).parent / "c-code"

    def it(scene, platform, before=(), **options):
        model, version, driven, flag, outputs = scene
        target, _, _, ending = TARGETS[platform]
        host = folder / f"host-{platform}{ending}"
        if not host.exists():
            source = ROOT / "tests" / "python" / "fmu_host.c"
            zig("cc", "-target", target, "-O1", "-I", headers, source, "-o", host, *([] if ending else ["-ldl"]))
        archive = archives / f"{model}.fmi{version}.fmu"
        description = read_model_description(archive)
        number = {v.name: str(v.valueReference) for v in description.modelVariables}
        token = description.guid if version == 2 else description.instantiationToken
        done = subprocess.run(
            # The path as both kinds of systems read it.
            [*before, host, f"./{library(archive, version, platform, folder).name}", str(version), token, STEP.hex(),
             number[driven], number[flag], *(number[name] for name in outputs)],
            input="\n".join(value.hex() for value in pulses()), capture_output=True, text=True, cwd=folder, **options,
        )
        assert done.returncode == 0, done.stderr
        rows = [line.split() for line in done.stdout.splitlines()]
        assert len(rows) == STEPS, done.stderr
        return [int(row[0]) for row in rows], [list(map(float.fromhex, row[1:])) for row in rows]

    it.folder = folder
    return it


def pulses():
    """Triangles up to 0.03 (A: twice what breaks the joint loose) of 0.1 s, forward and back in turn, 0.4 s apart."""
    for k in range(STEPS):
        cycle, at = divmod(k, 500)
        pulse = max(0.0, 0.03 * (1 - abs(at - 50) / 50))
        yield -pulse if cycle % 2 else pulse


def compared(scene, have, want, where):
    if scene[0] == "TwoMassJoint":
        changes = sum(a != b for a, b in zip(want[0], want[0][1:]))
        assert changes >= 8 and 100 < sum(want[0]) < STEPS - 100, "it does not stick and slip"
    assert have[0] == want[0]
    largest = [max(abs(x) for x in column) for column in zip(*want[1])]
    assert min(largest) > 0.0
    share = max(abs(a - b) / m for x, y in zip(have[1], want[1]) for a, b, m in zip(x, y, largest))
    print(f"\n{scene[0]}, FMI {scene[1]}.0, {where}: off by {share:.1e} of what outputs reach"
          f"{', bit-equal' if have == want else ''}")
    assert share <= 1e-12


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: f"{s[0]}{s[1]}")
def test_arm_computes_what_x86_does(scene, run):
    qemu = shutil.which("qemu-aarch64")
    root = Path("/usr/aarch64-linux-gnu")
    if qemu is None or not root.is_dir():
        pytest.skip("qemu-aarch64 and a C library for it (Debian: qemu-user, libc6-arm64-cross) are not installed")
    have = run(scene, "aarch64-linux", before=[qemu, "-L", str(root)])
    compared(scene, have, run(scene, "x86_64-linux"), "aarch64-linux under qemu")


@pytest.fixture(scope="module")
def wine(run, zig):
    """How wine is called: the start of a command, and its environment."""
    program = shutil.which("wine")
    if program is None:
        pytest.skip("wine (Debian: wine, wine64) is not installed")
    # A part of Windows, from which Rust's standard library takes random numbers for its hash tables; wine 8.0 has it not. The
    # dummy is the host's alone, and no part of an FMU.
    source = run.folder / "bcryptprimitives.c"
    source.write_text(
        "#include <stddef.h>\n__declspec(dllexport) int ProcessPrng(unsigned char *bytes, size_t n) {\n"
        "    for (size_t i = 0; i < n; i++) bytes[i] = (unsigned char)(73 * i + 11);\n    return 1;\n}\n"
    )
    zig("cc", "-target", TARGETS["x86_64-windows"][0], "-shared", "-O1", source, "-o", run.folder / "bcryptprimitives.dll")
    return [program], {**os.environ, "WINEPREFIX": str(run.folder / "wine"), "WINEDEBUG": "-all"}


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: f"{s[0]}{s[1]}")
def test_windows_computes_what_linux_does(scene, run, wine):
    have = run(scene, "x86_64-windows", before=wine[0], env=wine[1])
    compared(scene, have, run(scene, "x86_64-linux"), "x86_64-windows under wine")


def slices(library):
    """The libraries in a file of macOS, by processor."""
    processors = {0x0100_000C: "aarch64", 0x0100_0007: "x86_64"}
    if library[:4] == bytes.fromhex("cafebabe"):
        count = struct.unpack(">I", library[4:8])[0]
        for i in range(count):
            kind, _, offset, size, _ = struct.unpack(">5I", library[8 + 20 * i : 28 + 20 * i])
            yield processors[kind], library[offset : offset + size]
    else:
        yield processors[struct.unpack("<I", library[4:8])[0]], library


def signed_pages(library):
    """Of each page of a library for macOS, whether the hash in its signature is right; nothing without a signature."""
    commands, at = struct.unpack("<I", library[16:20])[0], 32
    for _ in range(commands):
        command, size, start = struct.unpack("<3I", library[at : at + 12])
        if command == 0x1D:  # LC_CODE_SIGNATURE
            count = struct.unpack(">I", library[start + 8 : start + 12])[0]
            for i in range(count):
                kind, offset = struct.unpack(">2I", library[start + 12 + 8 * i : start + 20 + 8 * i])
                if kind == 0:  # the code directory
                    directory = library[start + offset :]
                    hashes, slots, limit = (struct.unpack(">I", directory[k : k + 4])[0] for k in (16, 28, 32))
                    page = 1 << directory[39]
                    assert limit == start and directory[36] == 32 and directory[37] == 2
                    for k in range(slots):
                        want = directory[hashes + 32 * k : hashes + 32 * k + 32]
                        yield hashlib.sha256(library[k * page : min(limit, (k + 1) * page)]).digest() == want
        at += size


@pytest.mark.parametrize("model", MODELS)
def test_libraries_of_macos_are_signed_as_they_are_packed(model, archives):
    with zipfile.ZipFile(archives / f"{model}.fmi3.fmu") as z:
        arm, intel = (z.read(f"binaries/{p}-darwin/{model}.dylib") for p in ("aarch64", "x86_64"))
    pages = list(signed_pages(arm))
    assert len(pages) > 100 and all(pages)
    # Intel's may be without a signature; one that is there must be right.
    assert all(signed_pages(intel))
    # The check sees what patching without signing again would leave: one byte in the configuration.
    at = arm.index(b"model " + model.encode())
    assert not all(signed_pages(arm[:at] + b"M" + arm[at + 1 :]))
    # FMI 2.0: both in one file, which begins where pages do.
    with zipfile.ZipFile(archives / f"{model}.fmi2.fmu") as z:
        both = dict(slices(z.read(f"binaries/darwin64/{model}.dylib")))
    assert set(both) == {"aarch64", "x86_64"} and all(signed_pages(both["aarch64"]))


def test_rcodesign_finds_the_signature_in_order(archives, tmp_path):
    rcodesign = shutil.which("rcodesign")
    if rcodesign is None:
        pytest.skip("rcodesign is not installed: cargo install apple-codesign")
    with zipfile.ZipFile(archives / "TwoMassJoint.fmi3.fmu") as z:
        library = z.read("binaries/aarch64-darwin/TwoMassJoint.dylib")

    def complaints(bytes_):
        file = tmp_path / "it.dylib"
        file.write_bytes(bytes_)
        return subprocess.run([rcodesign, "verify", file], capture_output=True, text=True).stdout.splitlines()

    # What an ad-hoc signature is without, and nothing else.
    assert complaints(library) == ["no cryptographic signature present"]
    at = library.index(b"model TwoMassJoint")
    changed = complaints(library[:at] + b"M" + library[at + 1 :])
    assert any(line.startswith("code digest mismatch") for line in changed)
