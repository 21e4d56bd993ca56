"""Spikes: single wrong samples, from electronics or transmission.

A spike stands out of the samples on both sides of it, for three samples at most; a step, a slip
event or a change of an amplitude has a new level on one side, and is no spike. Friction itself may
have a peak of one sample where the drive changes: there a spike must be larger than any difference
of neighbouring samples elsewhere in the recording.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from asperity.arrays import Bool, Float, Index

#: A spike stands out of both samples at these distances. Next neighbours detect it next to a
#: fast modulation; more distant samples detect spikes longer than a sample.
_DISTANCES = (1, 3)
#: Smallest size of a spike, in usual differences of samples at that distance. White noise of 1e8
#: samples reaches 7, a sine 1.6.
_OUT = 10.0
#: Samples of a chunk with a common usual difference; they fit into the second-level cache.
_CHUNK = 1 << 14
#: Number of differences on each side of a spike that must be small, too.
_SIDE = 16
#: Stride of the differences from which the usual difference of a chunk is computed.
_EVERY = 8
#: Samples on either side of a change of the drive where the stricter rule applies; samples next to
#: a spike whose differences belong to it; and smallest ratio of a spike to all other differences
#: there.
_AT_CHANGE, _ITS_OWN, _CLEARLY = 16, 3, 2.0


def spikes(values: Float) -> Index:
    """Samples that are spikes, in rising order."""
    parts = [np.empty(0, dtype=np.intp)]
    most = max(_DISTANCES)
    # Another check reports missing and overflowing values.
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, max(values.size - 2 * most, 0), _CHUNK):
            piece = values[start : start + _CHUNK + 2 * most]
            parts += [_standing_out(piece, distance) + start for distance in _DISTANCES]
    return np.unique(np.concatenate(parts))


def _standing_out(piece: Float, distance: int) -> Index:
    steps = piece[distance:] - piece[:-distance]
    limit = _OUT * _usual(steps)
    if not limit > 0:
        return np.empty(0, dtype=np.intp)
    up, down = steps > limit, steps < -limit
    if not (up.any() and down.any()):
        return np.empty(0, dtype=np.intp)
    # A spike goes out and back; a step stays at a new level.
    at = (
        np.flatnonzero((up[:-distance] & down[distance:]) | (down[:-distance] & up[distance:]))
        + distance
    )
    return at[np.isfinite(piece[at]) & _locally(np.abs(steps), at, distance)]


def _locally(sizes: Float, at: Index, distance: int) -> Bool:
    """Whether spikes exceed the usual differences on both sides, as a modulation may begin here."""
    room = _SIDE + 2 * distance
    runs = sliding_window_view(np.pad(sizes, room), _SIDE)
    # The steps of the spike itself end where it is one step away.
    sides = np.stack([runs[at + 1], runs[at + room + distance]])
    usual = np.median(sides, axis=-1).max(0)
    return np.asarray(np.minimum(sizes[at - distance], sizes[at]) > _OUT * usual)


def _usual(steps: Float) -> float:
    """The usual size of a difference: robust against a few spikes."""
    size = np.abs(steps[::_EVERY])
    size = size[np.isfinite(size)]
    if not size.size:
        return 0.0
    usual = float(np.median(size))
    if usual:
        return usual
    # A coarse recorder repeats most values; its single steps then count as usual.
    every = np.abs(steps[np.isfinite(steps)])
    moving = every[every > 0]
    if moving.size > 0.02 * every.size:
        return float(np.median(moving))
    return float(moving.min()) if moving.size else 0.0


def away_from_changes(values: Float, rows: Index, changes: Sequence[int]) -> Index:
    """Spikes without the peaks that friction itself may have at changes of the drive.

    Parameters
    ----------
    values : array, shape (n,)
    rows : array of int
        Spikes, in rising order.
    changes : sequence of int
        First samples after changes of the drive.
    """
    edges = np.sort(np.asarray(changes, np.intp))
    if not edges.size or not rows.size:
        return rows
    at = np.searchsorted(edges, rows)
    nearest = np.minimum(
        np.abs(rows - edges[np.minimum(at, edges.size - 1)]),
        np.abs(rows - edges[np.maximum(at - 1, 0)]),
    )
    near = nearest <= _AT_CHANGE
    kept = list(rows[~near])
    steps = np.abs(np.diff(without(values, rows[~near])))
    for k in rows[near]:
        elsewhere = np.concatenate([steps[: max(k - _ITS_OWN, 0)], steps[k + _ITS_OWN :]])
        if min(steps[k - 1], steps[k]) > _CLEARLY * elsewhere.max(initial=0.0):
            kept.append(k)
    return np.sort(np.array(kept, np.intp))


def without(values: Float, rows: Index) -> Float:
    """Values with linear interpolation in place of the samples `rows`.

    Parameters
    ----------
    values : array, shape (n,)
    rows : array of int
    """
    good = np.ones(values.size, bool)
    good[rows] = False
    at = np.flatnonzero(good)
    result = values.copy()
    result[rows] = np.interp(rows, at, values[at])
    return result
