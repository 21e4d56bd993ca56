"""Conversion of user input to SI, and of SI to text."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from decimal import Decimal
from typing import Any, overload

import numpy as np

from asperity.errors import InputError, InputTypeError, printable
from asperity.units.kinds import KINDS, Kind, kind_of, require_text, shown
from asperity.units.scale import EXACT, normalised, scaled, unit_factor

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+))(?:[eE]([+-]?\d+))?(?![\d.])\s*(.*?)\s*", re.S)
#: Larger powers of ten overflow a double in any unit.
_LARGEST_POWER = 5000
_WITHIN = "lie within the range of double precision"
#: Largest length of a user's text in a message.
_SHOWN = 63

#: Radians in each unit; a text without one is in radians.
_RADIANS = {"": 1.0, "rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "degrees": math.pi / 180}


@overload
def to_si(value: str | float, kind: str, name: str) -> float: ...
@overload
def to_si(value: Any, kind: str, name: str) -> Any: ...
def to_si(value: Any, kind: str, name: str) -> Any:
    """Convert user input to SI.

    Parameters
    ----------
    value : str, number, array or sequence of these
        A text carries its unit (``"1 um/s"``), and so do quantities of pint and astropy, and arrays
        of xarray with the attribute ``units``; a number or another array is taken as SI.
    kind : str
        A key of `KINDS`.
    name : str
        Name of the value in messages, as ``<object>.<field>``.

    Returns
    -------
    float or array
        In the SI unit of `kind`. Arrays keep their type and shape; a value traced by JAX is
        returned unchanged, because it has no number to check.

    Raises
    ------
    InputError
        If the value is not a finite number, lacks a unit it needs, or has the wrong one.
    """
    spec = kind_of(kind)
    if isinstance(value, str):
        return _text_to_si(value, kind, name)
    if is_traced(value):
        return value
    if (quantity := _number_and_unit(value)) is not None:
        return _quantity_to_si(*quantity, kind, name)
    if getattr(getattr(value, "dtype", None), "kind", None) in ("U", "O"):
        return to_si(np.asarray(value).tolist(), kind, name)
    if isinstance(value, list | tuple):
        return _stacked([to_si(v, kind, name) for v in value], name)
    if isinstance(value, int) and not abs(value) < 10**308:
        raise _refused(name, _WITHIN, "an integer of more than 308 figures", spec)
    return _number_to_si(value, spec, name)


def from_si(value: Any, unit: str, kind: str) -> Any:
    """Express an SI value in another unit.

    Parameters
    ----------
    value : float or array
        In SI.
    unit : str
        Target unit, such as ``"um/s"``.
    kind : str
        A key of `KINDS`.

    Returns
    -------
    float or array
        The number in `unit`; a float is converted exactly in decimal.

    Raises
    ------
    InputError
        If `unit` is not a unit of `kind`, or `value` is no number.
    """
    kind_of(kind)
    require_text(unit, "unit")
    factor = unit_factor(normalised(unit), kind, "unit", unit)
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    if plain and math.isfinite(value):
        return float(EXACT.divide(Decimal(repr(float(value))), factor))
    if not is_traced(value):
        array = np.asarray(value)
        if array.dtype.kind not in "iuf":
            raise InputTypeError("value", "be a number or an array of them", shown(value))
        value = value if hasattr(value, "dtype") else array
    return scaled(value, EXACT.divide(Decimal(1), factor))


def format_si(value: float, kind: str, digits: int = 4) -> str:
    """Text of an SI value in a unit that gives short numbers, such as 4e-7 m -> ``"400 nm"``.

    Parameters
    ----------
    value : float
        In the SI unit of `kind`.
    kind : str
        A key of `KINDS`.
    digits : int
        Significant digits.

    Raises
    ------
    InputError
        If there is no such kind, or an argument has another type.
    """
    return quantity_text(value, kind_of(kind).si, digits)


def quantity_text(value: float, unit: str, digits: int = 4) -> str:
    """Text of a value, in an SI unit, in the unit that reads best.

    Raises
    ------
    InputError
        If an argument has another type.
    """
    if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf":
        raise InputTypeError("value", "be a number", shown(value))
    require_text(unit, "unit")
    if not (type(digits) is int and digits >= 0):
        raise InputTypeError("digits", "be a whole number from 0", shown(digits))
    value = float(value)
    best, power = display_unit(value, unit, digits)
    if value and math.isfinite(value):
        value = float(Decimal(repr(value)).scaleb(-power))
    return f"{value:.{digits}g} {best}".rstrip()


def display_unit(value: float, unit: str, digits: int = 4) -> tuple[str, int]:
    """The unit in which a value reads best, and its power of ten over the SI unit.

    Parameters
    ----------
    value : float
        In the SI unit.
    unit : str
        An SI unit of a kind of `KINDS`; any other is kept.
    digits : int
        Significant digits that are shown.
    """
    spec = next((kind for kind in KINDS.values() if kind.si == unit), None)
    if spec is None or not value or not math.isfinite(value):
        return unit, 0
    # The largest unit below the rounded value, so that 0.99999 um reads 1 um.
    size = abs(float(f"{value:.{digits}g}"))
    fitting = [rung for rung in spec.ladder if size >= float(f"1e{rung[1]}")]
    return fitting[-1] if fitting else spec.ladder[0]


def is_traced(value: Any) -> bool:
    """Whether `value` is a tracer of a JAX transformation, which has no number."""
    # JAX is not imported here: a program that has not loaded it has no tracers.
    jax = sys.modules.get("jax")
    return jax is not None and isinstance(value, jax.core.Tracer)


def _stacked(rows: list[Any], name: str) -> Any:
    try:
        return np.array(rows, dtype=float)
    except ValueError:
        rule, got = "be a rectangular array", "rows of different lengths"
        raise InputError(name, rule, got, "give every row the same length") from None


def _number_and_unit(value: Any) -> tuple[Any, str] | None:
    """Number and unit of a quantity of another package; None for a value without a unit."""
    if hasattr(value, "magnitude") and hasattr(value, "units"):  # pint
        return value.magnitude, str(value.units)
    if hasattr(value, "value") and hasattr(value, "unit"):  # astropy
        return value.value, str(value.unit)
    attributes = getattr(value, "attrs", None)
    unit = attributes.get("units") if isinstance(attributes, Mapping) else None
    # Of a pure number datasets have the unit "1", of an angle "rad".
    if not isinstance(unit, str) or unit in ("", "1", "rad"):
        return None
    return np.asarray(value), unit  # xarray


def _quantity_to_si(number: Any, unit: str, kind: str, name: str) -> Any:
    value = to_si(number, kind, name)
    if not np.ndim(value):
        return _text_to_si(f"{float(value)!r} {unit}", kind, name)
    return scaled(value, unit_factor(normalised(unit), kind, name, printable(unit, _SHOWN)))


def _number_to_si(value: Any, spec: Kind, name: str) -> Any:
    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(float), np.nan)
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise InputError(
            name,
            f"be {spec.noun}",
            shown(value),
            f"give a number in SI or a text like '{spec.example}'",
        )
    bad = array[~np.isfinite(array)]
    if bad.size:
        got = f"{bad.flat[0]} {spec.si}".rstrip()
        raise InputError(name, "be finite", got, f"give a value like '{spec.example}'")
    if array.ndim == 0 and isinstance(value, int | float | np.generic):
        return float(value)
    if not hasattr(value, "astype"):  # a range, for one
        value = array
    return value if array.dtype == float else value.astype(float)


def _text_to_si(text: str, kind: str, name: str) -> float:
    spec = kind_of(kind)
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise _refused(name, f"be a finite number{' with a unit' if spec.si else ''}", text, spec)
    if re.match(r",\d", match[3]):
        advice = f"write it like '{spec.example}', without commas"
        raise InputError(name, "have a decimal point", _quoted(text), advice)
    digits, unit = Decimal(match[1]), normalised(match[3])
    if spec.si and not unit:
        raise _refused(name, "carry a unit", text, spec)
    factor = unit_factor(unit, kind, name, printable(text, _SHOWN))
    power = _power_of_ten(match[2] or "0")
    # `Decimal` has a largest exponent; beyond it only zero is a number.
    if digits and abs(power + digits.adjusted()) > _LARGEST_POWER:
        raise _refused(name, _WITHIN, text, spec)
    value = float(EXACT.multiply(digits.scaleb(power if digits else 0, EXACT), factor))
    # Below the smallest normal double a number has few digits, and its reciprocal may be infinite.
    if math.isinf(value) or (digits and abs(value) < sys.float_info.min):
        raise _refused(name, _WITHIN, text, spec)
    return value


def _power_of_ten(text: str) -> int:
    """The integer of a text, or a too large integer if the text is too long to parse."""
    sign, figures = (-1 if text.startswith("-") else 1), text.lstrip("+-").lstrip("0")
    return sign * (int(figures or "0") if len(figures) < 10 else 10**10)


def _refused(name: str, rule: str, text: str, spec: Kind) -> InputError:
    return InputError(name, rule, _quoted(text), f"write it like '{spec.example}'")


def _quoted(text: str) -> str:
    return f"'{printable(text, _SHOWN)}'"


def to_radians(value: Any, name: str) -> Any:
    """Convert an angle to radians.

    Parameters
    ----------
    value : str, number or array
        A text has its unit, ``"5 deg"`` or ``"0.09 rad"``; numbers are in radians.
    name : str
        Name of the value in messages.

    Raises
    ------
    InputError
        If the value is no finite angle.
    """
    if not isinstance(value, str):
        return to_si(value, "dimensionless", name)
    number, _, unit = value.strip().replace("°", " deg").partition(" ")
    try:
        angle = float(number) * _RADIANS[unit.strip()]
    except (KeyError, ValueError):
        angle = math.nan
    if not math.isfinite(angle):
        rule = "be an angle in rad or deg"
        raise InputError(name, rule, _quoted(value), "write it like '5 deg'")
    return angle
