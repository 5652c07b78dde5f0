"""What goes wrong, as an exception."""

from __future__ import annotations

from typing import Any


class Error(ValueError):
    """Work that could not be done. The message is for people; the attributes are for programs, each `None` if not known."""

    #: Name of the variable, parameter or column that it is about.
    variable: str | None
    #: The file that is wrong.
    file: str | None
    #: What to do.
    mend: str | None

    def __init__(
        self, message: str, variable: str | None = None, file: str | None = None, mend: str | None = None
    ) -> None:
        super().__init__(message)
        self.variable, self.file, self.mend = variable, file, mend

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.variable, self.file, self.mend)
