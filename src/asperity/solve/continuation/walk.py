"""Walking along one branch: steps of adapted length, and points at a given distance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity._jax import spare_mappings
from asperity.solve.collocation import refined
from asperity.solve.continuation.arclength import (
    Point,
    Step,
    Tangent,
    arclength_step,
    first_tangent,
    read_orbit,
)
from asperity.solve.continuation.line import Line
from asperity.solve.floquet import log_multipliers
from asperity.solve.mesh import Orbit

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


class Station(NamedTuple):
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
    point : Point
        From where the next step starts.
    """

    t: float
    direction: float
    mean_friction: float
    harmonics: NDArray[np.complex128]
    logs: NDArray[np.complex128]
    point: Point

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int((self.logs.real > 0).sum())


class Walker(NamedTuple):
    """A line of parameters, and what to read off each orbit on it."""

    line: Line
    harmonics: int

    def step(self, point: Point, length: float) -> tuple[Station | None, Step]:
        """The station at the distance `length` from `point`, None where Newton's method fails."""
        spare_mappings()
        inputs = (self.line, point, np.array([length]))
        step = _on_host(arclength_step(inputs, max_steps=_NEWTON_STEPS))
        if not step.error[0] < _CONVERGED:
            return None, step
        return self.station(step.orbit, step.next), step

    def station(self, orbit: Orbit, point: Point) -> Station:
        """Read off an orbit."""
        read = _on_host(read_orbit((self.line, orbit, point.t), harmonics=self.harmonics))
        logs = log_multipliers(read.monodromy, read.log_scale, read.log_determinant)
        return Station(
            float(point.t[0]),
            float(point.tangent.t[0]),
            float(read.mean_friction[0]),
            read.harmonics[:, 0],
            logs[:, 0],
            point,
        )

    def reaching(self, here: Station, length: float, t: float) -> tuple[Station, float] | None:
        """The station at the coordinate `t` passed within `length` of `here`, and its distance."""
        # Loading SciPy's optimisation would slow the start of a process that continues nothing.
        from scipy.optimize import brentq

        def beyond(distance: float) -> float:
            station, _ = self.step(here.point, distance)
            return np.nan if station is None else station.t - t

        try:
            distance = float(brentq(beyond, 0.0, length, xtol=1e-14, rtol=1e-14))
        except ValueError:
            return None
        station, _ = self.step(here.point, distance)
        return None if station is None else (station, distance)

    def begin(self, orbit: Orbit, t: float, intervals: int) -> Station | None:
        """The station of an orbit at `t` on a mesh of `intervals`, in the direction of rising t."""
        at = np.array([t])
        orbit = jax.jit(refined, static_argnums=3)(*self.line.at(at), orbit, intervals)
        bare = Point(orbit, at, Tangent(np.zeros_like(orbit.nodes), orbit.slopes, np.ones(1)))
        station = self.at(bare, t)
        if station is None:
            return None
        tangent = _on_host(first_tangent((self.line, station.point.orbit, at)))
        return station._replace(
            direction=float(tangent.t[0]), point=station.point._replace(tangent=tangent)
        )

    def at(self, point: Point, t: float) -> Station | None:
        """The station at the coordinate `t`, from the orbit of a point nearby."""
        # With this tangent the plane of the corrector is that of constant t.
        nodes = np.zeros_like(point.tangent.nodes)
        tangent = Tangent(nodes, np.zeros_like(point.tangent.slopes), np.ones(1))
        return self.step(Point(point.orbit, np.array([t]), tangent), 0.0)[0]

    def across(self, point: Point, t: float) -> Station | None:
        """The station in the plane across the branch of a point nearby, from the guess `t`."""
        return self.step(point._replace(t=np.array([t])), 0.0)[0]

    def finer(self, point: Point, intervals: int) -> Station | None:
        """The station in the plane across the branch at a point, on a mesh of `intervals`."""
        orbit = jax.jit(refined, static_argnums=3)(*self.line.at(point.t), point.orbit, intervals)
        nodes = point.tangent.nodes[:, :, 0]
        periodic = np.concatenate([nodes, nodes[:, :1]], axis=1)
        carried = np.stack(
            [np.interp(orbit.mesh[:-1, 0], point.orbit.mesh[:, 0], row) for row in periodic]
        )
        slopes = np.zeros(orbit.slopes.shape)  # not used by a step of no length
        tangent = Tangent(carried[..., None], slopes, point.tangent.t)
        return self.step(Point(orbit, point.t, tangent), 0.0)[0]


def reversed_point(point: Point) -> Point:
    """The same point, to be left in the other direction."""
    return point._replace(tangent=Tangent(*(-a for a in point.tangent)))


def walk(
    walker: Walker,
    start: Station,
    *,
    most_steps: int,
    first_step: float,
    ended: Callable[[Station], bool],
    met: Callable[[Station, float, Station], None],
) -> str:
    """Walk along a branch until `ended`, telling `met` of each stretch.

    Parameters
    ----------
    walker : Walker
    start : Station
    most_steps : int
    first_step : float
    ended : callable
        Whether a station lies beyond the end.
    met : callable
        Called with a station, the length of the step from it, and the next station.

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
            there, step = walker.step(here.point, length)
            if there is not None and step.turn[0] > _SHARPEST_TURN:
                break
            length *= _SHRINKAGE
            if length < _SHORTEST:
                return "stuck"
        met(here, length, there)
        if ended(there):
            return "ended"
        here = there
        iterations = int(step.iterations[0])
        if iterations <= _EASY:
            length *= _GROWTH
        elif iterations > _HARD:
            length *= _SHRINKAGE
    return "steps"


def _on_host(tree: Any) -> Any:
    return jax.tree.map(np.asarray, tree)
