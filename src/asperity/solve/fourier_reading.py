"""What is read off a Fourier orbit: mean, harmonics, waveform and Floquet multipliers.

The fundamental matrix is Q(tau) exp(L tau) with Q periodic of mean 1, which obeys
dQ/dtau = J Q - Q L and is found by the iteration that finds the orbit; the multipliers are
exp(2 pi eig L).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.solve.fourier import (
    Cycle,
    FourierOrbit,
    States,
    grid,
    jacobian,
    load_cycle,
    rates_on,
    together,
)
from asperity.solve.linear import Matrix, expm_points, inverse_points

#: On the estimated error of L.
_FLOQUET_TOLERANCE = 1e-12


class FourierResponse(NamedTuple):
    """What is read off an orbit; F/W0 = mean + sum Re(c_n e^{i n theta})."""

    mean_friction: Array
    harmonics: Array  # complex, (count, points)
    monodromy: Array  # (size, size, points)
    log_determinant: Array  # of the monodromy matrix, by Liouville's formula
    error: Array  # of the orbit, of the Floquet iteration and of the truncation, the largest


def fourier_response(
    system: QuasiStatic,
    load: Harmonic,
    orbit: FourierOrbit,
    *,
    grading: float,
    harmonics: int,
    max_steps: int,
) -> FourierResponse:
    """Mean, harmonics and monodromy matrix of a converged orbit.

    Parameters
    ----------
    system, load, grading
        As given to `fourier_orbit`.
    orbit : FourierOrbit
    harmonics : int
        Number of harmonics.
    max_steps : int
        Bound on the steps of the Floquet iteration.
    """
    cycle = load_cycle(load, len(orbit.rest[0]), grading)
    mean, phasors = force_spectrum(system, cycle, orbit.mean, orbit.rest, harmonics)
    states = together(orbit.mean, orbit.rest)
    _, push = jax.linearize(rates_on(system, cycle), *states)
    stretch = cycle.stretch[:, None]
    J = [[stretch * entry for entry in row] for row in jacobian(push, states)]
    trace = sum(row[i].mean(0) for i, row in enumerate(J))
    exponent, floquet_error = _floquet_exponent(cycle, J, max_steps)
    error = jnp.maximum(orbit.error, _truncation(orbit, harmonics))
    # An interface that sticks for part of the period has kinks, which no Fourier series resolves.
    sticks = jnp.isneginf(system.log_slip(jnp.stack(states), cycle.at)).any(0)
    error = jnp.where(sticks, jnp.inf, error)
    return FourierResponse(
        mean,
        phasors,
        expm_points(2 * jnp.pi * exponent),
        2 * jnp.pi * trace,
        jnp.maximum(error, floquet_error),
    )


def force_spectrum(
    system: QuasiStatic, cycle: Cycle, mean: States, rest: States, harmonics: int
) -> tuple[Array, Array]:
    """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
    constant, force = system.force_split(jnp.stack(mean), jnp.stack(rest), cycle.at)
    angle = np.arange(harmonics + 1)[:, None] * cycle.theta
    # One product for all: a mean, cosines and sines.
    spectrum = (np.concatenate([np.cos(angle), -np.sin(angle[1:])]) * cycle.share) @ force
    cosine, sine = spectrum[1 : harmonics + 1], spectrum[harmonics + 1 :]
    return constant + spectrum[0], 2 * jax.lax.complex(cosine, sine)


def fourier_start(orbit: FourierOrbit) -> Array:
    """The states at theta = 0, shape (size, points)."""
    nodes = len(orbit.rest[0])
    k = np.arange(1, nodes // 2)[:, None]
    interpolate = (2 / nodes) * np.cos(k * grid(nodes)[0]).sum(0)
    return jnp.stack([m + interpolate @ y for m, y in zip(orbit.mean, orbit.rest, strict=True)])


def fourier_waveform(
    system: QuasiStatic, load: Harmonic, orbit: FourierOrbit, *, grading: float, phases: int
) -> Array:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points)."""
    if phases == 0:
        return jnp.zeros((2, 0, orbit.mean[0].shape[-1]))
    nodes = len(orbit.rest[0])
    theta = 2 * np.pi * np.arange(phases) / phases
    tau = theta.copy()
    for _ in range(60):  # Newton's method for Kepler's equation
        tau = tau - (tau + grading * np.sin(tau) - theta) / (1 + grading * np.cos(tau))
    apart = tau[:, None] - grid(nodes)[0]
    interpolate = (2 / nodes) * sum(np.cos(k * apart) for k in range(1, nodes // 2))
    Y = jnp.stack([m + interpolate @ y for m, y in zip(orbit.mean, orbit.rest, strict=True)])
    at = load.at(jnp.asarray(theta)[:, None])
    return jnp.stack([system.force(Y, at), system.log_slip(Y, at)])


def _truncation(orbit: FourierOrbit, harmonics: int) -> Array:
    """Estimate of the aliasing error of the harmonics from the end of the spectrum in tau.

    A coefficient of order nodes - n aliases into order n. The spectra fall off at least
    geometrically, so that coefficient is about the square of the one at (nodes - n) / 2.
    """
    z = orbit.rest[0]
    nodes = len(z)
    orders = np.array([1, 2, *range((nodes - harmonics) // 2, nodes // 2)])[:, None]
    angle = orders * grid(nodes)[0]
    power = (np.cos(angle) @ z) ** 2 + (np.sin(angle) @ z) ** 2
    scale = jnp.sqrt(power[0]) * jnp.sqrt(jnp.minimum(power[0], power[1]))
    return power[2:].max(0) / (scale + 1e-300)


def _floquet_exponent(cycle: Cycle, J: Matrix, max_steps: int) -> tuple[Array, Array]:
    """L, shape (size, size, points), and 0 where it settled, else inf.

    The iteration for Q gains an order of smallness a step. In the states y = Q z of an
    approximate Q,

        dz/dtau = R z,      R = Q^-1 (J Q - dQ/dtau),

    and R is constant but for the error of Q: by averaging, its mean is L to twice the order.
    """
    n = range(len(J))

    def product(q: Matrix) -> Matrix:
        """J (1 + q)."""
        return [[J[i][c] + sum(J[i][j] * q[j][c] for j in n) for c in n] for i in n]

    def body(carry: tuple) -> tuple:
        q, _, last, change, _, steps = carry
        P = product(q)
        L = _means(P)
        slope = [[P[i][c] - L[i][c] - sum(q[i][k] * L[k][c] for k in n) for c in n] for i in n]
        q = [[cycle.integral @ entry for entry in row] for row in slope]
        moved = jnp.stack([jnp.abs(L[i][c] - last[i][c]) for i in n for c in n]).max(0)
        # The next change would be smaller by the contraction; averaging leaves its square.
        error = jnp.minimum(moved, moved**2 / (change + 1e-300)) ** 2
        return q, slope, L, moved, error, steps + 1

    def unfinished(carry: tuple) -> Array:
        *_, change, error, steps = carry
        return (steps < max_steps) & jnp.any((error > _FLOQUET_TOLERANCE) & (change < 1e3))

    zero = [[jnp.zeros_like(entry) for entry in row] for row in J]
    none = jnp.zeros(J[0][0].shape[1])
    start = (zero, zero, [[none for _ in n] for _ in n], none, none + jnp.inf, 0)
    q, slope, _, _, error, _ = jax.lax.while_loop(unfinished, body, start)
    P = product(q)
    rest = [[P[i][c] - slope[i][c] for c in n] for i in n]
    inverse = inverse_points([[q[i][c] + float(i == c) for c in n] for i in n])
    R = [[sum(inverse[i][k] * rest[k][c] for k in n) for c in n] for i in n]
    exponent = jnp.stack([jnp.stack(row) for row in _means(R)])
    return exponent, jnp.where(error < _FLOQUET_TOLERANCE, 0.0, jnp.inf)


def _means(entries: Matrix) -> Matrix:
    """Means over tau, as products with a vector: XLA's reductions would be slower."""
    share = np.full(len(entries[0][0]), 1 / len(entries[0][0]))
    return [[share @ entry for entry in row] for row in entries]
