"""trueup bench from end to end: a sealed case, an entry of a program, a receipt, and the page of scores."""

import csv
import hashlib
import json
import shutil
import sys

import pytest

# A program that diagnoses every case alike.
STAND_IN = """#!{python}
import json, pathlib, sys
out = pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
claim = {{"id": "backlash", "component": "motor", "joint": 1, "probability": 0.7, "parameters": {{"backlashWidth": {{"value": 0.1, "ci95": [0.0, 0.2]}}}}}}
found = {{"verdict": "effects", "effects": [claim], "candidates": [claim], "unknown": {{"probability": 0.2}}}}
out.joinpath("diagnosis.json").write_text(json.dumps(found))
"""


def done(process):
    assert process.returncode == 0, process.stderr
    return process


@pytest.fixture(scope="module")
def bench(trueup, tmp_path_factory):
    """A benchmark of one joint, which its own seed draws quickly."""
    folder = tmp_path_factory.mktemp("bench") / "b"
    said = done(trueup("bench", "make", "-o", folder, "--count", "1", "--seed", "17")).stdout
    seals = hashlib.sha256((folder / "public" / "seals.csv").read_bytes()).hexdigest()
    assert f"publish now: seals {seals}" in said
    return folder


@pytest.fixture(scope="module")
def entry(trueup, bench, tmp_path_factory):
    folder = tmp_path_factory.mktemp("entry")
    program = folder / "program"
    program.write_text(STAND_IN.format(python=sys.executable))
    program.chmod(0o755)
    # A share alone writes no entry.
    command = ("bench", "run", bench / "public", "-o", folder / "mine.csv", "--program", program)
    shared = done(trueup(*command, "--shard", "1/2"))
    assert "the entry is written by a run without --shard" in shared.stderr and not (folder / "mine.csv").exists()
    said = done(trueup(*command)).stdout
    assert "cases: 1 with verdict, 1 with answer, 1 with effect, 1 with parameter, 0 with output, 1 with cost" in said
    return folder / "mine.csv"


def test_an_entry_has_what_the_program_reported(entry):
    rows = list(csv.DictReader(entry.open(newline="")))
    assert [(r["item"], r["name"], r["place"], r["value"]) for r in rows[:-1]] == [
        ("verdict", "effects", "", ""),
        ("answer", "backlash", "", "0.7"),
        ("answer", "unknown", "", "0.2"),
        ("effect", "backlash", "motor/1", "0.7"),
        ("parameter", "backlash.backlashWidth", "", "0.1"),
    ]
    assert rows[-1]["item"] == "cost" and float(rows[-1]["value"]) > 0


def test_a_receipt_has_the_hash_of_the_entry_and_of_the_seals(trueup, bench, entry, tmp_path):
    done(trueup("bench", "submit", bench / "public", entry, "-o", tmp_path / "receipt.toml"))
    receipt = (tmp_path / "receipt.toml").read_text()
    assert hashlib.sha256(entry.read_bytes()).hexdigest() in receipt and 'entry = "mine"' in receipt
    assert hashlib.sha256((bench / "public" / "seals.csv").read_bytes()).hexdigest() in receipt


def test_entries_are_scored_side_by_side(trueup, bench, entry, tmp_path):
    (key,) = (bench / "sealed" / "keys").glob("*.toml")
    truth = key.read_text()
    other = tmp_path / "unsure.csv"
    case = key.stem
    other.write_text(f"case,item,name,place,recording,time,value,low,high\n{case},verdict,unknown,,,,,,\n")
    done(trueup("bench", "score", bench, entry, other, "-o", tmp_path / "page.md"))
    page = (tmp_path / "page.md").read_text()
    assert "|  | mine | unsure |" in page.replace("| | ", "|  | ") and "| cases | 1 | 1 |" in page
    rows = {r["entry"]: r for r in csv.DictReader((tmp_path / "page.csv").open(newline=""))}
    assert (rows["mine"]["right"] == "true") == ('effects = ["backlash"]' in truth)
    assert rows["unsure"]["right"] == "false" and float(rows["unsure"]["log_score"]) < -8


def test_mistakes(trueup, bench, entry, tmp_path):
    def refused(*command):
        process = trueup("bench", *command)
        assert process.returncode == 1 and not (tmp_path / "out").exists()
        return process.stderr

    assert "no `bench.toml` in it: name the folder `public`" in refused("run", bench, "-o", tmp_path / "out")
    empty = tmp_path / "empty.csv"
    empty.write_text("case,item,name,place,recording,time,value,low,high\n")
    said = refused("submit", bench / "public", empty, "-o", tmp_path / "out")
    assert "1 of 1 cases have no verdict" in said and "empty.csv" in said
    entrant = tmp_path / "entrant"
    shutil.copytree(bench / "public", entrant / "public")
    assert "there are no keys in it" in refused("score", entrant, entry, "-o", tmp_path / "out")
    assert "another number of cases" in refused("make", "-o", bench, "--count", "2", "--seed", "17")
    assert trueup("bench", "make", "-o", tmp_path / "out", "--tier", "lathe").returncode == 2


@pytest.mark.full
def test_this_program_enters(trueup, bench, tmp_path):
    """Its own diagnosis of the public case, without the hold-out readings, names the effect that the key has."""
    done(trueup("bench", "run", bench / "public", "-o", tmp_path / "own.csv"))
    done(trueup("bench", "score", bench, tmp_path / "own.csv", "-o", tmp_path / "page.md"))
    (row,) = csv.DictReader((tmp_path / "page.csv").open(newline=""))
    assert row["right"] == "true" and float(row["confidence"]) > 0.5, json.dumps(row)
