"""Parameters of a case."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._case import Case, ChannelSeries, Floats, Problem, Progress, by_channel, long_frame
from ._model import Model
from ._result import Result
from ._system import Path

if TYPE_CHECKING:
    import pandas as pd


class Fit:
    """Parameters from recordings. `json` is what `trueup identify --json` prints."""

    def __init__(
        self,
        text: str,
        notes: list[str],
        series: Sequence[ChannelSeries],
        case: Case,
        effects: list[str],
    ) -> None:
        self.json: dict[str, Any] = json.loads(text)
        #: What was noticed in the case.
        self.notes = notes
        self._found, self._case, self._effects = by_channel(series), case, effects

    @property
    def parameters(self) -> pd.DataFrame:
        """Value, standard error, 95 % interval and unit of each parameter; what is uncertain and was estimated too is below."""
        import pandas as pd

        def row(found: dict[str, Any]) -> dict[str, Any]:
            low, high = found["ci95"]
            keys = ("value", "standard_error", "nominal", "unit")
            return {**{key: found[key] for key in keys}, "low": low, "high": high}

        found = {**self.json["parameters"], **self.json["uncertain"]}
        order = ["value", "standard_error", "low", "high", "nominal", "unit"]
        return pd.DataFrame({name: row(one) for name, one in found.items()}).T.reindex(columns=order)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return {name: found["value"] for name, found in self.json["parameters"].items()}

    @property
    def names(self) -> list[str]:
        """Of parameters whose uncertainty is known."""
        found = {**self.json["parameters"], **self.json["uncertain"]}
        return [n for n in self.json["correlation"]["names"] if found[n]["standard_error"] is not None]

    @property
    def covariance(self) -> Floats:
        """Of the parameters in `names`."""
        found = {**self.json["parameters"], **self.json["uncertain"]}
        all_names = self.json["correlation"]["names"]
        at = [all_names.index(name) for name in self.names]
        correlation = np.array(self.json["correlation"]["matrix"], dtype=np.float64)[np.ix_(at, at)]
        errors = np.array([found[name]["standard_error"] for name in self.names], dtype=np.float64)
        return correlation * np.outer(errors, errors)

    def draws(self, n: int = 2000, seed: int = 1) -> dict[str, Floats]:
        """Draws of the normal distribution about the estimates (Laplace's approximation)."""
        found = {**self.json["parameters"], **self.json["uncertain"]}
        mean = [found[name]["value"] for name in self.names]
        drawn = np.random.default_rng(seed).multivariate_normal(mean, self.covariance, size=n)
        return {name: drawn[:, i] for i, name in enumerate(self.names)}

    def model(self, *, fmi: int = 3) -> Model:
        """The model with the estimates and the effects that were fitted, as `trueup fmu pack --from` packs it."""
        return Model.of_result(self.json, fmi=fmi)

    def predict(
        self, t: npt.ArrayLike | None = None, inputs: Any = None, **options: Any
    ) -> pd.DataFrame | Result:
        """What the fitted model shows.

        Without arguments: along the recordings of the case, each from its estimated first state, a long frame with the columns
        `recording`, `channel`, `time`, `measured`, `predicted` (without a hold-out of those fitted alone). With times and inputs:
        a run of `model()`, with the arguments of `Model.simulate`."""
        if t is None and inputs is None and not options:
            return long_frame(self._found)
        return self.model().simulate(t, inputs, **options)

    def problem(self, parameters: Sequence[str] | None = None) -> Problem:
        """The case's recordings for fitting as a function of these parameters (by default of those in `names` that the model has),
        everything else at the estimates, first states of each recording too."""
        start = (self.json.get("pack") or {}).get("start", {})
        names = [name for name in self.names if name in start] if parameters is None else list(parameters)
        found = {**self.json["parameters"], **self.json["uncertain"]}
        values = [(name, float(one["value"])) for name, one in found.items() if name in start]
        first = [
            (recording, [(name, float(one["value"])) for name, one in own.items()])
            for recording, own in self.json["nuisance"].items()
        ]
        return Problem(self._case._native.problem(names, self._effects, values, first))

    def to_arviz(self, n: int = 500, seed: int = 1) -> Any:
        """All that ArviZ compares and plots, one chain of `n` draws (InferenceData, or DataTree from its version 1 on).

        `posterior`: draws about the estimates (Laplace's approximation). `prior`: of the parameters for which the case has a
        standard deviation. `posterior_predictive`, `observed_data`: by channel, its recordings for fitting one behind
        the other (coordinates of recording and time); `log_likelihood`: of all readings. Predictions are linear about the estimates, by the model's exact
        derivatives, as the posterior is. So `az.compare`, `az.loo` and `az.plot_ppc` work."""
        from ._arviz import inference_data

        return inference_data(self, n, seed)

    def __repr__(self) -> str:
        return f"<Fit of {self.json['model']}: {', '.join(f'{n} = {x:.6g}' for n, x in self.values.items())}>"

    def _repr_html_(self) -> str:
        def cell(x: Any) -> str:
            return "open" if x is None else f"{x:.5g}" if isinstance(x, float) else html.escape(str(x))

        heads = ("parameter", "value", "unit", "standard error", "95 % interval", "in the case")
        rows = ""
        for name, p in {**self.json["parameters"], **self.json["uncertain"]}.items():
            interval = f"{cell(p['ci95'][0])} .. {cell(p['ci95'][1])}"
            texts = (name, cell(p["value"]), p["unit"], cell(p["standard_error"]), interval, cell(p["nominal"]))
            rows += "<tr><td>" + "</td><td>".join(texts) + "</td></tr>"
        on = "held-out recordings" if self.json["fit_on"] == "holdout" else "the recordings fitted"
        fits = ", ".join(f"{html.escape(c)} {cell(f['nrmse'])}" for c, f in self.json["fit"].items())
        head = "".join(f"<th>{h}</th>" for h in heads)
        return f"<table><tr>{head}</tr>{rows}</table><p>RMS of the misfit over variation, on {on}: {fits}</p>"


def identify(
    case: Case | Path,
    method: str = "output-error",
    *,
    effects: Sequence[str] = (),
    fast: bool = False,
    progress: Progress | None = None,
) -> Fit:
    """Parameters of a case, with uncertainty, as `trueup identify` finds them.

    Parameters:
        case: a case, or its folder.
        method: `output-error`, `nelder-mead`, `innovations`, or for a joint `ls-literal`, `ls`, `filtered`, `iv`, `break-away`.
        effects: ids of effects that are fitted together with the parameters.
        fast: intervals from standard errors, without profiles of the likelihood.
        progress: receives what is being done.
    """
    case = case if isinstance(case, Case) else Case(case)
    return Fit(*case._native.identify(method, list(effects), not fast, progress), case, list(effects))


__all__ = ["Fit", "identify"]
