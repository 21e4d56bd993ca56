"""Limits of fast and of slow modulation: the averaged limit and the adiabatic limit.

In the averaged (high-frequency) limit a period is too short for the states to change. Only the
means of their rates count, and with the mean slip rate equal to the pulling velocity the periodic
orbit shrinks to a point:

    < v_pl(f/w, state, w) > = V,      < state rates > = 0.

The exponent of v_pl varies by eps mu / A, tens of units, so that the mean over the load cycle is
that of a narrow pulse at the weakest contact. The initial guess is the Laplace (saddle-point)
estimate of this mean, and Newton's method works on the logarithm of the mean slip rate, which is
nearly linear.

In the adiabatic limit the states at every phase are those of steady sliding under the present load.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import (
    Matrix,
    apply,
    averaged,
    inverse_points,
    jacobian,
    spectral_abscissa,
    value_and_jacobian,
)
from asperity.loads import Excitation
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem

#: Largest change of a logarithmic state in a step, the unknown being the mean of e^(-state); and
#: largest number of steps.
_STATE_STEP, _MOST_STEPS = 2.0, 12


class SlipPulse(NamedTuple):
    """Slip concentrated where the contact is weakest, for states of steady sliding."""

    weakest: Array  # spring force at which the weakest contact carries V
    width: Array  # of the exponent of the slip rate, in units of that force
    swing: Array  # of that force over the cycle, half its range

    @property
    def sharpness(self) -> Array:
        """Half the range of the exponent of the slip rate over the cycle."""
        return self.swing / self.width


def slip_pulse(system: QuasiStatic, at: Excitation) -> SlipPulse:
    """The pulse over samples of the load cycle, arrays of shape (nodes, points)."""
    law = system.slider.law
    state, w = tuple(system.steady()[1:]), at.w

    def friction(log_v: Array) -> Array:
        return law.friction(jnp.exp(log_v), state, w)

    log_v = jnp.log(system.V)
    strength, direct_effect = jax.jvp(friction, (log_v,), (jnp.ones_like(log_v),))
    carried = strength * (w + system.compliance_ratio) - at.shear
    weakest = carried.min(0)
    return SlipPulse(weakest, (direct_effect * w).min(0), 0.5 * (carried.max(0) - weakest))


def laplace_estimate(system: QuasiStatic, at: Excitation) -> Array:
    """States at which the pulse of slip at the weakest contact carries the mean velocity.

    Parameters
    ----------
    system : QuasiStatic
    at : Excitation
        Samples of the load cycle, arrays of shape (nodes, points).

    Returns
    -------
    array, shape (size, points)
    """
    start = jnp.broadcast_to(system.steady(), (system.size, at.w.shape[1]))
    pulse = slip_pulse(system, at)
    # Second derivative of the strength at its minimum, for a cosine with the same range.
    gain = 0.5 * jnp.log(jnp.maximum(2 * jnp.pi * pulse.sharpness, 1.0))
    return start.at[0].set(jnp.minimum(start[0], pulse.weakest + pulse.width * gain))


class AveragedLimit(NamedTuple):
    """The averaged limit, as tuples of arrays (points,) over the states."""

    centre: tuple[Array, ...]
    matrix: Matrix  # [i][j]: derivative of the mean rate of state i to state j


def averaged_limit(
    system: QuasiStatic,
    at: Excitation,
    weights: Array,
    *,
    tolerance: float = 1e-12,
) -> AveragedLimit:
    """States that make the mean rates vanish, by Newton's method from `laplace_estimate`.

    Parameters
    ----------
    system : QuasiStatic
    at : Excitation
        Samples of the load cycle, arrays of shape (nodes, points). Of the pulling velocity only
        the mean counts.
    weights : array, shape (nodes,)
        Their share of the period; sums to 1.
    tolerance : float
        On the last change of the exponent of the slip rate and of the logarithmic states.

    Returns
    -------
    AveragedLimit
        The last iterate, finite or not, where Newton's method did not converge.
    """
    points = at.w.shape[1]
    n = system.size

    # For constant states, terms with the slopes of load and shear force have zero mean.
    flat = jnp.zeros_like(at.w)
    constant = Excitation(at.w, flat, at.shear)

    def rates(*Y: Array) -> tuple[Array, ...]:
        return tuple(system.rates(jnp.stack(Y), constant))

    def unfinished(carry: tuple) -> Array:
        *_, change, steps = carry
        return (steps < _MOST_STEPS) & jnp.any(change > tolerance)

    def newton(carry: tuple) -> tuple:
        """New means, the matrix used, the largest logarithmic change, and the number of steps."""
        centre, _, _, steps = carry
        value, push = jax.linearize(rates, *(c + flat for c in centre))
        matrix = averaged(jacobian(push, value), weights)
        mean = [weights @ rate for rate in value]
        slip = 1 - mean[0] / system.kappa
        mean[0] = -system.kappa * slip * jnp.log(slip)
        change = [-c for c in apply(inverse_points(matrix), mean)]
        change[1:] = [jnp.clip(c, -_STATE_STEP, _STATE_STEP) for c in change[1:]]
        largest = jnp.abs(jnp.stack([jnp.log(slip), *change[1:]])).max(0)
        return tuple(c + d for c, d in zip(centre, change, strict=True)), matrix, largest, steps + 1

    none = [[jnp.zeros(points)] * n] * n
    start = (tuple(laplace_estimate(system, at)), none, jnp.full(points, jnp.inf), 0)
    centre, matrix, _, _ = jax.lax.while_loop(unfinished, newton, start)
    return AveragedLimit(centre, matrix)


_NODES = 192


def even_phases(nodes: int) -> np.ndarray:
    """Evenly spaced phases of a period, as a column."""
    return 2 * np.pi * np.arange(nodes)[:, None] / nodes


@partial(jit_large, static_argnames=("nodes",))
def adiabatic_states(problem: Problem, *, nodes: int) -> Array:
    """Steady states at even phases, under their loads and pulls; (size, nodes, points)."""
    system, load = problem
    at = load.at(even_phases(nodes) * jnp.ones(jnp.shape(system.V)[-1]))
    return system.steady_under(at)


@jit_large
def adiabatic_growth(problem: Problem) -> Array:
    """Exponent by which a disturbance grows within a period, over the phases at which it does."""
    system, load = problem
    Y = adiabatic_states(problem, nodes=_NODES)
    at = load.at(even_phases(_NODES) * jnp.ones(Y.shape[2]))
    _, slopes = value_and_jacobian(lambda y: system.rates(y, at), Y)
    rate = spectral_abscissa(slopes)
    return 2 * jnp.pi * jnp.maximum(rate, 0.0).mean(0)
