"""The samples of a recording that can be used, and those that cannot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.measurement.channels import compressive, shear_channel
from asperity.recording.checks import check, spikes
from asperity.recording.rounded_time import even_times

if TYPE_CHECKING:
    from asperity.recording.finding import Finding
    from asperity.recording.trace import Channel, Trace

Array = NDArray[np.float64]

#: A step of this many median steps is a gap.
_GAP = 1.5

#: Largest size of a value, and one over the smallest of a channel's largest: fits take squares of
#: squares of ratios, which doubles must hold.
_LARGEST = 1e30


@dataclass(frozen=True, eq=False)
class Samples:
    """Load and force where both are numbers and time goes on.

    Attributes
    ----------
    time, load, force : array, (n,)
        The load positive in compression.
    unit : str
        SI unit of load and force; empty where the file has none.
    names : (str, str)
        Of the channels.
    defects : int array
        Samples that are saturated, stand out, or follow a gap or a missing one, in rising order.
    findings : tuple of Finding
        About time and these two channels.
    dropped : int
        Samples of the recording that are not among these.
    unread : int
        Findings about channels that are not read.
    trace : Trace
        The recording of these two channels, with what cannot be used.
    """

    time: Array
    load: Array
    force: Array
    unit: str
    names: tuple[str, str]
    defects: NDArray[np.intp]
    findings: tuple[Finding, ...]
    dropped: int
    unread: int
    trace: Trace


def usable(trace: Trace, load: str, force: str) -> Samples:
    """Choose the channels of a reading, and the samples that can be read.

    Parameters
    ----------
    trace : Trace
    load, force : str
        Channels, by name or role.

    Raises
    ------
    InputError
        If a channel is not there, the two have units that cannot be divided, or nothing is left.

    Notes
    -----
    Where a friction coefficient is recorded in place of a shear force of the load's dimension, the
    force is that times the load, and is called so.
    """
    W = trace.channel(load)
    F, name = _force(trace, force, W)
    if W.kind != F.kind:
        raise InputError(
            f"measure.force must have the dimension of the load, got {_told(F)} for '{force}' and "
            f"{_told(W)} for '{load}'; name the units when reading"
        )
    names = (_name(trace, W), name)
    if names[0] == names[1]:
        raise InputError(
            f"measure.force must be another channel than the load, got '{names[0]}' for both; name "
            "the one that is the shear force"
        )
    two = replace(trace, channels={names[0]: W, names[1]: F}, findings=())
    findings = about_channels(trace, names)
    unread = len(trace.findings) - len(findings)
    findings = findings or check(two)
    turned_load, turned_force, turned = compressive(W.values, F.values)
    findings = (*findings, *turned)
    two = replace(two, findings=findings)
    time, values = even_times(trace.time), (turned_load, turned_force)
    names_found = {finding.name for finding in findings}
    keep = None
    if names_found & {"nan", "infinite", "backward time", "repeated time"}:
        keep = _kept(time, values)
        time, values = time[keep], (values[0][keep], values[1][keep])
    if time.size < 16:
        raise InputError(
            f"measure.trace must hold at least 16 usable samples, got {time.size}; give a longer "
            "recording or window"
        )
    require_computable(time=time - time[0], **dict(zip(names, values, strict=True)))
    defects = _defects(time, values, names_found, keep)
    dropped = len(trace) - time.size
    return Samples(time, *values, W.unit, names, defects, findings, dropped, unread, two)


def require_computable(**channels: Array) -> None:
    """Refuse values whose squares are too large or too small to be computed with.

    Parameters
    ----------
    **channels : array
        Finite values by the name of their channel; all of them may be zero.

    Raises
    ------
    InputError
        Which names the channel and its largest value.
    """
    for name, values in channels.items():
        largest = float(np.abs(values).max(initial=0.0))
        if largest and not 1 / _LARGEST < largest < _LARGEST:
            raise InputError(
                f"measure.trace must hold values from {1 / _LARGEST:g} to {_LARGEST:g} in size, "
                f"got {largest:.4g} as the largest of '{name}'; correct its unit, or cut damaged "
                "rows out with a window"
            )


def about_window(samples: Samples, start: float, end: float) -> list[Finding]:
    """Findings on the part of a recording that is read; those of the file stay with it."""
    if not samples.findings:
        return []
    return list(samples.trace.slice(start, np.nextafter(end, np.inf)).findings)


def _force(trace: Trace, name: str, load: Channel) -> tuple[Channel, str]:
    channel, _ = shear_channel(trace, name, load)
    recorded = _name(trace, channel)
    if channel.kind != "dimensionless" or load.kind in (None, "dimensionless"):
        return channel, recorded
    product = replace(load, values=channel.values * load.values, recorded_name=recorded)
    return product, f"{recorded} x load"


def about_channels(trace: Trace, names: tuple[str, ...]) -> tuple[Finding, ...]:
    """Findings without those on other channels; what names no channel is about the file.

    Parameters
    ----------
    trace : Trace
    names : tuple of str
        Channels that are read.
    """
    others = [name for name in trace.channels if name not in names]
    return tuple(
        f
        for f in trace.findings
        if not any(f.where == name or f.where.startswith(f"{name}, ") for name in others)
    )


def _kept(time: Array, values: tuple[Array, Array]) -> NDArray[np.bool_]:
    finite = np.isfinite(time) & np.isfinite(values[0]) & np.isfinite(values[1])
    latest = np.maximum.accumulate(np.where(finite, time, -np.inf))
    finite[1:] &= time[1:] > latest[:-1]
    return finite


def _defects(
    time: Array,
    values: tuple[Array, Array],
    names_found: set[str],
    keep: NDArray[np.bool_] | None,
) -> NDArray[np.intp]:
    found = [np.empty(0, dtype=np.intp)]
    if keep is not None:
        rows = np.flatnonzero(keep)
        found.append(np.flatnonzero(np.diff(rows) > 1) + 1)
    if "gap" in names_found:
        steps = np.diff(time)
        found.append(np.flatnonzero(steps > _GAP * np.median(steps)) + 1)
    if "spike" in names_found:
        found += [spikes(channel) for channel in values]
    if "saturation" in names_found:
        for channel in values:
            for extreme in (channel.max(), channel.min()):
                at = channel == extreme
                # A single largest value is none: saturation stands still.
                found.append(np.flatnonzero(at[1:] & at[:-1]) + 1)
    return np.unique(np.concatenate(found))


def _name(trace: Trace, channel: Channel) -> str:
    return next(name for name, c in trace.channels.items() if c is channel)


def _told(channel: Channel) -> str:
    return f"'{channel.unit}'" if channel.kind else "no known unit"
