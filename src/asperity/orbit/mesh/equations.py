"""The collocation equations of orbits on meshes, linearised and condensed.

The law's part comes from `asperity.slider.pointwise`, one compiled program for each law; the
condensation is one program for each number of states, for all meshes.

The response of the slopes at the collocation points to a change at the left node of an interval
is a small dense system. Its solution in each interval leaves equations for the nodes only.
Intervals are independent here, so that the intervals of all meshes and operating points lie along
one axis.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import (
    inverse_points,
    product,
    scaled_product,
    spectral_abscissa,
    spectral_radius,
)
from asperity.arrays import Complex, Float
from asperity.loads import Excitation
from asperity.orbit.batches import run_chunks
from asperity.orbit.mesh.mesh import STAGES, Orbit, split
from asperity.orbit.observables import Observables
from asperity.slider.pointwise import PointValues, excitation_at, slopes_along, values_at
from asperity.slider.problem import Problem

#: Matrix entries that are eliminated together; they fit into the cache of a core.
_CACHED = 20_000


def condense(jacobian: Array, right: Array, widths: Array, a: Array) -> tuple[Array, Array]:
    """Slopes at the stages as a linear function of the state at the left node.

    Parameters
    ----------
    jacobian : array, shape (n, n, STAGES, intervals)
        [row, column] at the collocation points.
    right : array, shape (n, STAGES, sides, intervals)
        Right-hand sides.
    widths : array, shape (intervals,)
    a : array, shape (STAGES, STAGES)
        Coefficients a of the collocation scheme.

    Returns
    -------
    response : array, shape (n, STAGES, n, intervals)
        Change of the slopes for a change at the left node.
    constant : array, shape (n, STAGES, sides, intervals)
        Change of the slopes for each right-hand side.
    """
    n, intervals = jacobian.shape[0], widths.shape[-1]
    solve = partial(_condense_block, a=a)
    entries = STAGES * n * ((STAGES + 1) * n + right.shape[2])
    divisors = (k for k in range(1, intervals) if _fits(intervals, k, entries))
    blocks = next(divisors, intervals)
    parts = jacobian, right, widths
    if blocks > 1:
        # Block by block, so that the elimination stays within a core's cache.
        cut = tuple(jnp.moveaxis(p.reshape(*p.shape[:-1], blocks, -1), -2, 0) for p in parts)
        solved = jax.lax.map(solve, cut)
        solution = jnp.moveaxis(solved, 0, -2).reshape(*solved.shape[1:-1], intervals)
    else:
        solution = solve(parts)
    return solution[:, :, :n], solution[:, :, n:]


def _fits(intervals: int, blocks: int, entries: int) -> bool:
    """Whether an equal share of the intervals, of so many entries each, fits into the cache."""
    return intervals % blocks == 0 and intervals // blocks * entries <= _CACHED


def _condense_block(part: tuple[Array, Array, Array], *, a: Array) -> Array:
    """`condense` of a block of intervals; (n, STAGES, n + right-hand sides, intervals)."""
    jacobian, right, widths = part
    n = jacobian.shape[0]
    per_stage = jnp.transpose(jacobian, (2, 0, 1, 3))  # (stage, row, column, intervals)
    right = jnp.transpose(right, (1, 0, 2, 3))
    # Row blocks (I - h a_jk J_j | J_j, right-hand sides), one per stage j, columns (k, state).
    coupling = per_stage[:, :, None] * (widths * a[:, None, :, None, None])
    identity = jnp.eye(STAGES)[:, None, :, None] * jnp.eye(n)[:, None, :]
    left = (identity[..., None] - coupling).reshape(STAGES, n, -1, *widths.shape)
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
        solution = product(jnp.stack([jnp.stack(row) for row in inverse]), rest)
        below, rows = rows[1:, :, :n], rows[1:, :, n:]
        rows = rows - (below[:, :, :, None] * solution[None, None]).sum(2)
        solved.append(solution)
    for j in reversed(range(stages - 1)):
        for later in range(stages - 1, j, -1):
            at = (later - j - 1) * n
            known = product(solved[j][:, at : at + n], solved[later])
            solved[j] = jnp.concatenate([solved[j][:, :at], solved[j][:, at + n :] - known], axis=1)
    return jnp.stack(solved)


def transfer_maps(response: Array, widths: Array, b: Array) -> Array:
    """Maps (n, n, ...) from a change at the left node to that at the right.

    Parameters
    ----------
    response : array, shape (n, STAGES, n, ...)
        As `condense` returns it.
    widths : array, shape (...)
    b : array, shape (STAGES,)
        Coefficients b of the collocation scheme.
    """
    n = response.shape[0]
    identity = np.eye(n).reshape(n, n, *(1 for _ in widths.shape))
    return identity + widths * sum(b[k] * response[:, k] for k in range(STAGES))


#: Numbers of intervals that are condensed in a call.
_BLOCKS = (1728, 576)

_condense = jit_large(condense)


class CondensedEquations(NamedTuple):
    """The linearised equations of orbits.

    Attributes
    ----------
    values : PointValues
        At the collocation points, arrays of shape (..., STAGES, intervals, points).
    response : array, shape (n, STAGES, n, intervals, points)
        Change of the slopes for a change at the left node.
    constant : array, shape (n, STAGES, sides, intervals, points)
        Change of the slopes for each right-hand side.
    """

    values: PointValues
    response: Float
    constant: Float


def collocated(problem: Problem, orbit: Orbit, at: Excitation | None = None) -> PointValues:
    """The equation of motion at the collocation points of an orbit.

    Parameters
    ----------
    problem : Problem
        NumPy arrays (points,).
    orbit : Orbit
    at : Excitation, optional
        At the collocation points, where it is known.
    """
    at = excitation_at(problem.load, orbit.stage_phases) if at is None else at
    return values_at(problem.system, at, orbit.centre, orbit.stage_deviations)


def condensed(
    problem: Problem,
    orbit: Orbit,
    direction: Problem | None = None,
    *,
    at: Excitation | None = None,
    closed: bool = True,
) -> CondensedEquations:
    """The equations of an orbit, linearised and condensed.

    Parameters
    ----------
    problem : Problem
        NumPy arrays (points,).
    orbit : Orbit
    direction : Problem, optional
        Direction of the parameters, for a second right-hand side.
    at : Excitation, optional
        As in `collocated`.
    closed : bool
        Whether the first right-hand side is the defect of the equations, or zero.
    """
    values = collocated(problem, orbit, at)
    right = np.zeros((*orbit.slopes.shape[:2], 1 + (direction is not None), *orbit.widths.shape))
    if closed:
        right[:, :, 0] = values.rates - orbit.slopes
    if direction is not None:
        one = jax.tree.map(lambda a: np.asarray(a)[None], direction)
        (slopes,), *_ = slopes_along(problem, one, orbit.stage_phases, orbit.stage_states)
        right[:, :, 1] = slopes
    return CondensedEquations(values, *condensed_jacobian(values.jacobian, right, orbit))


def condensed_jacobian(jacobian: Float, right: Float, orbit: Orbit) -> tuple[Float, Float]:
    """`condense` of NumPy arrays (..., intervals, points) on the mesh of an orbit."""
    a, shape = np.asarray(orbit.scheme.a), orbit.widths.shape
    parts = jacobian, right, orbit.widths
    flat = tuple(np.reshape(part, (*part.shape[:-2], -1)) for part in parts)
    everything = np.arange(shape[0] * shape[1])
    blocks = [block for _, block in run_chunks(partial(_condense, a=a), flat, everything, _BLOCKS)]
    solved = (np.concatenate(block, axis=-1) for block in zip(*blocks, strict=True))
    response, constant = (block.reshape(*block.shape[:-1], *shape) for block in solved)
    return response, constant


#: Modulus of the logarithms of the multipliers below which the mean Jacobian gives them better
#: than the monodromy matrix does: its error is about their square, of the latter the round-off of 1
#: or, of two that are close to each other, the root of that.
_SMALL_EXPONENT = 1e-5
#: Where the largest eigenvalue of the Jacobian integrates to less than this, all multipliers vanish
#: as doubles, and those of the transfer maps of a stiff method are not used.
VANISHING_GROWTH = -200.0


def fourier_coefficients(force: Float, orbit: Orbit, harmonics: int) -> tuple[Float, Complex]:
    """Mean (..., points) and harmonics (count, ..., points) of a force, peak amplitudes.

    Parameters
    ----------
    force : array, shape (..., STAGES, intervals, points)
        At the collocation points.
    orbit : Orbit
        With the mesh.
    harmonics : int
    """
    weighted = quadrature(orbit) / (2 * np.pi) * force
    turn, phasors = np.exp(-1j * orbit.stage_phases), []
    turns = np.ones_like(turn)
    for _ in range(harmonics):
        turns = turns * turn
        phasors.append(2 * (turns * weighted).sum((-3, -2)))
    return weighted.sum((-3, -2)), np.stack(phasors)


def mean_and_harmonics(values: PointValues, orbit: Orbit, harmonics: int) -> tuple[Float, Complex]:
    """Mean (points,) and harmonics (count, points) of F/W0, peak amplitudes."""
    mean, phasors = fourier_coefficients(values.force_rest, orbit, harmonics)
    return values.force_mean[0, 0] + mean, phasors


def read_orbit(problem: Problem, orbit: Orbit, harmonics: int) -> Observables:
    """Observables of a converged orbit, NumPy arrays."""
    size, weights = len(orbit.centre), quadrature(orbit)
    with np.errstate(all="ignore"):
        values, response, _ = condensed(problem, orbit)
        mean, phasors = mean_and_harmonics(values, orbit, harmonics)
        maps = transfer_maps(response, orbit.widths, orbit.scheme.b)
        monodromy, log_scale = scaled_product(maps)
        # Where rates are so small that the order in which they act does not matter, their mean.
        mean_jacobian = (weights * values.jacobian).sum((2, 3))
        small = spectral_radius(mean_jacobian) < _SMALL_EXPONENT
        exponent = np.where(small, mean_jacobian, np.nan)
        log_determinant = np.trace(mean_jacobian)
        # The largest eigenvalue is at least the mean of all: elsewhere it need not be known.
        growth = np.full(mean.shape, np.inf)
        for k in np.flatnonzero(log_determinant < VANISHING_GROWTH * size):
            rate = spectral_abscissa(values.jacobian[..., k])
            growth[k] = (weights[..., k] * rate).sum()
    return Observables(
        mean,
        phasors,
        monodromy,
        log_scale,
        log_determinant,
        exponent,
        growth,
        orbit.start,
        values.reversal_margin.min((0, 1)),
    )


def quadrature(orbit: Orbit) -> Array:
    """Weights of the collocation points in an integral over the period."""
    return orbit.scheme.b[:, None, None] * orbit.widths


def split_observables(problem: Problem, orbit: Orbit, parts: int) -> Observables:
    """Multipliers by transfer maps over parts of the intervals, for stiff but smooth orbits."""
    return read_orbit(problem, split(orbit, parts), 1)
