"""Output error of case A (joint 1, positive current steps) by `trueup identify` and by SciPy's least_squares over a compiled simulation, in one
run; and how the program's time grows.

    python tests/python/benchmark_identification.py target/release/trueup
"""

import ctypes
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

SOURCE = r"""
#include <math.h>
/* Two masses, true stick-slip to within a step; the current is held between samples. p: K D tau_c D_m J_l tau_s J_m n K_t */
static void rates(const double *p, const double *x, double tau, int mode, double *dx) {
    double e = p[0] * (x[0] - p[7] * x[2]) + p[1] * (x[1] - p[7] * x[3]);
    dx[0] = mode ? x[1] : 0; dx[1] = mode ? (tau - e - p[3] * x[1] - mode * p[2]) / p[6] : 0;
    dx[2] = x[3]; dx[3] = p[7] * e / p[4];
}
void simulate(const double *p, const double *u, int n, double h, int sub, double *out) {
    double x[4] = {0, 0, 0, 0}, k1[4], k2[4], k3[4], k4[4], y[4], d = h / sub; int mode = 0;
    for (int k = 0; k < n; k++) {
        out[k] = x[0]; out[n + k] = x[2];
        for (int s = 0; s < sub; s++) {
            double tau = p[8] * u[k], w = x[1];
            double a = tau - p[0] * (x[0] - p[7] * x[2]) + p[1] * p[7] * x[3];
            if (!mode && fabs(a) > p[5]) mode = a > 0 ? 1 : -1;
            rates(p, x, tau, mode, k1);
            for (int i = 0; i < 4; i++) y[i] = x[i] + d / 2 * k1[i];
            rates(p, y, tau, mode, k2);
            for (int i = 0; i < 4; i++) y[i] = x[i] + d / 2 * k2[i];
            rates(p, y, tau, mode, k3);
            for (int i = 0; i < 4; i++) y[i] = x[i] + d * k3[i];
            rates(p, y, tau, mode, k4);
            for (int i = 0; i < 4; i++) x[i] += d / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
            if (mode && w * mode > 0 && x[1] * mode <= 0) { x[1] = 0; mode = 0; }
        }
    }
}
"""
TRUTH = dict(stiffness=3.07e-5, damping=8.07e-8, coulombFriction=7.37e-5, viscousFriction=7.2e-8, loadInertia=8.0,
             staticFriction=2.99e-4, motorInertia=1.2e-7, gearRatio=44340.0, torqueConstant=0.02)
FITTED = ("stiffness", "damping", "coulombFriction", "viscousFriction")
SIGMA = np.array([2 * np.pi / 500 / np.sqrt(12), np.deg2rad(1e-3) / np.sqrt(12)])


class Model:
    def __init__(self, folder):
        (folder / "m.c").write_text(SOURCE)
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", folder / "m.so", folder / "m.c", "-lm"], check=True)
        self.run = ctypes.CDLL(str(folder / "m.so")).simulate

    def __call__(self, p, u, h):
        out = np.empty((2, len(u)))
        at = lambda a: a.ctypes.data_as(ctypes.c_void_p)
        p = np.array(list(p.values()))
        self.run(at(p), at(u), len(u), ctypes.c_double(h), max(1, round(h / 2.5e-4)), at(out))
        return out


def currents(rate, recordings, seconds):
    t = np.arange(int(seconds * rate)) / rate
    levels = (0.016, 0.018, 0.020, 0.023)
    for r in range(recordings):
        u = np.zeros_like(t)
        for k in range(4):
            begin = 0.1 + k * seconds / 4
            u[(t >= begin) & (t < begin + 0.4)] = levels[(k + r) % 4]
        yield t, u


def program(binary, folder, model, rate=1000, recordings=4, seconds=3.2, fitted=FITTED, rng=np.random.default_rng(1)):
    """Seconds that the program takes, its estimates, and the recordings."""
    runs = []
    for r, (t, u) in enumerate(currents(rate, recordings, seconds)):
        shown = model(TRUTH, u, 1 / rate) + SIGMA[:, None] * rng.normal(size=(2, len(u)))
        runs.append((t, u, shown))
        np.savetxt(folder / f"{r}.csv", np.column_stack([t, u, *shown]), delimiter=",", comments="",
                   header="time,motorCurrent,motorAngle,loadAngle", fmt="%.15g")
    start = {n: v * (1.5 if n in FITTED else 1.0) for n, v in TRUTH.items()}
    names = ", ".join(f'"{f"{r}.csv"}"' for r in range(recordings))
    case = [f'model = "TwoMassJoint"\ntrain = [{names}]', "[parameters]", *(f"{n} = {v!r}" for n, v in start.items())]
    case += ["[fit]", f"parameters = {json.dumps(list(fitted))}", '[channels.motorCurrent]\ninterpolation = "hold"']
    case += [f"[channels.{c}]\nnoise = {float(s)!r}" for c, s in zip(("motorAngle", "loadAngle"), SIGMA)]
    (folder / "case.toml").write_text("\n".join(case))
    begin = time.perf_counter()
    done = subprocess.run([binary, "identify", folder, "--json", "--fast"], capture_output=True, text=True, check=True)
    return time.perf_counter() - begin, json.loads(done.stdout)["parameters"], runs


def scipy(model, runs):
    def residuals(theta):
        p = TRUTH | dict(zip(FITTED, np.exp(theta)))
        return np.concatenate([((model(p, u, t[1]) - y) / SIGMA[:, None]).ravel() for t, u, y in runs])

    begin = time.perf_counter()
    # Half-way and without initial states as unknowns: an easier problem than the program's.
    found = least_squares(residuals, np.log([1.5 * TRUTH[n] for n in FITTED]), x_scale="jac", loss="soft_l1", f_scale=3.0)
    return time.perf_counter() - begin, dict(zip(FITTED, np.exp(found.x))), found.nfev


def main(binary):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        model = Model(folder)
        own, found, runs = program(binary, folder, model)
        other, theirs, evaluations = scipy(model, runs)
        error = lambda of: ", ".join(f"{n} {100 * (of(n) / TRUTH[n] - 1):+.3f} %" for n in FITTED)
        print(f"trueup {own:.2f} s (starts, initial states and offsets, figures included): {error(lambda n: found[n]['value'])}")
        print(f"SciPy, compiled simulation, one start, {evaluations} evaluations and their Jacobians {other:.2f} s: {error(theirs.get)}")
        print(f"ratio SciPy / trueup {other / own:.2f}")
        base = own
        for what, options in (
            ("half the samples", {"rate": 500}), ("twice the samples", {"rate": 2000}),
            ("half the recordings", {"recordings": 2}), ("twice the recordings", {"recordings": 8}),
            ("two parameters", {"fitted": FITTED[2:]}),
            ("seven parameters", {"fitted": (*FITTED, "loadInertia", "staticFriction", "torqueConstant")}),
        ):
            took, *_ = program(binary, folder, model, **options)
            print(f"{what:<22}{took:6.2f} s, {took / base:.2f} times")


if __name__ == "__main__":
    main(str(Path(sys.argv[1]).resolve()))
