"""The fast method: Fourier collocation for orbits that move little within a period.

The states are split into means and zero-mean parts. One step of the iteration

1. evaluates the rates and their derivatives on a uniform grid in tau,
2. moves the means by Newton's method, so that the mean rates vanish,
3. integrates the zero-mean rest spectrally, which gives the new zero-mean part.

It is a linear iteration that contracts by about the change of the slip exponent in a period, a few
hundredths in the regime of Bureau et al.; where it does not contract, the orbit is left to
`asperity.solve.collocation`. The zero-mean part is carried on its own, so the harmonics keep
their relative accuracy however small they are.

Grid: theta = tau + g sin(tau) puts the nodes where the load is lightest and the slip pulse narrow.
The nodes are half-shifted and symmetric about theta = 0, so w is even, integration maps even
functions to odd ones, and the matrices halve.

Floquet: the fundamental matrix is Q(tau) exp(L tau) with Q periodic of mean 1, which obeys
dQ/dtau = J Q - Q L and is found by the same iteration; the multipliers are
exp(2 pi eig L).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.solve.averaged import averaged_states
from asperity.solve.linear import expm_points, jacobian_columns, solve_points

#: A change this small is round-off of the slip exponent: it no longer shrinks, and need not.
_ROUND_OFF = 1e-12

#: On the change of L: multipliers are exp(2 pi eig L), and the last change overstates the error.
_FLOQUET_TOLERANCE = 1e-10


class FourierOrbit(NamedTuple):
    """A periodic orbit on the half grid; `even` and `odd` parts are (size, nodes/2, points)."""

    mean: Array
    even: Array
    odd: Array
    error: Array
    steps: Array


@lru_cache
def _half_grid(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes in (0, pi) and the matrices that integrate even and odd functions of tau."""
    half = nodes // 2
    tau = 2 * np.pi * (np.arange(half) + 0.5) / nodes
    k = np.arange(1, half)[:, None]
    cosine, sine = np.cos(k * tau), np.sin(k * tau)
    even_to_odd = (sine / k).T @ cosine * (4 / nodes)
    odd_to_even = -(cosine / k).T @ sine * (4 / nodes)
    return tau, even_to_odd, odd_to_even


class _Cycle(NamedTuple):
    """The load cycle on the half grid."""

    theta: Array
    stretch: Array  # dtheta/dtau
    w: Array
    w_slope: Array
    even_to_odd: Array
    odd_to_even: Array

    def integrate(self, even: list[Array], odd: list[Array]) -> tuple[list[Array], list[Array]]:
        """Zero-mean antiderivative in tau of even + odd."""
        new_odd = [self.even_to_odd @ e for e in even]
        new_even = [self.odd_to_even @ o for o in odd]
        return new_even, new_odd


def _cycle(load, nodes: int, grading: float) -> _Cycle:
    tau, even_to_odd, odd_to_even = _half_grid(nodes)
    tau = tau[:, None]
    theta = jnp.asarray(tau + grading * np.sin(tau))
    stretch = jnp.asarray(1 + grading * np.cos(tau))
    return _Cycle(
        theta,
        stretch,
        load.load(theta),
        load.slope(theta),
        jnp.asarray(even_to_odd),
        jnp.asarray(odd_to_even),
    )


class _Linearised(NamedTuple):
    """Rates per tau and their derivatives, in even and odd parts: rates[i], jacobian[j][i]."""

    even: list[Array]
    odd: list[Array]
    columns_even: list[list[Array]]
    columns_odd: list[list[Array]]


def _linearise(system, cycle: _Cycle, mean: Array, even: Array, odd: Array) -> _Linearised:
    def side(sign: float) -> tuple[Array, list[Array]]:
        Y = jnp.stack([m + (e + sign * o) for m, e, o in zip(mean, even, odd, strict=True)])
        return jacobian_columns(
            lambda Y: cycle.stretch * system.rates(Y, cycle.w, sign * cycle.w_slope), Y
        )

    (right, right_columns), (left, left_columns) = side(1.0), side(-1.0)
    n = len(mean)

    def parts(a: Array, b: Array) -> tuple[list[Array], list[Array]]:
        return (
            [0.5 * (a[i] + b[i]) for i in range(n)],
            [0.5 * (a[i] - b[i]) for i in range(n)],
        )

    rate_even, rate_odd = parts(right, left)
    columns = [parts(a, b) for a, b in zip(right_columns, left_columns, strict=True)]
    return _Linearised(rate_even, rate_odd, [c[0] for c in columns], [c[1] for c in columns])


def _matrix_of_means(columns: list[list[Array]]) -> Array:
    return jnp.stack([jnp.stack([c.mean(0) for c in column]) for column in columns], axis=1)


def _step(system, cycle: _Cycle, mean: Array, even: Array, odd: Array) -> tuple:
    lin = _linearise(system, cycle, mean, even, odd)
    n = len(mean)
    residual = jnp.stack([r.mean(0) for r in lin.even])
    change = solve_points(_matrix_of_means(lin.columns_even), -residual)
    rate_even = [
        lin.even[i] + sum(change[j] * lin.columns_even[j][i] for j in range(n)) for i in range(n)
    ]
    rate_odd = [
        lin.odd[i] + sum(change[j] * lin.columns_odd[j][i] for j in range(n)) for i in range(n)
    ]
    new_even, new_odd = cycle.integrate(rate_even, rate_odd)
    return mean + change, jnp.stack(new_even), jnp.stack(new_odd), jnp.abs(change).max(0)


def _relative_change(
    new_even: Array, new_odd: Array, even: Array, odd: Array, kappa: Array
) -> Array:
    """Largest change of the zero-mean parts: z relative to its size, log states absolutely.

    The rate of z is kappa times a number with the round-off of 1, which bounds what a vanishing
    z can mean.
    """
    moved = jnp.maximum(jnp.abs(new_even - even), jnp.abs(new_odd - odd)).max(1)
    size = jnp.maximum(jnp.abs(new_even), jnp.abs(new_odd)).max(1)
    return jnp.maximum(moved[0] / (size[0] + 1e-3 * kappa), moved[1:].max(0, initial=0.0))


def fourier_orbit(
    system, load, points: int, *, nodes: int, grading: float, tolerance: float, max_steps: int
) -> FourierOrbit:
    """Iterate to the periodic orbit of every operating point.

    Parameters
    ----------
    system : QuasiStatic
        Parameters of shape (points,).
    load : Harmonic
        Even in theta.
    points : int
        Number of operating points.
    nodes : int
        Grid points per period, even.
    grading : float
        g in theta = tau + g sin(tau), 0 <= g < 1.
    tolerance : float
        Bound on the error estimated from the observed contraction.
    max_steps : int

    Returns
    -------
    FourierOrbit
        `error` holds the estimate; inf where the iteration does not contract.
    """
    cycle = _cycle(load, nodes, grading)
    weights = cycle.stretch * (2 / nodes) * jnp.ones(points)
    mean = averaged_states(system, cycle.w, weights)
    zero = jnp.zeros((system.size, nodes // 2, points))
    far = jnp.full(points, jnp.inf)

    def unfinished(carry) -> Array:
        *_, change, error, steps = carry
        return (steps < max_steps) & jnp.any((error > tolerance) & ~jnp.isnan(change))

    def body(carry) -> tuple:
        mean, even, odd, change, _, steps = carry
        mean, new_even, new_odd, moved = _step(system, cycle, mean, even, odd)
        new_change = jnp.maximum(
            moved, _relative_change(new_even, new_odd, even, odd, system.kappa)
        )
        # A contraction by r leaves r / (1 - r) of the last change; none is assumed at first.
        contraction = jnp.where(jnp.isinf(change), 0.5, new_change / change)
        error = jnp.where(contraction < 1, new_change * contraction / (1 - contraction), jnp.inf)
        error = jnp.where(new_change < _ROUND_OFF, new_change, error)
        return mean, new_even, new_odd, new_change, error, steps + 1

    mean, even, odd, change, error, steps = jax.lax.while_loop(
        unfinished, body, (mean, zero, zero, far, far, 0)
    )
    return FourierOrbit(mean, even, odd, jnp.where(jnp.isnan(change), jnp.inf, error), steps)


class FourierResponse(NamedTuple):
    """What is read off an orbit; F/W0 = mean + sum Re(c_n e^{i n theta})."""

    mean_friction: Array
    harmonics: Array  # complex, (count, points)
    monodromy: Array  # (size, size, points)
    log_determinant: Array  # of the monodromy matrix, by Liouville's formula
    error: Array  # of the orbit, of the Floquet iteration and of the truncation, the largest


def fourier_response(
    system, load, orbit: FourierOrbit, *, grading: float, harmonics: int, max_steps: int
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
    half = orbit.even.shape[1]
    cycle = _cycle(load, 2 * half, grading)
    right = system.force_split(orbit.mean, orbit.even + orbit.odd, cycle.w)
    left = system.force_split(orbit.mean, orbit.even - orbit.odd, cycle.w)
    even = 0.5 * (right[1] + left[1]) * cycle.stretch
    odd = 0.5 * (right[1] - left[1]) * cycle.stretch
    angle = jnp.arange(1, harmonics + 1)[:, None] * cycle.theta[:, 0]
    phasors = (jnp.cos(angle) @ even - 1j * (jnp.sin(angle) @ odd)) * (2 / half)
    lin = _linearise(system, cycle, *orbit[:3])
    trace = sum(lin.columns_even[i][i].mean(0) for i in range(len(orbit.mean)))
    monodromy, floquet_error = _monodromy(cycle, lin, orbit, max_steps)
    error = jnp.maximum(jnp.maximum(orbit.error, floquet_error), _truncation(orbit))
    mean = right[0] + even.mean(0)
    return FourierResponse(mean, phasors, monodromy, 2 * jnp.pi * trace, error)


def fourier_waveform(system, load, orbit: FourierOrbit, *, grading: float, phases: int) -> Array:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points)."""
    if phases == 0:
        return jnp.zeros((2, 0, orbit.mean.shape[-1]))
    half = orbit.even.shape[1]
    theta = 2 * np.pi * np.arange(phases) / phases
    tau = theta.copy()
    for _ in range(60):  # Newton's method for Kepler's equation
        tau = tau - (tau + grading * np.sin(tau) - theta) / (1 + grading * np.cos(tau))
    nodes, k = _half_grid(2 * half)[0], np.arange(1, half)[:, None]
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
    cycle: _Cycle, lin: _Linearised, orbit: FourierOrbit, max_steps: int
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

    def body(carry) -> tuple:
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

    def unfinished(carry) -> Array:
        change, steps = carry[-2:]
        return (steps < max_steps) & jnp.any((change > _FLOQUET_TOLERANCE) & (change < 1e3))

    points = orbit.mean.shape[-1]
    zero = jnp.zeros((n, *orbit.even.shape))
    start = (zero, zero, jnp.zeros((n, n, points)), jnp.full(points, 1e2), 0)
    _, _, exponent, change, _ = jax.lax.while_loop(unfinished, body, start)
    change = jnp.where(change < _FLOQUET_TOLERANCE, 0.0, jnp.inf)
    return expm_points(2 * jnp.pi * exponent), change
