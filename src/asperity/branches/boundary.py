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

from asperity.branches.bifurcation import Kind, criterion, kind_of, root_near
from asperity.branches.parameters import ContinuedParameter, line_through
from asperity.branches.steps import BranchFollower, BranchOrbit
from asperity.slider.problem import Problem

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


class BoundaryPoint(NamedTuple):
    """A point of a boundary.

    Attributes
    ----------
    at : array, shape (2,)
        Coordinates of both parameters.
    branch_orbit : BranchOrbit
        Critical orbit, with its direction along the line on which it was found.
    """

    at: Float
    branch_orbit: BranchOrbit


class TracedBoundary(NamedTuple):
    """A boundary of one kind, as coordinates in the rectangle.

    Attributes
    ----------
    kind : str
    points : list of BoundaryPoint
    result : tuple of str
        Why it ends, at its first and at its last point.
    """

    kind: Kind
    points: list[BoundaryPoint]
    result: tuple[str, str]


class ParameterPlane(NamedTuple):
    """Two parameters of an operating point, and what to read off each orbit."""

    problem: Problem
    parameters: tuple[ContinuedParameter, ContinuedParameter]
    harmonics: int

    def follower(self, at: Any, direction: Any) -> BranchFollower:
        """Along a line through the plane."""
        return BranchFollower(
            line_through(self.problem, self.parameters, at, direction), self.harmonics
        )


def trace_boundary(
    plane: ParameterPlane,
    kind: Kind,
    first: BoundaryPoint,
    report: Callable[[], None] = lambda: None,
) -> TracedBoundary:
    """Follow a boundary from `first` in both directions."""
    forward, why_forward = _half(plane, kind, first, 1.0, report)
    if why_forward == "closed":
        return TracedBoundary(kind, [first, *forward], (_ENDS["closed"],) * 2)
    backward, why_backward = _half(plane, kind, first, -1.0, report)
    points = [*backward[::-1], first, *forward]
    return TracedBoundary(kind, points, (_ENDS[why_backward], _ENDS[why_forward]))


def _half(
    plane: ParameterPlane,
    kind: Kind,
    first: BoundaryPoint,
    sense: float,
    report: Callable[[], None],
) -> tuple[list[BoundaryPoint], str]:
    """From `first` in one direction, and why it ends there."""
    direction = _first_direction(plane, kind, first)
    if direction is None:
        return [], "lost"
    direction, step = sense * direction, _FIRST
    points: list[BoundaryPoint] = []
    here = first
    for _ in range(_MOST_STEPS):
        there, why = _next(plane, kind, here, direction, step)
        while there is None and step > _SHORTEST:
            step *= _SHRINKAGE
            there, why = _next(plane, kind, here, direction, step)
        if there is None:
            return points, why
        report()
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
    plane: ParameterPlane, kind: Kind, here: BoundaryPoint, direction: Float, step: float
) -> tuple[BoundaryPoint | None, str]:
    """The point of the boundary across `direction`, a step ahead."""
    guess = here.at + step * direction
    there = critical_point(plane, kind, here.branch_orbit, guess, _across(direction))
    if there is None:
        return None, "lost"
    moved = there.at - here.at
    turn = np.arccos(np.clip(moved @ direction / np.linalg.norm(moved), -1, 1))
    if turn > _SHARPEST_TURN or np.linalg.norm(there.at - guess) > _FARTHEST * step:
        return None, "lost"
    if not _critical_kind(kind, there.branch_orbit):
        return None, "kind"
    return there, ""


def critical_point(
    plane: ParameterPlane, kind: Kind, known: BranchOrbit, guess: Any, direction: Any
) -> BoundaryPoint | None:
    """The point of a boundary on the line through `guess`, from the orbit of a point nearby."""
    guess, direction = np.asarray(guess, float), np.asarray(direction, float)
    follower = plane.follower(guess, direction)
    # At a fold the orbit does not depend regularly on the parameters: it keeps its distance from
    # the plane across the branch instead of its parameters.
    start = follower.at(known.point, 0.0) if kind != "fold" else follower.across(known.point, 0.0)
    if start is None:
        return None
    found = root_near(follower, start, criterion(kind, _critical_index(kind, start)))
    if found is None:
        return None
    return BoundaryPoint(guess + found.t * direction, found)


def _critical_index(kind: Kind, branch_orbit: BranchOrbit) -> int:
    """Which multiplier of the given kind is nearest to the unit circle."""
    distance = np.abs(branch_orbit.logs.real)
    same = np.array([kind_of(log) == kind for log in branch_orbit.logs])
    return int(np.argmin(np.where(same, distance, distance + 1e3)))


def _critical_kind(kind: Kind, branch_orbit: BranchOrbit) -> bool:
    if kind == "fold":
        return True
    return kind_of(branch_orbit.logs[_critical_index(kind, branch_orbit)]) == kind


def _first_direction(plane: ParameterPlane, kind: Kind, first: BoundaryPoint) -> Float | None:
    """Direction of a boundary at a point, from a neighbour on either side of it."""
    for across in (np.array([1.0, 0.0]), np.array([0.0, 1.0])):
        for sense in (1.0, -1.0):
            guess = first.at + sense * 1e-4 * _across(across)
            if np.any(guess < 0) or np.any(guess > 1):
                continue
            other = critical_point(plane, kind, first.branch_orbit, guess, across)
            if other is not None and np.linalg.norm(other.at - first.at) < 1e-2:
                moved = other.at - first.at
                return moved / np.linalg.norm(moved)
    return None


def _across(direction: Float) -> Float:
    return np.array([-direction[1], direction[0]])


def _on_edge(
    plane: ParameterPlane, kind: Kind, inside: BoundaryPoint, outside: BoundaryPoint
) -> BoundaryPoint | None:
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
    return critical_point(plane, kind, inside.branch_orbit, guess, direction)
