"""The SI value of a unit, as an exact decimal.

The spellings of `asperity.units.kinds` are looked up directly. Any other spelling is read by pint,
which takes a third of a second to load and is therefore loaded only then.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Context, Decimal
from functools import lru_cache
from typing import Any

from asperity.errors import InputError, require
from asperity.units.kinds import KINDS

#: More digits than any double needs, so that only the final rounding to a double is inexact.
EXACT = Context(prec=60)

#: Characters of a unit; texts with other characters are not given to pint's expression parser.
_UNIT = re.compile(r"[A-Za-zΩµμ%°][A-Za-z0-9Ωµμ%°²³⁻¹·_ */^.()+-]*|1 ?/[A-Za-z0-9_ */^.()+-]+")
_LONGEST_UNIT = 60

#: Exponents of the SI base units in alphabetic order, without zeros.
Dimension = tuple[tuple[str, float], ...]


def normalised(unit: str) -> str:
    """The unit with ``u`` for each code point of micro, ``1/um`` for ``/um``, single blanks."""
    text = " ".join(unit.replace("µ", "u").replace("μ", "u").split())
    return f"1/{text[1:].lstrip()}" if text.startswith("/") else text


@lru_cache(maxsize=1024)
def _known(kind: str) -> Mapping[str, Decimal]:
    powers = {**dict(KINDS[kind].ladder), **KINDS[kind].also}
    return {unit: Decimal(1).scaleb(power) for unit, power in powers.items()}


def unit_factor(unit: str, kind: str, name: str, text: str) -> Decimal:
    """SI value of one `unit`; `name` and `text` are for messages only."""
    known = _known(kind).get(unit)
    if known is not None:
        return known
    try:
        return _factor_by_pint(unit, kind)
    except _UnitError as refused:
        spec = KINDS[kind]
        expected = f"{spec.noun} ({spec.si})" if spec.si else spec.noun
        advice = refused.advice or f"write it like '{spec.example}'"
        raise InputError(name, f"be {expected}", f"'{text}'{refused}", advice) from None


class _UnitError(Exception):
    """A unit that does not fit: the reason, and optional advice."""

    def __init__(self, why: str = "", advice: str = "") -> None:
        super().__init__(why)
        self.advice = advice


@lru_cache(maxsize=1024)
def _factor_by_pint(unit: str, kind: str) -> Decimal:
    registry = _registry()
    spec = KINDS[kind]
    parsed = _parse_unit(unit)
    try:
        factor, root = registry.get_root_units(parsed)
    except (ArithmeticError, ValueError):  # a power that decimals cannot hold
        raise _UnitError(", and no such power of a unit is a number") from None
    si_factor, si_root = registry.get_root_units(registry.parse_units(spec.si))
    if kind == "frequency":
        _require_hertz(parsed, root)
    if kind == "angular_frequency" and "hertz" in str(parsed):
        raise _UnitError(", which counts cycles", "multiply by 2 pi and write rad/s")
    # Roots are compared as units, not as dimensions: pint counts radians and turns as pure
    # numbers, and would take 24 degrees for an amplitude of 0.42.
    if kind in ("force", "stiffness") and root * registry.meter**2 == si_root:
        what = "stress" if kind == "force" else "stress over a length"
        like = "'50 MN' for 50 MPa" if kind == "force" else "'17 GN/m' for 17 MPa/mm"
        raise _UnitError(f", a {what}", f"give the {spec.noun[2:]} on a square metre, like {like}")
    if root != si_root and not spec.si:
        raise _UnitError(", which has a unit", f"give a ratio, like '{spec.example}'")
    if root != si_root:
        raise _UnitError
    try:
        shifted = registry.Quantity(Decimal(0), parsed).to(spec.si or "").magnitude != 0
    except TypeError:  # the logarithm of a decimal, as of dB
        raise _UnitError(", which is logarithmic") from None
    if shifted:
        raise _UnitError(", which has an offset")
    return EXACT.divide(Decimal(factor), Decimal(si_factor))


def _require_hertz(parsed: Any, root: Any) -> None:
    """Refuse units that pint treats as Hz, rad/s, rpm and 1/s, and periods."""
    if str(parsed).endswith("hertz"):
        return
    if "second" in str(root) and root.dimensionality == {"[time]": -1}:
        raise _UnitError(
            ", which can be an angular frequency", "give omega/(2 pi) in Hz, like '120 Hz'"
        )
    if root.dimensionality == {"[time]": 1}:
        raise _UnitError(", a period", "give 1 over it in Hz, like '22.4 uHz' for 12.4 h")
    raise _UnitError


def _parse_unit(unit: str) -> Any:
    if len(unit) > _LONGEST_UNIT or not _UNIT.fullmatch(unit):
        raise _UnitError(", which is no unit")
    try:
        return _registry().parse_units(unit.replace("%", "percent"))
    # pint's parser may raise errors of many types: syntax, type, value and attribute errors.
    except Exception:
        raise _UnitError(f", and '{unit}' is no known unit") from None


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


def scaled(values: Any, factor: Decimal) -> Any:
    """Values times a factor, rounded once: 10^-n is inexact in binary, 10^n is not."""
    if abs(factor) < 1:
        return values / float(EXACT.divide(Decimal(1), factor))
    return values * float(factor)


def dimension_of(exponents: Mapping[str, float]) -> Dimension:
    """The dimension with these exponents."""
    return tuple(sorted((name, float(n)) for name, n in exponents.items() if n))


@lru_cache(maxsize=1024)
def base_units(unit: str) -> tuple[float, Dimension]:
    """SI value of one unit of any dimension, and its dimension.

    Parameters
    ----------
    unit : str
        Such as ``"N/V"`` or ``"kN cm^2"``; empty for a pure number.

    Raises
    ------
    InputError
        If the text is no unit, or a unit with an offset such as the degree Celsius.
    """
    text = normalised(unit.strip())
    if not text:
        return 1.0, ()
    try:
        parsed = _parse_unit(text)
        registry = _registry()
        factor, base = registry.get_base_units(parsed)
        shifted = registry.Quantity(Decimal(0), parsed).to(base).magnitude != 0
    # pint's parser accepts some texts that are no units.
    except (_UnitError, ArithmeticError, AttributeError, TypeError, ValueError):
        raise InputError("unit", "be a unit", f"'{unit}'", "write it like 'N/V'") from None
    require(not shifted, "unit", "have no offset", f"'{unit}'", "convert it to kelvin first")
    return float(factor), dimension_of({str(k): float(v) for k, v in base._units.items()})


def kind_of_dimension(dimension: Dimension) -> str | None:
    """Key of `asperity.units.KINDS` with this dimension; None if there is none."""
    return next((k for k, spec in KINDS.items() if base_units(spec.si)[1] == dimension), None)


def unit_text(dimension: Dimension) -> str:
    """A dimension as a unit in base units, such as ``"kg/m/s^2"``."""
    short = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K"}

    def part(name: str, power: float) -> str:
        return short.get(name, name) + ("" if power == 1 else f"^{power:g}")

    above = [part(name, n) for name, n in dimension if n > 0]
    below = [part(name, -n) for name, n in dimension if n < 0]
    return "/".join(["*".join(above) or "1", *below]) if dimension else ""
