"""Orbits at the end of their branch from steady sliding, and why other branches end before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import Indices, take
from asperity.orbit.methods.branch_following.from_steady_sliding import (
    MESHES,
    BranchMesh,
    follow_from_steady_sliding,
)
from asperity.orbit.methods.collocation.initial_guess import InitialGuess
from asperity.orbit.methods.collocation.method import solve_from
from asperity.orbit.methods.method import Method
from asperity.orbit.outcome import WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem


class BranchFollowing(Method):
    """Follows the branch from steady sliding by its arclength, on finer and finer meshes."""

    name = "branch following"
    choice = "collocation"

    def __init__(self, meshes: tuple[BranchMesh, ...] = MESHES) -> None:
        """`meshes` are tried in turn, each on the points without a definite outcome."""
        self.meshes = meshes

    def suits(self, problem: Problem) -> bool:
        """Any equations and load."""
        return True

    def candidates(self, solution: Solution) -> Indices:
        """Points without an orbit, or with one that was lost on every finer mesh."""
        return np.flatnonzero(_without_orbit(solution))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; `detail` is the amplitude at which the branch ends."""
        points = problem.system.V.shape[-1]
        solution = Solution.unsolved(problem, points, options)
        definite = np.zeros(points, dtype=bool)
        for mesh in self.meshes:
            rows = np.flatnonzero(_without_orbit(solution) & ~definite)
            if len(rows):
                part = take(problem, rows)
                guess, definite[rows] = orbits_along_branches(part, len(rows), mesh)
                attempt = Solution.unsolved(problem, len(rows), options)
                solve_from(part, attempt, guess, options)
                solution.merge(rows, attempt)
                options.progress(int(attempt.converged.sum()))
        return solution


def _without_orbit(solution: Solution) -> NDArray[np.bool_]:
    lost = (solution.outcome == Outcome.NOT_RESOLVED) & np.isinf(solution.detail)
    return np.isin(solution.outcome, WITHOUT_ORBIT) | lost


def orbits_along_branches(
    problem: Problem, points: int, mesh: BranchMesh
) -> tuple[InitialGuess, NDArray[np.bool_]]:
    """Orbits of all points of `problem` (NumPy arrays) at the end of their branch.

    Where a branch does not reach the amplitude asked for, `outcome` says why. Returned beside the
    guess is whether a finer mesh would give the same, shape (points,).
    """
    branch = follow_from_steady_sliding(problem, np.arange(points), mesh)
    guess = InitialGuess.none(problem, points, mesh.intervals)._replace(orbit=branch.orbit)
    guess.detail[:] = branch.farthest
    amplitude = np.broadcast_to(problem.load.amplitude, (points,))
    for which, outcome, share in (
        (branch.folded, Outcome.FOLDED, branch.fold),
        (branch.ran_away, Outcome.RUNAWAY, branch.end),
        (branch.sensitive, Outcome.SENSITIVE, branch.farthest),
    ):
        rows = np.flatnonzero(which & (amplitude > 0))
        guess.outcome[rows] = outcome
        guess.detail[rows] = share[rows] * amplitude[rows]
    guess.found[:] = branch.arrived
    return guess, branch.definite
