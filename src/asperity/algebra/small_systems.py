"""Small dense systems, one per operating point, with the points along the last axes.

Written in element-wise operations on purpose. They vectorise over the points, which calls of LAPACK
do not, and two LAPACK calls that XLA's CPU backend runs side by side can wait for each other for
ever (seen with jaxlib 0.10.2 on two cores).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float

#: Entries [row][column] of a small matrix, each an array over the operating points.
Matrix = list[list[Array]]


def inverse_points(matrix: Matrix) -> Matrix:
    """Inverse of a small matrix for every operating point.

    Not finite where the matrix is singular, or so large that its determinant overflows.

    Entries are separate arrays, so that XLA writes no stacked matrix to memory.
    """
    n = len(matrix)
    if n == 1:
        return [[1 / matrix[0][0]]]
    if n == 2:
        (a, b), (c, d) = matrix
        scale = 1 / _finite(a * d - b * c)
        return [[d * scale, -b * scale], [-c * scale, a * scale]]
    # By the Schur complement of the first two unknowns: the mechanical ones, which a step of the
    # spring and the mass never makes singular.
    upper = [row[:2] for row in matrix[:2]], [row[2:] for row in matrix[:2]]
    lower = [row[:2] for row in matrix[2:]], [row[2:] for row in matrix[2:]]
    first = inverse_points(upper[0])
    across, down = multiply(first, upper[1]), multiply(lower[0], first)
    remaining = inverse_points(subtract(lower[1], multiply(lower[0], across)))
    corner = multiply(remaining, down)
    return [
        *(
            [*a, *(-b for b in c)]
            for a, c in zip(
                add(first, multiply(across, corner)), multiply(across, remaining), strict=True
            )
        ),
        *([*(-a for a in b), *c] for b, c in zip(corner, remaining, strict=True)),
    ]


def _finite(determinant: Array) -> Array:
    """NaN in place of infinity: a Newton step divided by infinity would look like convergence."""
    return jnp.where(jnp.isinf(determinant), jnp.nan, determinant)


def inverse_by_elimination(matrix: Array) -> Array:
    """Inverse of a matrix of some dozen rows for every operating point.

    By Gauss-Jordan elimination with partial pivoting; not finite where it is singular.

    Parameters
    ----------
    matrix : array, shape (n, n, points)
    """
    n, _, points = matrix.shape
    rows = jnp.arange(n)[:, None]

    def eliminate(k: Array, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        remaining, free, order = carry
        column = jax.lax.dynamic_index_in_dim(remaining, k, 1, keepdims=False)
        chosen = jnp.argmax(jnp.where(free, jnp.abs(column), -1.0), axis=0)
        here = rows == chosen
        pivot = 1 / jnp.where(here, column, 0.0).sum(0)
        row = jnp.where(here[:, None], remaining, 0.0).sum(0) * pivot
        row = jnp.where(rows == k, pivot, row)
        remaining = jnp.where((rows == k)[None], 0.0, remaining)
        below = jnp.where(here, 0.0, column)
        remaining = jnp.where(here[:, None], row[None], remaining - below[:, None] * row[None])
        return remaining, free & ~here, order.at[k].set(chosen)

    start = matrix, jnp.ones((n, points), dtype=bool), jnp.zeros((n, points), dtype=int)
    remaining, _, order = jax.lax.fori_loop(0, n, eliminate, start)
    remaining = jnp.take_along_axis(remaining, order[:, None], 0)
    return jnp.take_along_axis(remaining, jnp.argsort(order, axis=0)[None], 1)


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """Product of two matrices of separate entries."""
    columns = list(zip(*b, strict=True))
    return [[sum(x * y for x, y in zip(row, c, strict=True)) for c in columns] for row in a]


def apply(matrix: Matrix, vector: Sequence[Array]) -> tuple[Array, ...]:
    """Product of a matrix of separate entries and a vector."""
    return tuple(sum(a * x for a, x in zip(row, vector, strict=True)) for row in matrix)


def averaged(matrix: Matrix, weights: Array) -> Matrix:
    """Weighted sum of each entry over its first axis."""
    return [[weights @ entry for entry in row] for row in matrix]


def jacobian(push: Callable[..., Sequence[Array]], like: Sequence[Array]) -> Matrix:
    """Entries [i][j] of a linear map of several element-wise changes, shapes as `like`."""
    one, zero = jnp.ones_like(like[0]), jnp.zeros_like(like[0])
    n = range(len(like))
    columns = [push(*(one if i == j else zero for i in n)) for j in n]
    return [[columns[j][i] for j in n] for i in n]


def add(a: Matrix, b: Matrix) -> Matrix:
    """Sum of two matrices of separate entries."""
    return [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(a, b, strict=True)]


def subtract(a: Matrix, b: Matrix) -> Matrix:
    """Difference of two matrices of separate entries."""
    return [[x - y for x, y in zip(*rows, strict=True)] for rows in zip(a, b, strict=True)]


def solve_points(matrix: Array, rhs: Array) -> Array:
    """Solve ``matrix x = rhs`` for every operating point.

    Parameters
    ----------
    matrix : array, shape (n, n, ...)
    rhs : array, shape (n, ...)

    Returns
    -------
    array, shape (n, ...)
        Not finite where a matrix is singular, or its determinant overflows.
    """
    return solve_columns(matrix, rhs[:, None])[:, 0]


def solve_columns(matrix: Array, rhs: Array) -> Array:
    """Solve ``matrix X = rhs`` with several right-hand sides.

    By Cramer's rule up to two states, by Householder reflections for more.

    Parameters
    ----------
    matrix : array, shape (n, n, ...), real or complex
    rhs : array, shape (n, columns, ...)

    Returns
    -------
    array, shape (n, columns, ...)
    """
    n = matrix.shape[0]
    if n == 1:
        return rhs / matrix
    if n == 2:
        (a, b), (c, d) = matrix
        determinant = _finite(a * d - b * c)
        return jnp.stack([d * rhs[0] - b * rhs[1], a * rhs[1] - c * rhs[0]]) / determinant
    rows = jnp.concatenate([matrix, rhs], axis=1)
    # Reflections mix rows: a row larger than the others by 1e16, as in fast motions, would lose
    # the digits of the others.
    size = jax.lax.stop_gradient(jnp.abs(matrix).max(1, keepdims=True))
    rows = triangularise(rows / jnp.where(size > 0, size, 1.0), n)
    return back_substitute(rows[:, :n], rows[:, n:])


def triangularise(rows: Array, columns: int) -> Array:
    """Householder reflections that zero the first `columns` columns below the diagonal.

    `rows` has shape (rows, all columns, ...).
    """
    done, remaining = [], rows
    for k in range(columns):
        pivot, remaining = reflect(remaining)
        zeros = jnp.zeros((k, *pivot.shape))
        done.append(jnp.concatenate([zeros, pivot[None], remaining[0]]))
        remaining = remaining[1:]
    if not remaining.shape[0]:
        return jnp.stack(done)
    padding = jnp.zeros((remaining.shape[0], columns, *remaining.shape[2:]))
    return jnp.concatenate([jnp.stack(done), jnp.concatenate([padding, remaining], axis=1)])


def back_substitute(triangle: Array, rhs: Array) -> Array:
    """Solve with an upper triangle (n, n, ...) for right-hand sides (n, columns, ...)."""
    n = rhs.shape[0]
    solution: list[Array] = [rhs[0]] * n
    for k in reversed(range(n)):
        known = sum(triangle[k, j] * solution[j] for j in range(k + 1, n))
        solution[k] = (rhs[k] - known) / triangle[k, k]
    return jnp.stack(solution)


def reflect(rows: Array) -> tuple[Array, Array]:
    """One Householder reflection of `rows`, shape (rows, columns, ...).

    Returns the first entry of the first column after it, the others being zero, and the
    remaining columns.
    """
    x = rows[:, 0]
    norm = jnp.sqrt((x * x.conj()).real.sum(0))
    first = jnp.abs(x[0])
    signed = norm * jnp.where(first == 0, 1.0, x[0] / jnp.where(first == 0, 1.0, first))
    v = x.at[0].add(signed)
    scale = norm * (norm + first)
    along = (v.conj()[:, None] * rows[:, 1:]).sum(0) / jnp.where(scale == 0, 1.0, scale)
    return -signed, rows[:, 1:] - v[:, None] * along


def value_and_jacobian(function: Callable[[Array], Array], Y: Array) -> tuple[Array, Array]:
    """Value and derivative of an element-wise function of n states.

    Parameters
    ----------
    function : callable
        (n, ...) -> (m, ...), element-wise in the trailing axes.
    Y : array, shape (n, ...)

    Returns
    -------
    value : array, shape (m, ...)
    jacobian : array, shape (m, n, ...)
        [row, column]: derivative of the row with respect to the state of the column.
    """
    value, push = jax.linearize(function, Y)
    n = Y.shape[0]
    unit = [jnp.stack([jnp.full(Y.shape[1:], float(i == j)) for j in range(n)]) for i in range(n)]
    return value, jnp.stack([push(e) for e in unit], axis=1)


def product(a: Array, b: Array) -> Array:
    """Matrix product for every operating point, (n, n, ...) each."""
    return (a[:, :, None] * b[None]).sum(1)


def scaled_product(maps: Float) -> tuple[Float, Float]:
    """Product of the maps of successive intervals, the last one leftmost, kept near unit size.

    Parameters
    ----------
    maps : array, shape (n, n, intervals, points)
        NumPy arrays.

    Returns
    -------
    product : array, shape (n, n, points)
        Divided by the exponential of its scale.
    log_scale : array, shape (points,)
    """
    n, _, intervals, points = maps.shape
    # Products of about sqrt(count) neighbours, then the product of these: the error grows with the
    # square root of the number only.
    length = math.isqrt(intervals - 1) + 1
    blocks = -(-intervals // length)
    added = (n, n, blocks * length - intervals, points)
    padding = np.broadcast_to(np.eye(n)[..., None, None], added)
    maps = np.concatenate([maps, padding], axis=2).reshape(n, n, blocks, length, points)
    rows, scales = _scaled_products(np.moveaxis(maps, 3, 0))
    whole, scale = _scaled_products(np.moveaxis(rows, 2, 0))
    return whole, scale + scales.sum(0)


def _scaled_products(
    factors: Float,
) -> tuple[Float, Float]:
    """Products over the first axis of (count, n, n, ...), and the logarithms of their scales."""
    done, log_scale = factors[0], np.zeros(factors.shape[3:])
    for factor in factors[1:]:
        done = np.einsum("ij...,jk...->ik...", factor, done)
        size = np.abs(done).max((0, 1))
        size = np.where(size > 0, size, 1.0)
        done, log_scale = done / size, log_scale + np.log(size)
    return done, log_scale


def spectral_radius(matrix: Array) -> Array:
    """Largest modulus of the eigenvalues of (n, n, ...) matrices, of NumPy or JAX.

    Exact up to two states; to a per mille for more, by repeated squaring.
    """
    xp = matrix.__array_namespace__()
    if matrix.shape[0] == 1:
        return abs(matrix[0, 0])
    if matrix.shape[0] == 2:
        (a, b), (c, d) = matrix
        half, determinant = 0.5 * abs(a + d), a * d - b * c
        square = 0.25 * (a - d) ** 2 + b * c
        real = half + xp.sqrt(xp.maximum(square, 0.0))
        return xp.where(square >= 0, real, xp.sqrt(abs(determinant)))
    log_scale = xp.zeros(matrix.shape[2:])
    for k in range(12):
        size = abs(matrix).max((0, 1)) + 1e-300
        log_scale = log_scale + xp.log(size) / 2**k
        matrix = matrix / size
        matrix = product(matrix, matrix)
    return xp.exp(log_scale + xp.log(abs(matrix).max((0, 1)) + 1e-300) / 2**12)


def spectral_abscissa(matrix: Array) -> Array:
    """Largest real part of the eigenvalues of (n, n, ...) matrices, NaN where not finite.

    Of NumPy or JAX arrays.

    In closed form up to two states. For more by LAPACK, which balances matrices: those of motion
    with inertia have entries that differ by many orders of magnitude, and entries larger than any
    eigenvalue. A program must not call it twice, see above.
    """
    n, xp = matrix.shape[0], matrix.__array_namespace__()
    if n == 1:
        return matrix[0, 0]
    if n == 2:
        (a, b), (c, d) = matrix
        square = 0.25 * (a - d) ** 2 + b * c
        return 0.5 * (a + d) + xp.sqrt(xp.maximum(square, 0.0))
    finite = xp.isfinite(matrix).all((0, 1))
    points_first = xp.moveaxis(xp.where(finite, matrix, 0.0), (0, 1), (-2, -1))
    if xp is jnp:
        points_first = jax.lax.stop_gradient(points_first)
    values = xp.linalg.eigvals(points_first)
    return xp.where(finite, values.real.max(-1), np.nan)
