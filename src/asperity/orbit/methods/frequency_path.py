"""Orbits followed in frequency, from a modulation so fast that the averaged limit holds.

Each point has a step length: it grows after a success and shrinks after a failure.
"""

from __future__ import annotations

import equinox as eqx
import numpy as np
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.orbit.batches import Indices, mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import remeshed, solve
from asperity.orbit.methods.collocation import orbits_from_averaged_limit, refine
from asperity.orbit.outcome import WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import perturbation_rate
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Rate per radian of a perturbation at which the averaged limit is close enough to start from.
_FAST_MODULATION = 0.02
#: Lengths of the first and shortest step (fractions of the path), and largest number of steps.
_FIRST_STEP, _SHORTEST_STEP, _MOST_STEPS = 0.02, 1e-4, 250
#: Change of the length of a step after a success and after a failure.
_GROWTH, _SHRINKAGE = 1.6, 0.35
#: A step is accepted when Newton's method has converged to this; the end point is solved again.
_ACCEPTED, _NEWTON_STEPS = 1e-5, 10

_rate = jit_large(perturbation_rate)


class FrequencyPath(Method):
    """Orbits of branches that are not connected with steady sliding."""

    name = "frequency path"
    choice = "collocation"

    def suits(self, problem: Problem) -> bool:
        """Any equations and load."""
        return True

    def candidates(self, solution: Solution) -> Indices:
        """Points whose branch from steady sliding has no orbit at the requested amplitude."""
        return np.flatnonzero(np.isin(solution.outcome, WITHOUT_ORBIT))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; an orbit that is not resolved may not exist, and is not reported."""
        points = problem.system.V.shape[-1]
        solution = Solution.unsolved(problem, points, options)
        refine(problem, solution, *_orbits_from_high_frequency(problem, points), options)
        lost = solution.outcome == Outcome.NOT_RESOLVED
        solution.outcome[lost], solution.detail[lost] = Outcome.NO_ORBIT, 0.0
        options.progress(int(solution.converged.sum()))
        return solution


def _orbits_from_high_frequency(problem: Problem, points: int) -> tuple[Orbit, Indices]:
    """Orbits of the points that reach the end of their path in frequency, and these points."""
    rate, everyone = np.zeros(points), np.arange(points)
    chunk = mesh_chunk(problem.system.size)
    for part, value in run_chunks(_rate, (problem,), everyone, chunk):
        rate[part] = value
    end = np.asarray(problem.system.omega)
    first = end * np.maximum(rate / _FAST_MODULATION, 1.0)
    orbit, active = orbits_from_averaged_limit(_at_frequency(problem, first), everyone)
    reached, step = np.zeros(points), np.full(points, _FIRST_STEP)
    for _ in range(_MOST_STEPS):
        if not len(active):
            break
        # Evenly in the logarithm of the frequency.
        trial = np.minimum(1.0, reached + step)
        inputs = (_at_frequency(problem, first * (end / first) ** trial), orbit)
        for part, (moved, error) in run_chunks(_advance, inputs, active, chunk):
            # The re-meshed orbit, which is the next guess, must also be finite.
            good = (error < _ACCEPTED) & np.isfinite(moved.slopes).all((0, 1, 2))
            put(orbit, part[good], take(moved, np.flatnonzero(good)))
            reached[part[good]] = trial[part[good]]
            step[part] *= np.where(good, _GROWTH, _SHRINKAGE)
        active = active[(reached[active] < 1) & (step[active] > _SHORTEST_STEP)]
    return orbit, np.flatnonzero(reached >= 1)


def _at_frequency(problem: Problem, omega: Float) -> Problem:
    return problem._replace(system=eqx.tree_at(lambda q: q.omega, problem.system, omega))


def _advance(problem: Problem, guess: Orbit) -> tuple[Orbit, Float]:
    """Collocation from a neighbouring orbit; the result lies on a mesh made for it."""
    result = solve(problem, guess, _NEWTON_STEPS)
    return remeshed(problem, result.orbit, len(guess.mesh) - 1), result.error
