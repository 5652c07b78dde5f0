"""Results as Python reads them: CSV through FMPy, Parquet through pyarrow, the same bits in both."""

import json

import numpy as np
import pyarrow.parquet
import pytest
from fmpy.util import read_csv

MODELS = ("TwoMassJoint", "PlanarManipulator", "JointController", "ManipulatorController")


@pytest.mark.parametrize("version", (2, 3))
@pytest.mark.parametrize("model", MODELS)
def test_csv_and_parquet_hold_the_same_bits(trueup, fmu, tmp_path, model, version):
    for name in ("r.csv", "r.parquet"):
        done = trueup("simulate", fmu(model, version), "--stop", 0.5, "--step", 0.001, "-o", tmp_path / name)
        assert done.returncode == 0, done.stderr
    csv = read_csv(tmp_path / "r.csv")
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    assert tuple(table.column_names) == csv.dtype.names
    assert len(csv) == table.num_rows == 501
    for name in table.column_names:
        column = table[name].to_numpy()
        assert np.array_equal(column.astype(float).view(np.int64), csv[name].view(np.int64)), name

    info = json.loads(trueup("fmu", "info", "--json", fmu(model, version)).stdout)
    metadata = table.schema.metadata
    assert metadata[b"unit.time"] == b"s"
    units = {v["name"]: v["unit"] for v in info["variables"] if v.get("unit")}
    for name in table.column_names[1:]:
        unit = units.get(name, units.get(name.split("[")[0]))
        assert metadata.get(f"unit.{name}".encode(), b"").decode() == (unit or ""), name
