"""Steps along branches of orbits whose sharp parts move: prediction on a moving mesh.

Under slow modulation the orbit follows an unstable state of sliding for part of the period and
leaves it in a jump (a canard). Along the branch the jump moves through the period, while the
parameter hardly changes. At a fixed phase the states then change strongly; at a fixed interval of a
mesh that moves with the orbit they hardly change. The prediction therefore extrapolates the states
and the phases of each interval from the last two points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.mesh.mesh import STAGES, Orbit, on_mesh, spread
from asperity.orbit.mesh.newton import Plane, moved
from asperity.orbit.methods.branch_following.arclength import (
    ContinuationPoint,
    ParameterLine,
    correct,
    turned,
    usable,
    weighted_row,
)

Float = NDArray[np.float64]

#: Newton's method ends and a step is accepted at this change; the error is about its square.
ACCEPTED = 1e-5
#: Smallest ratio of the predicted width of an interval to its present width.
_NARROWEST = 0.3


class PointPair(NamedTuple):
    """Two successive points of a branch, the first without its tangent."""

    before: Orbit
    t_before: Float
    point: ContinuationPoint


class MovingMeshStep(NamedTuple):
    """One step on the moving mesh.

    Attributes
    ----------
    next : PointPair
    error, iterations : array, shape (points,)
        As in `ArclengthStep`.
    turn : array, shape (points,)
        Cosine of the angle between the tangents before and after.
    miss : array, shape (points,)
        Distance of the new point from the predicted one, in steps.
    length : array, shape (points,)
        Distance of the new point from the previous point, for each interval.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the new orbit.
    """

    next: PointPair
    error: Float
    iterations: Float
    turn: Float
    miss: Float
    length: Float
    fastest: Float


def _predicted(pair: PointPair, ratio: Float) -> tuple[Orbit, Float]:
    """Extrapolation by `ratio` times the last step."""
    before, now = pair.before, pair.point.orbit
    longer = now.widths + ratio * (now.widths - before.widths)
    widths = np.maximum(longer, _NARROWEST * now.widths)
    widths = widths * (2 * np.pi / widths.sum(0))
    mesh = np.concatenate([np.zeros_like(widths[:1]), np.cumsum(widths, axis=0)])
    mesh[-1] = 2 * np.pi
    rises = now.slopes * now.widths
    rises = rises + ratio * (rises - before.slopes * before.widths)
    return now.moved(
        mesh=mesh,
        centre=now.centre + ratio * (now.centre - before.centre),
        nodes=now.nodes + ratio * (now.nodes - before.nodes),
        slopes=rises / np.diff(mesh, axis=0),
    ), pair.point.t + ratio * (pair.point.t - pair.t_before)


def _distance(units: Float, a: Orbit, s: Float, b: Orbit, t: Float) -> Float:
    """Distance interval by interval, of states, phases and coordinate."""
    states = (a.centre - b.centre)[:, None] + a.nodes - b.nodes
    square = ((units[:, None] * states) ** 2).sum(0).mean(0)
    return np.sqrt(square + ((a.mesh - b.mesh) ** 2).mean(0) + (s - t) ** 2)


def relaid(orbit: Orbit, units: Float) -> Orbit:
    """The orbit on a mesh with intervals of equal length in the space of phase and states.

    Other than a mesh that spreads an error estimate it changes as smoothly as the orbit does, which
    extrapolation lives on.
    """
    widths = orbit.widths
    rises = widths * np.abs(orbit.slopes).mean(1) * units[:, None]
    top = np.einsum("k,nkmb->nmb", orbit.scheme.top, orbit.slopes)
    local = (np.abs(top) * widths * units[:, None]).max(0)
    error = (local + 1e-10) ** (1 / (STAGES + 1))
    for _ in range(2):
        error = (np.roll(error, 1, 0) + 2 * error + np.roll(error, -1, 0)) / 4
    length = np.sqrt(widths**2 + (rises**2).sum(0))
    density = sum(a / a.sum(0) for a in (error, length, widths)) / widths
    return on_mesh(orbit, spread(orbit.mesh, density, len(widths), smoothings=3))


def straight(point: ContinuationPoint, length: Float) -> PointPair:
    """A pair that extrapolates along the tangent, by the given length."""
    return PointPair(*moved(point.orbit, point.t, point.tangent, -length), point)


def moving_step(
    line: ParameterLine, pair: PointPair, ratio: Float, *, max_steps: int
) -> MovingMeshStep:
    """One step of `ratio` times the last one along each branch."""
    point = pair.point
    tangent, units = point.tangent, point.units
    with np.errstate(all="ignore"):
        guess, t_guess = _predicted(pair, ratio)
        plane = Plane(weighted_row(guess, tangent.nodes, units), tangent.t)
        result = correct(line, guess, t_guess, plane, max_steps=max_steps, tolerance=ACCEPTED)
        orbit, t = result.orbit, result.t
        new = relaid(orbit, units)
        turn = turned(line, new, t, tangent.nodes, tangent.t)
        step = _distance(units, guess, t_guess, point.orbit, point.t)
        t_slope = turn.point.tangent.t
        forward = ratio * (t - point.t) * (tangent.t + t_slope)
        backward = (tangent.t * t_slope > 0) & (forward < 0)
        miss = _distance(units, orbit, t, guess, t_guess) / step
        length = _distance(units, new, t, point.orbit, point.t)
        fine = usable(new, turn.cosine) & ~backward
        error = np.where(fine & (result.error <= ACCEPTED), result.error, np.inf)
        fastest = turn.values.log_slip.max((0, 1))
    following = PointPair(point.orbit, point.t, turn.point)
    return MovingMeshStep(following, error, result.steps, turn.cosine, miss, length, fastest)
