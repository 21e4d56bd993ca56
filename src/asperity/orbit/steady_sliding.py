"""Stiffness and amplitude measures of steady sliding, from which the search chooses the method."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import spectral_radius
from asperity.arrays import Bool
from asperity.loads import Harmonic, Modulation
from asperity.orbit.batches import chunk_of, points_of, put, run_chunks
from asperity.slider import QuasiStatic
from asperity.slider.pointwise import excitation_at
from asperity.slider.problem import Problem
from asperity.theory.limits import even_phases, slip_pulse

#: Number of phases at which the extremes of a non-harmonic load are sampled.
_PHASES = 64
#: Points in a call.
_CHUNK = 4096


class SteadySliding(NamedTuple):
    """Dimensionless numbers of an operating point, each (points,).

    Mass and damping are left out: they add fast rates, which the methods can treat.

    Attributes
    ----------
    rate : array
        Largest rate per radian of a perturbation of steady sliding: small for fast modulation.
    sharpness : array
        Half the range of the exponent of the slip rate over the load cycle.
    unloading : array
        Largest share of W0 that the modulation takes off the contacts: epsilon, or 1 - min w.
    """

    rate: Array
    sharpness: Array
    unloading: Array


def perturbation_rate(problem: Problem) -> Array:
    """Largest rate per radian of a perturbation of steady sliding, mass and damping included."""
    return spectral_radius(problem.system.steady_jacobian())


def steady_sliding_of(problem: Problem) -> SteadySliding:
    """`steady_sliding` of arrays of any length, within a compiled program too."""
    system, load = problem
    sliding = QuasiStatic(system.slider, system.V, system.omega)
    points = points_of(problem)
    harmonic = isinstance(load, Harmonic)
    cycle = load.at(even_phases(2 if harmonic else _PHASES) * jnp.ones(points))
    unloading = jnp.abs(load.epsilon) if harmonic else 1 - jnp.min(cycle.w, axis=0)
    return SteadySliding(
        perturbation_rate(Problem(sliding, load)),
        slip_pulse(sliding, cycle).sharpness,
        unloading * jnp.ones(points),
    )


_compiled = jit_large(steady_sliding_of)


def steady_sliding(problem: Problem) -> SteadySliding:
    """The numbers of all points of `problem`, NumPy arrays with the points along the last axis."""
    points = np.arange(problem.system.V.shape[-1])
    numbers = SteadySliding(*np.empty((3, len(points))))
    for part, values in run_chunks(_compiled, (problem,), points, chunk_of(points, _CHUNK)):
        put(numbers, part, values)
    return numbers


def unmodulated(load: Modulation, points: int) -> Bool:
    """Points at which load, shear force and pulling velocity are constant, shape (points,)."""
    if isinstance(load, Harmonic):
        return np.broadcast_to(np.asarray(load.epsilon) == 0, points)
    at = excitation_at(load, even_phases(_PHASES) * np.ones(points))
    swings = [np.ptp(part, axis=0) for part in (at.w, at.shear, at.pull)]
    return np.max(np.broadcast_arrays(*swings, np.zeros(points)), axis=0) == 0
