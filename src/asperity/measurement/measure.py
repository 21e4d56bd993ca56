"""From a recording to a reading with its verdicts: what `asperity measure` does."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from asperity.arrays import Float
from asperity.errors import Argument, ConstantLoadError, InputError, require
from asperity.lock_in.demodulation import DRIFTS, lock_in
from asperity.lock_in.quantisation import step_of, with_rounding
from asperity.lock_in.reading import LockInReading
from asperity.lock_in.reference import SpectralLine, around, require_modulated, strongest_line
from asperity.measurement.levels_and_trends import MeanLevel, effective_dof, rate_between
from asperity.measurement.samples import Samples, about_window, require_stated_load, usable
from asperity.measurement.static_friction import Pause, pauses_around, static_friction
from asperity.measurement.verdicts import checks, clipping, instrument, steadiness
from asperity.measurement.verdicts.verdict import Check, Judged
from asperity.measurement.window import LoadInterval, clean_run, settled, stretches, whole_periods
from asperity.parameters.arguments import typed
from asperity.parameters.parameter import SummaryLine
from asperity.questions.recording import Measurement as Question
from asperity.recording.trace import Trace

_DEFAULTS = Question()
#: A line this often above its background is a modulation.
_LINE = 8.0
#: Pieces of a long recording that are searched for the modulation, samples of a piece, and fewest
#: periods of a piece, by which the line stands apart from slower motion.
_PIECES, _PIECE, _FEWEST_PERIODS = 32, 1 << 15, 8.0


@dataclass(frozen=True, eq=False, repr=False)
class Measurement(Judged):
    """A reading of one modulated stretch, the force before and after it, and checks of both.

    Attributes
    ----------
    reading : LockInReading
    before, after : MeanLevel or None
        F(0): force without modulation next to the stretch, in the channels' unit.
    static_friction : float
        F(0)/W0 of the unmodulated load, mean of before and after; NaN if neither was recorded.
    delta_mu, delta_mu_uncertainty, delta_mu_interval_95 : float
        mean_friction - static_friction, its standard uncertainty, and half of its 95 % interval.
    checks : tuple of Check
        Every question with number, limits and sentence.
    stretches : tuple of LoadInterval
        Modulated and unmodulated parts of the whole recording.
    samples : Samples
        The usable samples.
    window : (int, int)
        Samples that were read, as a slice of `samples`.
    chosen_by : {"program", "user"}
        Who chose the window.
    """

    mode = "modulated"
    _drawn_by = "asperity.figures.recording:draw_modulated"

    reading: LockInReading
    before: MeanLevel | None
    after: MeanLevel | None
    static_friction: float
    delta_mu: float
    delta_mu_uncertainty: float
    delta_mu_interval_95: float
    checks: tuple[Check, ...]
    stretches: tuple[LoadInterval, ...]
    samples: Samples
    window: tuple[int, int]
    chosen_by: str

    def numbers(self) -> list[SummaryLine]:
        """The window and its observables."""
        reading, change = self.reading, "none"
        if math.isfinite(self.delta_mu):
            change = f"{self.delta_mu:.4g} +- {self.delta_mu_uncertainty:.1g}"
        lines = [
            SummaryLine("window", f"{reading.start:.6g} to {reading.end:.6g}", "s"),
            SummaryLine("epsilon", f"{reading.epsilon:.6g}"),
            SummaryLine("frequency", f"{reading.frequency:.9g}", "Hz"),
            SummaryLine("mean_friction", f"{reading.mean_friction:.6g}"),
            SummaryLine("delta_mu", change),
        ]
        harmonics = enumerate(reading.harmonics[:2], 1)
        lines += [SummaryLine(f"mu{n}", f"{abs(c):.4g}") for n, c in harmonics]
        return [*lines, SummaryLine("verdict", self.verdict)]


@typed
def measure(trace: Trace, question: Question = _DEFAULTS) -> Measurement:
    """Read the response to a modulated load out of a recording, and judge it.

    Without a window the longest modulated stretch is read, without what has not settled where that
    leaves half of it, and away from gaps and saturation where the longest run between them is long
    enough. A settling in the window is fitted.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
        Its fields of a modulated load; all have defaults.

    Returns
    -------
    Measurement

    Raises
    ------
    InputError
        If channels, window or frequency do not fit the recording, or no modulation stands out and
        no frequency is given.
    """
    return _measured(_prepared(trace, question), None)


@typed
def measure_amplitudes(
    trace: Trace, question: Question = _DEFAULTS
) -> list[Measurement | InputError]:
    """Read every modulated stretch of a recording, in their order; that of the window, if given.

    Parameters
    ----------
    trace, question
        As in `measure`.

    Returns
    -------
    list of Measurement or InputError
        The error of a stretch that cannot be read, such as one that is too short.

    Raises
    ------
    InputError
        As `measure` where the recording as a whole cannot be read.
    """
    if question.window is not None:
        return [measure(trace, question)]
    recording = _prepared(trace, question)
    measurements: list[Measurement | InputError] = []
    for part in (p for p in recording.parts if p.modulated):
        try:
            measurements.append(_measured(recording, part))
        except InputError as error:
            measurements.append(error)
    return measurements


def modulation_of(trace: Trace) -> float | None:
    """Frequency (Hz) at which the recorded load is modulated; None of another recording."""
    try:
        return _prepared(trace, _DEFAULTS).frequency
    except InputError:
        return None


@dataclass(frozen=True, eq=False)
class _ModulatedRecording:
    """A recording with its modulation, before any of it is read."""

    samples: Samples
    parts: list[LoadInterval]
    frequency: float
    question: Question


def _prepared(trace: Trace, question: Question) -> _ModulatedRecording:
    samples = usable(trace, question.load, question.force)
    line = modulation_line(samples.time, samples.load, question.frequency)
    require_modulated(line, samples.load)
    if question.frequency is None and line.amplitude < _LINE * line.background:
        raise ConstantLoadError(
            "measure.load",
            "be modulated",
            f"a constant load, whose strongest line, at {line.frequency:.4g} Hz, is "
            f"{line.amplitude / line.background:.2g} times its surroundings",
            f"give the frequency if you know it, or choose {Argument('modulated', value='False')}",
        )
    start = line.frequency
    if question.frequency is not None and question.exact_frequency:
        start = question.frequency
    return _ModulatedRecording(samples, _load_intervals(samples, line, start), start, question)


def _measured(recording: _ModulatedRecording, part: LoadInterval | None) -> Measurement:
    """One stretch: the longest modulated stretch, or the window, if none is given."""
    samples, parts, question = recording.samples, recording.parts, recording.question
    chosen, first, stop = _rows_to_read(recording, part)
    cut = slice(first, stop)
    time, load, force = samples.time[cut], samples.load[cut], samples.force[cut]
    reading = lock_in(
        time,
        load,
        force,
        frequency=recording.frequency,
        harmonics=question.harmonics,
        detrend=question.detrend,
        refine=not question.exact_frequency,
        settles=True,
    )
    require_stated_load(question.normal_load, reading.W0, samples.unit)
    steps = step_of(load), step_of(force)
    reading = with_rounding(reading, time, load, force, steps)
    chosen_by = "program" if question.window is None else "user"
    before, after = pauses_around(samples, parts, chosen, reading.W0, steps)
    pauses = [before.rate] if before and before.rate else []
    if before and after:
        pauses.append(rate_between(before.force, after.force))
    levels = [side.force if side else None for side in (before, after)]
    answers = (
        checks.modulation(reading),
        checks.periods(reading),
        checks.signal(reading),
        checks.contact(reading),
        checks.friction(reading.mean_friction),
        steadiness.leakage(reading),
        checks.other_modulation(reading, time, load),
        steadiness.steady_load(reading, time, load),
        steadiness.steady_response(reading),
        checks.transient(reading, chosen_by, pauses),
        checks.stick_slip(reading, time, reading.without_settling(time, force)),
        checks.load_harmonics(reading),
        checks.resolution(reading, steps),
        *instrument.computed_force(reading, samples, time, load, force),
        instrument.held_samples(reading, load, force),
        clipping.flat_top(reading, time, load, force),
        instrument.mains(reading, samples, parts),
        *instrument.lines_in_the_pauses(reading, samples, parts),
        instrument.hum(reading, time, force),
        steadiness.shifting_response(reading, time, force),
        checks.drift(reading, *levels),
        *_findings(samples, first, stop, [before, after]),
    )
    static = static_friction(reading, [b for b in (before, after) if b], pauses)
    doubt = reading.uncertainty("mean_friction")
    dof = effective_dof([(doubt, float(reading.dof[0])), (static[1], static[2])])
    whole = float(np.hypot(doubt, static[1]))
    return Measurement(
        reading=reading,
        before=levels[0],
        after=levels[1],
        static_friction=static[0],
        delta_mu=reading.mean_friction - static[0],
        delta_mu_uncertainty=whole,
        delta_mu_interval_95=float(stdtrit(dof, 0.975)) * whole,
        checks=answers,
        stretches=tuple(parts),
        samples=samples,
        window=(first, stop),
        chosen_by=chosen_by,
    )


def _rows_to_read(
    recording: _ModulatedRecording, part: LoadInterval | None
) -> tuple[LoadInterval, int, int]:
    """The stretch that is read, and its first row and the row after its last one."""
    samples, parts, question = recording.samples, recording.parts, recording.question
    time, frequency = samples.time, recording.frequency
    if question.window is None:
        modulated = [p for p in parts if p.modulated]
        chosen = part or max(modulated, key=lambda p: p.stop - p.first)
        first, stop = clean_run(chosen.first, chosen.stop, samples.defects)
        inside, degree = slice(first, stop), DRIFTS[question.detrend]
        first += settled(time[inside], samples.force[inside], frequency, degree)
    else:
        first, stop = _rows_of_window(time, question.window)
        # F(0) is that next to the stretch that is read.
        chosen = max(parts, key=lambda p: (min(p.stop, stop) - max(p.first, first), p.modulated))
    if question.whole_periods:
        stop = first + whole_periods(time[first:stop], frequency)
    return chosen, first, stop


def modulation_line(time: Float, load: Float, near: float | None = None) -> SpectralLine:
    """The modulation of a load, which may be in a part of the recording only.

    Parameters
    ----------
    time, load : array, (n,)
    near : float, optional
        Hz, within 5 %.
    """
    lines = [strongest_line(time, load, between=around(near))]
    if time.size > 2 * _PIECE:
        for at in np.linspace(0, time.size - _PIECE, _PIECES).astype(int):
            piece = slice(at, at + _PIECE)
            span = float(time[at + _PIECE - 1] - time[at])
            # A slow modulation that fits no piece is searched for in the whole.
            if near is None or near * span > _FEWEST_PERIODS:
                line = strongest_line(time[piece], load[piece], between=around(near))
                if line.frequency * span > _FEWEST_PERIODS:
                    lines.append(line)
    return max(lines, key=lambda line: line.amplitude)


def _findings(samples: Samples, first: int, stop: int, sides: list[Pause | None]) -> list[Check]:
    """Findings on the window, and what else is wrong with the pauses that are read."""
    time = samples.time

    def about(start: float, end: float) -> list[Check]:
        # Spikes and missing values are no usable samples.
        recorded = samples.trace.time
        count = int(np.sum((recorded >= start) & (recorded <= end)))
        return checks.findings(about_window(samples, start, end), count, end - start)

    answers = about(float(time[first]), float(time[stop - 1]))
    for side in sides:
        named = {check.name for check in answers}
        more = about(side.force.start, side.force.end) if side else []
        answers += [c for c in more if c.verdict != "ok" and c.name not in named]
    return answers


def _load_intervals(samples: Samples, line: SpectralLine, frequency: float) -> list[LoadInterval]:
    whole = LoadInterval(0, samples.time.size, line.amplitude)
    if line.amplitude < _LINE * line.background:
        return [whole]
    parts = stretches(samples.time, samples.load, frequency)
    return parts if any(part.modulated for part in parts) else [whole]


def _rows_of_window(time: Float, window: tuple[float, float]) -> tuple[int, int]:
    start, end = window
    first = int(np.searchsorted(time, start, side="left"))
    stop = int(np.searchsorted(time, end, side="right"))
    rule, got = "enclose at least 16 samples", f"{start:g} s to {end:g} s"
    advice = f"the recording runs from {time[0]:.10g} s to {time[-1]:.10g} s"
    require(stop - first >= 16, "measure.window", rule, got, advice)
    return first, stop
