"""trueup lab: a sealed joint, an experiment on it, and a diagnosis of all rounds as one case."""

import json

import pytest


def done(process):
    assert process.returncode == 0, process.stderr
    return process


def test_a_proposal_is_run_and_added_to_the_case(trueup, tmp_path):
    rig = tmp_path / "rig"
    said = done(trueup("lab", "new", "-o", rig, "--seed", "17", "--split", "none")).stdout
    assert "20 s" in said and "seal of its key: " in said
    (tmp_path / "push.csv").write_text("time,motorCurrent\n0,0\n0.5,0\n1,0\n")
    proposal = tmp_path / "proposal.toml"
    proposal.write_text('rig = "rig"\ninput = "push.csv"\n')
    assert "round 1, 1.00 s" in done(trueup("lab", "run", proposal)).stdout
    assert '"round-1.csv"]' in (rig / "case" / "case.toml").read_text()
    checked = json.loads(done(trueup("check", rig / "case", "--json")).stdout)
    assert [f for f in checked["findings"] if f["severity"] == "error"] == []
    assert any(r["name"] == "round-1.csv" for r in checked["recordings"])

    def refused(*command):
        process = trueup("lab", *command)
        assert process.returncode == 1, process.stdout
        return process.stderr

    assert "push.csv: it names no rig; write `rig = " in refused("run", tmp_path / "push.csv")
    proposal.write_text('rig = "rig"\n')
    assert "proposal.toml" in refused("run", proposal) and "input" in refused("run", proposal)
    assert "a rig is here already" in refused("new", "-o", rig)
    assert "no rig is here" in refused("run", tmp_path / "push.csv", "--rig", tmp_path)


@pytest.mark.full
def test_what_is_proposed_is_run_and_diagnosed_again(trueup, tmp_path):
    """Of a friction of motor or load, which are one body without a spring: each round's proposal is within the limits."""
    rig = tmp_path / "rig"
    done(trueup("lab", "new", "-o", rig, "--seed", "5", "--split", "unidentifiable"))
    for number in (1, 2):
        found = tmp_path / f"found-{number}"
        done(trueup("diagnose", rig / "case", "-o", found))
        verdict = json.loads((found / "diagnosis.json").read_text())
        print(verdict["verdict"], [(e["id"], e["probability"]) for e in verdict["effects"]], verdict["next_experiment"])
        if not (found / "next-experiment.csv").exists():
            break
        assert f"round {number}" in done(trueup("lab", "run", found / "next-experiment.csv", "--rig", rig)).stdout
