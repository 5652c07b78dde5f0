"""Identification against references: the FMU driven in FMPy by recorded currents with the identified parameters, and the
paper's least squares made here, in NumPy, from the results of FMPy."""

import json

import numpy as np
import pytest
from low_level import Opened

COMMON = {"motorInertia": 1.2e-7, "torqueConstant": 0.02}
# Joint: gear ratio, load inertia, K_eq, D_eq, tau_c, tau_s, D_m (S3 tables 1 and 2, assumed constants).
JOINTS = {
    1: (44340.0, 8.0, 3.07e-5, 8.07e-8, 7.37e-5, 2.99e-4, 7.2e-8),
    2: (21750.0, 6.0, 2.2e-5, 3.18e-8, 1.2e-4, 2.6e-4, 2.5e-8),
    3: (25000.0, 2.0, 2.96e-5, 8.35e-8, 7.73e-5, 2.45e-4, 6.93e-8),
}
NAMES = ("gearRatio", "loadInertia", "stiffness", "damping", "coulombFriction", "staticFriction", "viscousFriction")
FITTED = ("stiffness", "damping", "coulombFriction", "viscousFriction")


def parameters(joint):
    return COMMON | dict(zip(NAMES, JOINTS[joint]))


def drive(path, start, t, current):
    """Motor and load angle at the times t, the current held from each to the next."""
    with Opened(path, "CS", tolerance=1e-12) as f:
        f.initialize(start, stop=float(t[-1]) + 1.0)
        out = np.empty((len(t), 2))
        for k, time in enumerate(t):
            out[k] = f.get("motorAngle"), f.get("loadAngle")
            f.set("motorCurrent", float(current[k]))
            if k + 1 < len(t):
                f.fmu.doStep(currentCommunicationPoint=float(time), communicationStepSize=float(t[k + 1] - time))
    return out.T


def steps(t, signs, levels=(0.018, 0.021, 0.025, 0.030)):
    """Current steps with coasting in between."""
    u = np.zeros_like(t)
    length = t[-1] / len(levels)
    for k, level in enumerate(levels):
        u[(t >= k * length + 0.02) & (t < k * length + 0.35 * length)] = level * signs[k % len(signs)]
    return u


def low_pass(x, h, cutoff=8.0):
    sigma = np.sqrt(np.log(2)) / (2 * np.pi * cutoff) / h
    half = int(np.ceil(4 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2)
    return np.convolve(x, kernel / kernel.sum(), mode="valid")


def rows(p, t, current, q_m, q_l, constant=False, filtered=False):
    """Eq. (6)-(8): with `constant` the column of tau_c and the current as printed, else aligned and with the sign."""
    h, inner = t[1] - t[0], slice(1, -1)
    acceleration = (q_m[2:] - 2 * q_m[1:-1] + q_m[:-2]) / h**2
    rate = lambda q: (q[2:] - q[:-2]) / (2 * h)
    held = current[inner] if constant else 0.5 * (current[:-2] + current[inner])
    twist = q_m - p["gearRatio"] * q_l
    w = rate(q_m)
    x = np.column_stack([
        twist[inner] if constant else (twist[:-2] + 10 * twist[inner] + twist[2:]) / 12,
        rate(twist), np.ones_like(w) if constant else np.sign(w), w,
    ])
    y = p["torqueConstant"] * held - p["motorInertia"] * acceleration
    moving = np.abs(w) > 0.01 * np.abs(w).max()
    moving = np.convolve(moving, np.ones(5), mode="same") > 4.5
    if filtered:
        width = len(y) - len(low_pass(y, h)) + 1
        x = np.column_stack([low_pass(c, h) for c in x.T])
        y = low_pass(y, h)
        moving = np.convolve(moving, np.ones(width), mode="valid") > width - 0.5
    keep = np.ones_like(y, bool) if constant else moving
    return x[keep], y[keep]


def least_squares(p, *runs, **how):
    """K_eq, D_eq, tau_c, D_m from runs of (times, current, motor angle, load angle)."""
    x, y = (np.concatenate(parts) for parts in zip(*(rows(p, *run, **how) for run in runs)))
    scale = np.linalg.norm(x, axis=0)
    return np.linalg.lstsq(x / scale, y, rcond=None)[0] / scale


@pytest.mark.parametrize("version", (2, 3))
@pytest.mark.parametrize("joint", (1, 2, 3))
def test_aligned_least_squares_gives_the_parameters_of_the_fmu(fmu, joint, version):
    """D17: noise-free, aligned, moving samples, 1 kHz: within 0.2 %."""
    p = parameters(joint)
    t = np.arange(4000) * 1e-3
    u = steps(t, (1, -1))
    q_m, q_l = drive(fmu("TwoMassJoint", version), p, t, u)
    found = least_squares(p, (t, u, q_m, q_l))
    errors = dict(zip(FITTED, found / [p[n] for n in FITTED] - 1))
    print(f"joint {joint}, FMI {version}: {errors}")
    assert max(map(abs, errors.values())) < 2e-3


def test_leverage_and_the_constant_column(fmu):
    """D18: 1 % of J_m moves K_eq by -29.5 %; D19: the constant column makes tau_c vanish on data of both directions."""
    p = parameters(1)
    t = np.arange(4000) * 1e-3
    forward = steps(t, (1,))
    run = (t, forward, *drive(fmu("TwoMassJoint", 2), p, t, forward))
    base = least_squares(p, run, filtered=True)
    wrong = least_squares(p | {"motorInertia": 1.01 * p["motorInertia"]}, run, filtered=True)
    leverage = wrong[0] / base[0] - 1
    print(f"leverage of J_m on K_eq: {100 * leverage:.1f} %")
    assert abs(leverage + 0.29490534) < 0.015
    back = (t, -forward, *drive(fmu("TwoMassJoint", 2), p, t, -forward))
    tau_c = least_squares(p, run, back, constant=True)[2] / p["coulombFriction"]
    print(f"tau_c with the constant column: {100 * (tau_c - 1):.1f} %")
    assert abs(tau_c) < 0.02


def test_facts_of_the_paper():
    """D13 to D16: arithmetic on its tables."""
    ratio = [JOINTS[j][5] / JOINTS[j][4] for j in (1, 2, 3)]
    assert np.allclose(ratio, (4.05699, 2.16667, 3.16947), atol=1e-4) and ratio[0] > ratio[2] > ratio[1]
    assert np.allclose([100 * (e / 78 - 1) for e in (93.47, 87.23)], (19.833, 11.833), atol=0.01)
    # Relative rises of the square of the first mode, from those of the mode, must not exceed the 20 % of stiffness.
    assert 4.45 + 3.43 + 1.40 + 16.42 + 9.41 > 20
    accuracy = [JOINTS[j][0] * JOINTS[j][2] * np.deg2rad(0.003) / JOINTS[j][4] for j in (1, 2, 3)]
    assert np.allclose(accuracy, (0.96709, 0.20879, 0.50125), atol=1e-4)


@pytest.mark.parametrize("version", (pytest.param(2, marks=pytest.mark.full), 3))
def test_the_fmu_with_what_was_identified_reproduces_the_recordings(fmu, trueup, tmp_path, version):
    """Recordings by the exact solution, identified by the program; FMPy then drives the FMU with the recorded currents."""
    from exact_joint import ExactJoint

    p = parameters(2)
    t = np.arange(900) * 2e-3
    rng = np.random.default_rng(1)
    sigma = {"motorAngle": 2 * np.pi / 500 / np.sqrt(12), "loadAngle": np.deg2rad(1e-3) / np.sqrt(12)}
    recorded = {}
    for name, signs in (("a", (1, -1)), ("b", (-1, 1))):
        u = steps(t, signs, (0.016, 0.020, 0.018, 0.023))
        exact = ExactJoint(p["motorInertia"], p["loadInertia"], p["gearRatio"], p["torqueConstant"], p["stiffness"],
                           p["damping"], p["coulombFriction"], p["staticFriction"], p["viscousFriction"])
        shown = np.empty((len(t), 2))
        for k, time in enumerate(t):
            exact.advance(float(time), h=1e-3)
            exact.set(float(u[k]))
            shown[k] = exact.x[0], exact.x[2]
        noise = rng.normal(size=shown.shape) * list(sigma.values())
        recorded[name] = np.column_stack([t, u, shown + noise])
        np.savetxt(tmp_path / f"{name}.csv", recorded[name], delimiter=",", comments="", fmt="%.17g",
                   header="time,motorCurrent,motorAngle,loadAngle")
    wrong = p | {n: p[n] * f for n, f in zip(FITTED, (1.2, 0.7, 1.1, 0.85))}
    lines = ['model = "TwoMassJoint"', 'train = ["a.csv", "b.csv"]', "[parameters]"]
    lines += [f"{n} = {float(v)!r}" for n, v in wrong.items()]
    lines += [f"[channels.{c}]\nnoise = {float(s)!r}" for c, s in sigma.items()]
    lines += ["[channels.motorCurrent]", 'interpolation = "hold"']
    (tmp_path / "case.toml").write_text("\n".join(lines))
    done = trueup("identify", tmp_path, "--json", "--fast")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    found = {n: v["value"] for n, v in result["parameters"].items() if v["standard_error"] is not None}
    for name in FITTED:
        error, se = found[name] - p[name], result["parameters"][name]["standard_error"]
        assert abs(error) < 4 * se, f"{name}: {found[name]} +- {se}, truth {p[name]}"
    for name, data in recorded.items():
        own = {n: v["value"] for n, v in result["nuisance"][f"{name}.csv"].items() if n.startswith("initial")}
        q_m, q_l = drive(fmu("TwoMassJoint", version), p | found | own, t, data[:, 1])
        for channel, shown, column in (("motorAngle", q_m, 2), ("loadAngle", q_l, 3)):
            above = np.sqrt(np.mean((shown - data[:, column]) ** 2)) / sigma[channel]
            print(f"{name}.csv {channel}: FMPy is {above:.3f} times the noise off")
            # 1500 samples of N(0, 1): three standard deviations of their root mean square.
            assert abs(above - 1) < 3 / np.sqrt(2 * 1500)
