"""Peer: marching in time with SciPy's LSODA until the response repeats.

Marching starts from the averaged limit. At full amplitude a start in steady sliding runs away, as
steady sliding is unstable with the paper's parameters and the slider has no inertia.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.cases import Batch
from benchmarks.equations import Answer, averaged_limit, force_rest, rates, read

_SAMPLES = 32
#: The march ends if no change of the states over each of the last periods is larger. Transients
#: decay by a hundredth per period, so that the remaining change is a hundred times this one.
SETTLED, LAST = 1e-10, 10
_MOST_PERIODS = 5000


def solve(batch: Batch) -> Answer:
    """March each point to its periodic state."""
    numbers = batch.numbers()
    z0, chi0 = averaged_limit(numbers)
    answers = [
        _march({k: v[i] for k, v in numbers.items()}, z0[i], chi0[i]) for i in range(len(batch))
    ]
    return Answer(*(np.concatenate(values, axis=-1) for values in zip(*answers, strict=True)))


def _march(numbers: dict, z0: float, chi0: float) -> Answer:
    state = np.array([0.0, chi0])
    theta = np.linspace(0, 2 * np.pi, _SAMPLES + 1)
    changes = deque([np.inf], LAST)
    for _ in range(_MOST_PERIODS):
        run = solve_ivp(
            rates,
            (0.0, 2 * np.pi),
            state,
            "LSODA",
            t_eval=theta,
            args=(numbers, z0),
            rtol=1e-10,
            atol=1e-12,
        )
        changes.append(np.max(np.abs(run.y[:, -1] - state) * [numbers["kappa"], 1.0]))
        state = run.y[:, -1]
        if max(changes) < SETTLED:
            break
    w = 1 + numbers["epsilon"] * np.cos(theta[:-1, None])
    rest = force_rest(numbers, z0, run.y[0, :-1, None], w)
    return read(np.array([z0 / (1 + numbers["ratio"])]), rest, None)
