"""Recordings: read and measured in a process of its own, with limits.

This module imports what it needs late and nothing else: it is loaded anew for every file.
"""

from __future__ import annotations

import csv
import json
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from asperity.app.decimation import extremes
from asperity.app.endpoints import Question
from asperity.app.words import in_labels
from asperity.errors import InputError, naming, printable
from asperity.parameters import OUTPUTS
from asperity.recording.roles import ROLES, candidates

if TYPE_CHECKING:
    from asperity.measurement.sliding.measure import SlidingMeasurement


#: Address space (bytes) and processor time (s) of a process that reads a recording.
LIMITS = {"memory": 6 * 1024**3, "seconds": 240}
#: Blocks of a curve that is shown: two points each.
_BLOCKS = 700
#: Channels that are drawn, and findings and rows that are listed.
_MOST_CHANNELS, _MOST_LISTED = 24, 200
#: Largest lock-in table (bytes).
LARGEST_TABLE = 1024**2

Name = Annotated[str, Field(max_length=60)]
Text = Annotated[str, Field(max_length=200)]
Seconds = (
    Annotated[float, Field(allow_inf_nan=False)] | Annotated[int, Field(ge=-(10**15), le=10**15)]
)


class Source(Question):
    """How a file is read; the fields are those of `asperity.read`.

    Attributes
    ----------
    columns : dict of str to str or int
        Column of each role that was chosen.
    units : dict of str to str
        By column.
    channels : dict of str to str
        Expressions of channels that are made of others.
    rate, group, area, delimiter, decimal : str or None
        `area` makes stresses forces.
    """

    columns: Annotated[dict[Name, Text | int], Field(max_length=10, default_factory=dict)]
    units: Annotated[dict[Text, Name], Field(max_length=60, default_factory=dict)]
    channels: Annotated[dict[Name, Text], Field(max_length=20, default_factory=dict)]
    rate: Name | None = None
    group: Text | None = None
    area: Name | None = None
    delimiter: Name | None = None
    decimal: Name | None = None


class Options(Question):
    """What is measured; the fields are the options of ``asperity measure``.

    Attributes
    ----------
    mode : {"auto", "modulated", "sliding"}
        "auto": modulated if a modulation stands out, else velocity steps and holds.
    """

    mode: Literal["auto", "modulated", "sliding"] = "auto"
    frequency: Name | None = None
    exact_frequency: bool = False
    harmonics: Annotated[int, Field(ge=1, le=64)] = 4
    window: Annotated[list[Seconds], Field(min_length=2, max_length=2)] | None = None
    whole_periods: bool = False
    detrend: Literal["none", "linear", "quadratic"] = "linear"
    steps: Annotated[list[Seconds], Field(max_length=200)] | None = None
    holds: (
        Annotated[
            list[Annotated[list[Seconds], Field(min_length=2, max_length=2)]],
            Field(max_length=200),
        ]
        | None
    ) = None


def measure(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Read a file and measure it.

    Messages: ``recording`` with what was understood, and the result with ``measured``; a lock-in
    table is the result ``table``.
    """
    path, name = Path(argument["path"]), argument["name"]
    with named(path, name):
        table = _table_in(path, name)
        if table is not None:
            return {"table": table}
        report(stage="reading")
        trace = read_source(path, argument["source"])
        report(recording=_described(trace, name, argument["source"]))
        return _measured(trace, argument, report)


@contextmanager
def named(path: Path, name: str) -> Iterator[None]:
    """Sentences with the name that people know in place of the server's."""
    with naming(in_labels):
        try:
            yield
        except InputError as error:
            text = str(error).replace(str(path), name).replace(path.name, name)
            raise InputError(printable(text, 900)) from None


def read_source(path: Path, source: Mapping[str, Any]) -> Any:
    """The recording in a file, read as the fields of `Source` say."""
    from asperity.recording.conversions import stress_to_force
    from asperity.recording.readers import read

    chosen = Source.model_validate(source)
    layout = {n: getattr(chosen, n) for n in ("rate", "group", "delimiter", "decimal")}
    trace = read(
        path,
        columns=chosen.columns or None,
        units=chosen.units or None,
        channels=chosen.channels,
        **{n: v for n, v in layout.items() if v},
    )
    return stress_to_force(trace, chosen.area) if chosen.area else trace


def _described(trace: Any, name: str, source: Mapping[str, Any]) -> dict[str, Any]:
    """Channels and units as understood, what was found, and curves of each channel."""
    kinds = {n: c.kind for n, c in trace.channels.items()}
    roles = {role: trace.roles.get(role) for role in ROLES if role != "time"}
    fitting = {r: candidates(r, kinds) for r, n in roles.items() if n is None}
    guessed = {r: own[0] if len(own) == 1 else None for r, own in fitting.items()}
    channels = []
    for number, (channel_name, channel) in enumerate(trace.channels.items()):
        finite = channel.values[np.isfinite(channel.values)]
        some = curve = {}
        if finite.size:
            some = {"least": finite.min(), "mean": finite.mean(), "largest": finite.max()}
        if finite.size and number < _MOST_CHANNELS:
            curve = {"curve": extremes(trace.time, channel.values, 120)}
        channels.append(
            {
                "name": channel_name, "recorded_name": channel.recorded_name,
                "recorded_unit": channel.recorded_unit, "unit": channel.unit, "kind": channel.kind,
                "not_finite": int(channel.values.size - finite.size),
                **some, **curve,
            }
        )  # fmt: skip
    provenance = {
        k: v for k, v in trace.provenance.items() if isinstance(v, str | int | float | bool)
    }
    return {
        "name": name,
        "samples": len(trace),
        "start": trace.time[0], "end": trace.time[-1], "rate": trace.sample_rate,
        "channels": channels,
        "roles": roles | {r: n for r, n in guessed.items() if n is not None},
        "candidates": fitting,
        "findings": [asdict(f) for f in trace.findings[:_MOST_LISTED]],
        "provenance": {**provenance, "file": name},
        "python": _read_python(name, source),
    }  # fmt: skip


def _measured(
    trace: Any, argument: Mapping[str, Any], report: Callable[..., None]
) -> dict[str, Any]:
    from asperity.measurement.from_file import modulated_or_sliding

    options = Options.model_validate(argument["options"])
    name = argument["name"]
    result: dict[str, Any] | SlidingMeasurement
    report(stage="measuring")
    if options.mode == "modulated":
        result, note = _modulated(trace, options, name), ""
    elif options.mode == "sliding":
        result, note = _sliding(trace, options), ""
    else:
        result, note = modulated_or_sliding(
            trace,
            lambda: _modulated(trace, options, name),
            lambda: _sliding(trace, options),
            plain=True,
        )
    modulated = isinstance(result, dict)
    measured = (
        result if isinstance(result, dict) else {**_sliding_record(result, name), "note": note}
    )
    recipes = _recipes(name, argument["source"], options, modulated=modulated)
    return {"measured": measured, **recipes}


def _modulated(trace: Any, options: Options, name: str) -> dict[str, Any]:
    from asperity.measurement.campaign import modulated_rows
    from asperity.measurement.measure import measure as measured
    from asperity.measurement.measure import measure_amplitudes
    from asperity.measurement.record import mean_cycle, modulated_record, residual_spectrum
    from asperity.units import to_si

    frequency = options.frequency
    lock_in: dict[str, Any] = {
        "frequency": None if not frequency else float(to_si(frequency, "frequency", "frequency")),
        "harmonics": options.harmonics,
        "detrend": options.detrend,
        "only_whole_periods": options.whole_periods,
        "refine": not options.exact_frequency,
    }
    if options.exact_frequency and not frequency:
        raise InputError("frequency must be given to be taken as exact, got none; give it")
    window = None if options.window is None else (options.window[0], options.window[1])
    measurement = measured(trace, window=window, **lock_in)
    several = window is None and sum(part.modulated for part in measurement.stretches) > 1
    parts = measure_amplitudes(trace, **lock_in) if several else [measurement]
    samples, reading = measurement.samples, measurement.reading
    cycle = mean_cycle(measurement)
    frequencies, amplitudes = residual_spectrum(measurement)
    return {
        "record": modulated_record(measurement),
        "rows": modulated_rows(Path(name), parts),
        "curves": {
            "load": extremes(samples.time, samples.load / reading.W0, _BLOCKS),
            "force": extremes(samples.time, samples.force / reading.W0, _BLOCKS),
            "cycle": cycle._asdict(),
            "spectrum": extremes(frequencies, amplitudes, _BLOCKS),
        },
    }


def _sliding(trace: Any, options: Options) -> SlidingMeasurement:
    from asperity.measurement.sliding.measure import measure_sliding

    window = None if options.window is None else (options.window[0], options.window[1])
    holds = None if options.holds is None else [(a, b) for a, b in options.holds]
    return measure_sliding(
        trace, window=window, detrend=options.detrend, steps=options.steps, holds=holds
    )


def _sliding_record(measurement: SlidingMeasurement, name: str) -> dict[str, Any]:
    from asperity.measurement.campaign import sliding_rows
    from asperity.measurement.record import sliding_record

    return {
        "record": sliding_record(measurement),
        "rows": sliding_rows(Path(name), measurement),
        "curves": {"friction": extremes(measurement.time, measurement.values, _BLOCKS)},
    }


def _table_in(path: Path, name: str) -> dict[str, Any] | None:
    """The text of a lock-in table; None for any other file."""
    if path.stat().st_size > LARGEST_TABLE:
        return None
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (UnicodeDecodeError, ValueError):
        return None
    if text.lstrip().startswith("{"):
        try:
            mode = json.loads(text).get("mode")
        except (ValueError, RecursionError, AttributeError):
            return None
        return {"name": name, "text": text, "json": True} if mode == "modulated" else None
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        return None
    delimiter = max((",", ";", "\t"), key=lines[0].count)
    head = [cell.strip() for cell in lines[0].split(delimiter)]
    if "epsilon" not in head or not set(OUTPUTS) & set(head):
        return None
    rows = list(csv.reader(lines[1 : _MOST_LISTED + 1], delimiter=delimiter))
    return {
        "name": name, "text": text, "json": False,
        "header": head, "rows": rows, "count": len(lines) - 1,
    }  # fmt: skip


# --- Recipes -------------------------------------------------------------------------------------


def _read_python(name: str, source: Mapping[str, Any]) -> str:
    given = {k: v for k, v in source.items() if v and k != "area"}
    arguments = "".join(f", {k}={v!r}" for k, v in given.items())
    return f"trace = asp.read({name!r}{arguments})"


def _recipes(
    name: str, source: Mapping[str, Any], options: Options, *, modulated: bool
) -> dict[str, str]:
    """The same measurement as Python and as a command."""
    changed = options.model_dump(exclude_defaults=True)
    lines = ["import asperity as asp", "", _read_python(name, source)]
    if source.get("area"):
        lines.insert(1, "from asperity.recording.conversions import stress_to_force")
        lines.append(f"trace = stress_to_force(trace, {source['area']!r})")
    words = {"whole_periods": "only_whole_periods"}
    given = {words.get(k, k): v for k, v in changed.items() if k not in ("mode", "exact_frequency")}
    if not modulated:
        given["modulated"] = False
    if options.exact_frequency:
        given["refine"] = False
    arguments = "".join(f", {k}={v!r}" for k, v in given.items())
    lines += [f"measurement = asp.measure(trace{arguments})", "print(measurement)"]
    return {
        "python": "\n".join(lines) + "\n",
        "command": _command(name, source, options, modulated=modulated),
    }


def _command(name: str, source: Mapping[str, Any], options: Options, *, modulated: bool) -> str:
    parts = ["asperity measure", shlex.quote(name), *source_options(source)]
    if not modulated:
        parts.append("--no-modulation")
    elif options.frequency:
        parts.append(f"--frequency {shlex.quote(options.frequency)}")
        parts += ["--exact-frequency"] * options.exact_frequency
    if modulated and options.harmonics != 4:
        parts.append(f"--harmonics {options.harmonics}")
    if options.window is not None:
        parts.append(f"--window {options.window[0]:g}:{options.window[1]:g}")
    if modulated and options.whole_periods:
        parts.append("--whole-periods")
    if options.detrend != "linear":
        parts.append(f"--detrend {options.detrend}")
    if options.steps and not modulated:
        parts.append("--steps " + ",".join(f"{t:g}" for t in options.steps))
    if options.holds and not modulated:
        parts.append("--holds " + ",".join(f"{a:g}:{b:g}" for a, b in options.holds))
    return " ".join(parts)


def source_options(source: Mapping[str, Any]) -> list[str]:
    """How a file is read, as options of a command."""
    own = {"W": "--load", "F": "--force", "time": "--time"}
    parts: list[str] = []
    for role, column in source["columns"].items():
        given = [own[role], str(column)] if role in own else ["--column", f"{role}={column}"]
        parts += [given[0], shlex.quote(given[1])]
    parts += [f"--unit {shlex.quote(f'{n}={u}')}" for n, u in source["units"].items()]
    parts += [f"--channel {shlex.quote(f'{n} = {e}')}" for n, e in source["channels"].items()]
    for option in ("rate", "group", "delimiter", "decimal", "area"):
        if source.get(option):
            parts.append(f"--{option} {shlex.quote(source[option])}")
    return parts
