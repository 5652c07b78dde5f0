"""The examples of the README are what their documents say."""

import json
from pathlib import Path

BACKLASH = Path(__file__).resolve().parents[2] / "examples/backlash"


def test_the_case_with_play_is_diagnosed(trueup, tmp_path):
    """Play is what was left out of its model: found, sized, and all of the gap that it makes closed."""
    done = trueup("diagnose", BACKLASH, "-o", tmp_path / "found", "--json", "--verdict-only")
    assert done.returncode == 0, done.stderr
    diagnosis = json.loads(done.stdout)
    assert diagnosis["verdict"] == "effects"
    (effect,) = diagnosis["effects"]
    assert effect["id"] == "backlash" and effect["probability"] > 0.9
    gap = effect["parameters"]["backlashGap"]
    assert gap["ci95"][0] < 0.08 < gap["ci95"][1] and abs(gap["value"] - 0.08) < 0.004
    overall = diagnosis["gap"]["overall"]
    assert overall["after"] < 2 * overall["floor"] < overall["tuned"]
    # Tied to its data: sha256sum case.toml *.csv | sha256sum
    assert set(diagnosis["inputs"]["files"]) == {p.name for p in BACKLASH.iterdir() if p.suffix in (".csv", ".toml")}
    assert len(diagnosis["inputs"]["sha256"]) == 64
    # Progress is in words: no label of the search, no long numbers.
    assert "excess" not in done.stderr and "[\"" not in done.stderr
    told = [float(line.split("%")[0]) for line in done.stderr.splitlines() if "%  " in line[:8]]
    assert told and told == sorted(told), done.stderr
