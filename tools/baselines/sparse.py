"""Sparse regression (PySINDy's STLSQ) of the balances on parameters and candidate terms."""

import warnings

import numpy as np
from pysindy import STLSQ

from cases import Answer

THRESHOLDS = np.geomspace(0.5, 0.01, 12)  # of a term's share in what the parameters leave
RIDGE = 0.01
NOISE = 1.5  # balances up to so many times their noise are no gap
WORTH = 0.15  # terms, or parameters, have to take away so much of the hold-out's squared balances
SLACK = 0.1  # of the improvement that a sparser model may give up


def _fit(x, y, threshold):
    """Coefficients of the normalized columns that stay; all of them where the threshold is 0."""
    fit = STLSQ(threshold=threshold, alpha=RIDGE, max_iter=30)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a threshold takes out everything is one of the outcomes
        fit.fit(x, y)
    return np.ravel(fit.coef_)


def answer(problem):
    """The verdict on a case: `problem` holds what evidence.py reduced it to, nothing where it could not."""
    if not problem:
        return Answer("unknown")
    known, group, names = int(problem["known"]), problem["group"], problem["names"]
    train, holdout = problem["train"], problem["holdout"]
    # Below the parameters' rows of the triangular factor is what they cannot explain.
    x, y = train[known:, known:-1], train[known:, -1]
    norms = np.linalg.norm(train[:, known:-1], axis=0) + 1e-300
    size = np.linalg.norm(x, axis=0)
    usable = size > 1e-3 * norms  # the rest is what parameters could do as well
    scale = np.where(usable, size, np.inf)

    def error(c, parameters=True):
        """Root mean square on the hold-out, in units of the noise, with the parameters that go with the terms c."""
        target = train[:known, -1] - train[:known, known:-1] @ c
        values = np.linalg.lstsq(train[:known, :known], target, rcond=1e-7)[0] if parameters else np.zeros(known)
        return np.linalg.norm(holdout @ np.concatenate([values, c, [-1.0]])) / np.sqrt(problem["holdout_samples"])

    nothing = np.zeros(len(group))
    nominal, refitted = error(nothing, parameters=False), error(nothing)
    models = []
    total = np.linalg.norm(y) + 1e-300
    for threshold in THRESHOLDS:
        c = np.zeros(len(group))
        c[usable] = _fit(x[:, usable] / scale[usable], y / total, threshold)
        c = np.where(usable, c * total / scale, 0.0)
        models.append((error(c), c))
    least = min(e for e, _ in models)
    ranked = _ranked([c for _, c in models], x, group, names)
    if refitted**2 - least**2 < WORTH * refitted**2:
        if nominal <= NOISE and nominal**2 - refitted**2 < WORTH * nominal**2:
            return Answer("no-gap", ranked=ranked)
        return Answer("parameters" if refitted <= NOISE else "unknown", ranked=ranked)
    enough = least**2 + SLACK * (refitted**2 - least**2)
    chosen = next(c for e, c in models if e**2 <= enough)
    claimed = _ranked([chosen], x, group, names)
    return Answer("effects", claimed, list(dict.fromkeys(claimed + ranked)))


def _ranked(models, x, group, names):
    """Effects by the sparsest model that has them, within it by their contribution."""
    found = {}
    for rank, c in enumerate(models):
        for g in np.unique(group[c != 0]):
            share = np.linalg.norm(x[:, group == g] @ c[group == g])
            best = found.get(names[g], (rank, 0.0))
            if best[0] == rank:
                found[names[g]] = (rank, min(best[1], -share))
    return sorted(found, key=found.get)
