"""The commands of README.md work: its `sh` blocks first, then its `python` blocks."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", (ROOT / "README.md").read_text(), re.S | re.M)


def blocks(language):
    found = [text for name, text in BLOCKS if name == language]
    assert found, f"README.md has no {language} block"
    return found


PACKS = "target/release/trueup fmu pack -o out\n"


@pytest.fixture(scope="module")
def folder(full, fmus, tmp_path_factory):
    """A folder that looks like the root after `cargo build --release`, with the shell blocks run in it."""
    program = os.environ.get("TRUEUP_BIN")
    if not program:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    folder = tmp_path_factory.mktemp("readme")
    (folder / "target").mkdir()
    (folder / "target" / "release").symlink_to(Path(program).resolve().parent)
    # No link: the systems name their FMUs relative to themselves, `../../out`.
    shutil.copytree(ROOT / "examples", folder / "examples")
    assert sum(text.count(PACKS) for text in blocks("sh")) == 1
    for text in blocks("sh"):
        # By default what ./test packed with this command is copied.
        run(["bash", "-euc", text if full else text.replace(PACKS, f"cp -r '{fmus.resolve()}' out\n")], folder)
    return folder


def run(command, folder):
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert process.returncode == 0, process.stdout + process.stderr
    return process.stdout


def test_shell_blocks(folder):
    assert (folder / "out" / "TwoMassJoint+stribeck-friction.fmi3.fmu").is_file()


def test_joint(folder):
    below, above = run([sys.executable, "-c", blocks("python")[0]], folder).splitlines()
    assert below.startswith("0.0149 A: 0.0 rad/s") and below.endswith("sticks")
    assert above.endswith("slides") and float(above.split()[2]) > 100.0


def test_arm(folder):
    joint, base, momentum = map(float, run([sys.executable, "-c", blocks("python")[1]], folder).split())
    assert joint > 0.0 > base
    assert abs(momentum) < 1e-6
