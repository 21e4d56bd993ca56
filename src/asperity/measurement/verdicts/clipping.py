"""Clipping: whether load or force is cut off flat in its mean cycle.

A waveform that is clipped before the recorder adds its noise has no two equal samples: only the
mean cycle shows that it is clipped. Two descriptions of the mean cycle are compared by the Bayesian
information criterion: a sum of harmonics, and a sum of harmonics that is cut off above, below or on
both sides. Few harmonics and a level describe a clipped signal to within its noise, while without a
level its corners need many harmonics. A smooth signal, however flat its top, needs as many
harmonics with a level as without.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.lock_in.reading import LockInReading
from asperity.measurement.verdicts.verdict import LOCK_IN, Check

#: Phases into which a period is folded, and fewest samples of a phase.
_PHASES, _FEWEST = 128, 4
#: Fewest phases with samples for a comparison.
_FILLED = 16
#: Fewest periods and samples of a mean by which the drift is subtracted.
_MEAN_PERIODS, _MEAN_SAMPLES = 2, 64
#: Model error of a cycle, as a share of its height.
_LEFT = 2e-3
#: Most harmonics of a description that is cut off, and of a description that is not.
_CUT, _WHOLE = 4, 40
#: Initial shares of the period at the level, and most rounds from each.
_STARTS, _ROUNDS = (0.06, 0.12, 0.2, 0.3, 0.4, 0.48), 12
#: Smallest and largest share of the period at a level: below, little is cut off; above, there is
#: more level than signal.
_SHARES = (0.05, 0.55)
#: Smallest gain in the criterion at which a cycle counts as cut off. Of 1,500 cycles of three
#: harmonics with noise, and of 2,598 of orbits of four laws, two of them with inertia too (0.1 to
#: 100 um/s, epsilon 0.01 to 0.8, 1 to 316 Hz, noise of 0.3, 3 and 30 % of mu1), the highest gains
#: are 8.5, 7.8, 7.8 and 6.2; cycles that are cut off at half their height under noise of 30 % have
#: gains of 14 to 51.
_MARGIN = 12.0


class _Cycle(NamedTuple):
    """Mean cycle: phases (periods), values and their standard deviations, each (phases,)."""

    phase: Float
    value: Float
    doubt: Float


class _Level(NamedTuple):
    """The best description that is cut off: criterion, share of the period at the level, side."""

    criterion: float
    share: float
    side: str


def flat_top(reading: LockInReading, time: Float, load: Float, force: Float) -> Check:
    """Whether load or force is cut off flat.

    Parameters
    ----------
    reading : LockInReading
    time, load, force : array, (n,)
        Times, load and force of the window.
    """
    number = 0.0
    sentence = (
        "neither load nor force is cut off flat in its mean cycle; a gauge that saturates smoothly "
        "is not excluded, as its harmonics are those of a response"
    )
    gained = -np.inf
    for c, (name, values) in enumerate((("load", load), ("force", force))):
        cycle = _mean_cycle(reading, time, values, c)
        if cycle is None:
            if gained == -np.inf:
                sentence = "the mean cycle has too few samples to show whether it is cut off flat"
            continue
        gain, level = _gain_of_levels(cycle)
        gained = max(gained, gain)
        if gain > _MARGIN and level.share > number:
            number = level.share
            sentence = (
                f"the mean cycle of the {name} is cut off flat {level.side} for {number:.2g} of "
                "the period, as an amplifier or a converter at the end of its range cuts it: "
                "amplitudes and mean are wrong"
            )
    return LOCK_IN.check("flat top", number, sentence)


def _mean_cycle(reading: LockInReading, time: Float, values: Float, channel: int) -> _Cycle | None:
    """Values folded by the phase of the load, without what is slower than a period."""
    cycles = reading.cycles(time)
    left = values - reading.W0 * reading.waves(cycles, channel)
    whole = int(max(1, min((cycles[-1] - cycles[0]) / _MEAN_PERIODS, values.size / _MEAN_SAMPLES)))
    edges = np.linspace(0, values.size, whole + 1).astype(int)[:-1]
    counts = np.diff([*edges, values.size])
    means, at = (np.add.reduceat(x, edges) / counts for x in (left, time))
    left = left - np.interp(time, at, means)

    phase = cycles % 1.0
    index = np.minimum((phase * _PHASES).astype(int), _PHASES - 1)
    count = np.bincount(index, minlength=_PHASES)
    filled = count >= _FEWEST
    if filled.sum() < _FILLED:
        return None
    samples = count[filled]
    place = np.bincount(index, phase, minlength=_PHASES)[filled] / samples
    folded = np.bincount(index, left, minlength=_PHASES)[filled] / samples
    noise = float(np.mean((left - np.interp(phase, place, folded, period=1.0)) ** 2))
    # Noise that is coloured may be stronger at the harmonics.
    noise = max(noise, float(reading.noise.spectra[1:, channel, channel].real.max()))
    folded += reading.W0 * reading.waves(place, channel)
    height = float(np.ptp(folded))
    if not height > 0:
        return None
    return _Cycle(place, folded, np.hypot(np.sqrt(noise / samples), _LEFT * height))


def _gain_of_levels(cycle: _Cycle) -> tuple[float, _Level]:
    """Gain in the criterion of the best description that is cut off, and this description."""
    # With a large mean the squares would leave no digits to the cycle.
    cycle = cycle._replace(value=cycle.value - cycle.value.mean())
    size = cycle.value.size
    most = min(_WHOLE, (size - 4) // 2)
    order = np.arange(1, most + 1)
    turn = 2 * np.pi * cycle.phase[:, None] * order
    columns = np.empty((size, 2 * most + 1))
    columns[:, 0], columns[:, 1::2], columns[:, 2::2] = 1.0, np.cos(turn), np.sin(turn)
    weight = 1 / cycle.doubt
    parts = np.linalg.qr(columns * weight[:, None])[0].T @ (cycle.value * weight)
    whole = np.sum((cycle.value * weight) ** 2) - np.cumsum(parts**2)[2::2]
    penalty = np.log(size)
    least = float(np.min(whole + (2 * order + 1) * penalty))
    best = _Level(np.inf, 0.0, "")
    for harmonics in range(1, min(_CUT, most // 2) + 1):
        for side in ("at its top", "at its bottom", "at its top and bottom"):
            seen: set[bytes] = set()
            for share in _STARTS:
                level = _cut_off(cycle, columns[:, : 2 * harmonics + 1], side, share, seen)
                if level.criterion < best.criterion:
                    best = level
    return least - best.criterion, best


def _cut_off(cycle: _Cycle, columns: Float, side: str, share: float, seen: set[bytes]) -> _Level:
    """Harmonics that are cut off: harmonics between the levels and the levels fitted alternately.

    The phases beyond the levels determine all later rounds: phases that were `seen` from another
    start lead to the same end, and are not computed again.
    """
    value, weight = cycle.value, 1 / cycle.doubt
    squares, rows, right = weight**2, columns * weight[:, None], value * weight
    sides = [s for s, word in ((1, "top"), (-1, "bottom")) if word in side]
    shares = np.linspace(0, 1, value.size)
    ends = [np.interp(1 - share / len(sides), shares, np.sort(s * value)) for s in sides]
    beyond = [s * value >= end for s, end in zip(sides, ends, strict=True)]
    fitted, fits = value, False
    for _ in range(_ROUNDS):
        inside, place = ~(beyond[0] | beyond[-1]), np.packbits(beyond).tobytes()
        few = inside.sum() <= columns.shape[1] + 2 or not all(b.any() for b in beyond)
        if few or place in seen:
            return _Level(np.inf, 0.0, side)
        seen.add(place)
        kept = rows[inside]
        gram = kept.T @ kept
        gram.flat[:: len(gram) + 1] *= 1 + 1e-10
        smooth = columns @ np.linalg.solve(gram, kept.T @ right[inside])
        fitted, again = smooth, []
        for s, where in zip(sides, beyond, strict=True):
            level = squares[where] @ value[where] / squares[where].sum()
            again.append(s * smooth > s * level)
            fitted = np.where(again[-1], level, fitted)
        fits = all(map(np.array_equal, again, beyond))
        beyond = again
        if fits:
            break
    taken = float(np.mean(beyond[0] | beyond[-1]))
    if not fits or not _SHARES[0] <= taken <= _SHARES[1] * len(sides):
        return _Level(np.inf, 0.0, side)
    left = float(np.sum(((value - fitted) * weight) ** 2))
    numbers = columns.shape[1] + len(sides)
    return _Level(left + numbers * float(np.log(value.size)), taken, side)
