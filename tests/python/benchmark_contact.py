"""What it costs to couple a capture (examples/05-coupled-capture/capture-coupled.toml, S2's SIM2) out of three FMUs, against the same capture in one FMU with
located events; whether both come to the same at the places of the paper's tests; and CaptureScene compared with a loop in NumPy.

    python tests/python/benchmark_contact.py target/release/trueup        (the packed library is next to the program)
"""

import csv
import ctypes.util
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STOP, STEPS = 30.0, (2e-3, 1e-3, 5e-4)
ALGORITHMS = ("jacobi", "gauss-seidel", "extrapolate", "iterative")
SYSTEM = tomllib.loads((EXAMPLES / "05-coupled-capture/capture-coupled.toml").read_text())
LINKS = [link.split(" -> ") for link in SYSTEM["connections"]]
ENERGY = 0.5 * 1778.7 * 0.005**2  # J, at the start
NEEDED = [f"{body}.{name}" for body in ("chaser", "target") for name in ("velocity[1]", "velocity[2]", "rate", "kineticEnergy")]
NEEDED += [f"contact.{name}" for name in ("elasticEnergy", "dissipatedEnergy", "jawWork")]


def program(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=FOLDER, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def last_row(name, text):
    """End of a run of the system `text`, and its seconds without those of a run that ends at once."""
    took = {}
    for stop in ("1e-9", None):
        (FOLDER / f"{name}.toml").write_text(text if stop is None else text.replace(f"stop = {STOP:g}", f"stop = {stop}"))
        began = time.perf_counter()
        program("simulate", f"{name}.toml", "-o", f"{name}.csv")
        took[stop] = time.perf_counter() - began
    with open(FOLDER / f"{name}.csv") as file:
        rows = list(csv.reader(file))
    return dict(zip(rows[0], rows[-1])), took[None] - took["1e-9"]


def in_one(tolerance, interface, step):
    text = f'[run]\nstop = {STOP:g}\nstep = {step}\ntolerance = {tolerance}\n[components.scene]\nfmu = "out/CaptureScene.fmi3.fmu"\n'
    row, took = last_row("scene", text + f'interface = "{interface}"\n')
    motion = [float(row[f"scene.target{v}"]) - float(row[f"scene.chaser{v}"]) for v in ("Velocity[1]", "Velocity[2]", "Rate")]
    return motion, float(row["scene.dissipatedEnergy"]), took


def judged(values, reference):
    """Errors of the final relative velocity (m/s) and of the dissipated energy, energy that the coupling made (J)."""
    v = {name: float(values[name]) for name in NEEDED}
    off = [v[f"target.velocity[{i}]"] - v[f"chaser.velocity[{i}]"] - reference[0][i - 1] for i in (1, 2)]
    stored = v["chaser.kineticEnergy"] + v["target.kineticEnergy"] + v["contact.elasticEnergy"]
    made = stored + v["contact.dissipatedEnergy"] - v["contact.jawWork"] - ENERGY
    return np.hypot(*off), v["contact.dissipatedEnergy"] - reference[1], made


def ours(algorithm, step, version=3):
    text = (EXAMPLES / "05-coupled-capture/capture-coupled.toml").read_text().replace("../../out", "out").replace("fmi3", f"fmi{version}")
    for old, new in (("step = 0.001", f"step = {step}"), ('"extrapolate"', f'"{algorithm}"')):
        assert old in text
        text = text.replace(old, new)
    return last_row("coupled", text)


def files():
    return {name: str(FOLDER / "out" / f"{Path(c['fmu']).name.replace('fmi3', 'fmi2')}") for name, c in SYSTEM["components"].items()}


def starts():
    return [(name, variable, float(v)) for name, c in SYSTEM["components"].items() for variable, v in c.get("start", {}).items()]


def by_fmpy(step):
    """The loop that a user of FMPy writes: all get the values of the last step, all step."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    slaves, references = {}, {}
    for name, file in files().items():
        description = read_model_description(file)
        references |= {f"{name}.{v.name}": v.valueReference for v in description.modelVariables}
        slave = FMU2Slave(
            guid=description.guid, unzipDirectory=extract(file), instanceName=name,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )
        slave.instantiate()
        slaves[name] = slave
    for name, variable, value in starts():
        slaves[name].setReal([references[f"{name}.{variable}"]], [value])
    for slave in slaves.values():
        slave.setupExperiment(startTime=0.0, stopTime=STOP)
        slave.enterInitializationMode()
    get = lambda name: slaves[name.split(".")[0]].getReal([references[name]])[0]

    def exchange():
        values = [get(source) for source, _ in LINKS]
        for (_, target), value in zip(LINKS, values):
            slaves[target.split(".")[0]].setReal([references[target]], [value])

    for _ in range(2):  # bodies, then contact
        exchange()
    for slave in slaves.values():
        slave.exitInitializationMode()
    began = time.perf_counter()
    for k in range(round(STOP / step)):
        for slave in slaves.values():
            slave.doStep(k * step, step)
        exchange()
    took = time.perf_counter() - began
    values = {name: get(name) for name in NEEDED}
    for slave in slaves.values():
        slave.terminate()
        slave.freeInstance()
    return values, took


def by_libcosim(step):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    execution = CosimExecution.from_step_size(round(step * 1e9))
    slaves, references = {}, {}
    for name, file in files().items():
        slaves[name] = execution.add_local_slave(CosimLocalSlave(file, name))
        for v in execution.slave_variables(slaves[name]):
            references[f"{name}.{v.name.decode() if isinstance(v.name, bytes) else v.name}"] = v.reference
    observer = CosimObserver.create_last_value()
    execution.add_manipulator(CosimManipulator.create_override())
    execution.add_observer(observer)
    of = lambda name: slaves[name.split(".")[0]]
    for name, variable, value in starts():
        assert execution.real_initial_value(slaves[name], references[f"{name}.{variable}"], value)
    for source, target in LINKS:
        failed = execution.connect_real_variables(of(source), references[source], of(target), references[target])
        assert not failed, (source, target)
    began = time.perf_counter()
    assert execution.simulate_until(round(STOP * 1e9))
    took = time.perf_counter() - began
    return {name: observer.last_real_values(of(name), [references[name]])[0] for name in NEEDED}, took


def by_ecos(step):
    from ecospy import EcosSimulation, EcosSimulationStructure

    name_of = lambda name: "::".join(name.split(".", 1))
    structure = EcosSimulationStructure()
    for name, file in files().items():
        structure.add_model(name, file)
    for source, target in LINKS:
        structure.make_real_connection(name_of(source), name_of(target))
    structure.add_parameter_set("start", {f"{name}::{variable}": value for name, variable, value in starts()})
    with EcosSimulation(structure=structure, step_size=step) as simulation:
        simulation.init(parameter_set="start")
        began = time.perf_counter()
        simulation.step(num_steps=round(STOP / step))
        took = time.perf_counter() - began
        values = {name: simulation.get_real(name_of(name)) for name in NEEDED}
        simulation.terminate()
    return values, took


def others():
    yield "FMPy, a loop in Python (Jacobi)", by_fmpy
    yield "libcosim (Jacobi)", by_libcosim
    if ctypes.util.find_library("tbb") is None:
        print("SKIPPED: ecos needs the system library libtbb.so.12")
        return
    yield "ecos (Jacobi)", by_ecos


def couplings(reference):
    print("| who | step, ms | relative velocity off by, m/s | dissipated energy off by, J | energy made, J | s |\n|---|---|---|---|---|---|")
    table = {}
    for step in STEPS:
        runs = [(f"Trueup, {a}", lambda h, a=a: ours(a, h)) for a in ALGORITHMS] + list(others())
        runs += [(f"Trueup, {a}, FMI 2.0", lambda h, a=a: ours(a, h, 2)) for a in ALGORITHMS]
        for who, run in runs:
            values, took = run(step)
            velocity, dissipated, made = table[who, step] = judged(values, reference)
            print(f"| {who} | {1e3 * step:g} | {velocity:.1e} | {dissipated:+.1e} | {made:+.1e} | {took:.2f} |", flush=True)
    for step in STEPS:
        ratio = table["Trueup, jacobi", step][0] / table["Trueup, extrapolate", step][0]
        print(f"step {1e3 * step:g} ms: Jacobi is {ratio:.1f} times as far off as extrapolation")


def seconds_a_run(tolerance, runs=200):
    """Of CaptureScene by Co-Simulation: many runs in a row with all that a sweep does for each, so that the start of a process counts for nothing."""
    (FOLDER / "same.toml").write_text(
        f'system = "out/CaptureScene.fmi3.fmu"\ndesign = "list"\n[run]\nstop = {STOP:g}\nstep = 0.1\ntolerance = {tolerance}\n'
        f'[factors]\nstiffness = {{ values = {[20000.0] * runs} }}\n[outputs]\noutcome = {{}}\n'
    )
    shutil.rmtree(FOLDER / "same.runs", ignore_errors=True)
    began = time.perf_counter()
    program("sweep", "same.toml")
    return (time.perf_counter() - began) / runs


def against_three(reference):
    """CaptureScene by Co-Simulation at the accuracy of the best coupling at 1 ms."""
    values, _ = ours("extrapolate", 1e-3)
    wanted = judged(values, reference)[0]
    for tolerance in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        motion, *_ = in_one(tolerance, "co-simulation", 0.1)
        off = np.hypot(*(np.array(motion) - reference[0])[:2])
        if off <= wanted:
            break
    ratios = [ours("extrapolate", 1e-3)[1] / seconds_a_run(tolerance) for _ in range(7)]
    low, ratio, high = (np.quantile(ratios, q) for q in (0.25, 0.5, 0.75))
    print(
        f"three FMUs off by {wanted:.1e} m/s, CaptureScene at tolerance {tolerance} by {off:.1e} m/s: "
        f"{ratio:.0f} times as fast (median of {len(ratios)} pairs, middle half {low:.0f} to {high:.0f})"
    )


def in_numpy(step):
    """SIM2 as a researcher writes it: a state vector, Runge and Kutta's fourth-order method, contacts wherever a stage finds them."""
    k, eta, reach, closing = 20000.0, 900.0, 0.1, 5.0
    mass, inertia = np.array([1778.7, 7900.0]), np.array([762.0, 129112.2])
    hand, port = np.array([3.32, 0.0]), np.array([-5.0, -1.3])
    opened = np.array([[0.0, 0.0], [0.25, 0.2], [0.25, -0.2]])
    closed = np.array([[0.0, 0.0], [0.06, 0.085], [0.06, -0.085]])

    def turned(angle):
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def across(rate, r):
        return rate * np.array([-r[1], r[0]])

    def moment(r, f):
        return r[0] * f[1] - r[1] * f[0]

    def rates(t, x):
        position, angle, velocity, rate = x[:4].reshape(2, 2), x[4:6], x[6:10].reshape(2, 2), x[10:12]
        u = min(t / closing, 1.0)
        axes = turned(angle[0])
        balls = hand + opened + u * u * (3.0 - 2.0 * u) * (closed - opened)
        moving = 6.0 * u * (1.0 - u) / closing * (closed - opened)
        lever_port = turned(angle[1]) @ port
        force, torque = np.zeros((2, 2)), np.zeros(2)
        for ball, move in zip(balls, moving):
            lever = axes @ ball
            apart = position[1] + lever_port - position[0] - lever
            distance = np.linalg.norm(apart)
            depth = reach - distance
            if depth > 0.0:
                n = apart / distance
                parting = velocity[1] + across(rate[1], lever_port) - velocity[0] - across(rate[0], lever) - axes @ move
                approach = -n @ parting
                push = (k * depth + eta * max(approach, 0.0)) * n
                force += [-push, push]
                # Where the surfaces meet or the centres are: the same line.
                torque += [-moment(lever, push), moment(lever_port, push)]
        return np.concatenate([x[6:12], (force / mass[:, None]).ravel(), torque / inertia])

    x = np.zeros(12)
    x[2:4] = hand + [0.12, 0.01] - port
    x[6] = 0.005
    for i in range(round(STOP / step)):
        t = i * step
        a = rates(t, x)
        b = rates(t + step / 2, x + step / 2 * a)
        c = rates(t + step / 2, x + step / 2 * b)
        d = rates(t + step, x + step * c)
        x = x + step / 6 * (a + 2 * b + 2 * c + d)
    return x[8:10] - x[6:8]


def against_numpy(reference):
    """CaptureScene by Co-Simulation compared with the loop."""
    tolerance = 1e-8
    scene = in_one(tolerance, "co-simulation", 0.1)[0]
    for step in (1e-3, 5e-3):
        pairs = []
        for _ in range(5):
            began = time.perf_counter()
            loop = in_numpy(step)
            took = time.perf_counter() - began
            pairs.append((took, seconds_a_run(tolerance)))
        loop_off, scene_off = (np.hypot(*np.subtract(m[:2], reference[0][:2])) for m in (loop, scene))
        ratio = statistics.median(numpy / ours for numpy, ours in pairs)
        numpy, one = (statistics.median(times) for times in zip(*pairs))
        print(
            f"NumPy at {1e3 * step:g} ms is off by {loop_off:.1e} m/s in {numpy:.2f} s, CaptureScene by {scene_off:.1e} m/s "
            f"in {1e3 * one:.1f} ms: {ratio:.0f} times as fast (median of {len(pairs)} pairs)"
        )


def cells():
    """Outcomes at the places of the paper's tests, in one FMU and coupled."""
    import pyarrow.parquet as pq

    scene = tomllib.loads((EXAMPLES / "04-capture/capture.toml").read_text())["components"]["scene"]["start"]
    for name in ("capture.toml", "capture-cells.toml"):
        (FOLDER / name).write_text((EXAMPLES / "04-capture" / name).read_text().replace("../../out", "out"))
    program("sweep", "capture-cells.toml")
    program("sweep", "merge", "capture-cells.toml")
    table = pq.read_table(FOLDER / "capture-cells.parquet").to_pydict()
    base = (EXAMPLES / "05-coupled-capture/capture-coupled.toml").read_text().replace("../../out", "out")
    base = "\n".join(line for line in base.splitlines() if "initialPosition" not in line)
    gripper = "\n".join(f'"{k}" = {float(v)!r}' for k, v in scene.items() if not k.startswith("initialPort"))

    def coupled(angle, x, y, step):
        c, s = np.cos(angle), np.sin(angle)
        # From the end effector to the port, and on to the target's centre of mass.
        at = float(3.32 + x + c * 5.0 - s * 1.3), float(y + s * 5.0 + c * 1.3)
        text = base.replace("[components.target]", f"[components.contact.start]\n{gripper}\n\n[components.target]")
        text = text.replace("step = 0.001", f"step = {step}").replace(
            'initialVelocity', 'initialPosition[1]" = 0.0\n"initialPosition[2]" = 0.0\n"initialVelocity', 1
        )
        text += f'\n[components.target.start]\ninitialAttitude = {angle!r}\n"initialPosition[1]" = {at[0]!r}\n"initialPosition[2]" = {at[1]!r}\n'
        (FOLDER / "cell.toml").write_text(text)
        program("simulate", "cell.toml", "-o", "cell.csv")
        with open(FOLDER / "cell.csv") as file:
            rows = list(csv.reader(file))
        return int(float(dict(zip(rows[0], rows[-1]))["contact.outcome"]))

    alike = 0
    for angle, y, x, outcome in zip(*(table[k] for k in ("angle", "y", "x", "outcome"))):
        found = [coupled(angle, x, y, 1e-3)]
        if found[0] == outcome:
            alike += 1
            continue
        found.append(coupled(angle, x, y, 5e-4))
        print(f"differs: angle {angle:.4f}, y {y:g}, x {x:g}: one FMU {int(outcome)}, three at 1 ms {found[0]}, at 0.5 ms {found[1]}", flush=True)
    print(f"outcomes of {alike} of {len(table['x'])} places are the same in one FMU and in three at 1 ms")


def main():
    for model in ("FreeBody", "GripperContact", "CaptureScene"):
        program("fmu", "pack", model, "-o", "out")
    reference = in_one(1e-12, "model-exchange", 0.01)
    couplings(reference)
    against_three(reference)
    against_numpy(reference)
    cells()


if __name__ == "__main__":
    PROGRAM = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        main()
