"""Orbits along a branch: steps by the arclength, and orbits at which a function vanishes."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from asperity._jax import spare_mappings
from asperity.arrays import Complex
from asperity.orbit.floquet import log_multipliers
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
    reversal_margin : float
        As in `asperity.orbit.observables.Observables`.
    point : ContinuationPoint
        From where the next step starts.
    """

    mean_friction: float
    harmonics: Complex
    logs: Complex
    omega: float
    reversal_margin: float
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
            float(read.reversal_margin[0]),
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
