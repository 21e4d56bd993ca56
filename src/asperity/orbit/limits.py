"""The limits within which orbits are searched for.

They are limits of dimensionless numbers, so that units do not matter, and wider than the range that
is tested (`docs/theory/numerical_method.md`). A point outside gets `Outcome.OUT_OF_RANGE` at once:
a search there takes up to a minute and fails, or gives a stability that is round-off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.batches import run_chunks
from asperity.orbit.outcome import LARGEST_RATE, LARGEST_UNLOADING, SMALLEST_RATE, Outcome
from asperity.orbit.solution import Solution
from asperity.orbit.stiffness import STIFFNESS_CHUNK, deepest_unloading, stiffness_of_steady_sliding
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem


def mark_out_of_range(problem: Problem, solution: Solution) -> None:
    """Give the points outside the limits the outcome OUT_OF_RANGE."""
    points = np.arange(len(solution.outcome))
    system, load = problem
    # Mass and damping add fast rates that methods can treat, so they do not count here.
    sliding = Problem(QuasiStatic(system.slider, system.V, system.omega), load)
    rate, unloading = np.empty((2, len(points)))
    for part, values in run_chunks(
        stiffness_of_steady_sliding, (sliding,), points, STIFFNESS_CHUNK
    ):
        rate[part] = values
    for part, values in run_chunks(deepest_unloading, (sliding,), points, STIFFNESS_CHUNK):
        unloading[part] = values
    _mark(solution, ~((rate >= SMALLEST_RATE) & (rate <= LARGEST_RATE)), rate)
    _mark(solution, ~(unloading <= LARGEST_UNLOADING), unloading)


def _mark(solution: Solution, outside: NDArray[np.bool_], values: NDArray[np.float64]) -> None:
    solution.outcome[outside], solution.detail[outside] = Outcome.OUT_OF_RANGE, values[outside]
