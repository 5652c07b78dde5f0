"""JSON Schemas against the readers: what one takes the other takes, what one refuses the other refuses."""

import datetime
import json
import re
import subprocess
import tomllib

import jsonschema
import pytest
from conftest import ROOT, from_environment


def trueup(*arguments):
    command = [from_environment("TRUEUP_BIN"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)


def schema(of):
    done = trueup("schema", of)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    jsonschema.Draft202012Validator.check_schema(found)
    return found


def allows(validator, text):
    """Dates of TOML are no JSON: texts in a form that no key takes."""

    def plain(value):
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        if isinstance(value, list):
            return [plain(v) for v in value]
        return {"date": {"of": str(value)}} if isinstance(value, datetime.date) else value

    return validator.is_valid(plain(tomllib.loads(text)))


def blocks(page):
    return re.findall(r"^```toml\n(.*?)^```", (ROOT / "docs" / page).read_text(), re.S | re.M)


def files(of):
    """Files that are read."""
    examples = {name: (ROOT / "examples" / name).read_text() for name in ("02-arm/arm.toml", "01-joint/joint.toml", "03-sweep/sweep.toml")}
    cases = blocks("cases.md")
    return {
        "case": [*cases[:-1], (ROOT / "examples" / "06-backlash" / "case.toml").read_text()],
        "sidecar": cases[-1:],
        "system": [examples["02-arm/arm.toml"], examples["01-joint/joint.toml"]],
        "sweep": [examples["03-sweep/sweep.toml"]],
        "ports": blocks("ports.md"),
        "robot": [(ROOT / "tests" / "tests" / "robot.toml").read_text(), *(b for b in blocks("robots.md") if b.startswith("[robot]"))],
    }[of]


ALL = ["case", "sidecar", "system", "sweep", "robot", "ports"]


@pytest.mark.parametrize("of", ALL)
def test_what_is_read_is_valid(of):
    validator = jsonschema.Draft202012Validator(schema(of))
    assert files(of)
    for text in files(of):
        errors = [e.message for e in validator.iter_errors(tomllib.loads(text))]
        assert not errors, f"{errors}\n{text}"


@pytest.mark.parametrize("of", ALL)
def test_unknown_keys_are_not(of):
    validator = jsonschema.Draft202012Validator(schema(of))
    for text in files(of):
        assert not allows(validator, "surely_no_key = 1\n" + text)


CASE = 'model = "TwoMassJoint"\ntrain = ["run.csv"]\n'
LOG = "time,motorCurrent,motorAngle\n" + "".join(f"{0.01 * k:.2f},{k % 7},{k * k}\n" for k in range(40))
VALUES = ["1", "-2.5", "true", '"x"', "[1.0, 2.0]", '["run.csv"]', '[["run.csv", "run.csv"]]', "{}", "2026-01-01"]
PLACES = {"": "", "recordings": "[recordings]\n", "fit": "[fit]\n", "channels": "[channels.motorAngle]\n", "columns": "[columns.motorAngle]\n"}


def properties(found, place):
    own = found["properties"]
    if place in ("recordings", "fit"):
        own = own[place]["properties"]
    elif place == "channels":
        own = own[place]["additionalProperties"]["anyOf"][0]["properties"]
    elif place == "columns":
        forms = own[place]["additionalProperties"]["anyOf"][0]["anyOf"]
        own = next(f["properties"] for f in forms if "properties" in f)
    return own


@pytest.mark.parametrize("place", PLACES)
def test_every_key_of_a_case_takes_what_the_schema_allows(place, tmp_path):
    """Every key with values of every form: a form that the schema does not allow is refused by the reader, by a message on the key."""
    found = schema("case")
    validator = jsonschema.Draft202012Validator(found)
    (tmp_path / "run.csv").write_text(LOG)
    (tmp_path / "case.toml").write_text(CASE)
    assert trueup("check", tmp_path).returncode == 0, "without the key the case is read"
    refused = allowed = 0
    for key in properties(found, place):
        for value in VALUES:
            line = f"{key} = {value}\n"
            text = f"{line}{CASE if key not in ('model', 'train') else ''}" if not place else f"{CASE}{PLACES[place]}{line}"
            if not place and key in ("model", "train"):
                other = 'train = ["run.csv"]\n' if key == "model" else 'model = "TwoMassJoint"\n'
                text = line + other
            (tmp_path / "case.toml").write_text(text)
            done = trueup("check", tmp_path)
            if allows(validator, text):
                allowed += 1
                continue
            refused += 1
            named = re.search(rf"case\.toml:\d+: .*[`\[]{key}[`\].]", done.stderr)
            assert done.returncode == 1 and named, f"{text}\n{done.stderr}"
    assert refused > allowed > 0
