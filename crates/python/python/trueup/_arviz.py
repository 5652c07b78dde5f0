"""A fit as ArviZ has it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._case import Floats
    from ._fit import Fit


def inference_data(fit: Fit, n: int, seed: int) -> Any:
    """See `Fit.to_arviz`."""
    import arviz as az

    draws = fit.draws(n, seed)
    rng = np.random.default_rng(seed)
    problem = fit.problem()
    found = {**fit.json["parameters"], **fit.json["uncertain"]}
    theta = np.array([found[name]["value"] for name in problem.names], dtype=np.float64)
    mean, jacobian = problem.predict_and_jacobian(theta)
    away = np.stack([draws[name] for name in problem.names], axis=1) - theta
    groups: dict[str, dict[str, Floats]] = {
        "posterior": {name: x[None, :] for name, x in draws.items()},
        "prior": {},
        "log_likelihood": {},
        "posterior_predictive": {},
        "observed_data": {},
    }
    for name in draws:
        deviation = found[name].get("prior")
        if deviation and found[name]["nominal"]:
            scale = abs(found[name]["nominal"]) * deviation
            groups["prior"][name] = rng.normal(found[name]["nominal"], scale, size=(1, n))
    coords: dict[str, Any] = {}
    dims: dict[str, list[str]] = {}
    rows: dict[str, list[int]] = {}
    labels: dict[str, list[str]] = {}
    for recording, channel, part in problem.channels:
        at = range(*part.indices(len(problem.measured)))
        rows.setdefault(channel, []).extend(at)
        labels.setdefault(channel, []).extend([recording] * len(at))
    # One variable for all channels, as `az.compare` and `az.loo` expect it.
    reading = "all readings"
    likelihood = np.empty((len(away), len(problem.measured)))
    dims["reading"] = [reading]
    coords[reading] = np.arange(len(problem.measured))
    names = np.empty(len(problem.measured), dtype=object)
    for channel, which in rows.items():
        dim = f"{channel} reading"
        dims[channel] = [dim]
        coords[dim] = np.arange(len(which))
        coords[f"recording of {channel}"] = (dim, labels[channel])
        coords[f"time of {channel}"] = (dim, problem.time[which])
        names[which] = channel
        predicted = mean[which] + away @ jacobian[which].T
        measured, deviation = problem.measured[which], problem.deviation[which]
        off = (measured - predicted) / deviation
        likelihood[:, which] = -0.5 * off**2 - np.log(np.sqrt(2 * np.pi) * deviation)
        noise = deviation * rng.standard_normal(predicted.shape)
        groups["posterior_predictive"][channel] = (predicted + noise)[None]
        groups["observed_data"][channel] = measured
    groups["log_likelihood"]["reading"] = likelihood[None]
    coords["channel"] = (reading, names.astype(str))
    # Coordinates along a dimension are added behind: not every version takes them with the data.
    along = {key: coords.pop(key) for key in [k for k in coords if isinstance(coords[k], tuple)]}
    filled: dict[str, Any] = {key: group for key, group in groups.items() if group}
    if int(az.__version__.partition(".")[0]) >= 1:
        data = az.from_dict(filled, coords=coords, dims=dims)
    else:
        data = az.from_dict(**filled, coords=coords, dims=dims)
    for key in ("log_likelihood", "posterior_predictive", "observed_data"):
        own = {name: one for name, one in along.items() if one[0] in data[key].dims}
        data[key] = data[key].assign_coords(own)
    return data


__all__ = ["inference_data"]
