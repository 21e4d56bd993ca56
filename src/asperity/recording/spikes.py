"""Spikes: samples that jump away from both sides and come back, as dropped bits and sparks do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from asperity.recording.finding import Finding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: A spike stands out of both samples so far before and behind it. Next neighbours see it beside a
#: fast modulation; those farther off see spikes that last longer than a sample.
_APART = (1, 3)
#: How far it stands out, in usual differences of samples so far apart. White noise of 1e8 samples
#: reaches seven, a sine 1.6.
_OUT = 10.0
#: Samples that share one usual difference: small enough for the second cache.
_CHUNK = 1 << 14
#: Differences on each side of a spike that must be small too.
_SIDE = 16
#: A chunk's usual difference is taken from every so many of them.
_EVERY = 8


def check_spikes(values: Array, time: Array, name: str) -> list[Finding]:
    """Finding ``"spike"``, for samples that stand out of both sides of themselves.

    A step, a slip event or a change of the amplitude has a new level on one side, and is none.
    """
    at = np.array(spikes(values), dtype=np.intp)
    if not at.size:
        return []
    first = int(at[0])
    usual = np.nanmedian(values[max(0, first - 100) : first + 100])
    return [
        Finding(
            "spike",
            "warning",
            at.size,
            f"{name}, row {first}, t = {time[first]:.10g} s",
            f"{at.size} of {values.size} samples of '{name}' jump out and back, the first, "
            f"{values[first]:.6g} where {usual:.6g} is usual, in row {first}.",
        )
    ]


def spikes(values: Array) -> NDArray[np.intp]:
    """Samples that are spikes, in rising order."""
    found = [np.empty(0, dtype=np.intp)]
    most = max(_APART)
    # What overflows or is missing is news of another check.
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, max(values.size - 2 * most, 0), _CHUNK):
            piece = values[start : start + _CHUNK + 2 * most]
            found += [_standing_out(piece, apart) + start for apart in _APART]
    return np.unique(np.concatenate(found))


def _standing_out(piece: Array, apart: int) -> NDArray[np.intp]:
    steps = piece[apart:] - piece[:-apart]
    limit = _OUT * _usual(steps)
    if not limit > 0:
        return np.empty(0, dtype=np.intp)
    up, down = steps > limit, steps < -limit
    if not (up.any() and down.any()):
        return np.empty(0, dtype=np.intp)
    # Out on one side and back on the other: a step has a new level there.
    at = np.flatnonzero((up[:-apart] & down[apart:]) | (down[:-apart] & up[apart:])) + apart
    return at[np.isfinite(piece[at]) & _locally(np.abs(steps), at, apart)]


def _locally(sizes: Array, at: NDArray[np.intp], apart: int) -> NDArray[np.bool_]:
    """Whether spikes stand out of what is usual on each side, as where a modulation begins."""
    jump = np.minimum(sizes[at - apart], sizes[at])
    out = np.ones(at.size, dtype=bool)
    # The steps of the spike itself end where it is one step away.
    for side in (np.arange(-_SIDE, 0) - 2 * apart + 1, np.arange(_SIDE) + apart):
        for part in np.array_split(np.arange(at.size), at.size // _CHUNK + 1):
            near = at[part, None] + side
            inside = (near >= 0) & (near < sizes.size)
            beside = np.where(inside, sizes[np.clip(near, 0, sizes.size - 1)], 0.0)
            out[part] &= jump[part] > _OUT * np.median(beside, axis=1)
    return out


def _usual(steps: Array) -> float:
    """The usual size of a difference, which a few spikes hardly change."""
    size = np.abs(steps[::_EVERY])
    size = size[np.isfinite(size)]
    if not size.size:
        return 0.0
    usual = float(np.median(size))
    if usual:
        return usual
    # A coarse recorder stands still most of the time: its single steps are usual too.
    every = np.abs(steps[np.isfinite(steps)])
    moving = every[every > 0]
    return float(np.median(moving)) if moving.size > 0.02 * every.size else _smallest(moving)


def _smallest(moving: Array) -> float:
    return float(moving.min()) if moving.size else 0.0
