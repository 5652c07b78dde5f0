"""A running FMU, step by step: for controllers of one's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._errors import Error

if TYPE_CHECKING:
    import pandas as pd

    from . import _native
    from ._system import Fmu, Linear

Floats = npt.NDArray[np.float64]


class Derivatives(NamedTuple):
    """Partial derivatives, elements of arrays row by row."""

    of: tuple[str, ...]
    by: tuple[str, ...]
    #: A row for each of `of`, a column for each of `by`.
    matrix: Floats

    def to_pandas(self) -> pd.DataFrame:
        """As a frame."""
        import pandas as pd

        return pd.DataFrame(self.matrix, index=list(self.of), columns=list(self.by))


class Instance:
    """One FMU in Co-Simulation after initialization; a context manager, which ends it.

        with tu.Model("PlanarManipulator").instance() as arm:
            arm.set("jointTorque", [0.1, 0.0, 0.0])      # or arm["jointTorque[1]"] = 0.1
            arm.step(0.01)
            arm["jointAngle"]                            # an array; a scalar is a float

    Inputs hold their values over a step. `fmu.instance(parameters)` makes one.
    """

    def __init__(self, native: _native.Instance, fmu: Fmu, values: Mapping[str, Any]) -> None:
        self._native, self._fmu, self._values = native, fmu, dict(values)

    @property
    def time(self) -> float:
        """In s."""
        return self._native.time

    def step(self, dt: float) -> None:
        """Advances by `dt` s."""
        self._native.step(float(dt))

    def get(self, name: str) -> float | Floats:
        """The value of any variable, in its unit: a scalar as a float, an array with its shape. Booleans are 0 or 1."""
        shape, values = self._native.get(name)
        return values.reshape(shape) if shape else float(values[0])

    def set(self, name: str, value: npt.ArrayLike) -> None:
        """Sets an input or a tunable parameter, an array with all its elements or `name[1]`, in its unit."""
        values = np.asarray(value, dtype=np.float64)
        self._native.set(name, np.ascontiguousarray(values.ravel()))

    def __getitem__(self, name: str) -> float | Floats:
        return self.get(name)

    def __setitem__(self, name: str, value: npt.ArrayLike) -> None:
        self.set(name, value)

    def derivatives(self, of: str | Sequence[str], by: str | Sequence[str]) -> Derivatives:
        """The FMU's own partial derivatives of some variables with respect to others at this point, as of outputs by inputs; exact,
        between events."""
        named = [[names] if isinstance(names, str) else list(names) for names in (of, by)]
        rows, columns, matrix = self._native.derivatives(*named)
        return Derivatives(tuple(rows), tuple(columns), matrix)

    def linearize(self) -> Linear:
        """A, B, C, D about this point (`Fmu.linearize`): states and inputs as they are now. An event that is due there is handled
        first: a joint that rests sticks."""
        fmu = self._fmu
        names = fmu.linearize(parameters=self._values).states
        states = {name: float(np.asarray(self.get(name))) for name in names}
        inputs = {v.name: self.get(v.name) for v in fmu.variables.values() if v.causality == "input"}
        return fmu.linearize(self.time, states=states, inputs=inputs, parameters=self._values)

    def close(self) -> None:
        """Ends it; a second time it does nothing."""
        self._native.close()

    def __enter__(self) -> Instance:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except Error:
            # The failure inside counts, not that of its end.
            if error is None:
                raise

    def __repr__(self) -> str:
        return f"<Instance of {self._fmu.model}>"


__all__ = ["Derivatives", "Instance"]
