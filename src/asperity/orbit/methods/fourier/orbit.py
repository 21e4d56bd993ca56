"""The fast method: Fourier collocation for orbits that move little within a period.

The states are split into means and zero-mean parts. One step of the iteration

1. evaluates the rates on a uniform grid in tau,
2. moves the means by a Newton step, so that the mean rates vanish,
3. integrates the zero-mean rest spectrally, which gives the new zero-mean part.

It is a linear iteration that contracts by about the change of the slip exponent in a period, a few
hundredths in the regime of Bureau et al.; where it does not contract, the orbit is left to
`asperity.orbit.methods.collocation`. The means need to contract no faster than the rest, so their
Newton matrix stays that of the averaged limit. The zero-mean part is carried on its own, so the
harmonics keep their relative accuracy however small they are.

Grid: theta = tau + g sin(tau) puts the nodes where the load is lightest and the slip pulse narrow.

States and rates are tuples with an array for each state, not stacks: a stack is written to memory
before it is read, and access to memory limits these programs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.kepler import eccentric_phase
from asperity.algebra.small_systems import Matrix, inverse_points
from asperity.loads import Excitation, Harmonic, Modulation
from asperity.slider import QuasiStatic
from asperity.theory.averaged import averaged_limit

States = tuple[Array, ...]

#: A change this small is round-off of the slip exponent: it no longer shrinks, and need not.
_ROUND_OFF = 1e-12

#: The averaged limit is itself no closer to the orbit than this.
_AVERAGED_TOLERANCE = 1e-2

#: Convergence is looked for at every third node: the changes are smooth.
_LOOKED_AT = slice(1, None, 3)


class FourierOrbit(NamedTuple):
    """A `PeriodicOrbit` on the grid theta = tau + g sin(tau), one array for each state.

    Attributes
    ----------
    mean : tuple of arrays, shape (points,)
    rest : tuple of arrays, shape (nodes, points)
        Of zero mean in tau.
    error : array, shape (points,)
    steps : int
    grading : float
        g.
    """

    mean: States
    rest: States
    error: Array
    steps: Array
    grading: float

    @property
    def start(self) -> Array:
        """States at theta = 0, shape (size, points)."""
        return self._interpolated(np.zeros((1, 1)))[:, 0]

    def states(self, theta: np.ndarray) -> Array:
        """States at the phases `theta`, a column: shape (size, phases, points)."""
        return self._interpolated(eccentric_phase(theta, self.grading))

    def _interpolated(self, tau: np.ndarray) -> Array:
        """States at a column of `tau`, by trigonometric interpolation."""
        nodes = len(self.rest[0])
        apart = tau - grid(nodes)[0]
        kernel = (2 / nodes) * sum(np.cos(k * apart) for k in range(1, nodes // 2))
        # NumPy or JAX, as the arrays are.
        xp = self.rest[0].__array_namespace__()
        return xp.stack([m + kernel @ y for m, y in zip(self.mean, self.rest, strict=True)])


class LoadCycle(NamedTuple):
    """The load cycle on the grid."""

    theta: np.ndarray  # (nodes,)
    stretch: np.ndarray  # (nodes,), dtheta/dtau
    integral: np.ndarray  # (nodes, nodes), zero-mean antiderivative in tau
    at: Excitation  # arrays (nodes, points)

    @property
    def share(self) -> np.ndarray:
        """Weight of each node in a mean over theta, shape (nodes,)."""
        return self.stretch / len(self.stretch)


@lru_cache
def grid(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes tau, the positive ones before their mirror images, and the integrating matrix."""
    positive = 2 * np.pi * (np.arange(nodes // 2) + 0.5) / nodes
    tau = np.concatenate([positive, -positive])
    k = np.arange(1, nodes // 2)[:, None, None]
    return tau, (2 / nodes) * (np.sin(k * (tau[:, None] - tau)) / k).sum(0)


def load_cycle(load: Modulation, nodes: int, grading: float) -> LoadCycle:
    """The load cycle on a grid of `nodes` per period."""
    tau, integral = grid(nodes)
    theta = tau + grading * np.sin(tau)
    at = load.at(jnp.asarray(theta)[:, None])
    shape = (nodes, jax.tree.leaves(load)[0].shape[-1])
    at = jax.tree.map(lambda a: jnp.broadcast_to(a, shape) if jnp.ndim(a) else a, at)
    return LoadCycle(theta, 1 + grading * np.cos(tau), integral, at)


def rates_on(system: QuasiStatic, cycle: LoadCycle) -> Callable[..., States]:
    """The rates per radian on the grid, as a function of the states one by one."""

    def rates(*states: Array) -> States:
        return tuple(system.rates(jnp.stack(states), cycle.at))

    return rates


def together(mean: States, rest: States) -> States:
    """The states on the grid."""
    return tuple(m + y for m, y in zip(mean, rest, strict=True))


def jacobian(push: Callable[..., States], states: States) -> Matrix:
    """Derivatives [i][j] of rate i to state j, from the linear map of their changes."""
    one, zero = jnp.ones_like(states[0]), jnp.zeros_like(states[0])
    n = range(len(states))
    columns = [push(*(one if i == j else zero for j in n)) for i in n]
    return [[columns[j][i] for j in n] for i in n]


def advance(
    cycle: LoadCycle, inverse: Matrix, mean: States, rates: States, push: Callable[..., States]
) -> tuple[States, States, States]:
    """One step of the iteration: the new means and zero-mean parts, and the change of the means.

    Parameters
    ----------
    inverse : Matrix
        Of the derivatives of the mean rates to the means, roughly.
    rates : States
        At the present states.
    push : callable
        Change of the rates with the states, to first order.
    """
    half = len(cycle.theta) // 2
    # Mirror images first: what is odd in theta then cancels exactly, however large it is.
    residual = [cycle.share[:half] @ (r[:half] + r[half:]) for r in rates]
    change = tuple(-sum(a * r for a, r in zip(row, residual, strict=True)) for row in inverse)
    follow = push(*(c + jnp.zeros_like(r) for c, r in zip(change, rates, strict=True)))
    integral = cycle.integral * cycle.stretch
    rest = tuple(integral @ (r + f) for r, f in zip(rates, follow, strict=True))
    return together(mean, change), rest, change


def _largest_change(change: States, new: States, old: States, kappa: Array) -> Array:
    """Largest change of means and zero-mean parts: z relative to its size, log states absolutely.

    The rate of z is kappa times a number with the round-off of 1, which bounds what a vanishing
    z can mean.
    """
    moved = [jnp.abs(a - b)[_LOOKED_AT].max(0) for a, b in zip(new, old, strict=True)]
    size = jnp.abs(new[0])[_LOOKED_AT].max(0) + 1e-3 * kappa
    return jnp.stack([moved[0] / size, *moved[1:], *map(jnp.abs, change)]).max(0)


def fourier_orbit(
    system: QuasiStatic,
    load: Modulation,
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
    load : Modulation
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
    # Of a load that is known to be even, half of the symmetric grid suffices.
    part = nodes // 2 if isinstance(load, Harmonic) else nodes
    at = jax.tree.map(lambda a: a[:part] if jnp.ndim(a) else a, cycle.at)
    share = cycle.share[:part] / cycle.share[:part].sum()
    averaged = averaged_limit(system, at, share, tolerance=_AVERAGED_TOLERANCE)
    inverse = inverse_points(averaged.matrix)
    rates_of = rates_on(system, cycle)
    zero = (jnp.zeros((nodes, points)),) * system.size
    far = jnp.full(points, jnp.inf)

    def unfinished(carry: tuple) -> Array:
        *_, change, error, steps = carry
        return (steps < max_steps) & jnp.any((error > tolerance) & ~jnp.isnan(change))

    def body(carry: tuple) -> tuple:
        mean, rest, last, reached, steps = carry
        rates, push = jax.linearize(rates_of, *together(mean, rest))
        mean, new, moved = advance(cycle, inverse, mean, rates, push)
        change = _largest_change(moved, new, rest, system.kappa)
        # A contraction by r leaves r / (1 - r) of the last change; none is assumed at first.
        contraction = jnp.where(jnp.isinf(last), 0.5, change / last)
        error = jnp.where(contraction < 1, change * contraction / (1 - contraction), jnp.inf)
        error = jnp.where(change < _ROUND_OFF, change, error)
        # Settled points stay so while others need more steps: their changes are round-off.
        error = jnp.where(reached <= tolerance, reached, error)
        return mean, new, change, error, steps + 1

    mean, rest, change, error, steps = jax.lax.while_loop(
        unfinished, body, (averaged.centre, zero, far, far, 0)
    )
    return FourierOrbit(mean, rest, jnp.where(jnp.isnan(change), jnp.inf, error), steps, grading)
