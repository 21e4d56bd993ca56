"""Dates and times of day, as recording programs write them, as elapsed seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

#: Orders of day and month, each with both clocks.
_DATES = ("%d.%m.%Y", "%m/%d/%Y", "%d/%m/%Y", "%d-%m-%Y", "%d.%m.%y", "%m/%d/%y", "%d/%m/%y")
_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%I:%M:%S.%f %p", "%I:%M:%S %p")
_MINUTES = r"\d{1,3}:\d{2}(?:\.\d+)?"
_HOURS = r"(?:\d{1,4} days? )?[+-]?\d{1,6}:\d{1,2}:\d{1,2}(?:\.\d+)?"
_DAY = 86400.0


def elapsed(raw: NDArray[Any]) -> tuple[NDArray[np.float64], str] | None:
    """Seconds since the first stamp, and that stamp; None if these are no stamps.

    ISO 8601, days before or behind months, hours:minutes:seconds, which go on beyond midnight, and
    minutes:seconds. Where day and month can be exchanged, the shorter recording is meant.

    Parameters
    ----------
    raw : array of str, (n,)
    """
    import pandas as pd

    texts = pd.Series(raw).astype("string").str.strip().str.replace(",", ".", regex=False)
    # Stamps with and without a time zone agree in nothing but universal time.
    stamps = pd.to_datetime(texts, errors="coerce", format="ISO8601", utc=True)
    stamps = stamps.dt.tz_localize(None)
    if stamps.isna().all():
        stamps = _by_order(texts)
    if stamps is not None:
        origin = stamps[stamps.first_valid_index()]
        return _seconds(stamps - origin), str(origin)
    short = texts.str.fullmatch(_MINUTES).fillna(False).astype(bool)
    clock = texts.where(~short, "0:" + texts)
    # Words such as "5 S" would be durations of pandas' own.
    clock = clock.where(clock.str.fullmatch(_HOURS).fillna(False).astype(bool))
    times = pd.to_timedelta(clock, errors="coerce")
    if times.isna().all():
        return None
    origin = times[times.first_valid_index()]
    seconds = _seconds(times - origin)
    # A time of day falls by a day at midnight; a wrong stamp falls by less.
    steps = np.diff(seconds, prepend=seconds[:1])
    return seconds + _DAY * np.cumsum(steps < -_DAY / 2), str(origin)


def _by_order(texts: pd.Series[str]) -> pd.Series[Any] | None:
    """Stamps by the order of day and month that makes the recording shortest."""
    import pandas as pd

    first = texts[texts.first_valid_index()] if texts.notna().any() else ""
    best = None
    for date in _DATES:
        for clock in _CLOCKS:
            form = f"{date} {clock}"
            if pd.isna(pd.to_datetime(first, errors="coerce", format=form)):
                continue
            stamps = pd.to_datetime(texts, errors="coerce", format=form)
            length = stamps.max() - stamps.min()
            if best is None or length < best[0]:
                best = (length, stamps)
    return best[1] if best else None


def _seconds(times: pd.Series[Any]) -> NDArray[np.float64]:
    return np.asarray(times.dt.total_seconds().to_numpy(dtype=np.float64))
