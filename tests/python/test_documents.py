"""Every block of every document is valid: read by the program's own reader, or parsed by its language.

A block of a language that is not here fails: say how it is tested. README.md's commands are run by test_readme.py, blocks of
docs/systems.md by crates/cosim/tests/system/document.rs, too.

docs/SUMMARY.md names every page once, and links of the site lead somewhere.
"""

import ast
import json
import re
import subprocess
import xml.etree.ElementTree as xml
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest
from conftest import ROOT, from_environment
from input_desk import URDF
from words import without_code

BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```", re.S | re.M)
BASE = '[base]\nmass = 100.0\ninertia = [[5.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 7.0]]\n'
BODY = (
    '[[body]]\nmass = 2.0\ncenter-of-mass = [0.1, 0.0, 0.0]\nposition = [0.3, 0.0, 0.0]\n'
    "inertia = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]]\n"
)
TIP = "[[tip]]\n"
SPACES = "".join(f' xmlns:{p}="urn:{p}"' for p in ("ssd", "ssc", "ssv", "ssm"))


def documents():
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True)
    return [ROOT / line for line in listed.stdout.splitlines()] or sorted(ROOT.glob("docs/**/*.md"))


def blocks():
    for path in documents():
        text = path.read_text()
        for found in BLOCK.finditer(text):
            line = text[: found.start()].count("\n") + 1
            yield pytest.param(found[1].split()[:1], found[2], id=f"{path.relative_to(ROOT)}:{line}")


class Program:
    """The program in a folder of its own, with the FMUs that documents name."""

    def __init__(self, folder):
        self.folder = folder
        self.bin = from_environment("TRUEUP_BIN")
        for fmu in Path(from_environment("TRUEUP_FMUS")).glob("*.fmu"):
            (folder / fmu.name).symlink_to(fmu.resolve())

    def said(self, *arguments):
        done = subprocess.run([self.bin, *arguments], cwd=self.folder, capture_output=True, text=True, timeout=60)
        assert done.returncode in (0, 1), done.stderr
        lines = done.stderr.splitlines()
        return done.returncode, [re.sub(r"^error: |^  ", "", line) for line in lines if line.strip()]

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return name

    def reads_case(self, text):
        """Nothing is wrong with it but that its recordings are not there."""
        (self.folder / "case").mkdir()
        self.write("case/case.toml", text)
        code, lines = self.said("identify", "case")
        wrong = [line for line in lines if "there is no such file" not in line]
        assert code == 1 and not wrong, wrong

    def reads_sidecar(self, text):
        names = re.findall(r'^"?([^"\n=\[]+?)"? = [{"f]', text.split("[channels")[0], re.M)
        row = ",".join("1" for _ in names)
        self.write("run.csv", f"time,{','.join(names)}\n" + "".join(f"{t},{row}\n" for t in range(3)))
        self.write("run.toml", text)
        self.write("case.toml", 'model = "TwoMassJoint"\ntrain = ["run.csv"]\n')
        _, lines = self.said("identify", ".")
        assert not [line for line in lines if "run.toml" in line], lines

    def reads_robot(self, text):
        code, lines = self.said("robot", self.write("robot.toml", text))
        assert code == 0, lines

    def reads_sweep(self, text):
        self.write("joint.toml", (ROOT / "examples/01-joint/joint.toml").read_text().replace("../../out/", ""))
        # All of it is checked before the first run, of which there are none in this share.
        code, lines = self.said("sweep", self.write("sweep.toml", text), "--shard", "1/100000")
        assert code == 0, lines

    def reads_system(self, text):
        code, lines = self.said("simulate", self.write("system.toml", text), "--check")
        assert code == 0, lines

    def reads_ports(self, text):
        fmu = re.search(r'^fmu = "(.+)"', text, re.M)[1]
        code, lines = self.said("ports", fmu, "--ports", self.write("ports.toml", text))
        assert code == 0, lines

    def reads_toml(self, text):
        if re.search(r"^fmu = ", text) and re.search(r"^\[(joint|base)\b", text, re.M):
            self.reads_ports(text)
        elif re.search(r"^model = ", text, re.M):
            self.reads_case(text)
        elif re.search(r"^design = ", text, re.M):
            self.reads_sweep(text)
        elif re.search(r"^\[\[deflection\]\]", text, re.M):
            code, lines = self.said("statics", self.write("statics.toml", text))
            assert code == 0, lines
        elif re.search(r"^\[robot\]", text, re.M):
            self.write("arm.urdf", URDF.replace("fore", "tool0"))
            self.reads_robot(text)
        elif re.search(r"^\[\[body\]\]", text, re.M):
            self.reads_robot(BASE + text + TIP)
        elif re.search(r"^\[body\.link\]", text, re.M):
            self.reads_robot(BASE + BODY + text + TIP)
        elif re.search(r"^\[\[appendage\]\]", text, re.M):
            self.reads_robot(BASE + BODY + TIP + text)
        elif re.search(r"^\[columns\]", text, re.M):
            self.reads_sidecar(text)
        elif re.search(r"^\[components\..*\]", text, re.M):
            self.reads_system(text)
        elif re.search(r"^(connections|record|inputs) = |^\[inputs\]", text, re.M):
            # A part of a system: its names are those of another one.
            self.write("drive.csv", "time,load,reference\n0,0,0\n1,1,1\n")
            parts = self.write("system.toml", text + '\n[components.plant]\nfmu = "TwoMassJoint.fmi3.fmu"\n')
            _, lines = self.said("simulate", parts, "--check")
            other = [line for line in lines if not re.search(r"note: |there is no component|names no input|`plant\.\*`", line)]
            assert not other, other
        else:
            raise AssertionError("say here how this TOML is read")

    def reads_csv(self, text):
        code, lines = self.said("simulate", "TwoMassJoint.fmi3.fmu", "--input", self.write("run.csv", text), "--check")
        assert code == 0 and any("drive nothing: `motorAngle` (an output)" in line for line in lines), lines


@pytest.mark.parametrize("language, text", list(blocks()))
def test_a_block_is_read(language, text, tmp_path):
    match language:
        case ["python"]:
            ast.parse(text)
        case ["sh"] | ["console"]:
            done = subprocess.run(["bash", "-n"], input=text, capture_output=True, text=True)
            # Placeholders in capitals and `[...]` are words to a shell.
            assert done.returncode == 0, done.stderr
        case ["json"]:
            json.loads(text)
        case ["xml"]:
            xml.fromstring(f"<all{SPACES}>{text}</all>")
        case ["toml"]:
            Program(tmp_path).reads_toml(text)
        case ["csv"]:
            Program(tmp_path).reads_csv(text)
        case ["modelica"] | ["text"] | []:
            # Modelica: test_modelica.py and test_modelica_runs.py; the others are pictures and what programs print.
            assert text.strip()
        case other:
            raise AssertionError(f"a block of {other}: say here how it is tested")


def test_blocks_are_found():
    found = list(blocks())
    assert len(found) > 50 and {p.values[0][0] for p in found if p.values[0]} >= {"toml", "csv", "sh", "python", "console", "xml"}


def test_summary_names_every_page_once():
    docs = ROOT / "docs"
    named = [(docs / link).resolve() for link in re.findall(r"\]\(([^)#]+\.md)\)", (docs / "SUMMARY.md").read_text())]
    there = {*docs.rglob("*.md"), *(ROOT / "examples").rglob("README.md")} - {docs / "SUMMARY.md"}
    assert sorted(named) == sorted(there)


def site():
    """tools/site as a module."""
    loader = SourceFileLoader("site_of_documents", str(ROOT / "tools" / "site"))
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


def test_the_site_is_built_from_pages_whose_links_are_there(tmp_path):
    formulas, tool = [], site()
    tool.SOURCE = source = tmp_path
    tool.write_source(lambda tex, display="inline": formulas.append(tex) or "FORMULA")
    assert len(formulas) > 50
    copies = list(source.rglob("*.md"))
    assert len(copies) == len(tool.pages())
    for copy in copies:
        text = without_code(re.sub(r"\]\(([^)#\s:]+)(#[^)]*)?\)", r"] <\1>", copy.read_text()))
        missing = [link for link in re.findall(r"\] <([^>]+)>", text) if not (copy.parent / link).exists()]
        assert not missing and not re.search(r"\$\$|\$[^$\n]+\$", text), f"{copy}: {missing}"
    # A link that is written again leaves its surroundings as they were.
    assert (source / "index.md").read_text().count(")") == (ROOT / "README.md").read_text().count(")")
    assert (source / "files/examples/06-backlash/gap.svg").is_file()


def test_a_link_to_nowhere_is_an_error(tmp_path):
    tool, page = site(), tmp_path / "page.md"
    tool.ROOT = tmp_path
    page.write_text("[x](nowhere.md)")
    with pytest.raises(SystemExit, match=r"page\.md links to nowhere\.md, which is not there"):
        tool.page(page, {page: page}, str)


@pytest.mark.full
def test_the_site_loads_nothing_from_the_network():
    done = subprocess.run([ROOT / "tools" / "site"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.endswith("target/site/index.html\n"), done.stderr
    pages = list((ROOT / "target" / "site").rglob("*.html"))
    assert len(pages) > 80
    for page in pages:
        loaded = re.findall(r"""<(?:script|img|link|iframe)[^>]*(?:src|href)=["']((?:https?:)?//[^"']*)""", page.read_text())
        assert not loaded, f"{page}: {loaded}"
    assert (ROOT / "target/site/diagnosis.html").read_text().count("<math") > 50
