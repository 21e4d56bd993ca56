"""Adding rows to the end of axes of a store."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import zarr

from asperity.sweep.grid import SweepGrid
from asperity.sweep.store.store import SweepStore, write_coordinates


def is_extension(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Whether `new` has all points of `old`, and others only behind them along axes."""
    rest = [key for key in {*old, *new} if key not in ("axes", "laws")]
    if any(old.get(key) != new.get(key) for key in rest):
        return False
    if list(old["axes"]) != list(new["axes"]) or new["laws"][: len(old["laws"])] != old["laws"]:
        return False
    return all(_longer(old["axes"][name], new["axes"][name]) for name in old["axes"])


def _longer(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    if "columns" in old and "columns" in new:
        before, after = old["columns"], new["columns"]
        return list(before) == list(after) and all(
            after[name][: len(before[name])] == before[name] for name in before
        )
    if "over" in old and "over" in new:
        same = all(old[key] == new[key] for key in ("draw", "seed", "over"))
        return same and new["count"] >= old["count"]
    return False


def extend(store: SweepStore, record: Mapping[str, Any]) -> SweepStore:
    """The store with more points; can be repeated after an interruption at any moment.

    Chunks that get new points are no longer done; all others keep theirs.

    Parameters
    ----------
    store : SweepStore
    record : mapping
        Of a plan for which `is_extension` holds.
    """
    store.update_attributes(extending=json.dumps(record))
    grid = SweepGrid(record, store.grid.chunks)
    for chunk in _touched(store.grid, grid):
        store.reset(chunk)
    for array in store.arrays.values():
        array.resize(grid.shape)
    store.status.resize(grid.chunk_shape)
    group = zarr.open_group(store.path, mode="r+", use_consolidated=False)
    named = write_coordinates(group, grid)
    group.attrs.update(
        {
            "plan": json.dumps(record),
            "plan_sha256": grid.digest,
            "coordinates": " ".join(named),
            "extending": "",
        }
    )
    fresh = SweepStore(store.path)
    fresh.update_attributes()
    return fresh


def _touched(old: SweepGrid, new: SweepGrid) -> list[int]:
    """Chunks at the end of an axis that were not full and get new points."""
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
