"""The integrators and the event location against SciPy at its tightest tolerance."""

from collections import defaultdict

import numpy as np
import pytest
from scipy.integrate import solve_ivp

RTOL = 1e-12


@pytest.fixture(scope="module")
def ours(example):
    """{(model, solver, tolerance): rows of t and states}; the model "stick-slip event" has times and modes."""
    rows = defaultdict(list)
    for line in example("numerics_referee").splitlines():
        model, solver, tolerance, *values = line.split(",")
        rows[model, solver, float(tolerance)].append([float(v) for v in values])
    return {key: np.array(table) for key, table in rows.items()}


def errors(table, reference, nominal):
    """Errors relative to the states' size, at least the nominal one; prints their quantiles."""
    scale = np.abs(reference) + nominal
    e = np.abs(table - reference) / scale
    print("error quantiles 50, 90, 100 %:", *(f"{q:.1e}" for q in np.quantile(e, [0.5, 0.9, 1.0])))
    return e


def runs(ours, model):
    chosen = [(key, table) for key, table in ours.items() if key[0] == model]
    assert chosen
    for (_, solver, tolerance), table in chosen:
        print(model, solver, f"{tolerance:g}", end=": ")
        yield solver, tolerance, table


def scipy(rates, jacobian, x0, t, method, atol, rtol=RTOL):
    options = {"jac": jacobian} if jacobian else {}
    solution = solve_ivp(rates, (t[0], t[-1]), x0, method, t_eval=t, rtol=rtol, atol=atol, **options)
    assert solution.success
    return solution.y.T


def test_smooth(ours):
    for _, tolerance, table in runs(ours, "bell"):
        t = table[:, 0]
        reference = scipy(lambda t, x: [-2 * t * x[0] ** 2, x[0] - x[1]], None, [1, 0.5], t, "DOP853", 1e-15)
        assert errors(table[:, 1:], reference, 1.0).max() < 10 * tolerance


@pytest.mark.full
def test_van_der_pol(ours):
    def rates(t, x):
        return [x[1], 1e6 * ((1 - x[0] ** 2) * x[1] - x[0])]

    def jacobian(t, x):
        return [[0, 1], [1e6 * (-2 * x[0] * x[1] - 1), 1e6 * (1 - x[0] ** 2)]]

    reference = None
    for _, tolerance, table in runs(ours, "van der pol"):
        if reference is None:
            reference = scipy(rates, jacobian, [2, 0], table[:, 0], "Radau", 1e-14)
        assert errors(table[:, 1:], reference, 1.0).max() < 100 * tolerance


def test_robertson(ours):
    def rates(t, x):
        slow, back, fast = 0.04 * x[0], 1e4 * x[1] * x[2], 3e7 * x[1] ** 2
        return [back - slow, slow - back - fast, fast]

    def jacobian(t, x):
        return [
            [-0.04, 1e4 * x[2], 1e4 * x[1]],
            [0.04, -1e4 * x[2] - 6e7 * x[1], -1e4 * x[1]],
            [0, 6e7 * x[1], 0],
        ]

    nominal = np.array([1e-3, 1e-9, 1.0])
    reference = None
    for _, tolerance, table in runs(ours, "robertson"):
        if reference is None:
            reference = scipy(rates, jacobian, [1, 0, 0], table[:, 0], "Radau", 1e-13 * nominal, 1e-11)
        assert errors(table[:, 1:], reference, nominal).max() < 100 * tolerance


def stick_slip(t_end):
    """Event times and the state as a function of time, phase by phase."""
    v, k, static, kinetic = 0.5, 25.0, 4.0, 2.0
    t, x, stuck, times, phases = 0.0, np.array([0.0, v]), True, [], []
    while t < t_end:
        if stuck:
            rates, end = lambda t, x: [v, 0.0], lambda t, x: static - k * x[0]
        else:
            rates = lambda t, x: [x[1], kinetic - k * x[0]]
            end = lambda t, x: v - x[1] if x[0] < static / k - 1e-6 else 1.0
        end.terminal, end.direction = True, -1
        options = {"rtol": 3e-14, "atol": 1e-15, "max_step": 0.01}  # SciPy looks for events at the ends of steps only
        s = solve_ivp(rates, (t, t_end + 5), x, "DOP853", events=end, dense_output=True, **options)
        phases.append((t, s.t[-1], s.sol))
        t, x, stuck = s.t[-1], s.y[:, -1].copy(), not stuck
        if stuck:
            x[1] = v
        times.append(t)
    return np.array(times), phases


def test_stick_slip(ours):
    times, phases = stick_slip(20.0)
    starts = np.array([phase[0] for phase in phases])
    for _, tolerance, table in runs(ours, "stick-slip"):
        t = table[:, 0]
        reference = np.array([phases[np.searchsorted(starts, s, "right") - 1][2](s) for s in t])
        # Event times carry the error on: every cycle adds to it.
        assert errors(table[:, 1:], reference, [0.1, 0.5]).max() < 100 * tolerance
    for _, tolerance, table in runs(ours, "stick-slip event"):
        e = np.abs(table[:, 0] - times[: len(table)])
        print("events", len(e), "largest error in s", f"{e.max():.1e}")
        assert len(e) == (times <= 20.0).sum() and e.max() < max(10 * tolerance, 1e-11)
