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

from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Float
from asperity.orbit.mesh.equations import CondensedEquations, condensed
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import (
    ACCEPTED,
    TOLERANCE,
    Change,
    NewtonResult,
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


class ArclengthStep(NamedTuple):
    """A step along a branch.

    Attributes
    ----------
    orbit : Orbit
        The orbit at the new point, on the mesh of the old one.
    next : ContinuationPoint
        The orbit on an equidistributed mesh, with its tangent.
    error : array, shape (points,)
        Last change in Newton's method, inf where it was not finite.
    iterations : array, shape (points,)
    turn : array, shape (points,)
        Cosine of the angle between the tangents before and after.
    """

    orbit: Orbit
    next: ContinuationPoint
    error: Float
    iterations: NDArray[np.int_]
    turn: Float


def slip_units(system: Motion, values: PointValues) -> Float:
    """1/s_k, shape (n, points), from the equations at the collocation points."""
    units = np.abs(values.slip_gradient).mean((1, 2))
    logarithmic = ~np.isin(np.arange(len(units)), system.linear)
    return np.where(logarithmic[:, None], 1.0, units)


def weighted_row(orbit: Orbit, nodes: Float, units: Float) -> Float:
    """The functional <X', .> on the changes of the nodes."""
    return orbit.widths / (2 * np.pi) * units[:, None] ** 2 * nodes


def correct(
    line: ParameterLine,
    guess: Orbit,
    t: Float,
    plane: Plane,
    *,
    max_steps: int,
    tolerance: float = TOLERANCE,
) -> NewtonResult:
    """Newton's method on a plane through (guess, t) across a branch."""
    return solve_in_plane(
        lambda t: (line.at(t), line.slope(t)),
        guess,
        t,
        plane,
        max_steps=max_steps,
        tolerance=tolerance,
    )


class Turn(NamedTuple):
    """The tangent at a new point.

    Attributes
    ----------
    point : ContinuationPoint
    values : PointValues
        The equations at its collocation points.
    cosine : array, shape (points,)
        Cosine of the angle with the tangent before.
    """

    point: ContinuationPoint
    values: PointValues
    cosine: Float


def first_point(line: ParameterLine, orbit: Orbit, t: Float) -> ContinuationPoint:
    """A regular point of a branch, with its tangent in the direction of rising t."""
    with np.errstate(all="ignore"):
        equations = condensed(line.at(t), orbit, line.slope(t), closed=False)
        units = slip_units(line.origin.system, equations.values)
        plane = Plane.of_fixed_parameters(orbit)
        tangent = _unit_tangent(line, orbit, equations, plane, units)
    return ContinuationPoint(orbit, t, tangent, units)


def turned(line: ParameterLine, orbit: Orbit, t: Float, before: Float, before_t: Float) -> Turn:
    """A new point with the tangent that continues the one `before` (nodes, t)."""
    with np.errstate(all="ignore"):
        equations = condensed(line.at(t), orbit, line.slope(t), closed=False)
        units = slip_units(line.origin.system, equations.values)
        row = weighted_row(orbit, before, units)
        tangent = _unit_tangent(line, orbit, equations, Plane(row, before_t), units)
        size = np.sqrt((row * before).sum((0, 1)) + before_t**2)
        cosine = ((row * tangent.nodes).sum((0, 1)) + before_t * tangent.t) / size
    return Turn(ContinuationPoint(orbit, t, tangent, units), equations.values, cosine)


def _unit_tangent(
    line: ParameterLine,
    orbit: Orbit,
    equations: CondensedEquations,
    plane: Plane,
    units: Float,
) -> Change:
    """The direction along the branch, of unit length, that leaves the plane forwards."""
    step = newton_step(line.origin.system, equations, orbit, plane, 1.0, closed=False)
    raw = step.change
    square = (weighted_row(orbit, raw.nodes, units) * raw.nodes).sum((0, 1)) + raw.t**2
    return Change(*(a / np.sqrt(square) for a in raw))


def interpolated(nodes: Float, old: Float, new: Float) -> Float:
    """Values at the nodes of one mesh carried over to another, linearly."""
    closed = np.concatenate([nodes, nodes[:, :1]], axis=1)
    result = np.empty((len(nodes), len(new) - 1, nodes.shape[2]))
    for i, b in np.ndindex(len(nodes), nodes.shape[2]):
        result[i, :, b] = np.interp(new[:-1, b], old[:, b], closed[i, :, b])
    return result


def arclength_step(
    line: ParameterLine, point: ContinuationPoint, length: Float, *, max_steps: int
) -> ArclengthStep:
    """A step of the length `length` along each branch; valid where `error` is small."""
    with np.errstate(all="ignore"):
        guess, t = moved(point.orbit, point.t, point.tangent, length)
        plane = Plane(weighted_row(point.orbit, point.tangent.nodes, point.units), point.tangent.t)
        result = correct(line, guess, t, plane, max_steps=max_steps)
        orbit, t = result.orbit, result.t
        equidistributed = remeshed(line.at(t), orbit, len(orbit.mesh) - 1)
        before = interpolated(point.tangent.nodes, orbit.mesh, equidistributed.mesh)
        turn = turned(line, equidistributed, t, before, point.tangent.t)
        good = usable(equidistributed, turn.cosine) & (result.error < ACCEPTED)
    error = np.where(good, result.error, np.inf)
    return ArclengthStep(orbit, turn.point, error, result.steps, turn.cosine)


def usable(orbit: Orbit, cosine: Float) -> Bool:
    """Whether a new mesh and tangent are finite."""
    return np.isfinite(orbit.slopes).all((0, 1, 2)) & np.isfinite(cosine)
