"""The channels of load and shear of a recording, and their usable samples.

A sign that is a convention of the recorder is reversed. Gaps and defects are listed as samples that
a window avoids.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Float, Index
from asperity.errors import Argument, InputError, require
from asperity.recording.defects.check import rows_to_avoid, usable_rows
from asperity.recording.defects.sampling import even_times
from asperity.recording.defects.spikes import spikes
from asperity.recording.finding import Finding
from asperity.recording.roles import role_of
from asperity.recording.trace import Channel, Trace, check

#: Medians of F/W and of a recorded friction, and a load that is recorded and one that is stated,
#: contradict each other if they differ by more than this share. Corrections for jackets, seals and
#: changing areas are some percent; a wrong unit, column or zero is more.
CONTRADICTS = 0.1

#: Samples that a lock-in needs.
_FEWEST = 16

#: The largest value of a channel must lie between the inverse of this number and this number: fits
#: compute fourth powers of ratios, which must not overflow.
_LARGEST = 1e30


def named_channel(trace: Trace, name: str, argument: str) -> Channel:
    """The channel that an argument names, which messages name too; roles have their own."""
    try:
        return trace.channel(name)
    except InputError as error:
        raise (error if role_of(name) else error.about(f"measure.{argument}")) from None


def load_channel(trace: Trace, load: str) -> Channel | None:
    """The channel of the load; None where the user names no load and no load is recorded.

    Parameters
    ----------
    trace : Trace
    load : str
        Channel, by name or role.

    Raises
    ------
    InputError
        If the recording lacks the load that the user names.
    """
    named = load != "W" or "W" in trace.roles
    return named_channel(trace, load, "load") if named or trace.has(load) else None


def shear_channel(trace: Trace, force: str, load: Channel | None) -> tuple[Channel, bool]:
    """The shear force, or the recorded friction coefficient where F/W cannot be computed.

    A channel that the user has named comes first, the force before the friction. Otherwise a shear
    force (or stress) is used if the load has the same dimension, and the friction if not.

    Parameters
    ----------
    trace : Trace
    force : str
        Channel, by name or role.
    load : Channel or None

    Returns
    -------
    (Channel, bool)
        The channel, and whether it is a friction coefficient.

    Raises
    ------
    InputError
        If neither is recorded, or several channels can be meant.
    """
    if force != "F" or "F" in trace.roles:
        shear = named_channel(trace, force, "force")
        return shear, shear.kind == "dimensionless"
    friction = _friction(trace)
    if "friction" in trace.roles and friction is not None:
        return friction, True
    if friction is not None and not trace.has("F"):
        return friction, True
    shear = trace.channel("F")
    ratio = shear.kind == "dimensionless"
    if ratio or friction is None or (load is not None and load.kind == shear.kind):
        return shear, ratio
    return friction, True


def require_one_dimension(W: Channel, F: Channel, load: str, force: str) -> None:
    """Refuse a load and a shear that cannot be divided.

    Parameters
    ----------
    W, F : Channel
    load, force : str
        Names or roles of the two channels.

    Raises
    ------
    InputError
        If one is a force and the other a stress, or a unit is not known.
    """
    if W.kind == F.kind:
        return
    unit = " and ".join(
        str(Argument("units", side.recorded_name, other.unit if other.kind else "N"))
        for side, other in ((F, W), (W, F))
        if side.kind is None
    )
    advice = f"give the unit when reading, like {unit}" if unit else "name the units when reading"
    if {W.kind, F.kind} == {"force", "pressure"}:
        area = Argument("read.area", value="25 cm^2")
        advice = f"give the area that makes the stress a force, like {area}"
    got = f"{_dimension_text(F, force)} and {_dimension_text(W, load)}"
    raise InputError("measure.force", "have the dimension of the load", got, advice)


def refuse_contradiction(trace: Trace, force: str, shear: Channel, friction: Float) -> None:
    """Refuse a recorded friction that is not F/W, unless the user has named one of the two.

    Parameters
    ----------
    trace : Trace
    force : str
        Channel, by name or role.
    shear : Channel
        The force in F/W.
    friction : array, (n,)
        F/W; NaN where undefined.

    Raises
    ------
    InputError
        If the two contradict each other.
    """
    recorded = _friction(trace)
    named = force != "F" or {"F", "friction"} & set(trace.roles)
    if named or recorded is None or recorded is shear:
        return
    both = np.isfinite(friction) & np.isfinite(recorded.values)
    if not both.any():
        return
    made, written = (float(np.median(values[both])) for values in (friction, recorded.values))
    # The sign of a shear is a convention of the recorder.
    if abs(abs(made) - abs(written)) <= CONTRADICTS * abs(written):
        return
    one, other = (trace.name_of(used) for used in (shear, recorded))
    got = f"{made:.4g} for the median of F/W with '{one}' and {written:.4g} for that of '{other}'"
    like = f"{Argument('columns', 'F', one)} or {Argument('columns', 'friction', other)}"
    advice = f"choose one, like {like}, or correct the unit of the force or the load"
    raise InputError("measure.force", "agree with the recorded friction", got, advice)


def require_stated_load(stated: float | None, recorded: float, unit: str) -> None:
    """Refuse a stated W0 (N) that the recorded mean load, in newtons too, contradicts."""
    if stated is None or unit != "N":
        return
    rule, got = f"agree with the recorded load, {abs(recorded):.4g} N", f"{stated} N"
    agree = abs(stated - abs(recorded)) <= CONTRADICTS * abs(recorded)
    require(agree, "measure.normal_load", rule, got, "leave it out, or correct one of them")


def _friction(trace: Trace) -> Channel | None:
    return trace.channel("friction") if trace.has("friction") else None


def compressive(load: Float, shear: Float) -> tuple[Float, Float, list[Finding]]:
    """Load and shear with the load positive in compression.

    A negative mean load is a convention of the recorder: contacts bear no tension. If the mean
    shear is negative too, both channels follow this convention and both signs are reversed.

    Parameters
    ----------
    load, shear : array, (n,)
        As recorded.

    Returns
    -------
    (array, array, list of Finding)
        Load, shear, and a finding on reversed signs: a note if both were reversed, a warning if
        the load alone was.
    """
    if not _mean(load) < 0:
        return load, shear, []
    if _mean(shear) < 0:
        sentence = (
            "Load and shear are negative on average, as where compression counts as negative; both "
            "were read with the other sign."
        )
        return -load, -shear, [Finding("sign", "note", 2.0, "", sentence)]
    sentence = (
        "The load is negative on average and the shear is not; the load was read with the other "
        "sign, as contacts bear compression. If its zero is off, correct that instead."
    )
    return -load, shear, [Finding("sign", "warning", 1.0, "", sentence)]


def _mean(values: Float) -> float:
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore", invalid="ignore"):
        return float(finite.mean()) if finite.size else 0.0


@dataclass(frozen=True, eq=False)
class Samples:
    """Load and force in the rows in which both are finite and time increases.

    Attributes
    ----------
    time, load, force : array, (n,)
        The load positive in compression.
    unit : str
        SI unit of load and force; empty where the file has no unit.
    names : (str, str)
        Names of the two channels.
    defects : int array
        Indices of samples that are saturated, or follow a gap, a missing sample or a spike, in
        rising order.
    findings : tuple of Finding
        About time and these two channels.
    dropped : int
        Number of samples of the recording that were left out, spikes among them.
    unread : int
        Number of findings about channels that are not read.
    trace : Trace
        The recording of these two channels, with all its samples.
    """

    time: Float
    load: Float
    force: Float
    unit: str
    names: tuple[str, str]
    defects: Index
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
        If a channel is missing, the units of the two cannot be divided, or no sample is left.

    Notes
    -----
    Where a friction coefficient is recorded in place of a shear force, the force is the friction
    times the load, and its name says so.
    """
    W = named_channel(trace, load, "load")
    F, _ = shear_channel(trace, force, W)
    names = (trace.name_of(W), trace.name_of(F))
    if F.kind == "dimensionless" and W.kind != "dimensionless":
        F = replace(W, values=F.values * W.values, recorded_name=names[1])
        names = (names[0], f"{names[1]} x load")
    require_one_dimension(W, F, load, force)
    if names[0] == names[1]:
        rule, got = "be another channel than the load", f"'{names[0]}' for both"
        raise InputError("measure.force", rule, got, "name the one that is the shear force")
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
    if names_found & {"missing values", "infinite", "backward time", "repeated time", "spike"}:
        keep = usable_rows(time, values)
        for channel in values:
            keep[np.flatnonzero(keep)[spikes(channel[keep])]] = False
        time, values = time[keep], (values[0][keep], values[1][keep])
    if time.size < _FEWEST:
        recorded = {names[0]: W.values, names[1]: F.values}
        raise too_few(_FEWEST, time.size, trace.time, recorded)
    require_computable(time=time - time[0], **dict(zip(names, values, strict=True)))
    defects: Index = np.empty(0, dtype=np.intp)
    if keep is not None or names_found & {"gap", "spike", "saturation"}:
        defects = rows_to_avoid(time, values, keep)
    dropped = len(trace) - time.size
    return Samples(time, *values, W.unit, names, defects, findings, dropped, unread, two)


def too_few(fewest: int, usable: int, time: Float, columns: Mapping[str, Float]) -> InputError:
    """The error of a recording with too few usable samples; it names columns that lack numbers.

    Parameters
    ----------
    fewest, usable : int
    time : array, (n,)
    columns : mapping of str to array, (n,)
        By the names of the channels.
    """
    known = {name: int(np.isfinite(values).sum()) for name, values in columns.items()}
    known = {"time": int(np.isfinite(time).sum()), **known}
    lacking = [
        f"'{name}' holds {f'a number in {k} rows' if k else 'no number'}"
        for name, k in known.items()
        if k < time.size
    ]
    got = f"{usable} of {time.size}" + (f": {', '.join(lacking)}" if lacking else "")
    advice = ("choose another column" if lacking else "give a longer recording") + " or window"
    rule = f"hold at least {fewest} usable samples"
    return InputError("measure.trace", rule, got, advice)


def require_computable(**channels: Float) -> None:
    """Refuse values whose squares are too large or too small to be computed with.

    Parameters
    ----------
    **channels : array
        Finite values by the name of their channel; a channel may be zero throughout.

    Raises
    ------
    InputError
        If the largest value of a channel is out of range.
    """
    for name, values in channels.items():
        largest = float(np.abs(values).max(initial=0.0))
        holds = not largest or 1 / _LARGEST < largest < _LARGEST
        rule = f"hold values from {1 / _LARGEST:g} to {_LARGEST:g} in size"
        advice = "correct its unit, or cut damaged rows out with a window"
        require(holds, "measure.trace", rule, f"{largest:.4g} as the largest of '{name}'", advice)


def about_window(samples: Samples, start: float, end: float) -> list[Finding]:
    """Findings on the part of a recording that is read, and on its file."""
    if not samples.findings:
        return []
    return list(samples.trace.slice(start, np.nextafter(end, np.inf)).findings)


def about_channels(trace: Trace, names: tuple[str, ...]) -> tuple[Finding, ...]:
    """Findings on the channels that are read and on the file, without those on other channels.

    Parameters
    ----------
    trace : Trace
    names : tuple of str
        Channels that are read.
    """
    others = [name for name in trace.channels if name not in names]
    return tuple(f for f in trace.findings if not any(f.concerns(name) for name in others))


def _dimension_text(channel: Channel, name: str) -> str:
    unit = f"'{channel.unit or '1'}'" if channel.kind else "no known unit"
    return f"{unit} for '{channel.recorded_name or name}'"
