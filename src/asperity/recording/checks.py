"""Is a recording whole? Sampling, missing values, saturation: looked at, and never repaired."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from asperity.recording.finding import Finding
from asperity.recording.sampling import check_sampling, even_rate
from asperity.recording.saturation import check_saturation
from asperity.recording.spikes import check_spikes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from asperity.recording.trace import Trace

__all__ = ["CHECKED", "check", "even_rate"]

#: Names of the findings that `check` can make; a reader makes others.
CHECKED = frozenset(
    {
        "backward time",
        "constant",
        "gap",
        "infinite",
        "nan",
        "repeated time",
        "rounded time",
        "saturation",
        "spike",
        "uneven sampling",
    }
)


def check(trace: Trace) -> tuple[Finding, ...]:
    """Look for everything that can make a reading of `trace` wrong.

    Parameters
    ----------
    trace : Trace
        Any recording; it stays as it is.

    Returns
    -------
    tuple of Finding
        ``"backward time"``, ``"repeated time"``, ``"rounded time"``, ``"gap"``,
        ``"uneven sampling"``, ``"nan"``, ``"infinite"``, ``"constant"``, ``"spike"`` and
        ``"saturation"``; at most one of a name for time and for each channel. Empty when nothing
        was found.

    Notes
    -----
    A gap is a step of time longer than 1.5 times the median of the 24 steps before it, and of
    those after it, and outside their scatter: a change of the sampling rate is uneven, and no gap.
    Saturation is a crowd of samples at exactly the largest or smallest value. A spike stands out of
    the samples on both sides of it by ten usual differences, for three samples at most.
    """
    # Sums and differences of a damaged file may overflow, which is no news here.
    with np.errstate(over="ignore", invalid="ignore"):
        found = [*_missing(trace.time, trace.time, "time"), *check_sampling(trace.time)]
        for name, channel in trace.channels.items():
            found += _missing(channel.values, trace.time, name)
            found += check_saturation(channel.values, trace.time, name)
            found += check_spikes(channel.values, trace.time, name)
    return tuple(found)


def _missing(values: NDArray[np.float64], time: NDArray[np.float64], name: str) -> list[Finding]:
    # A sum is finite when all terms are, and costs one pass without a copy; when it is not, look.
    if np.isfinite(values.sum()):
        return []
    found = []
    for slug, bad in (("nan", np.isnan(values)), ("infinite", np.isinf(values))):
        count = int(bad.sum())
        if not count:
            continue
        first = int(np.argmax(bad))
        what = "not a number" if slug == "nan" else "infinite"
        found.append(
            Finding(
                slug,
                "error" if count == values.size or name == "time" else "warning",
                count,
                f"{name}, row {first}, t = {time[first]:.10g} s",
                f"{count} of {values.size} values of '{name}' are {what}, the first in row "
                f"{first}.",
            )
        )
    return found
