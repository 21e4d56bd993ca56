"""The compiled program of the fast method: orbits solved in blocks."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.orbit.batches import FAST_BLOCK, points_of
from asperity.orbit.methods.fourier.observables import fourier_observables
from asperity.orbit.methods.fourier.orbit import FourierOrbit, fourier_orbit
from asperity.orbit.observables import Observables
from asperity.slider.problem import Problem


@partial(jit_large, static_argnames=("nodes", "grading", "harmonics"))
def fast_solve(
    problem: Problem, *, nodes: int, grading: float, harmonics: int
) -> tuple[Observables, Array, FourierOrbit]:
    """Fourier collocation: the observables, their estimated error and the orbits.

    Works on blocks of points that fit into a core's cache, each until its slowest point is done.
    """
    points = points_of(problem)

    def solve(block: Problem) -> tuple[Observables, Array, FourierOrbit]:
        return _fast_block(block, nodes, grading, harmonics)

    blocks = jax.tree.map(lambda a: a.reshape(-1, FAST_BLOCK), problem)
    results = jax.lax.map(solve, blocks)
    return jax.tree.map(lambda a: jnp.moveaxis(a, 0, -2).reshape(*a.shape[1:-1], points), results)


def _fast_block(
    problem: Problem, nodes: int, grading: float, harmonics: int
) -> tuple[Observables, Array, FourierOrbit]:
    system, load = problem
    points = points_of(problem)
    orbit = fourier_orbit(
        system, load, points, nodes=nodes, grading=grading, tolerance=1e-10, max_steps=40
    )
    observables, error = fourier_observables(system, load, orbit, harmonics=harmonics, max_steps=40)
    each = {name: jnp.full(points, getattr(orbit, name)) for name in ("steps", "grading")}
    return observables, error, orbit._replace(**each)
