"""Channels computed from recorded channels: effective stress, area, gain, zero offset, clock."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from asperity.errors import Argument, InputError, require
from asperity.parameters.arguments import number, typed
from asperity.recording.expressions import Quantity, evaluate
from asperity.recording.finding import Finding
from asperity.recording.roles import free_name, kinds_of, nouns, role_of
from asperity.recording.trace import Channel, Trace, check, checked
from asperity.units import KINDS
from asperity.units.scale import kind_of_dimension, unit_text

#: The word before the length of a friction per length.
_FRICTION = re.compile(r"(?:friction|mu)(?=\s*/)")
#: Findings about time, not about a channel.
_OF_TIME = frozenset({"backward time", "repeated time", "rounded time", "gap", "uneven sampling"})

#: Findings of a channel that do not hold for channels made from it.
_OF_SOURCE = frozenset({"unknown unit", "unit overridden", "constant"})


@typed
def derive(trace: Trace, channels: Mapping[str, str]) -> Trace:
    """Add channels to a recording, each computed by an expression of other channels.

    Parameters
    ----------
    trace : Trace
    channels : mapping of str to str
        Expressions by the name of the new channel, such as ``{"load": "Conf.Press - (Up.Pore.Press
        + Dwn.Pore.Press)/2", "force": "zero(Force, 0 s, 5 s) / (20 mm * 36 mm)"}``; see
        `asperity.recording.expressions` for the grammar. A name of a role, such as ``load`` or
        ``force``, gives that role to the channel; ``time`` makes a new time axis, which expressions
        before it do not have. An expression may use channels of earlier expressions. A recorded
        channel of the same name is kept as ``NAME (recorded)``.

    Returns
    -------
    Trace
        The recording with the new channels, and with the expressions in its provenance. A new
        channel has the findings of the channels in its expression.

    Raises
    ------
    InputError
        If an expression is invalid, or its unit does not fit the role.
    """
    for target, text in channels.items():
        field = Argument("channels", target)
        rule = "be an expression"
        require(text.strip(), field, rule, repr(text), "write it like '2.4 N/V * Gauge'")
        require(target.strip(), "channels", "have names", "an empty one", "write 'load = ...'")
        quantity, sources = evaluate(text, trace, field)
        trace = _with_channel(trace, target, quantity, sources, field, text)
    made = {**trace.provenance.get("derived channels", {}), **channels}
    return replace(trace, provenance={**trace.provenance, "derived channels": made})


@typed
def stress_to_force(trace: Trace, area: float | str) -> Trace:
    """Convert all stresses to forces by the nominal contact area.

    Parameters
    ----------
    trace : Trace
        Any recording.
    area : float or str
        Nominal contact area (m^2, or a text such as ``"25 cm^2"``).

    Returns
    -------
    Trace
        With forces (N) under the names of the stresses, the area in its provenance.

    Raises
    ------
    InputError
        If the area is not positive, or no channel is a stress.
    """
    size = number(area, "stress_to_force.area", "area", "positive")
    stresses = [k for k, c in trace.channels.items() if c.kind == "pressure"]
    advice = "leave it out, or give the channel its unit"
    require(stresses, "stress_to_force.area", "go with a stress", "a recording without", advice)
    forces = {
        k: replace(
            trace.channels[k], values=trace.channels[k].values * size, kind="force", unit="N"
        )
        for k in stresses
    }
    note = {"area (m^2)": size, "stresses made forces": stresses}
    channels, provenance = {**trace.channels, **forces}, {**trace.provenance, **note}
    return replace(trace, channels=channels, provenance=provenance)


@typed
def stiffness_from_friction(stiffness: float | str, load: float | str) -> float:
    """Convert a stiffness in friction per length to force per length, K = k W.

    Parameters
    ----------
    stiffness : float or str
        Friction per metre, or a text such as ``"1e-3 /um"`` or ``"0.5 friction/mm"``.
    load : float or str
        Mean normal load W, N; or normal stress as a text such as ``"20 MPa"``.

    Returns
    -------
    float
        N/m; Pa/m if the load is a stress.

    Raises
    ------
    InputError
        If one of the two is not understood or not positive.
    """
    field = "stiffness_from_friction"
    text = _FRICTION.sub("", stiffness) if isinstance(stiffness, str) else stiffness
    per_length = number(text, f"{field}.stiffness", "per_length", "positive")
    stress = isinstance(load, str) and load.rstrip().endswith(("Pa", "bar"))
    kind = "pressure" if stress else "force"
    return per_length * number(load, f"{field}.load", kind, "positive")


def _with_channel(
    trace: Trace,
    target: str,
    quantity: Quantity,
    sources: tuple[str, ...],
    field: Argument,
    text: str,
) -> Trace:
    role = role_of(target)
    kind = kind_of_dimension(quantity.dimension)
    _check_kind(role, kind, quantity, field)
    shape = trace.time.shape
    values = np.array(np.broadcast_to(np.asarray(quantity.values, dtype=np.float64), shape))
    rule, advice = "give numbers", "correct the expression"
    require(np.isfinite(values).any() or not values.size, field, rule, "no finite one", advice)
    if role == "time":
        provenance = {**trace.provenance, "time": f"derived: {text}"}
        return checked(replace(trace, time=values, provenance=provenance))
    unit = KINDS[kind].si if kind else ""
    channel = Channel(values, kind, unit, target, unit or unit_text(quantity.dimension))
    channels, findings, roles = dict(trace.channels), trace.findings, dict(trace.roles)
    if target in channels:
        kept = free_name(f"{target} (recorded)", channels)
        channels = {kept if name == target else name: c for name, c in channels.items()}
        findings = tuple(_renamed(f, target, kept) for f in findings)
        roles = {r: kept if name == target else name for r, name in roles.items()}
        sources = tuple(kept if source == target else source for source in sources)
    channels[target] = channel
    if role is not None:
        roles[role] = target
    alone = check(Trace(trace.time, {target: channel}))
    direct = [f for f in alone if f.name not in _OF_TIME and not f.where.startswith("time,")]
    inherited = _inherited(findings, sources, target, {f.name for f in direct})
    return replace(trace, channels=channels, findings=(*findings, *direct, *inherited), roles=roles)


def _check_kind(role: str | None, kind: str | None, quantity: Quantity, field: Argument) -> None:
    if role is None:
        return
    fitting = kinds_of(role)
    if kind not in fitting:
        shown = f"one in {unit_text(quantity.dimension)}" if quantity.dimension else "a pure number"
        advice = "add the units of gains and areas, like '2.4 N/V' or '25 cm^2'"
        raise InputError(field, f"be {nouns(fitting)}", shown, advice)


def _inherited(
    findings: tuple[Finding, ...], sources: tuple[str, ...], target: str, known: set[str]
) -> list[Finding]:
    """Findings of the source channels, which a check of the new channel may miss."""
    made = []
    for source in sources:
        for f in findings:
            if not f.concerns(source) or f.name in known | _OF_SOURCE:
                continue
            sentence = f"'{target}' is made from '{source}': {f.sentence}"
            where = f"{target}{f.where.removeprefix(source)}"
            name = f.name if f.name.startswith("source ") else f"source {f.name}"
            made.append(Finding(name, f.severity, f.number, where, sentence))
    return made


def _renamed(finding: Finding, old: str, new: str) -> Finding:
    moved = new + finding.where.removeprefix(old)
    return replace(finding, where=moved) if finding.concerns(old) else finding
