"""Steps along branches of orbits whose sharp parts move: prediction on a moving mesh.

Under slow modulation the orbit follows an unstable state of sliding for part of the period and
leaves it in a jump (a canard). Along the branch the jump moves through the period, while the
parameter hardly changes. At a fixed phase that is a violent change, at a fixed interval
of a mesh that moves with the orbit it is none: so the change from the last point to this one is
extrapolated interval by interval, phases included.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import spectral_abscissa
from asperity.orbit.mesh.condensation import localise
from asperity.orbit.mesh.mesh import Orbit, on_mesh
from asperity.orbit.mesh.scheme import STAGES
from asperity.orbit.methods.branch_following.arclength import (
    ContinuationPoint,
    along,
    correct,
    slip_units,
    turned_tangent,
    usable,
    weighted_row,
)
from asperity.orbit.methods.branch_following.parameter_line import ParameterLine

#: Change at which Newton's method ends and a step is accepted: the error is about its square.
ACCEPTED = 1e-5
#: Cosine of the turn of the tangent below which the direction of the branch is not known.
_SHARPEST_TURN = 0.3
#: Narrowest an interval may be predicted, in parts of what it is.
_NARROWEST = 0.3


class PointPair(NamedTuple):
    """Two successive points of a branch, the first without its tangent."""

    before: Orbit
    t_before: Array
    point: ContinuationPoint


class MovingMeshStep(NamedTuple):
    """One step on the moving mesh.

    Attributes
    ----------
    next : PointPair
    error, iterations : array, shape (points,)
        As in `ArclengthStep`.
    miss : array, shape (points,)
        Distance of the new point from the predicted one, in steps.
    length : array, shape (points,)
        Distance of the new point from the one before, interval by interval.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the new orbit.
    """

    next: PointPair
    error: Array
    iterations: Array
    miss: Array
    length: Array
    fastest: Array


def _predicted(pair: PointPair, ratio: Array) -> tuple[Orbit, Array]:
    """Extrapolation by `ratio` times the last step."""
    before, now = pair.before, pair.point.orbit
    widths = now.widths + ratio * (now.widths - before.widths)
    widths = jnp.maximum(widths, _NARROWEST * now.widths)
    widths = widths * (2 * jnp.pi / widths.sum(0))
    mesh = jnp.concatenate([jnp.zeros_like(widths[:1]), jnp.cumsum(widths, axis=0)])
    mesh = mesh.at[-1].set(2 * jnp.pi)
    rises = now.slopes * now.widths
    rises = rises + ratio * (rises - before.slopes * before.widths)
    return now.moved(
        mesh=mesh,
        centre=now.centre + ratio * (now.centre - before.centre),
        nodes=now.nodes + ratio * (now.nodes - before.nodes),
        slopes=rises / jnp.diff(mesh, axis=0),
    ), pair.point.t + ratio * (pair.point.t - pair.t_before)


def _distance(units: Array, a: Orbit, s: Array, b: Orbit, t: Array) -> Array:
    """Distance interval by interval, of states, phases and coordinate."""
    states = (a.centre - b.centre)[:, None] + a.nodes - b.nodes
    square = ((units[:, None] * states) ** 2).sum(0).mean(0)
    return jnp.sqrt(square + ((a.mesh - b.mesh) ** 2).mean(0) + (s - t) ** 2)


def fastest_slip(line: ParameterLine, orbit: Orbit, t: Array) -> Array:
    """Largest ln(v_pl/V) at the collocation points."""
    system, load = line.at(t)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    return system.log_slip(states, load.at(orbit.stage_phases)).max((0, 1))


@jit_large
def growth_within(inputs: tuple[ParameterLine, Orbit, Array]) -> Array:
    """Integral of the growth rate of disturbances over the part of the period where they grow.

    From the eigenvalues of the Jacobian along the orbit: what it is where the orbit changes slowly.
    """
    line, orbit, t = inputs
    local = localise(*line.at(t), orbit)
    weights = jnp.asarray(orbit.scheme.b)[:, None, None] * orbit.widths
    return (weights * jnp.maximum(spectral_abscissa(local.jacobian), 0.0)).sum((0, 1))


def relaid(orbit: Orbit, units: Array) -> Orbit:
    """The orbit on a mesh with intervals of equal length in the space of phase and states.

    Other than a mesh that spreads an error estimate it changes as smoothly as the orbit does, which
    extrapolation lives on.
    """
    widths = orbit.widths
    rises = widths * jnp.abs(orbit.slopes).mean(1) * units[:, None]
    top = jnp.einsum("k,nkmb->nmb", orbit.scheme.top, orbit.slopes)
    local = (jnp.abs(top) * widths * units[:, None]).max(0)
    error = (local + 1e-10) ** (1 / (STAGES + 1))
    for _ in range(2):
        error = (jnp.roll(error, 1, 0) + 2 * error + jnp.roll(error, -1, 0)) / 4
    length = jnp.sqrt(widths**2 + (rises**2).sum(0))
    density = sum(a / a.sum(0) for a in (error, length, widths)) / widths
    for _ in range(3):
        density = (jnp.roll(density, 1, 0) + 2 * density + jnp.roll(density, -1, 0)) / 4
    mass = jnp.cumsum(density * orbit.widths, axis=0)
    mass = jnp.concatenate([jnp.zeros_like(mass[:1]), mass]) / mass[-1]
    share = jnp.linspace(0.0, 1.0, orbit.mesh.shape[0])
    mesh = jax.vmap(lambda m, t: jnp.interp(share, m, t), (1, 1), 1)(mass, orbit.mesh)
    return on_mesh(orbit, mesh.at[0].set(0.0).at[-1].set(2 * jnp.pi))


@jax.jit
def straight(inputs: tuple[ParameterLine, ContinuationPoint, Array]) -> PointPair:
    """A pair that extrapolates along the tangent, by the given length."""
    _, point, length = inputs
    before, t = along(point.orbit, point.t, point.tangent, -length)
    return PointPair(before, t, point)


@partial(jit_large, static_argnames=("max_steps",))
def moving_step(
    inputs: tuple[ParameterLine, PointPair, Array], *, max_steps: int
) -> MovingMeshStep:
    """One step of `ratio` times the last one along each branch."""
    line, pair, ratio = inputs
    point = pair.point
    guess, t_guess = _predicted(pair, ratio)
    units = slip_units(line, point.orbit, point.t)
    row = weighted_row(guess, point.tangent.nodes, units)
    orbit, t, error, iterations = correct(
        line, guess, t_guess, row, point.tangent.t, max_steps=max_steps, tolerance=ACCEPTED
    )
    there = relaid(orbit, units)
    tangent, turn = turned_tangent(line, there, t, point.tangent.nodes, point.tangent.t)
    step = _distance(units, guess, t_guess, point.orbit, point.t)
    forward = ratio * (t - point.t) * (point.tangent.t + tangent.t)
    backward = (point.tangent.t * tangent.t > 0) & (forward < 0)
    miss = _distance(units, orbit, t, guess, t_guess) / step
    length = _distance(units, there, t, point.orbit, point.t)
    fine = usable(there, turn) & (turn > _SHARPEST_TURN) & ~backward
    error = jnp.where(fine & (error <= ACCEPTED), error, jnp.inf)
    following = PointPair(point.orbit, point.t, ContinuationPoint(there, t, tangent))
    return MovingMeshStep(following, error, iterations, miss, length, fastest_slip(line, there, t))
