"""Samples of a recording that are wrong by themselves: spikes of electronics, single misreadings.

Where the drive does not change, a sample that is farther off than noise can be, while those beside
it are not, is one. Just after a change the motion itself may be off by as much, in a law that is
wrong, and friction may peak in one sample; there a sample is wrong that the spring cannot be pulled
to from its neighbours, whatever the law.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from asperity.inference.runs.noise import Autoregression
from asperity.inference.runs.run import RecordedRun

Float = NDArray[np.float64]

#: A sample that is farther off than this by chance, over the whole run, is wrong; the largest share
#: of samples that are left out as such.
_CHANCE, MOST = 1e-4, 0.01
#: Samples on either side of a change of the drive that are left out only where no motion leads to
#: them; how many deviations they must stand out by to be asked about, and how many of a change are.
AT_CHANGE, _STANDS_OUT, _MOST_AT_CHANGE = 5, 8.0, 2
#: How many times farther than a spring could take them they are off where they are wrong.
CLEARLY = 2.0
#: Changes of the load are few if there are so many samples to each.
_FEW_CHANGES = 100


def largest_by_chance(size: int) -> float:
    """Standard deviations that no sample of so many is off by chance."""
    return float(norm.isf(_CHANCE / (2 * size)))


def first_after_changes(run: RecordedRun) -> list[int]:
    """First samples after changes of the velocity, and of the load where they are few."""
    inner = run.drive.edges[1:-1]
    few = inner.size * _FEW_CHANGES <= run.time.size
    edges = inner if few else run.drive.edges[list(run.cuts)]
    return [int(k) for k in np.searchsorted(run.time, edges)]


def far_off_alone(
    run: RecordedRun,
    models: Sequence[Autoregression],
    white: Float,
    known: Sequence[int],
) -> list[int]:
    """Samples away from changes of the drive that are farther off than noise can be, worst first.

    Parameters
    ----------
    run : RecordedRun
    models : sequence of Autoregression
        Of each stretch.
    white : array, shape (n,)
        Innovations.
    known : sequence of int
        Samples that are left out already.
    """
    limit, room = largest_by_chance(white.size), int(MOST * white.size) - len(known)
    result: list[int] = []
    for model, (a, b) in zip(models, run.stretches, strict=True):
        apart = np.abs(model.departures_of_single_samples(white[a:b]))
        apart[[k - a for k in known if a <= k < b]] = 0.0
        # At a step a wrong motion is off by a few samples, and must not hide its misfit.
        for first in first_after_changes(run):
            first -= a
            apart[max(first - AT_CHANGE, 0) : max(first + AT_CHANGE, 0)] = 0.0
        reach = max(3, model.order)
        for k in np.argsort(-apart):
            if apart[k] <= limit or len(result) >= room:
                break
            # Beside a sample that is far off, others seem to be.
            if all(abs(k + a - other) > reach for other in result):
                result.append(int(k) + a)
    return result


def alone_at_changes(run: RecordedRun) -> dict[int, float]:
    """Samples beside changes of the drive that lie far above both their neighbours, or below.

    They are wrong, or a peak of friction that one sample holds.

    Returns
    -------
    dict of int to float
        Distance from the nearer neighbour.
    """
    result: dict[int, float] = {}
    for a, b in run.stretches:
        near = [first - a for first in first_after_changes(run)]
        alone = standing_out(run.friction[a:b], near, AT_CHANGE)
        result |= {k + a: size for k, size in alone.items()}
    return result


def standing_out(friction: Float, near: Sequence[int], reach: int) -> dict[int, float]:
    """Samples about given ones that lie far above both their neighbours, or below.

    Parameters
    ----------
    friction : array, shape (n,)
    near : sequence of int
    reach : int
        Samples on either side of each that are looked at.

    Returns
    -------
    dict of int to float
        Distance from the nearer neighbour.
    """
    result: dict[int, float] = {}
    friction = friction.copy()
    bends = np.abs(friction[1:-1] - 0.5 * (friction[:-2] + friction[2:]))
    scatter = 1.4826 * float(np.median(bends))
    for first in near:
        low, high = max(first - reach, 1), min(first + reach, friction.size - 1)
        for _ in range(_MOST_AT_CHANGE if low < high else 0):
            apart = _beyond_neighbours(friction[low - 1 : high + 1])
            k = low + int(np.argmax(apart))
            if apart[k - low] <= _STANDS_OUT * scatter:
                break
            result[k] = float(apart[k - low])
            # Its neighbours are judged without it.
            friction[k] = 0.5 * (friction[k - 1] + friction[k + 1])
    return result


def beyond_any_motion(
    run: RecordedRun, samples: Mapping[int, float], stiffness: float
) -> list[int]:
    """Samples that lie farther above or below their neighbours than a spring allows.

    Whatever the law, the force rises by no more than what the drive pulls the spring in the time,
    since the slider does not slide back: to a peak, or from a dip.

    Parameters
    ----------
    run : RecordedRun
    samples : mapping of int to float
        As `alone_at_changes` returns them.
    stiffness : float
        Force that the gauge shows over the pulled length, in the unit of the load over a metre.
    """
    drive, time = run.drive, run.time
    stretching = stiffness / (run.W0 * float(np.min(drive.load))) * run.velocity
    result = []
    for k, size in samples.items():
        near = time[[max(k - 2 * AT_CHANGE, 0), min(k + 2 * AT_CHANGE, time.size - 1)]]
        first, last = np.searchsorted(drive.edges[1:-1], near)
        pull = float(np.max(np.abs(drive.pull[first : last + 1])))
        longest = float(np.max(np.diff(time[k - 1 : k + 2])))
        if size > CLEARLY * stretching * pull * longest:
            result.append(k)
    return result


def _beyond_neighbours(x: Float) -> Float:
    """How far each sample but the first and last is above both its neighbours, or below both."""
    before, here, after = x[:-2], x[1:-1], x[2:]
    above = here - np.maximum(before, after)
    below = np.minimum(before, after) - here
    return np.asarray(np.maximum(np.maximum(above, below), 0.0))
