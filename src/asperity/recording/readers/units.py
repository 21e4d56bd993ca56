"""Units and headings as laboratories write them.

``microns``, ``sec`` and ``[kN]`` are units; ``Force [N]``, ``F/N``, ``time_s`` and ``Load, kN`` are
names with units.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Float
from asperity.errors import Argument, InputError, printable
from asperity.recording.roles import ROLES, candidates
from asperity.units import KINDS
from asperity.units.scale import normalised, scaled, unit_factor

#: Words for units, lower case, as the unit they stand for.
_WORDS = {
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek", "sekunden"), "s"),
    **dict.fromkeys(("msec", "msecs", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "usecs", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("mic", "mics", "micron", "microns", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("micrometers", "micrometres"), "um"),
    **dict.fromkeys(("nanometer", "nanometers", "nanometre", "nanometres"), "nm"),
    **dict.fromkeys(("millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("newton", "newtons"), "N"),
    **dict.fromkeys(("kilonewton", "kilonewtons", "kn"), "kN"),
    **dict.fromkeys(("pascal", "pascals"), "Pa"),
    **dict.fromkeys(("megapascal", "megapascals", "mpa"), "MPa"),
    **dict.fromkeys(("hertz", "hz"), "Hz"),
    **dict.fromkeys(("kelvin", "degk"), "K"),
}
#: Signs for "no unit": a pure number.
_PURE = frozenset({"-", "--", "1", ".", "/", "dimensionless", "unitless", "nd", "n/d", "friction"})
#: Fields that a format leaves empty.
_EMPTY = frozenset({"", "no_val", "no_info", "none", "n/a", "na", "unknown", "?"})
#: Units that a heading may end in, in addition to those that SI values are displayed in.
_ALSO_USUAL = frozenset(
    ("min", "h", "d", "mm/min", "um/min", "cm", "cm/s", "kgf", "gf", "lbf", "psi", "bar")
)
#: Smallest size of one recorded unit (SI), and one over the largest.
_SMALLEST = Decimal("1e-100")
_NUMBERED = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s+(\S.*)")

_BRACKETS = re.compile(r"(?P<name>.*?)[\s_]*[\[({<](?P<unit>[^\[\](){}<>]*)[\])}>]\s*", re.S)
_NESTED = re.compile(r"(?P<name>.*?)[\s_]*[\[(](?P<unit>.*)[\])]\s*", re.S)
_WORDED = re.compile(r"(?P<name>.+?)(?:,\s*|\s+in\s+|;\s*)(?P<unit>[^\s,].*?)\s*", re.S)


@dataclass(frozen=True)
class Unit:
    """A known unit.

    Attributes
    ----------
    kind : str
        Key of `asperity.units.KINDS`.
    factor : Decimal
        SI value of one unit.
    """

    kind: str
    factor: Decimal

    @property
    def si(self) -> str:
        """The SI unit of the kind."""
        return KINDS[self.kind].si


def is_empty(text: str) -> bool:
    """Whether a unit field is empty or a placeholder."""
    return text.strip().lower() in _EMPTY


def understood(text: str) -> Unit | None:
    """Unit of a text, None if it is not known.

    A word (``"microns/sec"``), a sign for a pure number (``"-"``), or any unit of
    `asperity.units`; prefixes keep their case, so that ``mN`` and ``MN`` differ. Volts, counts,
    degrees and the like, which `asperity` has no kind for, are not understood.
    """
    text = _bare(text)
    # A single letter that is no usual unit is more likely a name than a unit.
    return usual(text) or (_by_pint(_worded(text)) if len(text) > 1 else None)


@lru_cache(maxsize=1024)
def usual(text: str) -> Unit | None:
    """Unit of a text if it is a usual unit of laboratories, else None."""
    text = _bare(text)
    if text.lower() in _PURE or text == "%":
        return Unit("dimensionless", Decimal("0.01") if text == "%" else Decimal(1))
    # As written first: mPa is no MPa, while nothing but MPa can be meant by mpa.
    for plain in (text, _worded(text)):
        if plain in _ALSO_USUAL:
            return _by_pint(plain)
        for kind, spec in KINDS.items():
            for unit, power in spec.ladder:
                if unit and unit == plain:
                    return Unit(kind, Decimal(1).scaleb(power))
    return None


def without_brackets(text: str) -> str:
    """A unit as a table writes it, without brackets and blanks around it."""
    return text.strip().strip("[](){}<>").strip()


def _bare(text: str) -> str:
    return normalised(without_brackets(text))


def _worded(text: str) -> str:
    return "/".join(_WORDS.get(part.lower().strip(), part.strip()) for part in text.split("/"))


@lru_cache(maxsize=1024)
def _by_pint(text: str) -> Unit | None:
    for kind, spec in KINDS.items():
        if not spec.si or kind == "angular_frequency":
            continue
        try:
            return Unit(kind, unit_factor(text, kind, "unit", text))
        except InputError:
            continue
    return None


def required(text: str, name: str) -> Unit:
    """Unit of a column from the user, which must be a known unit.

    Parameters
    ----------
    text : str
        A unit, or a number with a unit: what one recorded unit is, such as ``"12.5 N"`` for a
        gauge of 12.5 N per volt.
    name : str
        The column, for the message.

    Raises
    ------
    InputError
        If it is not a unit of `asperity.units`, or its size is zero or beyond doubles.
    """
    match = _NUMBERED.fullmatch(text)
    unit = understood(match[2] if match else text)
    if unit is None:
        advice = (
            "write it like 'N', 'MPa', 'um', '-' for a pure number, or '12.5 N' for what one "
            "recorded unit is"
        )
        raise InputError(Argument("units", name), "be a unit", f"'{text}'", advice)
    if match is None:
        return unit
    try:
        factor = unit.factor * Decimal(match[1])
    except ArithmeticError:  # decimals have a largest power of ten themselves
        factor = Decimal(0)
    if not _SMALLEST < abs(factor) < 1 / _SMALLEST:
        rule = f"be a size between {_SMALLEST:.0e} and {1 / _SMALLEST:.0e} in SI"
        advice = "give what one recorded unit is, like '12.5 N'"
        raise InputError(Argument("units", name), rule, f"'{printable(text, 63)}'", advice)
    return Unit(unit.kind, factor)


def in_si(values: NDArray[Any], unit: Unit | None) -> Float:
    """Values times the factor of the unit, rounded once."""
    values = np.asarray(values, dtype=np.float64)
    if unit is None or unit.factor == 1:
        return values
    # Overflow in a damaged file gives infinity, which the checks report.
    with np.errstate(over="ignore"):
        return np.asarray(scaled(values, unit.factor))


def split_labels(labels: Sequence[str]) -> list[tuple[str, str]]:
    """Name and unit text of each heading of a file; the unit may be empty.

    Brackets at the end always hold the unit. A slash, a comma, ``in`` and an underscore
    count only before a usual unit, so that ``dW/dt``, ``mu_s`` and ``D_c`` stay whole; and ``F_N``
    next to another ``F_...`` is the normal force, not a force in newton.
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
