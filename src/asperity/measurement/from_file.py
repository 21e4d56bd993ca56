"""A recording measured, be it a file or a trace, modulated or not."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from asperity.errors import ConstantLoadError, InputError
from asperity.measurement.measure import Measurement, measure
from asperity.measurement.sliding.measure import SlidingMeasurement, measure_sliding
from asperity.parameters.arguments import number, one_of, pair, switch, whole_number
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
        load=load,
    )[0]


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
