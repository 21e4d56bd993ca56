"""Peer and reference: SciPy's DOP853 with variational equations, and shooting."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.cases import Batch
from benchmarks.equations import Answer, averaged_limit, force_rest, multipliers_of, newton_step

#: Tolerance of the reference, the smallest that round-off allows.
REFERENCE = 1e-13


def solve(batch: Batch, tolerance: float = 1e-10) -> Answer:
    """Solve the points one after the other."""
    return solve_numbers(batch.numbers(), tolerance)


def solve_numbers(numbers: dict[str, np.ndarray], tolerance: float) -> Answer:
    """Solve points by their dimensionless numbers, each (points,)."""
    z0, chi0 = averaged_limit(numbers)
    answers = [
        _solve_point({k: v[i] for k, v in numbers.items()}, z0[i], chi0[i], tolerance)
        for i in range(z0.size)
    ]
    return Answer(*(np.stack(values, axis=-1) for values in zip(*answers, strict=True)))


def _solve_point(numbers: dict, z0: float, chi0: float, tolerance: float) -> Answer:
    start = np.array([0.0, chi0])
    for _ in range(12):
        state = np.concatenate([start, np.eye(2).ravel(), np.zeros(5)])
        # y and chi differ by orders of magnitude from their variations, so that each has its scale.
        scale = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, *[numbers["kappa"]] * 5])
        run = solve_ivp(
            _rates,
            (0.0, 2 * np.pi),
            state,
            "DOP853",
            args=(numbers, z0),
            rtol=max(tolerance, 3e-14),
            atol=0.1 * tolerance * scale,
        )
        end = run.y[:, -1]
        monodromy = end[2:6].reshape(1, 2, 2)
        step = newton_step(start[:, None], end[:2, None], monodromy)[:, 0]
        # The change of the mean force, and of the exponent of the slip rate.
        if abs(numbers["kappa"] * step[0]) < tolerance and abs(step[1]) < 10 * tolerance:
            break
        start = start + step
    mean, c1, s1, c2, s2 = end[6:] / np.pi
    return Answer(
        z0 / (1 + numbers["ratio"]) + 0.5 * mean,
        np.hypot(c1, s1),
        np.hypot(c2, s2),
        multipliers_of(monodromy)[:, 0],
    )


def _rates(theta: float, state: np.ndarray, numbers: dict, z0: float) -> list[float]:
    """Rates of y and chi, of their variations by rows, and of the Fourier integrals of F/W0."""
    n = numbers
    y, chi = state[:2]
    w = 1 + n["epsilon"] * np.cos(theta)
    share = w / (w + n["ratio"])
    f = (z0 + n["kappa"] * y) * share
    coupling = n["ageing"] / n["kappa"]
    phi = chi + coupling * f
    slip = np.exp((f / w - n["mu"] - n["B"] * phi) / n["A"])
    young = n["ageing"] * np.exp(-phi)
    f_y = n["kappa"] * share
    J = np.array(
        [
            [-slip * (f_y / w - n["B"] * coupling * f_y) / n["A"], slip * n["B"] / n["A"]],
            [-young * coupling * f_y, -young],
        ]
    )
    variations = J @ state[2:6].reshape(2, 2)
    rest = force_rest(n, z0, y, w)
    waves = [1.0, np.cos(theta), np.sin(theta), np.cos(2 * theta), np.sin(2 * theta)]
    rates = [1 - slip, young - n["ageing"]]
    return [*rates, *variations.ravel(), *(rest * wave for wave in waves)]
