"""Floquet multipliers from a monodromy matrix, with their logarithms where they overflow.

Sign and order: a perturbation of the orbit is multiplied by a multiplier each period of the
modulation; they are sorted by falling modulus, and the orbit is stable if all moduli are below 1.

For derivatives the same logarithms are functions of JAX arrays, differentiable to any order.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

#: Logarithm above which a multiplier overflows a double. Its argument, a small difference of large
#: phases, is then unknown, too.
LARGEST_LOG = 709.0

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: with three
#: times the intervals the error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7
#: Multipliers below this modulus are compared absolutely, because no experiment can measure them:
#: for two multipliers, whose product Liouville's formula gives, and for more, where round-off of
#: the large ones hides the small ones.
_VANISHING = (1e-12, 1e-6)
_LOST_IN_ROUND_OFF = 1e-7

Complex = NDArray[np.complex128]
Float = NDArray[np.float64]


def log_multipliers(monodromy: Float, log_scale: Float, log_determinant: Float) -> Complex:
    """Natural logarithms ln|m| + i arg m of the multipliers.

    Parameters
    ----------
    monodromy : array, shape (n, n, points)
        Divided by exp(log_scale).
    log_scale : array, shape (points,)
    log_determinant : array, shape (points,)
        Logarithm of the determinant of the whole monodromy matrix, by Liouville's formula.

    Returns
    -------
    array, shape (n, points), sorted by falling real part
    """
    n = monodromy.shape[0]
    with np.errstate(all="ignore"):
        if n == 1:
            return log_determinant[None].astype(complex)
        if n == 2:
            return _log_pair(monodromy, log_scale, log_determinant)
        finite = np.where(np.isfinite(monodromy), monodromy, 0.0)
        values = np.log(np.linalg.eigvals(np.moveaxis(finite, -1, 0)).T.astype(complex))
        logs = values + log_scale
    order = np.argsort(-logs.real, axis=0, kind="stable")
    return np.take_along_axis(logs, order, axis=0)


def log_multipliers_of_exponent(exponent: Float, log_determinant: Float) -> Complex:
    """Logarithms of the multipliers from a matrix whose exponential is the monodromy matrix.

    A multiplier near 1 has a distance from 1 that a monodromy matrix loses to round-off.

    Parameters
    ----------
    exponent : array, shape (n, n, points)
    log_determinant : array, shape (points,)
        Trace of `exponent`, free of cancellation.
    """
    n = exponent.shape[0]
    if n == 1:
        return log_determinant[None].astype(complex)
    if n == 2:
        (a, b), (c, d) = exponent
        root = np.sqrt(0.25 * (a - d) ** 2 + b * c + 0j)
        logs = 0.5 * log_determinant + np.stack([root, -root])
    else:
        logs = np.linalg.eigvals(np.moveaxis(exponent, -1, 0)).T.astype(complex)
    # Arguments in (-pi, pi].
    logs.imag -= 2 * np.pi * np.ceil(logs.imag / (2 * np.pi) - 0.5)
    order = np.argsort(-logs.real, axis=0, kind="stable")
    return np.take_along_axis(logs, order, axis=0)


def _log_pair(monodromy: Float, log_scale: Float, log_determinant: Float) -> Complex:
    """Two multipliers from trace and determinant.

    The larger comes from the trace; the smaller one, lost in the round-off of the matrix when
    they differ by many orders of magnitude, is the determinant over the larger.
    """
    half_trace = 0.5 * (monodromy[0, 0] + monodromy[1, 1])
    determinant = np.exp(log_determinant - 2 * log_scale)
    square = half_trace**2 - determinant
    sign = np.where(half_trace < 0, -1.0, 1.0)
    real = square >= 0
    larger = half_trace + sign * np.sqrt(np.where(real, square, 0.0))
    first = np.where(
        real,
        np.log(np.abs(larger)) + log_scale + 1j * np.where(sign < 0, np.pi, 0.0),
        0.5 * log_determinant + 1j * np.arctan2(np.sqrt(np.where(real, 0.0, -square)), half_trace),
    )
    second = np.where(real, log_determinant - first.real + 1j * first.imag, np.conj(first))
    # Hadamard: entries of this size allow no larger determinant; the transfer maps missed growth.
    missed = determinant > 4 * np.abs(monodromy).max((0, 1)) ** 2
    return np.where(missed, np.nan, np.stack([first, second]))


def from_logs(logs: Complex) -> Complex:
    """Multipliers from their logarithms; a modulus beyond the range of doubles is inf or 0."""
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        modulus = np.exp(logs.real)
        angle = np.where(np.isnan(logs.imag) & ~np.isnan(logs.real), 0.0, logs.imag)
        on_axis = (angle == 0) | (np.abs(angle) == np.pi)
        # A real multiplier has no imaginary part; without this rule inf * 0 would give NaN.
        imaginary = np.where(on_axis, 0.0, modulus * np.sin(angle))
        return modulus * np.cos(angle) + 1j * imaginary


def multiplier_gap(before: Complex, now: Complex) -> Float:
    """Largest relative change of multipliers, shape (points,); inf where not finite.

    Parameters
    ----------
    before, now : complex array, shape (n, points)
        Logarithms of the multipliers.
    """
    several = len(now) > 2
    with np.errstate(all="ignore"):
        old, new = from_logs(before), from_logs(now)
        largest = np.minimum(np.abs(new).max(0, initial=0.0), np.exp(LARGEST_LOG))
        floor = np.maximum(_VANISHING[several], several * _LOST_IN_ROUND_OFF * largest)
        gaps = np.abs(old - new) / np.maximum(np.abs(new), floor)
        # Beyond doubles the logarithms are compared, the multipliers elsewhere.
        turned = np.abs(np.exp(1j * (before.imag - now.imag)) - 1)
        changes = np.abs(before.real - now.real) / np.abs(now.real)
        gaps = np.where(now.real > LARGEST_LOG, np.maximum(changes, turned), gaps)
    finite = (np.isfinite(before) & np.isfinite(now)).all(0)
    return np.where(finite, gaps.max(0, initial=0.0), np.inf)


#: Bifurcations by the argument of the leading multiplier where it leaves the unit circle.
FOLD, PERIOD_DOUBLING, NEIMARK_SACKER = "fold", "period doubling", "Neimark-Sacker"

#: Arguments (rad) below this, and as close to pi, are real multipliers.
_REAL = 1e-12


def kind_of_crossing(logs: Complex) -> NDArray[np.object_]:
    """Bifurcation at which a multiplier leaves the unit circle, by its argument; "" if unknown.

    Real and positive: a fold. Real and negative: period doubling, a response that repeats only
    after two periods. A complex pair: Neimark-Sacker, a slow oscillation on top of the modulation.

    Parameters
    ----------
    logs : complex array
        ln|m| + i arg m.
    """
    angle = np.abs(logs.imag)
    kinds = np.full(logs.shape, NEIMARK_SACKER, dtype=object)
    kinds[angle < _REAL] = FOLD
    kinds[np.abs(angle - np.pi) < _REAL] = PERIOD_DOUBLING
    kinds[np.isnan(angle) | np.isnan(logs.real)] = ""
    return kinds


def without_lost_arguments(logs: Complex) -> Complex:
    """Logarithms with NaN for the argument of a multiplier that overflows."""
    kept = logs.copy()
    kept.imag[logs.real > LARGEST_LOG] = np.nan
    return kept


def differentiable_log_multipliers(exponent: Array) -> Array:
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
    """First-order perturbation theory; the rule calls `eigensystem`, which gives higher orders."""
    values, vectors = eigensystem(*primals)
    turned = jnp.linalg.solve(vectors, tangents[0] @ vectors)
    n = values.shape[-1]
    differences = values[:, None, :] - values[:, :, None] + jnp.eye(n)
    mixed = jnp.where(jnp.eye(n, dtype=bool), 0.0, turned / differences)
    return (values, vectors), (jnp.diagonal(turned, axis1=-2, axis2=-1), vectors @ mixed)
