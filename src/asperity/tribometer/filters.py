"""Analogue filters acting on a simulated signal, exact between its samples.

A rational filter is a sum of first-order ones, sum of r/(s - p), over its poles p. Each is a linear
differential equation, y' = p y + r u, solved over a sampling interval h with u the cubic
polynomial through the four samples around it:

    y(t + h) = e^{ph} y(t) + r sum over four samples of c_j u_j.

A smooth signal is filtered with an error of fourth order in h, and a step moves nothing but the
three intervals next to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Nodes of the quadrature over an interval: enough for e^{ps} over the fastest poles in use.
_NODES = 64


def low_pass(order: int, frequency: float) -> tuple[NDArray, NDArray]:
    """Poles (rad/s) and residues of a Butterworth low-pass with gain 1 at frequency 0.

    Parameters
    ----------
    order : int
        1 is a single pole.
    frequency : float
        Where the gain is 1/sqrt 2 (Hz).
    """
    corner = 2 * np.pi * frequency
    k = np.arange(1, order + 1)
    poles = corner * np.exp(1j * np.pi * (2 * k + order - 1) / (2 * order))
    others = [np.prod(p - np.delete(poles, i)) for i, p in enumerate(poles)]
    return poles, corner**order / np.array(others)


def filtered(values: Array, rate: float, poles: NDArray, residues: NDArray) -> Array:
    """Output of a filter at the samples of its input, which was steady before the first.

    Parameters
    ----------
    values : array, shape (n,)
    rate : float
        Samples per second (Hz).
    poles, residues : complex array
        Of the transfer function, rad/s.

    Returns
    -------
    array, shape (n,)
    """
    from scipy.signal import lfilter

    n = values.size
    ends = np.concatenate([values[:1], values, np.repeat(values[-1:], 2)])
    stencils = [ends[j : j + n] for j in range(4)]
    total = np.zeros(n)
    for pole, residue in zip(poles, residues, strict=True):
        if pole.imag < -1e-9 * abs(pole):
            continue  # its conjugate has been counted twice
        weights = _weights(pole, 1 / rate)
        drive = sum(c * u for c, u in zip(weights, stencils, strict=True))
        start = -values[0] / pole
        # y_k of the interval that ends at sample k; the first is the steady state.
        y = lfilter([1.0], [1.0, -np.exp(pole / rate)], np.append(start, drive[:-1]))
        share = 1.0 if abs(pole.imag) <= 1e-9 * abs(pole) else 2.0
        total += share * (residue * y).real
    return total


def _weights(pole: complex, h: float) -> NDArray:
    """Integral over [0, h] of e^{p (h - s)} l_j(s), l_j the cubics of nodes -h, 0, h, 2h."""
    # The kernel fades within 1/|p| of the end: nodes where it lives.
    length = min(h, 40 / abs(pole.real)) if pole.real else h
    x, w = np.polynomial.legendre.leggauss(_NODES)
    s = h - length * (x + 1) / 2
    u = s / h
    basis = np.array(
        [
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        ]
    )
    return basis @ (w * np.exp(pole * (h - s))) * length / 2


def between(values: Array, rate: float, times: Array) -> Array:
    """Values at any times (s since the first sample), by the cubic through four samples.

    Before the first and after the last sample the signal is constant.
    """
    at = np.clip(times * rate, 0.0, values.size - 1.0)
    k = np.minimum(at.astype(int), max(values.size - 2, 0))
    u = at - k
    last = values.size - 1
    a, b, c, d = (values[np.clip(k + j, 0, last)] for j in (-1, 0, 1, 2))
    return (
        -u * (u - 1) * (u - 2) / 6 * a
        + (u + 1) * (u - 1) * (u - 2) / 2 * b
        - (u + 1) * u * (u - 2) / 2 * c
        + (u + 1) * u * (u - 1) / 6 * d
    )
