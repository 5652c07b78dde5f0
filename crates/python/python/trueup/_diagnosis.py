"""What separates a simulation from its recordings."""

from __future__ import annotations

import html
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any

from ._case import Case, ChannelSeries, Progress, by_channel, long_frame
from ._errors import Error
from ._model import Model
from ._program import run
from ._system import Path

if TYPE_CHECKING:
    import pandas as pd


class Diagnosis:
    """Where the gap between a simulation and recordings is, and what causes it. `json` is `diagnosis.json`; `augmented` is
    null there, for files are written by `report`."""

    def __init__(
        self,
        text: str,
        notes: list[str],
        files: list[tuple[str, bytes]],
        series: Sequence[ChannelSeries],
    ) -> None:
        self.json: dict[str, Any] = json.loads(text)
        #: What was noticed in the case.
        self.notes = notes
        self._files, self._found = dict(files), by_channel(series)

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

    @property
    def parameters(self) -> pd.DataFrame:
        """Everything that was estimated, effects first: value, the user's value and its standard deviation, the change relative to
        either, the 95 % interval, both sides of the gear."""
        import pandas as pd

        def row(effect: str | None, one: dict[str, Any]) -> dict[str, Any]:
            value, nominal, deviation = one["value"], one.get("nominal"), one.get("nominal_deviation")
            sides = one.get("sides") or {}
            known = nominal is not None
            return {
                "effect": effect,
                "value": value,
                "nominal": nominal,
                "change": (value - nominal) / abs(nominal) if known and nominal else None,
                "nominal_deviation": deviation,
                "change_in_deviations": (value - nominal) / deviation if known and deviation else None,
                "low": one["ci95"][0],
                "high": one["ci95"][1],
                "motor_side": sides.get("motor"),
                "load_side": sides.get("load"),
                "unit": one["unit"],
            }

        rows: dict[str, dict[str, Any]] = {}
        for e in self.json["effects"]:
            for name, one in e["parameters"].items():
                indexed = name if self.json["model"] == "TwoMassJoint" or not e["joint"] else f"{name}[{e['joint']}]"
                rows[indexed] = row(e["id"], one)
        for name, one in self.json["parameters"].items():
            rows[name] = row(None, one)
        return pd.DataFrame.from_dict(rows, orient="index")

    @property
    def residuals(self) -> pd.DataFrame:
        """Measured and simulated (`before`, `tuned`, `after`) of the compared recordings, and the standard deviation that noise alone
        leaves: a long frame with the columns `recording` and `channel`. The twist of a transmission is a channel, too."""
        return long_frame(self._found)

    def model(self, *, fmi: int = 3) -> Model:
        """The reported model: refitted values, with the effects that are claimed."""
        return Model.of_result(self.json, fmi=fmi)

    def report(self, folder: Path) -> _Path:
        """Writes all files of `trueup diagnose` (page, augmented FMUs, next experiment) into a folder; nothing is computed again. The
        path of the page."""
        page = "report.html"
        if page not in self._files:
            mend = "diagnose without verdict_only"
            raise Error(f"a verdict alone has no page; {mend}", variable="verdict_only", mend=mend)
        to = _Path(folder)
        to.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="trueup-report-", dir=to) as made:
            for name, content in self._files.items():
                (_Path(made) / name).write_bytes(content)
            if json.loads(self._files["diagnosis.json"])["augmented"]:
                run("fmu", "pack", "--from", str(_Path(made) / "diagnosis.json"), "-o", made)
            # All or nothing.
            for file in sorted(_Path(made).iterdir()):
                file.replace(to / file.name)
        return to / page

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
    return Diagnosis(*case._native.diagnose(seed, force, watch, all_readings, verdict_only, tell))


def _written(part: float, what: str) -> None:
    import sys

    print(f"{100 * part:3.0f} %  {what}", file=sys.stderr)


__all__ = ["Diagnosis", "diagnose"]
