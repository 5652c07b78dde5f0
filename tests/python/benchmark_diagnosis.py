"""Time of `trueup diagnose`: over generated cases; how it grows with samples, candidates and cores; compared with SciPy's least_squares refitting
every candidate over a compiled simulation. Alone on the machine, in one run; prints tables for docs/benchmarks.md.

    python tests/python/benchmark_diagnosis.py target/release/trueup [JOINTS [MANIPULATORS]]

JOINTS and MANIPULATORS: how many cases (12 and 6, at most 12 each); 1 1 for a look whether it runs.
"""

import ctypes
import functools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

SEED = 1
# Split and number of a case. Joints: with recordings of at least 10 s at 500 Hz; whatever fits next is taken should the generator change.
# The first has all four channels, and an effect whose law is that of the library: asymmetric-friction.
JOINTS = (("single", 55), ("parameters", 0), ("pairs", 0), ("none", 2), ("outside", 0), ("unidentifiable", 1),
          ("single", 7), ("parameters", 13), ("pairs", 6), ("none", 5), ("outside", 7), ("single", 12))
MANIPULATORS = tuple((s, i) for i in (0, 1) for s in ("parameters", "pairs", "none", "single", "outside", "unidentifiable"))
RATE, SECONDS = 500, 10
# Effects that a flexible joint with friction may lack, by id.
ALONE = 22
# Of the compiled simulation in a sample.
STEPS = 2

SOURCE = r"""
#include <math.h>
/* Motor, spring and load; dry friction by modes, turned where the motor stops; the current is held between samples.
   p: J_m J_l K_t K D tau_c D_m n; asymmetry of tau_c and D_m; cable's stiffness and pull; gravity's sine and cosine */
static void rates(const double *p, const double *x, double tau, int way, double *dx) {
    double e = p[3] * (x[0] - p[7] * x[2]) + p[4] * (x[1] - p[7] * x[3]);
    dx[0] = way ? x[1] : 0;
    dx[1] = way ? (tau - e - (p[6] + way * p[9]) * x[1] - way * p[5] - p[8]) / p[0] : 0;
    dx[2] = x[3];
    double out = p[11] - p[10] * x[2];
    if (p[12] || p[13]) out -= p[12] * sin(x[2]) + p[13] * cos(x[2]);
    dx[3] = (p[7] * e + out) / p[1];
}
static void step(const double *p, const double *x, double tau, int way, double h, double *to) {
    double k[4][4], y[4];
    rates(p, x, tau, way, k[0]);
    for (int s = 1; s < 4; s++) {
        for (int i = 0; i < 4; i++) y[i] = x[i] + h * (s < 3 ? 0.5 : 1) * k[s - 1][i];
        rates(p, y, tau, way, k[s]);
    }
    for (int i = 0; i < 4; i++) to[i] = x[i] + h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
}
/* Which way the motor at rest begins to slide; 0: it is held. */
static int slides(const double *p, const double *x, double tau) {
    double a = tau - p[3] * (x[0] - p[7] * x[2]) + p[4] * p[7] * x[3];
    return a > p[5] + p[8] ? 1 : a < p[8] - p[5] ? -1 : 0;
}
void simulate(const double *p, const double *x0, const double *t, const double *u, int n, int steps, double *out) {
    double x[4], y[4];
    for (int i = 0; i < 4; i++) x[i] = x0[i];
    int way = x[1] > 0 ? 1 : x[1] < 0 ? -1 : 0;
    for (int k = 0; k < n; k++) {
        out[k] = x[0]; out[n + k] = x[2];
        if (k + 1 == n) break;
        double tau = p[2] * u[k], h = (t[k + 1] - t[k]) / steps;
        for (int s = 0; s < steps; s++) {
            double left = h;
            for (int turn = 0; turn < 4 && left > 0; turn++) {
                if (!way) way = slides(p, x, tau);
                step(p, x, tau, way, left, y);
                double part = left;
                int stops = way && y[1] * way < 0;
                if (stops) { part *= x[1] / (x[1] - y[1]); step(p, x, tau, way, part, y); y[1] = 0; }
                for (int i = 0; i < 4; i++) x[i] = y[i];
                left -= part;
                if (stops) way = slides(p, x, tau);
            }
        }
    }
}
"""
OWN = ("motorInertia", "loadInertia", "torqueConstant", "stiffness", "damping", "coulombFriction", "viscousFriction")
# Where the effect's two parameters are in the C code.
EFFECTS = {"asymmetric-friction": 8, "cable-stiffness": 10, "gravity-torque": 12}


def say(text):
    print(text, file=sys.stderr, flush=True)


# Cases: case.toml as it was generated, recordings cut.


def rows(path):
    return path.read_text().splitlines()[1:]


def rate(case):
    times = [float(row.split(",")[0]) for row in rows(case / "train-1.csv")]
    return (len(times) - 1) / times[-1]


def generate(binary, folder, plant, split, number):
    """The case, its recordings cut to their first 10 s, and its key."""
    while True:
        out = folder / f"{plant}-{split}-{number}"
        # This one only.
        subprocess.run([binary, "trial", "generate", "-o", out, "--plant", plant, "--split", split, "--seed", str(SEED),
                        "--count", str(number + 1), "--shard", f"{number + 1}/{number + 1}"], check=True, capture_output=True)
        case, key = next((out / "cases").iterdir()), next((out / "keys").iterdir())
        samples = round(SECONDS * rate(case))
        if plant == "manipulator" or abs(rate(case) - RATE) < 1 and len(rows(case / "train-1.csv")) >= samples:
            return cut(case, folder / f"{out.name}-cut", samples), tomllib.loads(key.read_text())
        number += 1


def cut(case, to, samples=None, share=1.0, channels=None):
    """A copy whose recordings keep their first samples, so many or that share, and these channels (inputs always)."""
    to.mkdir()
    text = (case / "case.toml").read_text()
    for path in case.glob("*.csv"):
        head, *body = path.read_text().splitlines()
        names = head.split(",")
        keep = [i for i, n in enumerate(names) if channels is None or is_input(n) or n in channels]
        body = body if path.name.startswith("rest") else body[: samples or max(1, round(share * len(body)))]
        lines = [",".join(line.split(",")[i] for i in keep) for line in (head, *body)]
        (to / path.name).write_text("\n".join(lines) + "\n")
    blocks = text.split("\n[channels.")
    kept = [b for b in blocks[1:] if channels is None or is_input(name := b.split("]\n")[0].strip('"')) or name in channels]
    (to / "case.toml").write_text("\n[channels.".join([blocks[0], *kept]))
    return to


def is_input(name):
    return name == "time" or name.startswith(("motorCurrent", "jointTorque"))


def measured(case):
    return [n for n in (case / "train-1.csv").open().readline().strip().split(",") if not is_input(n)]


def candidates(case):
    """How many causes the program looks at (crates/diagnosis/src/engine/hypothesis.rs): effects in their places, wrong parameters."""
    read = tomllib.loads((case / "case.toml").read_text())
    channels = measured(case)
    encoders = ("motorAngle", "loadAngle", "jointAngle")
    sensors = 2 * len(channels) + sum(c.startswith(encoders) for c in channels)
    if read["model"] == "TwoMassJoint":
        # A flexible joint with friction; a constant offset of loadAngle shows against motorAngle.
        return 22 + sensors + 8 + ("loadAngle" in channels)
    springs = sum(read["parameters"]["jointFlexible"])
    return 39 + (springs < 3) + 5 * springs + sensors + 14 + 3 * springs


# The program.


def diagnose(binary, case, threads=2):
    """Wall seconds, processor seconds, and its output."""
    with tempfile.TemporaryDirectory() as out:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.perf_counter()
        done = subprocess.run([binary, "diagnose", case, "-o", out], capture_output=True, text=True,
                              env=os.environ | {"RAYON_NUM_THREADS": str(threads)})
        wall = time.perf_counter() - begin
        if done.returncode:
            sys.exit(f"{done.stderr}{case.name}: exit {done.returncode}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        said = json.loads((Path(out) / "diagnosis.json").read_text())
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    say(f"{case.name}, {threads} threads: {wall:.2f} s, processors {busy:.2f} s, {said['verdict']} {[e['id'] for e in said['effects']]}")
    return wall, busy, said


def table(head, lines):
    print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for line in lines:
        print("| " + " | ".join(str(c) if isinstance(c, str) else f"{c:.3g}" for c in line) + " |")
    print(flush=True)


# The same work by SciPy.


class Recording:
    def __init__(self, run, path, noise):
        """`noise`: standard deviations of current, motorAngle and loadAngle."""
        data = np.genfromtxt(path, delimiter=",", names=True)
        self.run, self.t, self.u = run, data["time"].copy(), data["motorCurrent"].copy()
        self.y = np.array([data["motorAngle"], data["loadAngle"]])
        self.there, self.noise = np.isfinite(self.y), noise
        few = slice(0, 10)
        speed = [np.polyfit(self.t[few][ok], y[few][ok], 1)[0] for y, ok in zip(self.y, self.there[:, few])]
        self.begin = np.array([self.y[0, 0], speed[0], self.y[1, 0], speed[1]])
        # Derivatives by first states of one recording leave the others as they were.
        self.residuals = functools.lru_cache(64)(self.residuals)

    def simulate(self, p, x0, u, steps=STEPS):
        """p and x0 as bytes, that they can be remembered."""
        out = np.empty_like(self.y)
        at = lambda a: a.ctypes.data_as(ctypes.c_void_p)
        self.run(p, x0, at(self.t), at(u), len(self.t), steps, at(out))
        return out

    def carry(self, p, rng):
        """The floor: noise of the readings, and that of the logged current carried through the simulation."""
        x0 = self.begin.tobytes()
        noisy = lambda: self.simulate(p, x0, self.u + self.noise[0] * rng.normal(size=len(self.u)))
        moved = np.mean([(noisy() - noisy()) ** 2 / 2 for _ in range(16)], axis=(0, 2))
        self.floor = np.sqrt(moved + np.array(self.noise[1:]) ** 2)[:, None]

    def residuals(self, p, x0, steps):
        return ((self.simulate(p, x0, self.u, steps) - self.y) / self.floor)[self.there]


class Refit:
    """Output error of the joint's parameters, an effect's and all first states, from the nominal values."""

    def __init__(self, case, folder):
        (folder / "m.c").write_text(SOURCE)
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", folder / "m.so", folder / "m.c", "-lm"], check=True)
        run = ctypes.CDLL(str(folder / "m.so")).simulate
        read = tomllib.loads((case / "case.toml").read_text())
        values, doubts = read["parameters"], read.get("uncertain", {})
        sensors = [read["channels"][c] for c in ("motorCurrent", "motorAngle", "loadAngle")]
        noise = [np.hypot(c["noise"], c.get("resolution", 0) / 12**0.5) for c in sensors]
        self.recordings = [Recording(run, case / f"train-{i}.csv", noise) for i in (1, 2, 3)]
        self.nominal = np.array([values[n] for n in OWN])
        # Where none is declared, the program's own.
        self.doubt = np.array([doubts.get(n, 0.01) for n in OWN])
        self.ratio = values["gearRatio"]
        rng = np.random.default_rng(SEED)
        for r in self.recordings:
            r.carry(np.array([*self.nominal, self.ratio, *np.zeros(6)]).tobytes(), rng)
        pull = 0.01 * self.ratio * self.nominal[2] * np.std(self.recordings[0].u)
        self.sizes = {8: 0.01 * self.nominal[5:7], 10: np.full(2, pull), 12: np.full(2, pull)}
        # First states: coordinates of the order of what is doubted of them.
        self.scale = [np.array([noise[1], 0.01 * abs(r.begin[1]) + 1e-3, noise[2], 0.01 * abs(r.begin[3]) + 1e-5]) for r in self.recordings]

    def residuals(self, z, at, steps=STEPS):
        p = np.zeros(14)
        p[:7], p[7] = self.nominal * np.exp(self.doubt * z[:7]), self.ratio
        p[at : at + 2] = self.sizes[at] * z[7:9]
        runs = zip(self.recordings, self.scale, z[9:].reshape(3, 4))
        return np.concatenate([*(r.residuals(p.tobytes(), (r.begin + s * x).tobytes(), steps) for r, s, x in runs), z[:7]])

    def misfit(self, z, at):
        """Root mean square over the readings, 1 being the floor."""
        return float(np.sqrt(np.mean(self.residuals(z, at)[:-7] ** 2)))

    def __call__(self, at, method):
        for r in self.recordings:
            r.residuals.cache_clear()
        begin = time.perf_counter()
        # Stops where the program's refits do (crates/diagnosis/src/engine/result.rs), not at SciPy's 1e-8. The friction's events want derivatives
        # by a larger step than SciPy's. `trf` begins with a step of 1 in what it scales, which with x_scale="jac" is next to none.
        found = least_squares(self.residuals, np.zeros(21), args=(at,), method=method, x_scale="jac" if method == "lm" else 1.0,
                              diff_step=1e-4, ftol=1e-4, xtol=1e-6, gtol=1e-6)
        return time.perf_counter() - begin, found


# The tables.


def over_cases(every, plain, took):
    lines = []
    for plant, cases in every.items():
        for what, some in (("all", cases), ("no effect there", [c for c in cases if c in plain]),
                           ("with effects", [c for c in cases if c not in plain])):
            if some:
                few, most = (f(len(rows(c / "train-1.csv")) for c in some) for f in (min, max))
                lines.append([plant, what, str(len(some)), f"{few} to {most}" if few < most else str(few),
                              *np.percentile([took[c][0] for c in some], (0, 25, 50, 75, 100)), np.median([took[c][1] for c in some])])
    table(["plant", "cases", "number", "samples of a recording", "min s", "quartile", "median s", "quartile", "max s", "processors, median s"],
          lines)


def growth(binary, folder, every, took):
    """Of the first two cases of each plant; by channels of the first."""

    def compared(plant, what, cases, others):
        whole = [took[c] for c in cases]
        same = sum(o[2]["verdict"] == w[2]["verdict"] for o, w in zip(others, whole))
        lines.append([plant, what, *(np.median([r[0] for r in runs]) for runs in (others, whole)),
                      *(np.median([o[k] / w[k] for o, w in zip(others, whole)]) for k in (0, 1)), f"{same} of {len(cases)}"])

    lines = []
    for plant, cases in every.items():
        cases = cases[:2]
        for share in (0.25, 0.5):
            cuts = [cut(c, folder / f"{c.name}-{share}", share=share) for c in cases]
            compared(plant, f"{share:g} of the samples", cases, [diagnose(binary, c) for c in cuts])
        compared(plant, "1 core instead of 2", cases, [diagnose(binary, c, threads=1) for c in cases])
    # The number of candidates has no switch: channels bring it. What is there (an effect, wrong parameters) goes with none of them.
    motor = ["motorAngle", "loadAngle", "motorVelocity"]
    arm = measured(every["manipulator"][0])
    for plant, sets in (("joint", (motor[:1], motor[:2], motor)),
                        ("manipulator", ([c for c in arm if not c.startswith(part)] for part in ("base", "motor")))):
        case = every[plant][0]
        for channels in sets:
            less = cut(case, folder / f"{case.name}-{len(channels)}-channels", channels=channels)
            what = f"{len(channels)} channels, {candidates(less)} candidates, instead of {len(measured(case))}, {candidates(case)}"
            compared(plant, what, [case], [diagnose(binary, less)])
    table(["plant", "what", "median s", "the whole s", "times the whole", "processors, times the whole", "same verdict"], lines)


def beside_scipy(binary, folder, case, truth):
    """Of the case with two channels; `truth`: its Coulomb asymmetry."""
    case = cut(case, folder / "scipy", channels=["motorAngle", "loadAngle"])
    (wall, _, said), (alone, *_) = (diagnose(binary, case, threads) for threads in (2, 1))
    refit = Refit(case, folder)
    start = np.zeros(21)
    coarse, fine = (refit.residuals(start, 8, steps) for steps in (STEPS, 16))
    say(f"{STEPS} steps per sample against 16: {np.abs(coarse - fine).max():.2g} floors at most")
    off = lambda value: f"{100 * (value / truth - 1):+.1f} %"
    lines, works = [["", "nominal model", "", "", refit.misfit(start, 8), ""]], []
    for method in ("trf", "lm"):
        seconds = []
        for name, at in EFFECTS.items():
            once, found = refit(at, method)
            seconds.append(once)
            say(f"SciPy, {method}, {name}: {once:.2f} s, {found.message}")
            lines.append([method, name, once, str(found.nfev), refit.misfit(found.x, at), off(found.x[7] * refit.sizes[at][0]) if at == 8 else ""])
        for what, total in (("that of the true effect", seconds[0]), ("the mean of these", np.mean(seconds))):
            works.append([f"SciPy, {method}: {ALONE} refits as long as {what}", ALONE * total, ALONE * total / wall, ALONE * total / alone])
    table(["SciPy", "refit with", "s", "evaluations", "left on the recordings for fitting, floor 1", "its Coulomb asymmetry off by"], lines)
    gap, claims = said["gap"]["overall"], {e["id"]: e["parameters"] for e in said["effects"]}
    own = claims.get("asymmetric-friction", {}).get("coulombAsymmetry", {}).get("value", np.nan)
    what = f"trueup diagnose: {said['verdict']}, {', '.join(claims)}, asymmetry off by {off(own)}; held out {gap['after'] / gap['floor']:.2f} floors"
    table(["work", "s", "times trueup on 2 cores", "times trueup on 1 core"],
          [[what, wall, 1.0, wall / alone], ["the same on 1 core", alone, alone / wall, 1.0], *works])


def main(binary, joints=12, manipulators=6):
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        wanted = [("joint", *c) for c in JOINTS[:joints]] + [("manipulator", *c) for c in MANIPULATORS[:manipulators]]
        say(f"generating {len(wanted)} cases")
        with ThreadPoolExecutor(2) as pool:
            made, keys = zip(*pool.map(lambda w: generate(binary, folder, *w), wanted))
        truth = keys[0]["amplitudes"].get("asymmetric-friction", {}).get("coulombAsymmetry")
        if truth is None or len(measured(made[0])) < 4:
            sys.exit("the generator has changed: put a joint with asymmetric-friction and four channels first in JOINTS")
        every = {plant: [c for c, w in zip(made, wanted) if w[0] == plant] for plant in ("joint", "manipulator")}
        plain = {c for c, w in zip(made, wanted) if w[1] in ("none", "parameters")}
        took = {case: diagnose(binary, case) for case in made}
        over_cases(every, plain, took)
        beside_scipy(binary, folder, made[0], truth)
        growth(binary, folder, every, took)
    say(f"{time.perf_counter() - begin:.0f} s in all")


if __name__ == "__main__":
    main(str(Path(sys.argv[1]).resolve()), *map(int, sys.argv[2:]))
