"""What a store holds besides answers: its arrays and its coordinates, which follow from the plan.

The same plan gives the same files to the last bit. A store is made by writing them all, made longer
by writing those of the longer plan, and repaired by writing those that differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.storage import MemoryStore

from asperity.sweep.grid import SweepGrid
from asperity.sweep.plan.axis import TEXTS
from asperity.sweep.plan.ratios import RATIOS
from asperity.sweep.record import OF_CHUNKS, OF_POINTS
from asperity.sweep.solve import SOLVES
from asperity.sweep.solve.outcome import SweepOutcome, flag_attributes

#: What `status` holds for a chunk that is not done; otherwise its failed points.
NOT_DONE = -1

#: What the columns of texts are.
_TEXTS_ARE = {"law": "friction law", "data": "file of the readings"}

#: Coordinates that follow from ratios are stored where they have at most this many values.
_MOST_DERIVED = 1_000_000

#: A chunk of fill values would otherwise leave no file, like one that was never computed.
ALL_CHUNKS: Any = {"write_empty_chunks": True}


def skeleton(grid: SweepGrid) -> Iterator[tuple[str, bytes]]:
    """Files by their path in the store: the description of each array, then its values if any.

    One block of a coordinate is in memory at a time.
    """
    arrays = _Arrays()
    dims = [axis.name for axis in grid.axes]
    known = SOLVES[grid.record["solve"]].known_outputs(grid.record)
    for name in grid.record["outputs"]:
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
    """Arrays in memory, whose files are handed out and forgotten."""

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
            # The checksum last, over what is on the disk: without it a turned bit is read as a
            # number.
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
    """Columns of the axes; drawn ones are drawn block by block."""
    for axis, chunk in zip(grid.axes, grid.chunks, strict=True):
        # Few and large: labels are read at once when the store is opened.
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
        return {"units": "1", "long_name": _TEXTS_ARE[name]}
    return dict(grid.known[name].attributes)


def _numbers(arrays: _Arrays, grid: SweepGrid) -> None:
    """Numbers that are the same at every point, and the law if it is."""
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


def coordinates(metadata: Mapping[str, Any], grid: SweepGrid) -> list[str]:
    """Arrays that are neither answers nor labels of a dimension."""
    others = {*grid.record["outputs"], *OF_POINTS, *OF_CHUNKS, *(axis.name for axis in grid.axes)}
    return [name for name in metadata if name not in others]
