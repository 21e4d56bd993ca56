"""Stability boundaries in the plane of two parameters: continuation of the bifurcation condition.

A point of a boundary is the zero of a test function on a line in the plane of the two parameters.
The line for the next point lies one step ahead, perpendicular to the direction of the boundary, so
that a boundary may turn back in either parameter. On that line folds, period doublings and
Neimark-Sacker points are located as on any branch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity.algebra.predictor_corrector import STEPS, STUCK, Attempt, Curves, StepControl, follow
from asperity.arrays import Bool, Complex, Float, Index
from asperity.branches.bifurcations import Kind, criterion, kind_of
from asperity.branches.continuation import ParameterBranch
from asperity.branches.follower import BranchFollower, BranchOrbit
from asperity.branches.parameters import (
    ContinuedParameter,
    fixed_parameters,
    line_through,
    moving_parameter,
    one_problem,
)
from asperity.errors import require
from asperity.loads import Modulation
from asperity.parameters.arguments import at_least, counted, typed
from asperity.parameters.parameter import Displayed, SummaryLine, count_text, number_line
from asperity.slider import Motion, Slider
from asperity.slider.parameters import equations_as_text
from asperity.slider.problem import Problem

if TYPE_CHECKING:
    import xarray


#: First step along a boundary, as a share of the span.
_FIRST = 0.005
_MOST_STEPS = 2000

_ENDS = {
    "edge": "the boundary leaves the rectangle",
    "closed": "the boundary closes on itself",
    "kind": "the bifurcation becomes one of another kind",
    STUCK: "no step along the boundary is short enough",
    STEPS: f"the boundary was followed for {_MOST_STEPS} steps",
}


class BoundaryPoint(NamedTuple):
    """A point of a boundary.

    Attributes
    ----------
    at : array, shape (2,)
        Coordinates of both parameters.
    branch_orbit : BranchOrbit
        Critical orbit, with its direction along the line on which it was located.
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
        Reasons why the boundary ends, at its first and at its last point.
    """

    kind: Kind
    points: list[BoundaryPoint]
    result: tuple[str, str]


class ParameterPlane(NamedTuple):
    """The plane of two parameters of an operating point."""

    problem: Problem
    parameters: tuple[ContinuedParameter, ContinuedParameter]

    def follower(self, at: Any, direction: Any) -> BranchFollower:
        """A follower of branches along a line through the plane."""
        line = line_through(self.problem, self.parameters, at, direction)
        return BranchFollower(line, harmonics=1)


def trace_boundary(
    plane: ParameterPlane,
    kind: Kind,
    first: BoundaryPoint,
    report: Callable[[], None],
) -> TracedBoundary:
    """Follow a boundary from `first` in both directions."""
    halves = []
    for sense in (1.0, -1.0):
        half = BoundaryHalf(plane, kind, first, report)
        halves.append((half.points, half.follow(sense)))
        if halves[0][1] == "closed":
            return TracedBoundary(kind, [first, *half.points], (_ENDS["closed"],) * 2)
    (forward, why_forward), (backward, why_backward) = halves
    points = [*backward[::-1], first, *forward]
    return TracedBoundary(kind, points, (_ENDS[why_backward], _ENDS[why_forward]))


class BoundaryHalf(Curves):
    """A boundary from one of its points in one direction.

    Parameters
    ----------
    plane : ParameterPlane
    kind : str
    first : BoundaryPoint
    report : callable
        Called after each step.

    Attributes
    ----------
    points : list of BoundaryPoint
        Points after `first`.
    """

    control = StepControl(
        shortest=1e-4,
        longest=0.02,
        growth=1.4,
        easy=0,
        hard=0,
        sharpest_turn=math.cos(0.25),
        farthest=0.3,
        most_failures=20,
    )

    def __init__(
        self,
        plane: ParameterPlane,
        kind: Kind,
        first: BoundaryPoint,
        report: Callable[[], None],
    ) -> None:
        self.plane, self.kind, self.report = plane, kind, report
        self.first = self.here = first
        self.direction = np.zeros(2)
        self.points: list[BoundaryPoint] = []
        self._other_kind = False

    def follow(self, sense: float) -> str:
        """Follow the boundary forwards or backwards; return a key of `_ENDS`."""
        direction = _first_direction(self.plane, self.kind, self.first)
        if direction is None:
            return STUCK
        self.direction = sense * direction
        (why,) = follow(self, np.array([_FIRST]), most=_MOST_STEPS)
        return "kind" if why == STUCK and self._other_kind else why

    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """The next point: on the line perpendicular to the boundary, one step ahead."""
        step = float(length[0])
        guess = self.here.at + step * self.direction
        across = _perpendicular(self.direction)
        neighbour = critical_point(self.plane, self.kind, self.here.branch_orbit, guess, across)
        turn, miss, self._other_kind = 1.0, 0.0, False
        if neighbour is not None:
            moved = neighbour.at - self.here.at
            turn = float(moved @ self.direction / np.linalg.norm(moved))
            miss = float(np.linalg.norm(neighbour.at - guess) / step)
            self._other_kind = not _is_critical(self.kind, neighbour.branch_orbit)
        good = None if self._other_kind else neighbour
        yield rows, Attempt.of_one(good, step, turn=turn, miss=miss)

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Keep the point; a boundary ends at the edge of the rectangle and where it closes."""
        self.report()
        before, neighbour = self.here, attempt.next
        moved = neighbour.at - before.at
        self.direction = moved / np.linalg.norm(moved)
        self.here = neighbour
        if np.any(neighbour.at < 0) or np.any(neighbour.at > 1):
            edge = _on_edge(self.plane, self.kind, before, neighbour)
            self.points += [edge] if edge else []
            return ["edge"]
        self.points.append(neighbour)
        if (
            len(self.points) > 5
            and np.linalg.norm(neighbour.at - self.first.at) < attempt.length[0]
        ):
            self.points.append(self.first)
            return ["closed"]
        return [""]


def critical_point(
    plane: ParameterPlane, kind: Kind, known: BranchOrbit, guess: Any, direction: Any
) -> BoundaryPoint | None:
    """The point of a boundary on the line through `guess`, from the orbit of a point nearby."""
    guess, direction = np.asarray(guess, float), np.asarray(direction, float)
    follower = plane.follower(guess, direction)
    # At a fold the orbit is not a regular function of the parameters: the parameter becomes an
    # unknown, and the plane perpendicular to the branch fixes the orbit.
    solve = follower.across_origin if kind == "fold" else follower.at_origin
    start = solve(known.point)
    if start is None:
        return None
    critical = follower.crossing(start, criterion(kind, _critical_index(kind, start)))
    if critical is None:
        return None
    return BoundaryPoint(guess + critical.t * direction, critical)


def _critical_index(kind: Kind, branch_orbit: BranchOrbit) -> int:
    """Which multiplier of the given kind is nearest to the unit circle."""
    distance = np.abs(branch_orbit.logs.real)
    same = np.array([kind_of(log) == kind for log in branch_orbit.logs])
    return int(np.argmin(np.where(same, distance, distance + 1e3)))


def _is_critical(kind: Kind, branch_orbit: BranchOrbit) -> bool:
    if kind == "fold":
        return True
    return kind_of(branch_orbit.logs[_critical_index(kind, branch_orbit)]) == kind


def _first_direction(plane: ParameterPlane, kind: Kind, first: BoundaryPoint) -> Float | None:
    """Direction of a boundary at a point, from a neighbour on either side of it."""
    for across in (np.array([1.0, 0.0]), np.array([0.0, 1.0])):
        for sense in (1.0, -1.0):
            guess = first.at + sense * 1e-4 * _perpendicular(across)
            if np.any(guess < 0) or np.any(guess > 1):
                continue
            other = critical_point(plane, kind, first.branch_orbit, guess, across)
            if other is not None and np.linalg.norm(other.at - first.at) < 1e-2:
                moved = other.at - first.at
                return moved / np.linalg.norm(moved)
    return None


def _perpendicular(direction: Float) -> Float:
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


#: A bifurcation this close to a boundary (share of the span) belongs to the boundary.
_SAME = 2e-3
_SCAN_STEPS = 400


@dataclass(frozen=True)
class BoundaryCurve:
    """One curve of bifurcations.

    Attributes
    ----------
    kind : str
        "fold", "period doubling" or "Neimark-Sacker".
    x, y : array, shape (points,)
        Values of the two parameters along the curve, SI.
    frequency : array, shape (points,)
        Frequency of the critical mode (Hz), see `Bifurcation`; 0 at folds.
    log_multipliers : complex array, shape (points, states)
        ln|m| + i arg m of the critical orbits.
    bounds_stability : bool array, shape (points,)
        Whether all other multipliers are inside the unit circle: one side is stable.
    reverses : bool array, shape (points,)
        Whether slip would reverse on the critical orbits, see `PeriodicResponse.reverses`.
    result : tuple of str
        Why the curve ends, at its first and at its last point.
    """

    kind: str
    x: Float
    y: Float
    frequency: Float
    log_multipliers: Complex
    bounds_stability: Bool
    reverses: Bool
    result: tuple[str, str]


@dataclass(frozen=True, repr=False)
class StabilityBoundary(Displayed):
    """Curves of bifurcations in the plane of two parameters.

    Attributes
    ----------
    names, units : tuple of two str
    curves : tuple of BoundaryCurve
    unsearched : tuple of str
        Parts of the lines of the search that could not be followed, as sentences: a curve that
        meets no other part is missed.
    motion : Motion
    fixed : dict
        The other parameters of the operating point, SI.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    curves: tuple[BoundaryCurve, ...]
    unsearched: tuple[str, ...]
    motion: Motion
    fixed: dict[str, float]

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """The plane, and a line for each curve and for each part that was not searched."""
        law = self.motion.slider.law.name
        lines = []
        for curve in self.curves:
            spans = zip(self.names, (curve.x, curve.y), strict=True)
            where = ", ".join(f"{name} {number_line(name, v).value}" for name, v in spans)
            lines.append(SummaryLine(curve.kind, where, count_text(len(curve.x), "point")))
        lines += [SummaryLine("not searched", line) for line in self.unsearched]
        return f"StabilityBoundary, {law}, {' and '.join(self.names)}", lines

    def to_dataset(self) -> xarray.Dataset:
        """All curves along one dimension, with the number and kind of the curve of each point."""
        import xarray

        def joined(values: list, units: str, name: str) -> tuple:
            flat = np.concatenate(values) if values else np.zeros(0)
            return "point", flat, {"units": units or "1", "long_name": name}

        curves = self.curves
        about = {
            "x": (self.units[0], self.names[0]),
            "y": (self.units[1], self.names[1]),
            "frequency": ("Hz", "critical mode"),
            "bounds_stability": ("", "one side is stable"),
            "reverses": ("", "slip would reverse, of a law that slips forwards only"),
        }
        data = {n: joined([getattr(c, n) for c in curves], *a) for n, a in about.items()}
        numbers = [np.full(len(c.x), i) for i, c in enumerate(curves)]
        kinds = [np.full(len(c.x), c.kind) for c in curves]
        data["curve"] = joined(numbers, "", "number of the curve")
        data["kind"] = joined(kinds, "", "kind of the bifurcation")
        missed = {"unsearched": "; ".join(self.unsearched)}
        return xarray.Dataset(data, attrs=equations_as_text(self.motion, self.fixed) | missed)


@typed
def stability_boundary(
    slider: Slider,
    *,
    x: str,
    y: str,
    x_span: tuple[Any, Any],
    y_span: tuple[Any, Any],
    velocity: ArrayLike | str | None = None,
    epsilon: ArrayLike | str | None = None,
    frequency: ArrayLike | str | None = None,
    modulation: Modulation | None = None,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
    lines: Annotated[int, at_least(2)] = 5,
    progress: Callable[[int, int], None] | None = None,
) -> StabilityBoundary:
    """Curves on which the periodic response changes its stability, in two parameters.

    Branches are followed along `lines` lines in each parameter, including the edges of the
    rectangle. Every bifurcation on these lines that lies on no curve yet is continued in both
    parameters.

    Parameters
    ----------
    slider : Slider
        Numbers, no arrays.
    x, y : str
        Names of two parameters, as in `continuation`.
    x_span, y_span : pair of float or str
        Sides of the rectangle.
    velocity, epsilon, frequency, modulation, inertia, radiation_damping
        As in `continuation`.
    lines : int
        Number of lines in each direction, at least 2. A closed curve between two lines is missed.
    progress : callable, optional
        Called with the number of lines searched so far and the number of all lines, and again with
        the same numbers after each point of a boundary.

    Returns
    -------
    StabilityBoundary
        Points are accurate to 1e-8 of the span.

    Raises
    ------
    InputError
        As `continuation`; if x and y are the same; if `lines` is below 2.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> at = {"velocity": "1 um/s", "frequency": "2 Hz"}
    >>> plane = {"x": "epsilon", "y": "K", "x_span": (0.05, 0.2), "y_span": (5e4, 2e5)}
    >>> asp.stability_boundary(slider, **plane, lines=2, **at)

    Notes
    -----
    Without modulation the curves end at the closed forms of linear stability: K = Kc for a
    slider without inertia, critical frequency (V/D0) sqrt((B - A)/A) for the ageing law.
    """
    problem = one_problem(locals(), {x: x_span, y: y_span})
    parameters = (
        moving_parameter(problem, x, x_span, "x_span"),
        moving_parameter(problem, y, y_span, "y_span"),
    )
    rule, got = "differ from x", f"'{y}' for both"
    require(parameters[0].name != parameters[1].name, "y", rule, got, "choose another parameter")
    plane = ParameterPlane(problem, parameters)
    report = counted(progress, 2 * lines)
    curves: list[TracedBoundary] = []
    unsearched = []
    for at, direction in _scan_lines(lines):
        crossings, reached, missed = _crossings(plane, at, direction)
        moving, fixed = parameters[:: -1 if direction[1] else 1]
        there = f"at {fixed.name} = {fixed.value(at.max()):.4g} {fixed.unit}".rstrip()
        gaps = [("beyond", reached)] * (reached < 1) + [("next to", t) for t in missed]
        for where, t in gaps:
            rest = f"{moving.name} {where} {moving.value(t):.4g} {moving.unit}".rstrip()
            unsearched.append(f"{rest} {there}")
        for kind, crossing in crossings:
            if not any(_lies_on(curve, kind, crossing) for curve in curves):
                curves.append(trace_boundary(plane, kind, crossing, partial(report, 0)))
        report(1)
    return StabilityBoundary(
        (parameters[0].name, parameters[1].name),
        (parameters[0].unit, parameters[1].unit),
        tuple(_boundary_curve(plane, curve) for curve in curves),
        tuple(unsearched),
        problem.system,
        fixed_parameters(problem, *(p.name for p in parameters)),
    )


def _scan_lines(lines: int) -> list[tuple[Float, Float]]:
    """Starts and directions: along y at several x, then along x at several y; edges first."""
    ticks = np.linspace(0, 1, lines)
    ticks = np.concatenate([ticks[[0, -1]], ticks[1:-1]])
    along_y = [(np.array([t, 0.0]), np.array([0.0, 1.0])) for t in ticks]
    along_x = [(np.array([0.0, t]), np.array([1.0, 0.0])) for t in ticks]
    return along_y + along_x


def _crossings(
    plane: ParameterPlane, at: Float, direction: Float
) -> tuple[list[tuple[Any, BoundaryPoint]], float, list[float]]:
    """Bifurcations on a line, the share of it that could be followed, and those not located."""
    follower = plane.follower(at, direction)
    start = follower.begin()
    if start is None:
        return [], 0.0, []
    branch = ParameterBranch(follower, start, _SCAN_STEPS)
    branch.follow()
    crossings = [
        (b.kind, BoundaryPoint(at + b.branch_orbit.t * direction, b.branch_orbit))
        for b, _ in branch.bifurcations
        if b.kind != "branch point"
    ]
    return crossings, max(orbit.t for orbit in branch.orbits), branch.missed


def _lies_on(curve: TracedBoundary, kind: str, crossing: BoundaryPoint) -> bool:
    """Whether a bifurcation lies on a curve already traced, by its distance from the chords."""
    if curve.kind != kind:
        return False
    points = np.array([p.at for p in curve.points])
    if len(points) < 2:
        return bool(np.linalg.norm(points[0] - crossing.at) < _SAME)
    start, chord = points[:-1], np.diff(points, axis=0)
    length = np.maximum((chord**2).sum(1), 1e-300)
    share = np.clip(((crossing.at - start) * chord).sum(1) / length, 0, 1)
    foot = start + share[:, None] * chord
    return bool(np.linalg.norm(foot - crossing.at, axis=1).min() < _SAME)


def _boundary_curve(plane: ParameterPlane, curve: TracedBoundary) -> BoundaryCurve:
    """The public result of a traced boundary, in SI."""
    at = np.array([p.at for p in curve.points])
    x, y = (p.value(at[:, i]) for i, p in enumerate(plane.parameters))
    logs = np.stack([p.branch_orbit.logs for p in curve.points])
    # The multipliers nearest to the unit circle are the critical ones.
    growth = logs.real
    order = np.argsort(np.abs(growth), axis=1, kind="stable")
    mode = [
        0.0 if curve.kind == "fold" else p.branch_orbit.mode_frequency(k)
        for p, k in zip(curve.points, order[:, 0], strict=True)
    ]
    others = order[:, 2 if curve.kind == "Neimark-Sacker" else 1 :]
    stable = (np.take_along_axis(growth, others, axis=1) < 0).all(1)
    reverses = np.array([p.branch_orbit.reversal_margin < 0 for p in curve.points])
    return BoundaryCurve(curve.kind, x, y, np.array(mode), logs, stable, reverses, curve.result)
