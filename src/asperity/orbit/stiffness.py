"""How stiff and how sharp a cycle will be, before it is solved: what chooses the method."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from asperity.algebra.small_systems import jacobian_columns, spectral_radius
from asperity.loads import Excitation, Harmonic
from asperity.orbit.batches import points_of
from asperity.slider.problem import Problem
from asperity.theory.adiabatic import even_phases
from asperity.theory.averaged import slip_pulse

#: Phases at which the extremes of a load that is not harmonic are looked for.
_PHASES = 64

#: Points in a call of `stiffness_of_steady_sliding` and `sharpness_of_slip`.
STIFFNESS_CHUNK = 4096


@jax.jit
def stiffness_of_steady_sliding(problem: Problem) -> Array:
    """Largest rate per radian of a perturbation of steady sliding: small for fast modulation."""
    system = problem.system
    steady = jnp.broadcast_to(system.steady(), (system.size, points_of(problem)))
    at = Excitation(jnp.ones(steady.shape[1:]))
    _, columns = jacobian_columns(lambda Y: system.rates(Y, at), steady)
    return spectral_radius(jnp.stack(columns, axis=1))


@jax.jit
def sharpness_of_slip(problem: Problem) -> Array:
    """Half the range of the exponent of the slip rate over the cycle."""
    system, load = problem
    phases = even_phases(2 if isinstance(load, Harmonic) else _PHASES) * jnp.ones(
        points_of(problem)
    )
    return slip_pulse(system, load.at(phases)).sharpness


@jax.jit
def deepest_unloading(problem: Problem) -> Array:
    """Largest share of W0 that the modulation takes off the contacts: epsilon, or 1 - min w."""
    if isinstance(problem.load, Harmonic):
        return jnp.abs(jnp.asarray(problem.load.epsilon))
    w = problem.load.at(even_phases(_PHASES) * jnp.ones(points_of(problem))).w
    return 1 - jnp.min(w, axis=0) * jnp.ones(points_of(problem))
