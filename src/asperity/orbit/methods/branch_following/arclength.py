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
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.cyclic import Border, solve_bordered
from asperity.algebra.small_systems import jacobian_columns
from asperity.orbit.mesh.condensation import (
    LinearisedEquations,
    condense,
    localise,
    transfer_maps,
)
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import (
    collocation_observables,
    refined,
    swing_change,
)
from asperity.orbit.mesh.programs import ACCEPTED
from asperity.orbit.methods.branch_following.parameter_line import ParameterLine
from asperity.orbit.newton_step import exponent_change
from asperity.orbit.observables import Observables
from asperity.slider import Motion

#: Bound on the change of an exponent or logarithmic state in a Newton step. Larger changes happen
#: only where the step along the branch is too long.
_LARGEST_CHANGE = 2.0
_NEWTON_TOLERANCE = 1e-8


class Tangent(NamedTuple):
    """Direction of a branch: derivatives of nodes, slopes and coordinate by the arclength."""

    nodes: Array
    slopes: Array
    t: Array


class ContinuationPoint(NamedTuple):
    """A point of a branch: the orbit at the coordinate t, and the direction of the branch there."""

    orbit: Orbit
    t: Array
    tangent: Tangent


class ArclengthStep(NamedTuple):
    """One step along a branch.

    Attributes
    ----------
    orbit : Orbit
        The orbit at the new point, on the mesh of the old one.
    next : ContinuationPoint
        The same on a mesh made for it, with its tangent.
    error : array, shape (points,)
        Last change in Newton's method, inf where it was not finite.
    iterations : array, shape (points,)
    turn : array, shape (points,)
        Cosine of the angle between the tangents before and after.
    """

    orbit: Orbit
    next: ContinuationPoint
    error: Array
    iterations: Array
    turn: Array


def slip_units(line: ParameterLine, orbit: Orbit, t: Array) -> Array:
    """1/s_k, shape (n, points): 1 for logarithms, 0 for states on which slip does not depend."""
    system, load = line.at(t)
    at = load.at(orbit.stage_phases)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    _, sensitivity = jacobian_columns(lambda Y: system.log_slip(Y, at)[None], states)
    slopes = [jnp.abs(s[0]).mean((0, 1)) for s in sensitivity]
    linear = system.linear
    return jnp.stack([s if i in linear else jnp.ones_like(s) for i, s in enumerate(slopes)])


def weighted_row(orbit: Orbit, nodes: Array, units: Array) -> Array:
    """The functional <X', .> on the changes of the nodes."""
    return orbit.widths / (2 * jnp.pi) * units[:, None] ** 2 * nodes


def _parameter_rates(
    line: ParameterLine, orbit: Orbit, local: LinearisedEquations, t: Array
) -> Array:
    """Derivative of the rates by t at the collocation points."""
    theta = orbit.stage_phases

    def rates(t: Array) -> Array:
        system, load = line.at(t)
        return system.rates(local.states, load.at(theta))

    return jax.jvp(rates, (t,), (jnp.ones_like(t),))[1]


def _solve(
    line: ParameterLine,
    orbit: Orbit,
    t: Array,
    row: Array,
    corner: Array,
    value: Array,
    *,
    newton: bool,
) -> tuple[LinearisedEquations, Tangent]:
    """Changes that obey the linearised equations, or, without `newton`, keep to their solution."""
    local = localise(*line.at(t), orbit)
    defect = local.rates - orbit.slopes
    if not newton:
        defect = jnp.zeros_like(defect)
    column = _parameter_rates(line, orbit, local, t)
    response, constant, column = condense(local, orbit, defect, column)
    rise = orbit.widths * jnp.einsum("k,nkmb->nmb", orbit.scheme.b, constant)
    if newton:
        rise += orbit.widths * jnp.einsum("k,nkmb->nmb", orbit.scheme.b, orbit.slopes)
        rise -= jnp.roll(orbit.nodes, -1, axis=1) - orbit.nodes
    gain = orbit.widths * jnp.einsum("k,nkmb->nmb", orbit.scheme.b, column)
    border = Border(gain, row, corner, value)
    nodes, change = solve_bordered(transfer_maps(response, orbit), rise, border)
    slopes = jnp.einsum("nkcmb,cmb->nkmb", response, nodes) + constant + column * change
    return local, Tangent(nodes, slopes, change)


def along(orbit: Orbit, t: Array, change: Tangent, length: Array) -> tuple[Orbit, Array]:
    """The orbit and coordinate changed by `length` times `change`."""
    nodes = orbit.nodes + length * change.nodes
    centre = orbit.centre + nodes[:, 0]
    slopes = orbit.slopes + length * change.slopes
    return orbit.moved(centre=centre, nodes=nodes - nodes[:, :1], slopes=slopes), (
        t + length * change.t
    )


def _unit_tangent(
    line: ParameterLine, orbit: Orbit, t: Array, row: Array, corner: Array, units: Array
) -> Tangent:
    _, raw = _solve(line, orbit, t, row, corner, jnp.ones_like(t), newton=False)
    square = (weighted_row(orbit, raw.nodes, units) * raw.nodes).sum((0, 1)) + raw.t**2
    return Tangent(*(a / jnp.sqrt(square) for a in raw))


@jit_large
def first_tangent(line_and_point: tuple[ParameterLine, Orbit, Array]) -> Tangent:
    """Direction of rising t at a regular point of a branch."""
    line, orbit, t = line_and_point
    none = jnp.zeros_like(orbit.nodes)
    return _unit_tangent(line, orbit, t, none, jnp.ones_like(t), slip_units(line, orbit, t))


def correct(
    line: ParameterLine,
    guess: Orbit,
    t: Array,
    row: Array,
    corner: Array,
    *,
    max_steps: int,
    tolerance: float = _NEWTON_TOLERANCE,
) -> tuple[Orbit, Array, Array, Array]:
    """Newton's method on the plane through (guess, t) across (row, corner).

    It ends with a change below `tolerance`; the error is about its square. Returns orbit, t,
    the last change (inf where it is not finite) and the number of steps.
    """

    def body(carry: tuple) -> tuple:
        orbit, t, error, count = carry
        # The first guess lies in the plane, and every change keeps it there.
        local, change = _solve(line, orbit, t, row, corner, jnp.zeros_like(t), newton=True)
        system = line.at(t).system
        largest, error_now = _sizes(system, local, orbit, change)
        damping = jnp.minimum(1.0, _LARGEST_CHANGE / jnp.where(largest > 0, largest, 1.0))
        damping = jnp.where(error > tolerance, damping, 0.0)
        orbit_now, t_now = along(orbit, t, change, damping)
        count = count + (error > tolerance)
        error_now = jnp.where(jnp.isfinite(error_now), error_now, jnp.inf)
        return orbit_now, t_now, jnp.where(error > tolerance, error_now, error), count

    def unfinished(carry: tuple) -> Array:
        _, _, error, count = carry
        return jnp.any((error > tolerance) & (count < max_steps))

    start = (guess, t, jnp.full(t.shape, jnp.inf), jnp.zeros(t.shape, int))
    return jax.lax.while_loop(unfinished, body, start)


def _sizes(
    system: Motion, local: LinearisedEquations, orbit: Orbit, change: Tangent
) -> tuple[Array, Array]:
    """Largest change of an exponent or logarithm, and the same with forces over their swing."""
    stages = change.nodes[:, None] + orbit.widths * orbit.stage_sums(change.slopes)
    largest = exponent_change(system, local.at, local.states, stages).max((0, 1))
    relative = swing_change(system, orbit, stages)
    error = jnp.maximum(jnp.maximum(largest, relative), jnp.abs(change.t))
    return largest, error


def _interpolated(nodes: Array, old: Array, new: Array) -> Array:
    """Values at the nodes of one mesh carried over to another, linearly."""
    closed = jnp.concatenate([nodes, nodes[:, :1]], axis=1)

    def one(x: Array, xp: Array, fp: Array) -> Array:
        return jnp.interp(x, xp, fp)

    over_points = jax.vmap(one, (1, 1, 1), 1)
    return jax.vmap(over_points, (None, None, 0))(new[:-1], old, closed)


@partial(jit_large, static_argnames=("max_steps",))
def arclength_step(
    inputs: tuple[ParameterLine, ContinuationPoint, Array], *, max_steps: int
) -> ArclengthStep:
    """One step of the given length along each branch; it counts where `error` is small."""
    line, point, length = inputs
    guess, t = along(point.orbit, point.t, point.tangent, length)
    row = weighted_row(point.orbit, point.tangent.nodes, slip_units(line, point.orbit, point.t))
    orbit, t, error, iterations = correct(line, guess, t, row, point.tangent.t, max_steps=max_steps)
    intervals = orbit.mesh.shape[0] - 1
    there = refined(*line.at(t), orbit, intervals)
    before = _interpolated(point.tangent.nodes, orbit.mesh, there.mesh)
    tangent, turn = turned_tangent(line, there, t, before, point.tangent.t)
    error = jnp.where(usable(there, turn) & (error < ACCEPTED), error, jnp.inf)
    return ArclengthStep(orbit, ContinuationPoint(there, t, tangent), error, iterations, turn)


def turned_tangent(
    line: ParameterLine, orbit: Orbit, t: Array, before: Array, before_t: Array
) -> tuple[Tangent, Array]:
    """The tangent that continues the one `before` (nodes, t), and the cosine of their angle."""
    units = slip_units(line, orbit, t)
    row = weighted_row(orbit, before, units)
    tangent = _unit_tangent(line, orbit, t, row, before_t, units)
    size = jnp.sqrt((row * before).sum((0, 1)) + before_t**2)
    return tangent, ((row * tangent.nodes).sum((0, 1)) + before_t * tangent.t) / size


def usable(orbit: Orbit, turn: Array) -> Array:
    """Whether a new mesh and tangent are finite."""
    return jnp.isfinite(orbit.slopes).all((0, 1, 2)) & jnp.isfinite(turn)


@partial(jit_large, static_argnames=("harmonics",))
def read_orbit(inputs: tuple[ParameterLine, Orbit, Array], *, harmonics: int) -> Observables:
    """Observables of the orbit at the coordinate t."""
    line, orbit, t = inputs
    return collocation_observables(*line.at(t), orbit, harmonics=harmonics)
