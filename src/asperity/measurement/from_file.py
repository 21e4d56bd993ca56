"""A recording measured, be it a file or a trace, modulated or not."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from asperity.errors import ConstantLoadError, InputError
from asperity.measurement.measure import Measurement, measure, measure_amplitudes
from asperity.measurement.sliding.measure import SlidingMeasurement, measure_sliding
from asperity.questions.recording import Measurement as Question
from asperity.recording import Trace
from asperity.recording.readers import read

Read = TypeVar("Read")


def measure_recording(
    recording: Trace | str | os.PathLike[str],
    *,
    modulated: bool | None = None,
    load: str = "W",
    force: str = "F",
    frequency: float | str | None = None,
    harmonics: int = 4,
    window: tuple[Any, Any] | None = None,
    detrend: str = "linear",
    only_whole_periods: bool = False,
    refine: bool = True,
    steps: Sequence[float] | None = None,
    holds: Sequence[tuple[float, float]] | None = None,
) -> Measurement | SlidingMeasurement:
    """Measure a recording, as ``asperity measure`` does.

    Parameters
    ----------
    recording : Trace or path
        What `asperity.read` returns, or a file that it reads without further arguments.
    modulated : bool
        Whether the load was modulated. If not, velocity steps and holds are measured; by default
        they are if the load is constant, or not recorded, and there are some.
    load, force : str
        Channels, by name or role.
    frequency : float or str, optional
        Of the modulation, to start from (Hz); found by default.
    harmonics : int
        Of a modulated recording.
    window : (float, float), optional
        First and last time (s), numbers or texts with units.
    detrend : {"none", "linear", "quadratic"}
    only_whole_periods, refine : bool
        Of a modulated recording: see `asperity.measurement.measure`.
    steps : sequence of float, optional
        Of a recording without modulation: times (s) of velocity steps.
    holds : sequence of (float, float), optional
        Of a recording without modulation: begin and end (s) of holds.

    Returns
    -------
    Measurement or SlidingMeasurement

    Raises
    ------
    InputError
        If the file cannot be read, the recording lacks a channel, or an argument does not fit.
    """
    fields: dict[str, Any] = {
        "modulated": modulated,
        "load": load,
        "force": force,
        "frequency": frequency,
        "exact_frequency": not refine,
        "harmonics": harmonics,
        "window": window,
        "whole_periods": only_whole_periods,
        "detrend": detrend,
        "steps": steps,
        "holds": holds,
    }
    question = Question(**fields)
    trace = recording if isinstance(recording, Trace) else read(recording)
    return answer_measurement(trace, question)[0]


def answer_measurement(
    trace: Trace, question: Question, *, plain: bool = False
) -> tuple[Measurement | SlidingMeasurement, str]:
    """What a question asks of a recording: its longest modulated stretch, or its sliding.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
    plain : bool
        As of `modulated_or_sliding`.

    Returns
    -------
    measurement : Measurement or SlidingMeasurement
    what : str
        What the recording is, where the program reads it as sliding by itself; else empty.

    Raises
    ------
    InputError
        As of `measure_recording`.
    """
    return _either(
        trace,
        question,
        lambda: measure(trace, window=question.window, **_lock_in(question)),
        plain=plain,
    )


def measured_parts(
    trace: Trace, question: Question
) -> list[Measurement | InputError] | SlidingMeasurement:
    """As `answer_measurement`, with every modulated stretch of the recording or of the window."""
    return _either(trace, question, lambda: modulated_parts(trace, question))[0]


def modulated_parts(trace: Trace, question: Question) -> list[Measurement | InputError]:
    """Every modulated stretch of a recording; that of the window, if one is given."""
    if question.window is not None:
        return [measure(trace, window=question.window, **_lock_in(question))]
    return measure_amplitudes(trace, **_lock_in(question))


def _either(
    trace: Trace, question: Question, modulated: Callable[[], Read], *, plain: bool = False
) -> tuple[Read | SlidingMeasurement, str]:
    """What `modulated` reads, or the sliding, as the question or the recording says."""

    def sliding() -> SlidingMeasurement:
        return measure_sliding(
            trace,
            load=question.load,
            force=question.force,
            window=question.window,
            detrend=question.detrend,
            steps=question.steps,
            holds=question.holds,
        )

    if question.modulated is False:
        return sliding(), ""
    if question.modulated or question.frequency is not None:
        return modulated(), ""
    return modulated_or_sliding(trace, modulated, sliding, load=question.load, plain=plain)


def _lock_in(question: Question) -> dict[str, Any]:
    return {
        "load": question.load,
        "force": question.force,
        "frequency": question.frequency,
        "harmonics": question.harmonics,
        "detrend": question.detrend,
        "only_whole_periods": question.whole_periods,
        "refine": not question.exact_frequency,
    }


def modulated_or_sliding(
    trace: Trace,
    modulated: Callable[[], Read],
    sliding: Callable[[], SlidingMeasurement],
    *,
    load: str = "W",
    plain: bool = False,
) -> tuple[Read | SlidingMeasurement, str]:
    """Measure a recording as what it is.

    Parameters
    ----------
    trace : Trace
    modulated : callable
        Measures a modulated recording.
    sliding : callable
        Measures one of which the load is constant, or not recorded.
    load : str
        Channel, by name or role.
    plain : bool
        Whether sliding at one velocity counts; if not, velocity steps or holds are needed.

    Returns
    -------
    measurement : Measurement or SlidingMeasurement
        Or what else `modulated` returns.
    reason : str
        What the recording is, where it was not read as modulated; else empty.

    Raises
    ------
    InputError
        If it is neither.
    """
    try:
        return modulated(), ""
    except InputError as error:
        constant = isinstance(error, ConstantLoadError)
        if not constant and _recorded(trace, load):
            raise
        reason = error
    try:
        measurement = sliding()
    except InputError as error:
        raise (error if constant and plain else reason) from None
    if not (plain or measurement.steps or measurement.holds):
        raise reason
    what = "The normal load is constant" if constant else "No channel is the normal load"
    return measurement, f"{what}: velocity steps and holds are read, not a modulation."


def _recorded(trace: Trace, name: str) -> bool:
    try:
        trace.channel(name)
    except InputError:
        return False
    return True
