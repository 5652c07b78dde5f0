"""Smoothing differentiation and the signals that candidate terms are made of."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import bilinear, lfilter


class Smoother:
    """Value, first and second derivative by a sliding bump (1 - t^2)^4 and the bump's own derivatives.

    All three are exactly those of one smoothed signal. So a linear balance that holds for the readings holds for what
    comes out, however wide the bump is; a sliding polynomial would smooth an acceleration otherwise than an angle.
    """

    def __init__(self, rate, seconds):
        self.half = max(3, round(0.5 * seconds * rate))
        bump = np.polynomial.Polynomial([1.0, 0.0, -1.0]) ** 4
        t = np.arange(-self.half, self.half + 1) / rate
        kernels = [bump.deriv(d)(t / (t[-1] + 0.5 / rate)) if d else bump(t / (t[-1] + 0.5 / rate)) for d in range(3)]
        value = kernels[0] / kernels[0].sum()
        slope = kernels[1] / (kernels[1] @ t)
        bend = kernels[2] - kernels[2].sum() * value
        self.kernels = np.column_stack([value, slope, 2 * bend / (bend @ t**2)])

    def __call__(self, x, step=1):
        """(3, samples); the ends are those of a signal that stays as it is."""
        padded = np.pad(x, self.half, mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, len(self.kernels))
        return (windows[::step] @ self.kernels).T


class Run:
    """A recording on an even grid.

    `raw`: the readings. `full`: their derivatives at every sample, hardly smoothed, for terms that are not linear. `at`
    smooths readings and terms alike, at the points that take part in the regression.
    """

    def __init__(self, case, name, seconds, points):
        time, channels = case.recording(name)
        dt = np.median(np.diff(time))
        self.rate = 1.0 / dt
        # Uneven instants are rounded to this; what moves is read wrongly by as much times its speed.
        uneven = np.abs(np.diff(time) - dt).max() > 1e-9
        self.stamp = 1e-5 if uneven else 0.0
        self.t = time[0] + dt * np.arange(int(np.floor((time[-1] - time[0]) / dt + 1e-6)) + 1)
        self.smoother = Smoother(self.rate, seconds)
        self.raw = {c: _even(time, x, self.t, case.held(c)) for c, x in channels.items()}
        self.fine = Smoother(self.rate, min(seconds, 7 / self.rate))
        self.full = {c: self.fine(x) for c, x in self.raw.items()}
        # Where the windows leave the recording nothing is known.
        edge = self.smoother.half + self.fine.half
        self.step = max(1, (len(self.t) - 2 * edge) // points)
        self.points = slice(-(-edge // self.step), max((len(self.t) - edge) // self.step, -(-edge // self.step) + 8))

    def at(self, x):
        """A signal of all samples, smoothed at the points: (3, points)."""
        return self.smoother(x, self.step)[:, self.points]

    def values(self, rows):
        """The same of several rows, without derivatives: (rows, points)."""
        half = self.smoother.half
        padded = np.pad(rows, ((0, 0), (half, half)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=1)
        return (windows[:, :: self.step] @ self.smoother.kernels[:, 0])[:, self.points]


def _even(time, x, grid, held):
    good = np.isfinite(x)
    if not good.any():
        return np.zeros_like(grid)
    time, x = time[good], x[good]
    if held:
        # Means over a period around each instant: a value that is held is late by half a period.
        half = 0.5 * (grid[1] - grid[0])
        area = np.concatenate([[0.0], np.cumsum(x[:-1] * np.diff(time))])
        return (np.interp(grid + half, time, area) - np.interp(grid - half, time, area)) / (
            np.clip(grid + half, time[0], time[-1]) - np.clip(grid - half, time[0], time[-1])
        )
    return CubicSpline(time, x)(np.clip(grid, time[0], time[-1]))


def dahl(x, reach):
    """Hysteresis between -1 and 1 by Dahl's law, exact between the turning points of x."""
    way = np.sign(np.diff(x))
    turns = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [len(way)]])
    z = np.zeros(len(x))
    for a, b in zip(turns[:-1], turns[1:]):
        z[a : b + 1] = way[a] + (z[a] - way[a]) * np.exp(-np.abs(x[a : b + 1] - x[a]) / reach)
    return z


def carried(x, rate, frequency, ratio=0.02):
    """Motion of a mass on a spring whose foot moves as x, against the foot."""
    w = 2 * np.pi * frequency
    return lfilter(*bilinear([2 * ratio * w, w * w], [1.0, 2 * ratio * w, w * w], rate), x - x[0]) - (x - x[0])


def late(x, rate, seconds):
    """x some time ago, less x."""
    at = np.arange(len(x)) - seconds * rate
    return np.interp(at, np.arange(len(x)), x) - x


def beyond(x, limit):
    """What of x exceeds a limit."""
    return np.sign(x) * np.maximum(np.abs(x) - limit, 0.0)
