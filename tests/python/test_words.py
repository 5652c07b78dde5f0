"""Documents, comments and messages do without the words that CONTRIBUTING.md lists."""

import re
import subprocess
from pathlib import Path

from conftest import ROOT
from words import PYTHON, RUST, comments_and_messages, read_by_people, without_code

# Its users' history keeps the words that it was written in.
HISTORY = "CHANGELOG.md"
ENDS = (".md", ".rs", ".py", ".toml")
BUILT = {"target", "out", ".venv"}


def listed_words():
    table = (ROOT / "CONTRIBUTING.md").read_text().split("| not | but |", 1)[1].split("\n\n", 1)[0]
    return [re.findall("`([^`]+)`", line.split("|")[1]) for line in table.splitlines()[2:]]


WORDS = [word for group in listed_words() for word in group]
PATTERN = re.compile(r"\b(" + "|".join(WORDS).replace(" ", r"\s+") + r")\b", re.I)
SINGLE = {word for word in WORDS if " " not in word}
PHRASES = [re.compile(word.replace(" ", r"\s+")) for word in WORDS if " " in word]


def may_have_some(text):
    """Most files have none, which this finds sooner than the pattern does."""
    text = text.lower()
    return not SINGLE.isdisjoint(re.findall("[a-z]+", text)) or any(phrase.search(text) for phrase in PHRASES)


def images(text):
    return [f"{text.count(chr(10), 0, hit.start()) + 1}: {hit[0]}" for hit in PATTERN.finditer(text)]


def files():
    listed = subprocess.run(["git", "ls-files", *(f"*{end}" for end in ENDS)], cwd=ROOT, capture_output=True, text=True).stdout.split()
    # Without a history, as in a source archive: all but what is built or fetched.
    written = lambda path: path.suffix in ENDS and not BUILT & {*path.relative_to(ROOT).parts}  # noqa: E731
    found = [ROOT / name for name in listed] or list(filter(written, ROOT.rglob("*.*")))
    scripts = [path for path in (ROOT / "tools").iterdir() if path.is_file()] + [ROOT / "test"]
    return [path for path in found + scripts if path.name != HISTORY and path.is_file()]


def test_forty_images_are_listed():
    assert len(listed_words()) == 40


def test_words_are_seen_in_pages_and_no_code():
    assert images(without_code("a `told` b\n```sh\ntold\n```\n[x](told.md) Told,\nhas a  say")) == ["5: Told", "6: has a  say"]


def test_words_are_seen_in_comments_and_messages_and_no_code():
    rust = """let told = 'x'; // told, not a.told nor [a](told)\nf("told", "is told", "a {told} b --beside `told`",\n r#"it "lies""#); /* a\nstands */ let x = "\\\n anew";"""
    assert images(comments_and_messages(rust, RUST)) == ["1: told", "2: told", "3: lies", "4: stands", "5: anew"]
    python = """told = 'told'  # told\nx = "is told"\ndef f():\n    \'\'\'A page\n    lies.\'\'\'\n    return f"a {told} b" + 'it "stands"'\n"""
    assert images(comments_and_messages(python, PYTHON)) == ["1: told", "2: told", "5: lies", "6: stands"]


def test_no_file_has_any_of_the_words():
    checked, complaints = files(), []
    assert len(checked) > 500
    for path in checked:
        text = path.read_text(errors="replace")
        read = read_by_people(path, text) if may_have_some(text) else ""
        hits = images(read) if may_have_some(read) and path != Path(__file__) else []
        complaints += [f"{path.relative_to(ROOT)}:{hit}" for hit in hits]
    assert not complaints, "\n".join(["CONTRIBUTING.md lists what to write instead:", *complaints])
