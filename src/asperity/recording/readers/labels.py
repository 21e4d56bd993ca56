"""Headings taken apart: ``Force [N]``, ``F/N``, ``time_s``, ``Load, kN`` are name and unit."""

from __future__ import annotations

import re
from collections.abc import Sequence

from asperity.recording.readers.units import usual
from asperity.recording.roles import ROLES, candidates

_BRACKETS = re.compile(r"(?P<name>.*?)[\s_]*[\[({<](?P<unit>[^\[\](){}<>]*)[\])}>]\s*", re.S)
_NESTED = re.compile(r"(?P<name>.*?)[\s_]*[\[(](?P<unit>.*)[\])]\s*", re.S)
_WORDED = re.compile(r"(?P<name>.+?)(?:,\s*|\s+in\s+|;\s*)(?P<unit>[^\s,].*?)\s*", re.S)


def split_labels(labels: Sequence[str]) -> list[tuple[str, str]]:
    """Name and unit text of each heading of a file; the unit is empty where there is none.

    Brackets at the end hold the unit whatever it says. A slash, a comma, ``in`` and an underscore
    count only before a usual unit, so that ``dW/dt``, ``mu_s`` and ``D_c`` stay whole; and ``F_N``
    beside another ``F_...`` is the normal force, not a force in newton.
    """
    stems = [label.strip().rpartition("_")[0] for label in labels]
    several = stems.count("F") > 1
    return [
        _split(label.strip(), several and stem == "F")
        for label, stem in zip(labels, stems, strict=True)
    ]


def _split(label: str, indexed: bool) -> tuple[str, str]:
    for pattern in (_BRACKETS, _NESTED):
        match = pattern.fullmatch(label)
        if match and match["name"].strip(" /"):
            return match["name"].strip(" /"), match["unit"].strip()
    name, slash, unit = label.partition("/")
    if slash and name.strip() and usual(unit):
        return name.strip(), unit.strip()
    match = _WORDED.fullmatch(label)
    if match and usual(match["unit"]):
        return match["name"].strip(), match["unit"]
    return (label, "") if indexed else _without_suffix(label)


def _without_suffix(label: str) -> tuple[str, str]:
    """A heading such as ``time_s``, ``velocity_um_s`` or ``W_kN``."""
    name, _, last = label.rpartition("_")
    head, _, middle = name.rpartition("_")
    if head and usual(f"{middle}/{last}"):
        return head, f"{middle}/{last}"
    if name and last.isalpha() and _is_unit_of(name, last):
        return name, last
    return label, ""


def _is_unit_of(name: str, text: str) -> bool:
    """Whether a suffix is a unit; one lower-case letter is, if it measures what is named."""
    unit = usual(text)
    if unit is None or unit.kind == "dimensionless":
        return False
    if len(text) > 1 or text.isupper():
        return True
    return any(unit.kind in ROLES[r].kinds and candidates(r, {name: unit.kind}) for r in ROLES)
