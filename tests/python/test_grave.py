"""After a grave finding the verdict is `unknown`, also where the nominal model cannot be simulated: then without a gap."""

import csv
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

BACKLASH = Path(__file__).resolve().parents[2] / "examples/06-backlash"


def run(*command):
    program = os.environ.get("TRUEUP_BIN")
    if not program:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    return subprocess.run([program, *map(str, command)], capture_output=True, text=True)


def with_times(folder, times):
    """The example with other times in its recordings, 12 s of each at the most."""
    folder.mkdir()
    (folder / "case.toml").write_text((BACKLASH / "case.toml").read_text())
    for file in BACKLASH.glob("*.csv"):
        rows = list(csv.reader(open(file)))[:2400]
        with open(folder / file.name, "w", newline="") as out:
            write = csv.writer(out)
            write.writerow(rows[0])
            write.writerows([repr(t), *row[1:]] for t, row in zip(times([float(r[0]) for r in rows[1:]]), rows[1:]))
    return folder


SEED = 6203
FACTORS = np.exp(np.random.default_rng(SEED).uniform(np.log(300), np.log(3e4), 2)).round(1).tolist()


@pytest.mark.parametrize("factor", [1000.0, *FACTORS])
def test_time_in_another_unit_is_a_finding_and_no_verdict(tmp_path, factor):
    print("seed", SEED, "factor", factor)
    case = with_times(tmp_path / "case", lambda t: [factor * x for x in t])
    done = run("diagnose", case, "-o", tmp_path / "out", "--json")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told == json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert told["verdict"] == "unknown" and told["unknown"]["present"] and not told["effects"] and not told["candidates"]
    grave = [f for f in told["findings"] if f["severity"] == "grave"]
    assert any("time" in f["text"] and f["file"].endswith(".csv") for f in grave), told["findings"]
    gap = told["gap"]["overall"]
    if gap is None:
        assert any("there is no gap, for the nominal model cannot be compared" in note for note in told["notes"])
    else:
        assert all(np.isfinite(gap[k]) for k in ("before", "tuned", "after", "floor"))
    assert told["augmented"] is None and told["parameters"] == {}
    assert "NaN" not in (tmp_path / "out/report.html").read_text().split("<!-- uPlot")[0]
    assert "a grave finding" in run("diagnose", case, "-o", tmp_path / "again", "--verdict-only").stdout
