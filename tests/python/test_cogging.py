"""Cogging of a direct drive, of any order: found as torque-ripple at its order, not as a late command or reading.

The truth is simulated here: explicit midpoint steps of 20 us, the current of a speed loop held from reading to reading.
"""

import json
import math
import os
import subprocess

import numpy as np
import pytest

SEED = 6204
KT, INERTIA, COULOMB, VISCOUS = 0.03, 6e-6, 0.0018, 4e-6
STEP, PARTS = 1e-3, 50
NOISE = {"motorAngle": 3e-4, "motorVelocity": 0.1, "motorCurrent": 0.004}


def drawn(count):
    random = np.random.default_rng(SEED)
    for _ in range(count):
        order, size = round(math.exp(random.uniform(math.log(7), math.log(300)))), random.uniform(2e-3, 4e-3)
        yield order, size, random.uniform(0, 2 * math.pi), int(random.integers(1 << 30))


def recorded(file, seconds, order, size, phase, seed):
    """The motor turns one way; high orders slowly enough for six readings a period."""
    random = np.random.default_rng(seed)
    turns = min(2.0, 160.0 / order)
    wanted = lambda t: 2 * math.pi * turns * (1 + 0.2 * math.sin(5 * t))

    def accelerates(q, w, i):
        ripple = size * math.sin(order * q + phase) + 0.3 * size * math.cos(2 * order * q)
        return (KT * i + ripple - COULOMB * math.tanh(w / 1e-3) - VISCOUS * w) / INERTIA

    q, w, rows = random.uniform(0, 6), wanted(0.0), []
    h = STEP / PARTS
    for k in range(int(seconds / STEP)):
        t = k * STEP
        i = 0.06 + 0.03 * (wanted(t) - w)
        seen = [q, w, i] + random.normal(0, 1, 3) * list(NOISE.values())
        rows.append([t, *seen])
        for _ in range(PARTS):
            a = accelerates(q, w, i)
            q, w = q + h * (w + 0.5 * h * a), w + h * accelerates(q + 0.5 * h * w, w + 0.5 * h * a, i)
    np.savetxt(file, rows, delimiter=",", header="time," + ",".join(NOISE), comments="", fmt="%.9g")
    assert np.array(rows)[:, 2].min() > 0, "it turns one way"


def case(folder, seconds, order, size, phase, seed):
    folder.mkdir()
    for k, name in enumerate(("train", "hold")):
        recorded(folder / f"{name}.csv", seconds, order, size, phase, seed + k)
    (folder / "case.toml").write_text(
        'model = "TwoMassJoint"\ntrain = ["train.csv"]\nholdout = ["hold.csv"]\n'
        f"[parameters]\njointFlexible = false\ngearRatio = 1.0\ntorqueConstant = {KT}\nmotorInertia = {INERTIA}\nloadInertia = 1e-8\n"
        f"coulombFriction = {COULOMB}\nstaticFriction = {COULOMB}\nviscousFriction = {VISCOUS}\n"
        "[uncertain]\nmotorInertia = 0.1\ncoulombFriction = 0.2\nstaticFriction = 0.5\nviscousFriction = 0.3\n"
        + "".join(f"[channels.{n}]\nnoise = {v}\n" for n, v in NOISE.items())
        + 'interpolation = "hold"\n')
    return folder


def found(folder, out):
    program = os.environ.get("TRUEUP_BIN")
    if not program:
        pytest.skip("TRUEUP_BIN is not set: run ./test")
    done = subprocess.run([program, "diagnose", folder, "-o", out, "--verdict-only", "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


ORDERS = list(drawn(8))


@pytest.mark.parametrize("one", [pytest.param(one, id=f"order-{one[0]}", marks=[] if one[0] == 9 else pytest.mark.full) for one in ORDERS])
def test_cogging_is_no_delay(tmp_path, one):
    """What is claimed of it has a ripple of its order (or of the half, with its double), or nothing is claimed."""
    order, size, phase, seed = one
    print("seed", SEED, "order", order, "N.m", size, "phase", phase, "seed of the recordings", seed)
    told = found(case(tmp_path / "case", 2.5, order, size, phase, seed), tmp_path / "out")
    claimed = {e["id"]: e for e in told["effects"]}
    if order == 9:
        assert told["verdict"] == "effects" and list(claimed) == ["torque-ripple"], (told["verdict"], list(claimed))
    if told["verdict"] not in ("effects", "ambiguous"):
        return
    assert "torque-ripple" in claimed, list(claimed)
    values = {k: v["value"] for k, v in claimed["torque-ripple"]["parameters"].items()}
    half = abs(values["rippleOrder"] - order / 2) < 0.01 * order
    assert half or abs(values["rippleOrder"] - order) < 0.01 * order, values
    if order == 9:
        sine, cosine = (values["rippleSine2"], values["rippleCosine2"]) if half else (values["rippleSine"], values["rippleCosine"])
        assert abs(math.hypot(sine, cosine) / size - 1) < 0.1, (values, size)
