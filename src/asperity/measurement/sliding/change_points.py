"""Change points of a displacement: pieces in which it is a straight line or a parabola.

Within a segment of constant velocity the displacement is a straight line, and a parabola while the
motor changes its velocity; the residual is noise of known strength. The means of the displacement
over short blocks are cut into such pieces by optimal partitioning (Killick, Fearnhead and Eckley,
J. Am. Stat. Assoc. 107, 1590, 2012), which is exact for this model.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from asperity.arrays import Float, Index
from asperity.recording.defects.resolution import recorder_step

#: First sample of a piece, and the sample after its last.
Piece = tuple[int, int]

#: Number of blocks of equal time, of equal numbers of samples and of equal slip each; number of
#: parts into which a block next to a change is divided.
_BLOCKS, _PARTS = 300, 12
#: Fewest means from which noise is estimated; number of parts of a recording, of which the quietest
#: quarter gives the noise.
MEANS, _QUIET_PARTS = 96, 16
#: A recorder is coarse if this share of its samples repeats the preceding sample.
_COARSE = 0.2
#: Multiple of the penalty of the Bayesian information criterion for a piece, as noise of a gauge is
#: not white.
_PENALTY = 2.0
#: Fewest samples of a piece.
FEWEST = 4


@dataclass(frozen=True, eq=False)
class RecordedDisplacement:
    """A displacement over time, and its noise.

    Attributes
    ----------
    time, displacement : array, (n,)
    noise : float
        Standard deviation of a sample (m).
    slow_noise : float
        Standard deviation (m) that a sample would have, were the noise of means over many samples
        white.
    step : float
        Step of a coarse recorder (m); 0 for a fine recorder.
    """

    time: Float
    displacement: Float
    noise: float
    slow_noise: float
    step: float


def displacement_noise(time: Float, displacement: Float) -> float:
    """Standard deviation of a displacement's noise (m), its resolution included.

    Parameters
    ----------
    time, displacement : array, (n,)
    """
    return recorded_displacement(time, displacement).noise


def recorded_displacement(time: Float, displacement: Float) -> RecordedDisplacement:
    """The noise of a displacement, from second differences of means over 1, 2, 4, ... samples.

    A constant velocity does not contribute to second differences, and a changing velocity hardly
    does in the quietest parts of a recording. Means over many samples scatter more than with white
    noise if the noise of a gauge is correlated, hums or wanders.
    """
    noise, slow, n = 0.0, 0.0, 1
    while n == 1 or n * MEANS <= time.size:
        t = time[: time.size // n * n : n]
        x = displacement[: t.size * n].reshape(t.size, n).mean(axis=1)
        lengths = np.diff(t)
        even = np.abs(np.diff(lengths)) < 0.05 * lengths[1:]
        second = np.abs(np.diff(x, 2))[even]
        if second.size:
            parts = np.array_split(second, max(1, min(_QUIET_PARTS, second.size // 24)))
            usual = np.sort([np.median(part) for part in parts])
            spread = float(usual[usual.size // (2 if n == 1 else 4)]) * 1.4826 / np.sqrt(6)
            noise, slow = max(noise, spread), max(slow, spread * np.sqrt(n))
        n *= 2
    # With a coarse recorder most differences are zero: its step is the noise.
    step = recorder_step(displacement, _COARSE)
    floor = 1e-9 * float(np.ptp(displacement)) + 1e-100
    return RecordedDisplacement(
        time, displacement, max(noise, step / np.sqrt(12), floor), max(slow, floor), step
    )


def pieces_of(motion: RecordedDisplacement) -> list[Piece]:
    """Lines and parabolas: cut at coarse blocks first, then at finer blocks next to the changes.

    Blocks next to a change are divided down to single samples, because the mean of a block in which
    the velocity changes lies off the lines on both sides. The record of a coarse recorder stands
    still between its steps: its blocks are divided once.
    """
    edges = _blocks(motion)
    largest = float(np.diff(edges).max())
    # The largest block is divided down to samples: noise may move a change to any block.
    finer = 1 if motion.step else int(np.ceil(np.log(largest) / np.log(_PARTS)))
    # Away from changes four blocks are merged into one.
    kept = np.append(edges[::4], edges[-1])
    for _ in range(finer):
        bounds = edges[_change_points(motion, edges)]
        near = np.searchsorted(edges, bounds[1:-1])[:, None] + [-1, 0, 1]
        near = np.unique(np.clip(near, 0, edges.size - 2))
        fine = [np.linspace(edges[k], edges[k + 1], _PARTS + 1).astype(np.intp) for k in near]
        edges = kept = np.unique(np.concatenate([kept, bounds, *fine]))
    bounds = edges[_change_points(motion, edges)]
    # A spike or a jump of the gauge is no motion.
    pieces = [(a, b) for a, b in pairwise(bounds.tolist()) if b - a >= FEWEST]
    return pieces or [(0, motion.time.size)]


def _blocks(motion: RecordedDisplacement) -> Index:
    """First samples of the blocks, and the number of all samples."""
    n = motion.time.size
    m = max(1, n // 20_000)
    at = np.arange(n // m) * m
    means = motion.displacement[: at.size * m].reshape(-1, m).mean(axis=1)
    # Noise alone makes neighbouring means differ.
    moved = np.abs(np.diff(means)) - 3 * motion.noise * np.sqrt(2 / m)
    path = np.concatenate([[0.0], np.cumsum(np.maximum(moved, 0.0))])
    edges = [np.array([0, n])]
    for measure in (motion.time[at], at.astype(float), path):
        levels = np.linspace(measure[0], measure[-1], _BLOCKS + 1)[1:-1]
        edges.append(at[np.searchsorted(measure, levels)])
    return np.unique(np.concatenate(edges))


def _change_points(motion: RecordedDisplacement, edges: Index) -> list[int]:
    """Bounds of the pieces, as places in edges: the least sum of squares and penalties."""
    size = np.diff(edges)
    t = np.add.reduceat(motion.time - motion.time[0], edges[:-1]) / size
    x = np.add.reduceat(motion.displacement - motion.displacement[0], edges[:-1]) / size
    # In a slow block the rounding error of the recorder is the same in all samples.
    unit = float(np.hypot(motion.slow_noise, motion.step))
    weight = 1 / ((motion.slow_noise / unit) ** 2 / size + (motion.step / unit) ** 2 / 12)
    x /= unit
    t /= float(np.median(np.diff(t)))
    n = size.size
    parameter = _PENALTY * np.log(n)
    best, last = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.intp)
    best[0] = 0.0
    starts = np.empty(0, dtype=np.intp)
    # For each start: sums of w, wu, wu2, wu3, wu4, wy, wyu, wyu2, wy2 over the blocks from it on.
    sums = np.empty((9, 0))
    for end in range(1, n + 1):
        starts = np.append(starts, end - 1)
        sums = np.concatenate([sums, np.zeros((9, 1))], axis=1)
        u, y = t[end - 1] - t[starts], x[end - 1] - x[starts]
        powers = np.stack([np.ones_like(u), u, u**2, u**3, u**4, y, y * u, y * u**2, y**2])
        sums += weight[end - 1] * powers
        line, parabola = _misfits(sums)
        total = best[starts] + np.minimum(line, parabola + parameter) + 3 * parameter
        at = int(np.argmin(total))
        best[end], last[end] = total[at], starts[at]
        # A start that is worse than the best by the penalty can never become the best.
        keep = total - 3 * parameter <= best[end]
        starts, sums = starts[keep], sums[:, keep]
    bounds = [n]
    while bounds[-1] > 0:
        bounds.append(int(last[bounds[-1]]))
    return bounds[::-1]


def _misfits(sums: Float) -> tuple[Float, Float]:
    """Sums of squares that a line and a parabola leave, by orthogonal polynomials."""
    s0, s1, s2, s3, s4, y0, y1, y2, yy = sums
    first = s2 - s1 * s1 / s0
    some = first > 1e-9 * s2
    first = np.where(some, first, np.inf)
    slope = (y1 - s1 * y0 / s0) / first
    line = yy - y0 * y0 / s0 - slope**2 * np.where(some, first, 0.0)
    bend = (s3 - s1 * s2 / s0) / first
    second = s4 - s2 * s2 / s0 - bend * (s3 - s1 * s2 / s0)
    some = some & (second > 1e-9 * s4)
    product = y2 - s2 * y0 / s0 - bend * (y1 - s1 * y0 / s0)
    parabola = line - np.where(some, product**2 / np.where(some, second, 1.0), 0.0)
    return np.maximum(line, 0.0), np.maximum(parabola, 0.0)
