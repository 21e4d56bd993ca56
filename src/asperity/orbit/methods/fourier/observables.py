"""Observables of a Fourier orbit: mean, harmonics and the logarithm of the monodromy matrix.

The fundamental matrix is Q(tau) exp(L tau) with Q periodic of mean 1, which obeys
dQ/dtau = J Q - Q L and is found by the iteration that finds the orbit; the multipliers are
exp(2 pi eig L).
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.small_systems import Matrix, inverse_points
from asperity.loads import Modulation
from asperity.orbit.methods.fourier.orbit import (
    FourierOrbit,
    LoadCycle,
    States,
    grid,
    jacobian,
    load_cycle,
    rates_on,
    together,
)
from asperity.orbit.observables import Observables
from asperity.slider import QuasiStatic

#: On the estimated error of L.
_FLOQUET_TOLERANCE = 1e-12


def fourier_observables(
    system: QuasiStatic,
    load: Modulation,
    orbit: FourierOrbit,
    *,
    harmonics: int,
    max_steps: int,
) -> tuple[Observables, Array]:
    """Observables of a converged orbit, and their estimated error, (points,).

    The error is the largest of those of the orbit, of the Floquet iteration and of the truncation.

    Parameters
    ----------
    system, load
        As given to `fourier_orbit`.
    orbit : FourierOrbit
    harmonics : int
        Their number.
    max_steps : int
        Bound on the steps of the Floquet iteration.
    """
    cycle = load_cycle(load, len(orbit.rest[0]), orbit.grading)
    mean, phasors = force_spectrum(system, cycle, orbit.mean, orbit.rest, harmonics)
    states = together(orbit.mean, orbit.rest)
    _, push = jax.linearize(rates_on(system, cycle), *states)
    stretch = cycle.stretch[:, None]
    J = [[stretch * entry for entry in row] for row in jacobian(push, states)]
    trace = sum(row[i].mean(0) for i, row in enumerate(J))
    exponent, floquet_error = _floquet_exponent(cycle, J, max_steps)
    error = orbit_error(system, cycle, orbit, harmonics)
    zero = jnp.zeros_like(mean)
    observables = Observables(
        mean,
        phasors,
        jnp.full_like(exponent, jnp.nan),
        zero,
        2 * jnp.pi * trace,
        2 * jnp.pi * exponent,
        jnp.full_like(mean, jnp.inf),
        orbit.start,
    )
    return observables, jnp.maximum(error, floquet_error)


def orbit_error(
    system: QuasiStatic, cycle: LoadCycle, orbit: FourierOrbit, harmonics: int
) -> Array:
    """Estimated error of mean and harmonics: of the iteration or of the truncation, (points,)."""
    error = jnp.maximum(orbit.error, truncation(orbit.rest[0], harmonics))
    # An interface that sticks for part of the period has kinks, which no Fourier series resolves.
    states = jnp.stack(together(orbit.mean, orbit.rest))
    sticks = jnp.isneginf(system.log_slip(states, cycle.at)).any(0)
    return jnp.where(sticks, jnp.inf, error)


def force_spectrum(
    system: QuasiStatic, cycle: LoadCycle, mean: States, rest: States, harmonics: int
) -> tuple[Array, Array]:
    """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
    constant, force = system.force_split(jnp.stack(mean), jnp.stack(rest), cycle.at)
    return spectrum(cycle, constant, force, harmonics)


def spectrum(
    cycle: LoadCycle, constant: Array, force: Array, harmonics: int
) -> tuple[Array, Array]:
    """The same of a constant, shape (points,), plus a rest on the grid, (nodes, points)."""
    angle = np.arange(harmonics + 1)[:, None] * cycle.theta
    # One product for all: a mean, cosines and sines.
    waves = (np.concatenate([np.cos(angle), -np.sin(angle[1:])]) * cycle.share) @ force
    cosine, sine = waves[1 : harmonics + 1], waves[harmonics + 1 :]
    return constant + waves[0], 2 * jax.lax.complex(cosine, sine)


def truncation(waves: Array, harmonics: int) -> Array:
    """Estimate of the aliasing error of the harmonics from the end of the spectrum in tau.

    Parameters
    ----------
    waves : array, shape (nodes, points)
    harmonics : int

    Returns
    -------
    array, shape (points,)

    Notes
    -----
    A coefficient of order nodes - n aliases into order n. The spectra fall off at least
    geometrically, so that coefficient is about the square of the one at (nodes - n) / 2.
    """
    nodes = len(waves)
    orders = np.array([1, 2, *range((nodes - harmonics) // 2, nodes // 2)])[:, None]
    angle = orders * grid(nodes)[0]
    power = (np.cos(angle) @ waves) ** 2 + (np.sin(angle) @ waves) ** 2
    scale = jnp.sqrt(power[0]) * jnp.sqrt(jnp.minimum(power[0], power[1]))
    return power[2:].max(0) / (scale + 1e-300)


def _floquet_exponent(cycle: LoadCycle, J: Matrix, max_steps: int) -> tuple[Array, Array]:
    """L, shape (size, size, points), and 0 where it converged, else inf.

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
