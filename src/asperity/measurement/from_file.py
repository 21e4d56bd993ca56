"""A recording measured, be it a file or a trace, modulated or not."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from asperity.errors import InputError
from asperity.measurement.measure import Measurement, measure
from asperity.measurement.sliding.measure import SlidingMeasurement, measure_sliding
from asperity.parameters.arguments import number, one_of, pair, switch, whole_number
from asperity.recording import Trace
from asperity.recording.readers import read


def measure_recording(
    recording: Trace | str | os.PathLike[str],
    *,
    modulated: bool = True,
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
        Whether the load was modulated. If not, velocity steps and holds are measured.
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
    modulated = switch(modulated, "modulated")
    one_of(detrend, ("none", "linear", "quadratic"), "detrend")
    if modulated and (steps is not None or holds is not None):
        raise InputError(
            "steps and holds must go with modulated=False, got them for a modulated recording; "
            "leave them out or say so"
        )
    between = None
    if window is not None:
        first, last = pair(window, "window")
        between = (number(first, "window", "time"), number(last, "window", "time"))
    trace = recording if isinstance(recording, Trace) else read(recording)
    common: dict[str, Any] = {"load": load, "force": force, "window": between, "detrend": detrend}
    if not modulated:
        return measure_sliding(trace, steps=steps, holds=holds, **common)
    start = None
    if frequency is not None:
        start = number(frequency, "frequency", "frequency", "positive")
    return measure(
        trace,
        frequency=start,
        harmonics=whole_number(harmonics, "harmonics", least=1),
        only_whole_periods=switch(only_whole_periods, "only_whole_periods"),
        refine=switch(refine, "refine"),
        **common,
    )
