"""Following one branch: steps of adapted length, and points at a given distance."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity._jax import spare_mappings
from asperity.orbit.floquet import log_multipliers
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import Change
from asperity.orbit.mesh.reading import read_orbit
from asperity.orbit.mesh.remeshing import remeshed
from asperity.orbit.methods.branch_following.arclength import (
    ArclengthStep,
    ContinuationPoint,
    ParameterLine,
    arclength_step,
    first_point,
    interpolated,
)

Float = NDArray[np.float64]

#: A step counts when Newton's method has converged to this: its error is about the square.
_CONVERGED = 1e-6
_NEWTON_STEPS = 10
#: Cosine of the turn of the tangent below which a step may have left its branch.
_SHARPEST_TURN = 0.7
_GROWTH, _SHRINKAGE = 1.5, 0.4
_EASY, _HARD = 4, 6
_SHORTEST = 1e-7
#: Longest step, in units of the exponent of the slip rate and of the whole span together, and the
#: largest part of the span in it.
_LONGEST, _LARGEST_PART = 0.25, 0.04


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
    harmonics: NDArray[np.complex128]
    logs: NDArray[np.complex128]
    point: ContinuationPoint

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int((self.logs.real > 0).sum())


class BranchFollower(NamedTuple):
    """A line of parameters, and what to read off each orbit on it."""

    line: ParameterLine
    harmonics: int

    def step(
        self, point: ContinuationPoint, length: float
    ) -> tuple[BranchOrbit | None, ArclengthStep]:
        """The orbit at the distance `length` from `point`, None where Newton's method fails."""
        spare_mappings()
        step = arclength_step(self.line, point, np.array([length]), max_steps=_NEWTON_STEPS)
        if not step.error[0] < _CONVERGED:
            return None, step
        return self.branch_orbit(step.orbit, step.next), step

    def branch_orbit(self, orbit: Orbit, point: ContinuationPoint) -> BranchOrbit:
        """Read off an orbit."""
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

    def reaching(
        self, here: BranchOrbit, length: float, t: float
    ) -> tuple[BranchOrbit, float] | None:
        """The orbit at the coordinate `t` passed within `length` of `here`, and its distance."""
        # Loading SciPy's optimisation would slow the start of a process that continues nothing.
        from scipy.optimize import brentq

        def beyond(distance: float) -> float:
            branch_orbit, _ = self.step(here.point, distance)
            return np.nan if branch_orbit is None else branch_orbit.t - t

        try:
            distance = float(brentq(beyond, 0.0, length, xtol=1e-14, rtol=1e-14))
        except ValueError:
            return None
        branch_orbit, _ = self.step(here.point, distance)
        return None if branch_orbit is None else (branch_orbit, distance)

    def begin(self, orbit: Orbit, t: float, intervals: int) -> BranchOrbit | None:
        """An orbit at `t` on a mesh of `intervals`, in the direction of rising t."""
        at = np.array([t])
        orbit = remeshed(self.line.at(at), orbit, intervals)
        none = Change(np.zeros_like(orbit.nodes), np.zeros_like(orbit.slopes), np.ones(1))
        bare = ContinuationPoint(orbit, at, none, np.ones_like(orbit.centre))
        branch_orbit = self.at(bare, t)
        if branch_orbit is None:
            return None
        point = first_point(self.line, branch_orbit.point.orbit, at)
        return branch_orbit._replace(direction=float(point.tangent.t[0]), point=point)

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
        slopes = np.zeros(orbit.slopes.shape)  # not used by a step of no length
        tangent = Change(carried, slopes, point.tangent.t)
        return self.step(point._replace(orbit=orbit, tangent=tangent), 0.0)[0]


def follow_branch(
    follower: BranchFollower,
    start: BranchOrbit,
    *,
    most_steps: int,
    first_step: float,
    ended: Callable[[BranchOrbit], bool],
    visit: Callable[[BranchOrbit, float, BranchOrbit], None],
) -> str:
    """Follow a branch until `ended`, calling `visit` for each step.

    Parameters
    ----------
    follower : BranchFollower
    start : BranchOrbit
    most_steps : int
    first_step : float
    ended : callable
        Whether a branch_orbit lies beyond the end.
    visit : callable
        Called with a branch_orbit, the length of the step from it, and the next branch_orbit.

    Returns
    -------
    str
        "ended", "steps" where there were `most_steps`, or "stuck" where no step is short enough.
    """
    here, length = start, first_step
    for _ in range(most_steps):
        part = abs(float(here.point.tangent.t[0]))
        length = min(length, _LONGEST, _LARGEST_PART / max(part, 1e-12))
        while True:
            there, step = follower.step(here.point, length)
            if there is not None and step.turn[0] > _SHARPEST_TURN:
                break
            length *= _SHRINKAGE
            if length < _SHORTEST:
                return "stuck"
        visit(here, length, there)
        if ended(there):
            return "ended"
        here = there
        iterations = int(step.iterations[0])
        if iterations <= _EASY:
            length *= _GROWTH
        elif iterations > _HARD:
            length *= _SHRINKAGE
    return "steps"
