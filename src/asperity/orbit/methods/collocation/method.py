"""The robust method: from the averaged limit, and refinement."""

from __future__ import annotations

import numpy as np

from asperity.orbit.mesh.remeshing import MESHES
from asperity.orbit.methods.collocation.initial_guess import (
    InitialGuess,
    orbits_from_averaged_limit,
)
from asperity.orbit.methods.collocation.refinement import refine
from asperity.orbit.methods.method import Method
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem


class Collocation(Method):
    """Collocation with Newton's method on the whole orbit."""

    name = "collocation"
    choice = "collocation"

    def suits(self, problem: Problem) -> bool:
        """Any equations and load."""
        return True

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`."""
        solution = Solution.unsolved(problem, problem.system.V.shape[-1], options)
        guess = orbits_from_averaged_limit(problem, len(solution.outcome))
        solve_from(problem, solution, guess, options)
        options.progress(int(solution.converged.sum()))
        return solution


def solve_from(
    problem: Problem, solution: Solution, guess: InitialGuess, options: SearchOptions
) -> None:
    """Refine the orbits of a guess and take over its outcomes of the points without one.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Of the points of the problem; overwritten where `guess` has an outcome.
    guess : InitialGuess
    options : SearchOptions
    """
    informed = guess.found | (guess.detail > 0)
    solution.outcome[informed] = guess.outcome[informed]
    solution.detail[informed] = guess.detail[informed]
    index = np.flatnonzero(guess.found)
    if len(index):
        coarse = guess.orbit.mesh.shape[0] - 1
        meshes = tuple(intervals for intervals in MESHES if intervals >= coarse)
        refine(problem, solution, guess.orbit, index, options, meshes)
