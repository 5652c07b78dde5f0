"""Figures of docs/python.md: short runs compared with FMPy, threads, Dask.   python benchmark.py [runs] [runs of the sweep]"""

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import fmpy
import numpy as np
import trueup as tu

SWEEP = """
system = "TwoMassJoint.fmi3.fmu"
design = "latin-hypercube"
runs = {}
[run]
stop = 0.1
step = 0.01
[factors]
stiffness = {{ from = 1e-5, to = 1e-4, spacing = "log" }}
motorCurrent = {{ from = -0.03, to = 0.03 }}
[outputs]
loadAngle = {{}}
largest = {{ variable = "motorVelocity", take = "max" }}
"""


def processor(work, runs):
    """Processor time of one run in s."""
    work()
    begun = time.process_time()
    for _ in range(runs):
        work()
    return (time.process_time() - begun) / runs


def side_by_side(file, runs, steps, step):
    """The same runs by FMPy in three ways and by trueup in two."""
    print(f"{runs} runs of {steps} steps, processor time of one in ms; of FMPy the mean of fewer")
    stop = steps * step
    start_values = {"motorCurrent": 0.02}
    arguments = dict(stop_time=stop, output_interval=step, start_values=start_values)
    folder = fmpy.extract(file)
    description = fmpy.read_model_description(folder)
    instance = fmpy.instantiate_fmu(folder, description, "CoSimulation")
    kept = dict(filename=folder, model_description=description, validate=False, **arguments)

    def reused():
        instance.reset()
        fmpy.simulate_fmu(fmu_instance=instance, fmi_type="CoSimulation", **kept)

    fmu = tu.Fmu(file)
    ways = [
        ("FMPy, simulate_fmu(file)", lambda: fmpy.simulate_fmu(file, **arguments), max(runs // 200, 5)),
        ("FMPy, unpacked, description read", lambda: fmpy.simulate_fmu(**kept), max(runs // 50, 5)),
        ("FMPy, one instance, reset", reused, max(runs // 10, 5)),
        ("trueup, simulate_fmu(file)", lambda: tu.simulate_fmu(file, **arguments), runs),
        ("trueup, Fmu.simulate", lambda: fmu.simulate(stop=stop, step=step, parameters=start_values), runs),
    ]
    found = {name: 1e3 * processor(work, n) for name, work, n in ways}
    own = found["trueup, simulate_fmu(file)"]
    for name, spent in found.items():
        print(f"  {name:36}{spent:10.3f}   {spent / own:8.1f} times trueup's simulate_fmu")
    shutil.rmtree(folder, ignore_errors=True)


def threads(file):
    fmu = tu.Fmu(file)
    t = np.linspace(0, 1, 1001)
    inputs = {"motorCurrent": 0.02 * np.sin(3 * t)}

    def runs(n):
        for _ in range(n):
            fmu.simulate(t, inputs)

    def seconds(n):
        all_threads = [threading.Thread(target=runs, args=(120 // n,)) for _ in range(n)]
        begun = time.perf_counter()
        for thread in all_threads:
            thread.start()
        for thread in all_threads:
            thread.join()
        return time.perf_counter() - begun

    tries = sorted(seconds(1) / seconds(2) for _ in range(7))
    print(f"two threads against one, 120 runs of 1000 steps: median {tries[3]:.2f}, best {tries[-1]:.2f} times as fast")


def workers(folder, runs):
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    from distributed import Client, LocalCluster
    from trueup._sweep import batch

    file = str(folder / "sweep.toml")
    Path(file).write_text(SWEEP.format(runs))
    half = runs // 2
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        list(pool.map(batch, [file] * 2, [None] * 2, [1] * 2, [1] * 2))
        begun = time.perf_counter()
        list(pool.map(batch, [file] * 2, [None] * 2, [1, half + 1], [half] * 2))
        bare = time.perf_counter() - begun
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        tu.sweep(file, client, runs=1000)
        begun = time.perf_counter()
        frame = tu.sweep(file, client)
        dask = time.perf_counter() - begun
    assert len(frame) == runs and frame["reason"].isna().all()
    print(f"{runs} runs of the joint: two bare loops {bare:.1f} s, two Dask workers {dask:.1f} s: {bare / dask:.2f} of the throughput")


def main():
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 10000
    swept = int(sys.argv[2]) if len(sys.argv) > 2 else 100000
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([tu.program(), "fmu", "pack", "TwoMassJoint", "--fmi=3", "-o", folder], check=True, stdout=subprocess.DEVNULL)
        file = os.path.join(folder, "TwoMassJoint.fmi3.fmu")
        side_by_side(file, runs, 5, 0.01)
        side_by_side(file, runs // 100, 1000, 0.001)
        threads(file)
        workers(Path(folder), swept)


if __name__ == "__main__":
    main()
