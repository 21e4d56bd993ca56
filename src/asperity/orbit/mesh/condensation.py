"""Collocation on one interval: linearised at its collocation points, condensed to a transfer map.

The response of the slopes at the collocation points to a change at the left node of an interval
is a small dense system. Solved interval by interval it leaves equations for the nodes alone.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.algebra.runge_kutta import CollocationScheme
from asperity.algebra.small_systems import inverse_points, jacobian_columns, product
from asperity.loads import Excitation, Modulation
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.scheme import STAGES
from asperity.slider import Motion

#: Entries of small matrices that are eliminated at a time: they fit into a core's cache.
_CACHED = 20_000


class LinearisedEquations(NamedTuple):
    """The equations at the collocation points."""

    at: Excitation
    states: Array
    rates: Array
    jacobian: Array  # (row, column, STAGES, intervals, points)


def localise(system: Motion, load: Modulation, orbit: Orbit) -> LinearisedEquations:
    """The equations and their derivatives at the collocation points of an orbit."""
    theta = orbit.stage_phases
    at = load.at(theta)
    states = orbit.centre[:, None, None] + orbit.stage_deviations
    rates, columns = jacobian_columns(lambda Y: system.rates(Y, at), states)
    return LinearisedEquations(at, states, rates, jnp.stack(columns, axis=1))


def condense(local: LinearisedEquations, orbit: Orbit, *right: Array) -> list[Array]:
    """Slopes at the stages as a linear function of the state at the left node.

    Returns the matrix (n, STAGES, n, intervals, points) and for each right-hand side, of shape
    (n, STAGES, intervals, points), the constant part of the change of the slopes.
    """
    solve = partial(_condense, scheme=orbit.scheme)
    constants = jnp.stack(right) if right else jnp.zeros((0, *local.rates.shape))
    whole = (local.jacobian, constants, orbit.widths)
    n, (intervals, points) = local.rates.shape[0], orbit.widths.shape
    entries = STAGES * n * ((STAGES + 1) * n + len(right)) * points
    divisors = (k for k in range(1, intervals) if _fits(intervals, k, entries))
    blocks = next(divisors, intervals)
    if blocks == 1:
        solution = solve(whole)
    else:
        # Block by block, so that the elimination stays within a core's cache.
        cut = (blocks, intervals // blocks, points)
        parts = tuple(jnp.moveaxis(a.reshape(*a.shape[:-2], *cut), -3, 0) for a in whole)
        solved = jax.lax.map(solve, parts)
        solution = jnp.moveaxis(solved, 0, -3).reshape(n, STAGES, -1, intervals, points)
    return [solution[:, :, :n], *(solution[:, :, n + i] for i in range(len(right)))]


def _fits(intervals: int, blocks: int, entries: int) -> bool:
    """Whether an equal share of the intervals, of so many entries each, fits into the cache."""
    return intervals % blocks == 0 and intervals // blocks * entries <= _CACHED


def _condense(part: tuple[Array, Array, Array], *, scheme: CollocationScheme) -> Array:
    """The same of some intervals; (n, STAGES, n + right-hand sides, intervals, points)."""
    jacobian, constants, widths = part
    n = jacobian.shape[0]
    per_stage = jnp.transpose(jacobian, (2, 0, 1, 3, 4))  # (stage, row, column, ...)
    right = jnp.transpose(constants, (2, 1, 0, 3, 4))
    # Row blocks (I - h a_jk J_j | J_j, F_j - K_j), one per stage j, columns (k, state).
    coupling = per_stage[:, :, None] * (widths * scheme.a[:, None, :, None, None, None])
    identity = jnp.eye(STAGES)[:, None, :, None] * jnp.eye(n)[:, None, :]
    left = (identity[..., None, None] - coupling).reshape(STAGES, n, -1, *widths.shape)
    solution = _eliminate_stages(jnp.concatenate([left, per_stage, right], axis=2))
    return jnp.swapaxes(solution, 0, 1)


def _eliminate_stages(rows: Array) -> Array:
    """Block elimination of (stages, n, stages * n + right sides, ...), one stage after the other.

    Returns (stages, n, right sides, ...). Pivots are the n x n blocks of the stages; one
    is singular only where the mesh is far too coarse for a growing mode.
    """
    stages, n = rows.shape[:2]
    solved = []
    for _ in range(stages):
        pivot, rest = rows[0, :, :n], rows[0, :, n:]
        inverse = inverse_points([list(row) for row in pivot])
        own = product(jnp.stack([jnp.stack(row) for row in inverse]), rest)
        below, rows = rows[1:, :, :n], rows[1:, :, n:]
        rows = rows - (below[:, :, :, None] * own[None, None]).sum(2)
        solved.append(own)
    for j in reversed(range(stages - 1)):
        for later in range(stages - 1, j, -1):
            at = (later - j - 1) * n
            known = product(solved[j][:, at : at + n], solved[later])
            solved[j] = jnp.concatenate([solved[j][:, :at], solved[j][:, at + n :] - known], axis=1)
    return jnp.stack(solved)


def transfer_maps(response: Array, orbit: Orbit) -> Array:
    """Maps (n, n, intervals, points) from a change at the left node to that at the right."""
    identity = jnp.eye(response.shape[0])[:, :, None, None]
    return identity + orbit.widths * jnp.einsum("k,nkcmb->ncmb", orbit.scheme.b, response)
