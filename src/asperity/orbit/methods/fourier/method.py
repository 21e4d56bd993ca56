"""The fast method, on a grid as fine as the slip pulse of a point needs."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import FAST_BLOCK, run_chunks, take
from asperity.orbit.methods.fourier.orbit import FourierOrbit
from asperity.orbit.methods.fourier.programs import fast_solve
from asperity.orbit.methods.method import Method
from asperity.orbit.observables import waveform
from asperity.orbit.solution import SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem

#: Grids (nodes, grading), each after the sharpness of the slip pulse it is fine enough for: the
#: nodes that a pulse needs grow with the root of it.
_GRIDS = ((5.0, 24, 0.3), (18.0, 32, 0.3), (300.0, 128, 0.5))
#: Points in a call: enough for the time that a call costs, few enough for a single point.
_CHUNK = 4 * FAST_BLOCK
#: Estimated error that is accepted.
_ERROR = 1e-9
#: Rate per radian of a disturbance above which the iteration does not contract, from experience.
LARGEST_RATE = 1.0


class Fourier(Method):
    """Fourier collocation, for orbits that move little within a period."""

    name = "fourier"
    choice = "fourier"
    block = 2**20

    def suits(self, problem: Problem) -> bool:
        """Without inertia and damping."""
        return isinstance(problem.system, QuasiStatic)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; a grid gives its failures to the next, finer one."""
        points = np.arange(problem.system.V.shape[-1])
        solution = Solution.unsolved(problem, len(points), options)
        rate, sharpness, _ = steady_sliding(problem)
        left = points[rate < LARGEST_RATE]
        # Blocks run until their slowest point is done: points of like difficulty belong together.
        left = left[np.argsort(rate[left], kind="stable")]
        for sharpest, nodes, grading in _GRIDS:
            solve = partial(
                fast_solve,
                nodes=nodes,
                grading=grading,
                harmonics=options.harmonics,
            )
            chosen = left[sharpness[left] <= sharpest]
            for part, (observables, error, orbit) in run_chunks(solve, (problem,), chosen, _CHUNK):
                good = np.flatnonzero(error < _ERROR)
                solution.store(part[good], take(observables, good))
                solution.iterations[part] += orbit.steps
                if options.phases:
                    sample = partial(_sample, grading=grading, phases=options.phases)
                    inputs = (take(problem, part), orbit)
                    for some, samples in run_chunks(sample, inputs, good, FAST_BLOCK):
                        solution.waveform[..., part[some]] = samples
                options.progress(len(good))
            left = left[~solution.converged[left]]
        return solution


def _sample(
    problem: Problem, orbit: FourierOrbit, *, grading: float, phases: int
) -> NDArray[np.float64]:
    return waveform(problem, orbit._replace(grading=grading), phases)
