"""The search for periodic orbits: a list of methods, each given the points that are left.

Which methods there are and in which order they are tried is in `asperity.orbit.methods.registry`;
what each does is in its own module.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from asperity.orbit.batches import take
from asperity.orbit.instability import mark_too_unstable
from asperity.orbit.limits import mark_out_of_range
from asperity.orbit.methods.method import Method
from asperity.orbit.methods.registry import METHODS
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem


def find_orbits(
    problem: Problem,
    points: int,
    *,
    harmonics: int,
    phases: int,
    progress: Callable[[int], None],
    methods: tuple[Method, ...] = METHODS,
    intervals: int = 0,
) -> Solution:
    """Find the periodic orbit of every operating point within the limits.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    harmonics, phases : int
        Numbers of harmonics and of waveform samples.
    progress : callable
        Called with the number of points finished since the last call.
    methods : tuple of Method
    intervals : int
        Of the meshes on which orbits found on a mesh are kept; 0 to keep none.
    """
    options = SearchOptions(harmonics, phases, progress, intervals)
    solution = Solution.unsolved(problem, points, options)
    mark_out_of_range(problem, solution)
    outside = solution.outcome == Outcome.OUT_OF_RANGE
    for method in methods:
        if not method.suits(problem):
            continue
        left = method.candidates(solution)
        left = left[~outside[left]]
        for start in range(0, len(left), method.block):
            rows = left[start : start + method.block]
            solution.merge(rows, method.solve(take(problem, rows), options), method.name)
    mark_too_unstable(problem, solution)
    failed = np.flatnonzero(~solution.converged)
    progress(len(failed))
    return solution
