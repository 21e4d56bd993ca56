"""Kepler's equation, the inverse of the grading theta = tau + g sin(tau) of a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Newton steps; quadratic convergence needs fewer for any grading below 0.9.
_STEPS = 60


def eccentric_phase(theta: NDArray[np.float64], grading: float) -> NDArray[np.float64]:
    """Tau with tau + g sin(tau) = theta, for 0 <= g < 1, by Newton's method."""
    tau = np.array(theta, float)
    for _ in range(_STEPS):
        tau = tau - (tau + grading * np.sin(tau) - theta) / (1 + grading * np.cos(tau))
    return tau
