"""Cases: recordings of the real system with its nominal model; parameters and causes from them."""

from __future__ import annotations

import html
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import Error
from ._program import run
from ._result import Result
from ._system import Path, columns

if TYPE_CHECKING:
    import pandas as pd

Floats = npt.NDArray[np.float64]
#: Called with how far the work is (0 to 1; nan: not known) and what is being done.
Progress = Callable[[float, str], object]
#: A recording: a mapping of names to arrays with `time` (s), a structured array, a frame or a `Result`.
Recording = Any
Recordings = Mapping[str, Recording] | Sequence[Recording]


class Case:
    """Recordings with a model. Of a folder: `Case("folder")`. From memory: `Case(model=..., train=[...], ...)`.

    Parameters:
        path: a folder with a `case.toml`, or that file.
        model: the model's name.
        train: recordings that may be used for fitting, a list or a mapping with names for them.
        holdout: recordings for the figures reported alone.
        rest: recordings at rest: their variation is noise.
        repeats: groups of names of recordings with the same command.
        parameters: nominal values, structural choices too.
        uncertain: relative prior standard deviations of these values.
        fit: names of what is estimated.
        channels: what is known of sensors, `{"loadAngle": {"resolution": 1e-4}}`.
        others: further tables of a `case.toml`, as `effects` and `payload`.
    """

    def __init__(
        self,
        path: Path | None = None,
        *,
        model: str | None = None,
        train: Recordings = (),
        holdout: Recordings = (),
        rest: Recordings = (),
        repeats: Sequence[Sequence[str]] = (),
        parameters: Mapping[str, Any] | None = None,
        uncertain: Mapping[str, float] | None = None,
        fit: Sequence[str] | None = None,
        channels: Mapping[str, Mapping[str, Any]] | None = None,
        **others: Any,
    ) -> None:
        self._path = os.fspath(path) if path is not None else None
        self._said: dict[str, Any] = {}
        self._tables: dict[str, dict[str, Floats]] = {}
        if self._path is not None:
            if model is not None or train or holdout or parameters:
                mend = "give the folder alone, or a model with recordings"
                raise Error(f"`path` is a whole case; {mend}", variable="path", mend=mend)
            self._native = _native.Case.read(self._path)
            return
        if model is None:
            mend = "give model=\"TwoMassJoint\", or the folder of a case"
            raise Error(f"a case has no `model`; {mend}", variable="model", mend=mend)
        self._said = {"model": model}
        for key, recordings in (("train", train), ("holdout", holdout), ("rest", rest)):
            if recordings:
                self._said[key] = self._add(key, recordings)
        if repeats:
            self._said["repeats"] = [list(group) for group in repeats]
        tables = {
            "parameters": parameters,
            "uncertain": uncertain,
            "channels": channels,
            "fit": {"parameters": list(fit)} if fit is not None else None,
            **others,
        }
        self._said.update((key, _plain(table)) for key, table in tables.items() if table)
        self._native = self._built()

    def _add(self, key: str, recordings: Recordings) -> list[str]:
        if isinstance(recordings, Mapping):
            named = [(str(name), one) for name, one in recordings.items()]
        else:
            named = [(f"{key}-{i}.csv", one) for i, one in enumerate(recordings, 1)]
        for name, one in named:
            table = columns(one, name)
            if "time" not in table:
                mend = "give it a column `time` in s"
                raise Error(f"{name}: there is no `time`; {mend}", variable="time", file=name, mend=mend)
            self._tables[name] = {"time": table.pop("time"), **table}
        return [name for name, _ in named]

    def _built(self) -> _native.Case:
        tables = [(name, list(table.items())) for name, table in self._tables.items()]
        return _native.Case.of(json.dumps(self._said), tables)

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in vars(self).items() if key != "_native"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._native = self._built() if self._path is None else _native.Case.read(self._path)

    def save(self, folder: Path) -> _Path:
        """Writes it as a folder that the program reads: `case.toml` and recordings, every number so that it reads back as the
        same bits. The folder must be empty, or not there yet."""
        to = _Path(folder)
        if to.exists() and any(to.iterdir()):
            mend = "name a new folder"
            raise Error(f"{to}: there is something in it; {mend}", file=str(to), mend=mend)
        if self._path is not None:
            path = _Path(self._path)
            shutil.copytree(path if path.is_dir() else path.parent, to, dirs_exist_ok=True)
            return to
        to.mkdir(parents=True, exist_ok=True)
        for name, table in self._tables.items():
            file = to / (name if name.endswith(".csv") else f"{name}.csv")
            if file.name != name:
                mend = "name it so, for a folder holds files"
                raise Error(f"the recording `{name}` does not end with .csv; {mend}", variable=name, mend=mend)
            with open(file, "w", encoding="utf-8") as out:
                out.write(",".join(f'"{c}"' if "," in c else c for c in table) + "\n")
                for row in zip(*(values.tolist() for values in table.values())):
                    out.write(",".join("" if x != x else repr(x) for x in row) + "\n")
        (to / "case.toml").write_text(self._native.text or "", encoding="utf-8")
        return to

    def problem(self, parameters: Sequence[str]) -> Problem:
        """The model along the recordings for fitting as a function of these parameters."""
        return Problem(self._native.problem(list(parameters)))

    def __repr__(self) -> str:
        return f"Case({self._path!r})" if self._path is not None else f"Case({self._said!r})"


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's."""
    if isinstance(value, Mapping):
        return {str(key): _plain(v) for key, v in value.items()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value


class Problem:
    """Predictions of recordings as a function of parameters, with exact sensitivities (by dual numbers, across events).

    Predictions of all channels of all recordings are concatenated; `channels` gives the rows of each.
    """

    def __init__(self, native: _native.Problem) -> None:
        self._native = native
        #: Names of the parameters, in the order of `theta`.
        self.names: list[str] = native.names
        #: The prior of the case, in the parameters' units.
        self.start: Floats = native.start
        #: Smallest and largest values, as SciPy takes them.
        self.bounds: tuple[Floats, Floats] = (np.array(native.bounds[0]), np.array(native.bounds[1]))
        found = native.channels
        #: Recording, channel, and the range of its predictions.
        self.channels: list[tuple[str, str, slice]] = []
        at = 0
        for recording, channel, times, _, _ in found:
            self.channels.append((recording, channel, slice(at, at + len(times))))
            at += len(times)
        empty = np.empty(0)
        #: Times in s.
        self.time: Floats = np.concatenate([empty, *(c[2] for c in found)])
        #: What was measured.
        self.measured: Floats = np.concatenate([empty, *(c[3] for c in found)])
        #: Standard deviation of each reading.
        self.deviation: Floats = np.concatenate([empty, *(c[4] for c in found)])

    def predict(self, theta: npt.ArrayLike) -> Floats:
        """Predictions with these values."""
        return self._native.predict(np.ascontiguousarray(theta, dtype=np.float64))

    def predict_and_jacobian(self, theta: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Predictions and their derivatives: a row for each prediction, a column for each parameter."""
        return self._native.predict_and_jacobian(np.ascontiguousarray(theta, dtype=np.float64))

    def residuals(self, theta: npt.ArrayLike) -> Floats:
        """Predicted less measured, in standard deviations: what SciPy's `least_squares` takes."""
        return (self.predict(theta) - self.measured) / self.deviation

    def jacobian(self, theta: npt.ArrayLike) -> Floats:
        """Of the residuals."""
        return self.predict_and_jacobian(theta)[1] / self.deviation[:, None]

    def __repr__(self) -> str:
        return f"<Problem: {len(self.measured)} readings, parameters {', '.join(self.names)}>"


class Fit:
    """Parameters from recordings. `json` is what `trueup identify --json` prints."""

    def __init__(self, text: str, notes: list[str]) -> None:
        self.json: dict[str, Any] = json.loads(text)
        #: What was noticed in the case.
        self.notes = notes

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

    def to_arviz(self, n: int = 2000, seed: int = 1) -> Any:
        """The draws as ArviZ has them, one chain (InferenceData, or DataTree from its version 1 on)."""
        import arviz as az

        posterior = {name: x[None, :] for name, x in self.draws(n, seed).items()}
        if int(az.__version__.partition(".")[0]) >= 1:
            return az.from_dict({"posterior": posterior})
        return az.from_dict(posterior=posterior)

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


class Diagnosis:
    """Where the gap between a simulation and recordings is, and what causes it. `json` is `diagnosis.json`; `augmented` is
    null there, for files are written by `report`."""

    def __init__(self, text: str, notes: list[str], case: Case, options: list[str]) -> None:
        self.json: dict[str, Any] = json.loads(text)
        #: What was noticed in the case.
        self.notes = notes
        self._case, self._options = case, options

    @property
    def verdict(self) -> str:
        """`no-gap`, `parameters`, `effects`, `ambiguous` or `unknown`."""
        return str(self.json["verdict"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """What is claimed, most probable first."""
        return list(self.json["effects"])

    @property
    def gap(self) -> dict[str, Any]:
        """Before, tuned, after and floor, overall and by channel; `window`: the same over windows of a few periods."""
        return dict(self.json["gap"])

    @property
    def where(self) -> dict[str, Any]:
        """Shares of the gap by component, channel, time, regime and frequency."""
        return dict(self.json["where"])

    @property
    def candidates(self) -> pd.DataFrame:
        """All causes that were weighed."""
        import pandas as pd

        return pd.DataFrame(self.json["candidates"])

    def report(self, folder: Path) -> _Path:
        """Writes all files of `trueup diagnose` (page, augmented FMUs, next experiment) into a folder, by the program; it
        diagnoses once more. The path of the page."""
        to = _Path(folder)
        with tempfile.TemporaryDirectory(prefix="trueup-case-") as temporary:
            path = self._case._path
            source = path if path is not None else str(self._case.save(_Path(temporary) / "case"))
            run("diagnose", source, "-o", os.fspath(to), *self._options)
        return to / "report.html"

    def __repr__(self) -> str:
        claimed = ", ".join(f"{e['id']} ({e['probability']:.2f})" for e in self.effects)
        return f"<Diagnosis of {self.json['model']}: {self.verdict}{': ' if claimed else ''}{claimed}>"

    def _repr_html_(self) -> str:
        overall = self.gap.get("overall") or {}
        figures = ", ".join(
            f"{key} {overall[key]:.4g}" for key in ("before", "tuned", "after", "floor") if overall.get(key) is not None
        )
        rows = "".join(
            f"<tr><td>{html.escape(e['id'])}</td><td>{html.escape(e['component'])}</td><td>{e['probability']:.2f}</td></tr>"
            for e in self.effects
        )
        table = f"<table><tr><th>effect</th><th>component</th><th>probability</th></tr>{rows}</table>" if rows else ""
        return f"<p><b>{html.escape(self.verdict)}</b></p>{table}<p>gap: {figures}</p>"


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
        method: `output-error`, `nelder-mead`, or for a joint `ls-literal`, `ls`, `filtered`, `iv`, `break-away`.
        effects: ids of effects that are fitted together with the parameters.
        fast: intervals from standard errors, without profiles of the likelihood.
        progress: receives what is being done.
    """
    case = case if isinstance(case, Case) else Case(case)
    return Fit(*case._native.identify(method, list(effects), not fast, progress))


def diagnose(
    case: Case | Path,
    *,
    seed: int = 1,
    force: bool = False,
    watch: bool = False,
    all_readings: bool = False,
    verdict_only: bool = False,
    progress: Progress | bool | None = None,
) -> Diagnosis:
    """Where the gap of a case is and what causes it, as `trueup diagnose` finds it.

    Parameters:
        case: a case, or its folder.
        seed: of all that is drawn.
        force: goes on in spite of grave findings.
        watch: recordings for fitting are healthy; when do those held out part from them?
        all_readings: large recordings are not thinned.
        verdict_only: neither where the gap is nor what to record next.
        progress: receives the share done; `True` writes that to standard error.
    """
    case = case if isinstance(case, Case) else Case(case)
    tell = _written if progress is True else progress or None
    found = case._native.diagnose(seed, force, watch, all_readings, verdict_only, tell)
    flags = {"--force": force, "--watch": watch, "--all-readings": all_readings}
    options = [f"--seed={seed}", *(flag for flag, on in flags.items() if on)]
    return Diagnosis(*found, case, options)


def _written(part: float, what: str) -> None:
    import sys

    print(f"{100 * part:3.0f} %  {what}", file=sys.stderr)


__all__ = ["Case", "Diagnosis", "Fit", "Problem", "Result", "diagnose", "identify"]
