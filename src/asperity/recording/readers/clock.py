"""The time axis of a recording: from a column, from a rate, or from the header of the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError, listed
from asperity.recording.finding import Finding
from asperity.recording.readers.dates import elapsed
from asperity.recording.roles import candidates, words
from asperity.units import to_si

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from asperity.recording.readers.raw import RawRecording
    from asperity.recording.readers.units import Unit


@dataclass(frozen=True, eq=False)
class Clock:
    """Times, and where they come from.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds.
    source : str
        For the provenance.
    column : str or None
        The column that was used up for it.
    findings : list of Finding
        Assumptions that had to be made.
    """

    time: NDArray[np.float64]
    source: str
    column: str | None = None
    findings: list[Finding] = field(default_factory=list)


def settle_time(
    values: Mapping[str, NDArray[Any]],
    units: Mapping[str, Unit],
    roles: Mapping[str, str],
    rate: float | str | None,
    recorded: RawRecording,
) -> Clock:
    """Time by the user's word, else by a column of that name, else by the file's own interval.

    Raises
    ------
    InputError
        If no column, or more than one, can be time.
    """
    rows = next(iter(values.values())).size
    if rate is not None:
        hertz = to_si(rate, "frequency", "read.rate")
        if hertz <= 0:
            raise InputError(
                f"read.rate must be positive, got {hertz:g} Hz; give a rate like '10 kHz'"
            )
        return Clock(np.asarray(np.arange(rows) / hertz), f"rate of {hertz:.10g} Hz, as asked")
    if "time" in roles:
        return _from_column(roles["time"], values, units)
    kinds = {name: units[name].kind if name in units else None for name in values}
    exact = [n for n in candidates("time", kinds) if "".join(words(n)) in ("time", "t")]
    found = exact if len(exact) == 1 else candidates("time", kinds)
    if len(found) > 1:
        raise InputError(
            f"columns['time'] must be chosen, got {' and '.join(map(repr, found))}, which both "
            f"can be it; choose one, like columns={{'time': '{found[0]}'}}"
        )
    if found:
        return _from_column(found[0], values, units)
    if recorded.step is not None:
        time = np.asarray(recorded.start + np.arange(rows) * recorded.step)
        return Clock(time, f"interval of {recorded.step:.10g} s in the file")
    return _from_first_column(values, units, recorded)


def _from_first_column(
    values: Mapping[str, NDArray[Any]], units: Mapping[str, Unit], recorded: RawRecording
) -> Clock:
    """Without any heading, a first column that only rises is time; the finding says so."""
    first = next(iter(values))
    bare = not any(c.label for c in recorded.columns)
    numbers = values[first]
    rises = numbers.dtype.kind in "iuf" and numbers.size > 1 and bool(np.all(np.diff(numbers) > 0))
    if not (bare and rises and len(values) > 1):
        raise InputError(
            f"columns['time'] must be a column, got none among {listed(map(repr, values))} that "
            "is named like time; say which it is, like columns={'time': "
            f"'{first}'}}, or give the sampling rate, like rate='10 kHz'"
        )
    clock = _from_column(first, values, units)
    said = Finding(
        "no header",
        "warning",
        len(values),
        first,
        "The file names no columns; the first, which only rises, was taken for time; say "
        "columns={'time': 0} to confirm, and name the units.",
    )
    return Clock(clock.time, clock.source, first, [said, *clock.findings])


def _from_column(name: str, values: Mapping[str, NDArray[Any]], units: Mapping[str, Unit]) -> Clock:
    raw = values[name]
    if raw.dtype.kind not in "iufb":
        return _from_dates(name, raw)
    unit = units.get(name)
    if unit is None:
        said = Finding(
            "unknown unit",
            "warning",
            1.0,
            name,
            f"The file states no unit of '{name}' that is known; seconds were assumed, until "
            f"units={{'{name}': ...}} says otherwise.",
        )
        return Clock(np.asarray(raw, dtype=np.float64), f"column '{name}'", name, [said])
    seconds = np.asarray(raw, dtype=np.float64)
    if unit.factor < 1:
        seconds = seconds / float(Decimal(1) / unit.factor)
    elif unit.factor > 1:
        seconds = seconds * float(unit.factor)
    return Clock(seconds, f"column '{name}'", name)


def _from_dates(name: str, raw: NDArray[Any]) -> Clock:
    """Seconds since the first stamp, of dates or of hours:minutes:seconds."""
    found = elapsed(raw)
    if found is None:
        raise InputError(
            f"columns['time'] must hold numbers, dates or hours:minutes:seconds, got "
            f"'{raw[0]}' in '{name}'; choose another column, or give rate='10 kHz'"
        )
    return Clock(found[0], f"column '{name}', since {found[1]}", name)
