"""Times and spans of time as options give them: in the option itself, or in a file."""

from __future__ import annotations

import math
import re
from pathlib import Path

from asperity.errors import InputError


def span_of(text: str, option: str) -> tuple[float, float]:
    """Seconds of a START:END text, with or without their unit; an open end is infinite."""
    start, colon, end = (part.strip() for part in text.partition(":"))
    if not colon:
        raise InputError(f"{option} must be START:END, got '{text}'; write it like {option} 10:60")
    return (
        _seconds(start, option) if start else -math.inf,
        _seconds(end, option) if end else math.inf,
    )


def times_of(text: str, option: str) -> list[float]:
    """Seconds of a list like ``12.5,60``, or of a file with one time a line.

    Raises
    ------
    InputError
        If a part is no time, or there is none.
    """
    times = [_seconds(part, option) for part in _parts(text, option)]
    return sorted(times)


def spans_of(text: str, option: str) -> list[tuple[float, float]]:
    """Seconds of a list like ``100:110,200:300``, or of a file with one span a line."""
    spans = [span_of(part, option) for part in _parts(text, option)]
    if not all(math.isfinite(edge) for span in spans for edge in span):
        raise InputError(f"{option} must have a start and an end, got '{text}'; write both")
    return sorted(spans)


def _parts(text: str, option: str) -> list[str]:
    path = Path(text)
    if not re.fullmatch(r"[-+.\d\s,:;eE\w]*", text) or path.is_file():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError):
            raise InputError(
                f"{option} must be times or a file that can be read, got '{text}'; check the name"
            ) from None
        # Two columns are a span.
        parts = [re.sub(r"[\s,;]+", ":", line.split("#")[0].strip()) for line in lines]
    else:
        parts = re.split(r"[,;]", text)
    found = [part.strip() for part in parts if part.strip()]
    if not found:
        raise InputError(
            f"{option} must hold times, got '{text}'; write them like {option} 12.5,60"
        )
    return found


def _seconds(part: str, option: str) -> float:
    from asperity.units import to_si

    return to_si(part if part[-1:].isalpha() else f"{part} s", "time", option)
