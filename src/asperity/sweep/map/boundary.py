"""The stability boundary on a grid: every edge that it crosses, and lines through the crossings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.sweep.map.crossing import Crossings, find_crossings
from asperity.sweep.map.plane import MapPlane, PointResponses
from asperity.sweep.map.refinement import refined_lines

Float = NDArray[np.float64]
Int = NDArray[np.intp]


@dataclass
class MapBoundary:
    """The stability boundary.

    Attributes
    ----------
    where : array, shape (points, 2)
        Fractions of the axes, line after line.
    line : int array, shape (points,)
        Number of the line that each point belongs to, from 0; -1 where stability changes between
        two neighbours of the grid but no crossing was found, for the `reason` given.
    points : PointResponses
        The responses there.
    reason : object array, shape (points,)
    unresolved : int
        Chords between neighbours whose distance from the boundary is unknown.
    """

    where: Float
    line: Int
    points: PointResponses
    reason: NDArray[np.object_]
    unresolved: int

    @classmethod
    def empty(cls) -> MapBoundary:
        """No points: nothing was searched for."""
        no = PointResponses.empty(0)
        return cls(np.empty((0, 2)), np.empty(0, dtype=int), no, np.empty(0, dtype=object), 0)


def trace_boundary(plane: MapPlane, grid: PointResponses) -> MapBoundary:
    """Trace the boundary through a solved grid.

    Parameters
    ----------
    plane : MapPlane
    grid : PointResponses
        At `plane.nodes`.

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
    links = _links(plane, grid, ends, edges.found)
    where, points, lines, unresolved = refined_lines(plane, edges, links)
    return _in_order(where, points, lines, edges, unresolved)


def _crossed_edges(shape: tuple[int, int], grid: PointResponses) -> Int:
    """Ends of the edges whose ends converged and differ in stability, shape (edges, 2)."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    along = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=-1)
    across = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=-1)
    ends = np.concatenate([along, across])
    solved = grid.converged[ends].all(axis=1)
    differ = grid.stable[ends[:, 0]] != grid.stable[ends[:, 1]]
    return ends[solved & differ]


def _links(plane: MapPlane, grid: PointResponses, ends: Int, found: NDArray[np.bool_]) -> list[Int]:
    """Pairs of crossings that are neighbours on the boundary, cell by cell."""
    rows, columns = plane.shape
    number = {tuple(pair): k for k, pair in enumerate(ends.tolist()) if found[k]}
    cells: dict[tuple[int, int], list[int]] = {}
    for (a, b), k in number.items():
        row, column = divmod(a, columns)
        beside = (row - 1, column) if b == a + 1 else (row, column - 1)
        for cell in ((row, column), beside):
            if 0 <= cell[0] < rows - 1 and 0 <= cell[1] < columns - 1:
                cells.setdefault(cell, []).append(k)
    links = [np.array(k) for k in cells.values() if len(k) == 2]
    saddles = [cell for cell, k in cells.items() if len(k) == 4]
    middle = np.array([[c + 0.5, r + 0.5] for r, c in saddles]).reshape(-1, 2)
    middles = plane.solve(middle / [columns - 1, rows - 1])
    for (r, c), stable in zip(saddles, middles.stable, strict=True):
        a = r * columns + c
        b, d = a + 1, a + columns
        bottom, top = number[(a, b)], number[(d, d + 1)]
        left, right = number[(a, d)], number[(b, d + 1)]
        # The boundary separates the middle from the two corners of the other stability.
        cut = ((bottom, right), (left, top)) if stable == grid.stable[a] else (
            (bottom, left), (right, top)
        )  # fmt: skip
        links += [np.array(pair) for pair in cut]
    return links


def _in_order(
    where: Float, points: PointResponses, lines: list[Int], edges: Crossings, unresolved: int
) -> MapBoundary:
    """Line after line, the crossings that were not found behind them."""
    lost = np.flatnonzero(~edges.found)
    order = np.concatenate([*lines, lost]).astype(int) if lines else lost
    sizes = [len(line) for line in lines]
    number = np.concatenate([np.repeat(np.arange(len(lines)), sizes), np.full(len(lost), -1)])
    reason = np.concatenate([np.full(sum(sizes), "converged", object), edges.reason[lost]])
    return MapBoundary(where[order], number.astype(int), points.take(order), reason, unresolved)
