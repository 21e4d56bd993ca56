"""The grid of Fourier collocation, symmetric about zero: integration and interpolation on it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np


@lru_cache
def grid(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes tau, the positive nodes before their mirror images, and the integrating matrix.

    The matrix, (nodes, nodes), gives the zero-mean antiderivative in tau of the trigonometric
    polynomial through values at the nodes.
    """
    positive = 2 * np.pi * (np.arange(nodes // 2) + 0.5) / nodes
    tau = np.concatenate([positive, -positive])
    k = np.arange(1, nodes // 2)[:, None, None]
    return tau, (2 / nodes) * (np.sin(k * (tau[:, None] - tau)) / k).sum(0)


def antiderivative(integral: Any, rate: Any) -> Any:
    """``integral @ rate`` by half of the products.

    The antiderivative of an even function is odd, and that of an odd one even.

    Parameters
    ----------
    integral : array, shape (nodes, nodes)
        That of `grid`, or with columns multiplied by an even function.
    rate : array, shape (nodes, points)
    """
    half = len(rate) // 2
    matrix = 0.5 * integral[:half]
    one, other = rate[:half], rate[half:]
    odd = (matrix[:, :half] + matrix[:, half:]) @ (one + other)
    even = (matrix[:, :half] - matrix[:, half:]) @ (one - other)
    return rate.__array_namespace__().concatenate([even + odd, even - odd])


def interpolation(phases: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Matrix of trigonometric interpolation from even nodes to phases, (phases, nodes).

    Its elements are (1 + 2 cos x + ... + 2 cos m x)/nodes = sin((m + 1/2) x)/sin(x/2)/nodes at the
    distance x, which is within half a turn: next to a full turn the quotient would be round-off.
    """
    count = len(nodes)
    x = np.remainder(phases[:, None] - nodes + np.pi, 2 * np.pi) - np.pi
    terms = 2 * ((count + 1) // 2) - 1
    with np.errstate(invalid="ignore"):
        kernel: np.ndarray = np.where(x == 0, terms, np.sin(terms * x / 2) / np.sin(x / 2)) / count
    return kernel
