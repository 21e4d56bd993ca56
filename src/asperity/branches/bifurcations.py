"""Following one branch by steps of adapted length, and the bifurcations on it.

At a fold a branch turns back in the parameter and a multiplier passes +1; at a period doubling one
passes -1; at a Neimark-Sacker bifurcation a complex pair passes the unit circle, and a slow
oscillation grows on top of the modulation. Each has a test function along the arclength whose
zero is located by Brent's method: the direction of the parameter for folds, ln|m| for the others.

Source: Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, chapters 4, 5 and 10;
R. Seydel, Practical Bifurcation and Stability Analysis, chapter 5.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity._jax import spare_mappings
from asperity.algebra.predictor_corrector import STEPS, Attempt, Curves, StepControl, follow
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
    mean_friction : float
    harmonics : complex array, shape (harmonics,)
    logs : complex array, shape (states,)
        Logarithms of the multipliers, by falling modulus.
    omega : float
        Angular frequency of the modulation (rad/s).
    point : ContinuationPoint
        From where the next step starts.
    """

    mean_friction: float
    harmonics: Complex
    logs: Complex
    omega: float
    point: ContinuationPoint

    @property
    def t(self) -> float:
        """Coordinate along the line of parameters."""
        return float(self.point.t[0])

    @property
    def direction(self) -> float:
        """Derivative of t by the arclength: its sign changes at folds."""
        return float(self.point.tangent.t[0])

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int((self.logs.real > 0).sum())

    def mode_frequency(self, index: int) -> float:
        """Frequency (Hz) of a mode, from 0 to half of that of the modulation."""
        angle = abs(np.angle(np.exp(1j * self.logs[index].imag)))
        return float(angle * self.omega / (2 * np.pi) ** 2)


class BranchFollower(NamedTuple):
    """A line of parameters, and the observables of each orbit on the line."""

    line: ParameterLine
    harmonics: int

    def step(
        self, point: ContinuationPoint, length: float
    ) -> tuple[BranchOrbit | None, BranchStep]:
        """The orbit at the distance `length` from `point`.

        None where Newton's method fails, or the multipliers are not known.
        """
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
        following = step.next.point
        problem = self.line.at(following.t)
        read = read_orbit(problem, step.orbit, self.harmonics)
        logs = log_multipliers(read.monodromy, read.log_scale, read.log_determinant)
        if np.isnan(logs).any():
            return None, step
        orbit = BranchOrbit(
            float(read.mean_friction[0]),
            read.harmonics[:, 0],
            logs[:, 0],
            float(problem.system.omega[0]),
            following,
        )
        return orbit, step

    def crossing(
        self,
        start: BranchOrbit,
        function: Callable[[BranchOrbit], float],
        end: tuple[float, BranchOrbit] | None = None,
    ) -> BranchOrbit | None:
        """The orbit of the branch of `start` at which a function vanishes; None on failure.

        It is found by Brent's method between `start` and `end`, the length of a step and the orbit
        after it, or without an end near `start` by the secant method.
        """
        # SciPy's optimisation loads slowly, and only continuation needs it.
        from scipy.optimize import root_scalar

        solved = {0.0: start} | dict([end] if end else [])

        def value(distance: float) -> float:
            if distance not in solved:
                orbit = self.step(start.point, distance)[0] if abs(distance) < 1 else None
                if orbit is None:
                    raise _UnsolvedError
                solved[distance] = orbit
            return function(solved[distance])

        search: dict[str, Any] = _SECANT if end is None else {**_BRENT, "bracket": (0.0, end[0])}
        try:
            with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
                root = root_scalar(value, **search).root
        except (_UnsolvedError, ValueError):
            return None
        nearest = min(solved, key=lambda distance: abs(distance - root))
        return solved[nearest] if abs(nearest - root) < _STALLED else None

    def begin(self) -> BranchOrbit | None:
        """An orbit at t = 0, in the direction of rising t; None where the search finds none."""
        zero = np.zeros(1)
        problem = jax.tree.map(np.asarray, self.line.at(zero))
        solution = find_orbits(problem, SearchOptions(2, intervals=INTERVALS))
        if not solution.converged[0]:
            return None
        orbit = remeshed(problem, solution.orbit, INTERVALS)
        tangent, units = _at_constant_t(orbit), np.ones_like(orbit.centre)
        start = self.across_origin(ContinuationPoint(orbit, zero, tangent, units))
        if start is None:
            return None
        return start._replace(point=first_point(self.line, start.point.orbit, zero))

    def at_origin(self, point: ContinuationPoint) -> BranchOrbit | None:
        """The orbit at t = 0, from the orbit of a point nearby."""
        return self.across_origin(point._replace(tangent=_at_constant_t(point.orbit)))

    def across_origin(self, point: ContinuationPoint) -> BranchOrbit | None:
        """The orbit in the plane across the branch of a point nearby, from the guess t = 0."""
        return self.step(point._replace(t=np.zeros(1)), 0.0)[0]

    def finer(self, point: ContinuationPoint, intervals: int) -> BranchOrbit | None:
        """The orbit in the plane across the branch at a point, on a mesh of `intervals`."""
        orbit = remeshed(self.line.at(point.t), point.orbit, intervals)
        carried = interpolated(point.tangent.nodes, point.orbit.mesh, orbit.mesh)
        slopes = np.zeros(orbit.slopes.shape)  # a step of length zero does not use them
        tangent = Change(carried, slopes, point.tangent.t)
        return self.step(point._replace(orbit=orbit, tangent=tangent), 0.0)[0]


def _at_constant_t(orbit: Orbit) -> Change:
    """The tangent with which the plane of the corrector is that of constant t."""
    return Change(np.zeros_like(orbit.nodes), np.zeros_like(orbit.slopes), np.ones(1))


#: Brent's method between two orbits, and the secant method from an orbit, on the distance from it.
_BRENT = {"method": "brentq", "xtol": 1e-14, "rtol": 1e-14}
_SECANT = {"method": "secant", "x0": 0.0, "x1": 1e-4, "xtol": 1e-12, "maxiter": 12}
#: Largest last change of the distance that is attributed to round-off.
_STALLED = 1e-9


class _UnsolvedError(Exception):
    """Newton's method failed between two solved points."""


class ParameterBranch(Curves):
    """A branch along a line of parameters, followed until it leaves the span.

    Parameters
    ----------
    follower : BranchFollower
    start : BranchOrbit
    most_steps : int
    report : callable, optional
        Called with 1 after each step.

    Attributes
    ----------
    orbits : list of BranchOrbit
    bifurcations : list of (LocatedBifurcation, int)
        Those within the span, each with the index of the orbit before it.
    missed : list of float
        Values of t after which stability changes at a bifurcation that is not located.
    last_length : float
        Length of the last step.
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
        most_steps: int,
        report: Callable[[int], None] = lambda _: None,
    ) -> None:
        self.follower, self.most_steps, self.report = follower, most_steps, report
        self.orbits, self.last_length = [start], 0.0
        self.bifurcations: list[tuple[LocatedBifurcation, int]] = []
        self.missed: list[float] = []

    def follow(self) -> str:
        """Follow the branch; why it ends: "end", "start", "steps" or "stuck"."""
        (why,) = follow(self, np.array([_FIRST]))
        return why

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """No longer than a part of the span."""
        return np.minimum(length, _LARGEST_PART / np.maximum(abs(self.orbits[-1].direction), 1e-12))

    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """One step of the arclength."""
        following, step = self.follower.step(self.orbits[-1].point, float(length[0]))
        iterations, turn = float(step.iterations[0]), float(step.turn[0])
        yield rows, Attempt.of_one(following, float(length[0]), iterations=iterations, turn=turn)

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Keep the new orbit and the bifurcations before it; the branch ends outside the span."""
        here, there, self.last_length = self.orbits[-1], attempt.next, float(attempt.length[0])
        for located in bifurcations_between(self.follower, here, self.last_length, there):
            if located is None:
                self.missed.append(here.t)
            elif 0 <= located.branch_orbit.t <= 1:
                self.bifurcations.append((located, len(self.orbits) - 1))
        self.orbits.append(there)
        self.report(1)
        if not 0 <= there.t <= 1:
            return ["end" if there.t >= 0.5 else "start"]
        return [STEPS if len(self.orbits) > self.most_steps else ""]

    def cut(self) -> None:
        """Replace a last orbit outside the span by that at the end of the span."""
        last = self.orbits[-1]
        if not 0 <= last.t <= 1:
            edge = 1.0 if last.t > 1 else 0.0
            step = self.last_length, last
            reached = self.follower.crossing(self.orbits[-2], lambda orbit: orbit.t - edge, step)
            self.orbits[-1] = reached or last


Kind = Literal["fold", "period doubling", "Neimark-Sacker", "branch point"]

#: Arguments of multipliers below this, or this close to pi, count as real.
_REAL = 1e-6


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
) -> Iterator[LocatedBifurcation | None]:
    """All bifurcations between two neighbouring orbits.

    None for those that are not located, because Newton's method fails between the orbits.
    """
    before, after = start.unstable, end.unstable
    turned = start.direction * end.direction < 0
    if turned:
        index = min(before, after) if before != after else 0
        critical_orbit = follower.crossing(start, criterion("fold", index), (length, end))
        if critical_orbit is None:
            yield None
        else:
            yield LocatedBifurcation("fold", critical_orbit, index, before, after)
    index, last = min(before, after), max(before, after)
    while index < last:
        critical_orbit = follower.crossing(start, criterion(None, index), (length, end))
        if critical_orbit is None:
            yield None
            return
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


def criterion(kind: Kind | None, index: int) -> Callable[[BranchOrbit], float]:
    """The test function of a bifurcation, which vanishes there.

    It is the direction of a fold, and otherwise ln|m| of the multiplier of this index.
    """
    if kind == "fold":
        return lambda orbit: orbit.direction
    return lambda orbit: float(orbit.logs[index].real)
