"""The limit of slow modulation: at every phase the steady state under the present load."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.small_systems import jacobian_columns, spectral_abscissa
from asperity.slider.problem import Problem

_NODES = 192


def even_phases(nodes: int) -> np.ndarray:
    """Evenly spaced phases of a period, as a column."""
    return 2 * np.pi * np.arange(nodes)[:, None] / nodes


@partial(jax.jit, static_argnames=("nodes",))
def adiabatic_states(problem: Problem, *, nodes: int) -> Array:
    """Steady states at even phases, at their pulling velocities; (size, nodes, points)."""
    system, load = problem
    ones = jnp.ones((nodes, jnp.shape(system.V)[-1]))
    at = load.at(even_phases(nodes) * ones)
    law, pull = system.slider.law, at.pull * ones
    friction = law.mu_ss(system.V) * ones
    mechanical = system.mechanical_states(friction, pull, jnp.log(pull), at)
    return jnp.stack([state * ones for state in (*mechanical, *law.steady_state(system.V * pull))])


@jax.jit
def adiabatic_growth(problem: Problem) -> Array:
    """Exponent by which a disturbance grows within a period, over the phases at which it does."""
    system, load = problem
    Y = adiabatic_states(problem, nodes=_NODES)
    at = load.at(even_phases(_NODES) * jnp.ones(Y.shape[2]))
    _, columns = jacobian_columns(lambda y: system.rates(y, at), Y)
    rate = spectral_abscissa(jnp.stack(columns, axis=1))
    return 2 * jnp.pi * jnp.maximum(rate, 0.0).mean(0)
