"""The simulated recording of a run, from the protocol's table ``[tribometer]``."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from asperity.errors import InputError, closest, require
from asperity.parameters.arguments import annotations_of, at_least, of_type, typed
from asperity.questions.record import require_unit, shown
from asperity.recording.roles import candidates
from asperity.recording.trace import Trace
from asperity.tribometer.sensors import (
    Accelerometer,
    DisplacementGauge,
    LoadCell,
    Sensor,
    SpringGauge,
)
from asperity.tribometer.tribometer import Recorder, Tribometer

#: Sensors by their names in files, each with its possible quantities, the usual one first.
SENSORS: Mapping[str, tuple[type[Sensor], tuple[str, ...]]] = {
    "spring gauge": (SpringGauge, ("shear force",)),
    "load cell": (LoadCell, ("normal load", "shear force")),
    "accelerometer": (Accelerometer, ("normal load",)),
    "displacement gauge": (DisplacementGauge, ("slider displacement", "load-point displacement")),
}

#: Variable of the motion for each quantity of a sensor; the load point needs two variables.
_SIGNALS = {
    "shear force": "force",
    "normal load": "load",
    "slider displacement": "displacement",
    "load-point displacement": "load point",
}

#: Quantity of a channel by the role that its name implies.
_CLAIMS = {"F": "shear force", "W": "normal load"}


@dataclasses.dataclass(frozen=True)
class RecordingSetup:
    """The recording of a protocol: tribometer, quantities and seed.

    Attributes
    ----------
    tribometer : Tribometer
    exposed : dict of str to str
        Variable of the motion that each sensor measures; ``"load point"`` for the far end of the
        spring.
    seed : int
        Seed of the noise.
    stiffness : float
        Stiffness of the spring (N/m), for the load point.
    """

    tribometer: Tribometer
    exposed: dict[str, str]
    seed: int
    stiffness: float = np.nan


def setup_of(
    table: Mapping[str, Any], sampling: float | None, stiffness: float = np.nan
) -> RecordingSetup:
    """The tribometer of a table of a protocol.

    Parameters
    ----------
    table : mapping
        Fields of `Recorder`, ``seed``, and ``sensors``: a table for each channel, with ``type``,
        the fields of that sensor and, where it can measure several things, ``measures``.
    sampling : float or None
        At which the motion is written (Hz).
    stiffness : float
        Stiffness of the spring (N/m).

    Raises
    ------
    InputError
        If a field is unknown or breaks its rule, or the motion is sampled too coarsely.
    """
    settings = dict(table)
    seed, described = settings.pop("seed", 0), settings.pop("sensors", {})
    of_type(seed, Annotated[int, at_least(0)], "tribometer.seed")
    if not isinstance(described, Mapping) or not described:
        raise InputError(
            "tribometer.sensors",
            "have a table for each channel",
            "none",
            "write it like [tribometer.sensors.'shear force'] with type = 'spring gauge' below it",
        )
    recorder = _made(Recorder, settings, "tribometer")
    sensors: dict[str, Sensor] = {}
    exposed = {}
    for channel, fields in described.items():
        sensors[channel], exposed[channel] = _sensor(channel, fields)
    _check_sampling(sampling, recorder, sensors)
    try:
        tribometer = Tribometer(sensors=sensors, recorder=recorder)
    except InputError as error:
        raise error.about(error.field.name.replace("Recorder", "tribometer")) from None
    for channel, ends in recorder.ranges.items():
        for end in ends:
            require_unit(end, sensors[channel].reads, f"tribometer.ranges['{channel}']")
    return RecordingSetup(tribometer, exposed, seed, stiffness)


@typed
def record_run(setup: RecordingSetup, run: str | Path) -> Trace:
    """Record the motion of a run; the whole motion is in memory.

    Parameters
    ----------
    setup : RecordingSetup
    run : str or path
        NetCDF file of `run_protocol`.
    """
    import h5netcdf

    with h5netcdf.File(run, "r") as file:
        time = np.asarray(file.variables["time"][:])
        wanted = set(setup.exposed.values()) - {"load point"}
        if "load point" in setup.exposed.values():
            wanted |= {"force", "displacement"}
        motion = {name: np.asarray(file.variables[name][:]) for name in wanted}
        provenance = {str(name): value for name, value in file.attrs.items()}
    if "load point" in setup.exposed.values():
        stretched = (motion["force"] - motion["force"][:1]) / setup.stiffness
        motion["load point"] = motion["displacement"] + stretched
    signals = {channel: motion[name] for channel, name in setup.exposed.items()}
    # A motion that ends early may end between two samples.
    steps = np.diff(time)
    uneven = time.size > 3 and abs(steps[-1] - steps[0]) > 1e-6 * steps[0]
    even = time.size - 1 if uneven else time.size
    signals = {channel: values[:even] for channel, values in signals.items()}
    return setup.tribometer.record(time[:even], signals, seed=setup.seed, provenance=provenance)


def _sensor(channel: str, fields: Any) -> tuple[Sensor, str]:
    """The sensor of a channel, and the variable of the motion that it measures."""
    place = f"tribometer.sensors.{channel}"
    options = dict(fields) if isinstance(fields, Mapping) else {}
    require("type" in options, f"{place}.type", "be given", "nothing", closest("", SENSORS))
    name = options.pop("type")
    if not isinstance(name, str) or name not in SENSORS:
        raise InputError(f"{place}.type", "be a sensor", shown(name), closest(str(name), SENSORS))
    made, measurable = SENSORS[name]
    chosen = options.pop("measures", None)
    measured = measurable[0] if chosen is None else chosen
    rule = f"be something that a {name} can measure"
    advice = f"choose {' or '.join(map(repr, measurable))}"
    require(measured in measurable, f"{place}.measures", rule, shown(measured), advice)
    claimed = next((_CLAIMS[r] for r in _CLAIMS if candidates(r, {channel: None})), measured)
    if chosen is None and claimed != measured:
        rule = f"be given for a {name} in a channel of this name"
        advice = f"it measures the {measured} without measures = '{claimed}'"
        raise InputError(f"{place}.measures", rule, "nothing", advice)
    return _made(made, options, place), _SIGNALS[measured]


def _made(kind: type[Any], fields: Mapping[str, Any], place: str) -> Any:
    known = annotations_of(kind.__init__)
    for name, value in fields.items():
        if name not in known:
            advice = closest(name, known)
            raise InputError(f"{place}.{name}", "be a known field", shown(value), advice)
        of_type(value, known[name], f"{place}.{name}")
        require_unit(value, kind.kind_of(name), f"{place}.{name}")
    for field in dataclasses.fields(kind):
        needed = field.default is field.default_factory is dataclasses.MISSING
        if needed and field.name not in fields:
            raise InputError(f"{place}.{field.name}", "be given", "nothing", "add it")
    try:
        return kind(**fields)
    except InputError as error:
        # The message of a sensor does not name its channel.
        raise error.about(f"{place}.{error.field.name.rpartition('.')[2]}") from None


def _check_sampling(rate: float | None, recorder: Recorder, sensors: Mapping[str, Sensor]) -> None:
    """Check, before the computation, that the motion is sampled finely enough."""
    fastest = max(max(s.bandwidth, s.resonance) for s in sensors.values())
    wanted = max(recorder.rate, 2 * fastest)
    if rate is None or rate < wanted:
        shown = "none" if rate is None else f"{rate:g} Hz"
        rule = (
            f"be at least {wanted:g} Hz for the tribometer, its rate and twice its bandwidths and "
            "resonances"
        )
        raise InputError("solver.sampling", rule, shown, "give four times its rate if you can")
