"""The time axis of a recording: from a column, from a rate, or from the header of the file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, listed
from asperity.parameters.arguments import number
from asperity.recording.finding import Finding
from asperity.recording.readers.units import Unit, in_si
from asperity.recording.roles import candidates, words

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

    from asperity.recording.readers.raw import RawRecording

#: Orders of day and month, each with both clocks.
_DATES = (
    *("%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%d-%m-%Y", "%Y-%m-%d", "%Y/%m/%d"),
    *("%d.%m.%y", "%m/%d/%y", "%d/%m/%y"),
)
_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
_DATE = re.compile(r"\d{1,4}([-/.])\d{1,2}\1\d{1,4}")
_MINUTES = r"\d{1,3}:\d{2}(?:\.\d+)?"
_HOURS = r"(?:\d{1,4} days? )?[+-]?\d{1,6}:\d{1,2}:\d{1,2}(?:\.\d+)?"
_DAY = 86400.0


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
        The column that became time.
    findings : list of Finding
        Assumptions about the clock.
    dates : str or None
        The column of dates that belong to its times of day.
    """

    time: Float
    source: str
    column: str | None = None
    findings: list[Finding] = field(default_factory=list)
    dates: str | None = None


def time_axis(
    values: Mapping[str, NDArray[Any]],
    units: Mapping[str, Unit],
    roles: Mapping[str, str],
    rate: float | str | None,
    recorded: RawRecording,
) -> Clock:
    """Time from the user's choice, a column named like time, the interval, or a column of dates.

    Raises
    ------
    InputError
        If no column, or more than one, can be time.
    """
    rows = next(iter(values.values())).size
    if rate is not None:
        hertz = number(rate, "read.rate", "frequency", "positive")
        return Clock(np.asarray(np.arange(rows) / hertz), f"rate of {hertz:.10g} Hz, as asked")
    if "time" in roles:
        return _from_column(roles["time"], values, units)
    kinds = {name: units[name].kind if name in units else None for name in values}
    exact = [n for n in candidates("time", kinds) if "".join(words(n)) in ("time", "t")]
    fitting = exact if len(exact) == 1 else candidates("time", kinds)
    if len(fitting) > 1:
        got = f"{' and '.join(map(repr, fitting))}, which both can be it"
        advice = f"choose one, like {Argument('columns', 'time', fitting[0])}"
        raise InputError(Argument("columns", "time"), "be chosen", got, advice)
    if fitting:
        return _from_column(fitting[0], values, units)
    if recorded.step is not None:
        time = np.asarray(recorded.start + np.arange(rows) * recorded.step)
        return Clock(time, f"interval of {recorded.step:.10g} s in the file")
    for name, raw in values.items():
        if raw.dtype.kind not in "iufb" and _elapsed(raw[:1]) is not None:
            return _from_dates(name, values)
    return _from_first_column(values, units, recorded)


def _from_first_column(
    values: Mapping[str, NDArray[Any]], units: Mapping[str, Unit], recorded: RawRecording
) -> Clock:
    """Without headings a rising first column is time; a finding reports this assumption."""
    first = next(iter(values))
    bare = not any(c.label for c in recorded.columns)
    numbers = values[first]
    rises = numbers.dtype.kind in "iuf" and numbers.size > 1 and bool(np.all(np.diff(numbers) > 0))
    if not (bare and rises and len(values) > 1):
        got = f"none among {listed(map(repr, values))} that is named like time"
        advice = (
            f"give the sampling rate, like {Argument('rate', value='10 kHz')}, or, if one of them "
            f"is time, its name with {Argument('columns', 'time', '...')}"
        )
        raise InputError(Argument("columns", "time"), "be a column", got, advice)
    clock = _from_column(first, values, units)
    text = (
        "The file names no columns; the first, which only rises, was taken for time; say "
        f"{Argument('columns', 'time', '0')} to confirm, and name the units."
    )
    assumed = Finding("no header", "warning", len(values), first, text)
    return Clock(clock.time, clock.source, first, [assumed, *clock.findings])


def _from_column(name: str, values: Mapping[str, NDArray[Any]], units: Mapping[str, Unit]) -> Clock:
    raw = values[name]
    if raw.dtype.kind not in "iufb":
        return _from_dates(name, values)
    unit = units.get(name)
    findings = []
    if unit is None:
        text = (
            f"The file states no unit of '{name}' that is known; seconds were assumed, until "
            f"{Argument('units', name, '...')} says otherwise."
        )
        findings.append(Finding("unknown unit", "warning", 1.0, name, text))
    return Clock(in_si(raw, unit), f"column '{name}'", name, findings)


def _from_dates(name: str, values: Mapping[str, NDArray[Any]]) -> Clock:
    """Seconds since the first stamp, of dates, or of times of day with or without their dates."""
    raw = values[name]
    for other, dates in values.items():
        if "elapsed" in words(name) or dates.dtype.kind in "iufb" or not _are_dates(dates):
            continue
        of_days = _elapsed(np.array([f"{d} {t}" for d, t in zip(dates, raw, strict=True)]))
        if of_days is not None and np.isfinite(of_days[0]).all():
            # One date in all rows is that of the beginning.
            one = bool(np.all(dates == dates[0]))
            time = _across_midnights(of_days[0]) if one else of_days[0]
            source = f"columns '{other}' and '{name}', since {of_days[1]}"
            return Clock(time, source, name, dates=other)
    stamps = _elapsed(raw)
    if stamps is None:
        rule = "hold numbers, dates or hours:minutes:seconds"
        advice = f"choose another column, or give {Argument('rate', value='10 kHz')}"
        raise InputError(Argument("columns", "time"), rule, f"'{raw[0]}' in '{name}'", advice)
    return Clock(stamps[0], f"column '{name}', since {stamps[1]}", name)


def _are_dates(raw: NDArray[Any]) -> bool:
    """Whether texts are dates without times."""
    return all(isinstance(text, str) and _DATE.fullmatch(text.strip()) for text in raw)


def _elapsed(raw: NDArray[Any]) -> tuple[Float, str] | None:
    """Seconds since the first time stamp, and this stamp; None if the texts are no time stamps.

    Formats are ISO 8601, dates with the day before or after the month, minutes:seconds, and
    hours:minutes:seconds, also across midnight. If day and month can be exchanged, the order that
    fits more of the stamps is used, and of equal ones that which makes the recording shorter.

    Parameters
    ----------
    raw : array of str, (n,)
    """
    import pandas as pd

    texts = pd.Series(raw).astype("string").str.strip().str.replace(",", ".", regex=False)
    # Stamps with and without a time zone are compared in universal time.
    stamps = pd.to_datetime(texts, errors="coerce", format="ISO8601", utc=True)
    stamps = stamps.dt.tz_localize(None)
    if stamps.isna().all():
        stamps = _by_order(texts)
    if stamps is not None:
        origin = stamps[stamps.first_valid_index()]
        return _seconds(stamps - origin), str(origin)
    short = texts.str.fullmatch(_MINUTES).fillna(False).astype(bool)
    clock = texts.where(~short, "0:" + texts)
    # pandas would read words such as "5 S" as durations.
    clock = clock.where(clock.str.fullmatch(_HOURS).fillna(False).astype(bool))
    times = pd.to_timedelta(clock, errors="coerce")
    if times.isna().all():
        return None
    origin = times[times.first_valid_index()]
    return _across_midnights(_seconds(times - origin)), str(origin)


def _across_midnights(seconds: Float) -> Float:
    """Times of day as rising times: they fall by a day at midnight; a wrong stamp falls by less."""
    steps = np.diff(seconds, prepend=seconds[:1])
    return seconds + _DAY * np.cumsum(steps < -_DAY / 2)


def _by_order(texts: pd.Series[str]) -> pd.Series[Any] | None:
    """Stamps by the order of day and month that fits most of them, in the shortest recording."""
    import pandas as pd

    first = texts[texts.first_valid_index()] if texts.notna().any() else ""
    best = None
    for date in _DATES:
        for clock in _CLOCKS:
            form = f"{date} {clock}"
            if pd.isna(pd.to_datetime(first, errors="coerce", format=form)):
                continue
            stamps = pd.to_datetime(texts, errors="coerce", format=form)
            # An order that does not fit has no times after the twelfth day of a month.
            rank = (-stamps.count(), stamps.max() - stamps.min())
            if best is None or rank < best[0]:
                best = (rank, stamps)
    return best[1] if best else None


def _seconds(times: pd.Series[Any]) -> Float:
    return np.asarray(times.dt.total_seconds().to_numpy(dtype=np.float64))
