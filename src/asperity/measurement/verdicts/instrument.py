"""Faults of the instrument: repeated samples, a computed force, mains, hum."""

from __future__ import annotations

from itertools import product

import numpy as np

from asperity.arrays import Float
from asperity.errors import symbol
from asperity.lock_in.reading import LockInReading
from asperity.lock_in.reference import strongest_line
from asperity.measurement.samples import Samples
from asperity.measurement.verdicts.verdict import LOCK_IN, Check
from asperity.measurement.window import LoadInterval
from asperity.recording.defects.resolution import held_length

_PIECE = 1 << 16
#: Mains frequencies (Hz), number of their harmonics, and largest departure of a network (Hz).
_MAINS, _MAINS_HARMONICS, _WANDER = (50.0, 60.0), 4, 0.2
#: A line counts above this multiple of its background, a median. White noise exceeds it at one of
#: the five spectral values that are searched once in 13,000 times.
_SEEN = 4.0
#: A modulation is switched off where less than this share of it is left.
_SWITCHED = 0.5
#: Fewest periods and samples in which a line is searched.
_LINE_PERIODS, _LINE_SAMPLES = 32, 128


def held_samples(reading: LockInReading, load: Float, force: Float) -> Check:
    """Whether a channel repeats samples, because it is converted more slowly than recorded.

    The value of a run of k equal samples belongs to its first sample: a harmonic of frequency f
    lags by pi f (k - 1)/rate and is smaller by the sinc of this angle.
    """
    number, sentence = 0.0, "no channel repeats its samples"
    rate = (reading.samples - 1) / (reading.end - reading.start)
    for name, values in (("load", load), ("force", force)):
        length = held_length(values[:_PIECE])
        if length is None:
            continue
        lag = np.pi * reading.frequency * (length - 1) / rate
        if lag >= number:
            number = float(lag)
            sentence = (
                f"the {name} repeats each value {length:.3g} times on average: it is converted "
                f"more slowly than recorded, and its first harmonic lags by {lag:.2g} rad"
            )
    return LOCK_IN.check("held samples", number, sentence)


def computed_force(
    reading: LockInReading, samples: Samples, time: Float, load: Float, force: Float
) -> tuple[Check, ...]:
    """Whether a force that was computed as friction times load can be right.

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
    modulated = 2 * abs(np.mean(friction * (turn - np.mean(turn))))
    whole = abs(reading.epsilon * reading.mean_friction)
    number = float(modulated / whole) if whole else np.inf
    sentence = (
        f"the force was made from friction x load ('{name}'); the recorded coefficient is "
        f"modulated by {number:.2g} of epsilon times its mean"
    )
    if number < LOCK_IN["computed force"][0]:
        sentence += (
            ". It hardly follows the load: if the recorder divided by a mean load, mu1 and phase1 "
            "are those of the load and not of the friction; use the recorded shear force"
        )
    return (LOCK_IN.check("computed force", number, sentence),)


def mains(reading: LockInReading, samples: Samples, parts: list[LoadInterval]) -> Check:
    """Whether the modulation can be hum of the mains in the load's signal.

    A line that vanishes in the pauses of the recording is not the mains.
    """
    f = reading.frequency
    near = _near_mains(f, *_MAINS)
    number = float(abs(reading.epsilon))
    if not near:
        sentence = f"{f:.6g} Hz is no harmonic of 50 or 60 Hz"
        return LOCK_IN.check("mains", number, sentence, significant=False)
    switched = False
    for part in parts:
        cut = slice(part.first, part.stop)
        line, background = _line(samples.time[cut], samples.load[cut], f)
        quiet = not part.modulated and background < np.inf
        switched |= quiet and line + background < _SWITCHED * number * abs(reading.W0)
    sentence = (
        f"the modulation, epsilon = {number:.3g} at {f:.6g} Hz, lies at a harmonic of the mains "
        f"({near[0]:g} Hz); so small a modulation may be hum in the load's signal"
        if number < LOCK_IN["mains"][0] and not switched
        else f"the modulation lies at a harmonic of the mains ({near[0]:g} Hz), and is "
        + ("switched off in the pauses" if switched else "larger than hum usually is")
    )
    return LOCK_IN.check("mains", number, sentence, significant=not switched)


def _near_mains(frequency: float, *bases: float) -> list[float]:
    """Harmonics (Hz) of mains that may be a frequency (Hz)."""
    orders = range(1, _MAINS_HARMONICS + 1)
    return [n * f for f in bases for n in orders if abs(frequency - n * f) < n * _WANDER]


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
    answers = []
    orders = range(1, min(reading.harmonics.size, 2) + 1)
    pauses = [slice(part.first, part.stop) for part in parts if not part.modulated]
    for cut, n in product(pauses, orders):
        f, harmonic = n * reading.frequency, reading.phasor(n)
        line, background = _line(samples.time[cut], samples.force[cut], f)
        if not background < np.inf:
            continue
        doubt = harmonic.amplitude_uncertainty
        number = line / (max(harmonic.amplitude, doubt) * abs(reading.W0))
        # An effect smaller than the uncertainty of the harmonic is not reported.
        seen = line > max(_SEEN * background, doubt * abs(reading.W0))
        sentence = (
            f"without modulation the force has a line of {number:.2g} mu{n} {symbol('W0')} at "
            f"{f:.6g} Hz: mains, cross-talk or the drive, which is part of the reading"
        )
        answers.append((seen, number, sentence))
    if not answers:
        return ()
    seen, number, sentence = max(answers, key=lambda answer: answer[:2])
    if not seen:
        sentence = "without modulation the force has no significant line at f and 2f"
    return (LOCK_IN.check("lines in the pauses", number, sentence, significant=seen),)


def hum(reading: LockInReading, time: Float, force: Float) -> Check:
    """Whether hum at other harmonics of the mains makes hum at f or 2f likely."""
    f = reading.frequency
    number, sentence, seen = 0.0, "no hum is to be expected at the modulation or its double", False
    for base in _MAINS:
        orders = [n for n in (1, 2) if _near_mains(n * f, base)]
        if not orders:
            continue
        n = orders[0]
        for m in (1, 2, 3):
            # Harmonics of the modulation are responses.
            if abs(m * base / f - round(m * base / f)) * f < 1.0:
                continue
            line, background = _line(time, force, m * base)
            share = line / max(reading.phasor(n).amplitude * abs(reading.W0), 1e-300)
            if line > _SEEN * background and share > number:
                number, seen = share, True
                sentence = (
                    f"hum at {m * base:g} Hz is {share:.2g} of mu{n} {symbol('W0')}; mains have "
                    f"harmonics, and {n * f:.6g} Hz is one of them: mu{n} may hold hum"
                )
    return LOCK_IN.check("hum", number, sentence, significant=seen)


def _line(time: Float, values: Float, frequency: float) -> tuple[float, float]:
    """Amplitude of a line, and its background; infinite where there are too few periods."""
    span = float(time[-1] - time[0])
    few = time.size < _LINE_SAMPLES or span * frequency < _LINE_PERIODS
    if few or frequency > 0.45 * (time.size - 1) / span:
        return 0.0, np.inf
    line = strongest_line(time, values, between=(frequency, frequency))
    return line.amplitude, line.background
