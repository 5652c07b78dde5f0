"""`simulate_fmu` with FMPy's arguments and result."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import Error
from ._result import Array
from ._system import Fmu, Path, Value, Variable

_INTERFACES = {None: None, "CoSimulation": "co-simulation", "ModelExchange": "model-exchange"}

#: As FMPy has them, in the order in which it lists columns.
_TYPES: list[tuple[str, Any]] = [
    ("Real", np.float64),
    ("Float32", np.float32),
    ("Float64", np.float64),
    ("Int8", np.int8),
    ("UInt8", np.uint8),
    ("Int16", np.int16),
    ("UInt16", np.uint16),
    ("Int32", np.int32),
    ("UInt32", np.uint32),
    ("Int64", np.int64),
    ("UInt64", np.uint64),
    ("Integer", np.int32),
    ("Boolean", np.bool_),
]
#: Place and type of a column.
_ORDER = {name: (place, dtype) for place, (name, dtype) in enumerate(_TYPES)}

#: FMUs that were opened last, by path and time of change: reading one takes longer than a short run.
_open: dict[str, tuple[tuple[int, int], Fmu]] = {}
_lock = threading.Lock()
_MOST_OPEN = 16


def opened(filename: Path | Fmu) -> Fmu:
    """The FMU, read once as long as its file does not change."""
    if isinstance(filename, Fmu):
        return filename
    name = os.path.abspath(filename)
    try:
        found = os.stat(name)
    except OSError:
        return Fmu(filename)  # which raises the error
    stamp = (found.st_mtime_ns, found.st_size)
    with _lock:
        known = _open.pop(name, None)
        fmu = known[1] if known is not None and known[0] == stamp else None
        if fmu is None or os.path.isdir(name):
            fmu = Fmu(filename)
        _open[name] = (stamp, fmu)
        if len(_open) > _MOST_OPEN:
            del _open[next(iter(_open))]
        return fmu


def simulate_fmu(
    filename: Path | Fmu,
    validate: bool = True,
    start_time: float | str | None = None,
    stop_time: float | str | None = None,
    solver: str = "CVode",
    step_size: float | str | None = None,
    relative_tolerance: float | str | None = None,
    output_interval: float | str | None = None,
    record_events: bool = True,
    fmi_type: str | None = None,
    start_values: Mapping[str, Value] | None = None,
    apply_default_start_values: bool = False,
    input: Array | None = None,
    output: Sequence[str] | None = None,
    **others: Any,
) -> Array:
    """Runs an FMU as FMPy's `simulate_fmu` does: the same arguments, a structured array of the same fields.

    Times are in s. `solver` and `step_size` are FMPy's own integrators: here events are located and the step follows
    `relative_tolerance`, so both are accepted and not used; `validate` is always done. What FMPy can do and this cannot
    (`fmu_instance`, `step_finished`, ...) is refused.
    """
    refused = [name for name, value in others.items() if value]
    if refused:
        mend = "leave it out, or call fmpy.simulate_fmu"
        raise Error(f"`{refused[0]}` is not offered here; {mend}", variable=refused[0], mend=mend)
    if fmi_type not in _INTERFACES:
        mend = "give 'CoSimulation' or 'ModelExchange'"
        raise Error(f"`fmi_type` is {fmi_type!r}; {mend}", variable="fmi_type", mend=mend)
    fmu = opened(filename)
    start, stop = _number("start_time", start_time), _number("stop_time", stop_time)
    interval = _number("output_interval", output_interval)
    result = fmu.simulate(
        inputs=input,
        parameters=start_values,
        start=start,
        stop=stop,
        step=interval,
        outputs=[name for name in output or () if name != "time"],
        tolerance=_number("relative_tolerance", relative_tolerance),
        interface=_INTERFACES[fmi_type],
        events=None if record_events else False,
    )
    dtype, fields = _layout(fmu, tuple(result))
    table = np.empty(len(result), dtype=dtype)
    table["time"] = result.time
    for name, columns, shape in fields:
        if not shape:
            table[name] = result[columns[0]]
            continue
        elements = np.stack([result[column] for column in columns], axis=1)
        table[name] = elements.reshape(len(result), *shape)
    return table


_Layout = tuple[np.dtype[Any], list[tuple[str, tuple[str, ...], tuple[int, ...]]]]
#: Of results that have these columns: making one takes as long as a short run.
_layouts: weakref.WeakKeyDictionary[Fmu, dict[tuple[str, ...], _Layout]] = weakref.WeakKeyDictionary()


def _layout(fmu: Fmu, columns: tuple[str, ...]) -> _Layout:
    """Type of a structured array, and of each field its name, columns and shape."""
    known = _layouts.setdefault(fmu, {})
    if columns not in known:
        names = {fmu.by_column[column].name for column in columns}
        typed = [(*_ORDER[_type(v, fmu.fmi_version)], v) for name, v in fmu.variables.items() if name in names]
        typed.sort(key=lambda one: one[0])
        dtype = np.dtype([("time", np.float64), *(_field(v, of) for _, of, v in typed)])
        known[columns] = dtype, [(v.name, v.columns, v.shape) for _, _, v in typed]
    return known[columns]


def _type(v: Variable, fmi_version: str) -> str:
    if v.type == "Enumeration":
        return "Integer" if fmi_version.startswith("2") else "Int64"
    return v.type


def _field(v: Variable, dtype: Any) -> tuple[str, Any] | tuple[str, Any, tuple[int, ...]]:
    return (v.name, dtype, v.shape) if v.shape else (v.name, dtype)


def _number(name: str, value: float | str | None) -> float | None:
    if value is None:
        return None
    try:
        return float(value)
    except (TypeError, ValueError):
        mend = "give a number in s" if name != "relative_tolerance" else "give a number"
        raise Error(f"`{name}` is {value!r}; {mend}", variable=name, mend=mend) from None
