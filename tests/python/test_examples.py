"""Each folder of examples/ has a story, its data and a picture; its commands print what its page shows."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT, from_environment
from test_tutorials import Walk

EXAMPLES = ROOT / "examples"
FOLDERS = sorted(path.name for path in EXAMPLES.iterdir() if path.is_dir() and path.name != "__pycache__")
# Only with --full; by default test_readme.py, test_contact.py, test_diagnose.py, test_delian_arm.py and test_papers.py run the systems and the case of these.
LONG = {"03-sweep", "05-coupled-capture", "06-backlash", "08-delian", "10-attitude"}
# By default until this command, of ten seconds or more.
UNTIL = {"07-space-arm": "CaptureScene", "04-capture": "capture-map.toml", "09-flexible-joint": "transmission-hysteresis"}
# Figures of a picture may move by as many pixels with the program.
NEAR = 3.0


def page(name):
    return (EXAMPLES / name / "README.md").read_text()


def test_folders_are_numbered_and_listed():
    assert [name[:2] for name in FOLDERS] == [f"{k + 1:02}" for k in range(len(FOLDERS))]
    assert re.findall(r"^\| \[(.+?)\]\(\1/README\.md\)", (EXAMPLES / "README.md").read_text(), re.M) == FOLDERS


def test_paths_into_the_examples_are_there():
    """Of all documents, helps, comments and tests; what a command writes there has another name."""
    written = re.compile(r"\.(parquet|runs)$|/bench\.toml$|\.scaled\.toml$")
    lines = subprocess.run(["git", "grep", "-nIE", r"(^|[^A-Za-z0-9_/}])(\.\./)*examples/[a-z0-9]", "--", ":!CHANGELOG.md"], cwd=ROOT, capture_output=True, text=True)
    wrong = []
    for line in lines.stdout.splitlines():
        for path in re.findall(r"(?<![\w/}])(?:\.\./)*(examples/[a-z0-9][\w./-]*)", line.split(":", 2)[2]):
            path = path.rstrip(".")
            if not written.search(path) and not (ROOT / path).exists():
                wrong.append(f"{line[:100]}: {path}")
    joined = subprocess.run(["git", "grep", "-nE", r'"examples" / "'], cwd=ROOT, capture_output=True, text=True).stdout.splitlines()
    for line in joined:
        wrong += [line for name in re.findall(r'"examples" / "([\w./-]+)"', line) if not (EXAMPLES / name).exists()]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_page_has_a_picture_and_names_every_file(name):
    (picture,) = re.findall(r"^!\[[^\]]{20,}\]\((\w+\.svg)\)$", page(name), re.M)
    listed = subprocess.run(["git", "ls-files", "."], cwd=EXAMPLES / name, capture_output=True, text=True).stdout.split()
    there = listed or [path.name for path in (EXAMPLES / name).iterdir()]
    assert picture in there and all(f"`{file}`" in page(name) for file in there if re.search(r"\.(toml|ssd|py)$", file))
    assert sum((EXAMPLES / name / file).stat().st_size for file in there) < 200_000


def long(names):
    return [pytest.param(name, marks=[pytest.mark.full] if name in names else []) for name in FOLDERS]


def walk(folder, name, until=None):
    walked = Walk(folder)
    (folder / "out").symlink_to(Path(from_environment("TRUEUP_FMUS")).resolve())
    walked.through(EXAMPLES / name / "README.md", until)
    return walked


@pytest.mark.parametrize("name", long(LONG))
def test_its_commands_print_what_the_page_shows(name, tmp_path):
    assert walk(tmp_path, name, UNTIL.get(name)).seconds


@pytest.mark.full
@pytest.mark.parametrize("name", UNTIL)
def test_its_long_commands_print_what_the_page_shows(name, tmp_path):
    walk(tmp_path, name)


def figures(text):
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


def same(drawn, committed):
    """The same words, and all figures where they were."""
    words = [re.sub(r"-?\d+(?:\.\d+)?", "#", text) for text in (drawn, committed)]
    return words[0] == words[1] and max(abs(a - b) for a, b in zip(figures(drawn), figures(committed))) <= NEAR


def test_another_picture_is_not_the_same():
    text = (EXAMPLES / "01-joint/step.svg").read_text()
    (x, y) = re.search(r"L(\d+\.\d) (\d+\.\d)", text).groups()
    assert same(text, text) and not same(text.replace("WBC", "WCB"), text)
    assert not same(text.replace(f"L{x} {y}", f"L{x} {float(y) + 2 * NEAR}", 1), text)


@pytest.mark.parametrize("name", long(LONG | {"02-arm", "04-capture", "07-space-arm", "09-flexible-joint"}))
def test_its_picture_is_of_this_program(name, tmp_path):
    command = [sys.executable, EXAMPLES / "pictures.py", from_environment("TRUEUP_BIN"), name, "--into", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    drawn = Path(done.stdout.strip())
    assert same(drawn.read_text(), (EXAMPLES / name / drawn.name).read_text())
