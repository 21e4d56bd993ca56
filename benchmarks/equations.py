"""The published equations for the other programs, independent of the package.

Rice-Ruina friction with elastic asperities, Eqs. (1), (2) and (26)-(29) of Bureau et al. (2000), in
theta = omega t, with w = 1 + eps cos(theta). The spring and the asperities together are
stretched by z; the age enters as chi = phi - (ageing/kappa) f, phi = ln(V Phi/D0), whose rate
contains no velocity:

    dz/dtheta   = kappa (1 - exp((f/w - mu - B phi)/A)),     f = z w / (w + ratio) = F/W0,
    dchi/dtheta = ageing (exp(-phi) - 1).

The states are y = (z - z0)/kappa and chi, counted from the averaged limit (z0, chi0), so that they
keep their relative accuracy when the response is small.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Answer(NamedTuple):
    """Numbers that are compared; points along the last axis, NaN if a method does not give them."""

    mean: np.ndarray
    mu1: np.ndarray
    mu2: np.ndarray
    multipliers: np.ndarray  # (2, points), by decreasing modulus


def force(numbers: dict, z: np.ndarray, w: np.ndarray) -> np.ndarray:
    """F/W0."""
    return z * w / (w + numbers["ratio"])


def rates(theta, state, numbers: dict, z0, module: Any = np) -> list:
    """Rates of y and chi by theta, of NumPy or of JAX numbers."""
    n = numbers
    w = 1 + n["epsilon"] * module.cos(theta)
    f = force(n, z0 + n["kappa"] * state[0], w)
    phi = state[1] + n["ageing"] / n["kappa"] * f
    slip = module.exp((f / w - n["mu"] - n["B"] * phi) / n["A"])
    return [1 - slip, n["ageing"] * (module.exp(-phi) - 1)]


def averaged_limit(numbers: dict, nodes: int = 24, steps: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Constant z and chi that make the mean rates vanish, shape (points,) each."""
    n = numbers
    tau = np.pi * (np.arange(nodes) + 0.5)[:, None] / nodes
    weight = (1 + 0.3 * np.cos(tau)) / nodes
    w = 1 + n["epsilon"] * np.cos(tau + 0.3 * np.sin(tau))
    share = w / (w + n["ratio"])
    coupling = n["ageing"] / n["kappa"]
    weakest = n["mu"] / share.max(0) * w.min(0)
    sharpness = n["mu"] * n["epsilon"] / n["A"]
    gain = 0.5 * n["A"] * w.min(0) * np.log(np.maximum(2 * np.pi * sharpness, 1))
    z = np.minimum(n["mu"] * (1 + n["ratio"]), weakest / share.max(0) + gain)
    chi = -coupling * z * np.mean(share, 0)
    for _ in range(steps):
        phi = chi + coupling * z * share
        slip = weight * np.exp((z * share / w - n["mu"] - n["B"] * phi) / n["A"])
        young = weight * np.exp(-phi)
        by_z = (slip * (share / w - n["B"] * coupling * share)).sum(0) / n["A"]
        by_chi = -slip.sum(0) * n["B"] / n["A"]
        a, b = by_z / slip.sum(0), by_chi / slip.sum(0)
        c, d = -(young * coupling * share).sum(0) / young.sum(0), -1.0
        r, s = -np.log(slip.sum(0)), -np.log(young.sum(0))
        z = z + (r * d - b * s) / (a * d - b * c)
        chi = chi + (a * s - c * r) / (a * d - b * c)
    return z, chi


def multipliers_of(monodromy: np.ndarray) -> np.ndarray:
    """Eigenvalues of (points, 2, 2), shape (2, points), by decreasing modulus."""
    values = np.linalg.eigvals(monodromy).astype(complex)
    order = np.argsort(-np.abs(values), axis=1, kind="stable")
    return np.take_along_axis(values, order, 1).T


def newton_step(start: np.ndarray, end: np.ndarray, monodromy: np.ndarray) -> np.ndarray:
    """Change of the start, (2, points), that closes the orbit to first order."""
    identity = np.eye(2)
    gap = (end - start).T[..., None]
    return np.linalg.solve(identity - monodromy, gap)[..., 0].T


def read(mean: np.ndarray, rest: np.ndarray, monodromy: np.ndarray | None) -> Answer:
    """Mean and harmonics of F/W0 = mean + rest from equidistant samples (samples, points)."""
    spectrum = np.fft.fft(rest, axis=0) / len(rest)
    if monodromy is None:
        multipliers = np.full((2, rest.shape[1]), np.nan)
    else:
        multipliers = multipliers_of(monodromy)
    return Answer(mean + spectrum[0].real, 2 * abs(spectrum[1]), 2 * abs(spectrum[2]), multipliers)


def force_rest(numbers: dict, z0: np.ndarray, y: np.ndarray, w: np.ndarray) -> np.ndarray:
    """F/W0 less its constant part z0/(1 + ratio), without cancellation."""
    n = numbers
    elastic = z0 * n["ratio"] / (1 + n["ratio"])
    return (n["kappa"] * y * w + elastic * (w - 1)) / (w + n["ratio"])
