"""Columns as recorded to a checked `Trace`: names, units and roles are determined here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING

from asperity.errors import Argument, InputError, closest, known_as, listed, printable, require
from asperity.parameters.arguments import shown
from asperity.recording.finding import Finding, with_cause
from asperity.recording.readers.clock import time_axis
from asperity.recording.readers.missing import without_codes
from asperity.recording.readers.raw import unusable
from asperity.recording.readers.units import (
    Unit,
    in_si,
    is_empty,
    required,
    split_labels,
    understood,
    without_brackets,
)
from asperity.recording.roles import (
    ROLES,
    candidates,
    find_channel,
    free_name,
    kinds_of,
    nouns,
    recorded_as,
    role_of,
)
from asperity.recording.trace import Channel, Trace, checked

if TYPE_CHECKING:
    from asperity.recording.readers.raw import RawColumn, RawRecording


#: Largest length of a column's name.
_LONGEST_NAME = 120
#: More findings with the same name than this are merged.
_FOLDED = 60


def assemble(
    recorded: RawRecording,
    path: Path,
    columns: Mapping[str, str | int] | None,
    units: Sequence[Mapping[str, str]],
    rate: float | str | None,
) -> Trace:
    """The trace of a file's columns; the arguments are those of `read`.

    Of two units of a column in different mappings, that of the last counts.
    """
    findings = list(recorded.findings)
    split = _names_and_units(recorded.columns)
    # Names of a damaged file may hold anything.
    names = _unique([printable(name, _LONGEST_NAME) for name, _ in split], findings)
    recorded_columns = dict(zip(names, recorded.columns, strict=True))
    written = dict(zip(names, (units for _, units in split), strict=True))
    texts = {name: units[-1] for name, units in written.items()}
    headings = {name: column.label for name, column in recorded_columns.items()}
    try:
        roles = _chosen_roles(columns or {}, headings)
        stated: dict[str, str] = {}
        for mapping in units:
            stated |= _by_name(mapping, headings, roles)
    except InputError as error:
        raise with_cause(error, findings) from None
    _refuse_two_units({n: u for n, u in written.items() if n not in stated})
    known = _known_units(texts, stated, findings)
    _check_kinds(roles, known)
    values = {name: column.values for name, column in recorded_columns.items()}
    try:
        clock = time_axis(values, known, roles, rate, recorded)
    except InputError as error:
        refused = error
        if any(f.name == "truncated" for f in findings) and "time" not in roles:
            left = listed(map(repr, names))
            refused = unusable(path, f"which is cut so that no time but {left} is left")
        raise with_cause(refused, findings) from None
    findings += clock.findings
    channels, dropped = {}, []
    for name, column in recorded_columns.items():
        if name in (clock.column, clock.dates):
            continue
        if column.values.dtype.kind not in "iufb":
            dropped.append(name)
            continue
        unit = known.get(name)
        numbers, missing = without_codes(column.values, name)
        findings += missing
        channels[name] = Channel(
            in_si(numbers, unit),
            unit.kind if unit else None,
            unit.si if unit else "",
            column.label,
            texts[name],
        )
    if dropped:
        findings.append(_left_out(dropped))
    findings = _folded(findings + _unknown(channels))
    provenance = {"file": known_as(path).name, **recorded.provenance, "time": clock.source}
    roles = {role: name for role, name in roles.items() if role != "time"}
    return checked(Trace(clock.time, channels, tuple(findings), provenance, roles))


def _names_and_units(columns: Sequence[RawColumn]) -> list[tuple[str, list[str]]]:
    """Name of each column, and the units in its heading and next to it; at least one, maybe empty.

    What follows an underscore or a slash is part of the name where the file states another unit, as
    of F_N in kN and of F/N, a pure number.
    """
    split = []
    for column, (name, unit) in zip(columns, split_labels([c.label for c in columns]), strict=True):
        stated = "" if is_empty(column.unit or "") else without_brackets(column.unit or "")
        label = column.label.strip()
        joined = label.replace(" ", "") in (f"{name}_{unit.replace('/', '_')}", f"{name}/{unit}")
        if stated and joined and understood(stated) != understood(unit):
            name, unit = label, ""
        split.append((name, [text for text in (unit, stated) if text] or [""]))
    return split


def _refuse_two_units(written: Mapping[str, list[str]]) -> None:
    """Refuse a column whose heading has another unit than the file states next to it."""
    for name, units in written.items():
        known = [understood(text) for text in units]
        rule, got = "be one unit", f"'{units[0]}' in the heading and '{units[-1]}' next to it"
        alike = None in known or known[0] == known[-1]
        require(alike, Argument("units", name), rule, got, "say which one is right")


def _unique(names: list[str], findings: list[Finding]) -> list[str]:
    """Unique names: repeated names get numbers."""
    unique: dict[str, None] = {}
    for i, name in enumerate(names):
        plain = name or f"column {i}"
        free = free_name(plain, unique)
        unique[free] = None
        if free != plain:
            number = names[: i + 1].count(name)
            text = (
                f"The name '{plain}' stands on more than one column; this one is called '{free}'."
            )
            findings.append(Finding("repeated name", "warning", number, f"column {i}", text))
    return list(unique)


def _chosen_roles(columns: Mapping[str, str | int], headings: Mapping[str, str]) -> dict[str, str]:
    roles: dict[str, str] = {}
    for key, wanted in columns.items():
        role = role_of(key)
        if role is None:
            raise InputError("columns", "name roles", f"'{key}'", closest(key, ROLES))
        field = Argument("columns", key)
        name = _name_of(wanted, headings, field)
        other = next((known for known, taken in roles.items() if taken == name), None)
        got, advice = f"'{name}', which is {other} too", "choose another column for one of them"
        require(other is None, field, "be a column of its own", got, advice)
        roles[role] = name
    return roles


def _check_kinds(roles: Mapping[str, str], known: Mapping[str, Unit]) -> None:
    """Refuse a column whose unit does not fit its role."""
    for role, name in roles.items():
        kind = known[name].kind if name in known else None
        fitting = kinds_of(role)
        if kind is not None and kind not in fitting:
            unit = Argument("units", name, "...")
            advice = f"choose another column, or correct its unit with {unit}"
            field, rule = Argument("columns", role), f"be {nouns(fitting)}"
            raise InputError(field, rule, f"'{name}', {nouns([kind])}", advice)


def _name_of(wanted: str | int, headings: Mapping[str, str], field: Argument) -> str:
    if isinstance(wanted, int):
        names = list(headings)
        if not -len(names) <= wanted < len(names):
            rule = f"the file has columns 0 to {len(names) - 1}"
            raise InputError(field, "be a column", shown(wanted), rule)
        return names[wanted]
    name = recorded_as(wanted, headings)
    if name is None:
        raise InputError(field, "be a column", f"'{wanted}'", closest(wanted, headings))
    return name


def _by_name(
    units: Mapping[str, str], headings: Mapping[str, str], roles: Mapping[str, str]
) -> dict[str, str]:
    """Units by the name of the column; the user may have used its heading or role."""
    by_name: dict[str, str] = {}
    kinds = dict.fromkeys(headings)
    for key, text in units.items():
        try:
            name = key if key in headings else find_channel(key, kinds, roles, headings)
        except InputError as error:
            raise error.about(Argument("units")) from None
        got = f"'{by_name.get(name)}' and '{text}'"
        once = by_name.get(name, text) == text
        require(once, Argument("units", name), "be given once", got, "leave one out")
        by_name[name] = text
    return by_name


def _known_units(
    texts: dict[str, str], stated: Mapping[str, str], findings: list[Finding]
) -> dict[str, Unit]:
    """Known units; a unit of the user has priority over the file's."""
    known = {}
    for name, text in texts.items():
        unit = understood(text)
        if name in stated:
            wanted = required(stated[name], name)
            if unit is not None and unit != wanted:
                read = f"it was read in '{stated[name]}', as asked."
                text = f"The file gives '{name}' in '{text}'; {read}"
                factor = float(wanted.factor)
                findings.append(Finding("unit overridden", "note", factor, name, text))
            unit = wanted
        elif unit is None and is_empty(text) and candidates("friction", {name: "dimensionless"}):
            # A coefficient of friction is dimensionless.
            unit = Unit("dimensionless", Decimal(1))
        if unit is not None:
            known[name] = unit
    return known


def _left_out(names: list[str]) -> Finding:
    named = listed(map(repr, names), most=12)
    holds = "holds" if len(names) == 1 else "hold"
    text = f"{named} {holds} text or complex numbers, and was left out."
    return Finding("text column", "note", len(names), named, text)


def _folded(findings: list[Finding]) -> list[Finding]:
    """Findings, of which many with the same name become one (a wide table without units)."""
    many = {name for name, n in Counter(f.name for f in findings).items() if n > _FOLDED}
    folded = [f for f in findings if f.name not in many]
    for name in many:
        same = [f for f in findings if f.name == name]
        sentence = f"{len(same)} columns have this finding; the first: {same[0].sentence}"
        where = listed([f.where for f in same], most=12)
        folded.append(Finding(name, same[0].severity, len(same), where, sentence))
    return folded


def _unknown(channels: Mapping[str, Channel]) -> list[Finding]:
    findings = []
    for name, c in channels.items():
        if c.kind is None:
            text = f"The file states no unit of '{name}'"
            if c.recorded_unit:
                text = f"The unit '{c.recorded_unit}' of '{name}' is not known"
            unit = Argument("units", name, "...")
            text += f"; its values are as recorded, until {unit} says what they are."
            findings.append(Finding("unknown unit", "warning", 1.0, name, text))
    return findings
