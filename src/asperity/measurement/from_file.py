"""A recording measured, be it a file or a trace, modulated or not."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from asperity.errors import Argument, ConstantLoadError, InputError
from asperity.measurement.measure import Measurement, measure
from asperity.measurement.sliding.measure import SlidingMeasurement, measure_sliding
from asperity.measurement.stick_slip.measure import (
    Machine,
    StickSlipMeasurement,
    measure_stick_slip,
)
from asperity.parameters.arguments import number, one_of, pair, switch, whole_number
from asperity.recording import Trace
from asperity.recording.readers import read

Read = TypeVar("Read")

#: Share of the displacement in the slips above which it is the slider's, and slip events for each
#: velocity step or hold above which these are read within stick-slip.
_SLIDER, _EVENTS = 0.5, 10


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
    """
    if modulated is not None:
        modulated = switch(modulated, "modulated")
    one_of(detrend, ("none", "linear", "quadratic"), "detrend")
    if modulated is not False and (steps is not None or holds is not None):
        raise InputError(
            "steps and holds must go with modulated=False, got them without; leave them out or say "
            "so"
        )
    between = None
    if window is not None:
        first, last = pair(window, "window")
        between = (number(first, "window", "time"), number(last, "window", "time"))
    trace = recording if isinstance(recording, Trace) else read(recording)
    common: dict[str, Any] = {"load": load, "force": force, "window": between, "detrend": detrend}
    if stick_slip is not None:
        stick_slip = switch(stick_slip, "stick_slip")
    machine = Machine(
        *(
            None if value is None else number(value, name, kind, "positive")
            for value, name, kind in (
                (stiffness, "stiffness", "stiffness"),
                (velocity, "velocity", "velocity"),
                (mass, "mass", "mass"),
                (normal_load, "normal_load", "force"),
            )
        )
    )

    def events() -> StickSlipMeasurement:
        return measure_stick_slip(trace, load=load, force=force, window=between, machine=machine)

    if stick_slip:
        return events()
    if modulated is False:
        return measure_sliding(trace, steps=steps, holds=holds, **common)
    lock_in: dict[str, Any] = {
        "frequency": None,
        "harmonics": whole_number(harmonics, "harmonics", least=1),
        "only_whole_periods": switch(only_whole_periods, "only_whole_periods"),
        "refine": switch(refine, "refine"),
    }
    if frequency is not None:
        lock_in["frequency"] = number(frequency, "frequency", "frequency", "positive")
    if modulated or frequency is not None:
        return measure(trace, **lock_in, **common)
    return modulated_or_sliding(
        trace,
        lambda: measure(trace, **lock_in, **common),
        lambda: measure_sliding(trace, **common),
        events if stick_slip is None else None,
        load=load,
    )[0]


def modulated_or_sliding(
    trace: Trace,
    modulated: Callable[[], Read],
    sliding: Callable[[], SlidingMeasurement],
    stick_slip: Callable[[], StickSlipMeasurement] | None = None,
    *,
    load: str = "W",
    plain: bool = False,
) -> tuple[Read | SlidingMeasurement | StickSlipMeasurement, str]:
    """Measure a recording as what it is.

    Parameters
    ----------
    trace : Trace
    modulated : callable
        Measures a modulated recording.
    sliding : callable
        Measures one of which the load is constant, or not recorded.
    stick_slip : callable, optional
        Measures the slip events of one; None where these are not asked for.
    load : str
        Channel, by name or role.
    plain : bool
        Whether sliding at one velocity counts whatever it is; if not, there must be velocity steps,
        holds, slip events, or sliding that is steady.

    Returns
    -------
    measurement : Measurement, SlidingMeasurement or StickSlipMeasurement
        Or what else `modulated` returns.
    reason : str
        What the recording is, where it was not read as modulated; else empty.

    Raises
    ------
    InputError
        If it is none of these.
    """
    try:
        return modulated(), ""
    except InputError as error:
        constant = isinstance(error, ConstantLoadError)
        if not constant and _recorded(trace, load):
            raise
        reason = error
    what = "The normal load is constant" if constant else "No channel is the normal load"
    events = _events(stick_slip)
    try:
        measurement = sliding()
    except InputError as error:
        if not constant and len(trace.channels) == 1:
            raise _which_force(trace) from None
        raise (error if constant and plain else reason) from None
    changes = len(measurement.steps) + len(measurement.holds)
    if events is not None and _rather_events(events, changes):
        return events, f"{what}: {events.kind} is read, not a modulation."
    if changes:
        return measurement, f"{what}: velocity steps and holds are read, not a modulation."
    steady = events is not None and events.kind == "steady sliding"
    if not (plain or steady):
        raise reason
    return measurement, f"{what}: steady sliding is read, not a modulation."


def _events(read: Callable[[], StickSlipMeasurement] | None) -> StickSlipMeasurement | None:
    try:
        return None if read is None else read()
    except InputError:
        return None


def _rather_events(events: StickSlipMeasurement, changes: int) -> bool:
    """Whether slip events say more of a recording than its velocity steps and holds do.

    Where the displacement is the slider's, each stick looks like a hold.
    """
    if not events.clear:
        return False
    if not changes or events.slip_share > _SLIDER:
        return True
    return any(r.sticks for r in events.regimes) and len(events.events) > _EVENTS * changes


def _which_force(trace: Trace) -> InputError:
    (name,) = trace.channels
    friction, force = (Argument("columns", role, name) for role in ("friction", "F"))
    return InputError(
        Argument("columns", "friction"),
        "name the friction in a recording of one column",
        f"'{name}'",
        f"where it is F/W write {friction}; where it is the force write {force} and give the load "
        "too",
    )


def _recorded(trace: Trace, name: str) -> bool:
    try:
        trace.channel(name)
    except InputError:
        return False
    return True
