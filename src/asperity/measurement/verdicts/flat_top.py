"""A waveform that is cut off flat, as an amplifier or a converter at the end of its range cuts it.

What is clipped before the recorder's noise is added has no two equal samples: only the mean cycle
shows it. Two descriptions of the mean cycle are compared, a sum of harmonics and a sum of harmonics
that is cut off above, below or on both sides, by the Bayesian information criterion. Few harmonics
and a level describe a clipped signal to within its noise, where the corners need many harmonics; a
smooth signal, be it ever so flat at its top, needs as many harmonics with the level as without.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.reading import LockInReading
from asperity.measurement.verdicts.verdict import Check, judged

Array = NDArray[np.float64]

#: Shares of the period at a level that are suspicious and bad.
LIMITS = (0.0, 0.16)

#: Phases into which a period is folded, and samples in each, at least.
_PHASES, _FEWEST = 128, 4
#: Phases with samples that a comparison needs.
_FILLED = 16
#: Periods and samples of a mean that the drift is taken from.
_PERIODS, _SAMPLES = 2, 64
#: What models leave of the height of a cycle, besides noise.
_LEFT = 2e-3
#: Harmonics of a cycle that may be cut off, and of one that is not.
_CUT, _WHOLE = 4, 40
#: Shares of the period at the level that are tried first, and rounds from each.
_STARTS, _ROUNDS = (0.06, 0.12, 0.2, 0.3, 0.4, 0.48), 12
#: Shares of the period that a level takes: of a shorter one little is cut off, and a signal that is
#: beyond the range for longer is more level than signal.
_SHARES = (0.05, 0.55)
#: How much better the description that is cut off must be. Of 1,500 cycles of three harmonics with
#: noise, and of 2,598 of orbits of four laws, two of them with inertia too (0.1 to 100 um/s,
#: epsilon 0.01 to 0.8, 1 to 316 Hz, noise of 0.3, 3 and 30 % of mu1), the highest are at 8.5, 7.8,
#: 7.8 and 6.2; cycles that are cut off at half their height under noise of 30 % are at 14 to 51.
_MARGIN = 12.0


class _Cycle(NamedTuple):
    """Mean cycle: phases (periods), values and their standard deviations, each (phases,)."""

    phase: Array
    value: Array
    doubt: Array


class _Level(NamedTuple):
    """The best cycle that is cut off: its criterion, share of the period, and side."""

    criterion: float
    share: float
    side: str


def flat_top(reading: LockInReading, time: Array, load: Array, force: Array) -> Check:
    """Whether load or force is cut off flat.

    Parameters
    ----------
    reading : LockInReading
    time, load, force : array, (n,)
        Of the window.
    """
    number, sentence = 0.0, "neither load nor force is cut off flat in its mean cycle"
    gained = -np.inf
    for c, (name, values) in enumerate((("load", load), ("force", force))):
        cycle = _mean_cycle(reading, time, values, c)
        if cycle is None:
            if gained == -np.inf:
                sentence = "the mean cycle has too few samples to show whether it is cut off flat"
            continue
        gain, level = _compared(cycle)
        gained = max(gained, gain)
        if gain > _MARGIN and level.share > number:
            number = level.share
            sentence = (
                f"the mean cycle of the {name} is cut off flat {level.side} for {number:.2g} of "
                "the period, as an amplifier or a converter at the end of its range cuts it: "
                "amplitudes and mean are wrong"
            )
    return judged("flat top", number, LIMITS, sentence)


def _mean_cycle(reading: LockInReading, time: Array, values: Array, channel: int) -> _Cycle | None:
    """Values folded by the phase of the load, without what is slower than a period."""
    middle = (reading.start + reading.end) / 2
    cycles = reading.frequency * (time - middle) + reading.phase / (2 * np.pi)
    phasors = (reading.load_harmonics, reading.harmonics)[channel] * reading.W0
    order = np.arange(1, phasors.size + 1)
    fitted = np.zeros_like(values)
    turn, power = np.exp(2j * np.pi * cycles), 1.0
    for phasor in phasors:
        power = power * turn
        fitted += (phasor * power).real
    left = values - fitted
    whole = int(max(1, min((cycles[-1] - cycles[0]) / _PERIODS, values.size / _SAMPLES)))
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
    folded += (phasors * np.exp(2j * np.pi * place[:, None] * order)).real.sum(1)
    height = float(np.ptp(folded))
    if not height > 0:
        return None
    return _Cycle(place, folded, np.hypot(np.sqrt(noise / samples), _LEFT * height))


def _compared(cycle: _Cycle) -> tuple[float, _Level]:
    """How much better a cycle is described cut off than whole, and how it is cut off."""
    # Squares of a mean that is large would leave no digits to the cycle.
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
            for share in _STARTS:
                found = _cut_off(cycle, columns[:, : 2 * harmonics + 1], side, share)
                if found.criterion < best.criterion:
                    best = found
    return least - best.criterion, best


def _cut_off(cycle: _Cycle, columns: Array, side: str, share: float) -> _Level:
    """Harmonics that are cut off, fitted where they are not: levels and harmonics in turns."""
    value, weight = cycle.value, 1 / cycle.doubt
    sides = [s for s, word in ((1, "top"), (-1, "bottom")) if word in side]
    share /= len(sides)
    beyond = {s: s * value >= np.quantile(s * value, 1 - share) for s in sides}
    fitted, fits = value, False
    for _ in range(_ROUNDS):
        inside = ~np.logical_or.reduce(list(beyond.values()))
        if inside.sum() <= columns.shape[1] + 2 or not all(b.any() for b in beyond.values()):
            return _Level(np.inf, 0.0, side)
        rows = columns[inside] * weight[inside, None]
        gram = rows.T @ rows
        gram[np.diag_indices_from(gram)] *= 1 + 1e-10
        smooth = columns @ np.linalg.solve(gram, rows.T @ (value[inside] * weight[inside]))
        fitted, again = smooth, {}
        for s, where in beyond.items():
            level = float(np.average(value[where], weights=weight[where] ** 2))
            again[s] = s * smooth > s * level
            fitted = np.where(again[s], level, fitted)
        fits = all(np.array_equal(again[s], beyond[s]) for s in sides)
        beyond = again
        if fits:
            break
    taken = float(np.mean(np.logical_or.reduce(list(beyond.values()))))
    if not fits or not _SHARES[0] <= taken <= _SHARES[1] * len(sides):
        return _Level(np.inf, 0.0, side)
    left = float(np.sum(((value - fitted) * weight) ** 2))
    numbers = columns.shape[1] + len(sides)
    return _Level(left + numbers * float(np.log(value.size)), taken, side)
