"""The grid of a map, solved in blocks that an interruption does not cost."""

from __future__ import annotations

import csv
import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity._version import __version__
from asperity.study.map.plane import NUMBERS, Plane, Points
from asperity.study.table.partial import PartialOutput

#: Points solved and written at a time.
BLOCK = 4800


class MapInterrupted(KeyboardInterrupt):
    """The user stopped a map; the message says how to go on."""


def solve_grid(plane: Plane, progress: Callable[[int, int], None], block: int = BLOCK) -> Points:
    """Responses at the points of the grid, in memory.

    Parameters
    ----------
    plane : Plane
    progress : callable
        Told the number of points done so far and of all points.
    block : int
        Points solved at a time.
    """
    points = Points.empty(len(plane.nodes()))
    _fill(plane, points, 0, progress, block, lambda index, part: None)
    return points


def solve_grid_kept(
    plane: Plane,
    kept: PartialOutput,
    resume: bool,
    progress: Callable[[int, int], None],
    block: int = BLOCK,
) -> Points:
    """The same, with finished blocks in a file, from which an interrupted map goes on.

    Raises
    ------
    InputError
        If there are finished blocks that are not to be used, or that belong to another map.
    MapInterrupted
        On Ctrl-C.
    """
    points = Points.empty(len(plane.nodes()))
    kept.start(resume)
    done = kept.done.rows
    _read(kept, points)
    try:
        _fill(plane, points, done, progress, block, lambda _, part: _append(kept, part))
    except KeyboardInterrupt:
        raise interrupted(kept, len(points.converged)) from None
    finally:
        kept.drop_if_empty()
    return points


def interrupted(kept: PartialOutput, total: int) -> MapInterrupted:
    """What to raise when the user stops."""
    done = kept.done.rows
    return MapInterrupted(
        f"interrupted with {done} of {total} points finished; repeat the command with --resume to "
        "go on from there"
        if done
        else "interrupted before the first points were finished; nothing was written"
    )


def fingerprint(plane: Plane) -> str:
    """What finished blocks belong to."""
    axes = [vars(axis) for axis in (plane.x, plane.y)]
    said = [__version__, plane.law.name, sorted(plane.fixed.items()), axes]
    return hashlib.sha256(json.dumps(said).encode()).hexdigest()


def kept_beside(out: Path, plane: Plane) -> PartialOutput:
    """Finished blocks of the map that is to become `out`."""
    return PartialOutput(out, fingerprint(plane))


def _fill(
    plane: Plane,
    points: Points,
    done: int,
    progress: Callable[[int, int], None],
    block: int,
    keep: Callable[[NDArray[np.intp], Points], None],
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


def _append(kept: PartialOutput, part: Points) -> None:
    rows = zip(*part.numbers.tolist(), part.converged.astype(int).tolist(), part.result,
               strict=True)  # fmt: skip
    kept.append(rows, len(part.converged), int((~part.converged).sum()), ",")


def _read(kept: PartialOutput, points: Points) -> None:
    """The finished blocks; what lies behind them was never finished."""
    if not kept.done.rows:
        return
    with kept.path.open("rb") as stream:
        text = stream.read(kept.done.length).decode()
    for i, row in enumerate(csv.reader(text.splitlines())):
        points.numbers[:, i] = [float(cell) if cell else math.nan for cell in row[: len(NUMBERS)]]
        points.converged[i] = row[-2] == "1"
        points.result[i] = row[-1]
