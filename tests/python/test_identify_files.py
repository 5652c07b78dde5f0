"""Recordings as other programs write them: Parquet by pyarrow as it does by default, MAT by SciPy, other names and scales."""

import json

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import scipy.io
from test_identify_mistakes import HEALTHY

CASE = 'model = "TwoMassJoint"\ntrain = ["run{0}"]\n[fit]\nparameters = ["coulombFriction", "viscousFriction"]\n'


def columns():
    header, *rows = HEALTHY.split()
    return dict(zip(header.split(","), np.array([row.split(",") for row in rows], float).T))


def csv(path, table):
    path.write_text(",".join(table) + "\n" + "".join(",".join(map(repr, map(float, r))) + "\n" for r in zip(*table.values())))


WRITERS = {
    ".csv": csv,
    ".parquet": lambda path, table: pyarrow.parquet.write_table(pyarrow.table(table), path),
    ".mat": scipy.io.savemat,
}


def estimates(trueup, folder, suffix, table, sidecar=None):
    folder.mkdir()
    (folder / "case.toml").write_text(CASE.format(suffix))
    WRITERS[suffix](folder / f"run{suffix}", table)
    if sidecar:
        (folder / f"run{suffix}.toml").write_text(sidecar)
    done = trueup("identify", folder, "--method", "ls", "--json", "--fast")
    assert done.returncode == 0, done.stderr
    return [p["value"] for p in json.loads(done.stdout)["parameters"].values()]


@pytest.mark.parametrize("suffix", (".parquet", ".mat"))
def test_the_same_estimates_from_every_format(trueup, tmp_path, suffix):
    expected = estimates(trueup, tmp_path / "csv", ".csv", columns())
    assert estimates(trueup, tmp_path / "other", suffix, columns()) == expected


def test_names_and_scales_of_the_sidecar(trueup, tmp_path):
    expected = estimates(trueup, tmp_path / "csv", ".csv", columns())
    table = columns()
    table["position"] = 2 * table.pop("motorAngle")
    table["reading"] = 0.25 * table.pop("motorCurrent")
    sidecar = """[columns]
position = { variable = "motorAngle", scale = 0.5 }
reading = { variable = "motorCurrent", scale = 4.0 }
"""
    assert estimates(trueup, tmp_path / "other", ".csv", table, sidecar) == expected
