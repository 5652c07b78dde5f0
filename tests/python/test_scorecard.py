"""docs/scorecard.md names the engine that it is of, and states it where the engine has changed since."""

import re
import subprocess

import pytest
from conftest import ROOT

PAGE = (ROOT / "docs" / "scorecard.md").read_text()
CHANGED = "**The engine has changed since these figures.**"


def named():
    return re.search(r"^Sources of the engine: `([0-9a-f]{16})`", PAGE, re.M)[1]


def test_the_engine_is_named():
    assert named() and re.search(r"commit [0-9a-f]{7}", PAGE)


@pytest.mark.full
def test_the_page_states_whether_it_is_of_this_engine():
    digest = subprocess.run([ROOT / "tools" / "engine-digest"], capture_output=True, text=True, check=True).stdout.strip()
    remedy = f"run the trials again (docs/blind-trials.md) and write `{digest}`, or add: {CHANGED}"
    assert (digest != named()) == (CHANGED in PAGE), f"docs/scorecard.md is of `{named()}`, the engine is `{digest}`: {remedy}"
