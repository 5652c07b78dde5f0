"""Many runs of a system, here or on Dask's workers."""

from __future__ import annotations

import importlib
import os
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import _native
from ._errors import Error
from ._system import Path

if TYPE_CHECKING:
    import pandas as pd

#: Seconds that a batch of runs shall take: long against what handing it over takes, short against a wait for the last one.
BATCH = 1.0

#: One thread runs a sweep at a time, so each has its own.
_local = threading.local()


def opened(file: str, fingerprint: str | None) -> _native.Sweep:
    """The sweep, read once in each thread as long as it is the same."""
    known: dict[str, _native.Sweep] = vars(_local).setdefault("sweeps", {})
    found = known.get(file)
    if found is None or (fingerprint is not None and found.fingerprint != fingerprint):
        found = known[file] = _native.Sweep(file)
    if fingerprint is not None and found.fingerprint != fingerprint:
        mend = "give all workers the same files"
        raise Error(f"{file}: it is not the same sweep here as where it was begun; {mend}", file=file, mend=mend)
    return found


def batch(file: str, fingerprint: str | None, first: int, count: int) -> pd.DataFrame:
    """Runs `first` (from 1) and the following: a row for each, with number, factors, outputs and `reason` of a failure."""
    import pandas as pd

    one = opened(file, fingerprint)
    values, reasons = one.run(first, count)
    frame: dict[str, Any] = {"run": range(first, first + count)}
    frame.update(zip(one.factors, one.values(first, count)))
    frame.update((name, values[:, i]) for i, name in enumerate(one.outputs))
    return pd.DataFrame({**frame, "reason": pd.Series(reasons, dtype="object")})


def sweep(
    file: Path,
    client: Any = None,
    *,
    runs: int | None = None,
    batch_runs: int | None = None,
    progress: Callable[[float, str], object] | None = None,
) -> pd.DataFrame:
    """Does the runs of a sweep: a frame with a row for each.

    Parameters:
        file: the sweep's file; workers must see it, and what it names, under the same path.
        client: a `dask.distributed.Client`; without one, the runs are done here.
        runs: only the first so many.
        batch_runs: so many runs at once; else as many as take about a second.
        progress: told how far it is.
    """
    import pandas as pd

    path = os.path.abspath(file)
    whole = _native.Sweep(path)
    last = whole.runs if runs is None else min(runs, whole.runs)
    # How long a run takes is found out, and what was done for that is kept.
    done: list[pd.DataFrame] = []
    at, count = 1, 1
    begun = time.perf_counter()
    while batch_runs is None and at <= last:
        count = min(count, last - at + 1)
        began = time.perf_counter()
        done.append(batch(path, whole.fingerprint, at, count))
        spent = time.perf_counter() - began
        at += count
        if spent >= 0.1 * BATCH:
            batch_runs = max(1, round(count * BATCH / spent))
        count *= 4
    size = batch_runs or 1
    shares = [(first, min(size, last - first + 1)) for first in range(at, last + 1, size)]

    def tell(n: int) -> None:
        if progress is not None:
            progress(n / max(last, 1), f"{n} of {last} runs, {time.perf_counter() - begun:.0f} s")

    if client is None:
        for first, count in shares:
            done.append(batch(path, whole.fingerprint, first, count))
            tell(first + count - 1)
    elif shares:
        distributed: Any = importlib.import_module("distributed")
        futures = [client.submit(batch, path, whole.fingerprint, *share, pure=False) for share in shares]
        try:
            for n, _ in enumerate(distributed.as_completed(futures), 1):
                tell(at - 1 + min(n * size, last - at + 1))
            done.extend(client.gather(futures))
        except BaseException:
            client.cancel(futures)
            raise
    return pd.concat(done, ignore_index=True) if done else batch(path, whole.fingerprint, 1, 0)
