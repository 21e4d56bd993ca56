"""Pseudo-arclength continuation of periodic orbits (Keller, 1977), one step of many branches.

The unknowns are an orbit X and the coordinate t of a line of parameters. From a point (X, t) of a
branch with tangent (X', t') the next one obeys the equations of the orbit and lies at the distance
ds along the tangent,

    <X', X - X_0> + t' (t - t_0) = ds,

which makes no difference between regular points and folds, where t turns back. The inner
product is the mean over the period, each state in units in which it changes the exponent of the
slip rate by one:

    <X, Y> = sum_k 1/(2 pi) int X_k Y_k / s_k^2 dtheta.

Source: H. B. Keller, in Applications of Bifurcation Theory (1977), 359-384; collocation with
an arclength condition as in E. J. Doedel et al., Int. J. Bifurcation Chaos 1, 745 (1991).

A branch is followed along a straight line through the space of all parameters. Every parameter x of
the equations and of the load depends on one coordinate t,

    x(t) = (x + a t) e^(g t),

evenly where a is given and by equal factors where g is. Which parameters move is data, not code, so
that one compiled program serves for all of them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import numpy as np

from asperity.arrays import Float
from asperity.orbit.mesh.equations import condensed
from asperity.orbit.mesh.mesh import STAGES, Orbit, on_mesh, spread
from asperity.orbit.mesh.newton import (
    ACCEPTED,
    TOLERANCE,
    Change,
    Plane,
    moved,
    newton_step,
    remeshed,
    solve_in_plane,
)
from asperity.slider.motion import Motion
from asperity.slider.pointwise import PointValues
from asperity.slider.problem import Problem


class ParameterLine(NamedTuple):
    """A line in the parameters of many operating points, NumPy arrays (points,).

    Attributes
    ----------
    origin : Problem
        Parameters at t = 0.
    added, growth : Problem
        The coefficients a and g of each parameter.
    """

    origin: Problem
    added: Problem
    growth: Problem

    def at(self, t: Float) -> Problem:
        """Parameters at the coordinate `t`, shape (points,)."""
        return jax.tree.map(lambda x, a, g: (x + a * t) * np.exp(g * t), *self)

    def slope(self, t: Float) -> Problem:
        """Derivatives of the parameters by t."""
        return jax.tree.map(lambda x, a, g: (a + g * (x + a * t)) * np.exp(g * t), *self)

    def with_slope(self, t: Float) -> tuple[Problem, Problem]:
        """Parameters at the coordinate `t`, and their derivatives."""
        return self.at(t), self.slope(t)


def still(problem: Problem) -> Problem:
    """Coefficients of a constant line."""
    return jax.tree.map(np.zeros_like, problem)


def amplitude_line(problem: Problem) -> ParameterLine:
    """From steady sliding at t = 0 to the requested modulation at t = 1."""
    origin = problem._replace(load=jax.tree.map(np.zeros_like, problem.load))
    added = still(problem)._replace(load=problem.load)
    return ParameterLine(origin, added, still(problem))


class ContinuationPoint(NamedTuple):
    """A point of a branch.

    Attributes
    ----------
    orbit : Orbit
        At the coordinate t.
    t : array, shape (points,)
    tangent : Change
        Direction of the branch: derivatives of nodes, slopes and t by the arclength.
    units : array, shape (n, points)
        1/s_k of the inner product: 1 for logarithms, 0 for states on which slip does not depend.
    """

    orbit: Orbit
    t: Float
    tangent: Change
    units: Float


def slip_units(system: Motion, values: PointValues) -> Float:
    """1/s_k, shape (n, points), from the equations at the collocation points."""
    units = np.abs(values.slip_gradient).mean((1, 2))
    return np.where(system.logarithms[:, None], 1.0, units)


def weighted_row(orbit: Orbit, nodes: Float, units: Float) -> Float:
    """The functional <X', .> on the changes of the nodes."""
    return orbit.widths / (2 * np.pi) * units[:, None] ** 2 * nodes


def first_point(line: ParameterLine, orbit: Orbit, t: Float) -> ContinuationPoint:
    """A regular point of a branch, with its tangent in the direction of rising t."""
    return turned(line, orbit, t, np.zeros_like(orbit.nodes), np.ones_like(t))[0]


def turned(
    line: ParameterLine, orbit: Orbit, t: Float, before: Float, before_t: Float
) -> tuple[ContinuationPoint, Float, Float]:
    """A new point with the tangent that continues the tangent before, of nodes and t.

    Also returned are the cosine of the angle between the two tangents, and the largest exponent of
    the slip rate, both (points,).
    """
    with np.errstate(all="ignore"):
        equations = condensed(line.at(t), orbit, line.slope(t), closed=False)
        units = slip_units(line.origin.system, equations.values)
        row = weighted_row(orbit, before, units)
        plane = Plane(row, before_t)
        # The change that leaves the plane forwards, reduced to unit length.
        raw = newton_step(line.origin.system, equations, orbit, plane, 1.0, closed=False).change
        square = (weighted_row(orbit, raw.nodes, units) * raw.nodes).sum((0, 1)) + raw.t**2
        tangent = Change(*(a / np.sqrt(square) for a in raw))
        size = np.sqrt((row * before).sum((0, 1)) + before_t**2)
        cosine = ((row * tangent.nodes).sum((0, 1)) + before_t * tangent.t) / size
        fastest = equations.values.log_slip.max((0, 1))
    return ContinuationPoint(orbit, t, tangent, units), cosine, fastest


def interpolated(nodes: Float, old: Float, new: Float) -> Float:
    """Values at the nodes of one mesh carried over to another, linearly."""
    closed = np.concatenate([nodes, nodes[:, :1]], axis=1)
    result = np.empty((len(nodes), len(new) - 1, nodes.shape[2]))
    for i, b in np.ndindex(len(nodes), nodes.shape[2]):
        result[i, :, b] = np.interp(new[:-1, b], old[:, b], closed[i, :, b])
    return result


#: Smallest ratio of the predicted width of an interval to its present width.
_NARROWEST = 0.3


class PointPair(NamedTuple):
    """Two successive points of a branch, the first without its tangent."""

    before: Orbit
    t_before: Float
    point: ContinuationPoint


class BranchStep(NamedTuple):
    """One step along each of several branches.

    Attributes
    ----------
    orbit : Orbit
        The orbit at the new point, on the predicted mesh.
    next : PointPair
        The old point, and the new one on a mesh made for it.
    error : array, shape (points,)
        Last change in Newton's method, inf where the step failed.
    iterations : array, shape (points,)
    turn : array, shape (points,)
        Cosine of the angle between the tangents before and after.
    miss : array, shape (points,)
        Distance of the new point from the predicted one, in steps.
    length : array, shape (points,)
        Distance of the new point from the previous point, for each interval.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the new orbit.
    """

    orbit: Orbit
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
    return now._replace(
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

    Along a branch this mesh changes as smoothly as the orbit does, so that it can be extrapolated;
    a mesh that spreads an error estimate evenly does not.
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


class Remeshing(NamedTuple):
    """How a new point gets its mesh.

    Attributes
    ----------
    moves : bool
        Whether the mesh moves with the orbit, as `relaid` lays it, so that the next step can
        extrapolate the phases of each interval. Otherwise the mesh spreads the error evenly.
    tolerance, accepted : float
        Change at which Newton's method ends, and largest last change of a step that counts.
    """

    moves: bool
    tolerance: float
    accepted: float


#: Of branches whose orbits are results, and of branches followed to an initial guess: there the
#: error, about the square of the change, is that of the next search.
EQUIDISTRIBUTED = Remeshing(moves=False, tolerance=TOLERANCE, accepted=ACCEPTED)
MOVING = Remeshing(moves=True, tolerance=1e-5, accepted=1e-5)


# Under slow modulation the orbit follows an unstable state of sliding for part of the period and
# leaves it in a jump (a canard). Along the branch the jump moves through the period, while the
# parameter hardly changes. At a fixed phase the states then change strongly; at a fixed interval of
# a mesh that moves with the orbit they hardly change. The prediction therefore extrapolates the
# states and the phases of each interval from the last two points.


def branch_step(
    line: ParameterLine, pair: PointPair, ratio: Float, *, remeshing: Remeshing, max_steps: int
) -> BranchStep:
    """One step of `ratio` times the last one along each branch."""
    point = pair.point
    tangent, units = point.tangent, point.units
    with np.errstate(all="ignore"):
        guess, t_guess = _predicted(pair, ratio)
        plane = Plane(weighted_row(guess, tangent.nodes, units), tangent.t)
        tolerance = remeshing.tolerance
        result = solve_in_plane(
            line.with_slope, guess, t_guess, plane, max_steps=max_steps, tolerance=tolerance
        )
        orbit, t = result.orbit, result.t
        before: Any = tangent.nodes
        if remeshing.moves:
            new = relaid(orbit, units)
        else:
            new = remeshed(line.at(t), orbit, len(orbit.mesh) - 1)
            before = interpolated(before, orbit.mesh, new.mesh)
        following, cosine, fastest = turned(line, new, t, before, tangent.t)
        step = _distance(units, guess, t_guess, point.orbit, point.t)
        t_slope = following.tangent.t
        forward = ratio * (t - point.t) * (tangent.t + t_slope)
        # A step that is shorter than round-off, towards a bifurcation, may seem to go backward.
        backward = remeshing.moves & (tangent.t * t_slope > 0) & (forward < 0)
        miss = _distance(units, orbit, t, guess, t_guess) / step
        length = _distance(units, new, t, point.orbit, point.t)
        fine = np.isfinite(new.slopes).all((0, 1, 2)) & np.isfinite(cosine) & ~backward
        error = np.where(fine & (result.error <= remeshing.accepted), result.error, np.inf)
    moved_on = PointPair(point.orbit, point.t, following)
    return BranchStep(orbit, moved_on, error, result.steps, cosine, miss, length, fastest)
