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


def timed(file: str, fingerprint: str | None, first: int, count: int) -> tuple[pd.DataFrame, float]:
    """A batch, and how long it took in s."""
    begun = time.perf_counter()
    return batch(file, fingerprint, first, count), time.perf_counter() - begun


class _Shares:
    """Cuts runs into batches that take about a second, and smaller ones towards the end, so that all workers end together."""

    def __init__(self, runs: int, workers: int, size: int | None) -> None:
        self.runs, self.workers, self.fixed = runs, workers, size
        self.next, self.size = 1, float(size or 1)

    def learn(self, count: int, spent: float) -> None:
        """A batch of so many took so long."""
        if self.fixed is None:
            self.size = min(count * BATCH / max(spent, 1e-6), 4.0 * max(self.size, count))

    def take(self) -> tuple[int, int] | None:
        """The next batch: its first run and its number of runs."""
        left = self.runs - self.next + 1
        if left <= 0:
            return None
        count = self.size
        if self.fixed is None:
            count = min(count, max(left / (2 * self.workers), count / 8))
        first, count = self.next, min(left, max(1, round(count)))
        self.next += int(count)
        return first, int(count)


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
        progress: receives the share done.
    """
    import pandas as pd

    path = os.path.abspath(file)
    whole = _native.Sweep(path)
    last = whole.runs if runs is None else min(runs, whole.runs)
    threads = sum(client.nthreads().values()) if client is not None else 1
    shares = _Shares(last, max(threads, 1), batch_runs)
    done: dict[int, pd.DataFrame] = {}
    begun, finished = time.perf_counter(), 0

    def took(first: int, found: tuple[pd.DataFrame, float]) -> None:
        nonlocal finished
        done[first], spent = found
        count = len(done[first])
        finished += count
        shares.learn(count, spent)
        if progress is not None:
            progress(finished / max(last, 1), f"{finished} of {last} runs, {time.perf_counter() - begun:.0f} s")

    if client is None:
        while (share := shares.take()) is not None:
            took(share[0], timed(path, whole.fingerprint, *share))
    else:
        _on_workers(client, path, whole.fingerprint, shares, took)
    frames = [done[first] for first in sorted(done)]
    return pd.concat(frames, ignore_index=True) if frames else batch(path, whole.fingerprint, 1, 0)


def _on_workers(client: Any, path: str, fingerprint: str, shares: _Shares, took: Callable[..., None]) -> None:
    """Two batches for each worker's thread at a time: one that runs, one that waits."""
    distributed: Any = importlib.import_module("distributed")
    first_of: dict[Any, int] = {}
    waiting = distributed.as_completed(with_results=True)

    def hand_out() -> None:
        share = shares.take()
        if share is not None:
            future = client.submit(timed, path, fingerprint, *share, pure=False)
            first_of[future] = share[0]
            waiting.add(future)

    try:
        for _ in range(2 * shares.workers):
            hand_out()
        for future, found in waiting:
            took(first_of.pop(future), found)
            hand_out()
    except BaseException:
        client.cancel(list(first_of))
        raise
