"""The fast method, on a grid as fine as the slip pulse of a point needs."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.orbit.batches import FAST_BLOCK, chunk_of, points_of, run_chunks, take
from asperity.orbit.methods.fourier.orbit import FourierOrbit, fourier_observables, fourier_orbit
from asperity.orbit.methods.method import Method
from asperity.orbit.observables import Observables, waveform
from asperity.orbit.solution import SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.slider import QuasiStatic
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

    blocks = jax.tree.map(lambda a: a.reshape(-1, min(points, FAST_BLOCK)), problem)
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


#: Grids (nodes, grading), each after the sharpness of the slip pulse it is fine enough for: the
#: nodes that a pulse needs grow with the root of it.
_GRIDS = ((5.0, 24, 0.3), (18.0, 32, 0.3), (300.0, 128, 0.5))
#: Points in a call: enough to spread the cost of a call.
_CHUNK = 4 * FAST_BLOCK
#: Estimated error that is accepted.
_ERROR = 1e-9
#: Rate per radian of a disturbance above which the iteration does not contract, from experience.
LARGEST_CONTRACTING_RATE = 1.0


class Fourier(Method):
    """Fourier collocation, for orbits that move little within a period."""

    name = "fourier"
    choice = "fourier"
    on_mesh = False
    block = 2**20

    def suits(self, problem: Problem) -> bool:
        """Without inertia and damping."""
        return isinstance(problem.system, QuasiStatic)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; a grid gives its failures to the next, finer one."""
        points = np.arange(problem.system.V.shape[-1])
        solution = Solution.unsolved(problem, len(points), options)
        rate, sharpness, _ = steady_sliding(problem)
        left = points[rate < LARGEST_CONTRACTING_RATE]
        # A block runs until its slowest point has converged, so points are sorted by difficulty.
        left = left[np.argsort(rate[left], kind="stable")]
        for sharpest, nodes, grading in _GRIDS:
            solve = partial(
                fast_solve,
                nodes=nodes,
                grading=grading,
                harmonics=options.harmonics,
            )
            chosen = left[sharpness[left] <= sharpest]
            size = chunk_of(chosen, _CHUNK)
            for part, (observables, error, orbit) in run_chunks(solve, (problem,), chosen, size):
                good = np.flatnonzero(error < _ERROR)
                solution.store(part[good], take(observables, good))
                solution.iterations[part] += orbit.steps
                if options.phases:
                    sample = partial(_sample, grading=grading, phases=options.phases)
                    inputs = (take(problem, part), orbit)
                    size = chunk_of(good, FAST_BLOCK)
                    for some, samples in run_chunks(sample, inputs, good, size):
                        solution.waveform[..., part[some]] = samples
                options.progress(len(good))
            left = left[~solution.converged[left]]
        return solution


def _sample(
    problem: Problem, orbit: FourierOrbit, *, grading: float, phases: int
) -> NDArray[np.float64]:
    return waveform(problem, orbit._replace(grading=grading), phases)
