"""Unexplained jumps of a signal's level: a gauge that slips, is moved, or changes its range.

A jump is a single large step between samples, with usual steps around it. The steps are modelled by
an autoregression, which includes drift, motion and noise of any correlation length: a random walk
of the level is no jump. The size of a jump is estimated by generalised least squares. A jump is
significant if its size over its standard error exceeds the maximum of noise in 999 of 1,000
recordings, and that of any gradual change around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.special import ndtri

from asperity.arrays import Float
from asperity.recording.defects.autoregression import Autoregression, fitted

#: Probability that noise is taken for a jump, anywhere in a recording.
CHANCE = 1e-3
#: Largest number of jumps.
_MOST = 5
#: Lengths (samples) of a gradual change, and the share of its departure that a jump must exceed.
#: Without this rule 9 of 180 recordings with hum and without jump have a false one, from motion
#: after changes of the drive; with it none has. A share of 1 loses one of six jumps under white
#: noise.
_GRADUAL, _SUDDEN = (4, 8, 16, 32), 0.95
#: Number of samples at the ends of a stretch, where no gradual change as long as the longest has
#: room on both sides. With 6, up to 21 of 60 velocity steps whose transient reaches into the
#: stretch have a false jump, with 32 none of 900.
_EDGE = max(_GRADUAL)
#: Smallest number of samples of a stretch.
_SHORTEST = 64


class Jump(NamedTuple):
    """A jump of the level.

    Attributes
    ----------
    sample : int
        First sample behind the jump.
    size : float
    departure : float
        Size over its standard error.
    """

    sample: int
    size: float
    departure: float


def find_jumps(
    values: Float, stretches: Sequence[tuple[int, int]], chance: float = CHANCE
) -> list[Jump]:
    """Jumps of the level within stretches, the largest departure first.

    Parameters
    ----------
    values : array, shape (n,)
        Evenly sampled and finite within each stretch.
    stretches : sequence of (int, int)
        Start and stop (exclusive) of each stretch without a known change of the level. Short
        stretches are skipped.
    chance : float
        Probability that any of the jumps is noise.

    Notes
    -----
    The look-elsewhere correction is that of Bonferroni over all samples. With an impulse at t the
    steps d have innovations that are the autoregression's weights from t on, and the estimate of
    the impulse over its error is their correlation with the innovations (the innovational form of
    the additive outlier of Fox, J. R. Stat. Soc. B 34, 350, 1972).
    """
    steps = [np.diff(values[a:b]) for a, b in stretches]
    places = [a + 1 for a, _ in stretches]
    used = [k for k, d in enumerate(steps) if d.size >= _SHORTEST]
    if not used:
        return []
    limit = -float(ndtri(chance / (2 * sum(steps[k].size for k in used))))
    result: list[Jump] = []
    while len(result) < _MOST:
        model = fitted([steps[k] - np.mean(steps[k]) for k in used])
        best = Jump(-1, 0.0, limit)
        for k in used:
            size, departure = _impulses(model, steps[k] - np.mean(steps[k]))
            departure[:_EDGE] = departure[departure.size - _EDGE :] = 0.0
            at = int(np.argmax(np.abs(departure)))
            if abs(departure[at]) > abs(best.departure):
                best = Jump(places[k] + at, float(size[at]), float(departure[at]))
                where = k, at
        if best.sample < 0:
            break
        k, at = where
        steps[k][at] -= best.size
        result.append(best)
    return result


def _impulses(model: Autoregression, steps: Float) -> tuple[Float, Float]:
    """Size of an impulse at each sample, and this size over its standard error.

    The ratio is 0 where a gradual change over several samples explains the departure as well.
    """
    white = model.whiten(steps[:, None])[:, 0]
    departure = model.departures_of_single_samples(white)
    weights = np.concatenate([[1.0], -model.coefficients[-1]])
    length = float(np.sqrt(weights @ weights))
    sums = np.concatenate([[0.0], np.cumsum(departure)])
    sudden = np.ones(steps.size, bool)
    for wide in _GRADUAL:
        spread = np.convolve(weights, np.ones(wide))
        changes = np.abs(sums[wide:] - sums[:-wide]) * length / np.sqrt(float(spread @ spread))
        # The largest of the gradual changes that contain the sample.
        around = np.concatenate([np.zeros(wide - 1), changes, np.zeros(wide - 1)])
        sudden &= np.abs(departure) > _SUDDEN * sliding_window_view(around, wide).max(axis=1)
    return model.innovation / length * departure, np.where(sudden, departure, 0.0)
