"""Layout of a store: its arrays, coordinates and attributes, which follow from the plan.

The same plan gives the same files to the last bit. `lay_out` writes the files that are missing or
differ; thus it creates a store, extends it to a longer plan, and repairs it.
"""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.storage import MemoryStore

from asperity.study.axes import TEXTS
from asperity.study.grid import SweepGrid
from asperity.study.plan import OF_CHUNKS, OF_POINTS
from asperity.study.points import RATIOS, SweepOutcome, flag_attributes
from asperity.study.solve import SOLVES
from asperity.study.store.root import FORMAT, KIND, Root, put, sync_folder, write_root

#: `status` of a chunk that is not done; `status` of a chunk that is done is its failed points.
NOT_DONE = -1

#: Long names of the columns of texts.
_TEXT_NAMES = {"law": "friction law", "data": "file of the readings"}

#: Largest number of values of a stored coordinate that follows from a ratio: readers load all
#: coordinates, and this one is made in memory (8 MB).
_MOST_DERIVED = 1_000_000

#: Zarr leaves out files of fill values by default; such a chunk would look as if not computed.
ALL_CHUNKS: Any = {"write_empty_chunks": True}


def create(path: Path, grid: SweepGrid, attributes: Mapping[str, Any]) -> None:
    """Make an empty store; it is renamed to `path` when it is complete.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    fresh = fresh_folder(path)
    shutil.rmtree(fresh, ignore_errors=True)
    try:
        fresh.mkdir()
        lay_out(fresh, grid, attributes)
        fresh.rename(path)
        sync_folder(path.parent)
    except OSError:
        shutil.rmtree(fresh, ignore_errors=True)
        raise


def lay_out(path: Path, grid: SweepGrid, attributes: Mapping[str, Any]) -> list[str]:
    """Write the arrays, coordinates and attributes of a plan; answers in the store stay.

    Parameters
    ----------
    path : Path
        A folder, empty or with a store.
    grid : SweepGrid
    attributes : mapping
        Attributes that do not follow from the grid.

    Returns
    -------
    list of str
        Files that were written because they were missing or differed.
    """
    written: list[str] = []
    arrays: dict[str, Any] = {}
    checksums: dict[str, Any] = {}
    for name, content in _skeleton(grid):
        file, array = path / name, name.split("/")[0]
        if file.name == "zarr.json":
            arrays[array] = json.loads(content)
        else:
            checksums.setdefault(array, checksum()).update(content)
        if not _holds(file, content):
            put(file, content)
            written.append(name)
    for folder in {(path / name).parents[1] for name in written}:
        sync_folder(folder)
    write_root(
        path,
        {
            **attributes,
            KIND: FORMAT,
            "Conventions": "CF-1.11",
            "plan": json.dumps(grid.record),
            "plan_sha256": grid.digest,
            "chunk_shape": list(grid.chunks),
            "coordinates": " ".join(_coordinates(arrays, grid)),
            "coordinate_checksums": {name: c.hexdigest() for name, c in checksums.items()},
        },
        arrays,
    )
    return written


def _holds(file: Path, content: bytes) -> bool:
    try:
        return file.read_bytes() == content
    except OSError:
        return False


def extend(path: Path, root: Root, grid: SweepGrid, attributes: Mapping[str, Any]) -> None:
    """Append points to a store; chunks that get new points become "not done".

    After an interruption the shorter plan and the longer one can both be continued: the root, which
    is written last, tells which plan the store has.

    Parameters
    ----------
    path : Path
    root : Root
        Root of the store before the extension.
    grid : SweepGrid
        Grid of a plan for which `is_extension` holds.
    attributes : mapping
        Attributes of the longer store that do not follow from its grid.
    """
    for chunk in _chunks_with_new_points(root.grid, grid):
        reset(path, root.grid, chunk)
    lay_out(path, grid, {"runs": root.runs, **attributes})


def _chunks_with_new_points(old: SweepGrid, new: SweepGrid) -> list[int]:
    """Incomplete chunks at the end of an axis that get new points."""
    shape = old.chunk_shape
    touched = np.zeros(shape, dtype=bool) if math.prod(shape) else np.zeros(0, dtype=bool)
    for axis, (before, after, length) in enumerate(
        zip(old.shape, new.shape, old.chunks, strict=True)
    ):
        if after > before and before % length:
            index: list[Any] = [slice(None)] * len(shape)
            index[axis] = -1
            touched[tuple(index)] = True
    return [int(i) for i in np.flatnonzero(touched)]


def fresh_folder(store: Path) -> Path:
    """Folder of a store until it is complete."""
    return store.with_name(store.name + ".new")


def chunk_file(path: Path, name: str, place: tuple[int, ...]) -> Path:
    """File of a chunk of an array, by its position among the chunks."""
    return path.joinpath(name, "c", *map(str, place))


def reset(path: Path, grid: SweepGrid, chunk: int) -> None:
    """Set a chunk of a store to "not done", and its points to "not computed"."""
    for name in ("status", "outcome"):
        file = chunk_file(path, name, grid.place(chunk))
        if file.is_file():
            file.unlink()
            sync_folder(file.parent)


def checksum(content: bytes = b"") -> Any:
    """A checksum of bytes, which can be updated with further bytes."""
    return hashlib.blake2b(content, digest_size=8)


def _skeleton(grid: SweepGrid) -> Iterator[tuple[str, bytes]]:
    """Files of a store, path and content: metadata of each array, and values of coordinates.

    A coordinate is made block by block, to save memory.
    """
    arrays = _Arrays()
    dims = [axis.name for axis in grid.axes]
    record = grid.record
    known = SOLVES[record["solve"]].known_outputs(record["laws"], record.get("settings", {}))
    for name in record["outputs"]:
        arrays.add(name, grid.shape, grid.chunks, dims, "float64", known[name].attributes)
    arrays.add("outcome", grid.shape, grid.chunks, dims, "int16", flag_attributes(),
               fill=int(SweepOutcome.NOT_COMPUTED))  # fmt: skip
    about = {"units": "1", "long_name": "number in the sentence of the outcome"}
    arrays.add("detail", grid.shape, grid.chunks, dims, "float64", about)
    ones, dims = (1,) * len(dims), [f"{d}_chunk" for d in dims]
    about = {"units": "1", "long_name": "checksum of the files of the chunk"}
    arrays.add("checksum", grid.chunk_shape, ones, dims, "int64", about, fill=0)
    about = {"units": "1", "long_name": "failed points of the chunk; -1: not done"}
    arrays.add("status", grid.chunk_shape, ones, dims, "int64", about, fill=NOT_DONE)
    yield from arrays.files()
    yield from _axes(arrays, grid)
    _numbers(arrays, grid)
    _derived(arrays, grid)
    yield from arrays.files()


class _Arrays:
    """Zarr arrays in memory; `files` yields their files and removes them from memory."""

    def __init__(self) -> None:
        self._kept: dict[str, Any] = {}
        self._group = zarr.create_group(MemoryStore(self._kept), zarr_format=3)

    def add(
        self,
        name: str,
        shape: tuple[int, ...],
        chunks: tuple[int, ...],
        dims: list[str],
        dtype: str,
        attributes: Mapping[str, Any],
        fill: Any = np.nan,
    ) -> Any:
        """An array without values."""
        return self._group.create_array(
            name,
            shape=shape,
            chunks=chunks,
            dtype=dtype,
            fill_value="" if dtype == "string" else fill,
            dimension_names=dims,
            # The checksum covers the compressed bytes: without it a flipped bit on the disk would
            # change a number unnoticed.
            compressors=[ZstdCodec(level=1), Crc32cCodec()],
            attributes=dict(attributes),
            config=ALL_CHUNKS,
        )

    def files(self) -> Iterator[tuple[str, bytes]]:
        """Files since the last call."""
        made = {path: v.to_bytes() for path, v in self._kept.items() if path != "zarr.json"}
        self._kept.clear()
        yield from made.items()


def _axes(arrays: _Arrays, grid: SweepGrid) -> Iterator[tuple[str, bytes]]:
    """Columns of the axes; drawn columns are drawn block by block."""
    for axis, chunk in zip(grid.axes, grid.chunks, strict=True):
        # Large blocks, because opening a store reads all labels.
        length = min(axis.length, max(chunk, 65_536))
        made = {
            name: arrays.add(
                name, (axis.length,), (length,), [axis.name],
                "string" if name in TEXTS else "float64", _about(name, grid),
            )
            for name in axis.names
        }  # fmt: skip
        for start in range(0, axis.length, length):
            stop = min(start + length, axis.length)
            for name, values in axis.rows(start, stop).items():
                made[name][start:stop] = values
            yield from arrays.files()


def _about(name: str, grid: SweepGrid) -> dict[str, Any]:
    if name in TEXTS:
        return {"units": "1", "long_name": _TEXT_NAMES[name]}
    return dict(grid.known[name].attributes)


def _numbers(arrays: _Arrays, grid: SweepGrid) -> None:
    """Numbers that are the same at every point, and the law if no axis varies it."""
    for name, value in grid.record["numbers"].items():
        about = _about(name, grid)
        if name in grid.record["origins"]:
            about["origin"] = grid.record["origins"][name]
        arrays.add(name, (), (), [], "float64", about)[...] = value
    if "law" not in {name for axis in grid.axes for name in axis.names}:
        arrays.add("law", (), (), [], "string", _about("law", grid))[...] = grid.record["laws"][0]


def _derived(arrays: _Arrays, grid: SweepGrid) -> None:
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
        dims = [grid.axes[i].name for i in axes]
        array = arrays.add(ratio.target, shape, shape, dims, "float64", _about(ratio.target, grid))
        array[...] = values


def _coordinates(metadata: Mapping[str, Any], grid: SweepGrid) -> list[str]:
    """Names of the auxiliary coordinates, which are neither answers nor labels of a dimension."""
    others = {*grid.record["outputs"], *OF_POINTS, *OF_CHUNKS, *(axis.name for axis in grid.axes)}
    return [name for name in metadata if name not in others]
