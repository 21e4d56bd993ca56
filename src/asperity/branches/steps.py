"""Following one branch by steps of adapted length, and the bifurcations on it.

At a fold a branch turns back in the parameter and a multiplier passes +1; at a period doubling one
passes -1; at a Neimark-Sacker bifurcation a complex pair passes the unit circle, and a slow
oscillation grows on top of the modulation. Each has a test function along the arclength whose
zero is located by Brent's method: the direction of the parameter for folds, ln|m| for the others.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapters 4, 5 and 10;
R. Seydel, Practical Bifurcation and Stability Analysis, chapter 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity._jax import spare_mappings
from asperity.algebra.continuation import STEPS, Attempt, Curves, StepControl, follow
from asperity.arrays import Complex, Float, Index
from asperity.orbit.floquet import FOLD, kind_of_crossing, log_multipliers
from asperity.orbit.mesh.arclength import (
    EQUIDISTRIBUTED,
    BranchStep,
    ContinuationPoint,
    ParameterLine,
    branch_step,
    first_point,
    interpolated,
    straight,
)
from asperity.orbit.mesh.equations import read_orbit
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import Change, remeshed
from asperity.orbit.search import find_orbits
from asperity.orbit.solution import SearchOptions

#: Mesh intervals of a branch of simple period; a bifurcation is solved on three times as many.
INTERVALS = 216
_NEWTON_STEPS = 10
#: First step, and longest step, as shares of the span.
_FIRST, _LARGEST_PART = 1e-3, 0.04


class BranchOrbit(NamedTuple):
    """A solved point of a branch.

    Attributes
    ----------
    t : float
        Coordinate along the line of parameters.
    direction : float
        Derivative of t by the arclength: its sign changes at folds.
    mean_friction : float
    harmonics : complex array, shape (harmonics,)
    logs : complex array, shape (states,)
        Logarithms of the multipliers, by falling modulus.
    point : ContinuationPoint
        From where the next step starts.
    """

    t: float
    direction: float
    mean_friction: float
    harmonics: Complex
    logs: Complex
    point: ContinuationPoint

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int((self.logs.real > 0).sum())


class BranchFollower(NamedTuple):
    """A line of parameters, and the observables of each orbit on the line."""

    line: ParameterLine
    harmonics: int

    def step(
        self, point: ContinuationPoint, length: float
    ) -> tuple[BranchOrbit | None, BranchStep]:
        """The orbit at the distance `length` from `point`, None where Newton's method fails."""
        spare_mappings()
        step = branch_step(
            self.line,
            straight(point, np.ones(1)),
            np.array([length]),
            remeshing=EQUIDISTRIBUTED,
            max_steps=_NEWTON_STEPS,
        )
        if not np.isfinite(step.error[0]):
            return None, step
        return self.branch_orbit(step.orbit, step.next.point), step

    def branch_orbit(self, orbit: Orbit, point: ContinuationPoint) -> BranchOrbit:
        """Evaluate the observables of an orbit."""
        read = read_orbit(self.line.at(point.t), orbit, self.harmonics)
        logs = log_multipliers(read.monodromy, read.log_scale, read.log_determinant)
        return BranchOrbit(
            float(point.t[0]),
            float(point.tangent.t[0]),
            float(read.mean_friction[0]),
            read.harmonics[:, 0],
            logs[:, 0],
            point,
        )

    def crossing(
        self, start: BranchOrbit, length: float, function: Callable[[BranchOrbit], float]
    ) -> tuple[BranchOrbit, float] | None:
        """The orbit within `length` of `start` at which a function vanishes, and its distance."""
        # SciPy's optimisation loads slowly, and only continuation needs it.
        from scipy.optimize import brentq

        seen: dict[float, BranchOrbit] = {}

        def value(distance: float) -> float:
            branch_orbit, _ = self.step(start.point, distance)
            if branch_orbit is None:
                raise _UnsolvedError
            seen[distance] = branch_orbit
            return function(branch_orbit)

        try:
            root = float(brentq(value, 0.0, length, xtol=1e-14, rtol=1e-14))
        except (_UnsolvedError, ValueError):
            return None
        orbit = seen[root] if root in seen else self.step(start.point, root)[0]
        return None if orbit is None else (orbit, root)

    def begin(self) -> BranchOrbit | None:
        """An orbit at t = 0, in the direction of rising t; None where the search finds none."""
        zero = np.zeros(1)
        problem = jax.tree.map(np.asarray, self.line.at(zero))
        solution = find_orbits(problem, SearchOptions(2, intervals=INTERVALS))
        if not solution.converged[0]:
            return None
        orbit = remeshed(problem, solution.orbit, INTERVALS)
        tangent = Change(np.zeros_like(orbit.nodes), np.zeros_like(orbit.slopes), np.ones(1))
        start = self.at(ContinuationPoint(orbit, zero, tangent, np.ones_like(orbit.centre)), 0.0)
        if start is None:
            return None
        point = first_point(self.line, start.point.orbit, zero)
        return start._replace(direction=float(point.tangent.t[0]), point=point)

    def at(self, point: ContinuationPoint, t: float) -> BranchOrbit | None:
        """The orbit at the coordinate `t`, from the orbit of a point nearby."""
        # With this tangent the plane of the corrector is that of constant t.
        nodes = np.zeros_like(point.tangent.nodes)
        tangent = Change(nodes, np.zeros_like(point.tangent.slopes), np.ones(1))
        return self.step(point._replace(t=np.array([t]), tangent=tangent), 0.0)[0]

    def across(self, point: ContinuationPoint, t: float) -> BranchOrbit | None:
        """The orbit in the plane across the branch of a point nearby, from the guess `t`."""
        return self.step(point._replace(t=np.array([t])), 0.0)[0]

    def finer(self, point: ContinuationPoint, intervals: int) -> BranchOrbit | None:
        """The orbit in the plane across the branch at a point, on a mesh of `intervals`."""
        orbit = remeshed(self.line.at(point.t), point.orbit, intervals)
        carried = interpolated(point.tangent.nodes, point.orbit.mesh, orbit.mesh)
        slopes = np.zeros(orbit.slopes.shape)  # a step of length zero does not use them
        tangent = Change(carried, slopes, point.tangent.t)
        return self.step(point._replace(orbit=orbit, tangent=tangent), 0.0)[0]


class _UnsolvedError(Exception):
    """Newton's method failed between two solved points."""


class ParameterBranch(Curves):
    """A branch along a line of parameters, followed until it leaves the span.

    Parameters
    ----------
    follower : BranchFollower
    start : BranchOrbit
    visit : callable
        Called with an orbit, the length of the step from it, and the next orbit.
    most_steps : int
    """

    control = StepControl(
        shortest=1e-7,
        longest=0.25,  # in units of the exponent of the slip rate and of the whole span together
        growth=1.5,
        easy=4,
        hard=6,
        sharpest_turn=0.7,
        farthest=np.inf,
        most_failures=20,
    )

    def __init__(
        self,
        follower: BranchFollower,
        start: BranchOrbit,
        visit: Callable[[BranchOrbit, float, BranchOrbit], None],
        most_steps: int,
    ) -> None:
        self.follower, self.here, self.visit, self.left = follower, start, visit, most_steps

    def follow(self) -> str:
        """Follow the branch; why it ends: "end", "start", "steps" or "stuck"."""
        (why,) = follow(self, np.array([_FIRST]))
        return why

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """No longer than a part of the span."""
        return np.minimum(length, _LARGEST_PART / np.maximum(abs(self.here.direction), 1e-12))

    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """One step of the arclength."""
        following, step = self.follower.step(self.here.point, float(length[0]))
        iterations, turn = float(step.iterations[0]), float(step.turn[0])
        yield rows, Attempt.of_one(following, float(length[0]), iterations=iterations, turn=turn)

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Visit the new orbit; the branch ends outside the span."""
        following = attempt.next
        self.visit(self.here, float(attempt.length[0]), following)
        self.here, self.left = following, self.left - 1
        if not 0 <= following.t <= 1:
            return ["end" if following.t >= 0.5 else "start"]
        return ["" if self.left else STEPS]


Kind = Literal["fold", "period doubling", "Neimark-Sacker", "branch point"]

#: Arguments of multipliers below this, or this close to pi, count as real.
_REAL = 1e-6
#: Secant steps that carry a bifurcation over to a finer mesh, and their tolerance on t.
_SECANT_STEPS = 12
_TOLERANCE = 1e-12
#: Largest last secant step that is attributed to round-off.
_STALLED = 1e-9


class LocatedBifurcation(NamedTuple):
    """A bifurcation on a branch.

    Attributes
    ----------
    kind : str
    branch_orbit : BranchOrbit
    critical : int
        Which multiplier, by falling modulus, is critical.
    before, after : int
        Unstable multipliers on the two sides, along the branch.
    """

    kind: Kind
    branch_orbit: BranchOrbit
    critical: int
    before: int
    after: int


def bifurcations_between(
    follower: BranchFollower, start: BranchOrbit, length: float, end: BranchOrbit
) -> Iterator[LocatedBifurcation]:
    """All bifurcations between two neighbouring orbits."""
    before, after = start.unstable, end.unstable
    turned = start.direction * end.direction < 0
    if turned:
        index = min(before, after) if before != after else 0
        crossing = follower.crossing(start, length, _direction)
        if crossing is not None:
            yield LocatedBifurcation("fold", crossing[0], index, before, after)
    index, last = min(before, after), max(before, after)
    while index < last:
        crossing = follower.crossing(start, length, _log_modulus(index))
        if crossing is None:
            return
        critical_orbit, _ = crossing
        kind = kind_of(critical_orbit.logs[index])
        if kind == "branch point" and turned:
            index += 1  # the multiplier of the fold itself
            continue
        width = 2 if kind == "Neimark-Sacker" else 1
        near, far = (index, index + width) if before < after else (index + width, index)
        yield LocatedBifurcation(kind, critical_orbit, index, near, far)
        index += width


def kind_of(log: complex) -> Kind:
    """Bifurcation of a multiplier on the unit circle; "branch point" where it is +1."""
    (kind,) = kind_of_crossing(np.array([log]), real=_REAL)
    return "branch point" if kind == FOLD else kind


def criterion(kind: Kind, index: int) -> Callable[[BranchOrbit], float]:
    """The test function of a bifurcation, which vanishes there."""
    return _direction if kind == "fold" else _log_modulus(index)


def _direction(branch_orbit: BranchOrbit) -> float:
    return branch_orbit.direction


def _log_modulus(index: int) -> Callable[[BranchOrbit], float]:
    return lambda branch_orbit: float(branch_orbit.logs[index].real)


def polished(
    follower: BranchFollower, located: LocatedBifurcation, intervals: int
) -> BranchOrbit | None:
    """The bifurcation located again on a mesh of `intervals`, by the secant method."""
    return root_near(
        follower,
        follower.finer(located.branch_orbit.point, intervals),
        criterion(located.kind, located.critical),
    )


def root_near(
    follower: BranchFollower, start: BranchOrbit | None, function: Callable[[BranchOrbit], float]
) -> BranchOrbit | None:
    """The orbit near `start` on its branch at which `function` vanishes; None on failure."""
    if start is None:
        return None
    before, value_before = 0.0, function(start)
    distance, branch_orbit = 1e-4, start
    for _ in range(_SECANT_STEPS):
        now, _ = follower.step(start.point, distance)
        if now is None:
            return None
        branch_orbit, value = now, function(now)
        if value == value_before:
            return branch_orbit
        change = -value * (distance - before) / (value - value_before)
        before, value_before = distance, value
        distance += change
        if abs(change) < _TOLERANCE:
            return branch_orbit
        if abs(change) > 1.0:
            return None
    return branch_orbit if abs(change) < _STALLED else None
