"""What a store holds: how far it is, the dataset, and statistics of its points, chunk by chunk."""

from __future__ import annotations

import contextlib
import json
import math
import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.parameters.arguments import file_path
from asperity.study.outcome import SweepOutcome, words
from asperity.study.store.layout import NOT_DONE
from asperity.study.store.lock import holder_of, is_held, lock_file
from asperity.study.store.store import SweepStore

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class SweepStatus:
    """How far a sweep is.

    Attributes
    ----------
    store : Path
    title : str
    points, done, failed : int
        All points, those in chunks that are done, and those of these without a converged answer.
    chunks, chunks_done, chunks_damaged : int
        All, those that are done, and those that were and whose files are no longer what was
        written: the next run solves them again.
    outcomes : dict of str to int
        Points of each outcome, of chunks that are done.
    running : str
        Who is at work on it; "" for nobody.
    runs : list of dict
        Every run so far: when, where, with which versions, how many points.
    bytes : int
        On the disk.
    """

    store: Path
    title: str
    points: int
    done: int
    failed: int
    chunks: int
    chunks_done: int
    chunks_damaged: int
    outcomes: dict[str, int]
    running: str
    runs: list[dict[str, Any]]
    bytes: int


def open_store(store: str | os.PathLike[str]) -> xarray.Dataset:
    """The dataset of a sweep, finished or not: labelled, with units, and lazy.

    `xarray.open_zarr` opens the same.

    Parameters
    ----------
    store : path

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    import xarray

    whole = SweepStore(file_path(store, "store"), mode="r")
    return xarray.open_zarr(whole.path, consolidated=False, chunks=None)


def store_status(store: str | os.PathLike[str]) -> SweepStatus:
    """How far a sweep is, while it runs too.

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    opened = SweepStore(file_path(store, "store").resolve(), mode="r")
    outcomes: Counter[int] = Counter()
    chunks = done = failed = damaged = 0
    for chunk in range(opened.grid.chunk_count):
        count = opened.failed_in(chunk)
        if count == NOT_DONE:
            continue
        if opened.is_damaged(chunk):
            damaged += 1
            continue
        chunks, done, failed = chunks + 1, done + opened.grid.size(chunk), failed + count
        codes, counts = np.unique(opened.read(chunk, ("outcome",))["outcome"], return_counts=True)
        outcomes.update(dict(zip(codes.tolist(), counts.tolist(), strict=True)))
    names = words()
    lock = lock_file(opened.path)
    holder = holder_of(lock)
    running = ""
    if holder and is_held(lock):
        running = f"process {holder['process']} on {holder['host']} since {holder['since']}"
    return SweepStatus(
        store=opened.path,
        title=str(opened.attributes.get("title", "")),
        points=opened.grid.points,
        done=done,
        failed=failed,
        chunks=opened.grid.chunk_count,
        chunks_done=chunks,
        chunks_damaged=damaged,
        outcomes={names.get(code, str(code)): n for code, n in sorted(outcomes.items())},
        running=running,
        runs=opened.root.runs,
        bytes=_bytes_in(opened.path),
    )


def _bytes_in(path: Path) -> int:
    """Bytes of all files; one that a worker removes meanwhile has none."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with contextlib.suppress(OSError):
                total += Path(folder, name).stat().st_size
    return total


@dataclass
class _Moments:
    """Sums that two parts of a population can be joined from (Chan, Golub and LeVeque, 1979)."""

    count: int = 0
    mean: float = 0.0
    square: float = 0.0
    low: float = math.inf
    high: float = -math.inf

    def add(self, values: np.ndarray) -> None:
        """Join the finite ones of some values."""
        values = values[np.isfinite(values)]
        if not values.size:
            return
        count, mean = values.size, float(values.mean())
        square = float(((values - mean) ** 2).sum())
        total, apart = self.count + count, mean - self.mean
        self.square += square + apart**2 * self.count * count / total
        self.mean += apart * count / total
        self.count = total
        self.low = min(self.low, float(values.min()))
        self.high = max(self.high, float(values.max()))

    def record(self) -> dict[str, float]:
        """The statistics by name; NaN where there is no value."""
        none = not self.count
        return {
            "count": self.count,
            "mean": math.nan if none else self.mean,
            "std": math.nan if none else math.sqrt(self.square / self.count),
            "min": math.nan if none else self.low,
            "max": math.nan if none else self.high,
        }


def summary_statistics(store: str | os.PathLike[str]) -> dict[str, dict[str, float]]:
    """Count, mean, standard deviation, smallest and largest value of every output.

    Over the points that have one, a chunk at a time: memory does not grow with the store.

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    opened = SweepStore(file_path(store, "store").resolve(), mode="r")
    names = tuple(opened.record["outputs"])
    moments = {name: _Moments() for name in names}
    for chunk, _ in opened.done():
        values = opened.read(chunk, (*names, "outcome"))
        solved = values["outcome"] == SweepOutcome.CONVERGED
        for name in names:
            moments[name].add(values[name][solved])
    return {name: m.record() for name, m in moments.items()}


def status_record(status: SweepStatus) -> dict[str, Any]:
    """The status as JSON values."""
    return json.loads(json.dumps({**vars(status), "store": str(status.store)}))
