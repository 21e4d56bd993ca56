"""Is a recording whole? Sampling, missing values, saturation: looked at, and never repaired."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from asperity.recording.finding import Finding
from asperity.recording.sampling import check_sampling, even_rate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from asperity.recording.trace import Trace

    Array = NDArray[np.float64]

__all__ = ["CHECKED", "check", "even_rate"]

#: Names of the findings that `check` can make; a reader makes others.
CHECKED = frozenset(
    {
        "backward time",
        "constant",
        "gap",
        "infinite",
        "nan",
        "repeated time",
        "rounded time",
        "saturation",
        "spike",
        "uneven sampling",
    }
)

#: Values next to the extreme that say how crowded a level is without saturation.
_LEVELS = 3
#: The extreme of a smooth signal that is quantised holds at most 2.4 times the samples of the next
#: level where it is a parabola, and 5.3 times where it is as flat as a fourth power.
_CROWDED = 8
_FEWEST = 5

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


def check(trace: Trace) -> tuple[Finding, ...]:
    """Look for everything that can make a reading of `trace` wrong.

    Parameters
    ----------
    trace : Trace
        Any recording; it stays as it is.

    Returns
    -------
    tuple of Finding
        ``"backward time"``, ``"repeated time"``, ``"rounded time"``, ``"gap"``,
        ``"uneven sampling"``, ``"nan"``, ``"infinite"``, ``"constant"``, ``"spike"`` and
        ``"saturation"``; at most one of a name for time and for each channel. Empty when nothing
        was found.

    Notes
    -----
    A gap is a step of time longer than 1.5 times the median of the 24 steps before it, and of
    those after it, and outside their scatter: a change of the sampling rate is uneven, and no gap.
    Saturation is a crowd of samples at exactly the largest or smallest value. A spike stands out of
    the samples on both sides of it by ten usual differences, for three samples at most.
    """
    # Sums and differences of a damaged file may overflow, which is no news here.
    with np.errstate(over="ignore", invalid="ignore"):
        findings = [*_missing(trace.time, trace.time, "time"), *check_sampling(trace.time)]
        for name, channel in trace.channels.items():
            findings += _missing(channel.values, trace.time, name)
            findings += _saturation(channel.values, trace.time, name)
            findings += _spikes(channel.values, trace.time, name)
    return tuple(findings)


def _missing(values: Array, time: Array, name: str) -> list[Finding]:
    # A sum is finite when all terms are, and costs one pass without a copy; when it is not, look.
    if np.isfinite(values.sum()):
        return []
    findings = []
    for slug, bad in (("nan", np.isnan(values)), ("infinite", np.isinf(values))):
        count = int(bad.sum())
        if not count:
            continue
        first = int(np.argmax(bad))
        what = "not a number" if slug == "nan" else "infinite"
        findings.append(
            Finding(
                slug,
                "error" if count == values.size or name == "time" else "warning",
                count,
                f"{name}, row {first}, t = {time[first]:.10g} s",
                f"{count} of {values.size} values of '{name}' are {what}, the first in row "
                f"{first}.",
            )
        )
    return findings


def _saturation(values: Array, time: Array, name: str) -> list[Finding]:
    """Findings ``"saturation"`` for the top and the bottom, or ``"constant"``.

    A channel of three values or fewer, such as a switch, has no flat top of its own.
    """
    finite = values if np.isfinite(values.sum()) else values[np.isfinite(values)]
    if finite.size < 2:
        return []
    low, high = float(finite.min()), float(finite.max())
    if low == high:
        return [
            Finding(
                "constant",
                "note",
                high,
                f"{name}, row 0, t = {time[0]:.10g} s",
                f"'{name}' has one and the same value in the whole recording.",
            )
        ]
    findings = []
    for side, extreme in (("largest", high), ("smallest", low)):
        at_extreme = values == extreme
        count = int(np.count_nonzero(at_extreme))
        # The usual case, and the cheap one.
        if count < _FEWEST or not (at_extreme[1:] & at_extreme[:-1]).any():
            continue
        usual = _most_at_a_level(finite, extreme, side)
        if usual is None or count <= _CROWDED * usual:
            continue
        first = int(np.argmax(at_extreme))
        sentence = (
            f"{count} of {values.size} samples of '{name}' stand at exactly its {side} value, "
            f"{extreme:.6g}, and at most {usual} at any value next to it: saturated, or held there "
            "by a command."
        )
        where = f"{name}, row {first}, t = {time[first]:.10g} s"
        findings.append(Finding("saturation", "warning", count / values.size, where, sentence))
    return findings


def _most_at_a_level(values: Array, extreme: float, side: str) -> int | None:
    """Samples at the fullest of the values next to the extreme; None if there are too few."""
    left, most = values, 0
    level = extreme
    for _ in range(_LEVELS):
        left = left[left < level] if side == "largest" else left[left > level]
        if not left.size:
            return None
        level = left.max() if side == "largest" else left.min()
        most = max(most, int(np.count_nonzero(left == level)))
    return most


def _spikes(values: Array, time: Array, name: str) -> list[Finding]:
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
    parts = [np.empty(0, dtype=np.intp)]
    most = max(_APART)
    # What overflows or is missing is news of another check.
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, max(values.size - 2 * most, 0), _CHUNK):
            piece = values[start : start + _CHUNK + 2 * most]
            parts += [_standing_out(piece, apart) + start for apart in _APART]
    return np.unique(np.concatenate(parts))


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
            near_sizes = np.where(inside, sizes[np.clip(near, 0, sizes.size - 1)], 0.0)
            out[part] &= jump[part] > _OUT * np.median(near_sizes, axis=1)
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
