"""docs/papers.md: its commands run, and print the figures next to them."""

import re
import shlex
import shutil

import pytest

from conftest import ROOT

# Table 2 of S2, full size.
QUANTITIES = """[nominal]
target-mass = { value = 7900, unit = "kg" }
target-inertia = { value = 129112.2, unit = "kg.m2" }
chaser-mass = { value = 1500, unit = "kg" }
chaser-inertia = { value = 762, unit = "kg.m2" }
arm-length = { value = 4.2, unit = "m" }
"""

# Two stages of a gearbox.
GEARBOX = """motorInertia = 1.2e-7
loadInertia = 8.0
planetary = { inertia = 3e-8, stiffness = 1e-4, damping = 2e-7, ratio = 200 }
harmonic-drive = { inertia = 2e-5, stiffness = 6.0, damping = 3e-3, ratio = 160 }
"""


def rows():
    """(command, figures, long) of every row with a command of the program, each command once with all its figures."""
    found = {}
    for line in (ROOT / "docs/papers.md").read_text().splitlines():
        cells = [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) != 6:
            continue
        for command in re.findall(r"`(trueup [^`]+)`", cells[2]):
            figures, long = found.get(command, ([], False))
            found[command] = figures + re.findall(r"`([^`]+)`", cells[3]), long or "*long*" in cells[2]
    return [(command, *row) for command, row in found.items()]


@pytest.fixture(scope="module")
def folder(fmus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("papers")
    shutil.copytree(ROOT / "examples", folder / "examples")
    (folder / "out").symlink_to(fmus)
    (folder / "quantities.toml").write_text(QUANTITIES)
    (folder / "gearbox.toml").write_text(GEARBOX)
    return folder


@pytest.mark.parametrize(
    "command, figures", [pytest.param(c, f, id=c[7:60], marks=[pytest.mark.full] if long else []) for c, f, long in rows()]
)
def test_a_command_prints_its_figures(trueup, folder, command, figures):
    said = ""
    assert figures, "a command without a figure shows nothing"
    for part in command.split(" && "):
        program, *arguments = shlex.split(part)
        if program == "cat":
            said += "".join((folder / name).read_text() for name in arguments)
            continue
        assert program == "trueup", part
        done = trueup(*arguments, cwd=folder)
        assert done.returncode == 0, done.stderr
        said += done.stdout + done.stderr
    missing = [f for f in figures if f not in said]
    assert not missing, f"{command} does not print {missing}:\n{said}"


def test_every_numbered_equation_of_the_papers_is_there():
    """By section: the last equation of each paper, and none left out in between."""
    sections = re.split(r"^## ", (ROOT / "docs/papers.md").read_text(), flags=re.M)
    for name, last in (("S0", 24), ("S1", 19), ("S2", 23), ("S3", 11)):
        text = next(s for s in sections if s.startswith(name))
        numbers = set()
        for line in text.splitlines():
            cell = line.split("|")[1] if line.startswith("| ") else ""
            for a, b in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", cell):
                numbers |= set(range(int(a), int(b or a) + 1))
        assert numbers >= set(range(1, last + 1)), f"{name}: {sorted(set(range(1, last + 1)) - numbers)}"
