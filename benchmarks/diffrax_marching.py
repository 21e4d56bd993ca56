"""Peer: marching in time with diffrax's Tsit5 in log variables, all points at once.

Marching starts from the averaged limit, for the reason given in `scipy_marching`.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from benchmarks.cases import Batch
from benchmarks.equations import Answer, averaged_limit, force_rest, rates, read
from benchmarks.scipy_marching import LAST, SETTLED

_SAMPLES = 32
_MOST_PERIODS = 5000


class Marching:
    """The compiled map over one period."""

    def __init__(self) -> None:
        import jax

        self.period = jax.jit(jax.vmap(_period))

    def solve(self, batch: Batch, most_periods: int = _MOST_PERIODS) -> Answer:
        """March until all points are periodic, or for `most_periods`."""
        numbers = {k: np.array(v) for k, v in batch.numbers().items()}
        z0, chi = averaged_limit(numbers)
        state = np.stack([np.zeros_like(chi), chi], axis=-1)
        changes = deque([np.inf], LAST)
        for _ in range(most_periods):
            path = np.asarray(self.period(state, numbers, z0))
            scale = np.stack([numbers["kappa"], np.ones_like(chi)], axis=-1)
            changes.append(np.max(np.abs(path[:, -1] - state) * scale))
            state = path[:, -1]
            if max(changes) < SETTLED:
                break
        theta = 2 * np.pi * np.arange(_SAMPLES)[:, None] / _SAMPLES
        w = 1 + numbers["epsilon"] * np.cos(theta)
        rest = force_rest(numbers, z0, path[:, :-1, 0].T, w)
        return read(z0 / (1 + numbers["ratio"]), rest, None)


def _period(state, numbers: dict, z0):
    """Samples of the states over one period, shape (samples + 1, 2)."""
    import diffrax
    import jax.numpy as jnp

    theta = jnp.linspace(0, 2 * np.pi, _SAMPLES + 1)
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(lambda theta, y, _: jnp.stack(rates(theta, y, numbers, z0, jnp))),
        diffrax.Tsit5(),
        0.0,
        2 * np.pi,
        None,
        state,
        # Steps end at the samples, as dense output has a lower order than the steps.
        saveat=diffrax.SaveAt(ts=theta),
        stepsize_controller=diffrax.ClipStepSizeController(
            diffrax.PIDController(rtol=1e-10, atol=1e-12), step_ts=theta[1:-1]
        ),
        max_steps=100_000,
    )
    return solution.ys
