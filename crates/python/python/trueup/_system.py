"""FMUs and systems of them."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _native
from ._errors import Error
from ._instance import Instance
from ._result import Array, Result, base

if TYPE_CHECKING:
    import pandas as pd

Path = str | os.PathLike[str]
#: A start value: a number, a truth, the name of an enumeration's item, or an array of numbers.
Value = float | int | bool | str | Sequence[float] | Array
#: Inputs over time: by name, each as long as the times; or a structured array or a frame with the times in it.
Inputs = Mapping[str, npt.ArrayLike] | Array

#: Relative to a step: what is less is rounding.
_EVEN = 1e-6

_DTYPES = {"bool": np.bool_, "int64": np.int64, "uint64": np.uint64, "float32": np.float32}


def text(value: Value) -> str:
    """A start value as the program reads it: of a number the digits that read back as the same bits."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return ",".join(text(item.item()) for item in np.asarray(value).ravel())


def floats(name: str, values: Any) -> npt.NDArray[np.float64]:
    """One column of numbers, `nan` where something is missing."""
    try:
        column = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as e:
        mend = "give numbers, nan where nothing was measured"
        raise Error(f"`{name}` holds what is no number ({e}); {mend}", variable=name, mend=mend) from None
    if column.ndim != 1:
        mend = f"give one column for each element, `{name}[1]`"
        raise Error(f"`{name}` has {column.ndim} dimensions; {mend}", variable=name, mend=mend)
    return column


def columns(table: Any, what: str) -> dict[str, npt.NDArray[np.float64]]:
    """The columns of a mapping, a structured array or a frame, `time` (s) among them. A frame may have its times as index,
    numbers in s or a `TimedeltaIndex`. Columns of two dimensions become elements, `name[1]`."""
    if isinstance(table, Result):
        table = {"time": table.time, **{name: table[name] for name in table.names}}
    names = getattr(table, "columns", None)
    dtype = getattr(table, "dtype", None)
    if names is not None and hasattr(table, "index"):
        listed = [str(name) for name in names]
        twice = next((name for name in listed if listed.count(name) > 1), None)
        if twice is not None:
            mend = "rename or drop one"
            raise Error(f"{what}: two columns are named `{twice}`; {mend}", variable=twice, mend=mend)
        found: dict[str, Any] = {}
        if "time" not in listed:
            found["time"] = seconds(table.index)
        found.update((name, table[key].to_numpy()) for name, key in zip(listed, names))
    elif dtype is not None and dtype.names:
        found = {name: table[name] for name in dtype.names}
    elif isinstance(table, Mapping):
        found = dict(table)
    else:
        mend = "give a mapping of names to arrays, a structured array, or a frame"
        raise Error(f"{what}: a {type(table).__name__} has no named columns; {mend}", mend=mend)
    flat: dict[str, npt.NDArray[np.float64]] = {}
    for name, values in found.items():
        array = np.asarray(values)
        if array.ndim < 2:
            flat[name] = floats(name, array)
            continue
        for index in np.ndindex(*array.shape[1:]):
            element = f"{name}[{','.join(str(i + 1) for i in index)}]"
            flat[element] = floats(element, array[(slice(None), *index)])
    return flat


def seconds(index: Any) -> npt.NDArray[np.float64]:
    """Times in s of a frame's index."""
    if hasattr(index, "total_seconds"):
        return floats("time", index.total_seconds())
    return floats("time", index)


def grid(t: npt.ArrayLike) -> tuple[float, float, float]:
    """Start, stop and step of times that are evenly spaced."""
    times = floats("time", t)
    if len(times) < 2:
        mend = "give at least a start and a stop"
        raise Error(f"`t` has {len(times)} times; {mend}", variable="t", mend=mend)
    step = (times[-1] - times[0]) / (len(times) - 1)
    off = np.abs(times - (times[0] + step * np.arange(len(times))))
    worst = int(np.argmax(off))
    if not (step > 0 and off[worst] <= _EVEN * step):
        mend = "give numpy.linspace(start, stop, n), and interpolate the result where you need other times"
        raise Error(
            f"`t` is not even: row {worst} is {times[worst]:.9g} s; {mend}", variable="t", mend=mend
        )
    return float(times[0]), float(times[-1]), float(step)


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU."""

    name: str
    causality: str
    variability: str
    type: str
    #: Empty: none.
    unit: str
    #: The start values; empty: none, or no numbers.
    start: tuple[float, ...]
    description: str
    #: Of an array; empty: a scalar.
    shape: tuple[int, ...]
    #: Names of its values in results, an array's elements row by row; empty: their number is not known.
    columns: tuple[str, ...]

    def _cells(self) -> list[str]:
        start = ", ".join(f"{x:g}" for x in self.start[:4]) + (", ..." if len(self.start) > 4 else "")
        return [self.name, self.causality, self.type, self.unit, start, self.description]


class Variables(dict[str, Variable]):
    """Variables by name; Jupyter shows a table."""

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{h}</th>" for h in ("name", "causality", "type", "unit", "start", "description"))
        rows = ("<td>" + "</td><td>".join(map(html.escape, v._cells())) + "</td>" for v in self.values())
        return f"<table><tr>{head}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>"

    def to_pandas(self) -> pd.DataFrame:
        """A frame with a row for each variable."""
        import pandas as pd

        frame = pd.DataFrame([vars(v) for v in self.values()])
        return frame.set_index("name")


class System:
    """FMUs that are coupled, as a file (TOML or SSP) defines. Threads may run one system at once, Python's lock is released."""

    def __init__(self, file: Path) -> None:
        self._file = os.fspath(file)
        self._native = _native.System(self._file)
        self._components = self._native.components()

    @classmethod
    def from_toml(cls, file: Path) -> System:
        """The same as `System(file)`."""
        return cls(file)

    @classmethod
    def from_ssp(cls, file: Path) -> System:
        """The same as `System(file)`."""
        return cls(file)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._file,)

    @property
    def file(self) -> str:
        """The file that it was read from."""
        return self._file

    @property
    def notes(self) -> list[str]:
        """What was chosen while reading."""
        return self._native.notes

    @cached_property
    def variables(self) -> Variables:
        """Variables of all components, `component.variable`."""
        found = Variables()
        for component in self._components:
            prefix = f"{component['name']}." if component["name"] else ""
            for v in component["variables"]:
                name = prefix + v["name"]
                found[name] = Variable(
                    name,
                    v["causality"],
                    v["variability"],
                    v["type"],
                    v["unit"] or "",
                    tuple(v["start"] or ()),
                    v["description"],
                    tuple(v["shape"] or ()),
                    tuple(prefix + column for column in v["columns"] or ()),
                )
        return found

    def simulate(
        self,
        t: npt.ArrayLike | None = None,
        inputs: Inputs | None = None,
        parameters: Mapping[str, Value] | None = None,
        *,
        start: float | None = None,
        stop: float | None = None,
        step: float | None = None,
        outputs: Sequence[str] = (),
        tolerance: float | None = None,
        algorithm: str | None = None,
        interface: str | None = None,
        events: bool | None = None,
    ) -> Result:
        """Runs it.

        Parameters:
            t: evenly spaced times in s at which there are results; or give `start`, `stop`, `step` (s), each by default what
                the FMUs propose.
            inputs: arrays by name, as long as `t`; a structured array or a frame with its own times, `time` in s. Between
                samples a continuous input follows the line, others hold. `nan` is missing.
            parameters: start values of parameters and inputs by name, in the variables' units.
            outputs: what is recorded; all outputs if nothing is named.
            tolerance: relative, of integrators and of the coupling.
            algorithm: how components are coupled (`jacobi`, `gauss-seidel`, `iterative`, `adaptive`, ...).
            interface: `co-simulation` or `model-exchange`.
            events: two rows at each event between times; with `t` there are none by default.
        """
        if t is not None:
            if start is not None or stop is not None or step is not None:
                mend = "give `t` alone, or `start`, `stop` and `step`"
                raise Error(f"`t` gives start, stop and step already; {mend}", variable="t", mend=mend)
            start, stop, step = grid(t)
            events = bool(events)
        signals = None
        if inputs is not None:
            table = columns(inputs, "inputs")
            times = table.pop("time", None)
            if times is None:
                if t is None:
                    mend = "give `t`, or a column `time` in s"
                    raise Error(f"`inputs` have no times; {mend}", variable="inputs", mend=mend)
                times = floats("time", t)
            signals = [(name, times, values) for name, values in table.items()]
        values = [(name, text(value)) for name, value in (parameters or {}).items()]
        heads, time, series, notes = self._native.run(
            start, stop, step, tolerance, algorithm, interface, values, signals, list(outputs), events
        )
        found: dict[str, Array] = {}
        for (name, kind, _), column in zip(heads, series):
            dtype = _DTYPES.get(kind)
            # A value that is not due is nan, which only floats have.
            fits = dtype is not None and not (kind != "float32" and np.isnan(column).any())
            found[name] = column.astype(dtype) if dtype is not None and fits else column
        return Result(time, found, {name: unit for name, _, unit in heads if unit}, notes)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._file!r})"

    def _repr_html_(self) -> str:
        parts = (f"{c['name'] or c['model']} (FMI {c['fmi_version']})" for c in self._components)
        return f"<p>{html.escape(', '.join(parts))}</p>{self.variables._repr_html_()}"


@dataclass(frozen=True)
class Linear:
    """dx/dt = f(x, u), y = g(x, u) about one point, as it is between events: `f + A (x - x0) + B (u - u0)`, `y + C .. + D ..`.

    Iterating gives A, B, C, D."""

    #: Names of rows and columns, arrays by element; values are in the variables' units.
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    #: The point: states and inputs there, derivatives of the states, outputs.
    x: npt.NDArray[np.float64]
    u: npt.NDArray[np.float64]
    f: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    #: df/dx, df/du, dg/dx, dg/du.
    A: npt.NDArray[np.float64]
    B: npt.NDArray[np.float64]
    C: npt.NDArray[np.float64]
    D: npt.NDArray[np.float64]

    def __iter__(self) -> Iterator[npt.NDArray[np.float64]]:
        return iter((self.A, self.B, self.C, self.D))

    def to_pandas(self) -> pd.DataFrame:
        """All four as one frame: rows `der(..)` of the states, then outputs; columns states, then inputs."""
        import pandas as pd

        rows = [*(f"der({name})" for name in self.states), *self.outputs]
        return pd.DataFrame(
            np.block([[self.A, self.B], [self.C, self.D]]), index=rows, columns=[*self.states, *self.inputs]
        )


class Fmu(System):
    """One FMU, anybody's: read and loaded once, run often."""

    @property
    def model(self) -> str:
        """Name of its model."""
        return str(self._components[0]["model"])

    @property
    def fmi_version(self) -> str:
        """As in its description, `2.0` or `3.0`."""
        return str(self._components[0]["fmi_version"])

    def instance(
        self,
        parameters: Mapping[str, Value] | None = None,
        *,
        start: float = 0.0,
        tolerance: float | None = None,
    ) -> Instance:
        """A running instance in Co-Simulation, to be stepped.

        Parameters:
            parameters: start values of parameters and inputs by name.
            start: time in s at which it begins.
            tolerance: relative, of its integrator.
        """
        given = dict(parameters or {})
        values = [(name, text(value)) for name, value in given.items()]
        return Instance(self._native.instance(start, tolerance, values), self, given)

    def linearize(
        self,
        t: float = 0.0,
        *,
        states: Mapping[str, float] | None = None,
        inputs: Mapping[str, Value] | None = None,
        parameters: Mapping[str, Value] | None = None,
    ) -> Linear:
        """Its exact derivatives where a run begins, for Model Exchange.

        Parameters:
            t: time in s at which it begins.
            states: values of continuous states by name, elements as `q[1]`, in their units; the others are as the run begins. An
                event that is due there is handled first: a joint that rests sticks, and `x` is what came of it.
            inputs: by name.
            parameters: start values of parameters by name.
        """
        values = [(name, text(value)) for name, value in {**(parameters or {}), **(inputs or {})}.items()]
        given = [(name, float(value)) for name, value in (states or {}).items()]
        ((xs, x), (us, u), (_, f), (ys, y)), flat = self._native.linear(t, values, given)
        whole = flat.reshape(len(x) + len(y), len(x) + len(u))
        top, bottom = whole[: len(x)], whole[len(x) :]
        n = len(x)
        return Linear(
            tuple(xs), tuple(us), tuple(ys), x, u, f, y, top[:, :n], top[:, n:], bottom[:, :n], bottom[:, n:]
        )

    @cached_property
    def by_column(self) -> dict[str, Variable]:
        """The variable of each column that a result may have."""
        return {column: v for v in self.variables.values() for column in v.columns}


__all__ = ["Fmu", "Linear", "System", "Variable", "Variables", "base"]
