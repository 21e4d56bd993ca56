"""Can it be so? Numbers that no dry contact gives: columns, signs or units are mistaken."""

from __future__ import annotations

import numpy as np

from asperity.lock_in.reading import LockInReading
from asperity.measurement.verdicts.verdict import Check, judged

#: Where suspicious and bad begin; friction has a lower and an upper side.
LIMITS: dict[str, tuple[float, float]] = {
    "contact": (0.95, 1.0),
    "low friction": (0.02, -2.0),
    "high friction": (2.0, 20.0),
    "response": (1.5, 5.0),
    "aliasing": (2.0, -1.0),
}

#: Harmonics of a load that is as good as a shaker's are gone from here on.
_HIGHEST = 8


def contact(reading: LockInReading) -> Check:
    """Whether the load stays above zero."""
    return judged(
        "contact",
        reading.epsilon,
        LIMITS["contact"],
        f"the load falls to {1 - reading.epsilon:.3g} W0 in each period; below zero contact is "
        "lost, or the load's zero or sign is not that of the recording",
    )


def friction(reading: LockInReading) -> Check:
    """Whether the mean friction is one."""
    number = reading.mean_friction
    limits = LIMITS["high friction" if number > LIMITS["low friction"][0] else "low friction"]
    sentence = (
        f"the mean of F/W0 is {number:.4g}, where contacts have {LIMITS['low friction'][0]:g} to 2"
    )
    if number < 0:
        sentence += (
            "; load and force have opposite signs, which turns every phase by pi: a unit such as "
            "'-1 N' for one of them turns it back"
        )
    elif number < LIMITS["low friction"][0] or number > LIMITS["high friction"][0]:
        sentence += "; check the units, the zeros and which column is which"
    return judged("friction", number, limits, sentence)


def response(reading: LockInReading) -> Check:
    """Whether the force follows the load by no more than in proportion to it."""
    phasor = reading.phasor(1)
    whole = abs(reading.epsilon * reading.mean_friction)
    number = phasor.amplitude / max(whole, 1e-300)
    return judged(
        "response",
        min(number, 1e300),
        LIMITS["response"],
        f"mu1 is {number:.3g} times the mean friction times epsilon, which is what a force in "
        "proportion to the load has; if it is more, load and force may be exchanged",
        significant=phasor.amplitude > 3 * phasor.amplitude_uncertainty,
    )


def aliasing(reading: LockInReading, rate: float) -> Check:
    """Whether a harmonic that is not read looks like one that is.

    Parameters
    ----------
    reading : LockInReading
    rate : float
        Samples per second, of most of the recording.
    """
    n = reading.harmonics.size
    above = np.arange(n + 1, max(_HIGHEST, n + 1) + 1)
    # A harmonic below half the rate is where it belongs.
    folded = above[above * reading.frequency > rate / 2]
    span = reading.end - reading.start
    away = (
        np.abs(np.remainder(folded * reading.frequency + rate / 2, rate) - rate / 2)[:, None]
        - np.arange(n + 1) * reading.frequency
    )
    away = np.abs(away) * span
    number, sentence = float(span * rate), "no higher harmonic is folded onto one that is read"
    if away.size:
        number = float(away.min())
        at = np.unravel_index(int(np.argmin(away)), away.shape)
        sentence = (
            f"at {rate:.5g} samples per second harmonic {folded[at[0]]} of the load looks like "
            f"{'the mean' if at[1] == 0 else f'harmonic {at[1]}'}, {number:.3g} lines of the "
            "window away; closer than two, what is read holds both"
        )
    return judged("aliasing", number, LIMITS["aliasing"], sentence)
