"""The stability boundary on a grid: the crossings with the edges, joined to lines.

All crossings are searched together. The grid detects every piece of the boundary, open or closed,
that separates two of its points. Continuation (`asperity.branches`) also gives bifurcation curves
that bound no stable region, but it is sequential, needs a start on each curve, and ends where the
kind of bifurcation changes. Measured for rice-ruina over K and 0.5 to 100 Hz: 154 s for three
curves by continuation, 43 s for the one line of the map with a grid of 40 x 40 points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.study.map.plane import OUTPUTS, MapPlane
from asperity.study.outcome import Answers
from asperity.study.points import Float, Index
from asperity.study.responses import is_stable
from asperity.study.threshold import Crossings, find_crossings

#: Largest distance of the boundary from the chord between two neighbouring points, in fractions of
#: the axes.
CHORD = 5e-5
_MOST_ROUNDS = 7
#: Half width of the search perpendicular to a chord, in units of its length. A boundary that leaves
#: this strip is not refined further.
_REACH = 0.5


@dataclass
class MapBoundary:
    """The stability boundary.

    Attributes
    ----------
    where : array, shape (points, 2)
        Fractions of the axes, in the order of the lines.
    line : int array, shape (points,)
        Number of the line that each point belongs to, from 0; -1 where stability changes between
        two neighbours of the grid but no crossing was located.
    points : Answers
        Responses at `where`.
    reason : object array, shape (points,)
        "converged", or why no crossing was located.
    unresolved : int
        Chords between neighbours whose distance from the boundary is unknown.
    """

    where: Float
    line: Index
    points: Answers
    reason: NDArray[np.object_]
    unresolved: int

    @classmethod
    def empty(cls) -> MapBoundary:
        """A boundary without points, for maps without a search."""
        none = Answers.empty(OUTPUTS, 0)
        return cls(np.empty((0, 2)), np.empty(0, dtype=int), none, np.empty(0, dtype=object), 0)


def trace_boundary(plane: MapPlane, grid: Answers) -> MapBoundary:
    """Trace the boundary through a solved grid.

    Parameters
    ----------
    plane : MapPlane
    grid : Answers
        Responses at `plane.nodes`.

    Notes
    -----
    Each of a cell's four edges is crossed if its ends converged and differ in stability. Crossings
    of a cell are joined in pairs; where there are four, the response in the middle of the cell
    decides. A boundary that crosses the same edge twice is not detected.
    """
    nodes = plane.nodes()
    ends = _crossed_edges(plane.shape, grid)
    g = grid["log_multiplier"]
    edges = find_crossings(
        plane, nodes[ends[:, 0]], nodes[ends[:, 1]], g[ends[:, 0]], g[ends[:, 1]]
    )
    links = _links(plane, grid, ends, edges.located)
    where, points, lines, unresolved = refined_lines(plane, edges, links)
    return _in_order(where, points, lines, edges, unresolved)


def _crossed_edges(shape: tuple[int, int], grid: Answers) -> Index:
    """Nodes of the edges whose two nodes converged and differ in stability, shape (edges, 2)."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    along = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=-1)
    across = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=-1)
    ends = np.concatenate([along, across])
    solved = grid.converged[ends].all(axis=1)
    stable = is_stable(grid)
    differ = stable[ends[:, 0]] != stable[ends[:, 1]]
    return ends[solved & differ]


def _links(plane: MapPlane, grid: Answers, ends: Index, located: NDArray[np.bool_]) -> list[Index]:
    """Pairs of crossings that are neighbours on the boundary, cell by cell."""
    rows, columns = plane.shape
    number = {tuple(pair): k for k, pair in enumerate(ends.tolist()) if located[k]}
    cells: dict[tuple[int, int], list[int]] = {}
    for (a, b), k in number.items():
        row, column = divmod(a, columns)
        neighbour = (row - 1, column) if b == a + 1 else (row, column - 1)
        for cell in ((row, column), neighbour):
            if 0 <= cell[0] < rows - 1 and 0 <= cell[1] < columns - 1:
                cells.setdefault(cell, []).append(k)
    links = [np.array(k) for k in cells.values() if len(k) == 2]
    saddles = [cell for cell, k in cells.items() if len(k) == 4]
    middle = np.array([[c + 0.5, r + 0.5] for r, c in saddles]).reshape(-1, 2)
    middle_stable = is_stable(plane.solve(middle / [columns - 1, rows - 1]))
    stable_nodes = is_stable(grid)
    for (r, c), stable in zip(saddles, middle_stable, strict=True):
        a = r * columns + c
        b, d = a + 1, a + columns
        bottom, top = number[(a, b)], number[(d, d + 1)]
        left, right = number[(a, d)], number[(b, d + 1)]
        # The boundary separates the middle from the two corners that differ from it in stability.
        cut = ((bottom, right), (left, top)) if stable == stable_nodes[a] else (
            (bottom, left), (right, top)
        )  # fmt: skip
        links += [np.array(pair) for pair in cut]
    return links


def refined_lines(
    plane: MapPlane, edges: Crossings, links: Sequence[Index]
) -> tuple[Float, Answers, list[Index], int]:
    """Halve chords until the boundary is within `CHORD` of each, and join them to lines.

    Parameters
    ----------
    plane : MapPlane
    edges : Crossings
    links : sequence of (int, int)
        Neighbours among the crossings.

    Returns
    -------
    where : array, shape (points, 2)
        The crossings, and the added points.
    points : Answers
    lines : list of int arrays
        Indices of the points of each line, in order; a closed line ends with its first point.
    unresolved : int
        Chords whose distance from the boundary is unknown.
    """
    where, points = edges.where, edges.points
    chords = np.array(links, dtype=int).reshape(-1, 2)
    done: list[Index] = []
    unresolved = 0
    for rounds_left in range(_MOST_ROUNDS, -1, -1):
        bent, unknown, between = _bent(plane, where, chords)
        unresolved += int(unknown.sum())
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


def join(links: Index) -> list[Index]:
    """Lines from pairs of neighbours: first open lines from end to end, then closed lines.

    Parameters
    ----------
    links : int array, shape (pairs, 2)
        No index occurs more than twice.
    """
    neighbours: dict[int, list[int]] = {}
    for a, b in links.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    left = dict.fromkeys(sorted(neighbours))
    ends = [k for k in left if len(neighbours[k]) == 1]
    lines = []
    for begin in [*ends, *left]:
        if begin not in left:
            continue
        line = [begin]
        del left[begin]
        while following := [k for k in neighbours[line[-1]] if k in left]:
            line.append(following[0])
            del left[following[0]]
        if len(line) > 2 and begin in neighbours[line[-1]] and len(neighbours[begin]) == 2:
            line.append(begin)
        lines.append(np.array(line))
    return lines


def _bent(
    plane: MapPlane, where: Float, chords: Index
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Crossings]:
    """Chords further than `CHORD` from the boundary, chords of unknown distance, and crossings.

    The distance is measured from the middle of the chord along its perpendicular. The crossings
    are those of the chords further than `CHORD`. A chord shorter than `CHORD` needs no distance.
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
    located = between.located
    bent, unknown = np.zeros(len(chords), dtype=bool), ~crossed
    bent[index[located]] = True
    unknown[index[~located]] = True
    unknown &= np.linalg.norm(chord, axis=1) > CHORD
    points = between.points.take(located)
    kept = Crossings(between.where[located], points, located[located], between.reason[located])
    return bent, unknown, kept


def _joined(points: Answers, others: Answers) -> Answers:
    count = len(points)
    joined = Answers.empty(OUTPUTS, count + len(others))
    joined.put(slice(count), points)
    joined.put(slice(count, None), others)
    return joined


def _in_order(
    where: Float, points: Answers, lines: list[Index], edges: Crossings, unresolved: int
) -> MapBoundary:
    """The points of all lines in order, followed by the crossings that were not located."""
    lost = np.flatnonzero(~edges.located)
    order = np.concatenate([*lines, lost]).astype(int) if lines else lost
    sizes = [len(line) for line in lines]
    number = np.concatenate([np.repeat(np.arange(len(lines)), sizes), np.full(len(lost), -1)])
    reason = np.concatenate([np.full(sum(sizes), "converged", object), edges.reason[lost]])
    return MapBoundary(where[order], number.astype(int), points.take(order), reason, unresolved)
