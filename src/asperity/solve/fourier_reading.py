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
    Linearised,
    half_grid,
    linearise,
    load_cycle,
)
from asperity.solve.linear import expm_points

#: On the change of L: multipliers are exp(2 pi eig L), and the last change overstates the error.
_FLOQUET_TOLERANCE = 1e-10


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
    cycle = load_cycle(load, 2 * orbit.even.shape[1], grading)
    mean, phasors = force_spectrum(system, cycle, orbit.mean, orbit.even, orbit.odd, harmonics)
    lin = linearise(system, cycle, *orbit[:3])
    trace = sum(lin.columns_even[i][i].mean(0) for i in range(len(orbit.mean)))
    monodromy, floquet_error = _monodromy(cycle, lin, orbit, max_steps)
    error = jnp.maximum(jnp.maximum(orbit.error, floquet_error), _truncation(orbit))
    return FourierResponse(mean, phasors, monodromy, 2 * jnp.pi * trace, error)


def force_spectrum(
    system: QuasiStatic, cycle: Cycle, mean: Array, even: Array, odd: Array, harmonics: int
) -> tuple[Array, Array]:
    """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
    constant, right = system.force_split(mean, even + odd, cycle.w)
    _, left = system.force_split(mean, even - odd, cycle.w)
    force_even = 0.5 * (right + left) * cycle.stretch
    force_odd = 0.5 * (right - left) * cycle.stretch
    angle = jnp.arange(1, harmonics + 1)[:, None] * cycle.theta[:, 0]
    phasors = jnp.cos(angle) @ force_even - 1j * (jnp.sin(angle) @ force_odd)
    return constant + force_even.mean(0), phasors * (2 / cycle.theta.shape[0])


def fourier_waveform(
    system: QuasiStatic, load: Harmonic, orbit: FourierOrbit, *, grading: float, phases: int
) -> Array:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points)."""
    if phases == 0:
        return jnp.zeros((2, 0, orbit.mean.shape[-1]))
    half = orbit.even.shape[1]
    theta = 2 * np.pi * np.arange(phases) / phases
    tau = theta.copy()
    for _ in range(60):  # Newton's method for Kepler's equation
        tau = tau - (tau + grading * np.sin(tau) - theta) / (1 + grading * np.cos(tau))
    nodes, k = half_grid(2 * half)[0], np.arange(1, half)[:, None]
    even = (2 / half) * np.cos(k * tau).T @ np.cos(k * nodes)
    odd = (2 / half) * np.sin(k * tau).T @ np.sin(k * nodes)
    Y = jnp.stack(
        [m + even @ e + odd @ o for m, e, o in zip(orbit.mean, orbit.even, orbit.odd, strict=True)]
    )
    w = load.load(jnp.asarray(theta)[:, None])
    return jnp.stack([system.force(Y, w), system.log_slip(Y, w)])


def _truncation(orbit: FourierOrbit) -> Array:
    """Estimate of the aliasing error of the harmonics from the end of the spectrum in tau.

    A coefficient of order nodes - n aliases into order n. The spectra fall off at least
    geometrically, so that coefficient is about the square of the one at nodes / 2.
    """
    half = orbit.even.shape[1]
    tau = np.pi * (np.arange(half) + 0.5) / half
    last = np.arange(half - 4, half)[:, None]
    spectrum = jnp.hypot(
        jnp.cos(last * tau) @ orbit.even[0], jnp.sin(last * tau) @ orbit.odd[0]
    ).max(0)
    first = jnp.hypot(np.cos(tau) @ orbit.even[0], np.sin(tau) @ orbit.odd[0])
    second = jnp.hypot(np.cos(2 * tau) @ orbit.even[0], np.sin(2 * tau) @ orbit.odd[0])
    return spectrum**2 / (first * jnp.minimum(first, second) + 1e-300)


def _monodromy(
    cycle: Cycle, lin: Linearised, orbit: FourierOrbit, max_steps: int
) -> tuple[Array, Array]:
    """Monodromy matrix exp(2 pi L), and 0 where L settled, else inf."""
    n = orbit.mean.shape[0]

    def times(even: list[Array], odd: list[Array]) -> tuple[list[Array], list[Array]]:
        """J times a vector with the given parts."""
        ce, co = lin.columns_even, lin.columns_odd
        return (
            [sum(ce[j][i] * even[j] + co[j][i] * odd[j] for j in range(n)) for i in range(n)],
            [sum(ce[j][i] * odd[j] + co[j][i] * even[j] for j in range(n)) for i in range(n)],
        )

    def body(carry: tuple) -> tuple:
        even, odd, exponent, _, steps = carry  # even, odd: Q - 1 as [column][row]
        products = [
            times([even[c][i] + float(i == c) for i in range(n)], list(odd[c])) for c in range(n)
        ]
        new_exponent = jnp.stack(
            [jnp.stack([products[c][0][i].mean(0) for c in range(n)]) for i in range(n)]
        )
        new_even, new_odd = [], []
        for c in range(n):
            q_even = [
                products[c][0][i]
                - new_exponent[i, c]
                - sum(even[k][i] * new_exponent[k, c] for k in range(n))
                for i in range(n)
            ]
            q_odd = [
                products[c][1][i] - sum(odd[k][i] * new_exponent[k, c] for k in range(n))
                for i in range(n)
            ]
            e, o = cycle.integrate(q_even, q_odd)
            new_even.append(jnp.stack(e))
            new_odd.append(jnp.stack(o))
        change = jnp.abs(new_exponent - exponent).max((0, 1))
        return jnp.stack(new_even), jnp.stack(new_odd), new_exponent, change, steps + 1

    def unfinished(carry: tuple) -> Array:
        change, steps = carry[-2:]
        return (steps < max_steps) & jnp.any((change > _FLOQUET_TOLERANCE) & (change < 1e3))

    points = orbit.mean.shape[-1]
    zero = jnp.zeros((n, *orbit.even.shape))
    start = (zero, zero, jnp.zeros((n, n, points)), jnp.full(points, 1e2), 0)
    _, _, exponent, change, _ = jax.lax.while_loop(unfinished, body, start)
    change = jnp.where(change < _FLOQUET_TOLERANCE, 0.0, jnp.inf)
    return expm_points(2 * jnp.pi * exponent), change
