"""trueup trial from end to end: cases are made, diagnosed, tabulated, decided again and compared."""

import csv
import json
import os
import stat

import pytest

CASE = ("--plant", "joint", "--split", "none", "--seed", "100", "--count", "2", "--shard", "2/2")


def done(process):
    assert process.returncode == 0, process.stderr
    return process


@pytest.fixture(scope="module")
def trials(trueup, tmp_path_factory):
    """A joint without a gap, diagnosed for its verdict alone."""
    folder = tmp_path_factory.mktemp("trials") / "t"
    done(trueup("trial", "generate", "-o", folder, *CASE))
    said = done(trueup("trial", "run", folder, "--verdict-only")).stdout
    assert said.startswith("joint: 1 of 1 cases right; processor time "), said
    return folder


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_one_table_a_run(trials):
    (row,) = rows(trials / "results" / "table.csv")
    (case,) = (trials / "cases").iterdir()
    told = {key: row[key] for key in ("case", "split", "truth", "verdict", "claims", "right", "index")}
    assert told == {
        "case": case.name, "split": "none", "truth": "", "verdict": "no-gap", "claims": "", "right": "true", "index": "1"
    }
    assert float(row["processor_seconds"]) > 0 and 0 < float(row["before"]) < 2 * float(row["floor"])


def test_a_verdict_alone_has_no_page_and_no_fmu(trials):
    (case,) = (trials / "cases").iterdir()
    found = sorted(path.name for path in (trials / "results" / case.name).iterdir())
    assert found == ["decision.json", "diagnosis.json", "trial.toml"]
    decision = json.loads((trials / "results" / case.name / "decision.json").read_text())
    assert decision["schema"] == "trueup.decision/2" and decision["sets"]
    posterior = decision["plain"]["posterior"]
    assert {"name", "value", "unit", "deviation"} == set(posterior[0]) and all(u["deviation"] >= 0 for u in posterior)


def program(path, text):
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_a_case_that_takes_too_long_is_a_miss(trueup, trials, tmp_path):
    """By another program: one that never ends, one that gives up, and then the first next to what was stopped."""
    busy = program(tmp_path / "busy", "while :; do :; done\n")
    run = trueup("trial", "run", trials, "--results", trials / "busy", "--program", busy, "--limit", 1)
    assert run.returncode == 0 and "stopped after 1 s of processor time, a miss (--limit)" in run.stderr, run.stderr
    (row,) = rows(trials / "busy" / "table.csv")
    assert (row["verdict"], row["right"], float(row["processor_seconds"])) == ("stopped", "false", 1.0)
    fails = program(tmp_path / "fails", "echo 'error: no licence' >&2; exit 1\n")
    run = trueup("trial", "run", trials, "--results", trials / "fails", "--program", fails)
    assert run.returncode == 1 and "error: no licence" in run.stderr and "1 diagnoses failed" in run.stderr
    said = done(trueup("trial", "compare", trials, trials / "busy")).stdout
    assert "McNemar's exact test of 1 discordant cases: p = 1.000" in said
    assert f"{next((trials / 'cases').iterdir()).name} none no-gap" in said and "A no-gap; B stopped" in said


def test_a_corpus_keeps_what_went_wrong(trueup, trials, tmp_path):
    file = tmp_path / "corpus.csv"
    said = done(trueup("trial", "corpus", file, "--from", trials, "--commit", "abc")).stdout
    assert said.startswith("joint: 1 right, 0 wrong when they entered\n1 entered"), said
    assert "0 entered" in done(trueup("trial", "corpus", file, "--from", trials)).stdout
    done(trueup("trial", "generate", "-o", tmp_path / "again", "--corpus", file))
    seals = [(folder / "seals.csv").read_text() for folder in (trials, tmp_path / "again")]
    assert seals[0] == seals[1]


def test_mistakes(trueup, trials, tmp_path):
    for arguments, words in [
        (("compare", trials, tmp_path), "neither a folder of trials that `trueup trial run` has run"),
        (("generate", "-o", tmp_path / "x", "--corpus", tmp_path / "none.csv"), "there is no such corpus"),
        (("run", trials, "--limit", "0"), "write seconds, 1 or more, as in 120"),
        (("generate", "-o", tmp_path / "x", "--plant", "joint"), "--split"),
    ]:
        wrong = trueup("trial", *arguments)
        assert wrong.returncode in (1, 2) and words in wrong.stderr, (arguments, wrong.stderr)
    assert not os.listdir(tmp_path)
