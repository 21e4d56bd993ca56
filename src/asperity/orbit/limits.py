"""The limits within which orbits are searched for.

They are limits of dimensionless numbers, so that units do not matter, and wider than the range that
is tested (`docs/theory/numerical_method.md`). A point outside gets `Outcome.OUT_OF_RANGE` at once:
a search there takes up to a minute and fails, or gives a stability that is round-off.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.orbit.outcome import LARGEST_RATE, LARGEST_UNLOADING, SMALLEST_RATE, Outcome
from asperity.orbit.solution import Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.slider.problem import Problem


def mark_out_of_range(problem: Problem, solution: Solution) -> None:
    """Give the points outside the limits the outcome OUT_OF_RANGE."""
    rate, _, unloading = steady_sliding(problem)
    _mark(solution, ~((rate >= SMALLEST_RATE) & (rate <= LARGEST_RATE)), rate)
    _mark(solution, ~(unloading <= LARGEST_UNLOADING), unloading)


def _mark(solution: Solution, outside: NDArray[np.bool_], values: NDArray[np.float64]) -> None:
    solution.outcome[outside], solution.detail[outside] = Outcome.OUT_OF_RANGE, values[outside]
