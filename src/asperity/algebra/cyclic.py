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

from asperity.algebra.small_systems import back_substitute, product, solve_points, triangularise


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

    After the elimination there is one system for d_0 and p together. It is regular at a fold, where
    the periodic recurrence alone is singular.

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
    n = len(maps)
    columns, ends, right = _eliminated(maps, jnp.stack([rhs, border.column], axis=1))
    weighted = jnp.einsum("nmb,mncb->cb", border.row, columns)
    constant, along = weighted[0], weighted[1] + border.corner
    top = jnp.concatenate([ends, -right[:, 1:]], axis=1)
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


def solve_cyclic(maps: Array, rhs: Array) -> Array:
    """Solve d_{i+1} - T_i d_i = r_i, d_M = d_0, for several right-hand sides at once.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
    rhs : array, shape (n, sides, intervals, points)

    Returns
    -------
    d : array, shape (n, sides, intervals, points)
    """
    sides = rhs.shape[1]
    columns, ends, right = _eliminated(maps, rhs)
    first = jax.vmap(solve_points, in_axes=(None, 1), out_axes=1)(ends, right)
    d = columns[:, :, :sides] + jnp.einsum("mnkb,kcb->mncb", columns[:, :, sides:], first)
    return jnp.moveaxis(d, 0, 2)


def _eliminated(maps: Array, rhs: Array) -> tuple[Array, Array, Array]:
    """Every d_i as a linear function of the right-hand sides and d_0, and the equation for d_0.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
    rhs : array, shape (n, sides, intervals, points)

    Returns
    -------
    columns : array, shape (intervals, n, sides + n, points)
        Columns of each side, and of d_0.
    ends, right : array, shape (n, n, points) and (n, sides, points)
        ends d_0 = right.
    """
    n, sides, _, points = rhs.shape
    identity = jnp.broadcast_to(jnp.eye(n)[:, :, None], (n, n, points))
    maps = jnp.moveaxis(maps, 2, 0)
    rights = jnp.moveaxis(rhs, 2, 0)

    def forward(relation: tuple, interval: tuple) -> tuple:
        first, last, right = relation  # first d_0 + last d_i = right
        T, r = interval
        zero = jnp.zeros_like(T)
        upper = jnp.concatenate([last, first, zero, right], axis=1)
        lower = jnp.concatenate([-T, zero, identity, r], axis=1)
        rows = triangularise(jnp.concatenate([upper, lower]), n)
        remaining = rows[n:]
        return (remaining[:, n : 2 * n], remaining[:, 2 * n : 3 * n], remaining[:, 3 * n :]), rows[
            :n
        ]

    start = (-maps[0], identity, rights[0])
    rows: Array
    (first, last, right), rows = jax.lax.scan(forward, start, (maps[1:], rights[1:]))

    closed = jnp.concatenate([jnp.zeros((n, sides, points)), identity], axis=1)

    def backward(after: Array, rows: Array) -> tuple[Array, Array]:
        known = jnp.concatenate([rows[:, 3 * n :], -rows[:, n : 2 * n]], axis=1)
        here = back_substitute(rows[:, :n], known - product(rows[:, 2 * n : 3 * n], after))
        return here, here

    _, inner = jax.lax.scan(backward, closed, rows, reverse=True)
    return jnp.concatenate([closed[None], inner]), first + last, right
