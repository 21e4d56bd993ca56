"""Types of NumPy arrays, as annotations name them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
Bool = NDArray[np.bool_]


def between(low: float, high: float, u: Float, *, log: bool = False) -> Float:
    """Values at fractions `u` of the way from `low` to `high`, with `log` at equal ratios."""
    return np.asarray(low * (high / low) ** u if log else low + (high - low) * u)


def spaced(low: float, high: float, count: int, *, log: bool = False) -> Float:
    """Values at equal distances, or ratios, with both ends, rounded to 15 digits.

    A longer grid of the same step then has bit for bit the same values, and a decimal step gives
    decimal values (0.3, not 0.30000000000000004).
    """
    values = between(low, high, np.linspace(0.0, 1.0, count), log=log)
    return np.array([float(f"{value:.15g}") for value in values])
