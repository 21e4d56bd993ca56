"""Reading and writing the store of a sweep.

Every variable is a Zarr array with named dimensions and units. ``status``, with one number for each
chunk, alone says which chunks are done: it is written after the data and their folders have
reached the disk.
"""

from __future__ import annotations

import json
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from asperity.errors import InputError
from asperity.sweep.grid import SweepGrid
from asperity.sweep.plan.axis import TEXTS
from asperity.sweep.plan.ratios import RATIOS
from asperity.sweep.solve import SOLVES, Findings
from asperity.sweep.solve.outcome import SweepOutcome, flag_attributes
from asperity.sweep.store.durable import sync_file, sync_folder

#: What `status` holds for a chunk that is not done; otherwise its failed points.
NOT_DONE = -1

#: What the columns of texts are.
_TEXTS_ARE = {"law": "friction law", "data": "file of the readings"}

#: Attribute that says what kind of group this is.
KIND = "asperity_sweep"
_FORMAT = 1

#: Coordinates that follow from ratios are stored where they have at most this many values.
_MOST_DERIVED = 1_000_000

#: A chunk of fill values would otherwise leave no file, like one that was never computed.
_ALL_CHUNKS: Any = {"write_empty_chunks": True}

#: Reading a damaged chunk raises one of these, by the codec that finds out.
DAMAGED = (ValueError, RuntimeError, OSError, KeyError, TypeError)


class SweepStore:
    """A store that exists.

    Parameters
    ----------
    path : Path
    mode : {"r", "r+"}
        Whether it is only read.

    Raises
    ------
    InputError
        If there is no store of a sweep.
    """

    def __init__(self, path: Path, mode: Literal["r", "r+"] = "r+") -> None:
        self.path = path
        try:
            self.group = zarr.open_group(path, mode=mode, use_consolidated=False)
            attributes: dict[str, Any] = dict(self.group.attrs)
        except (FileNotFoundError, ValueError, KeyError, OSError, TypeError):
            attributes = {}
        if attributes.get(KIND) != _FORMAT:
            raise InputError(
                f"store must be the folder of a sweep, got '{path}', which is none; give what "
                "--out of asperity sweep named"
            )
        self.attributes = attributes
        self.record: dict[str, Any] = json.loads(attributes["plan"])
        self.grid = SweepGrid(self.record, attributes["chunk_shape"])
        names = [*self.record["outputs"], "outcome", "detail"]
        self.arrays: dict[str, Any] = {name: _writing_all(self.group[name]) for name in names}
        self.status: Any = _writing_all(self.group["status"])

    # Chunks

    def is_done(self, chunk: int) -> bool:
        """Whether the status of a chunk says that it is done; False if that is damaged."""
        try:
            return bool(self.status[self.grid.place(chunk)] != NOT_DONE)
        except DAMAGED:
            return False

    def failed_in(self, chunk: int) -> int:
        """Failed points of a chunk, -1 where it is not done."""
        try:
            return int(self.status[self.grid.place(chunk)])
        except DAMAGED:
            return NOT_DONE

    def is_sound(self, chunk: int) -> bool:
        """Whether all files of a chunk are there and have their checksums."""
        slices = self.grid.slices(chunk)
        for array in self.arrays.values():
            # Zarr reads a file that is missing as fill values.
            if not self._file(array, chunk).is_file():
                return False
            try:
                array[slices]
            except DAMAGED:
                return False
        return True

    def write(self, chunk: int, findings: Findings) -> None:
        """Write a chunk; when this returns it is on the disk and done.

        Raises
        ------
        OSError
            If the disk is full or cannot be written: the chunk is then not done.
        """
        self.reset(chunk)
        slices = self.grid.slices(chunk)
        shape = tuple(s.stop - s.start for s in slices)
        values: dict[str, Any] = {
            **findings.numbers,
            "outcome": findings.outcome,
            "detail": findings.detail,
        }
        files = []
        for name, array in self.arrays.items():
            array[slices] = values[name].reshape(shape)
            files.append(self._file(array, chunk))
        for file in files:
            sync_file(file)
        for folder in self._folders(files):
            sync_folder(folder)
        self.status[self.grid.place(chunk)] = findings.failed
        done = self._file(self.status, chunk)
        sync_file(done)
        for folder in self._folders([done]):
            sync_folder(folder)

    def reset(self, chunk: int) -> None:
        """Make a chunk not done."""
        file = self._file(self.status, chunk)
        if file.exists():
            file.unlink()
            sync_folder(file.parent)

    def read(self, chunk: int, names: tuple[str, ...] | None = None) -> dict[str, Any]:
        """The variables of a chunk as arrays of its shape."""
        slices = self.grid.slices(chunk)
        return {n: self.arrays[n][slices] for n in names or tuple(self.arrays)}

    def _file(self, array: Any, chunk: int) -> Path:
        key = array.metadata.encode_chunk_key(self.grid.place(chunk))
        return self.path / array.path / key

    def _folders(self, files: list[Path]) -> Iterator[Path]:
        """Folders of the files, up to their arrays, each once and inner ones first."""
        seen = set()
        for file in files:
            folder = file.parent
            while folder not in seen and folder != self.path:
                seen.add(folder)
                yield folder
                folder = folder.parent

    def sweep_orphans(self) -> int:
        """Remove files that killed writers have left half-written; returns how many."""
        count = 0
        for folder, _, names in os.walk(self.path):
            for name in names:
                if name.endswith(".partial"):
                    Path(folder, name).unlink(missing_ok=True)
                    count += 1
        return count

    # Counts

    def counts(self) -> tuple[int, int, int]:
        """Chunks that are done, their points, and the failed ones among these."""
        chunks = points = failed = 0
        for chunk in range(self.grid.chunk_count):
            count = self.failed_in(chunk)
            if count != NOT_DONE:
                chunks, points = chunks + 1, points + self.grid.size(chunk)
                failed += count
        return chunks, points, failed

    # Attributes

    def update_attributes(self, **changed: Any) -> None:
        """Replace attributes of the store; the file is on the disk when this returns."""
        self.group.attrs.update(changed)
        self.attributes.update(changed)
        _consolidate(self.path)


def create(path: Path, grid: SweepGrid, attributes: Mapping[str, Any]) -> SweepStore:
    """Make an empty store; it has its name when it is complete.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    fresh = path.with_name(path.name + ".new")
    shutil.rmtree(fresh, ignore_errors=True)
    try:
        _fill(fresh, grid, attributes)
        for folder, _, names in os.walk(fresh):
            for name in names:
                sync_file(Path(folder, name))
            sync_folder(Path(folder))
        fresh.rename(path)
        sync_folder(path.parent)
    except OSError as error:
        shutil.rmtree(fresh, ignore_errors=True)
        raise InputError(
            f"out must be a folder that can be written, got '{path}' "
            f"({(error.strerror or str(error)).lower()}); choose another place with room"
        ) from None
    return SweepStore(path)


def _fill(path: Path, grid: SweepGrid, attributes: Mapping[str, Any]) -> None:
    record = grid.record
    group = zarr.create_group(path, zarr_format=3)
    dims = [axis.name for axis in grid.axes]
    known = SOLVES[record["solve"]].known_outputs(record)
    for name in record["outputs"]:
        _array(group, name, grid.shape, grid.chunks, dims, "float64", known[name].attributes)
    _array(group, "outcome", grid.shape, grid.chunks, dims, "int16", flag_attributes(),
           fill=int(SweepOutcome.NOT_COMPUTED))  # fmt: skip
    about = {"units": "1", "long_name": "number in the sentence of the outcome"}
    _array(group, "detail", grid.shape, grid.chunks, dims, "float64", about)
    about = {"units": "1", "long_name": "failed points of the chunk; -1: not done"}
    ones = (1,) * len(dims)
    _array(group, "status", grid.chunk_shape, ones, [f"{d}_chunk" for d in dims], "int64", about,
           fill=NOT_DONE)  # fmt: skip
    named = write_coordinates(group, grid)
    group.attrs.update(
        {
            KIND: _FORMAT,
            "Conventions": "CF-1.11",
            **attributes,
            "plan": json.dumps(record),
            "plan_sha256": grid.digest,
            "chunk_shape": list(grid.chunks),
            "coordinates": " ".join(named),
        }
    )
    _consolidate(path)


def _array(
    group: Any,
    name: str,
    shape: tuple[int, ...],
    chunks: tuple[int, ...],
    dims: list[str],
    dtype: str,
    attributes: Mapping[str, Any],
    fill: Any = np.nan,
) -> Any:
    return group.create_array(
        name,
        shape=shape,
        chunks=chunks,
        dtype=dtype,
        fill_value="" if dtype == "string" else fill,
        dimension_names=dims,
        # The checksum last, over what is on the disk: without it a turned bit is read as a number.
        compressors=[ZstdCodec(level=1), Crc32cCodec()],
        attributes=dict(attributes),
        config=_ALL_CHUNKS,
        overwrite=True,
    )


def _writing_all(array: Any) -> Any:
    """The array with `_ALL_CHUNKS`, which is no part of its file."""
    return array.with_config(_ALL_CHUNKS)


def write_coordinates(group: Any, grid: SweepGrid) -> list[str]:
    """Write the columns of the axes and the fixed numbers; names of those that label no dimension.

    Drawn columns are written block by block.
    """
    named: list[str] = []
    for axis, chunk in zip(grid.axes, grid.chunks, strict=True):
        # Few and large: labels are read at once when the store is opened.
        length = min(axis.length, max(chunk, 65_536))
        for name in axis.names:
            dtype = "string" if name in TEXTS else "float64"
            about = (
                {"units": "1", "long_name": _TEXTS_ARE[name]}
                if name in TEXTS
                else grid.known[name].attributes
            )
            array = _array(group, name, (axis.length,), (length,), [axis.name], dtype, about)
            for start in range(0, axis.length, length):
                stop = min(start + length, axis.length)
                array[start:stop] = axis.rows(start, stop)[name]
            if name != axis.name:
                named.append(name)
    for name, value in grid.record["numbers"].items():
        about = dict(grid.known[name].attributes)
        if name in grid.record["origins"]:
            about["origin"] = grid.record["origins"][name]
        _array(group, name, (), (), [], "float64", about)[...] = value
        named.append(name)
    if "law" not in {name for axis in grid.axes for name in axis.names}:
        about = {"units": "1", "long_name": "friction law"}
        _array(group, "law", (), (), [], "string", about)[...] = grid.record["laws"][0]
        named.append("law")
    return [*named, *_write_derived(group, grid)]


def _write_derived(group: Any, grid: SweepGrid) -> Iterator[str]:
    """Parameters that follow from ratios, along the axes that they depend on."""
    varied = {name: i for i, axis in enumerate(grid.axes) for name in axis.names}
    along: dict[str, set[int]] = {n: {i} for n, i in varied.items()}
    present = {*varied, *grid.record["numbers"]}
    for name, ratio in RATIOS.items():
        if name not in present:
            continue
        axes = sorted(set().union(*(along.get(n, set()) for n in (name, *ratio.needs))))
        along[ratio.target] = set(axes)
        shape = tuple(grid.shape[i] for i in axes)
        if np.prod(shape, dtype=float) > _MOST_DERIVED:
            continue
        whole = tuple(slice(0, axis.length if i in axes else 1) for i, axis in enumerate(grid.axes))
        values = grid.between(whole).values[ratio.target].reshape(shape)
        about = grid.known[ratio.target].attributes
        dims = [grid.axes[i].name for i in axes]
        _array(group, ratio.target, shape, shape, dims, "float64", about)[...] = values
        yield ratio.target


def _consolidate(path: Path) -> None:
    """Gather the descriptions of all arrays in one file, which makes a store open at once."""
    with warnings.catch_warnings():
        # Readers that do not know this part of the file leave it out.
        warnings.filterwarnings("ignore", message="Consolidated metadata")
        zarr.consolidate_metadata(path)
    sync_file(path / "zarr.json")
    sync_folder(path)
