"""Boundary lines through the crossings, with further points where a chord deviates too much."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.sweep.map.crossing import Crossings, find_crossings
from asperity.sweep.map.plane import MapPlane, PointResponses

Float = NDArray[np.float64]
Int = NDArray[np.intp]

#: Largest distance of the boundary from the chord between two of its points, in fractions of the
#: axes.
CHORD = 5e-5
_MOST_ROUNDS = 7
#: Half width of the search perpendicular to a chord, over its length: a boundary that bends more
#: within a cell is not refined further.
_REACH = 0.5


def refined_lines(
    plane: MapPlane, edges: Crossings, links: Sequence[Int]
) -> tuple[Float, PointResponses, list[Int], int]:
    """Halve chords until none is further from the boundary than `CHORD`, and join them to lines.

    Parameters
    ----------
    plane : MapPlane
    edges : Crossings
    links : sequence of (int, int)
        Neighbours among the crossings.

    Returns
    -------
    where : array, shape (points, 2)
        The crossings, and the points added.
    points : PointResponses
    lines : list of int arrays
        Indices of the points of each line, in order; of a closed one the first is repeated.
    unresolved : int
        Chords whose distance from the boundary is unknown.
    """
    where, points = edges.where, edges.points
    chords = np.array(links, dtype=int).reshape(-1, 2)
    done: list[Int] = []
    unresolved = 0
    for rounds_left in range(_MOST_ROUNDS, -1, -1):
        bent, unmet, between = _bent(plane, where, chords)
        unresolved += int(unmet.sum())
        if not rounds_left:
            unresolved += int(bent.sum())
            bent[:] = False
        done.append(chords[~bent])
        if not bent.any():
            break
        new = len(where) + np.arange(bent.sum())
        where = np.concatenate([where, between.where])
        points = _joined(points, between.points)
        first, last = chords[bent].T
        chords = np.concatenate([np.stack([first, new], -1), np.stack([new, last], -1)])
    return where, points, join(np.concatenate(done)), unresolved


def join(links: Int) -> list[Int]:
    """Lines from pairs of neighbours: open ones from end to end, then closed ones.

    Parameters
    ----------
    links : int array, shape (pairs, 2)
        No index occurs more than twice.
    """
    beside: dict[int, list[int]] = {}
    for a, b in links.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    left = dict.fromkeys(sorted(beside))
    ends = [k for k in left if len(beside[k]) == 1]
    lines = []
    for begin in [*ends, *left]:
        if begin not in left:
            continue
        line = [begin]
        del left[begin]
        while following := [k for k in beside[line[-1]] if k in left]:
            line.append(following[0])
            del left[following[0]]
        if len(line) > 2 and begin in beside[line[-1]] and len(beside[begin]) == 2:
            line.append(begin)
        lines.append(np.array(line))
    return lines


def _bent(
    plane: MapPlane, where: Float, chords: Int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Crossings]:
    """Chords further than `CHORD` from the boundary, chords of unknown distance, and crossings.

    The distance is that of the crossing on the perpendicular through the middle of the chord,
    which is returned for the former; a chord shorter than `CHORD` needs none.
    """
    a, b = where[chords[:, 0]], where[chords[:, 1]]
    middle, chord = (a + b) / 2, b - a
    normal = _REACH * np.stack([-chord[:, 1], chord[:, 0]], axis=-1)
    start, end = (np.clip(middle + side * normal, 0.0, 1.0) for side in (-1, 1))
    solved = plane.solve(np.concatenate([start, middle, end]))
    g0, g, g1 = solved["log_multiplier"].reshape(3, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = g0 * g1 < 0
        gap = np.abs(g / (g1 - g0)) * np.linalg.norm(end - start, axis=1)
    index = np.flatnonzero(crossed & (gap > CHORD))
    between = find_crossings(plane, start[index], end[index], g0[index], g1[index])
    met = between.found
    bent, unmet = np.zeros(len(chords), dtype=bool), ~crossed
    bent[index[met]] = True
    unmet[index[~met]] = True
    unmet &= np.linalg.norm(chord, axis=1) > CHORD
    kept = Crossings(between.where[met], between.points.take(met), met[met], between.reason[met])
    return bent, unmet, kept


def _joined(points: PointResponses, others: PointResponses) -> PointResponses:
    return PointResponses(
        np.concatenate([points.numbers, others.numbers], axis=1),
        np.concatenate([points.converged, others.converged]),
        np.concatenate([points.result, others.result]),
    )
