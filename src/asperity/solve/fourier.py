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
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.solve.averaged import averaged_states
from asperity.solve.linear import jacobian_columns, solve_points

#: A change this small is round-off of the slip exponent: it no longer shrinks, and need not.
_ROUND_OFF = 1e-12


class FourierOrbit(NamedTuple):
    """A periodic orbit on the half grid; `even` and `odd` parts are (size, nodes/2, points)."""

    mean: Array
    even: Array
    odd: Array
    error: Array
    steps: Array


@lru_cache
def half_grid(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes in (0, pi) and the matrices that integrate even and odd functions of tau."""
    half = nodes // 2
    tau = 2 * np.pi * (np.arange(half) + 0.5) / nodes
    k = np.arange(1, half)[:, None]
    cosine, sine = np.cos(k * tau), np.sin(k * tau)
    even_to_odd = (sine / k).T @ cosine * (4 / nodes)
    odd_to_even = -(cosine / k).T @ sine * (4 / nodes)
    return tau, even_to_odd, odd_to_even


class Cycle(NamedTuple):
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


def load_cycle(load: Harmonic, nodes: int, grading: float) -> Cycle:
    """The load cycle on a grid of `nodes` per period, shape (nodes/2, points)."""
    tau, even_to_odd, odd_to_even = half_grid(nodes)
    tau = tau[:, None]
    theta = jnp.asarray(tau + grading * np.sin(tau))
    stretch = jnp.asarray(1 + grading * np.cos(tau))
    return Cycle(
        theta,
        stretch,
        load.load(theta),
        load.slope(theta),
        jnp.asarray(even_to_odd),
        jnp.asarray(odd_to_even),
    )


class Linearised(NamedTuple):
    """Rates per tau and their derivatives, in even and odd parts: rates[i], jacobian[j][i]."""

    even: list[Array]
    odd: list[Array]
    columns_even: list[list[Array]]
    columns_odd: list[list[Array]]


def linearise(
    system: QuasiStatic, cycle: Cycle, mean: Array, even: Array, odd: Array
) -> Linearised:
    """Rates per tau at mean + even + odd, and their derivatives with respect to the states."""

    def side(sign: float) -> tuple[Array, list[Array]]:
        Y = jnp.stack([m + (e + sign * o) for m, e, o in zip(mean, even, odd, strict=True)])
        return jacobian_columns(
            lambda Y: cycle.stretch * system.rates(Y, cycle.w, sign * cycle.w_slope), Y
        )

    (right, right_columns), (left, left_columns) = side(1.0), side(-1.0)
    rate_even, rate_odd = _parity_parts(right, left)
    columns = [_parity_parts(a, b) for a, b in zip(right_columns, left_columns, strict=True)]
    return Linearised(rate_even, rate_odd, [c[0] for c in columns], [c[1] for c in columns])


def rate_parts(
    system: QuasiStatic, cycle: Cycle, mean: Array, even: Array, odd: Array
) -> tuple[list[Array], list[Array]]:
    """Even and odd parts of the rates per tau alone."""

    def side(sign: float) -> Array:
        Y = mean[:, None] + even + sign * odd
        return cycle.stretch * system.rates(Y, cycle.w, sign * cycle.w_slope)

    return _parity_parts(side(1.0), side(-1.0))


def _parity_parts(right: Array, left: Array) -> tuple[list[Array], list[Array]]:
    """Even and odd parts of functions known at theta and -theta."""
    pairs = list(zip(right, left, strict=True))
    return [0.5 * (a + b) for a, b in pairs], [0.5 * (a - b) for a, b in pairs]


def _matrix_of_means(columns: list[list[Array]]) -> Array:
    return jnp.stack([jnp.stack([c.mean(0) for c in column]) for column in columns], axis=1)


def advance(cycle: Cycle, mean: Array, lin: Linearised) -> tuple[Array, Array, Array, Array]:
    """One step of the iteration: new mean, even and odd parts, and the largest change of a mean."""
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
    system: QuasiStatic,
    load: Harmonic,
    points: int,
    *,
    nodes: int,
    grading: float,
    tolerance: float,
    max_steps: int,
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
    cycle = load_cycle(load, nodes, grading)
    weights = cycle.stretch * (2 / nodes) * jnp.ones(points)
    mean = averaged_states(system, cycle.w, weights)
    zero = jnp.zeros((system.size, nodes // 2, points))
    far = jnp.full(points, jnp.inf)

    def unfinished(carry: tuple) -> Array:
        *_, change, error, steps = carry
        return (steps < max_steps) & jnp.any((error > tolerance) & ~jnp.isnan(change))

    def body(carry: tuple) -> tuple:
        mean, even, odd, change, _, steps = carry
        lin = linearise(system, cycle, mean, even, odd)
        mean, new_even, new_odd, moved = advance(cycle, mean, lin)
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
