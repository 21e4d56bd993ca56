"""Averaging of long recordings over blocks of samples.

The block means of a recording of millions of samples are compared with means of the computed motion
over the same blocks. This is exact: steps of the drive within a block are included, and the noise
is estimated from the means. Only changes within a block are lost. Blocks are therefore short enough
for the changes of friction after each change of the drive: the difference between the halves of a
block (a Haar coefficient) must not exceed its scatter in other blocks.

The mains and other spectral lines far above the block rate would be aliased. They are subtracted
before, in short pieces, because the frequency of the mains varies.
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
from asperity.inference.runs.run import Blocks, RecordedRun
from asperity.recording.defects.lines import find_lines, subtract_line
from asperity.units import to_si

#: Largest number of samples that are compared one by one.
LONGEST = 20_000
#: Smallest and largest number of blocks of a recording.
_FEWEST, _MOST = 2_000, 100_000
#: Number of block means for the search for starts.
_SEARCHED = 2_000
#: Smallest number of blocks of a stretch with one sampling rate.
_SHORTEST = 16
#: Quick changes are searched in these blocks after a change of the drive.
_AFTER = (1, 2, 4, 8, 16, 32)
#: Probability that noise alone makes the differences within blocks, over all changes; largest share
#: of these differences in those of all longer blocks (squared, over the noise); number of lengths.
_CHANCE, _LEFT_OUT, _LEVELS = 1e-4, 0.02, 64
#: A block is left out if its samples lack more than this share of its duration.
_GAP = 0.05
#: Lowest frequency of a line (Hz), and largest number of segments of the drive in one of its
#: periods: with more segments the line may be the modulation.
_LOWEST, _PIECES_PER_PERIOD = 5.0, 0.1


def reduced(run: RecordedRun, rate: Any = None) -> RecordedRun:
    """A long recording as means over blocks; a short recording unchanged.

    Parameters
    ----------
    run : RecordedRun
    rate : float, str or None
        Blocks per second (Hz, or a text with a unit), or "full" for every sample. By default
        recordings of up to 20,000 samples are unchanged, and others get blocks that resolve their
        changes, at most 100,000.

    Returns
    -------
    RecordedRun
        The same object if it is unchanged, or has blocks already.

    Raises
    ------
    InputError
        If `rate` is not positive, or leaves fewer than 16 blocks.
    """
    wanted = checked_rate(rate)
    if run.blocks is not None or wanted == math.inf:
        return run
    if wanted is None and run.time.size <= LONGEST:
        return run
    length = None if wanted is None else 1 / wanted
    if length is not None:
        shortest = min(
            step * (b - a) for step, (a, b) in zip(_intervals(run), run.stretches, strict=True)
        )
        rule, got = f"leave {_SHORTEST} means or more of {run.name}", f"{1 / length:.4g} Hz"
        advice = f"give {_SHORTEST / shortest:.4g} Hz or more"
        enough = not length > shortest / _SHORTEST
        require(enough, "fit_rate", rule, f"{got} for {shortest:.4g} s", advice)
        if all(q == 1 for q in _counts(run, length)):
            return run
    clean, lines = _without_lines(run)
    doubts = list(run.doubts)
    if length is None:
        length, complete = _needed_length(clean)
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


def coarser(runs: Sequence[RecordedRun]) -> list[RecordedRun]:
    """Long recordings as few means, for a first search; empty if all are short."""
    if all(run.time.size <= LONGEST for run in runs):
        return []
    return [
        averaged(run, float(run.time[-1]) / _SEARCHED) if run.time.size > _SEARCHED else run
        for run in runs
    ]


def checked_rate(rate: Any) -> float | None:
    """Blocks per second; infinite for every sample, None if the data decide.

    Raises
    ------
    InputError
        If the rate is neither positive nor "full".
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
    """Beginning and end of the cell of each sample (s), halfway to its neighbours."""
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


def _needed_length(run: RecordedRun) -> tuple[float, bool]:
    """Longest blocks (s) that resolve the friction after changes of the drive.

    The second result says whether the shortest allowed blocks resolve it completely.
    """
    duration = float(run.time[-1])
    finest = max(min(_intervals(run)), duration / _MOST)
    # The force is used: a step of the load leaves it continuous, while F/W jumps.
    series = averaged(replace(run, friction=run.friction * run.drive.load_at(run.time)), finest / 2)
    result, lengths = [], [finest]
    while lengths[-1] <= duration / _LEVELS:
        result.append(_excess_within(series, lengths[-1]))
        series = averaged(series, lengths[-1])
        lengths.append(2 * lengths[-1])
    small = np.cumsum(result) <= _LEFT_OUT * np.sum(result)
    # The first level is the loss within the shortest blocks.
    allowed = small & (np.array(lengths[:-1]) <= duration / _FEWEST)
    kept = int(np.argmin(np.append(allowed, False)))
    return lengths[max(kept - 1, 0)], bool(small[0])


def _excess_within(run: RecordedRun, length: float) -> float:
    """Differences between the halves of blocks after changes of the drive, in excess of noise.

    Parameters
    ----------
    run : RecordedRun
        The recording, averaged over the halves.
    length : float
        Length of the blocks (s).

    Returns
    -------
    float
        Sum of squares over the variance of noise, less its expected value for noise; 0 if noise
        alone may explain the differences.
    """
    changes = run.drive.edges[1:-1]
    after: list[Float] = []
    for (a, b), step in zip(run.stretches, _intervals(run), strict=True):
        if step > 0.75 * length:
            continue  # a stretch with a slower sampling rate
        halves = run.friction[a : a + (b - a) // 2 * 2].reshape(-1, 2)
        d = halves[:, 1] - halves[:, 0]
        d = d - np.median(d)
        noise = 1.4826 * float(np.median(np.abs(d)))
        here = changes[(changes >= run.time[a]) & (changes <= run.time[b - 1])]
        if noise == 0 or not here.size:
            continue
        # Start one block before: the time of a change is uncertain.
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
    """The recording without spectral lines such as the mains, and their frequencies (Hz)."""
    pieces = np.sort(np.diff(run.drive.edges))
    typical = float(pieces[np.searchsorted(np.cumsum(pieces), pieces.sum() / 2)])
    lowest = max(_LOWEST, 1 / (_PIECES_PER_PERIOD * typical))
    friction = run.friction.copy()
    taken: list[float] = []
    for (a, b), step in zip(run.stretches, _intervals(run), strict=True):
        for hertz in find_lines(friction[a:b], step, lowest):
            subtract_line(friction[a:b], hertz * step)
            taken.append(hertz)
    return (replace(run, friction=friction) if taken else run), tuple(sorted(taken))
