"""Faults of the instrument: held samples, dropouts, a force that was made."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.reading import LockInReading
from asperity.measurement.verdicts.verdict import Check, judged

if TYPE_CHECKING:
    from asperity.measurement.samples import Samples

Array = NDArray[np.float64]

#: Where suspicious and bad begin; of a made force, small numbers are suspicious and none is bad.
LIMITS: dict[str, tuple[float, float]] = {
    "held samples": (0.01, 0.1),
    "dropouts": (0.0, 0.01),
    "made force": (0.3, -1.0),
}

_PIECE = 1 << 16
#: A held channel repeats a tenth of its samples at least and jumps by several steps between.
_REPEATED, _STEPS = 0.1, 4.0
#: Share of the runs of equal samples that have the usual length, and what irregular holding needs.
_REGULAR, _OFTEN, _FAR = 0.9, 0.3, 10.0
#: Zeros count where the channel is usually this many scatters away from zero.
_AWAY = 5.0


def held_samples(reading: LockInReading, load: Array, force: Array) -> Check:
    """Whether a channel repeats samples, as one does that is converted slower than recorded.

    The value of each run of k equal samples belongs to its beginning: a harmonic of frequency f
    lags by pi f (k - 1)/rate and is smaller by the sinc of that.
    """
    number, sentence = 0.0, "no channel repeats its samples"
    rate = (reading.samples - 1) / (reading.end - reading.start)
    for name, values in (("load", load), ("force", force)):
        length = _held_length(values[:_PIECE])
        if length is None:
            continue
        lag = np.pi * reading.frequency * (length - 1) / rate
        if lag >= number:
            number = float(lag)
            sentence = (
                f"the {name} repeats each value {length:.3g} times on average: it is converted "
                f"more slowly than recorded, and its first harmonic lags by {lag:.2g} rad"
            )
    return judged("held samples", number, LIMITS["held samples"], sentence)


def _held_length(values: Array) -> float | None:
    """Mean number of equal samples in a run; None where the resolution explains them."""
    steps = np.abs(np.diff(values))
    moving = steps[steps > 0]
    repeated = 1 - moving.size / max(steps.size, 1)
    if repeated < _REPEATED or moving.size < 16:
        return None
    jump = float(np.median(moving)) / float(moving.min())
    at = np.flatnonzero(steps > 0)
    runs = np.diff(at)
    length = float(runs.mean())
    regular = float(np.mean((runs >= np.floor(length)) & (runs <= np.ceil(length))))
    if jump > _STEPS and regular > _REGULAR:
        return length
    return length if jump > _FAR and repeated > _OFTEN else None


def dropouts(load: Array, force: Array) -> Check:
    """Whether a channel falls to exactly zero where it is far from zero otherwise."""
    number, sentence = 0.0, "no channel drops to zero"
    for name, values in (("load", load), ("force", force)):
        zeros = values == 0
        count = int(np.count_nonzero(zeros))
        if not count or count == values.size:
            continue
        others = values[~zeros]
        middle = float(np.median(others))
        scatter = float(np.median(np.abs(others - middle)))
        if abs(middle) <= _AWAY * scatter or zeros.mean() <= number:
            continue
        number = float(zeros.mean())
        sentence = (
            f"{count} of {values.size} samples of the {name} are exactly zero, where {middle:.4g} "
            "is usual: the signal was lost there"
        )
    return judged("dropouts", number, LIMITS["dropouts"], sentence)


def made_force(
    reading: LockInReading, samples: Samples, time: Array, load: Array, force: Array
) -> tuple[Check, ...]:
    """That the force was made of a friction coefficient, if it was, and whether it can be right.

    A recorder that divides the force by a mean load gives a coefficient that the load does not
    modulate; times the instantaneous load it makes a force in proportion to the load.
    """
    name = samples.names[1]
    if not name.endswith(" x load"):
        return ()
    turn = np.exp(-2j * np.pi * reading.frequency * (time - time[0]))
    friction = force / np.where(load == 0, np.nan, load)
    good = np.isfinite(friction)
    friction, turn = friction[good] - np.mean(friction[good]), turn[good]
    own = 2 * abs(np.mean(friction * (turn - np.mean(turn))))
    whole = abs(reading.epsilon * reading.mean_friction)
    number = float(own / whole) if whole else np.inf
    sentence = (
        f"the force was made from friction x load ('{name}'); the recorded coefficient is "
        f"modulated by {number:.2g} of epsilon times its mean"
    )
    if number < LIMITS["made force"][0]:
        sentence += (
            ". It hardly follows the load: if the recorder divided by a mean load, mu1 and phase1 "
            "are those of the load and not of the friction; use the recorded shear force"
        )
    return (judged("made force", number, LIMITS["made force"], sentence),)
