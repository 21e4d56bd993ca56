"""Adding rows to the end of axes of a store."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.sweep.grid import SweepGrid
from asperity.sweep.store.root import Root, write_root
from asperity.sweep.store.store import lay_out, reset


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


def extend(path: Path, root: Root, grid: SweepGrid, attributes: Mapping[str, Any]) -> list[str]:
    """Give a store more points; can be repeated after an interruption at any moment.

    Chunks that get new points are no longer done; all others keep theirs.

    Parameters
    ----------
    path : Path
    root : Root
        Of the store as it is.
    grid : SweepGrid
        Of a plan for which `is_extension` holds.
    attributes : mapping
        Of the longer store, besides those that follow from its grid.

    Returns
    -------
    list of str
        As of `lay_out`.
    """
    pending = {"record": grid.record, "attributes": dict(attributes)}
    write_root(path, {**root.attributes, "extending": pending}, root.arrays)
    for chunk in _touched(root.grid, grid):
        reset(path, root.grid, chunk)
    return lay_out(path, grid, {"runs": root.runs, **attributes})


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
