"""The table that the search fills in, and the options it runs under."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices
from asperity.solve.floquet import log_multipliers
from asperity.solve.kernels import Reading
from asperity.solve.outcome import Outcome

Float = NDArray[np.float64]


class Found(NamedTuple):
    """Results of a search, points along the last axis; NaN where no orbit was found."""

    mean_friction: Float
    harmonics: NDArray[np.complex128]
    log_multipliers: NDArray[np.complex128]
    start: Float
    waveform: Float
    iterations: NDArray[np.int64]
    outcome: NDArray[np.int64]
    detail: Float

    @classmethod
    def empty(cls, size: int, points: int, harmonics: int, phases: int) -> Found:
        """Nothing found yet."""
        return cls(
            np.full(points, np.nan),
            np.full((harmonics, points), np.nan + 0j),
            np.full((size, points), np.nan + 0j),
            np.full((size, points), np.nan),
            np.full((2, phases, points), np.nan),
            np.zeros(points, dtype=np.int64),
            np.full(points, int(Outcome.NO_ORBIT)),
            np.zeros(points),
        )

    def discard(self, rows: Indices) -> None:
        """Take the numbers of failed points back, so that none is mistaken for an answer."""
        for values in self[:5]:
            values[..., rows] = np.nan


class Options(NamedTuple):
    """What to read off, and whom to tell."""

    harmonics: int
    phases: int
    progress: Callable[[int], None]


def logs_of(reading: Reading) -> NDArray[np.complex128]:
    """Logarithms of the multipliers of a reading."""
    return log_multipliers(
        np.asarray(reading.monodromy),
        np.asarray(reading.log_scale),
        np.asarray(reading.log_determinant),
    )


def store(found: Found, rows: Indices, reading: Reading, logs: NDArray[np.complex128]) -> None:
    """Write converged points into the table."""
    found.mean_friction[rows] = reading.mean_friction
    found.harmonics[:, rows] = reading.harmonics
    found.log_multipliers[:, rows] = logs
    found.start[:, rows] = reading.start
    found.waveform[..., rows] = reading.waveform
    found.outcome[rows] = Outcome.CONVERGED
