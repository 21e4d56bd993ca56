"""The grid of a map, solved in blocks; an interrupted map keeps the finished ones."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity.outputs import Interrupted, UnfinishedText
from asperity.sweep.map.plane import NUMBERS, MapPlane, PointResponses

#: Points solved and written at a time.
BLOCK = 4800


def solve_grid(
    plane: MapPlane, progress: Callable[[int, int], None], block: int = BLOCK
) -> PointResponses:
    """Responses at the points of the grid, in memory.

    Parameters
    ----------
    plane : MapPlane
    progress : callable
        Called with the number of points done so far and of all points.
    block : int
        Points solved at a time.
    """
    points = PointResponses.empty(len(plane.nodes()))
    _fill(plane, points, 0, progress, block, lambda index, part: None)
    return points


def solve_grid_kept(
    plane: MapPlane,
    kept: UnfinishedText,
    resume: bool,
    progress: Callable[[int, int], None],
    block: int = BLOCK,
) -> PointResponses:
    """Responses at the points of the grid, with the finished blocks in a file for `resume`.

    Raises
    ------
    InputError
        If there are finished blocks and `resume` is False, or they belong to another map.
    Interrupted
        On Ctrl-C.
    """
    points = PointResponses.empty(len(plane.nodes()))
    kept.start(resume)
    done = kept.rows
    _read(kept, points)
    try:
        _fill(plane, points, done, progress, block, lambda _, part: _append(kept, part))
    except KeyboardInterrupt:
        raise interrupted(kept, len(points.converged)) from None
    finally:
        kept.discard_if_empty()
    return points


def interrupted(kept: UnfinishedText, total: int) -> Interrupted:
    """The exception to raise when the user interrupts."""
    return Interrupted(f"{kept.rows} of {total} points" if kept.rows else "")


def kept_beside(out: Path, plane: MapPlane) -> UnfinishedText:
    """The file of the finished blocks of the map `out`."""
    axes = {name: dataclasses.asdict(getattr(plane, name)) for name in ("x", "y")}
    return UnfinishedText(out, {"law": plane.law.name, "numbers": dict(plane.fixed), **axes})


def _fill(
    plane: MapPlane,
    points: PointResponses,
    done: int,
    progress: Callable[[int, int], None],
    block: int,
    keep: Callable[[NDArray[np.intp], PointResponses], None],
) -> None:
    nodes = plane.nodes()
    progress(done, len(nodes))

    def advance(count: int) -> None:
        nonlocal done
        done += count
        progress(done, len(nodes))

    for start in range(done, len(nodes), block):
        index = np.arange(start, min(start + block, len(nodes)))
        part = plane.solve(nodes[index], advance)
        points.put(index, part)
        keep(index, part)


def _append(kept: UnfinishedText, part: PointResponses) -> None:
    rows = zip(*part.numbers.tolist(), part.converged.astype(int).tolist(), part.result,
               strict=True)  # fmt: skip
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    kept.append(text.getvalue(), len(part.converged))


def _read(kept: UnfinishedText, points: PointResponses) -> None:
    """Read the finished blocks into `points`."""
    for i, row in enumerate(csv.reader(kept.text().splitlines())):
        points.numbers[:, i] = [float(cell) if cell else math.nan for cell in row[: len(NUMBERS)]]
        points.converged[i] = row[-2] == "1"
        points.result[i] = row[-1]
