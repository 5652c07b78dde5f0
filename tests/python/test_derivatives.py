"""Directional derivatives of the FMUs against central differences of the same FMUs, at random states in every mode."""

import ctypes
import os
import re
from pathlib import Path

import numpy as np
import pytest

from low_level import Opened

FMUS = Path(os.environ.get("TRUEUP_FMUS", "target/test-fmus"))
ALL = sorted(FMUS.rglob("*.fmu"))
if not ALL:
    pytest.skip(f"no packed FMUs in {FMUS}: run ./test, which packs them", allow_module_level=True)


class Point:
    """States and inputs as one vector; rates and outputs as another."""

    def __init__(self, f):
        self.f = f
        d = f.description
        rates = [u.variable for u in d.derivatives]
        self.rates = [(v.valueReference, f._size(v)) for v in rates]
        self.states = [(v.derivative.valueReference, f._size(v)) for v in rates]
        self.nx = sum(n for _, n in self.states)
        self.inputs, self.outputs = f.reals("input"), f.reals("output")
        output = {v.valueReference: v.name for v in d.modelVariables}
        outputs = [output[vr] for vr, n in self.outputs for _ in range(n)]
        self.forces = [self.nx + i for i, name in enumerate(outputs) if name.startswith(("hostForce", "portForce"))]
        self.torques = [self.nx + i for i, name in enumerate(outputs) if name in ("hostTorque", "portTorque")]
        self.nu = sum(n for _, n in self.inputs)
        # Bristles on the load side yield with the magnitude of its velocity, which is continuous: no event.
        names = [name for v in rates for name in [v.derivative.name] * f._size(v)]
        bristles = any("loadBristle" in name for name in names)
        # An attitude at rest is no turn; one of nothing is none.
        self.rest = np.zeros(self.nx)
        self.rest[[i for i, name in enumerate(names) if name in ("state.baseQuaternion", "state.baseQuaternion[1]")][:1]] = 1.0
        # Jaws bend where they begin and end: an event of theirs puts them exactly there, and they begin there.
        jaws = [i for i, name in enumerate(names) if name == "state.closing"]
        self.rest[jaws] = 0.5
        self.kinks = [(i, end) for i in jaws for end in (0.0, 1.0)]
        self.kinks += [(i, 0.0) for i, name in enumerate(names) if bristles and re.search("(joint|load)Velocity", name)]

    def read(self, list_):
        vrs = [vr for vr, _ in list_]
        if not vrs:
            return np.zeros(0)
        if self.f.version == 2:
            return np.array(self.f.fmu.getReal(vrs))
        return np.array(self.f.fmu.getFloat64(vrs, nValues=sum(n for _, n in list_)))

    def write(self, z):
        x, u = z[: self.nx], z[self.nx :]
        self.f.fmu.setContinuousStates((ctypes.c_double * self.nx)(*x), self.nx)
        if self.nu:
            vrs = [vr for vr, _ in self.inputs]
            (self.f.fmu.setReal if self.f.version == 2 else self.f.fmu.setFloat64)(vrs, list(u))

    def value(self, z):
        self.write(z)
        return np.concatenate([self.read(self.rates), self.read(self.outputs)])

    def sides(self, z):
        """On which side of each event and of each kink without an event the point is."""
        self.write(z)
        nz = self.f.description.numberOfEventIndicators or 0
        indicators = (ctypes.c_double * max(nz, 1))()
        if nz:
            self.f.fmu.getEventIndicators(indicators, nz)
        return [v > 0 for v in indicators] + [z[i] > at for i, at in self.kinks]

    def derivative(self, seed):
        known = [vr for vr, _ in self.states + self.inputs]
        unknown = [vr for vr, _ in self.rates + self.outputs]
        if self.f.version == 2:
            return np.array(self.f.fmu.getDirectionalDerivative(unknown, known, list(seed)))
        n = sum(k for _, k in self.rates + self.outputs)
        return np.array(self.f.fmu.getDirectionalDerivative(unknown, known, list(seed), n))


# So short that the fourth-order error stays below 1e-7 where an effect bends most: a ripple of several periods per turn,
# a power law near rest. Rounding leaves 1e-9.
STEP = 2e-4
POINTS = 12


def five_points(f):
    """Central difference of fourth order."""
    return (8 * (f(STEP) - f(-STEP)) - (f(2 * STEP) - f(-2 * STEP))) / (12 * STEP)


# With effects: every third one by default.
OF_EFFECTS = [p for p in ALL if "+" in p.name]
LEFT = {p for k, p in enumerate(OF_EFFECTS) if k % 3}


@pytest.mark.parametrize("fmu", [pytest.param(p, marks=[pytest.mark.full] if p in LEFT else [], id=p.name) for p in ALL])
def test_directional_derivatives_equal_central_differences(fmu):
    rng = np.random.default_rng(7)
    worst = []
    # Of six motors that may stick, one often is about to: fewer points have no event near them.
    points = POINTS // 2 if "FlexibleArm" in fmu.name else POINTS
    with Opened(fmu, "ME") as f:
        f.initialize()
        p = Point(f)
        # Nominal values are what a solver resolves; the joint's motor runs a hundred times faster.
        scale_x = (100 if "TwoMassJoint" in fmu.name else 1) * np.array([max(abs(v), 1e-9) for v in state_nominals(f)])
        # The rate of a hysteretic spring and of bristles has a kink where their deformation rests, so not at rest.
        at_rest = 0 if re.search("hysteresis|load-friction|presliding", fmu.name) else 4
        for trial in range(5 * POINTS):
            if len(worst) == points:
                break
            z = np.concatenate([rng.normal(size=p.nx) * scale_x, rng.normal(size=p.nu) * 0.02])
            if trial < at_rest:  # first at rest, so that what can stick does
                z[: p.nx] = p.rest
                z[p.nx :] = rng.normal(size=p.nu) * 1e-3
            p.write(z)
            f.event()
            z[: p.nx] = current_states(f, p.nx)
            seeds = [rng.normal(size=len(z)) * np.concatenate([scale_x, np.full(p.nu, 0.02)]) for _ in range(4)]
            if any(p.sides(z + 2 * STEP * w * seed) != p.sides(z) for seed in seeds for w in (-1, 1)):
                continue  # an event is within the difference: there is no derivative across it
            p.value(z)
            exact = np.array([p.derivative(seed) for seed in seeds])
            difference = np.array([five_points(lambda s: p.value(z + s * seed)) for seed in seeds])
            # Relative to the largest derivative of each unknown among the directions; what changes by less than
            # the rounding of its own value has no difference to compare with.
            value = abs(p.value(z))
            if p.forces:  # sums of forces times levers below 1 m, which cancel where balls have no friction
                value[p.torques] = np.maximum(value[p.torques], value[p.forces].max())
            rounding = 1e-15 * value / STEP
            floor = np.maximum(rounding / 1e-6, 1e-9 * abs(exact).max())
            scale = np.maximum(abs(exact).max(axis=0), floor)
            worst.append((abs(difference - exact) / scale).max())
    print(f"{fmu.name}: quantiles of the relative difference {np.quantile(worst, [0.5, 0.9, 1.0])}")
    assert len(worst) == points and max(worst) < 1e-6


def state_nominals(f):
    out = []
    for u in f.description.derivatives:
        v = u.variable.derivative
        out += [float(v.nominal or 1.0)] * f._size(v)
    return out


def current_states(f, n):
    x = (ctypes.c_double * n)()
    f.fmu.getContinuousStates(x, n)
    return np.array(x)
