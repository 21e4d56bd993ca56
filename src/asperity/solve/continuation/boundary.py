"""Stability boundaries in any two parameters: continuation of the bifurcation condition.

A point of a boundary is the zero of a test function on a line through the plane of the two
parameters. From a known point the next is sought on the line across the boundary's own direction a
step ahead, so that boundaries may turn back in either parameter. On that line folds, period
doublings and Neimark-Sacker points are found like those of any branch.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.solve.continuation.bifurcation import Kind, criterion, kind_of, root_near
from asperity.solve.continuation.parameters import Parameter, line_through
from asperity.solve.continuation.walk import Station, Walker
from asperity.solve.kernels import Problem

Float = NDArray[np.float64]

#: Steps along a boundary, in parts of the span: first, longest, shortest.
_FIRST, _LONGEST, _SHORTEST = 0.005, 0.02, 1e-4
_GROWTH, _SHRINKAGE = 1.4, 0.4
#: Largest turn of a boundary (rad) and distance from the predicted point, in steps.
_SHARPEST_TURN, _FARTHEST = 0.25, 0.3
_MOST_STEPS = 2000

_ENDS = {
    "edge": "the boundary leaves the rectangle",
    "closed": "the boundary closes on itself",
    "kind": "the bifurcation becomes one of another kind",
    "lost": "no step along the boundary is short enough",
    "steps": f"the boundary was followed for {_MOST_STEPS} steps",
}


class Crossing(NamedTuple):
    """A point of a boundary.

    Attributes
    ----------
    at : array, shape (2,)
        Coordinates of both parameters.
    station : Station
        Critical orbit, with its direction along the line on which it was found.
    """

    at: Float
    station: Station


class Curve(NamedTuple):
    """A boundary of one kind, as coordinates in the rectangle.

    Attributes
    ----------
    kind : str
    points : list of Crossing
    result : tuple of str
        Why it ends, at its first and at its last point.
    """

    kind: Kind
    points: list[Crossing]
    result: tuple[str, str]


class Plane(NamedTuple):
    """Two parameters of an operating point, and what to read off each orbit."""

    problem: Problem
    parameters: tuple[Parameter, Parameter]
    harmonics: int

    def walker(self, at: Any, direction: Any) -> Walker:
        """Along a line through the plane."""
        return Walker(line_through(self.problem, self.parameters, at, direction), self.harmonics)


def trace_boundary(
    plane: Plane, kind: Kind, first: Crossing, told: Callable[[], None] = lambda: None
) -> Curve:
    """Follow a boundary from `first` in both directions."""
    forward, why_forward = _half(plane, kind, first, 1.0, told)
    if why_forward == "closed":
        return Curve(kind, [first, *forward], (_ENDS["closed"],) * 2)
    backward, why_backward = _half(plane, kind, first, -1.0, told)
    points = [*backward[::-1], first, *forward]
    return Curve(kind, points, (_ENDS[why_backward], _ENDS[why_forward]))


def _half(
    plane: Plane, kind: Kind, first: Crossing, sense: float, told: Callable[[], None]
) -> tuple[list[Crossing], str]:
    """From `first` in one direction, and why it ends there."""
    direction = _first_direction(plane, kind, first)
    if direction is None:
        return [], "lost"
    direction, step = sense * direction, _FIRST
    points: list[Crossing] = []
    here = first
    for _ in range(_MOST_STEPS):
        there, why = _next(plane, kind, here, direction, step)
        while there is None and step > _SHORTEST:
            step *= _SHRINKAGE
            there, why = _next(plane, kind, here, direction, step)
        if there is None:
            return points, why
        told()
        moved = there.at - here.at
        direction = moved / np.linalg.norm(moved)
        points.append(there)
        if np.any(there.at < 0) or np.any(there.at > 1):
            edge = _on_edge(plane, kind, here, there)
            return [*points[:-1], *([edge] if edge else [])], "edge"
        if len(points) > 5 and np.linalg.norm(there.at - first.at) < step:
            return [*points, first], "closed"
        here, step = there, min(step * _GROWTH, _LONGEST)
    return points, "steps"


def _next(
    plane: Plane, kind: Kind, here: Crossing, direction: Float, step: float
) -> tuple[Crossing | None, str]:
    """The point of the boundary across `direction`, a step ahead."""
    guess = here.at + step * direction
    there = critical_point(plane, kind, here.station, guess, _across(direction))
    if there is None:
        return None, "lost"
    moved = there.at - here.at
    turn = np.arccos(np.clip(moved @ direction / np.linalg.norm(moved), -1, 1))
    if turn > _SHARPEST_TURN or np.linalg.norm(there.at - guess) > _FARTHEST * step:
        return None, "lost"
    if not _critical_kind(kind, there.station):
        return None, "kind"
    return there, ""


def critical_point(
    plane: Plane, kind: Kind, known: Station, guess: Any, direction: Any
) -> Crossing | None:
    """The point of a boundary on the line through `guess`, from the orbit of a point nearby."""
    guess, direction = np.asarray(guess, float), np.asarray(direction, float)
    walker = plane.walker(guess, direction)
    # At a fold the orbit does not depend regularly on the parameters: it keeps its distance from
    # the plane across the branch instead of its parameters.
    start = walker.at(known.point, 0.0) if kind != "fold" else walker.across(known.point, 0.0)
    if start is None:
        return None
    found = root_near(walker, start, criterion(kind, _critical_index(kind, start)))
    if found is None:
        return None
    return Crossing(guess + found.t * direction, found)


def _critical_index(kind: Kind, station: Station) -> int:
    """Which multiplier of the given kind is nearest to the unit circle."""
    distance = np.abs(station.logs.real)
    same = np.array([kind_of(log) == kind for log in station.logs])
    return int(np.argmin(np.where(same, distance, distance + 1e3)))


def _critical_kind(kind: Kind, station: Station) -> bool:
    if kind == "fold":
        return True
    return kind_of(station.logs[_critical_index(kind, station)]) == kind


def _first_direction(plane: Plane, kind: Kind, first: Crossing) -> Float | None:
    """Direction of a boundary at a point, from a neighbour on either side of it."""
    for across in (np.array([1.0, 0.0]), np.array([0.0, 1.0])):
        for sense in (1.0, -1.0):
            guess = first.at + sense * 1e-4 * _across(across)
            if np.any(guess < 0) or np.any(guess > 1):
                continue
            other = critical_point(plane, kind, first.station, guess, across)
            if other is not None and np.linalg.norm(other.at - first.at) < 1e-2:
                moved = other.at - first.at
                return moved / np.linalg.norm(moved)
    return None


def _across(direction: Float) -> Float:
    return np.array([-direction[1], direction[0]])


def _on_edge(plane: Plane, kind: Kind, inside: Crossing, outside: Crossing) -> Crossing | None:
    """The point at which a boundary leaves the rectangle."""
    moved = outside.at - inside.at
    edges = [(axis, edge) for axis in (0, 1) for edge in (0.0, 1.0) if moved[axis]]
    shares = [((edge - inside.at[axis]) / moved[axis], axis, edge) for axis, edge in edges]
    beyond = [(s, axis, edge) for s, axis, edge in shares if 0 < s <= 1]
    if not beyond:
        return None
    share, axis, edge = min(beyond)
    guess = inside.at + share * moved
    guess[axis] = edge
    direction = np.array([0.0, 1.0]) if axis == 0 else np.array([1.0, 0.0])
    return critical_point(plane, kind, inside.station, guess, direction)
