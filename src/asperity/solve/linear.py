"""Small dense systems, one per operating point, with the points along the last axis."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jax import Array


def solve_points(matrix: Array, rhs: Array) -> Array:
    """Solve ``matrix x = rhs`` for every operating point.

    Parameters
    ----------
    matrix : array, shape (n, n, points)
    rhs : array, shape (n, points)

    Returns
    -------
    array, shape (n, points)
        Not finite where a matrix is singular.
    """
    n = matrix.shape[0]
    if n == 1:
        return rhs / matrix[0]
    if n == 2:  # Cramer: vectorises over the points, which LAPACK calls do not
        (a, b), (c, d) = matrix
        return jnp.stack([d * rhs[0] - b * rhs[1], a * rhs[1] - c * rhs[0]]) / (a * d - b * c)
    x = jnp.linalg.solve(jnp.moveaxis(matrix, -1, 0), jnp.moveaxis(rhs, -1, 0)[..., None])
    return jnp.moveaxis(x[..., 0], 0, -1)


def jacobian_columns(function: Callable[[Array], Array], Y: Array) -> tuple[Array, list[Array]]:
    """Value and derivative of an element-wise function of n states.

    Parameters
    ----------
    function : callable
        (n, ...) -> (m, ...), element-wise in the trailing axes.
    Y : array, shape (n, ...)

    Returns
    -------
    value : array, shape (m, ...)
    columns : list of n arrays, shape (m, ...)
        Derivative with respect to each state.
    """
    value, push = jax.linearize(function, Y)
    n = Y.shape[0]
    unit = [jnp.stack([jnp.full(Y.shape[1:], float(i == j)) for j in range(n)]) for i in range(n)]
    return value, [push(e) for e in unit]


def expm_points(matrix: Array) -> Array:
    """Matrix exponential for every operating point.

    Parameters
    ----------
    matrix : array, shape (n, n, points)
    """
    if matrix.shape[0] == 1:
        return jnp.exp(matrix)
    if matrix.shape[0] == 2:
        (a, b), (c, d) = matrix
        half = 0.5 * (a + d)
        square = (0.5 * (a - d)) ** 2 + b * c
        root = jnp.sqrt(jnp.abs(square))
        small = root < 1e-4  # series: accurate to 1e-17, and differentiable at zero
        safe = jnp.where(small, 1.0, root)
        cosh = jnp.where(square > 0, jnp.cosh(safe), jnp.cos(safe))
        cosh = jnp.where(small, 1 + square / 2 + square**2 / 24, cosh)
        sinhc = jnp.where(square > 0, jnp.sinh(safe), jnp.sin(safe)) / safe
        sinhc = jnp.where(small, 1 + square / 6 + square**2 / 120, sinhc)
        traceless = jnp.stack([jnp.stack([a - half, b]), jnp.stack([c, d - half])])
        identity = jnp.eye(2)[:, :, None]
        return jnp.exp(half) * (cosh * identity + sinhc * traceless)
    return jnp.moveaxis(jax.scipy.linalg.expm(jnp.moveaxis(matrix, -1, 0)), 0, -1)
