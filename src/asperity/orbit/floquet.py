"""Floquet multipliers, and their logarithms where multipliers overflow.

A perturbation of the orbit along an eigenvector is multiplied by a multiplier in each period of the
modulation. Multipliers are sorted by falling modulus; the orbit is stable if all moduli are below
1.

Orbits on meshes have monodromy matrices, which are products of transfer maps. On the grid of the
fast method a periodic change of variables gives the linearised equations constant coefficients L
(Floquet's theorem); the multipliers are exp(2 pi eig L).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.algebra.fourier_grid import antiderivative
from asperity.algebra.small_systems import (
    Matrix,
    add,
    averaged,
    inverse_points,
    multiply,
    product,
    subtract,
)
from asperity.arrays import Complex, Float

#: Logarithm above which a multiplier overflows a double. Its argument, a small difference of large
#: phases, is then unknown, too.
LARGEST_LOG = 709.0

#: Relative agreement of two meshes at which the finer mesh is accurate to 1e-8: with three times
#: the intervals the error is smaller by 3^4 for a stiff orbit, by 3^8 otherwise.
AGREEMENT = 2e-7
#: Multipliers below this modulus are compared absolutely, because no experiment can measure them.
#: The first number is for two multipliers, whose product Liouville's formula gives; the second for
#: more than two, where round-off of large multipliers hides small ones.
_VANISHING = (1e-12, 1e-6)
_LOST_IN_ROUND_OFF = 1e-7


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
        NaN where a matrix is not finite.
    """
    n = monodromy.shape[0]
    with np.errstate(all="ignore"):
        if n == 1:
            return log_determinant[None].astype(complex)
        if n == 2:
            return _log_pair(monodromy, log_scale, log_determinant)
        known = np.isfinite(monodromy).all((0, 1))
        matrices = np.moveaxis(np.where(known, monodromy, 0.0), -1, 0)
        values = np.log(np.linalg.eigvals(matrices).T.astype(complex))
    logs: Complex = sorted_logs(values + log_scale)
    return np.where(known, logs, np.nan)


def log_multipliers_of_exponent(exponent: Any, log_determinant: Any) -> Any:
    """Logarithms of the multipliers from a matrix whose exponential is the monodromy matrix.

    Of NumPy or JAX. A multiplier near 1 has a distance from 1 that a monodromy matrix loses to
    round-off.

    Parameters
    ----------
    exponent : array, shape (n, n, points)
    log_determinant : array, shape (points,)
        Trace of `exponent`, free of cancellation.
    """
    return _principal(_eigenvalues(exponent, log_determinant))


def _eigenvalues(exponent: Any, log_determinant: Any) -> Any:
    """Eigenvalues, (n, points), by falling real part."""
    n, xp = exponent.shape[0], exponent.__array_namespace__()
    if n == 1:
        return log_determinant[None] + 0j
    if n == 2:
        (a, b), (c, d) = exponent
        root = xp.sqrt(0.25 * (a - d) ** 2 + b * c + 0j)
        return 0.5 * log_determinant + xp.stack([root, -root])
    finite = xp.where(xp.isfinite(exponent).all((0, 1)), exponent, 0.0)
    return sorted_logs(xp.linalg.eigvals(xp.moveaxis(finite, -1, 0)).T + 0j)


def _principal(logs: Any) -> Any:
    """Logarithms with arguments in (-pi, pi]."""
    xp = logs.__array_namespace__()
    return logs - 2j * np.pi * xp.ceil(logs.imag / (2 * np.pi) - 0.5)


#: Accepted error of L, and accepted size of the last q where the factor P is wanted.
_EXPONENT_ERROR, _FACTOR_ERROR = 1e-10, 1e-9
#: Largest difference between the trace of 2 pi L and Liouville's formula. Of 20,651 orbits at
#: numbers over decades 117 differ by more than 1e-7, half of them by more than 0.01; the larger
#: multiplier of the others has a relative error of half of that difference.
_LIOUVILLE = 1e-9
_MOST_STEPS = 40


class FloquetForm(NamedTuple):
    """The fundamental matrix P(tau) e^{L tau} of linear equations with a period.

    Attributes
    ----------
    exponent : array, shape (size, size, points)
        2 pi L, whose exponential is similar to the monodromy matrix.
    factor : matrix of arrays, shape (nodes, points), or None
        P, if wanted.
    converged : bool array, shape (points,)
    """

    exponent: Array
    factor: Matrix | None
    converged: Array


def floquet_form(J: Matrix, integral: np.ndarray, *, factor: bool = False) -> FloquetForm:
    """Exponent and periodic factor of the fundamental matrix.

    Parameters
    ----------
    J : matrix of arrays, shape (nodes, points)
        Derivatives of the rates to the states, per unit of tau, on that grid.
    integral : array, shape (nodes, nodes)
        The matrix of `asperity.algebra.fourier_grid.grid`.
    factor : bool
        Whether P is wanted, which takes about twice as many steps.

    Notes
    -----
    Let L be the mean of J and q the zero-mean antiderivative of J - L. With y = (1 + q) z, the
    equation dy/dtau = J y becomes

        dz/dtau = R z,      R = (1 + q)^-1 (L + J q),

    and R varies less than J by a factor of the size of L and q. Each step applies this to the R of
    the step before; P is the product of all 1 + q. The error of L is about the square of the
    variation that is left.

    Where 1 + q is singular at some phase there is no such change of variables, and the steps may
    converge to a wrong L. Its trace shows this, because otherwise the steps keep the trace.
    """
    n = range(len(J))
    accepted = _FACTOR_ERROR if factor else _EXPONENT_ERROR

    def step(carry: tuple) -> tuple:
        R, L, P, last, _, steps = carry
        q = [[antiderivative(integral, a) for a in row] for row in subtract(R, L)]
        inverse = inverse_points([[q[i][j] + float(i == j) for j in n] for i in n])
        R = multiply(inverse, add(L, multiply(R, q)))
        new = _means(R)
        change = jnp.stack([jnp.abs(new[i][j] - L[i][j]) for i in n for j in n]).max(0)
        error = jnp.minimum(change, change**2 / (last + 1e-300))
        if factor:
            P = add(P, multiply(P, q))
            error = jnp.stack([jnp.abs(a) for row in q for a in row]).max((0, 1))
        return R, new, P, change, error, steps + 1

    def unfinished(carry: tuple) -> Array:
        *_, change, error, steps = carry
        # A diverging iteration becomes large or NaN, which ends it.
        return (steps < _MOST_STEPS) & jnp.any((error > accepted) & (change < 1e3))

    none = jnp.zeros(J[0][0].shape[1])
    identity = [[float(i == j) + 0 * J[i][j] for j in n] for i in n] if factor else None
    start = (J, _means(J), identity, none + 1.0, none + 1.0, 0)
    _, L, P, _, error, _ = jax.lax.while_loop(unfinished, step, start)
    stacked = 2 * jnp.pi * jnp.stack([jnp.stack(row) for row in L])
    kept = 2 * jnp.pi * sum(row[i] for i, row in enumerate(_means(J)))
    valid = jnp.abs(jnp.trace(stacked) - kept) <= _LIOUVILLE
    return FloquetForm(stacked, P, (error <= accepted) & valid)


@jax.custom_jvp
def log_multipliers_along(J: Matrix, integral: np.ndarray) -> Array:
    """ln|m| + i arg m, (n, points), with derivatives; arguments as of `floquet_form`.

    At a double multiplier the derivatives are not finite.
    """
    exponent = floquet_form(J, integral).exponent
    return log_multipliers_of_exponent(exponent, jnp.trace(exponent))


@log_multipliers_along.defjvp
def _logs_rule(primals: tuple, tangents: tuple) -> tuple[Array, Array]:
    """First-order perturbation theory: d ln m = 2 pi < tr(S P^-1 dJ P) >.

    S is the projector on the eigenspace of m, prod_j (L - l_j)/(l_m - l_j) over the other
    eigenvalues.
    """
    (J, integral), (dJ, _) = primals, tangents
    n = range(len(J))
    exponent, P, _ = floquet_form(J, integral, factor=True)
    logs = _eigenvalues(exponent, jnp.trace(exponent))
    back = inverse_points(P)
    changes = []
    for m in n:
        projector = jnp.eye(len(J))[..., None] + 0 * exponent
        for j in n:
            if j != m:
                other = exponent - logs[j] * jnp.eye(len(J))[..., None]
                projector = product(projector, other / (logs[m] - logs[j]))
        weights = multiply(multiply(P, [list(row) for row in projector]), back)
        change = sum(weights[j][i] * dJ[i][j] for i in n for j in n)
        changes.append(2 * jnp.pi * change.mean(0))
    return _principal(logs), jnp.stack(changes)


def _means(entries: Matrix) -> Matrix:
    """Means over tau, as products with a vector: XLA's reductions would be slower."""
    nodes = len(entries[0][0])
    return averaged(entries, np.full(nodes, 1 / nodes))


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
    """Largest relative change of multipliers, shape (points,); inf where a multiplier is unknown.

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
        # Where multipliers overflow, their logarithms are compared.
        turned = np.abs(np.exp(1j * (before.imag - now.imag)) - 1)
        changes = np.abs(before.real - now.real) / np.abs(now.real)
        gaps = np.where(now.real > LARGEST_LOG, np.maximum(changes, turned), gaps)
    # A multiplier that vanishes has the logarithm -inf; it is known.
    return np.where(np.isnan(gaps), np.inf, gaps).max(0, initial=0.0)


#: Bifurcations by the argument of the leading multiplier where it leaves the unit circle.
FOLD, PERIOD_DOUBLING, NEIMARK_SACKER = "fold", "period doubling", "Neimark-Sacker"


def kind_of_crossing(logs: Complex, real: float = 1e-12) -> NDArray[np.object_]:
    """Bifurcation at which a multiplier leaves the unit circle, by its argument; "" if unknown.

    Real and positive: a fold. Real and negative: period doubling, a response that repeats only
    after two periods. A complex pair: Neimark-Sacker, a slow oscillation on top of the modulation.

    Parameters
    ----------
    logs : complex array
        ln|m| + i arg m.
    real : float
        Multipliers whose argument is closer than this to 0 or pi (rad) are real.
    """
    angle = np.abs(logs.imag)
    kinds = np.full(logs.shape, NEIMARK_SACKER, dtype=object)
    kinds[angle < real] = FOLD
    kinds[np.abs(angle - np.pi) < real] = PERIOD_DOUBLING
    kinds[np.isnan(angle) | np.isnan(logs.real)] = ""
    return kinds


def without_lost_arguments(logs: Complex) -> Complex:
    """Logarithms with NaN for the argument of a multiplier that overflows."""
    kept = logs.copy()
    kept.imag[logs.real > LARGEST_LOG] = np.nan
    return kept


def sorted_logs(logs: Any) -> Any:
    """By falling real part; of a complex pair the one with the positive argument first."""
    xp = logs.__array_namespace__()
    # The logarithm of a disturbance that vanishes within a period is -inf.
    margin = 1e-9 * (1 + xp.minimum(abs(logs.real), 1e300))
    order = xp.argsort(-logs.real - margin * xp.sign(logs.imag), axis=0, stable=True)
    return xp.take_along_axis(logs, order, axis=0)
