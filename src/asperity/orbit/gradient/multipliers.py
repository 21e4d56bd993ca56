"""Logarithms of Floquet multipliers as functions that JAX differentiates to any order."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array


def log_multipliers(monodromy: Array, log_scale: Array, log_determinant: Array) -> Array:
    """ln|m| + i arg m, as `asperity.orbit.floquet.log_multipliers` has them.

    Parameters
    ----------
    monodromy : array, shape (n, n, points)
        Divided by exp(log_scale).
    log_scale : array, shape (points,)
    log_determinant : array, shape (points,)
        Of the whole monodromy matrix, by Liouville's formula.

    Returns
    -------
    complex array, shape (n, points), sorted by falling real part
    """
    n = monodromy.shape[0]
    if n == 1:
        return log_determinant[None] + 0j
    if n == 2:
        return _log_pair(monodromy, log_scale, log_determinant)
    values, _ = eigensystem(jnp.moveaxis(monodromy, -1, 0) + 0j)
    return sorted_logs(jnp.log(values.T) + log_scale)


def log_multipliers_of_exponent(exponent: Array) -> Array:
    """The same from a matrix L, shape (n, n, points), of which e^L is the monodromy matrix."""
    n = exponent.shape[0]
    if n == 1:
        return exponent[0] + 0j
    if n == 2:
        (a, b), (c, d) = exponent
        half, square = 0.5 * (a + d), 0.25 * (a - d) ** 2 + b * c
        real = square >= 0
        root = jnp.where(real, jnp.sqrt(jnp.where(real, square, 1.0)), 0.0)
        turn = jnp.where(real, 0.0, jnp.sqrt(jnp.where(real, 1.0, -square)))
        logs = jnp.stack([half + root + 1j * turn, half - root - 1j * turn])
    else:
        values, _ = eigensystem(jnp.moveaxis(exponent, -1, 0) + 0j)
        logs = sorted_logs(values.T)
    turns = jax.lax.stop_gradient(jnp.round(logs.imag / (2 * jnp.pi)))
    return logs - 2j * jnp.pi * turns


def sorted_logs(logs: Array) -> Array:
    """By falling real part; of a complex pair the one with the positive argument first."""
    margin = 1e-9 * (1 + jnp.abs(logs.real))
    order = jnp.argsort(-logs.real - margin * jnp.sign(logs.imag), axis=0, stable=True)
    return jnp.take_along_axis(logs, order, axis=0)


def _log_pair(monodromy: Array, log_scale: Array, log_determinant: Array) -> Array:
    """The larger of two from the trace, the smaller one from the determinant."""
    half_trace = 0.5 * (monodromy[0, 0] + monodromy[1, 1])
    square = half_trace**2 - jnp.exp(log_determinant - 2 * log_scale)
    negative = half_trace < 0
    sign = jnp.where(negative, -1.0, 1.0)
    real = square >= 0
    root = jnp.sqrt(jnp.where(real, square, 1.0))
    size = jnp.log(jnp.abs(half_trace + sign * jnp.where(real, root, 0.0))) + log_scale
    turn = jnp.arctan2(jnp.sqrt(jnp.where(real, 1.0, -square)), half_trace)
    angle = jnp.where(real, jnp.where(negative, jnp.pi, 0.0), turn)
    first = jnp.where(real, size, 0.5 * log_determinant)
    second = jnp.where(real, log_determinant - size, 0.5 * log_determinant)
    return jnp.stack([first + 1j * angle, second + 1j * jnp.where(real, angle, -angle)])


@jax.custom_jvp
def eigensystem(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues and right eigenvectors as columns.

    Parameters
    ----------
    matrix : complex array, shape (points, n, n)
        With simple eigenvalues: at a multiple one the derivatives are not finite.

    Returns
    -------
    values : array, shape (points, n)
    vectors : array, shape (points, n, n)
        Of a norm that does not change to first order in any coordinate system of the vectors.
    """
    finite = jnp.isfinite(matrix).all((1, 2), keepdims=True)
    values, vectors = jnp.linalg.eig(jnp.where(finite, matrix, jnp.eye(matrix.shape[-1])))
    return jnp.where(finite[..., 0], values, jnp.nan), vectors


@eigensystem.defjvp
def _eigensystem_rule(primals: tuple, tangents: tuple) -> tuple:
    """First-order perturbation; it refers to itself, and so holds for higher orders."""
    values, vectors = eigensystem(*primals)
    turned = jnp.linalg.solve(vectors, tangents[0] @ vectors)
    n = values.shape[-1]
    apart = values[:, None, :] - values[:, :, None] + jnp.eye(n)
    mixed = jnp.where(jnp.eye(n, dtype=bool), 0.0, turned / apart)
    return (values, vectors), (jnp.diagonal(turned, axis1=-2, axis2=-1), vectors @ mixed)
