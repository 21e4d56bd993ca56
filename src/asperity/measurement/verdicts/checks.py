"""Checks of a lock-in reading, each a number with its limits.

Some checks ask whether a dry contact can give these numbers at all; if it cannot, columns, signs or
units are wrong.
"""

from __future__ import annotations

import numpy as np

from asperity.arrays import Float
from asperity.errors import symbol
from asperity.lock_in.reading import LockInReading
from asperity.measurement.levels_and_trends import MeanLevel, Rate
from asperity.measurement.verdicts.steadiness import other_line
from asperity.measurement.verdicts.verdict import FINDINGS, LOCK_IN, Check, Limits, percent
from asperity.recording.finding import Finding

#: Friction of contacts: limits of a small mean of F/W0, and of a large one.
_LOW_FRICTION, _HIGH_FRICTION = (0.02, -2.0), (2.0, 20.0)

#: A line this often above its background is no accident of a spectrum of 1e5 lines.
_LINE = 6.0

#: Phases of a period, both ends included, at which the smallest load is looked for.
_PHASES = 257


def modulation(reading: LockInReading) -> Check:
    """Whether the load is modulated at all."""
    number = abs(reading.epsilon) / max(reading.uncertainty("epsilon"), 1e-300)
    text = (
        f"the load's amplitude is {_times(number)} its uncertainty, epsilon = "
        f"{reading.epsilon:.4g} at {reading.frequency:.6g} Hz"
    )
    return LOCK_IN.check("modulation", number, text)


def periods(reading: LockInReading) -> Check:
    """Whether the window holds enough periods of the modulation."""
    number = reading.periods
    text = (
        f"the window holds {number:.5g} periods; below five, harmonics and drift are hard to tell "
        "apart"
    )
    return LOCK_IN.check("periods", number, text)


def signal(reading: LockInReading) -> Check:
    """Whether the first harmonic stands out of the noise."""
    phasor = reading.phasor(1)
    number = phasor.amplitude / max(phasor.amplitude_uncertainty, 1e-300)
    text = (
        f"mu1 is {_times(number)} its standard uncertainty; below three its amplitude is biased "
        "and its phase unknown"
    )
    return LOCK_IN.check("signal", number, text)


def load_harmonics(reading: LockInReading) -> Check:
    """How much of mu2 can come from a second harmonic of the load."""
    if reading.harmonics.size < 2:
        return LOCK_IN.check("load harmonics", 0.0, "mu2 was not measured")
    second, response = reading.load_phasor(2), reading.phasor(2)
    share = second.amplitude
    effect = reading.phasor(1).amplitude / abs(reading.epsilon) * share
    number = effect / max(response.amplitude, 1e-300)
    text = (
        f"the load's second harmonic is {share:.3g} {symbol('W0')}; with the ratio mu1/epsilon of "
        f"the first harmonic it makes {effect:.2g} of mu2 = {response.amplitude:.3g}, and at most "
        f"{abs(reading.mean_friction) * share:.2g} if the force followed the load at once"
    )
    seen = _in_load(reading, 2) and effect > response.amplitude_uncertainty
    return LOCK_IN.check("load harmonics", number, text, significant=seen)


def drift(reading: LockInReading, before: MeanLevel | None, after: MeanLevel | None) -> Check:
    """Whether F(0) is the same after the modulation as before it."""
    if before is not None and after is not None:
        change = after.value - before.value
        doubt = float(np.hypot(before.uncertainty, after.uncertainty))
        share = change / _nonzero(before.value)
        sentence = f"F(0) after the modulation differs by {percent(share)} from F(0) before it"
        significant = abs(change) > 3 * doubt
    else:
        # A parabola may end where it began.
        change = float(np.copysign(reading.drift_range[1], reading.drift[1].sum()))
        share = change / _nonzero(reading.mean_force)
        sentence = (
            f"the force drifts by {percent(share)} over the window; F(0) before and after is not "
            "in the recording"
        )
        significant = abs(change) > 10 * reading.uncertainty("mean_force")
    return LOCK_IN.check("drift", abs(share), sentence, significant=significant)


def transient(reading: LockInReading, chosen_by: str, pauses: list[Rate]) -> Check:
    """Whether the mean force settles in the window, and whether its final value is determined.

    A settling that ends in the window is part of the reading. In a window that the user chose, it
    is still reported: the window does not hold a steady state. A settling that is much slower than
    the window looks like a drift; the force without modulation does not have this drift.

    Parameters
    ----------
    reading : LockInReading
    chosen_by : {"program", "user"}
        Who chose the window.
    pauses : list of Rate
        Rates at which the force changes without modulation.
    """
    settling, mean = reading.settling, max(abs(reading.mean_force), 1e-300)
    length = reading.end - reading.start
    if settling is not None:
        number, lasts = abs(settling.amplitude) / mean, length / settling.decay
        sentence = (
            f"the force settles by {percent(number)} of its mean, and the window holds "
            f"{lasts:.2g} of its time constants; "
        ) + (
            "the reading is of its final value"
            if settling.determined
            else "its final value is not determined; record a longer stretch"
        )
        seen = chosen_by == "user" or not settling.determined
        return LOCK_IN.check("transient", number, sentence, significant=seen)
    away = [drift_rate(reading).beyond(pause) for pause in pauses if reading.drift.shape[1]]
    # A pause that recovers from a modulation drifts too: the drift of the window must exceed that
    # of every pause.
    number = min(away, default=0.0) * length / mean
    sentence = (
        f"over the window the force moves by {percent(number)} of its mean more than without "
        "modulation: it still settles, and its final value is not determined"
        if number
        else "the force does not settle significantly"
    )
    return LOCK_IN.check("transient", number, sentence)


def drift_rate(reading: LockInReading) -> Rate:
    """Rate of the fitted linear drift of the force."""
    length = reading.end - reading.start
    change, doubt = reading.drift[1, 0], reading.drift_uncertainty[1, 0]
    return Rate(float(change / length), float(doubt / length), float(reading.dof[0]))


def stick_slip(reading: LockInReading, time: Float, force: Float) -> Check:
    """Whether the force has a slow oscillation that the load does not cause."""
    line = other_line(reading, time, force, 1)
    number, sentence, seen = 0.0, "no slow oscillation is significant", False
    if line is not None:
        number = line.amplitude / max(abs(reading.mean_force), 1e-300)
        seen = line.amplitude > _LINE * line.background
        if seen:
            sentence = (
                f"the force oscillates at {line.frequency:.4g} Hz, no harmonic, by "
                f"{percent(number)} of its mean"
            )
    return LOCK_IN.check("stick-slip", number, sentence, significant=seen)


def other_modulation(reading: LockInReading, time: Float, load: Float) -> Check:
    """Whether the load is modulated at one frequency: a second line lowers the friction as well.

    The number is the power of the second line over that of the first, because the mean of friction
    changes with the square of a small amplitude.
    """
    line = other_line(reading, time, load, 0)
    number, sentence, seen = 0.0, "the load has no significant line that is no harmonic", False
    if line is not None and line.amplitude > _LINE * line.background:
        share = line.amplitude / abs(_nonzero(reading.epsilon * reading.W0))
        number, seen = share**2, True
        sentence = (
            f"the load has a line at {line.frequency:.4g} Hz, no harmonic, of {percent(share)} of "
            "its amplitude, or its phase wanders"
        )
    return LOCK_IN.check("other modulation", number, sentence, significant=seen)


def resolution(reading: LockInReading, steps: tuple[float, float]) -> Check:
    """Whether the steps of the recorder are small against the first harmonics.

    Noise of at least half a step smooths the steps; without noise, a harmonic smaller than a step
    cannot be measured.

    Parameters
    ----------
    reading : LockInReading
    steps : (float, float)
        Steps of the recorder of load and force.
    """
    heights = (reading.epsilon, reading.phasor(1).amplitude)
    answers = []
    for c, (name, step) in enumerate(zip(("load", "force"), steps, strict=True)):
        noise = float(np.sqrt(reading.noise.spectra[1:, c, c].real.mean()))
        number = step / max(heights[c] * abs(reading.W0), 1e-300)
        answers.append((noise < 0.5 * step, number, name, noise / step if step else np.inf))
    seen, number, name, noisy = max(answers)
    text = (
        f"the {name} is recorded in steps of {number:.2g} of its first harmonic, with noise of "
        f"{noisy:.2g} steps"
    )
    return LOCK_IN.check("resolution", number, text, significant=seen)


def findings(noticed: list[Finding], samples: int, span: float) -> list[Check]:
    """Findings of the reader and of the checks of the recording, as checks of the window.

    Parameters
    ----------
    noticed : list of Finding
    samples : int
        Number of samples in the window.
    span : float
        Length of the window (s).
    """
    # Factors that turn the number of a finding into a share of the window.
    shares = dict.fromkeys(("spike", "repeated time", "missing values", "infinite"), 1 / samples)
    shares["gap"] = 1 / span
    limits = {"note": (2.0, 3.0), "warning": (0.5, 2.0), "error": (0.25, 0.5)}
    checks = []
    for finding in noticed:
        name, number = finding.name, finding.number * shares.get(finding.name, 1.0)
        sentence = finding.sentence.rstrip(".") + (f" ({finding.where})" if finding.where else "")
        if name in FINDINGS:
            checks.append(FINDINGS.check(name, number, sentence))
        else:
            by_severity = Limits({name: limits[finding.severity]})
            checks.append(by_severity.check(name, 1.0, sentence))
    return checks


def _nonzero(value: float) -> float:
    return value or 1e-300


def _times(number: float) -> str:
    return f"{number:.3g} times" if number < 1e6 else "more than a million times"


def contact(reading: LockInReading) -> Check:
    """Whether the load stays above zero."""
    # Of the harmonics those count that noise does not explain.
    seen = [n for n in range(1, reading.harmonics.size + 1) if n == 1 or _in_load(reading, n)]
    turns = np.exp(2j * np.pi * np.outer(np.linspace(0, 1, _PHASES), seen))
    number = -float((turns @ reading.load_harmonics[np.array(seen) - 1]).real.min())
    text = (
        f"the load falls to {1 - number:.3g} {symbol('W0')} in each period; below zero "
        "contact is lost, or the load's zero or sign is not that of the recording"
    )
    return LOCK_IN.check("contact", number, text)


def _in_load(reading: LockInReading, n: int) -> bool:
    """Whether the load has harmonic n beyond noise."""
    phasor = reading.load_phasor(n)
    return phasor.amplitude > 4 * phasor.amplitude_uncertainty


def friction(number: float) -> Check:
    """Whether a mean of F/W0 is a friction coefficient of contacts."""
    low, high = _LOW_FRICTION[0], _HIGH_FRICTION[0]
    sentence = (
        f"the mean of F/{symbol('W0')} is {number:.4g}, where contacts have {low:g} to {high:g}"
    )
    if number < 0:
        sentence += (
            "; load and force have opposite signs, which turns every phase by pi: a unit such as "
            "'-1 N' for one of them turns it back"
        )
    elif not low <= number <= high:
        sentence += "; check the units, the zeros and which column is which"
    limits = Limits(friction=_HIGH_FRICTION if number > low else _LOW_FRICTION)
    return limits.check("friction", number, sentence)
