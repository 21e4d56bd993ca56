"""Units of any dimension, for products and quotients that no kind of quantity has."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from functools import lru_cache

from asperity.errors import InputError
from asperity.units.kinds import KINDS
from asperity.units.scale import _parse_unit, _registry, _UnitError, normalised

#: Exponents of the base units of the SI, in alphabetic order; those that are zero are left out.
Dimension = tuple[tuple[str, float], ...]

#: Of kinds with one dimension, the first is meant.
_KINDS = (
    "dimensionless", "force", "pressure", "length", "time", "velocity", "frequency", "stiffness",
    "damping", "mass", "area", "viscosity", "temperature",
)  # fmt: skip


def dimension_of(exponents: Mapping[str, float]) -> Dimension:
    """A dimension of exponents, those that are zero left out."""
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
        If it is no unit, or one with a zero of its own such as the degree Celsius.
    """
    text = normalised(unit.strip())
    if not text:
        return 1.0, ()
    try:
        parsed = _parse_unit(text)
        registry = _registry()
        factor, base = registry.get_base_units(parsed)
        shifted = registry.Quantity(Decimal(0), parsed).to(base).magnitude != 0
    # pint's parser takes some texts that are no units of anything.
    except (_UnitError, ArithmeticError, AttributeError, TypeError, ValueError):
        raise InputError(f"unit must be a unit, got '{unit}'; write it like 'N/V'") from None
    if shifted:
        raise InputError(
            f"unit must have its zero where nothing is, got '{unit}'; convert it to kelvin first"
        )
    return float(factor), dimension_of({str(k): float(v) for k, v in base._units.items()})


def kind_of_dimension(dimension: Dimension) -> str | None:
    """Key of `asperity.units.KINDS` for a dimension, None if none has it."""
    return next((kind for kind in _KINDS if base_units(KINDS[kind].si)[1] == dimension), None)


def unit_text(dimension: Dimension) -> str:
    """A dimension as a unit in base units, such as ``"kg/m/s^2"``."""
    short = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K"}

    def part(name: str, power: float) -> str:
        return short.get(name, name) + ("" if power == 1 else f"^{power:g}")

    above = [part(name, n) for name, n in dimension if n > 0]
    below = [part(name, -n) for name, n in dimension if n < 0]
    return "/".join(["*".join(above) or "1", *below]) if dimension else ""
