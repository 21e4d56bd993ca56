"""A store as one file: NetCDF, CSV or Parquet, written chunk by chunk."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError
from asperity.outputs import output_file, require_disk, written_file
from asperity.parameters.arguments import file_path
from asperity.study.axes import TEXTS
from asperity.study.outcome import words
from asperity.study.plan import OF_CHUNKS
from asperity.study.results import dataset_of
from asperity.study.store.store import SweepStore

if TYPE_CHECKING:
    import pandas

#: Columns of texts.
_TEXTS = (*TEXTS, "outcome")
_FORMATS = (".nc", ".csv", ".parquet")


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
    write = {".nc": _netcdf, ".csv": _csv, ".parquet": _parquet}.get(target.suffix.lower())
    if write is None:
        rule = f"end in {', '.join(_FORMATS)}"
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
    meanings = words()
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
