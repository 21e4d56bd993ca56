"""Lines that are no response: mains, and what the pauses of a recording hold at f and 2f."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.lock_in.reading import LockInReading
from asperity.measurement.samples import Samples
from asperity.measurement.verdicts.verdict import Check, judged
from asperity.measurement.window import LoadInterval

Array = NDArray[np.float64]

#: Where suspicious and bad begin; a mains line is judged by epsilon, small being bad.
LIMITS: dict[str, tuple[float, float]] = {
    "mains": (0.02, 0.005),
    "lines in the pauses": (0.02, 0.2),
    "hum": (0.05, 0.5),
}

#: Mains frequencies (Hz), how many harmonics of them count, and how far a network wanders (Hz).
_MAINS, _HARMONICS, _WANDER = (50.0, 60.0), 4, 0.2
#: A line is seen where it is so many times its scatter.
_SEEN = 4.0
#: A modulation is switched off where less than this share of it is left.
_SWITCHED = 0.5
#: Pieces of a pause that give a line's scatter, and periods in each at least.
_PIECES, _PERIODS = 8, 4


def mains(reading: LockInReading, samples: Samples, parts: list[LoadInterval]) -> Check:
    """Whether what is taken for the modulation can be the mains in the load's signal.

    A line that is switched off in the pauses of the recording is none of the mains.
    """
    f = reading.frequency
    near = [
        (n * base)
        for base in _MAINS
        for n in range(1, _HARMONICS + 1)
        if abs(f - n * base) < n * _WANDER
    ]
    number = float(abs(reading.epsilon))
    if not near:
        sentence = f"{f:.6g} Hz is no harmonic of 50 or 60 Hz"
        return judged("mains", number, LIMITS["mains"], sentence, significant=False)
    switched = False
    for part in parts:
        cut = slice(part.first, part.stop)
        line, doubt = _line(samples.time[cut], samples.load[cut], f)
        quiet = not part.modulated and doubt < np.inf
        switched |= quiet and line + doubt < _SWITCHED * number * abs(reading.W0)
    sentence = (
        f"the modulation, epsilon = {number:.3g} at {f:.6g} Hz, lies at a harmonic of the mains "
        f"({near[0]:g} Hz); so small a one may be hum in the load's signal and no modulation"
        if number < LIMITS["mains"][0] and not switched
        else f"the modulation lies at a harmonic of the mains ({near[0]:g} Hz), and is "
        + ("switched off in the pauses" if switched else "larger than hum usually is")
    )
    return judged("mains", number, LIMITS["mains"], sentence, significant=not switched)


def lines_in_the_pauses(
    reading: LockInReading, samples: Samples, parts: list[LoadInterval]
) -> tuple[Check, ...]:
    """Lines of load and force at f and 2f where the load is not modulated, against the reading.

    Parameters
    ----------
    reading : LockInReading
    samples : Samples
    parts : list of LoadInterval
        Modulated and unmodulated parts of the recording.
    """
    found: tuple[float, str, bool] | None = None
    for part in parts:
        if part.modulated:
            continue
        for n in (1, 2):
            if n > reading.harmonics.size:
                continue
            f = n * reading.frequency
            time, force = (
                samples.time[part.first : part.stop],
                samples.force[part.first : part.stop],
            )
            line, doubt = _line(time, force, f)
            if not doubt < np.inf:
                continue
            own = reading.phasor(n)
            height = max(own.amplitude, own.amplitude_uncertainty) * abs(reading.W0)
            number = line / height
            # What is smaller than the uncertainty of the harmonic changes nothing that is reported.
            seen = line > _SEEN * doubt and line > own.amplitude_uncertainty * abs(reading.W0)
            if found is None or (seen, number) > (found[2], found[0]):
                sentence = (
                    f"without modulation the force has a line of {number:.2g} mu{n} W0 at {f:.6g} "
                    "Hz: mains, cross-talk or the drive, which is part of what is read"
                )
                found = number, sentence, seen
    if found is None:
        return ()
    number, sentence, seen = found
    if not seen:
        sentence = "without modulation the force has no line at f and 2f that stands out"
    limits = LIMITS["lines in the pauses"]
    return (judged("lines in the pauses", number, limits, sentence, significant=seen),)


def hum(reading: LockInReading, time: Array, force: Array) -> Check:
    """Whether hum at other harmonics of the mains says that there is some at the modulation too."""
    f = reading.frequency
    number, sentence, seen = 0.0, "no hum is to be expected at the modulation or its double", False
    for base in _MAINS:
        orders = [
            n
            for n in (1, 2)
            for m in range(1, _HARMONICS + 1)
            if abs(n * f - m * base) < m * _WANDER
        ]
        if not orders:
            continue
        n = orders[0]
        for m in (1, 2, 3):
            # Harmonics of the modulation are responses.
            if abs(m * base / f - round(m * base / f)) * f < 1.0:
                continue
            line, doubt = _line(time, force, m * base)
            share = line / max(reading.phasor(n).amplitude * abs(reading.W0), 1e-300)
            if line > _SEEN * doubt and share > number:
                number, seen = share, True
                sentence = (
                    f"hum at {m * base:g} Hz is {share:.2g} of mu{n} W0; mains have harmonics, and "
                    f"{n * f:.6g} Hz is one of them: mu{n} may hold hum"
                )
    return judged("hum", number, LIMITS["hum"], sentence, significant=seen)


def _line(time: Array, values: Array, frequency: float) -> tuple[float, float]:
    """Amplitude of a line and its scatter from pieces; infinite where there are too few periods."""
    span = float(time[-1] - time[0])
    if time.size < 16 * _PIECES or span * frequency < _PIECES * _PERIODS:
        return 0.0, np.inf
    if frequency > 0.45 * (time.size - 1) / span:
        return 0.0, np.inf
    phasors = []
    # Steps and ramps at the edges of a pause are broad lines: a window keeps them out.
    for piece in np.array_split(np.arange(time.size), _PIECES):
        t, x = time[piece], values[piece]
        u = 2 * np.pi * np.arange(t.size) / t.size
        weight = (1 - np.cos(u)) / t.size
        rest = x - np.polynomial.Polynomial.fit(t, x, 1)(t)
        phasors.append(2 * np.sum(weight * rest * np.exp(-2j * np.pi * frequency * t)))
    mean = np.mean(phasors)
    # A network wanders: the pieces need not agree in phase as the mean does.
    scatter = np.sqrt(np.mean(np.abs(phasors - mean) ** 2) / (_PIECES - 1))
    return float(abs(mean)), float(scatter)
