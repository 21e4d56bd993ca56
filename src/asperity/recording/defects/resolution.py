"""Resolution of a channel: the step of its recorder, coarse rounding, repeated samples."""

from __future__ import annotations

import numpy as np

from asperity.arrays import Bool, Float

#: Rounding is coarse where this share of neighbours is equal and the other differences are whole
#: multiples of one step, to this share of it.
_MOSTLY_EQUAL, _WHOLE = 0.5, 0.02
#: Quantile of the differences next to equal samples that is the step: few are smaller by chance, as
#: where the load in F/W changes by a step of its own.
_LEAST = 0.05
#: A sample-and-hold channel repeats at least a tenth of its samples, and has several quantisation
#: steps between them: a sine whose usual difference is this many steps repeats 5 % at its extremes.
#: Of 73 held channels of `benchmarks.hostile_modulation` all are named, and of 1,046 clean ones of
#: `benchmarks.clipped_recordings` four, three of them with narrow peaks and one with four samples a
#: period.
_REPEATED, _STEPS = 0.1, 5.0


def recorder_step(values: Float, repeated: float = 0.05) -> float:
    """Step of the recorder, in the unit of the values; 0 of a fine recorder.

    A recorder whose steps are seen repeats samples. Next to a repeated sample the signal changes by
    one step, while elsewhere it may pass many.

    Parameters
    ----------
    values : array, shape (n,)
    repeated : float
        Share of repeated samples from which on the recorder is coarse.
    """
    steps, equal = _steps(values)
    if np.count_nonzero(equal) <= repeated * equal.size or equal.all():
        return 0.0
    adjacent = ~equal
    adjacent[1:-1] &= equal[:-2] | equal[2:]
    return float(np.quantile(steps[adjacent], _LEAST))


def _steps(values: Float) -> tuple[Float, Bool]:
    """Sizes of the differences between neighbours, and which of them are equal."""
    steps = np.abs(np.diff(values))
    return steps, steps <= 1e-9 * float(np.median(np.abs(values)))


def coarsely_rounded(values: Float) -> tuple[float, float] | None:
    """Share of values equal to the value before, and the step of the others.

    None where values were not rounded, or no more coarsely than their noise.

    Parameters
    ----------
    values : array, shape (n,)

    Notes
    -----
    Rounding acts like white noise if the signal has noise of that size (Widrow, 1956). If most
    neighbours are equal there is no such noise, and the rounding error follows the signal.
    """
    step = recorder_step(values, _MOSTLY_EQUAL)
    if not step:
        return None
    steps, equal = _steps(values)
    digits = steps[~equal] / step
    if float(np.abs(digits - np.round(digits)).max()) >= _WHOLE:
        return None
    return float(equal.mean()), step


def held_length(values: Float) -> float | None:
    """Mean number of equal samples in a row, where a converter is slower than the recorder.

    None where the resolution of the channel explains the equal samples.

    Parameters
    ----------
    values : array, shape (n,)
    """
    steps = np.abs(np.diff(values))
    moving = steps[steps > 0]
    repeated = 1 - moving.size / max(steps.size, 1)
    if repeated < _REPEATED or moving.size < 16:
        return None
    if not float(np.median(moving)) > _STEPS * float(moving.min()):
        return None
    return float(np.diff(np.flatnonzero(steps > 0)).mean())
