"""The stability boundary on a grid: contours of its points, located on the edges and refined.

All crossings are searched together. The grid detects every line of the boundary, open or closed,
that separates two grid points. Continuation (`asperity.branches`) also gives bifurcation curves
that bound no stable region, but it is sequential, needs a start on each curve, and ends where the
kind of bifurcation changes. Measured for rice-ruina over K and 0.5 to 100 Hz: 154 s for three
curves by continuation, 43 s for the single line of the map with a grid of 40 x 40 points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from contourpy import contour_generator
from numpy.typing import NDArray

from asperity.arrays import Bool, Float, Index
from asperity.study.crossings import Crossings, find_crossings
from asperity.study.map.plane import OUTPUTS, MapPlane
from asperity.study.points import Answers

#: Largest distance of the boundary from the chord between two neighbouring points, in fractions of
#: the axes.
CHORD = 5e-5
#: Each halving of a chord divides its distance from a smooth curve by four: seven reduce a distance
#: of the whole axis to `CHORD`.
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
    Marching squares on the sign of ln|m| give the edges of the grid that each line crosses, in
    order. In a cell whose four edges are crossed, the mean of the corners decides which crossings
    are joined. A boundary that crosses the same edge twice is not detected. On each edge the
    crossing is located; a line ends at an edge without a located crossing. Then chords are halved
    until the boundary is within `CHORD` of each.
    """
    contours = _contours(plane.shape, grid)
    if not contours:
        return MapBoundary.empty()
    nodes, g = plane.nodes(), grid["log_multiplier"]
    first, last = np.concatenate(contours).T
    edges = find_crossings(plane.solve, nodes[first], nodes[last], g[first], g[last])
    # A line ends where no crossing is located, and has at least two points.
    begins = np.concatenate([np.arange(len(contour)) == 0 for contour in contours])
    line = np.where(edges.located, np.cumsum(begins | ~edges.located), -1)
    line[edges.located & (np.bincount(line + 1)[line + 1] < 2)] = -2
    where, points, line, place, unresolved = _halved_chords(plane, edges, line)
    # The points of all lines in order, followed by the crossings that were not located.
    on_line = line >= 0
    lost = np.flatnonzero(~edges.located)
    order = np.concatenate([np.lexsort((place, line))[np.count_nonzero(~on_line) :], lost])
    number = np.concatenate(
        [np.unique(np.sort(line[on_line]), return_inverse=True)[1], 0 * lost - 1]
    )
    reason = np.full(len(order), "converged", dtype=object)
    reason[number < 0] = edges.reason[lost]
    return MapBoundary(where[order], number, points.take(order), reason, unresolved)


def _contours(shape: tuple[int, int], grid: Answers) -> list[Index]:
    """Nodes of the edges that each line of the boundary crosses, in order, shape (edges, 2)."""
    g = grid["log_multiplier"].reshape(shape)
    # Between 1 and 2 in modulus: contours then cross an edge near its middle, never at a node.
    sign = np.where(g < 0, -1.0, 1.0) * (2 - 1 / (1 + np.abs(g)))
    masked = np.ma.array(sign, mask=~grid.converged.reshape(shape))
    contours = []
    generator: Any = contour_generator(z=masked, corner_mask=True)
    for vertices in generator.lines(0.0):
        whole = np.round(vertices)
        between = np.abs(vertices - whole) > 0.1
        low = np.where(between, np.floor(vertices), whole).astype(int)
        # Next to a point without response a contour may end on a diagonal.
        on_edge = between.sum(axis=1) == 1
        x, y = np.stack([low, low + between], axis=-1)[on_edge].transpose(1, 0, 2)
        contours.append(y * shape[1] + x)
    return contours


def _halved_chords(
    plane: MapPlane, edges: Crossings, line: Index
) -> tuple[Float, Answers, Index, Float, int]:
    """Halve chords until the boundary is within `CHORD` of each.

    Parameters
    ----------
    plane : MapPlane
    edges : Crossings
        The points of each line in order.
    line : int array, shape (points,)
        Number of the line of each point; negative for a point on no line.

    Returns
    -------
    where : array, shape (points, 2)
        The crossings, and the added points.
    points : Answers
    line : int array, shape (points,)
    place : array, shape (points,)
        Sort key of the points along their line.
    unresolved : int
        Chords whose distance from the boundary is unknown.
    """
    where, points, place = edges.where, edges.points, np.arange(len(line), dtype=float)
    first = np.flatnonzero((line[:-1] == line[1:]) & (line[1:] >= 0))
    chords = np.stack([first, first + 1], axis=-1)
    unresolved = 0
    for rounds_left in range(_MOST_ROUNDS, -1, -1):
        bent, unknown, between = _chord_distances(plane, where, chords)
        unresolved += int(unknown.sum())
        if not bent.any():
            break
        if not rounds_left:
            unresolved += int(bent.sum())
            break
        new = len(where) + np.arange(np.count_nonzero(bent))
        first, last = chords[bent].T
        chords = np.concatenate([np.stack([first, new], -1), np.stack([new, last], -1)])
        where = np.concatenate([where, between.where])
        points = points.with_others(between.points)
        line = np.concatenate([line, line[first]])
        place = np.concatenate([place, (place[first] + place[last]) / 2])
    return where, points, line, place, unresolved


def _chord_distances(plane: MapPlane, where: Float, chords: Index) -> tuple[Bool, Bool, Crossings]:
    """Distances of chords from the boundary.

    Returns
    -------
    bent : bool array, shape (chords,)
        Whether the boundary is further than `CHORD` from the middle of the chord, measured along
        the perpendicular of the chord.
    unknown : bool array, shape (chords,)
        Whether the distance is unknown; False for chords shorter than `CHORD`.
    between : Crossings
        Points of the boundary on the perpendiculars of the bent chords.
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
    between = find_crossings(plane.solve, start[index], end[index], g0[index], g1[index])
    located = between.located
    bent, unknown = np.zeros(len(chords), dtype=bool), ~crossed
    bent[index[located]] = True
    unknown[index[~located]] = True
    unknown &= np.linalg.norm(chord, axis=1) > CHORD
    points = between.points.take(located)
    kept = Crossings(between.where[located], points, located[located], between.reason[located])
    return bent, unknown, kept
