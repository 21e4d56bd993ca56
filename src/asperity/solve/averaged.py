"""The averaged (high-frequency) limit: states constant over a period.

When a period is too short for the states to move, only the means of their rates count, and with
the mean slip rate equal to the pulling velocity the periodic orbit shrinks to a point:

    < v_pl(f/w, state, w) > = V,      < state rates > = 0.

The exponent of v_pl varies by eps mu / A, tens of units, so the mean over the load cycle is
that of a narrow pulse at the weakest contact. The start comes from its Laplace (saddle-point)
estimate, and Newton's method works on the logarithm of the mean slip rate, which is nearly linear.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from asperity.slider import QuasiStatic
from asperity.solve.linear import jacobian_columns, solve_points

#: Largest change of a logarithmic state in one step; the mean of e^(-state) is what is solved for.
_STATE_STEP = 2.0


def laplace_estimate(system: QuasiStatic, w: Array) -> Array:
    """States at which the pulse of slip at the weakest contact carries the mean velocity.

    Parameters
    ----------
    system : QuasiStatic
    w : array, shape (nodes, points)
        Samples of the load cycle.

    Returns
    -------
    array, shape (size, points)
    """
    start = jnp.broadcast_to(system.steady(), (system.size, w.shape[1]))
    law = system.slider.law
    state = tuple(start[1:])

    def friction(log_v: Array) -> Array:
        return law.friction(jnp.exp(log_v), state, w)

    log_v = jnp.log(system.V) * jnp.ones_like(w)
    strength, direct_effect = jax.jvp(friction, (log_v,), (jnp.ones_like(w),))
    carried = strength * (w + system.compliance_ratio)
    weakest = carried.min(0)
    width = (direct_effect * w).min(0)
    # Second derivative of the strength at its minimum, as if its whole swing were one cosine.
    swing = 0.5 * (carried.max(0) - weakest)
    gain = 0.5 * jnp.log(jnp.maximum(2 * jnp.pi * swing / width, 1.0))
    return start.at[0].set(jnp.minimum(start[0], weakest + width * gain))


def averaged_states(system: QuasiStatic, w: Array, weights: Array, steps: int = 10) -> Array:
    """States that make the mean rates vanish, by Newton's method from `laplace_estimate`.

    Parameters
    ----------
    system : QuasiStatic
    w : array, shape (nodes, points)
        Samples of the load cycle.
    weights : array, shape (nodes, points)
        Their share of the period; sums to 1.
    steps : int
        Newton steps.

    Returns
    -------
    array, shape (size, points)
        Not finite where it failed.
    """
    flat = jnp.zeros_like(w)  # constant states: terms in dw/dtheta have zero mean

    def step(_: int, centre: Array) -> Array:
        Y = jnp.stack([c + flat for c in centre])
        rates, columns = jacobian_columns(lambda Y: system.rates(Y, w, flat), Y)
        mean = [(weights * r).sum(0) for r in rates]
        jacobian = jnp.stack(
            [jnp.stack([(weights * r).sum(0) for r in column]) for column in columns], axis=1
        )
        slip = 1 - mean[0] / system.kappa
        mean[0] = -system.kappa * slip * jnp.log(slip)
        change = solve_points(jacobian, -jnp.stack(mean))
        change = jnp.stack(
            [change[0], *(jnp.clip(c, -_STATE_STEP, _STATE_STEP) for c in change[1:])]
        )
        return centre + change

    return jax.lax.fori_loop(0, steps, step, laplace_estimate(system, w))
