"""Peer: shooting with heyoka, Taylor integration in SIMD batches with variational equations.

Everything known to us that makes heyoka fast is used: equations with few products (see
`equations`), one compilation, no compact mode, one point in a SIMD lane, points of similar epsilon
in a batch, a first Newton step at a loose tolerance, and harmonics from the dense output of the
last period.
"""

from __future__ import annotations

import numpy as np

from benchmarks.cases import Batch
from benchmarks.equations import Answer, averaged_limit, force_rest, read

TOLERANCE = 1e-10
_LOOSE = 1e-6
_SAMPLES = 32
_NUMBERS = ("mu", "A", "B", "kappa", "ratio", "ageing", "epsilon")
#: Vectors integrated together, which hides the latency of the arithmetic.
_VECTORS = 2


def _integrator(tolerance: float, lanes: int):
    import heyoka as hy

    y, chi = hy.make_vars("y", "chi")
    mu, A, B, kappa, ratio, ageing, epsilon, z0 = (hy.par[i] for i in range(8))
    w = 1.0 + epsilon * hy.cos(hy.time)
    z = z0 + kappa * y
    f_over_w = z / (w + ratio)
    phi = chi + ageing / kappa * (z - ratio * f_over_w)
    slip = hy.exp((f_over_w - mu - B * phi) / A)
    equations = [(y, 1.0 - slip), (chi, ageing * (hy.exp(-phi) - 1.0))]
    return hy.taylor_adaptive_batch(
        hy.var_ode_sys(equations, hy.var_args.vars, order=1),
        np.zeros((6, lanes)),
        tol=tolerance,
        pars=np.zeros((8, lanes)),
        compact_mode=False,
        high_accuracy=False,
    )


class Shooting:
    """Compiled integrators for any number of points."""

    def __init__(self) -> None:
        import heyoka as hy

        self.lanes = _VECTORS * hy.recommended_simd_size()
        self.fine = _integrator(TOLERANCE, self.lanes)
        self.loose = _integrator(_LOOSE, self.lanes)
        theta = np.linspace(0, 2 * np.pi, _SAMPLES + 1)
        self.grid = np.repeat(theta[:, None], self.lanes, axis=1)

    def solve(self, batch: Batch) -> Answer:
        """Solve all points; copies of points fill up the last vector."""
        order = np.argsort(batch.epsilon)
        filled = np.resize(order, -(-len(batch) // self.lanes) * self.lanes)
        numbers = {k: v[filled] for k, v in batch.numbers().items()}
        z0, chi0 = averaged_limit(numbers)
        values = np.array([*(numbers[name] for name in _NUMBERS), z0])
        runs = [
            self._shoot(values[:, i : i + self.lanes], chi0[i : i + self.lanes])
            for i in range(0, len(filled), self.lanes)
        ]
        y = np.concatenate([run[:, 0] for run in runs], axis=1)[:-1]
        last = np.concatenate([run[-1, 2:] for run in runs], axis=1)
        w = 1 + numbers["epsilon"] * np.cos(self.grid[:-1, :1])
        rest = force_rest(numbers, z0, y, w)
        answer = read(z0 / (1 + numbers["ratio"]), rest, last.T.reshape(-1, 2, 2))
        back = np.argsort(order)
        return Answer(*(a[..., : len(batch)][..., back] for a in answer))

    def _shoot(self, values: np.ndarray, chi: np.ndarray) -> np.ndarray:
        start = np.array([np.zeros_like(chi), chi])
        self._set(self.loose, values, start)
        self.loose.propagate_until(self.grid[-1])
        start = start + _newton(start, self.loose.state)
        for _ in range(8):
            self._set(self.fine, values, start)
            path = self.fine.propagate_grid(self.grid)[-1]
            step = _newton(start, path[-1])
            # Changes of the force over W0, and of the exponent of the slip rate.
            if np.abs(values[3] * step[0]).max() < 1e-11 and np.abs(step[1]).max() < 1e-8:
                break
            start = start + step
        return path

    def _set(self, integrator, values: np.ndarray, start: np.ndarray) -> None:
        integrator.pars[:] = values
        integrator.set_time(0.0)
        integrator.state[:2] = start
        integrator.state[2:] = np.eye(2).reshape(4, 1)


def _newton(start: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Newton step by Cramer's rule: LAPACK calls would cost as much as the integration."""
    gap = state[:2] - start
    a, b, c, d = state[2:] - np.eye(2).reshape(4, 1)
    determinant = a * d - b * c
    return np.array([b * gap[1] - d * gap[0], c * gap[0] - a * gap[1]]) / determinant
