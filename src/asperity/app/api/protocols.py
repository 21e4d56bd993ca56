"""Protocols of the page: checked with the line of each mistake, run, and recorded.

A protocol of the page cannot name a file: neither a law, nor a material, nor a recording that a
step follows.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError, closest, require
from asperity.laws import registered
from asperity.materials.material import packaged
from asperity.outputs import size_text
from asperity.parameters.toml_file import SyntaxMistakeError, parsed_toml
from asperity.protocol import (
    Protocol,
    ProtocolError,
    outline,
    record_run,
    run_protocol,
    write_csv,
)

#: Rows of a motion (bytes in its file).
_LARGEST_MOTION = 256 * 1024**2
#: Stretches of time that are shown.
_SHOWN = 700

Mistake = dict[str, Any]


def checked(text: str) -> tuple[Protocol | None, list[Mistake]]:
    """The protocol, or its mistakes: ``sentence`` and ``line``, counted from 1, or None."""
    try:
        content = parsed_toml(text, "protocol")
    except InputError as error:
        line = error.line if isinstance(error, SyntaxMistakeError) else None
        return None, [{"sentence": str(error), "line": line}]
    errors: Sequence[InputError] = list(_files_named(content))
    if not errors:
        try:
            protocol = Protocol.of_content(content)
            _ = protocol.rows  # raises for an invalid table of the solver
            return protocol, []
        except ProtocolError as error:
            errors = error.errors
        except InputError as error:
            errors = [error]
    lines = _lines(text, content)
    return None, [{"sentence": str(e), "line": _line_of(e, lines, text)} for e in errors]


def check(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Mistakes of a protocol with their lines, or its duration, rows and steps."""
    report()
    protocol, mistakes = checked(argument["text"])
    if protocol is None:
        return {"mistakes": mistakes}
    return {
        "mistakes": [],
        "duration": protocol.programme.duration,
        "rows": protocol.rows,
        "steps": len(protocol.lines),
        "records": protocol.setup is not None,
    }


def run(argument: Mapping[str, Any], report: Callable[..., None]) -> dict[str, Any]:
    """Run a protocol, record it, and outline the motion.

    Parameters
    ----------
    argument : mapping
        ``text``, and ``path``, ``id`` and ``name`` of the recording, which becomes a file like an
        uploaded one: what the tribometer records, or the motion itself where there is none.
    report : callable
        Called with ``reached`` and ``duration`` (s).
    """
    from asperity.recording.writers import write

    out = Path(argument["path"])
    report(stage="checking")
    protocol, mistakes = checked(argument["text"])
    if protocol is None:
        raise InputError(mistakes[0]["sentence"])
    size = (protocol.rows or 0) * protocol.row_bytes
    rule = f"leave at most {size_text(_LARGEST_MOTION)} of motion for the page"
    advice = "lower it, shorten the steps, or use asperity run"
    require(size <= _LARGEST_MOTION, "solver.sampling", rule, size_text(size), advice)
    with tempfile.TemporaryDirectory(prefix="asperity-page-") as folder:
        motion = Path(folder) / "motion.nc"

        def on_progress(reached: float, end: float) -> None:
            report(reached=float(reached), duration=float(end))

        done = run_protocol(protocol, motion, progress=on_progress)
        shown = outline(motion, _SHOWN)
        if protocol.setup is None:
            write_csv(motion, out)
        else:
            write(record_run(protocol.setup, motion), out)
    time = np.repeat(shown.time, 2)
    return {
        "id": argument["id"],
        "name": argument["name"],
        "stopped": done.stopped,
        "stability": done.unstable_start,
        "rows": done.rows,
        "events": shown.events[:500],
        "curves": {
            name: {"x": time, "y": np.stack([shown.low[name], shown.high[name]], axis=1).ravel()}
            for name in ("load", "force", "velocity")
        },
    }


def _files_named(content: dict[str, Any]) -> Iterator[InputError]:
    """Mistakes about fields and steps that would read a file of this machine."""
    if "folder" in content:
        yield InputError("folder", "be left out on the page", "one", "write the steps out")
    for field, known in (("law", registered()), ("material", packaged())):
        name = content.get(field)
        if isinstance(name, str) and name and name not in known:
            got = repr(name[:80])
            yield InputError(field, f"be one of {', '.join(known)}", got, closest(name, known))
    for place, step in _steps(content.get("steps"), "step "):
        if "follow" in step.lower():
            advice = "use asperity run for steps that follow a recording"
            yield InputError(place, "name no file on the page", repr(step[:80]), advice)


def _steps(steps: Any, prefix: str) -> Iterator[tuple[str, str]]:
    """Places and texts of all lines, in their order."""
    if not isinstance(steps, Sequence) or isinstance(steps, str):
        return
    for number, step in enumerate(steps, start=1):
        if isinstance(step, str):
            yield f"{prefix}{number}", step
        elif isinstance(step, dict):
            yield from _steps(step.get("steps"), f"{prefix}{number}.")


def _lines(text: str, content: dict[str, Any]) -> dict[str, int]:
    """Line of each step and field by its place, such as "step 3.1" and "solver.sampling"."""
    result: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        plain = line.strip()
        if head := re.match(r"\[+\s*([^\]]+?)\s*\]+", plain):
            table = head[1].replace('"', "").replace("'", "")
            result.setdefault(table, number)
        elif field := re.match(r"""["']?([\w ]+?)["']?\s*=""", plain):
            result.setdefault(f"{table}.{field[1]}" if table else field[1], number)
    at = max(text.find("steps"), 0)
    for place, step in _steps(content.get("steps"), "step "):
        there = text.find(step, at)
        if there < 0:  # written with escapes
            continue
        at = there + len(step)
        result[place] = text.count("\n", 0, there) + 1
    return result


def _line_of(error: InputError, lines: dict[str, int], text: str) -> int | None:
    """The line of the field of a mistake, else of its value."""
    place = error.field.name
    while place:
        if place in lines:
            return lines[place]
        place = place.rpartition(".")[0]
    there = text.find(error.got.strip("'")) if error.got else -1
    return text.count("\n", 0, there) + 1 if there >= 0 else None
