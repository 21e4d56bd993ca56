"""Implicit steps: Radau collocation with five stages, of order 9, for stiff equations.

    Z_i = h sum_j a_ij f(t + c_j h, Y + Z_j),        Y_new = Y + Z_5,

solved by simplified Newton iterations in the eigenvectors of the matrix a, which splits them into
one real and two complex systems of the size of one state. The displacement, on which no rate
depends, is a quadrature. Dense output is the collocation polynomial.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. (Springer,
1996), section IV.8; J. Comput. Appl. Math. 111, 93 (1999) for other numbers of stages. The
coefficients are computed from their definition.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.runge_kutta import radau_iia
from asperity.algebra.small_systems import solve_columns, spectral_radius, value_and_jacobian
from asperity.transients.dense_output import Interval, StepChunk
from asperity.transients.equations import SegmentEquations, Tolerances
from asperity.transients.one_kernel import one_kernel
from asperity.transients.step_size import TrialStep, run_steps

STAGES = 5
_SAFETY = 0.9
_LIMITS = 0.1, 8.0

_NEWTON_STEPS = 10
#: Newton's method ends when the estimated error is this share of the tolerance.
_NEWTON_SHARE = 0.01

#: Product of step and largest eigenvalue below which explicit steps would cost less.
_MILD = 8.0


class _ModalTableau(NamedTuple):
    """The Radau method of s stages, in the eigenvectors of the inverse of its matrix a."""

    c: np.ndarray  # (s,)
    a: np.ndarray  # (s, s)
    inverse: np.ndarray  # of a
    eigenvalues: np.ndarray  # of the inverse: the real one and those with Im > 0, (pairs,)
    to_modes: np.ndarray  # (pairs, s)
    from_modes: np.ndarray  # (s, pairs); the real part of the sum
    error: np.ndarray  # (s,), weights of Z in the error estimate
    powers: np.ndarray  # (s + 1, s): polynomial through 0 and Z in rising powers


@cache
def _tableau() -> _ModalTableau:
    scheme, s = radau_iia(STAGES), STAGES
    c, a, k = scheme.c, scheme.a, np.arange(1, STAGES + 1)
    inverse = np.linalg.inv(a)
    values, vectors = np.linalg.eig(inverse)
    kept = np.flatnonzero(values.imag > -1e-9)
    kept = kept[np.argsort(np.abs(values[kept].imag))]
    # A complex pair adds twice its real part.
    twice = np.where(np.abs(values[kept].imag) < 1e-9, 1.0, 2.0)
    # An embedded quadrature of order s on the same points and on t itself. The weight of t is the
    # real eigenvalue, so that the matrix that is factorised already damps the stiff components of
    # the error.
    gamma = 1 / values[kept[0]].real
    weights = (1 / k - gamma * (k == 1)) @ scheme.monomials
    # The polynomial is t times the one through Z/c.
    powers = np.vstack([np.zeros(s), scheme.monomials / c])
    return _ModalTableau(
        c, a, inverse, values[kept], np.linalg.inv(vectors)[kept], vectors[:, kept] * twice,
        (weights - a[-1]) @ inverse, powers,
    )  # fmt: skip


class _LastStep(NamedTuple):
    """The last accepted step, from which the guess of the next is extrapolated."""

    polynomial: Array  # (s + 1, size)
    length: Array  # 0 before the first


@one_kernel
def advance(system: SegmentEquations, interval: Interval, tolerances: Tolerances) -> StepChunk:
    """Integrate over an interval, as `run_steps`, with dense output."""
    powers = jnp.asarray(_tableau().powers)

    def attempt(t: Array, Y: Array, h: Array, last: _LastStep) -> TrialStep:
        scale = system.scale(Y, tolerances)
        Z, error, steps, slope = _step(system, t, Y, h, _extrapolated(last, Y, h), scale)
        # After many Newton iterations the step should not grow.
        safety = _SAFETY * (2 * _NEWTON_STEPS + 1) / (2 * _NEWTON_STEPS + steps)
        factor = safety * error ** (-1 / (STAGES + 1))
        piece = (powers @ Z.T).at[0].set(Y)
        return TrialStep(Y + Z[:, -1], error, factor, _LastStep(piece, h), h * slope < _MILD, piece)

    none = _LastStep(jnp.zeros((STAGES + 1, system.motion.size + 1)), jnp.zeros(()))
    return run_steps(system, interval, attempt, none, _LIMITS)


def _extrapolated(last: _LastStep, Y: Array, h: Array) -> Array:
    """The last polynomial extrapolated to the stages, less the state, shape (size, stages)."""
    # Far beyond its step the polynomial is inaccurate; before the first step there is none.
    near = h < 3 * last.length
    share = 1 + h / jnp.where(near, last.length, h) * jnp.asarray(_tableau().c)
    ahead = last.polynomial[STAGES][:, None]
    for power in range(STAGES - 1, -1, -1):
        ahead = ahead * share + last.polynomial[power][:, None]
    return jnp.where(near, ahead - Y[:, None], 0.0)


def _step(
    system: SegmentEquations, t: Array, Y: Array, h: Array, guess: Array, scale: Array
) -> tuple[Array, Array, Array, Array]:
    """Stages Z, shape (size, stages), error, Newton iterations, and largest eigenvalue."""
    table = _tableau()
    n = Y.shape[0] - 1
    now, at = system.at(t), system.at(t + jnp.asarray(table.c) * h)
    value, slopes = value_and_jacobian(lambda y: system.rates(now, jnp.append(y, 0.0)), Y[:n])
    jacobian = slopes[:n]
    values = jnp.asarray(table.eigenvalues)
    identity = jnp.eye(n)[:, :, None]
    matrices = identity * values / h - jacobian[:, :, None]
    inverses = solve_columns(matrices, jnp.broadcast_to(identity + 0j, matrices.shape))

    inertness_now = jnp.reshape(system.motion.inertness(Y[:n], now), (-1, 1))

    def newton(carry: tuple) -> tuple:
        Z, steps, change, _ = carry
        rates, _ = system.motion_rates(at, Y[:n, None] + Z)
        inertness = system.motion.inertness(Y[:n, None] + Z, at)
        residual = (rates - Z @ table.inverse.T / h) * (inertness / inertness_now)
        modes = residual @ table.to_modes.T
        correction = (jnp.einsum("ijk,jk->ik", inverses, modes) @ table.from_modes.T).real
        size = jnp.sqrt(jnp.mean(jnp.square(correction / scale[:n, None])))
        return Z + correction, steps + 1, size, size / change

    def unfinished(carry: tuple) -> Array:
        _, steps, size, rate = carry
        hopeless = (steps > 1) & (rate > 2)
        return (steps < _NEWTON_STEPS) & (_remaining_change(size, rate) > _NEWTON_SHARE) & ~hopeless

    start = (guess[:n], jnp.asarray(0), jnp.asarray(1.0), jnp.asarray(1.0))
    Z, steps, size, rate = jax.lax.while_loop(unfinished, newton, start)
    converged = _remaining_change(size, rate) <= _NEWTON_SHARE
    _, x_rate = system.motion_rates(at, Y[:n, None] + Z)
    x = h * (jnp.asarray(table.a) @ (x_rate * jnp.ones(STAGES)))
    Z = jnp.concatenate([Z, x[None]])
    real = table.eigenvalues[0].real
    raw = h * value / real + Z @ table.error
    filtered = (inverses[:, :, 0].real @ raw[:n]) * real / h
    error = jnp.concatenate([filtered, raw[n:]]) / scale
    size = jnp.sqrt(jnp.mean(jnp.square(error)))
    return Z, jnp.where(converged, size, jnp.inf), steps, spectral_radius(jacobian)


def _remaining_change(size: Array, rate: Array) -> Array:
    """Sum of the corrections still to come, if they fall geometrically."""
    return size * jnp.minimum(rate / jnp.maximum(1 - rate, 1e-3), 1.0)
