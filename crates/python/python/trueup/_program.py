"""The program `trueup` that the wheel carries."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from ._errors import Error


def program() -> Path:
    """Where the program is: by `TRUEUP_BIN`, else where this environment has its scripts, else on the path."""
    named = os.environ.get("TRUEUP_BIN")
    if named:
        return Path(named)
    name = "trueup.exe" if sys.platform == "win32" else "trueup"
    for folder in (sysconfig.get_path("scripts"), os.path.dirname(sys.executable)):
        file = Path(folder) / name
        if file.is_file():
            return file
    found = shutil.which(name)
    if found:
        return Path(found)
    raise Error(
        "the program `trueup` is not in this environment; install the wheel again, or name it in TRUEUP_BIN",
        mend="install the wheel again, or name it in TRUEUP_BIN",
    )


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Runs the program; its message on a failure becomes an `Error`."""
    done = subprocess.run([program(), *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        said = done.stderr.strip().removeprefix("error: ")
        first = said.partition("\n")[0]
        named = first.split("`")
        raise Error(
            said or f"the program ended with status {done.returncode}",
            variable=named[1] if len(named) > 2 else None,
            mend=first.rpartition("; ")[2] if "; " in first else None,
        )
    return done
