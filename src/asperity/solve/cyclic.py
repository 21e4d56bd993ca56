"""Linear systems of periodic boundary-value problems.

Collocation reduces Newton's step to one transfer map per interval,

    d_{i+1} - T_i d_i = r_i,     d_M = d_0.

Multiplying the maps out is unstable when some directions grow and others decay within the period;
orthogonal elimination along the mesh is not (Wright, SIAM J. Sci. Stat. Comput. 13, 742, 1992).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from asperity.solve.linear import reflect


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
