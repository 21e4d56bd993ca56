"""Measurement of a recording, a file or a trace, with or without modulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from asperity.errors import Argument, ConstantLoadError, InputError, require
from asperity.measurement.measure import Measurement, measure, measure_amplitudes
from asperity.measurement.sliding.measure import SlidingMeasurement, measure_sliding
from asperity.measurement.stick_slip.measure import SLIDER, StickSlipMeasurement, measure_stick_slip
from asperity.parameters.arguments import FilePath, typed
from asperity.questions.recording import OF_MODULATION, OF_SLIPS, Measurement as Question
from asperity.recording import Trace
from asperity.recording.finding import with_cause
from asperity.recording.readers import read

Read = TypeVar("Read")

#: Number of slip events per velocity step or hold, above which the recording is read as stick-slip.
_EVENTS = 10


@typed
def measure_recording(
    recording: Trace | FilePath,
    *,
    modulated: bool | None = None,
    load: str = "W",
    force: str = "F",
    frequency: float | str | None = None,
    harmonics: int = 4,
    window: tuple[Any, Any] | str | None = None,
    detrend: str = "linear",
    only_whole_periods: bool = False,
    refine: bool = True,
    steps: Sequence[float | str] | None = None,
    velocities: Sequence[float | str] | None = None,
    holds: Sequence[tuple[Any, Any] | str] | None = None,
    stick_slip: bool | None = None,
    stiffness: float | str | None = None,
    velocity: float | str | None = None,
    mass: float | str | None = None,
    normal_load: float | str | None = None,
) -> Measurement | SlidingMeasurement | StickSlipMeasurement:
    """Measure a recording, as ``asperity measure`` does.

    Parameters
    ----------
    recording : Trace or path
        Result of `asperity.read`, or a file that it reads without further arguments.
    modulated : bool
        Whether the load was modulated. If not, velocity steps and holds are measured; by default
        they are if the load is constant, or not recorded, and there are some.
    load, force : str
        Channels, by name or role.
    frequency : float or str, optional
        Initial guess of the modulation frequency (Hz); by default the strongest line.
    harmonics : int
        Number of harmonics, for a modulated recording.
    window : (float, float), optional
        First and last time (s), numbers or texts with units.
    detrend : {"none", "linear", "quadratic"}
    only_whole_periods, refine : bool
        Of a modulated recording: whether the window is cut to whole periods, which the fit does
        not need, and whether the frequency is fitted. If not, `frequency` is taken to be exact.
    steps : sequence of float, optional
        For a recording without modulation: times (s) of velocity steps.
    velocities : sequence of float or str, optional
        Velocities of the drive between the steps (m/s), one more than these, 0 in a hold; measured
        where a channel has the motion.
    holds : sequence of (float, float), optional
        For a recording without modulation: begin and end (s) of holds.
    stick_slip : bool
        Whether slip events are read; by default they are if there are some, and no modulation.
    stiffness, velocity, mass, normal_load : float or str, optional
        K, V, M and W0 of the machine (N/m, m/s, kg, N), for slips, velocities and energies of slip
        events. Without a recorded load W0 is M g unless it is given.

    Returns
    -------
    Measurement, SlidingMeasurement or StickSlipMeasurement

    Raises
    ------
    InputError
        If the file cannot be read, the recording lacks a channel, or an argument does not fit.

    Examples
    --------
    >>> import asperity as asp
    >>> print(asp.measure(asp.samples.velocity_steps()))
    >>> asp.measure(asp.samples.velocity_steps(), window=("100 s", "400 s")).plot()
    """
    # Most arguments are the fields of the question.
    fields = {name: value for name, value in locals().items() if name in Question.model_fields}
    question = Question(**fields, exact_frequency=not refine, whole_periods=only_whole_periods)
    trace = recording if isinstance(recording, Trace) else read(recording)
    return answer_measurement(trace, question)[0]


def answer_measurement(
    trace: Trace, question: Question, *, plain: bool = False
) -> tuple[Measurement | SlidingMeasurement | StickSlipMeasurement, str]:
    """The measurement that a question asks for: the modulated stretch, slip events, or sliding.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
    plain : bool
        Whether sliding at one velocity is measured in any case. If not, the recording must have
        velocity steps, holds, slip events or steady sliding.

    Returns
    -------
    measurement : Measurement, SlidingMeasurement or StickSlipMeasurement
    what : str
        A note if the program itself takes the recording as not modulated; else empty.

    Raises
    ------
    InputError
        As in `measure_recording`.
    """
    result, note = _by_kind_of_motion(trace, question, measure, plain=plain)
    if not isinstance(result, StickSlipMeasurement):
        advice = f"leave it out, or give {Argument('measure.stick_slip')} too"
        _require_unset(question, OF_SLIPS, "slip events", "a recording without them", advice)
    if not isinstance(result, Measurement):
        slips = isinstance(result, StickSlipMeasurement)
        what = "a recording of slip events" if slips else "a constant load"
        names = OF_MODULATION if slips else OF_MODULATION[:-1]
        _require_unset(question, names, "a modulated load", what, "leave it out")
    return result, note


def _require_unset(
    question: Question, names: Sequence[str], needed: str, recording: str, advice: str
) -> None:
    """Refuse fields that have no influence on the measurement of this recording."""
    for name in names:
        value = getattr(question, name)
        unset = value == Question.model_fields[name].default
        require(unset, f"measure.{name}", f"go with {needed}", f"it with {recording}", advice)


def measured_parts(
    trace: Trace, question: Question
) -> list[Measurement | InputError] | SlidingMeasurement | StickSlipMeasurement:
    """As `answer_measurement`, with every modulated stretch of the recording or of the window."""
    return _by_kind_of_motion(trace, question, measure_amplitudes)[0]


def _by_kind_of_motion(
    trace: Trace,
    question: Question,
    modulated: Callable[[Trace, Question], Read],
    *,
    plain: bool = False,
) -> tuple[Read | SlidingMeasurement | StickSlipMeasurement, str]:
    """The result of `modulated`, the sliding or the slip events, as question or recording says."""
    if question.stick_slip:
        return measure_stick_slip(trace, question), ""
    if question.modulated is False:
        return measure_sliding(trace, question), ""
    try:
        return modulated(trace, question), ""
    except InputError as error:
        constant = isinstance(error, ConstantLoadError)
        known = question.modulated or question.frequency is not None
        if known or (not constant and trace.has(question.load)):
            raise
        reason = error
    what = "The normal load is not modulated" if constant else "No channel is the normal load"
    events, unread = None, None
    try:
        events = measure_stick_slip(trace, question) if question.stick_slip is None else None
    except InputError as error:
        unread = error
    try:
        measurement = measure_sliding(trace, question)
    except InputError as error:
        # W0 is known of slip events alone.
        if events is not None and _rather_events(events, 0):
            return events, f"{what}: {events.kind} is read."
        if unread is not None and question.normal_load is not None:
            raise unread from None
        if not constant and len(trace.channels) == 1:
            raise with_cause(_which_force(trace), trace.findings) from None
        raise error from None
    changes = len(measurement.steps) + len(measurement.holds)
    if events is not None and _rather_events(events, changes):
        return events, f"{what}: {events.kind} is read."
    if changes:
        return measurement, f"{what}: velocity steps and holds are read."
    steady = events is not None and events.kind == "steady sliding"
    if not (plain or steady):
        if measurement.velocity_from:
            raise reason
        if unread is not None and not constant:
            raise unread
        raise _without_motion(measurement, events)
    return measurement, f"{what}: steady sliding is read."


def reads_cycles(trace: Trace, question: Question, events: StickSlipMeasurement) -> bool:
    """Whether most of a recording is stick-slip, and not velocity steps and holds.

    Parameters
    ----------
    trace : Trace
    question : asperity.questions.recording.Measurement
    events : StickSlipMeasurement
        Its slip events: peaks of velocity steps may be some, too.
    """
    if not events.clear:
        return False
    # Velocity steps and holds show in the displacement of the drive alone.
    if not events.slip_share <= SLIDER:
        return True
    try:
        sliding = measure_sliding(trace, question)
    except InputError:
        return True
    return _rather_events(events, len(sliding.steps) + len(sliding.holds))


def _rather_events(events: StickSlipMeasurement, changes: int) -> bool:
    """Whether slip events say more of a recording than its velocity steps and holds do.

    Where the displacement is the slider's, each stick looks like a hold.
    """
    kinds = {regime.kind for regime in events.regimes}
    sticks = any(regime.sticks for regime in events.regimes)
    # Stick-slip may begin or end in a recording of one velocity.
    if not (events.clear or (sticks and not changes and "cannot tell" not in kinds)):
        return False
    if not changes or events.slip_share > SLIDER:
        return True
    return sticks and len(events.events) > _EVENTS * changes


def _which_force(trace: Trace) -> InputError:
    (name,) = trace.channels
    friction, force = (Argument("columns", role, name) for role in ("friction", "F"))
    load = Argument("channels", "load", "1200 N")
    rule = "name the friction in a recording of one column"
    advice = f"where it is F/W write {friction}; where it is the force write {force} {load}"
    return InputError(Argument("columns", "friction"), rule, f"'{name}'", advice)


def _without_motion(
    measurement: SlidingMeasurement, events: StickSlipMeasurement | None
) -> InputError:
    (cut,) = (check for check in measurement.checks if check.name == "segments")
    got = (
        f"{'friction alone' if measurement.load is None else 'a constant load'}, and {cut.sentence}"
    )
    name = Argument("columns", "displacement", "x")
    steps, velocities = Argument("measure.steps"), Argument("measure.velocities")
    advice = f"name a displacement, like {name}, or give {steps} and {velocities}"
    if events is not None and events.kind == "cannot tell":
        got += f", and as slips {events.regimes[0].evidence}"
        advice += f"; {Argument('measure.stick_slip')} reads slips nevertheless"
    rule = "have a modulated load, velocity steps, holds, slips or steady friction"
    return InputError("measure.trace", rule, got, advice)
