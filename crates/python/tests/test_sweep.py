"""Sweeps: the program's table, Dask's workers, their throughput."""

import os
import time

import pandas as pd
import pytest
import trueup as tu

SWEEP = """
system = "TwoMassJoint.fmi3.fmu"
design = "latin-hypercube"
runs = {runs}
[run]
stop = {stop}
step = 0.01
[factors]
stiffness = {{ from = 1e-5, to = 1e-4, spacing = "log" }}
motorCurrent = {{ from = -0.03, to = 0.03 }}
[outputs]
loadAngle = {{}}
largest = {{ variable = "motorVelocity", take = "max" }}
late = {{ variable = "motorVelocity", take = "time", above = 1e3 }}
"""


@pytest.fixture
def sweep(fmus):
    def write(runs, stop=0.1):
        file = fmus / f"sweep-{runs}-{stop}.toml"
        file.write_text(SWEEP.format(runs=runs, stop=stop))
        return file

    return write


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        yield client


def test_the_frame_is_the_programs_table(sweep, program, tmp_path):
    file = sweep(60)
    frame = tu.sweep(file)
    program("sweep", file)
    program("sweep", "merge", file, "-o", tmp_path / "table.parquet")
    table = pd.read_parquet(tmp_path / "table.parquet")
    assert set(frame.columns) == set(table.columns)
    table = table[frame.columns]
    pd.testing.assert_frame_equal(
        frame.drop(columns="reason"), table.drop(columns="reason"), check_dtype=False, check_exact=True
    )
    assert frame["reason"].isna().all() and frame["late"].isna().any()


def test_workers_give_the_same_frame(sweep, client):
    file = sweep(60)
    told = []
    frame = tu.sweep(file, client, batch_runs=7, progress=lambda part, what: told.append(part))
    pd.testing.assert_frame_equal(frame, tu.sweep(file))
    assert told == sorted(told) and told[-1] == 1


def test_a_run_that_fails_is_a_row_with_its_reason(fmus):
    file = fmus / "failing.toml"
    file.write_text(SWEEP.format(runs=4, stop=0.1).replace("from = 1e-5", "from = -1e-4").replace(', spacing = "log"', ""))
    frame = tu.sweep(file)
    assert frame["reason"].notna().any() and frame["reason"].isna().any()
    assert frame.loc[frame["reason"].notna(), "loadAngle"].isna().all()


def test_mistakes_are_told_with_their_line(fmus):
    file = fmus / "wrong.toml"
    file.write_text(SWEEP.format(runs=4, stop=0.1).replace("loadAngle = ", "loadAngel = "))
    with pytest.raises(tu.Error) as caught:
        tu.sweep(file)
    assert caught.value.file == str(file) and caught.value.variable == "loadAngel" and caught.value.mend


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="there is one processor")
def test_workers_lose_little_of_the_bare_loop(sweep, client):
    """Two workers against two processes that only loop, 20000 runs: at least 0.9 of their throughput, best of three."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    from trueup._sweep import batch

    file = str(sweep(20000))
    half = 10000

    def bare():
        with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
            list(pool.map(batch, [file] * 2, [None] * 2, [1] * 2, [1] * 2))  # processes and files are ready then
            begun = time.perf_counter()
            list(pool.map(batch, [file] * 2, [None] * 2, [1, half + 1], [half] * 2))
            return time.perf_counter() - begun

    def dask():
        begun = time.perf_counter()
        assert len(tu.sweep(file, client)) == 2 * half
        return time.perf_counter() - begun

    dask()
    best = max(bare() / dask() for _ in range(3))
    assert best >= 0.9, best
