"""Logarithms of Floquet multipliers as functions that JAX differentiates to any order."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array


def log_multipliers_of_exponent(exponent: Array) -> Array:
    """ln|m| + i arg m from a matrix L, (n, n, points), of which e^L is the monodromy matrix.

    Returns
    -------
    complex array, shape (n, points), sorted by falling real part
    """
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
