"""The tutorials as a new user walks through them: each file saved, each command run, its output compared with what the page shows.

`pytest -s` prints the seconds of each command.
"""

import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest
from conftest import ROOT, from_environment

DOCS = ROOT / "docs"
STEP = re.compile(r"^```(\w+)\n(.*?)^```", re.S | re.M)
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")


def words(line):
    """Figures may move a little with the program, words do not."""
    return NUMBER.sub("#", line).split()


def saved_as(before):
    """The file that the text before a block has the reader save."""
    named = re.findall(r"`(?:python3 )?([\w/]+\.(?:urdf|py|toml))`", before)
    return named[-1] if named else None


class Walk:
    def __init__(self, folder):
        self.folder, self.output, self.seconds = folder, "", []
        programs = folder / "path"
        programs.mkdir()
        program = Path(from_environment("TRUEUP_BIN")).resolve()
        (programs / "trueup").symlink_to(program)
        (folder / "target").mkdir()
        (folder / "target" / "release").symlink_to(program.parent)
        shutil.copytree(ROOT / "examples", folder / "examples")
        self.environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}

    def run(self, command):
        began = time.monotonic()
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, capture_output=True, text=True, env=self.environment)
        self.seconds.append((time.monotonic() - began, command))
        print(f"{self.seconds[-1][0]:8.1f} s  {command[:100]}")
        assert done.returncode == 0, f"{command}: {done.stderr}"
        self.output = done.stderr + done.stdout

    def shows(self, text):
        printed = [words(line) for line in self.output.splitlines()]
        missing = [line for line in text.splitlines() if line.strip() and words(line) not in printed]
        assert not missing, f"not printed: {missing}\n{self.output}"

    def through(self, page, until=None):
        text = page.read_text()
        end = 0
        for block in STEP.finditer(text):
            before, (language, content) = text[end : block.start()], block.groups()
            end = block.end()
            if until and until in content:
                return
            name = saved_as(before)
            if language == "console":
                for command in content.strip().splitlines():
                    self.run(command)
            elif language == "text" and not name:
                self.shows(content)
            elif name and language in ("xml", "python", "text"):
                (self.folder / name).write_text(content)
                if language == "python":
                    self.run(f"python3 {name}")


def test_my_first_robot_up_to_its_run(tmp_path):
    walk = Walk(tmp_path)
    walk.through(DOCS / "first-robot.md", until="--outputs")
    assert len(walk.seconds) == 4 and (tmp_path / "run.html").is_file()


@pytest.mark.full
def test_my_first_robot(tmp_path):
    walk = Walk(tmp_path)
    walk.through(DOCS / "first-robot.md")
    assert len(walk.seconds) == 8


@pytest.mark.full
def test_my_first_log(tmp_path):
    walk = Walk(tmp_path)
    walk.through(DOCS / "first-log.md")
    assert len(walk.seconds) == 5 and (tmp_path / "found" / "TwoMassJoint.augmented.fmi3.fmu").is_file()
