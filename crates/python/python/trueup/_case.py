"""Cases: recordings of the real system with its nominal model, and their predictions."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import Error
from ._system import Path, columns

if TYPE_CHECKING:
    import pandas as pd

Floats = npt.NDArray[np.float64]
#: Called with how far the work is (0 to 1; nan: not known) and what is being done.
Progress = Callable[[float, str], object]
#: A recording: a mapping of names to arrays with `time` (s), a structured array, a frame or a `Result`.
Recording = Any
Recordings = Mapping[str, Recording] | Sequence[Recording]
#: Recording, channel, columns by name.
ChannelSeries = tuple[str, str, list[tuple[str, Floats]]]
#: Columns by recording and channel.
ByChannel = dict[str, dict[str, dict[str, Floats]]]


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
        return Problem(self._native.problem(list(parameters), [], [], []))

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


def by_channel(found: Sequence[ChannelSeries]) -> ByChannel:
    """Columns by recording and channel."""
    series: ByChannel = {}
    for recording, channel, table in found:
        series.setdefault(recording, {})[channel] = dict(table)
    return series


def long_frame(series: ByChannel) -> pd.DataFrame:
    """One long frame, with columns `recording` and `channel`."""
    import pandas as pd

    frames = [
        pd.DataFrame({"recording": recording, "channel": channel, **table})
        for recording, channels in series.items()
        for channel, table in channels.items()
    ]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()


__all__ = ["ByChannel", "Case", "ChannelSeries", "Problem", "by_channel", "long_frame"]
