"""Size of a Newton step: what it does to the exponents that make the equations nonlinear."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from asperity.loads import Excitation
from asperity.slider import Motion


def exponent_change(system: Motion, at: Excitation, states: Array, step: Array) -> Array:
    """Largest first-order change of the slip exponent and of the logarithmic states.

    Parameters
    ----------
    system : Motion
    at : Excitation
        At the phases of the states.
    states, step : array, shape (size, ...)

    Returns
    -------
    array, shape (...)
    """
    _, exponent = jax.jvp(lambda Y: system.log_slip(Y, at), (states,), (step,))
    logarithms = [step[i] for i in range(system.size) if i not in system.linear]
    return jnp.abs(jnp.stack([exponent, *logarithms])).max(0)
