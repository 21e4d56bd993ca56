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
from asperity.orbit.mesh.newton import solve
from asperity.orbit.mesh.remeshing import remeshed
from asperity.orbit.methods.collocation.initial_guess import (
    InitialGuess,
    orbits_from_averaged_limit,
)
from asperity.orbit.methods.collocation.method import solve_from
from asperity.orbit.methods.method import Method
from asperity.orbit.outcome import WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import SearchOptions, Solution
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
    """Finds orbits of branches that are not connected with steady sliding."""

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
        solve_from(problem, solution, orbits_from_high_frequency(problem, points), options)
        lost = solution.outcome == Outcome.NOT_RESOLVED
        solution.outcome[lost], solution.detail[lost] = Outcome.NO_ORBIT, 0.0
        options.progress(int(solution.converged.sum()))
        return solution


def orbits_from_high_frequency(problem: Problem, points: int) -> InitialGuess:
    """Orbits of all points of `problem` (NumPy arrays) at the end of their path in frequency."""
    rate = np.zeros(points)
    chunk = mesh_chunk(problem.system.size)
    for part, value in run_chunks(_rate, (problem,), np.arange(points), chunk):
        rate[part] = value
    omega = np.asarray(problem.system.omega)
    first = omega * np.maximum(rate / _FAST_MODULATION, 1.0)
    guess = orbits_from_averaged_limit(_at_frequency(problem, first), points)
    _follow(problem, first, guess.orbit, guess.solved)
    return guess


def _at_frequency(problem: Problem, omega: Float) -> Problem:
    return problem._replace(system=eqx.tree_at(lambda q: q.omega, problem.system, omega))


def _follow(problem: Problem, first: Float, orbit: Orbit, solved: NDArray[np.bool_]) -> None:
    """Follow orbits from omega = `first` to that of the problem, evenly in its logarithm.

    Parameters
    ----------
    problem : Problem
        NumPy arrays.
    first : array, shape (points,)
        rad/s.
    orbit : Orbit
        Orbits at `first`; overwritten with those at the end of the path.
    solved : bool array, shape (points,)
        Which points have an orbit; overwritten with those that reach the end.
    """
    reached, step = np.zeros(len(solved)), np.full(len(solved), _FIRST_STEP)
    active = np.flatnonzero(solved)

    chunk = mesh_chunk(problem.system.size)
    for _ in range(_MOST_STEPS):
        if not len(active):
            break
        trial = np.minimum(1.0, reached + step)
        omega = first * (np.asarray(problem.system.omega) / first) ** trial
        inputs = (_at_frequency(problem, omega), orbit)
        for part, (moved, error) in run_chunks(_advance, inputs, active, chunk):
            # The re-meshed orbit, which is the next guess, must also be finite.
            good = (error < _ACCEPTED) & np.isfinite(moved.slopes).all((0, 1, 2))
            put(orbit, part[good], take(moved, np.flatnonzero(good)))
            reached[part[good]] = trial[part[good]]
            step[part] *= np.where(good, _GROWTH, _SHRINKAGE)
        active = active[(reached[active] < 1) & (step[active] > _SHORTEST_STEP)]
    solved[:] = reached >= 1


def _advance(problem: Problem, guess: Orbit) -> tuple[Orbit, Float]:
    """Collocation from a neighbouring orbit; the result lies on a mesh made for it."""
    result = solve(problem, guess, _NEWTON_STEPS)
    return remeshed(problem, result.orbit, len(guess.mesh) - 1), result.error
