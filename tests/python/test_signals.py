"""The signal processing of trueup-signals against SciPy and NumPy."""

import numpy as np
import pytest
from scipy import signal, stats

RATE = 100.0


@pytest.fixture(scope="module")
def signals():
    """Uneven times, a swing with noise, and a nearly white signal that goes with it."""
    rng = np.random.default_rng(7)
    n = 1003
    t = np.cumsum(rng.uniform(0.5, 1.5, n)) / RATE
    x = 3.0 + np.sin(0.07 * np.arange(n)) + 0.2 * rng.standard_normal(n)
    y = rng.standard_normal(n) + 0.1 * x
    return t, x, y


@pytest.fixture(scope="module")
def ours(signals, example):
    text = "\n".join(",".join(repr(float(v)) for v in s) for s in signals) + "\n"
    rows = (line.split(",") for line in example("signals_referee", text).splitlines())
    return {name: np.array(values, dtype=float) for name, *values in rows}


def cases(ours, name):
    found = [(tuple(map(float, key.split()[1:])), v) for key, v in ours.items() if key.split()[0] == name]
    assert found
    return found


def close(a, b, tolerance):
    error = np.max(np.abs(a - b)) / np.max(np.abs(b))
    print(f"largest error relative to the largest value: {error:.1e}")
    assert error < tolerance


def test_zero_phase_butterworth(ours, signals):
    for (order, cutoff), y in cases(ours, "filtfilt"):
        sos = signal.butter(int(order), cutoff, fs=RATE, output="sos")
        close(y, signal.sosfiltfilt(sos, signals[1]), 1e-11)
        if order <= 3:  # the plain form, while it is well conditioned
            b, a = signal.butter(int(order), cutoff, fs=RATE)
            close(y, signal.filtfilt(b, a, signals[1]), 1e-8)


def by_fits(x, window, degree, derivative):
    """The definition, one well-scaled polynomial fit per window."""
    half = window // 2
    y = np.empty_like(x)
    for i in range(len(x)):
        first = min(max(i - half, 0), len(x) - window)
        at = np.arange(first, first + window) / RATE
        y[i] = np.polynomial.Legendre.fit(at, x[first : first + window], degree).deriv(derivative)(i / RATE)
    return y


def test_savitzky_golay(ours, signals):
    for (window, degree, derivative), y in cases(ours, "savgol"):
        window, degree, derivative = int(window), int(degree), int(derivative)
        if window < 50:
            theirs = signal.savgol_filter(signals[1], window, degree, derivative, delta=1 / RATE)
            close(y, theirs, 1e-10)
        else:  # SciPy's powers of unscaled abscissae, up to 50^5, lose digits
            close(y, by_fits(signals[1], window, degree, derivative), 1e-11)


def test_gradient(ours, signals):
    close(ours["gradient"], np.gradient(signals[1], signals[0]), 1e-11)


def test_welch_and_coherence(ours, signals):
    _, x, y = signals
    for (segment,), p in cases(ours, "welch"):
        close(p, signal.welch(x, RATE, nperseg=int(segment))[1], 1e-12)
    for (segment,), c in cases(ours, "coherence"):
        close(c, signal.coherence(x, y, RATE, nperseg=int(segment))[1], 1e-10)
    close(ours["frequency 101"], signal.welch(x, RATE, nperseg=101)[0], 1e-15)


def test_whiteness(ours, signals):
    def r(x, lags):
        d = x - x.mean()
        return np.array([d[: len(d) - k] @ d[k:] for k in range(lags + 1)]) / (d @ d)

    _, x, y = signals
    close(ours["autocorrelation"], r(x, 40), 1e-12)
    n = len(y)
    for (lags,), (q, p) in cases(ours, "ljung-box"):
        k = np.arange(1, int(lags) + 1)
        theirs = n * (n + 2) * np.sum(r(y, int(lags))[1:] ** 2 / (n - k))
        close(np.array([q]), np.array([theirs]), 1e-10)
        close(np.array([p]), np.array([stats.chi2.sf(theirs, lags)]), 1e-9)


def test_metric(ours, signals):
    _, x, y = signals
    close(ours["nrmse"], np.array([np.sqrt(np.mean((x - y) ** 2)) / np.std(y)]), 1e-13)
