"""States of a law in steady sliding under any constant load."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.small_systems import solve_points, value_and_jacobian
from asperity.laws import Law, State
from asperity.laws.uneven_track import POSITION

#: Largest number and length of the Newton steps for the states of the law under another load, and
#: the change below which they end: from an age that is too small a step is one unit of its
#: logarithm, however far the age is off.
_STEPS, _LEAP, _STILL = 100_000, 2.0, 1e-12


def steady_state(law: Law, v: Array, w: Array) -> State:
    """States of the law at `v` under the load `w`, by Newton's method from those under w = 1.

    Parameters
    ----------
    law : Law
    v, w : array, any one shape
        Velocity (m/s) and W/W0.
    """
    if not law.state_names:
        return ()
    start = jnp.stack([s + jnp.zeros_like(w) for s in law.steady_state(v)])
    moves = np.array([name == POSITION for name in law.state_names])
    moves = moves.reshape(-1, *(1 for _ in start.shape[1:]))

    def rates(packed: Array) -> Array:
        # A position has no steady value: it stays where it is.
        changes = jnp.stack(jnp.broadcast_arrays(*law.state_rate(v, v, tuple(packed), w)))
        return jnp.where(moves, packed - start, changes)

    def step(carry: tuple) -> tuple:
        packed, _, count = carry
        value, jacobian = value_and_jacobian(rates, packed)
        change = jnp.clip(solve_points(jacobian, -value), -_LEAP, _LEAP)
        return packed + change, jnp.abs(change), count + 1

    def unfinished(carry: tuple) -> Array:
        _, change, count = carry
        return jnp.any(change > _STILL) & (count < _STEPS)

    # Under w = 1 the initial guess is exact to the last digit.
    first = jnp.where(w == 1, 0.0, jnp.inf) + jnp.zeros_like(start)
    result, *_ = jax.lax.while_loop(unfinished, step, (start, first, 0))
    return tuple(result)
