"""The signals of sliding: friction, load and slip over time, from the channels of a recording."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.measurement.samples import (
    compressive,
    load_channel,
    refuse_contradiction,
    require_computable,
    require_one_dimension,
    shear_channel,
    too_few,
)
from asperity.parameters.arguments import rising
from asperity.recording.defects.check import usable_rows
from asperity.recording.defects.sampling import even_times
from asperity.recording.expressions import trapezoids
from asperity.recording.finding import Finding
from asperity.recording.roles import candidates, words
from asperity.recording.trace import Channel, Trace

_FEWEST = 32
#: Names of a force divided by the weight, and what its unit measures if one is known.
_NORMALISED = frozenset({"fnorm", "forcenorm", "normforce", "fnormalised", "fnormalized"})
_PURE = (None, "dimensionless")
#: Names of the displacement that the machine imposes.
_LOAD_POINT = re.compile(r"\b(load ?point|lp|lpd|ram|vertical|axial|actuator)\b")


@dataclass(frozen=True, eq=False)
class SlidingSignals:
    """Samples at which friction and motion are finite and time increases.

    Attributes
    ----------
    time : array, (n,)
        Seconds.
    friction : array, (n,)
        F/W, or the recorded friction coefficient; of the sign in which most of it is positive.
    displacement : array, (n,), or None
        Metres, as recorded or as the integral of the velocity; None where neither is recorded.
    load : array, (m,), or None
        Load at the samples where it is a number, positive in compression.
    load_time : array, (m,), or None
        Seconds of these samples.
    load_unit : str
        SI unit of the load.
    motion : str
        Name of the channel of the displacement; empty without such a channel.
    no_motion : str
        Reason why there is no motion; empty if there is a motion.
    names : tuple of str
        Channels that were read.
    turned : bool
        Whether the friction was multiplied by -1.
    signs : tuple of Finding
        Load and shear that are read with the opposite sign.
    left_out : int
        Number of samples within the window with a missing value or a time that does not increase.
    """

    time: Float
    friction: Float
    displacement: Float | None
    load: Float | None
    load_time: Float | None
    load_unit: str
    motion: str
    no_motion: str
    names: tuple[str, ...]
    turned: bool
    signs: tuple[Finding, ...]
    left_out: int


def sliding_signals(
    trace: Trace, load: str, force: str, window: tuple[float, float] | None
) -> SlidingSignals:
    """Choose the channels, and the samples that can be used.

    Parameters
    ----------
    trace : Trace
    load, force : str
        Channels, by name or role.
    window : (float, float), optional
        First and last time (s).

    Raises
    ------
    InputError
        If neither force and load nor friction is recorded, or fewer than 32 samples are left.
    """
    trace = with_normalised_force(trace)
    if window is not None:
        rising(window, "measure.window")
    friction, weight, unit, read, signs = _friction(trace, load, force)
    moved, is_velocity, no_motion = _motion(trace, read)
    motion = None if moved is None else moved.values
    read = [*read, *([] if moved is None else [moved])]
    names = tuple(key for key, c in trace.channels.items() if any(c is used for used in read))
    name = "" if moved is None else moved.recorded_name or names[-1]
    time = even_times(trace.time)
    use = usable_rows(time, [friction] if motion is None else [friction, motion])
    outside = np.zeros(time.size, bool)
    if window is not None:
        outside = (time < window[0]) | (time > window[1])
        use &= ~outside
        extent = f"it runs from {time[0]:.10g} s to {time[-1]:.10g} s"
        rule, got = "lie inside the recording", f"{window[0]:g} s to {window[1]:g} s"
        require(not outside.all(), "measure.window", rule, got, extent)
    left_out = int((~use & ~outside).sum())
    if use.sum() < _FEWEST:
        used = {name: trace.channels[name].values[~outside] for name in names}
        zeros = 0 if weight is None else int((weight[~outside] == 0).sum())
        if zeros and all(np.isfinite(values).all() for values in used.values()):
            got = f"0 in {zeros} of {(~outside).sum()} samples of '{trace.name_of(read[0])}'"
            advice = "choose another column or window"
            raise InputError("measure.load", "be above zero", got, advice)
        raise too_few(_FEWEST, int(use.sum()), trace.time[~outside], used)
    known = use if weight is None else use & np.isfinite(weight)
    load_time = time[known]
    time, friction = time[use], friction[use]
    slip = None
    if motion is not None:
        slip = motion[use]
        if is_velocity:
            slip = trapezoids(slip, time)
    if weight is not None:
        weight = weight[known]
        weight = weight if weight.size else None
    optional = {"load": weight, "displacement": slip}
    present = {name: values for name, values in optional.items() if values is not None}
    require_computable(time=time - time[0], friction=friction, **present)
    turned = bool(np.median(friction) < 0)
    return SlidingSignals(
        time=time,
        friction=-friction if turned else friction,
        displacement=slip,
        load=weight,
        load_time=None if weight is None else load_time,
        load_unit=unit,
        motion=name,
        no_motion=no_motion,
        names=names,
        turned=turned,
        signs=tuple(signs),
        left_out=left_out,
    )


def with_normalised_force(trace: Trace) -> Trace:
    """The same recording, with a force that is named as F/(m g) in the role of the friction.

    Only if it is the only channel: with other channels such a name is the normal force.
    """
    if len(trace.channels) != 1 or trace.roles:
        return trace
    (name,) = trace.channels
    if "".join(words(name)) not in _NORMALISED or trace.channels[name].kind not in _PURE:
        return trace
    # The name says the unit.
    known = {name: replace(trace.channels[name], kind="dimensionless")}
    findings = tuple(f for f in trace.findings if (f.name, f.where) != ("unknown unit", name))
    return replace(trace, channels=known, roles={"friction": name}, findings=findings)


def _friction(
    trace: Trace, load: str, force: str
) -> tuple[Float, Float | None, str, list[Channel], list[Finding]]:
    """Friction, load, unit of the load, their channels, and findings on reversed signs."""
    W = load_channel(trace, load)
    F, is_friction = shear_channel(trace, force, W)
    if W is None:
        if not is_friction:
            # This raises an error that names the columns.
            trace.channel(load)
        return F.values, None, "", [F], []
    unit, read = W.unit, [W, F]
    # NaN where undefined; the caller leaves these samples out.
    with np.errstate(invalid="ignore", over="ignore"):
        if is_friction:
            borne, _, turned = compressive(W.values, F.values * W.values)
            return F.values, borne, unit, read, turned
        require_one_dimension(W, F, load, force)
        borne, shear, turned = compressive(W.values, F.values)
        known = np.isfinite(borne) & (borne != 0)
        friction = shear / np.where(known, borne, np.nan)
    refuse_contradiction(trace, force, F, friction)
    return friction, borne, unit, read, turned


def _motion(trace: Trace, read: Sequence[Channel]) -> tuple[Channel | None, bool, str]:
    """Displacement or velocity, whether it is a velocity, and the reason if there is neither.

    Of several displacements that of the load point is taken: it is what the machine imposes. A
    channel whose unit is unknown gives no velocity in m/s.
    """
    reasons = []
    for role, kind in (("displacement", "length"), ("velocity", "velocity")):
        kinds = {key: c.kind for key, c in trace.channels.items()}
        fitting = [n for n in candidates(role, kinds) if kinds[n] == kind]
        imposed = [n for n in fitting if _LOAD_POINT.search(" ".join(words(n)))]
        try:
            channel = trace.channel(role)
        except InputError:
            # Of several candidates, the only one with a known unit of that kind is taken.
            only = fitting if len(fitting) == 1 else imposed
            if len(only) == 1:
                return trace.channels[only[0]], role == "velocity", ""
            if len(fitting) > 1:
                listed = " or ".join(f"'{n}'" for n in fitting)
                reasons.append(f"the {role} can be {listed}; choose one")
            continue
        if channel.kind == kind:
            return channel, role == "velocity", ""
        name = channel.recorded_name or role
        unit = {"length": "um", "velocity": "um/s"}[kind]
        reasons.append(
            f"'{name}' has no known unit of a {kind}; give it one, like "
            f"{Argument('units', name, unit)}"
        )
    if not reasons:
        # Of an unread channel without a known unit anything may be meant.
        used = [any(c is one for one in read) for c in trace.channels.values()]
        unread = [
            name
            for (name, c), known in zip(trace.channels.items(), used, strict=True)
            if not known and c.kind in (None, "length", "velocity")
        ]
        reasons = ["neither displacement nor velocity is recorded"]
        if unread:
            like = Argument("columns", "displacement", unread[0])
            reasons = [f"no channel is called a displacement or velocity; if one is, write {like}"]
    return None, False, reasons[0]
