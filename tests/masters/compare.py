"""What masters cost per FMU and step, side by side in one run.

    python tests/masters/compare.py [--pairs 1,10,50,500] [--rounds 5] [--steps 200000]

Pairs of two-mass oscillators (oscillator.c, 3 connections a pair, steps of 1 ms) are run by a plain C loop (floor.c), by
Trueup and by whatever other master is installed; they take turns, and of each the fastest round counts, for every other
process on the machine only adds to it. Needs a C compiler, `cargo build --release --example speed -p trueup-cosim`, and
the packages of tools/python/requirements.txt. What cannot run is printed with its reason.
"""

import argparse
import csv
import ctypes.util
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
H = 1e-3
TOKEN = {"left": "{left}", "right": "{right}"}


def description(side):
    inputs = ["force"] if side == "left" else ["x1", "v1"]
    outputs = {"left": [("x1", 2), ("v1", 3)], "right": [("F", 4), ("x2", 2), ("v2", 3)]}[side]
    variables = [
        f'<ScalarVariable name="{n}" valueReference="{r}" causality="input"><Real start="0"/></ScalarVariable>'
        for r, n in enumerate(inputs)
    ] + [f'<ScalarVariable name="{n}" valueReference="{r}" causality="output"><Real/></ScalarVariable>' for n, r in outputs]
    unknowns = []
    for i, (name, _) in enumerate(outputs):
        depends = "1 2" if name == "F" else ""
        unknowns.append(f'<Unknown index="{len(inputs) + 1 + i}" dependencies="{depends}"/>')
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="2.0" modelName="{side}" guid="{TOKEN[side]}">'
        f'<CoSimulation modelIdentifier="{side}" canHandleVariableCommunicationStepSize="true"/>'
        f'<DefaultExperiment startTime="0" stopTime="10" stepSize="{H}"/>'
        f'<ModelVariables>{"".join(variables)}</ModelVariables><ModelStructure><Outputs>{"".join(unknowns)}</Outputs>'
        f'<InitialUnknowns>{"".join(unknowns)}</InitialUnknowns></ModelStructure></fmiModelDescription>\n'
    )


def build(folder):
    """left.fmu, right.fmu, their libraries and the plain C loop."""
    for side in ("left", "right"):
        library = folder / f"{side}.so"
        flags = ["-DLEFT"] if side == "left" else []
        subprocess.run(["cc", "-O2", "-fPIC", "-shared", *flags, HERE / "oscillator.c", "-o", library], check=True)
        with zipfile.ZipFile(folder / f"{side}.fmu", "w") as z:
            z.writestr("modelDescription.xml", description(side))
            z.write(library, f"binaries/linux64/{side}.so")
    subprocess.run(["cc", "-O2", HERE / "floor.c", "-o", folder / "floor", "-ldl"], check=True)


CONNECTIONS = [("l", "x1", "r", "x1"), ("l", "v1", "r", "v1"), ("r", "F", "l", "force")]


def plain_loop(folder, pairs, steps, *options):
    return loop(folder, pairs, steps, *options)[0]


def loop(folder, pairs, steps, *options):
    """ns, and x1 of the first pair at the end."""
    command = [folder / "floor", folder / "left.so", folder / "right.so", str(pairs), str(steps), *options]
    out = subprocess.run(command, check=True, capture_output=True, text=True)
    return [float(x) for x in out.stdout.split()]


def deviations(folder, steps=10000):
    """Largest difference of x1 between Trueup and the loop of the same work, over x1's largest, of both algorithms."""
    results = folder / "same.csv"
    for name, algorithm, options in (("held inputs", "jacobi", ()), ("linear inputs", "extrapolate", ("lines",))):
        trueup(folder, 1, steps, algorithm, results)
        with open(results) as file:
            rows = list(csv.DictReader(file))
        x1 = [float(row["l0.x1"]) for row in rows]
        ends = range(steps // 10, steps + 1, steps // 10)
        apart = max(abs(loop(folder, 1, n, *options)[1] - x1[n]) for n in ends)
        yield name, apart / max(map(abs, x1))


def trueup(folder, pairs, steps, *options):
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    system = folder / f"{pairs}.toml"
    if not system.exists():
        text = "connections = [\n"
        for i in range(pairs):
            text += "".join(f'  "{a}{i}.{x} -> {b}{i}.{y}",\n' for a, x, b, y in CONNECTIONS)
        text += "]\n"
        for i in range(pairs):
            text += f'[components.l{i}]\nfmu = "left.fmu"\n[components.r{i}]\nfmu = "right.fmu"\n'
        system.write_text(text)
    out = subprocess.run([target / "release/examples/speed", system, str(H), str(steps), *options], capture_output=True, text=True)
    if out.returncode:
        raise RuntimeError(out.stderr.strip().splitlines()[-1] if out.stderr.strip() else f"exit {out.returncode}")
    return float(out.stdout.split()[0])


def container(folder, pairs, steps):
    """FMPy's Container FMU, called from the plain C loop."""
    from fmpy import read_model_description
    from fmpy.container_fmu import cli
    from fmpy.container_fmu.config import Component, Configuration, Connection

    work = folder / f"container-{pairs}"
    if not work.exists():
        work.mkdir()
        sides = {s: read_model_description(folder / f"{s}.fmu") for s in ("left", "right")}
        for side in sides.values():
            for v in side.modelVariables:
                v.type = "Float64"  # the only name of a double that the container's connections know
        parts = [Component(name=f"{s[0]}{i}", filename=folder / f"{s}.fmu", modelDescription=sides[s]) for i in range(pairs) for s in ("left", "right")]
        named = {p.name: p for p in parts}
        variable = lambda p, n: next(v for v in p.modelDescription.modelVariables if v.name == n)  # noqa: E731
        links = [
            Connection(startElement=named[f"{a}{i}"], startConnectors=[variable(named[f"{a}{i}"], x)],
                       endElement=named[f"{b}{i}"], endConnectors=[variable(named[f"{b}{i}"], y)])
            for i in range(pairs) for a, x, b, y in CONNECTIONS
        ]
        whole = read_model_description(folder / "left.fmu")
        whole.modelName, whole.instantiationToken = "container", TOKEN["left"]
        whole.modelVariables, whole.outputs, whole.initialUnknowns = [], [], []
        whole.coSimulation.fixedInternalStepSize = H
        cli.create_container_fmu(Configuration(False, whole, parts, links, {}), work, folder / f"container-{pairs}.fmu")
    out = subprocess.run(
        [folder / "floor", work / "binaries/linux64/container_fmu.so", (work / "resources").resolve().as_uri(), TOKEN["left"], str(2 * pairs), str(steps)],
        capture_output=True, text=True,
    )
    if out.returncode:
        raise RuntimeError(out.stderr.strip().splitlines()[-1] if out.stderr.strip() else f"exit {out.returncode}")
    return float(out.stdout.split()[0])


def timed(step, steps, count):
    """ns per FMU and step of the fastest of ten parts; `step(n)` does n steps."""
    part = max(1, steps // 10)
    best = min(_seconds(step, part) for _ in range(10))
    return best / part / count * 1e9


def _seconds(step, n):
    begin = time.perf_counter()
    step(n)
    return time.perf_counter() - begin


def fmpy_loop(folder, pairs, steps):
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    def slave(side, name):
        d = read_model_description(folder / f"{side}.fmu")
        if not (folder / f"{side}-unzipped").exists():
            extract(folder / f"{side}.fmu", folder / f"{side}-unzipped")
        fmu = FMU2Slave(guid=d.guid, unzipDirectory=str(folder / f"{side}-unzipped"), modelIdentifier=side, instanceName=name)
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        return fmu

    both = [(slave("left", f"l{i}"), slave("right", f"r{i}")) for i in range(pairs)]
    clock = [0]

    def step(n):
        for _ in range(n):
            t = clock[0] * H
            for left, right in both:
                left.doStep(t, H)
                right.doStep(t, H)
            for left, right in both:
                right.setReal([0, 1], left.getReal([2, 3]))
                left.setReal([0], right.getReal([4]))
            clock[0] += 1

    return timed(step, min(steps, max(100, 20000 // pairs)), 2 * pairs)


def ecos(folder, pairs, steps):
    if ctypes.util.find_library("tbb") is None:
        raise RuntimeError("needs the system library libtbb.so.12 (Debian: libtbb12)")
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    for i in range(pairs):
        structure.add_model(f"l{i}", str(folder / "left.fmu"))
        structure.add_model(f"r{i}", str(folder / "right.fmu"))
        for a, x, b, y in CONNECTIONS:
            structure.make_real_connection(f"{a}{i}::{x}", f"{b}{i}::{y}")
    with EcosSimulation(structure=structure, step_size=H) as simulation:
        simulation.init()
        result = timed(lambda n: simulation.step(num_steps=n), min(steps, max(100, 400000 // pairs)), 2 * pairs)
        simulation.terminate()
    return result


def libcosim(folder, pairs, steps, workers=None):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimSlave import CosimLocalSlave

    if workers is None:
        execution = CosimExecution.from_step_size(int(H * 1e9))
        for i in range(pairs):
            slaves = [execution.add_local_slave(CosimLocalSlave(str(folder / f"{s}.fmu"), f"{s[0]}{i}")) for s in ("left", "right")]
            for a, x, b, y in CONNECTIONS:
                index = {"l": slaves[0], "r": slaves[1]}
                out = {"x1": 2, "v1": 3, "F": 4}[x]
                execution.connect_real_variables(index[a], out, index[b], {"x1": 0, "v1": 1, "force": 0}[y])
    else:
        xml = folder / f"ssp-{pairs}" / "SystemStructure.ssd"
        xml.parent.mkdir(exist_ok=True)
        connector = lambda name, kind: f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>'  # noqa: E731
        ports = {
            "left": connector("force", "input") + connector("x1", "output") + connector("v1", "output"),
            "right": connector("x1", "input") + connector("v1", "input") + connector("F", "output"),
        }
        parts = "".join(
            f'<ssd:Component name="{s[0]}{i}" source="../{s}.fmu"><ssd:Connectors>{ports[s]}</ssd:Connectors></ssd:Component>'
            for i in range(pairs) for s in ("left", "right")
        )
        links = "".join(
            f'<ssd:Connection startElement="{a}{i}" startConnector="{x}" endElement="{b}{i}" endConnector="{y}"/>'
            for i in range(pairs) for a, x, b, y in CONNECTIONS
        )
        xml.write_text(
            '<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription name="s" version="1.0" '
            'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
            'xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"><ssd:System name="s">'
            f"<ssd:Elements>{parts}</ssd:Elements><ssd:Connections>{links}</ssd:Connections></ssd:System>"
            '<ssd:DefaultExperiment startTime="0"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform"><osp:Algorithm>'
            f'<osp:FixedStepAlgorithm baseStepSize="{H}" numWorkerThreads="{workers}"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>'
            "</ssd:DefaultExperiment></ssd:SystemStructureDescription>"
        )
        execution = CosimExecution.from_ssp_file(str(xml.parent))
    execution.step(1)
    return timed(lambda n: execution.step(step_count=n), min(steps, max(100, 100000 // pairs)), 2 * pairs)


MASTERS = [
    ("plain C loop", plain_loop),
    ("Trueup", trueup),
    ("C loop, linear inputs", lambda *a: plain_loop(*a, "lines")),
    ("Trueup, linear inputs", lambda *a: trueup(*a, "extrapolate")),
    ("FMPy, Container FMU", container),
    ("ecos", ecos),
    ("libcosim, no worker threads", lambda *a: libcosim(*a, workers=0)),
    ("libcosim", libcosim),
    ("FMPy, loop in Python", fmpy_loop),
]
ABSENT = {"OMSimulator": "OMSimulator", "PyFMI": "pyfmi", "CoFmuPy": "cofmupy"}


def one(name, folder, pairs, steps):
    """Each measurement in a process of its own: a master that crashes takes no other with it."""
    out = subprocess.run([sys.executable, __file__, "--one", name, str(folder), str(pairs), str(steps)], capture_output=True, text=True, timeout=600)
    if out.returncode:
        lines = [line for line in out.stderr.splitlines() if line.strip()]
        return None, lines[-1] if lines else f"ended with {out.returncode}"
    return float(out.stdout.split()[-1]), ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", default="1,10,50,500")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=200000, help="steps of a pair; divided by the number of pairs")
    parser.add_argument("--one", nargs=4)
    options = parser.parse_args()
    if options.one:
        name, folder, pairs, steps = options.one
        print(dict(MASTERS)[name](Path(folder), int(pairs), int(steps)))
        return
    sizes = [int(n) for n in options.pairs.split(",")]
    best, why, logged = {}, {}, {}
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        for round_ in range(options.rounds):
            for pairs in sizes:
                for name, _ in MASTERS:
                    if (name, pairs) in why:
                        continue
                    print(f"round {round_ + 1} of {options.rounds}: {2 * pairs} FMUs, {name}", file=sys.stderr)
                    value, reason = one(name, folder, pairs, max(100, options.steps // pairs))
                    if value is None:
                        why[name, pairs] = reason
                    else:
                        best.setdefault((name, pairs), []).append(value)
            steps = 5 * options.steps
            for name, value in (
                ("nothing logged", 2 * trueup(Path(folder), 1, steps)),
                ("Parquet", trueup(Path(folder), 1, steps, "jacobi", Path(folder) / "r.parquet")),
                ("CSV", trueup(Path(folder), 1, steps, "jacobi", Path(folder) / "r.csv")),
            ):
                logged.setdefault(name, []).append(value)
        apart = list(deviations(Path(folder)))
    print(f"ns per FMU and step, fastest of {options.rounds} rounds; in brackets times the plain C loop\n")
    print("| master | " + " | ".join(f"{2 * n} FMUs, {3 * n} connections" for n in sizes) + " |")
    print("|---|" + "---|" * len(sizes))
    for name, _ in MASTERS:
        cells = []
        for n in sizes:
            if (name, n) in best:
                x = min(best[name, n])
                cells.append(f"{x:.1f} ({x / min(best['plain C loop', n]):.2f})")
            else:
                cells.append(why.get((name, n), "-")[:60])
        print(f"| {name} | " + " | ".join(cells) + " |")
    same = [("Trueup, linear inputs", n) in best and min(best["Trueup, linear inputs", n]) / min(best["C loop, linear inputs", n]) for n in sizes]
    print("| Trueup, linear inputs, times the C loop of the same work | " + " | ".join(f"{x:.2f}" if x else "-" for x in same) + " |")
    print("\nlargest difference of x1 between Trueup and the C loop of the same work, relative to the largest x1")
    for name, value in apart:
        print(f"| {name} | {value:.1e} |")
    print("\nns per step of 2 FMUs with all 5 outputs logged at every step, the whole run, fastest round")
    for name, values in logged.items():
        print(f"| {name} | {min(values):.0f} |")
    for name, module in ABSENT.items():
        try:
            __import__(module)
            print(f"{name} is installed, but this script does not drive it")
        except ImportError:
            print(f"{name}: not installed")


if __name__ == "__main__":
    main()
