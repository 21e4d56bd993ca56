"""Linear systems of periodic boundary-value problems.

Collocation reduces Newton's step to one transfer map per interval,

    d_{i+1} - T_i d_i = r_i,     d_M = d_0.

Multiplying the maps out is unstable when some directions grow and others decay within the period;
orthogonal elimination along the mesh is not (Wright, SIAM J. Sci. Stat. Comput. 13, 742, 1992).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.algebra.small_systems import product, reflect, solve_points


def _triangularise(rows: Array, columns: int) -> Array:
    """Householder reflections that zero the first `columns` columns below the diagonal.

    `rows` has shape (rows, all columns, points).
    """
    done, rest = [], rows
    for k in range(columns):
        pivot, rest = reflect(rest)
        zeros = jnp.zeros((k, *pivot.shape))
        done.append(jnp.concatenate([zeros, pivot[None], rest[0]]))
        rest = rest[1:]
    if not rest.shape[0]:
        return jnp.stack(done)
    padding = jnp.zeros((rest.shape[0], columns, *rest.shape[2:]))
    return jnp.concatenate([jnp.stack(done), jnp.concatenate([padding, rest], axis=1)])


def _back_substitute(triangle: Array, rhs: Array) -> Array:
    """Solve with an upper triangle (n, n, points)."""
    n = rhs.shape[0]
    solution: list[Array] = [rhs[0]] * n
    for k in reversed(range(n)):
        known = sum(triangle[k, j] * solution[j] for j in range(k + 1, n))
        solution[k] = (rhs[k] - known) / triangle[k, k]
    return jnp.stack(solution)


def solve_cyclic(maps: Array, rhs: Array) -> Array:
    """Solve the periodic recurrence above.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
    rhs : array, shape (n, intervals, points)

    Returns
    -------
    array, shape (n, intervals, points)
        d_0 ... d_{M-1}.
    """
    n, _, _, points = maps.shape
    identity = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, points))
    maps, rhs = jnp.moveaxis(maps, 2, 0), jnp.moveaxis(rhs, 1, 0)

    def forward(relation: tuple, interval: tuple) -> tuple:
        first, last, right = relation  # first d_0 + last d_i = right
        T, r = interval
        zero = jnp.zeros_like(T)
        upper = jnp.concatenate([last, first, zero, right[:, None]], axis=1)
        lower = jnp.concatenate([-T, zero, identity, r[:, None]], axis=1)
        rows = _triangularise(jnp.concatenate([upper, lower]), n)
        rest = rows[n:]
        return (rest[:, n : 2 * n], rest[:, 2 * n : 3 * n], rest[:, -1]), rows[:n]

    eliminated: Array
    (first, last, right), eliminated = jax.lax.scan(
        forward, (-maps[0], identity, rhs[0]), (maps[1:], rhs[1:])
    )
    rows = _triangularise(jnp.concatenate([first + last, right[:, None]], axis=1), n)
    start = _back_substitute(rows[:, :n], rows[:, n])

    def backward(after: Array, rows: Array) -> tuple[Array, Array]:
        known = (rows[:, n : 2 * n] * start).sum(1) + (rows[:, 2 * n : 3 * n] * after).sum(1)
        here = _back_substitute(rows[:, :n], rows[:, -1] - known)
        return here, here

    _, inner = jax.lax.scan(backward, start, eliminated, reverse=True)
    return jnp.moveaxis(jnp.concatenate([start[None], inner]), 0, 1)


class CyclicFactors(NamedTuple):
    """The orthogonal elimination of a periodic recurrence, for any number of right-hand sides.

    Attributes
    ----------
    rotations : array, shape (intervals - 1, 2 n, 2 n, points)
        What each step of the elimination does to the right-hand sides.
    rows : array, shape (intervals - 1, n, 3 n, points)
        Eliminated equations: columns of d_i, d_0 and d_{i+1}.
    closing : array, shape (n, n, points)
        Inverse of the matrix that is left for d_0.
    """

    rotations: Array
    rows: Array
    closing: Array


def factorise_cyclic(maps: Array) -> CyclicFactors:
    """Eliminate the recurrence d_{i+1} - T_i d_i = r_i, d_M = d_0, once for all r.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
    """
    n, _, _, points = maps.shape
    maps = jnp.moveaxis(maps, 2, 0)
    identity = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, points))
    record = jnp.broadcast_to(jnp.eye(2 * n)[:, :, None], (2 * n, 2 * n, points))

    def forward(relation: tuple, T: Array) -> tuple:
        first, last = relation  # first d_0 + last d_i = right
        zero = jnp.zeros_like(T)
        upper = jnp.concatenate([last, first, zero], axis=1)
        lower = jnp.concatenate([-T, zero, identity], axis=1)
        matrix = jnp.concatenate([upper, lower])
        rows = _triangularise(jnp.concatenate([matrix, record], axis=1), n)
        rest = rows[n:]
        done = rows[:, 3 * n :], rows[:n, : 3 * n]
        return (rest[:, n : 2 * n], rest[:, 2 * n : 3 * n]), done

    rotations: Array
    rows: Array
    (first, last), (rotations, rows) = jax.lax.scan(forward, (-maps[0], identity), maps[1:])
    triangle = _triangularise(jnp.concatenate([first + last, identity], axis=1), n)
    columns = [_back_substitute(triangle[:, :n], triangle[:, n + i]) for i in range(n)]
    return CyclicFactors(rotations, rows, jnp.stack(columns, axis=1))


def solve_factorised(factors: CyclicFactors, rhs: Array) -> Array:
    """Solve the recurrence for a right-hand side (n, intervals, points); linear in it.

    Returns
    -------
    array, shape (n, intervals, points)
        d_0 ... d_{M-1}.
    """
    n = rhs.shape[0]
    rhs = jnp.moveaxis(rhs, 1, 0)

    def forward(right: Array, interval: tuple) -> tuple:
        rotation, r = interval
        turned = (rotation * jnp.concatenate([right, r])[None]).sum(1)
        return turned[n:], turned[:n]

    known: Array
    right, known = jax.lax.scan(forward, rhs[0], (factors.rotations, rhs[1:]))
    start = (factors.closing * right[None]).sum(1)

    def backward(after: Array, interval: tuple) -> tuple:
        rows, right = interval
        rest = (rows[:, n : 2 * n] * start[None]).sum(1) + (rows[:, 2 * n :] * after[None]).sum(1)
        here = _back_substitute(rows[:, :n], right - rest)
        return here, here

    inner: Array
    _, inner = jax.lax.scan(backward, start, (factors.rows, known), reverse=True)
    return jnp.moveaxis(jnp.concatenate([start[None], inner]), 0, 1)


class Border(NamedTuple):
    """One more unknown p and one more equation, sum_i row_i . d_i + corner p = value.

    Attributes
    ----------
    column : array, shape (n, intervals, points)
        Contribution of a unit of p to the right-hand sides.
    row : array, shape (n, intervals, points)
    corner, value : array, shape (points,)
    """

    column: Array
    row: Array
    corner: Array
    value: Array


def solve_bordered(maps: Array, rhs: Array, border: Border) -> tuple[Array, Array]:
    """Solve d_{i+1} - T_i d_i = r_i + p column_i, d_M = d_0, with the equation of the border.

    The elimination runs once for all; what closes it is one system for d_0 and p together, so that
    a fold, where the periodic recurrence alone is singular, makes no difference.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
    rhs : array, shape (n, intervals, points)
    border : Border

    Returns
    -------
    d : array, shape (n, intervals, points)
    p : array, shape (points,)
    """
    n, _, _, points = maps.shape
    identity = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, points))
    maps = jnp.moveaxis(maps, 2, 0)
    rights = jnp.moveaxis(jnp.stack([rhs, border.column], axis=1), 2, 0)

    def forward(relation: tuple, interval: tuple) -> tuple:
        first, last, right = relation  # first d_0 + last d_i = right (1, p)
        T, r = interval
        zero = jnp.zeros_like(T)
        upper = jnp.concatenate([last, first, zero, right], axis=1)
        lower = jnp.concatenate([-T, zero, identity, r], axis=1)
        rows = _triangularise(jnp.concatenate([upper, lower]), n)
        rest = rows[n:]
        return (rest[:, n : 2 * n], rest[:, 2 * n : 3 * n], rest[:, 3 * n :]), rows[:n]

    start = (-maps[0], identity, rights[0])
    rows: Array
    (first, last, right), rows = jax.lax.scan(forward, start, (maps[1:], rights[1:]))

    # Every d_i as columns times (1, p, d_0).
    closed = jnp.concatenate([jnp.zeros((n, 2, points)), identity], axis=1)

    def backward(after: Array, rows: Array) -> tuple[Array, Array]:
        known = jnp.concatenate([rows[:, 3 * n :], -rows[:, n : 2 * n]], axis=1)
        here = _back_substitute(rows[:, :n], known - product(rows[:, 2 * n : 3 * n], after))
        return here, here

    _, inner = jax.lax.scan(backward, closed, rows, reverse=True)
    columns = jnp.concatenate([closed[None], inner])  # (intervals, n, 2 + n, points)
    weighted = jnp.einsum("nmb,mncb->cb", border.row, columns)
    constant, along = weighted[0], weighted[1] + border.corner
    top = jnp.concatenate([first + last, -right[:, 1:]], axis=1)
    bottom = jnp.concatenate([weighted[2:], along[None]])
    matrix = jnp.concatenate([top, bottom[None]])
    known = jnp.concatenate([right[:, 0], (border.value - constant)[None]])
    closing = solve_points(matrix, known)
    d = (
        columns[:, :, 0]
        + columns[:, :, 1] * closing[n]
        + jnp.einsum("mncb,cb->mnb", columns[:, :, 2:], closing[:n])
    )
    return jnp.moveaxis(d, 0, 1), closing[n]
