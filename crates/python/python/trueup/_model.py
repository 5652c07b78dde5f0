"""The models of the template library."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path as _Path
from typing import Any

from ._errors import Error
from ._program import run
from ._system import Fmu, Path, Value, text


def models() -> str:
    """Models with their presets, structures and effects, as `trueup fmu list` prints them."""
    return run("fmu", "list").stdout


class Model(Fmu):
    """A model, ready to run: packed as an FMU (as `trueup fmu pack` does) into a temporary folder that goes with it.

    Parameters:
        name: as `models()` lists it.
        preset: values of its parameters by a name.
        effects: ids of what acts beyond its equations, a place behind a colon.
        flexible: which joints are flexible.
        structure: choices by name, `{"base": "fixed"}`.
        robot: a robot's file (TOML or URDF), for the models that take one.
        parameters: start values.
        fmi: version of FMI, 2 or 3.
    """

    def __init__(
        self,
        name: str,
        *,
        preset: str | None = None,
        effects: Sequence[str] = (),
        flexible: Sequence[bool] = (),
        structure: Mapping[str, str | int] | None = None,
        robot: Path | None = None,
        parameters: Mapping[str, Value] | None = None,
        fmi: int = 3,
    ) -> None:
        self._arguments: dict[str, Any] = {
            "preset": preset,
            "effects": tuple(effects),
            "flexible": tuple(flexible),
            "structure": dict(structure or {}),
            "robot": robot,
            "parameters": dict(parameters or {}),
            "fmi": fmi,
        }
        self._name = name
        folder = tempfile.mkdtemp(prefix="trueup-model-")
        self._gone = weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        options = [f"--preset={preset}"] if preset else []
        options += [f"--effect={effect}" for effect in effects]
        if flexible:
            options.append(f"--flexible={','.join(text(bool(f)) for f in flexible)}")
        options += [f"--structure={choice}={value}" for choice, value in (structure or {}).items()]
        if robot is not None:
            options.append(f"--robot={os.fspath(robot)}")
        options += [f"--set={p}={text(value)}" for p, value in (parameters or {}).items()]
        run("fmu", "pack", name, f"--fmi={fmi}", "-o", folder, *options)
        (file,) = _Path(folder).iterdir()
        super().__init__(file)

    @classmethod
    def of_result(cls, result: Mapping[str, Any], *, fmi: int = 3) -> Model:
        """The model of a result, with its effects and values: the JSON of an identification or of a diagnosis, as
        `trueup fmu pack --from` takes it."""
        pack = result.get("pack")
        if not pack:
            mend = "take the JSON of `trueup identify` with a model of this project, or a diagnosis that was not capped"
            raise Error(f"there is no model in this result; {mend}", mend=mend)
        return cls(
            pack["model"],
            effects=pack.get("effects", ()),
            flexible=pack.get("flexible", ()),
            structure=pack.get("structure"),
            parameters=pack["start"],
            fmi=fmi,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self._name, self._arguments)

    def fmu(self, file: Path) -> _Path:
        """Writes it as an FMU that any tool can run; the file's path."""
        return _Path(shutil.copyfile(self.file, file))

    def __repr__(self) -> str:
        given = (f"{key}={value!r}" for key, value in self._arguments.items() if value and key != "fmi")
        return f"Model({', '.join([repr(self._name), *given])})"


def _again(name: str, arguments: dict[str, Any]) -> Model:
    return Model(name, **arguments)
