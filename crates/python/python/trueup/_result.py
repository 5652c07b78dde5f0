"""What a run gave."""

from __future__ import annotations

import html
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from ._errors import Error

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa  # type: ignore[import-untyped]
    import xarray as xr

Array = npt.NDArray[Any]


class Drawable(Protocol):
    """What Jupyter shows."""

    def _repr_html_(self) -> str: ...


def base(name: str) -> str:
    """`jointAngle` of `jointAngle[2]`."""
    return name.partition("[")[0] if name.endswith("]") else name


def unknown(name: str, known: list[str], what: str) -> Error:
    """There is no such name; the nearest one is the remedy."""
    import difflib

    near = difflib.get_close_matches(name, known, 1)
    mend = f"did you mean `{near[0]}`?" if near else f"there is {', '.join(known[:12])}"
    return Error(f"there is no {what} `{name}`; {mend}", variable=name, mend=mend)


class Result:
    """Columns over `time` (s). `result["loadAngle"]` is a column, of an array variable all its elements, a row for each time."""

    #: Times in s.
    time: npt.NDArray[np.float64]
    #: Unit of each column; empty: none.
    units: dict[str, str]
    #: What was chosen or noticed on the way.
    notes: list[str]

    def __init__(
        self,
        time: npt.NDArray[np.float64],
        columns: dict[str, Array],
        units: dict[str, str] | None = None,
        notes: list[str] | None = None,
    ) -> None:
        self.time, self._columns = time, columns
        self.units, self.notes = units or {}, notes or []

    @property
    def names(self) -> list[str]:
        """Names of the columns, without `time`."""
        return list(self._columns)

    @property
    def events(self) -> npt.NDArray[np.float64]:
        """Times in s at which there are two rows, before and after an event, of a run with `events=True`. One that falls on a time of
        the grid may have one row only."""
        return np.unique(self.time[1:][np.diff(self.time) == 0.0])

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self._columns

    def __getitem__(self, name: str) -> Array:
        if name == "time":
            return self.time
        column = self._columns.get(name)
        if column is not None:
            return column
        elements = [values for other, values in self._columns.items() if base(other) == name]
        if not elements:
            raise unknown(name, self.names, "column")
        return np.stack(elements, axis=1)

    def __repr__(self) -> str:
        return f"<Result: {len(self)} rows, {len(self._columns)} columns: {', '.join(self.names[:6])}{', ...' if len(self._columns) > 6 else ''}>"

    def to_pandas(self) -> pd.DataFrame:
        """A frame with the time in s as index; units are in its `attrs`."""
        import pandas as pd

        frame = pd.DataFrame(self._columns, index=pd.Index(self.time, name="time"))
        frame.attrs["units"] = dict(self.units)
        return frame

    def to_xarray(self) -> xr.Dataset:
        """A dataset over `time`, a variable for each column, with its unit."""
        import xarray as xr

        def attributes(name: str) -> dict[str, str]:
            return {"units": self.units[name]} if self.units.get(name) else {}

        variables = {name: ("time", x, attributes(name)) for name, x in self._columns.items()}
        return xr.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})

    def to_arrow(self) -> pa.Table:
        """A table of Arrow with the column `time` (s) first; a field's metadata has its unit as `unit`."""
        import pyarrow as pa

        def field(name: str, array: pa.Array, unit: str | None) -> pa.Field:
            return pa.field(name, array.type, metadata={"unit": unit} if unit else None)

        columns = {"time": self.time, **self._columns}
        units = {"time": "s", **self.units}
        arrays = {name: pa.array(values) for name, values in columns.items()}
        schema = pa.schema([field(name, array, units.get(name)) for name, array in arrays.items()])
        return pa.Table.from_arrays(list(arrays.values()), schema=schema)

    def to_numpy(self) -> Array:
        """A structured array with the field `time` first, as FMPy and `input=` have it."""
        fields = [("time", np.dtype(np.float64)), *((n, x.dtype) for n, x in self._columns.items())]
        table = np.empty(len(self.time), dtype=fields)
        table["time"] = self.time
        for name, values in self._columns.items():
            table[name] = values
        return table

    def plot(self, *names: str, ax: Any = None) -> Any:
        """Draws these columns (all if none is named) and returns the axes; nothing is shown."""
        import matplotlib.pyplot as plt

        if ax is None:
            ax = plt.figure().add_subplot()
        for name in names or self.names:
            unit = self.units.get(name)
            ax.plot(self.time, self[name], label=f"{name} ({unit})" if unit else name)
        ax.set_xlabel("time (s)")
        ax.legend()
        return ax

    def _repr_html_(self) -> str:
        def cells(tag: str, texts: list[str]) -> str:
            return "<tr>" + "".join(f"<{tag}>{html.escape(t)}</{tag}>" for t in texts) + "</tr>"

        def row(i: int) -> str:
            return cells("td", [f"{self.time[i]:.6g}", *(f"{x[i]:.6g}" for x in self._columns.values())])

        n = len(self)
        shown = list(range(n)) if n <= 8 else [0, 1, 2, -1, n - 3, n - 2, n - 1]
        gap = cells("td", ["..."] * (1 + len(self._columns)))
        rows = "".join(gap if i < 0 else row(i) for i in shown)
        units = cells("td", ["s", *(self.units.get(name, "") for name in self.names)])
        return f"<table>{cells('th', ['time', *self.names])}{units}{rows}</table><p>{n} rows</p>"
