"""Status, dataset and summary statistics of a store, and its export, chunk by chunk."""

from __future__ import annotations

import contextlib
import math
import os
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from zarr.abc.buffer import Buffer, BufferPrototype
from zarr.abc.store import ByteRequest
from zarr.storage import LocalStore, WrapperStore

from asperity.errors import InputError, require
from asperity.outputs import output_file, require_disk, written_file
from asperity.parameters import OUTPUTS
from asperity.parameters.arguments import file_path, typed
from asperity.study.axes import TEXTS
from asperity.study.plan import OF_CHUNKS
from asperity.study.points import SweepOutcome, outcome_words
from asperity.study.store.lock import running_driver
from asperity.study.store.store import SweepStore

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True)
class SweepStatus:
    """Status of a sweep.

    Attributes
    ----------
    store : Path
    title : str
    points, done, failed : int
        All points, points in chunks that are done, and points among these without a converged
        answer.
    chunks, chunks_done, chunks_damaged : int
        All chunks, chunks that are done, and chunks whose files have changed since they were
        written. The next run solves the damaged chunks again.
    outcomes : dict of str to int
        Number of points of each outcome in the chunks that are done.
    running : str
        Process that works on the store; "" if none does.
    runs : list of dict
        Every run so far: time, machine, versions, number of points.
    bytes : int
        Size on the disk.
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


@typed
def open_store(store: str | os.PathLike[str]) -> xarray.Dataset:
    """The dataset of a finished or unfinished sweep, with labels and units; loaded on access.

    Every chunk that is done is compared with its checksum before, which takes as long as reading
    the store. Points of the other chunks are NaN, their outcome -1. `xarray.open_zarr` gives the
    same dataset of a finished sweep without this check.

    Parameters
    ----------
    store : path

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    opened = SweepStore(file_path(store, "store"), mode="r")
    for _ in opened.done():
        pass
    return dataset_of(opened)


class _DoneChunks(WrapperStore[LocalStore]):
    """The files of a store without the answers of chunks that are not done, which may be half."""

    def __init__(self, store: LocalStore, answers: Collection[str]) -> None:
        super().__init__(store)
        self._answers = answers

    def _with_store(self, store: LocalStore) -> _DoneChunks:
        return _DoneChunks(store, self._answers)

    async def get(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        array, _, place = key.partition("/")
        of_chunk = array in self._answers and place.startswith("c/")
        if of_chunk and not (self._store.root / "status" / place).exists():
            return None
        return await super().get(key, prototype, byte_range)


def dataset_of(store: SweepStore) -> xarray.Dataset:
    """The dataset of the chunks that are done; they are not compared with their checksums."""
    import xarray

    files = _DoneChunks(LocalStore(store.path, read_only=True), store.arrays)
    return xarray.open_zarr(files, consolidated=False, chunks=None)


@typed
def store_status(store: str | os.PathLike[str]) -> SweepStatus:
    """Status of a sweep, which may be running.

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    opened = SweepStore(file_path(store, "store").resolve(), mode="r")
    outcomes: Counter[int] = Counter()
    chunks = done = failed = damaged = 0
    for chunk, count, sound in opened.states():
        if not sound:
            damaged += 1
            continue
        chunks, done, failed = chunks + 1, done + opened.grid.size(chunk), failed + count
        codes, counts = np.unique(opened.read(chunk, ("outcome",))["outcome"], return_counts=True)
        outcomes.update(dict(zip(codes.tolist(), counts.tolist(), strict=True)))
    names = outcome_words()
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
        running=running_driver(opened.path),
        runs=opened.root.runs,
        bytes=_bytes_in(opened.path),
    )


def _bytes_in(path: Path) -> int:
    """Size of all files; a file that a worker removes at this moment counts as 0."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with contextlib.suppress(OSError):
                total += Path(folder, name).stat().st_size
    return total


@typed
def summary_statistics(store: str | os.PathLike[str]) -> dict[str, dict[str, float]]:
    """Count, mean, standard deviation, smallest and largest value of every output.

    Points without a converged answer are left out. The mean of an angle is that of its direction,
    the argument of the mean R of exp(i angle), and its deviation sqrt(-2 ln abs(R)): phases next to
    pi and to -pi are alike. The store is read a chunk at a time, so that memory does not grow with
    the store.

    Raises
    ------
    InputError
        If there is no store of a sweep, or it is damaged.
    """
    opened = SweepStore(file_path(store, "store").resolve(), mode="r")
    names = tuple(opened.record["outputs"])
    parts: dict[str, list[tuple[float, ...]]] = {name: [] for name in names}
    for chunk in opened.done():
        values = opened.read(chunk, (*names, "outcome"))
        solved = values["outcome"] == SweepOutcome.CONVERGED
        for name in names:
            x = values[name][solved & np.isfinite(values[name])]
            if x.size:
                moments = x.mean(), x.var(), np.exp(1j * x).mean()
                parts[name].append((x.size, *moments, x.min(), x.max()))
    angles = {name for name, output in OUTPUTS.items() if output.unit == "rad"}
    return {name: _pooled(part, name in angles) for name, part in parts.items()}


def _pooled(parts: list[tuple[Any, ...]], angle: bool) -> dict[str, float]:
    """Statistics of all values, pooled from those of the chunks; NaN without a value."""
    if not parts:
        return {"count": 0, **dict.fromkeys(("mean", "std", "min", "max"), math.nan)}
    count, mean, variance, turn, low, high = map(np.array, zip(*parts, strict=True))
    total = float(np.average(mean, weights=count))
    square = np.average(variance + (mean - total) ** 2, weights=count)
    if angle:
        direction = np.average(turn, weights=count)
        total, square = float(np.angle(direction)), -2 * np.log(min(abs(direction), 1.0))
    return {"count": int(count.sum()), "mean": total, "std": math.sqrt(square),
            "min": float(low.min()), "max": float(high.max())}  # fmt: skip


#: Columns of texts in an export.
_TEXTS = (*TEXTS, "outcome")


@typed
def export_store(store: str | os.PathLike[str], out: str | os.PathLike[str]) -> int:
    """Write a store to one file; the suffix of the file chooses the format.

    NetCDF keeps the grid; points that are not computed are NaN, their outcome -1. CSV and Parquet
    have a row for each point of the chunks that are done: the columns of the axes, the outputs,
    ``outcome`` as a word, and ``detail``.

    Parameters
    ----------
    store : path
    out : path
        ``.nc``, ``.csv`` or ``.parquet``.

    Returns
    -------
    int
        Number of points written.

    Raises
    ------
    InputError
        If there is no store, it is damaged, `out` cannot be written, or pyarrow is missing for
        Parquet.
    """
    opened = SweepStore(file_path(store, "store").resolve(), mode="r")
    target = output_file(out, example="results.nc")
    outside = opened.path not in target.parents
    require(outside, "out", "lie outside the store", f"'{out}'", "choose another folder")
    writers = {".nc": _netcdf, ".csv": _csv, ".parquet": _parquet}
    write = writers.get(target.suffix.lower())
    if write is None:
        rule = f"end in {', '.join(writers)}"
        raise InputError("out", rule, f"'{target.name}'", "write it like results.nc")
    require_disk(
        opened.grid.points * 8.0 * (len(opened.record["outputs"]) + 2),
        target.parent, "out", f"{opened.grid.points:,} points", "choose another disk",
    )  # fmt: skip
    with written_file(target) as file:
        return write(opened, file)


def _netcdf(store: SweepStore, file: Path) -> int:
    written = sum(store.grid.size(chunk) for chunk in store.done())
    dataset = dataset_of(store).drop_vars(OF_CHUNKS)
    texts = ("title", "source", "convention", "plan", "plan_text")
    dataset.attrs = {name: str(store.attributes.get(name, "")) for name in texts}
    # CF: flags have the type of their variable.
    flags = dataset["outcome"].attrs
    flags["flag_values"] = np.array(flags["flag_values"], dtype=dataset["outcome"].dtype)
    chunks = {name: {"chunksizes": store.grid.chunks} for name in store.arrays}
    # One variable at a time is in memory.
    dataset.to_netcdf(file, engine="h5netcdf", encoding=chunks)
    return written


def _frames(store: SweepStore) -> Iterator[pandas.DataFrame]:
    """For each chunk that is done a table of axes, outputs, outcome and detail; first an empty one.

    The empty table has the types of the columns.
    """
    import pandas

    axes = [name for axis in store.grid.axes for name in axis.names]
    kinds = {n: str if n in _TEXTS else float for n in (*axes, *store.arrays)}
    yield pandas.DataFrame({name: pandas.Series(dtype=kind) for name, kind in kinds.items()})
    meanings = outcome_words()
    for chunk in store.done():
        points = store.grid.at(chunk)
        known: dict[str, Any] = {**points.values, "law": points.laws, "data": points.data}
        columns: dict[str, Any] = {name: known[name] for name in axes}
        columns |= {name: values.ravel() for name, values in store.read(chunk).items()}
        columns["outcome"] = [meanings[int(code)] for code in columns["outcome"]]
        yield pandas.DataFrame(columns)


def _csv(store: SweepStore, file: Path) -> int:
    written = 0
    with file.open("w", encoding="utf-8", newline="") as stream:
        for i, frame in enumerate(_frames(store)):
            frame.to_csv(stream, header=not i, index=False, lineterminator="\n")
            written += len(frame)
    return written


def _parquet(store: SweepStore, file: Path) -> int:
    try:
        import pyarrow  # type: ignore[import-untyped]
        from pyarrow import parquet
    except ImportError:
        rule = "be a format that is installed"
        advice = "install it with pip install 'asperity[parquet]', or export to .csv or .nc"
        raise InputError("out", rule, "Parquet without pyarrow", advice) from None
    written = 0
    frames = _frames(store)
    schema = pyarrow.schema(
        (n, pyarrow.string() if n in _TEXTS else pyarrow.float64()) for n in next(frames).columns
    )
    with parquet.ParquetWriter(file, schema) as writer:
        for frame in frames:
            writer.write_table(pyarrow.Table.from_pandas(frame, schema, preserve_index=False))
            written += len(frame)
    return written
