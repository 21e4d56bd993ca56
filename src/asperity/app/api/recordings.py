"""Recordings of the page: read and measured in a separate process with limits.

A new process reads each file; it imports modules late to start quickly.
"""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import field_validator

from asperity.app.words import in_labels
from asperity.errors import InputError, naming
from asperity.outputs.sections import records
from asperity.parameters import NAMES, OUTPUTS, Names, display_name
from asperity.parameters.columns import headings, sheet
from asperity.questions import recording as questions
from asperity.questions.options import measure_options, source_options
from asperity.recording.extremes import thinned
from asperity.recording.readers.from_file import read_source
from asperity.recording.roles import ROLES, candidates

#: Address space (bytes) and processor time (s) of a process that reads a recording.
LIMITS = {"memory": 6 * 1024**3, "seconds": 240}
#: Blocks of a curve that is shown: two points each.
_BLOCKS = 700
#: Channels that are drawn, and findings and rows that are listed.
_MOST_CHANNELS, _MOST_LISTED = 24, 200
#: Largest lock-in table (bytes).
LARGEST_TABLE = 1024**2


class Source(questions.Source):
    """How an uploaded file is read.

    A reduction file is refused, because its path would be one on the server.
    """

    @field_validator("recipe")
    @classmethod
    def _left_out(cls, recipe: Path | None) -> None:
        if recipe is not None:
            raise InputError("read.recipe", "be left out on the page", "one", "leave it out")


def measure(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Read a file and measure it.

    Messages: ``recording`` with the channels as understood. The result has ``measured``, or
    ``table`` for a lock-in table.
    """
    path, name = Path(argument["path"]), argument["name"]
    symbols = partial(display_name, names=argument.get("names", NAMES[0]))
    with naming(in_labels, symbols, {path: name}):
        table = _table_in(path, name)
        if table is not None:
            return {"table": table}
        report(stage="reading")
        trace = read_source(path, Source(**argument["source"]))
        report(recording=_described(trace, name))
        return _measured(trace, argument, report)


def _described(trace: Any, name: str) -> dict[str, Any]:
    """Channels and units as understood, findings of the reader, and curves of the channels."""
    kinds = {n: c.kind for n, c in trace.channels.items()}
    roles = {role: trace.roles.get(role) for role in ROLES if role != "time"}
    fitting = {r: candidates(r, kinds) for r, n in roles.items() if n is None}
    guessed = {r: c[0] if len(c) == 1 else None for r, c in fitting.items()}
    channels = []
    for number, (channel_name, channel) in enumerate(trace.channels.items()):
        finite = channel.values[np.isfinite(channel.values)]
        some = curve = {}
        if finite.size:
            some = {"least": finite.min(), "mean": finite.mean(), "largest": finite.max()}
        if finite.size and number < _MOST_CHANNELS:
            curve = {"curve": thinned(trace.time, channel.values, 120)}
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
        "provenance": provenance,
    }  # fmt: skip


def _measured(
    trace: Any, argument: Mapping[str, Any], report: Callable[..., None]
) -> dict[str, Any]:
    from asperity.measurement.from_file import answer_measurement
    from asperity.measurement.measure import measure_amplitudes
    from asperity.measurement.report import (
        amplitude_sections,
        measured_record,
        measured_rows,
        measured_sections,
    )

    names: Names = argument.get("names", NAMES[0])

    question = questions.Measurement(**argument["options"])
    name = argument["name"]
    report(stage="measuring")
    measurement: Any
    measurement, note = answer_measurement(trace, question, plain=True)
    modulated = measurement.mode == "modulated"
    stick_slip = measurement.mode == "stick-slip"
    parts: Any = measurement
    if modulated:
        several = question.window is None and sum(p.modulated for p in measurement.stretches) > 1
        parts = measure_amplitudes(trace, question) if several else measurement
    measured: dict[str, Any] = {
        "record": measured_record(measurement),
        "rows": measured_rows(Path(name), parts),
        "curves": _curves(measurement),
        "sections": records(measured_sections(measurement, name, names)),
        "note": note,
    }
    if modulated:
        measured["amplitudes"] = records(amplitude_sections(measured["rows"], name))
    if stick_slip:
        question = question.model_copy(update={"stick_slip": True, "modulated": None})
    source = Source(**argument["source"])
    command = ["asperity measure", shlex.quote(name), *source_options(source)]
    command += measure_options(question, modulated=modulated or stick_slip)
    return {
        "measured": measured,
        "python": _python(name, source, question, modulated=modulated or stick_slip),
        "command": " ".join(command),
    }


def _curves(measurement: Any) -> dict[str, Any]:
    """Curves of a measurement of any kind."""
    from asperity.measurement.curves import mean_cycle, middle_events, residual_spectrum

    if measurement.mode == "modulated":
        samples, W0 = measurement.samples, measurement.reading.W0
        return {
            "load": thinned(samples.time, samples.load / W0, _BLOCKS),
            "force": thinned(samples.time, samples.force / W0, _BLOCKS),
            "cycle": mean_cycle(measurement)._asdict(),
            "spectrum": thinned(*residual_spectrum(measurement), _BLOCKS),
        }
    time = measurement.time
    if measurement.mode == "sliding":
        return {"friction": thinned(time, measurement.values, _BLOCKS)}
    friction = measurement.friction
    curves = {"friction": thinned(time, friction, _BLOCKS)}
    if len(measurement.events):
        _, near = middle_events(measurement)
        curves["close"] = thinned(time[near], friction[near], _BLOCKS)
    return curves


def _table_in(path: Path, name: str) -> dict[str, Any] | None:
    """The content of a lock-in table; None for any other file."""
    if path.stat().st_size > LARGEST_TABLE:
        return None
    content = path.read_bytes()
    if content.lstrip(b"\xef\xbb\xbf \r\n\t").startswith(b"{"):
        try:
            text = content.decode("utf-8-sig")
            mode = json.loads(text).get("mode")
        except (ValueError, RecursionError, AttributeError):
            return None
        return {"name": name, "text": text, "json": True} if mode == "modulated" else None
    try:
        table = sheet(path, bool, content=content)
        columns = headings(table.heading, name, {"epsilon", *OUTPUTS}.__contains__)
        rows = list(table.rows())
    except InputError:
        return None
    if not rows or "epsilon" not in columns or len(columns) < 2:
        return None
    return {
        "name": name, "text": content.decode(table.encoding), "json": False,
        "header": table.heading, "rows": rows[:_MOST_LISTED], "count": len(rows),
    }  # fmt: skip


def _python(name: str, source: Source, question: questions.Measurement, *, modulated: bool) -> str:
    """The same measurement as Python."""
    reading = "".join(f", {k}={v!r}" for k, v in source.arguments.items())
    lines = ["import asperity as asp", "", f"trace = asp.read({name!r}{reading})"]
    if any(map(math.isinf, question.window or ())):
        lines.insert(0, "from math import inf\n")
    if source.area:
        lines.insert(-2, "from asperity.recording import stress_to_force")
        lines.append(f"trace = stress_to_force(trace, {source.area!r})")
    fields = question.model_dump(exclude={"modulated", "exact_frequency"}, exclude_defaults=True)
    words = {"whole_periods": "only_whole_periods"}
    options = {words.get(k, k): v for k, v in fields.items()}
    if not modulated:
        options["modulated"] = False
    if question.exact_frequency:
        options["refine"] = False
    arguments = "".join(f", {k}={v!r}" for k, v in options.items())
    lines += [f"measurement = asp.measure(trace{arguments})", "print(measurement)"]
    return "\n".join(lines) + "\n"
