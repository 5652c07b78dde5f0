"""From a case to numbers: a whitened regression problem for the sparse fit, features for the forest."""

import numpy as np
from scipy.linalg import cholesky, qr, solve_triangular

from plant import Push, Wave
from signals import Run

POINTS = 500  # per recording
BANDS = 5
LOUD = 5.0  # a balance speaks if it has a part that is so many times its noise


class Evidence:
    """Balances of a case, whitened by what the sensors' noise makes of them, and columns for parameters and terms.

    `train` and `holdout` hold the triangular factor of [parameters, terms, balances]: least squares on it are those on
    all samples.
    """

    def __init__(self, case, plant):
        self.width = plant.seconds()
        runs = [Run(case, name, self.width, POINTS) for name in case.train + case.holdout]
        for run in runs:
            plant.begin(run)
        plant.sizes(runs)
        self.plant, self.runs, self.count = plant, runs, len(case.train)
        for run in runs:
            run.r = plant.left(run)
            run.valid = plant.valid(run)
            run.parts = {name: plant.by_parameter(run, name) for name in plant.parameters}
            nuisance = plant.nuisance(run)
            run.loose = _basis([rows.ravel() for rows in nuisance], run.valid.size)
        self.whiten = self._noise(case)
        self._silence()
        for run in runs:
            self._first(run)
        self._project()
        columns, self.names = [], []
        for term in plant.terms():
            if isinstance(term, Push):
                built = [self._push(term)]
            elif isinstance(term, Wave):
                built = self._wave(term)
            else:
                gains = [0.0] if len(term.shapes) == 1 else [self._gain(c) for c in self._shapes(term)]
                built = self._columns(lambda run: term.build(run, term.shapes[int(np.argmax(gains))]))
            columns.append(built)
            self.names.append((term.effect, term.place))
        self._finish(columns)

    # One recording: balances, nuisance and parameters.

    def _noise(self, case):
        """Cholesky factor of the balances' covariance under the sensors' noise, by draws of it."""
        random, plant = np.random.default_rng(0), self.plant
        rest = Run(case, case.rest[0], self.width, POINTS).raw if case.rest else {}
        changes = []
        for run in self.runs[: self.count]:
            noisy = {}
            for channel, x in run.raw.items():
                draw = case.deviation(channel) * random.standard_normal(len(x))
                if channel in rest:
                    # Noise of neighbouring samples may be alike; an encoder at rest may also show none at all.
                    seen = np.resize(rest[channel] - rest[channel].mean(), len(x))
                    draw = max(draw, seen, key=lambda e: run.at(e)[0].std())
                draw = draw + run.stamp * random.uniform(-0.5, 0.5, len(x)) * run.full[channel][1]
                noisy[channel] = run.y[channel] + plant.ready(run, draw)
            change = plant.left(run, y={**run.y, **noisy}) - run.r
            changes.append(_beside(run.loose, change.ravel()).reshape(change.shape))
        return cholesky(np.atleast_2d(np.cov(np.hstack(changes))), lower=True)

    def _white(self, run, rows):
        """Independent rows of unit noise; those that do not hold are 0."""
        return np.where(run.valid, solve_triangular(self.whiten, rows, lower=True), 0.0)

    def _silence(self):
        """Takes out balances whose largest part is within the noise: the fit would make their parameters 0. The last
        one stays."""
        runs, plant = self.runs[: self.count], self.plant
        largest = np.zeros(len(plant.rows))
        for name in plant.parts:
            parts = [self._white(r, r.parts[name]) for r in runs]
            largest = np.maximum(largest, np.std(np.hstack(parts), axis=1))
        largest[-1] = np.inf
        for run in self.runs:
            run.valid[largest < LOUD] = False

    def _first(self, run):
        loose = [self._white(run, rows.reshape(run.r.shape)).ravel() for rows in run.loose.T]
        run.loose = _basis(loose, run.valid.size)
        run.target = self._tight(run, run.r)
        run.known = np.column_stack([self._tight(run, run.parts[name]) for name in self.plant.parameters])

    def _tight(self, run, rows):
        return _beside(run.loose, self._white(run, rows).ravel())

    # All recordings for fitting.

    def _project(self):
        """Orthonormal basis of the parameters' columns and what they leave of the balances."""
        known = np.vstack([r.known for r in self.runs[: self.count]])
        target = np.concatenate([r.target for r in self.runs[: self.count]])
        u, s, _ = np.linalg.svd(known, full_matrices=False)
        self.basis = u[:, s > 1e-7 * s[0]]
        self.target, self.left = target, _beside(self.basis, target)
        values = np.linalg.lstsq(known, target, rcond=1e-7)[0]
        for run in self.runs:
            run.left = run.target - run.known @ values

    def _column(self, run, signals):
        return self._tight(run, self.plant.by_signals(run, signals))

    def _shapes(self, term):
        """Columns over the recordings for fitting, shape by shape."""
        for shape in term.shapes:
            built = [[self._column(r, s) for s in term.build(r, shape)] for r in self.runs[: self.count]]
            yield np.column_stack([np.concatenate(parts) for parts in zip(*built)])

    def _columns(self, build):
        """Columns over all recordings, each a list over them; `build` gives a recording's signals."""
        built = [[self._column(r, s) for s in build(r)] for r in self.runs]
        return [list(parts) for parts in zip(*built)]

    def _explained(self, columns):
        """What columns explain of that which the parameters leave."""
        beside = _beside(self.basis, columns)
        size = np.linalg.norm(beside, axis=0)
        # A column that the parameters can represent explains nothing.
        beside = beside[:, size > 1e-6 * np.linalg.norm(columns, axis=0) + 1e-300]
        if not beside.shape[1]:
            return np.zeros_like(self.left)
        q, _ = np.linalg.qr(beside / np.linalg.norm(beside, axis=0))
        return q @ (q.T @ self.left)

    def _gain(self, columns):
        return np.sum(self._explained(columns) ** 2) / np.sum(self.left**2)

    def _reach(self, run, port):
        """What a unit at a port does to the white rows at every point; rows with memory are left out."""
        unit = self._white(run, self.plant.by_signals(run, {port: np.ones_like(run.t)}))
        return np.where(np.reshape(self.plant.slow, (-1, 1)), 0.0, unit)

    def _wave(self, wave):
        """Sine and cosine of the order at which a periodogram over the angle is largest."""
        power = np.zeros(len(wave.orders))
        for run in self.runs[: self.count]:
            angle = run.at(wave.angle(run))[0]
            # A constant offset of a reading may be without effect: what moves is seen by all rows alike then.
            reach = np.ones_like(run.r) if wave.port.startswith("reading:") else self._reach(run, wave.port)
            seen = np.sum(reach * run.left.reshape(run.valid.shape), axis=0)
            power += np.abs(np.exp(1j * np.outer(wave.orders, angle)) @ seen) ** 2
        order = wave.orders[int(power.argmax())]

        def build(run):
            angle = wave.angle(run)
            return [{wave.port: np.sin(order * angle)}, {wave.port: np.cos(order * angle)}]

        return self._columns(build)

    def _push(self, push):
        """Per recording the interval in which a push at these ports explains most, with its size: one column."""
        column = []
        for run in self.runs:
            left = run.left.reshape(run.valid.shape)
            seen, size = [], []
            for port in push.ports:
                d = self._reach(run, port)
                seen.append(np.concatenate([[0], np.cumsum(np.sum(d * left, axis=0))]))
                size.append(np.concatenate([[0], np.cumsum(np.sum(d * d, axis=0))]))
            seen, size = np.array(seen), np.array(size)
            best = (-1.0, 0, 1)
            for width in {max(2, round(w * run.rate / run.step)) for w in (0.1, 0.2, 0.4, 0.8, 1.6)}:
                if width < seen.shape[1]:
                    within, weight = seen[:, width:] - seen[:, :-width], size[:, width:] - size[:, :-width]
                    gain = np.sum(within**2 / (weight + 1e-9 * size[:, -1:] + 1e-300), axis=0)
                    best = max(best, (gain.max(), int(gain.argmax()), width))
            _, begin, width = best
            weight = size[:, begin + width] - size[:, begin]
            force = (seen[:, begin + width] - seen[:, begin]) / (weight + 1e-9 * size[:, -1] + 1e-300)
            at = (np.arange(begin, begin + width + 1)[[0, -1]] + run.points.start) * run.step
            shape = np.zeros_like(run.t)
            shape[at[0] : at[1]] = 1.0
            column.append(self._column(run, {port: x * shape for port, x in zip(push.ports, force)}))
        return column

    def _finish(self, columns):
        group = np.repeat(np.arange(len(columns)), [len(c) for c in columns])
        flat = [c for term in columns for c in term]
        sets = {"train": range(self.count), "holdout": range(self.count, len(self.runs))}
        self.arrays = {"group": group, "known": self.runs[0].known.shape[1]}
        for name, which in sets.items():
            chosen = [(self.runs[i], [c[i] for c in flat]) for i in which]
            rows = [np.column_stack([run.known, *terms, run.target]) for run, terms in chosen]
            matrix = np.vstack(rows) if rows else np.zeros((1, len(flat) + self.arrays["known"] + 1))
            self.arrays[name] = qr(matrix, mode="r")[0][: matrix.shape[1]]
            self.arrays[f"{name}_samples"] = sum(int(self.runs[i].valid.sum()) for i in which)
        self.features = self._features(columns)

    # What the forest sees.

    def _by_row(self, x):
        """Sum of squares per row of the balances, over the recordings for fitting."""
        total, begin = np.zeros(len(self.plant.rows)), 0
        for run in self.runs[: self.count]:
            total += np.sum(x[begin : begin + run.valid.size].reshape(run.valid.shape) ** 2, axis=1)
            begin += run.valid.size
        return total

    def _features(self, columns):
        rows, runs = self.plant.rows, self.runs[: self.count]
        counts = np.sum([r.valid.sum(axis=1) for r in runs], axis=0) + 1e-9
        before, left = self._by_row(self.target), self._by_row(self.left)
        features = {"rows": len(rows), "parameters": np.log10(left.sum() / before.sum())}
        for i, row in enumerate(rows):
            features[f"level before, {row}"] = 0.5 * np.log10(before[i] / counts[i] + 1e-9)
            features[f"level, {row}"] = 0.5 * np.log10(left[i] / counts[i] + 1e-9)
            power = np.zeros(BANDS)
            for run in runs:
                spectrum = np.abs(np.fft.rfft(run.left.reshape(run.valid.shape)[i])) ** 2
                frequency = np.fft.rfftfreq(run.valid.shape[1], run.step / run.rate)
                band = np.digitize(frequency, [0.3, 1.0, 3.0, 10.0])
                power += np.bincount(band, spectrum, BANDS)[:BANDS]
            for b in range(BANDS):
                features[f"band {b}, {row}"] = power[b] / (power.sum() + 1e-300)
        for (effect, place), parts in zip(self.names, columns):
            matrix = np.column_stack([np.concatenate(c[: self.count]) for c in parts])
            explained = self._explained(matrix)
            gains = (left - self._by_row(self.left - explained)) / left.sum()
            features[f"{effect}, {place}"] = gains.sum()
            for row, gain in zip(rows, gains):
                features[f"{effect}, {place}, {row}"] = gain
            best = features.get(f"{effect}, best", 0.0)
            features[f"{effect}, best"] = max(best, gains.sum())
        return features


def _basis(columns, rows):
    """Orthonormal basis of columns."""
    return np.linalg.qr(np.column_stack(columns))[0] if columns else np.empty((rows, 0))


def _beside(basis, x):
    """x without its part in the basis."""
    return x - basis @ (basis.T @ x)
