"""Long recordings as means over blocks of samples.

A recording of millions of samples is compared with the means of the computed motion over blocks of
equal duration. Nothing is approximated by that: the motion is averaged over the same blocks, steps
of the drive within a block included, and the noise is estimated from the means themselves. What is
lost is what changes within a block. Blocks are therefore as short as the changes of friction after
each change of the drive need: the difference of the two halves of a block (a Haar coefficient) is
compared there with its scatter elsewhere.

Mains and other lines far above the blocks' rate would come down as lines of other frequencies. They
are taken off before, piece by piece, since mains wander.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.special import chdtrc

from asperity.arrays import Float
from asperity.errors import require
from asperity.inference.runs.run import LONGEST, Blocks, RecordedRun
from asperity.recording.defects.lines import find_lines, take_off
from asperity.units import to_si

#: Blocks of a recording, at least and at most.
_FEWEST, _MOST = 2_000, 100_000
#: Readings with which starts are looked for.
_SEARCHED = 2_000
#: Blocks of a stretch of one sampling rate, at least.
_SHORTEST = 16
#: Blocks after a change of the drive in which what is quick is looked for.
_AFTER = (1, 2, 4, 8, 16, 32)
#: Chance of differences within blocks that are noise, over all changes; what they may be of the
#: differences within all longer blocks, both squared over the noise; and how many the longest are.
_CHANCE, _LEFT_OUT, _LEVELS = 1e-4, 0.02, 64
#: A block whose samples do not cover it, by this share, is left out.
_GAP = 0.05
#: Least frequency of a line (Hz), and pieces of the drive during a period of it, at most: it may be
#: the modulation otherwise.
_LOWEST, _PIECES_PER_PERIOD = 5.0, 0.1


def reduced(run: RecordedRun, rate: Any = None) -> RecordedRun:
    """A long recording as means over blocks; a short one as it is.

    Parameters
    ----------
    run : RecordedRun
    rate : float, str or None
        Blocks a second (Hz, or a text with a unit), or "full" for every sample. By default
        recordings of up to 20,000 samples are left as they are, and others get blocks as short as
        they need, 100,000 at most.

    Returns
    -------
    RecordedRun
        The same run if it is left as it is, or has blocks already.

    Raises
    ------
    InputError
        If `rate` is not positive, or leaves fewer than 16 blocks.
    """
    asked = checked_rate(rate)
    if run.blocks is not None or asked == math.inf:
        return run
    if asked is None and run.time.size <= LONGEST:
        return run
    length = None if asked is None else 1 / asked
    if length is not None:
        _require_blocks(run, length)
        if all(q == 1 for q in _counts(run, length)):
            return run
    clean, lines = _without_lines(run)
    doubts = list(run.doubts)
    if length is None:
        length, complete = _needed(clean)
        if not complete:
            doubts.append(
                f"friction changes within the blocks of {1e3 * length:.3g} ms that it is averaged "
                "over: the intervals hold, and shorter blocks would narrow them; give a higher "
                "rate or a shorter window"
            )
    short = averaged(clean, length)
    if short.blocks is None:
        return run  # every sample is needed
    return replace(short, doubts=tuple(doubts), blocks=replace(short.blocks, lines=lines))


def _require_blocks(run: RecordedRun, length: float) -> None:
    shortest = min(
        step * (b - a) for step, (a, b) in zip(_intervals(run), run.stretches, strict=True)
    )
    holds, got = not length > shortest / _SHORTEST, f"{1 / length:.4g} Hz for {shortest:.4g} s"
    rule = f"leave {_SHORTEST} means or more of {run.name}"
    require(holds, "fit_rate", rule, got, f"give {_SHORTEST / shortest:.4g} Hz or more")


def coarser(runs: Sequence[RecordedRun]) -> list[RecordedRun]:
    """Long recordings as few means, for a first search; empty where all are short."""
    if all(run.time.size <= LONGEST for run in runs):
        return []
    return [
        averaged(run, float(run.time[-1]) / _SEARCHED) if run.time.size > _SEARCHED else run
        for run in runs
    ]


def checked_rate(rate: Any) -> float | None:
    """Blocks a second; infinite for every sample, None for what the data need.

    Raises
    ------
    InputError
        If it is neither positive nor "full".
    """
    if rate is None:
        return None
    if isinstance(rate, str) and rate.strip() == "full":
        return math.inf
    value = float(to_si(rate, "frequency", "fit_rate"))
    advice = "give blocks a second, or full"
    require(value > 0 and math.isfinite(value), "fit_rate", "be positive", rate, advice)
    return value


def averaged(run: RecordedRun, length: float) -> RecordedRun:
    """A recording as means over blocks of about `length` seconds, of samples or of blocks."""
    counts = _counts(run, length)
    if all(q == 1 for q in counts):
        return run
    cells = _cells(run)
    before = run.blocks or Blocks(cells, (1,) * len(counts), run.time.size)
    edges, friction, slip, sizes = [], [], [], []
    for (a, b), q in zip(run.stretches, counts, strict=True):
        whole = a + (b - a) // q * q
        rows = cells[a:whole].reshape(-1, q, 2)
        spans = rows[:, -1, 1] - rows[:, 0, 0]
        covered = (rows[:, :, 1] - rows[:, :, 0]).sum(axis=1) > (1 - _GAP) * spans
        edges.append(np.stack([rows[:, 0, 0], rows[:, -1, 1]], axis=1)[covered])
        friction.append(run.friction[a:whole].reshape(-1, q).mean(axis=1)[covered])
        slip.append(run.slip[a:whole].reshape(-1, q).mean(axis=1)[covered])
        sizes.append(int(covered.sum()))
    ends = np.cumsum([0, *sizes]).tolist()
    samples = tuple(q * n for q, n in zip(counts, before.samples, strict=True))
    blocks = replace(before, edges=np.concatenate(edges), samples=samples)
    return replace(
        run,
        time=blocks.edges.mean(axis=1),
        friction=np.concatenate(friction),
        slip=np.concatenate(slip),
        stretches=tuple(pairwise(ends)),
        blocks=blocks,
    )


def _intervals(run: RecordedRun) -> list[float]:
    """Sampling interval of each stretch (s)."""
    return [float(np.median(np.diff(run.time[a:b]))) for a, b in run.stretches]


def _counts(run: RecordedRun, length: float) -> list[int]:
    """Samples in a block, of each stretch."""
    return [
        max(1, min(round(length / step), (b - a) // _SHORTEST))
        for step, (a, b) in zip(_intervals(run), run.stretches, strict=True)
    ]


def _cells(run: RecordedRun) -> Float:
    """Beginning and end of what each sample stands for (s): half the way to its neighbours."""
    if run.blocks is not None:
        return run.blocks.edges
    t = run.time
    half = np.concatenate(
        [np.full(b - a, s / 2) for s, (a, b) in zip(_intervals(run), run.stretches, strict=True)]
    )
    begin, end = t - half, t + half
    middle = (t[1:] + t[:-1]) / 2
    near = np.diff(t) < 3 * np.minimum(half[1:], half[:-1])
    end[:-1][near] = begin[1:][near] = middle[near]
    return np.clip(np.stack([begin, end], axis=1), 0.0, t[-1])


def _needed(run: RecordedRun) -> tuple[float, bool]:
    """Longest blocks that keep what friction does after changes of the drive (s).

    Besides, whether nothing is lost within the shortest blocks that are allowed.
    """
    duration = float(run.time[-1])
    finest = max(min(_intervals(run)), duration / _MOST)
    # The force, which a step of the load leaves continuous: what friction does then is known.
    series = averaged(replace(run, friction=run.friction * run.drive.load_at(run.time)), finest / 2)
    result, lengths = [], [finest]
    while lengths[-1] <= duration / _LEVELS:
        result.append(_within(series, lengths[-1]))
        series = averaged(series, lengths[-1])
        lengths.append(2 * lengths[-1])
    small = np.cumsum(result) <= _LEFT_OUT * np.sum(result)
    # The first level is what the shortest blocks lose.
    allowed = small & (np.array(lengths[:-1]) <= duration / _FEWEST)
    kept = int(np.argmin(np.append(allowed, False)))
    return lengths[max(kept - 1, 0)], bool(small[0])


def _within(run: RecordedRun, length: float) -> float:
    """Differences of the halves of blocks in excess of noise, after changes of the drive.

    Parameters
    ----------
    run : RecordedRun
        Of the halves.
    length : float
        Of the blocks (s).

    Returns
    -------
    float
        Sum of squares over that of noise, less what noise has; 0 if noise may be all.
    """
    changes = run.drive.edges[1:-1]
    after: list[Float] = []
    for (a, b), step in zip(run.stretches, _intervals(run), strict=True):
        if step > 0.75 * length:
            continue  # of a slower sampling rate
        halves = run.friction[a : a + (b - a) // 2 * 2].reshape(-1, 2)
        d = halves[:, 1] - halves[:, 0]
        d = d - np.median(d)
        noise = 1.4826 * float(np.median(np.abs(d)))
        here = changes[(changes >= run.time[a]) & (changes <= run.time[b - 1])]
        if noise == 0 or not here.size:
            continue
        # From the block before: the time of a change is not quite known.
        first = (np.searchsorted(run.time[a:b], here) // 2) - 1
        at = first[:, None] + np.arange(_AFTER[-1])
        inside = (at >= 0) & (at < d.size)
        after += list(np.where(inside, d[np.clip(at, 0, d.size - 1)] / noise, np.nan))
    if not after:
        return 0.0
    squares = np.array(after) ** 2
    best = 0.0
    for k in _AFTER:
        count = int(np.isfinite(squares[:, :k]).sum())
        total = float(np.nansum(squares[:, :k]))
        if chdtrc(max(count, 1), total) < _CHANCE:
            best = max(best, total - count)
    return best


def _without_lines(run: RecordedRun) -> tuple[RecordedRun, tuple[float, ...]]:
    """The recording without lines of the mains and the like, and their frequencies (Hz)."""
    pieces = np.sort(np.diff(run.drive.edges))
    typical = float(pieces[np.searchsorted(np.cumsum(pieces), pieces.sum() / 2)])
    lowest = max(_LOWEST, 1 / (_PIECES_PER_PERIOD * typical))
    friction = run.friction.copy()
    taken: list[float] = []
    for (a, b), step in zip(run.stretches, _intervals(run), strict=True):
        for hertz in find_lines(friction[a:b], step, lowest):
            take_off(friction[a:b], hertz * step)
            taken.append(hertz)
    return (replace(run, friction=friction) if taken else run), tuple(sorted(taken))
