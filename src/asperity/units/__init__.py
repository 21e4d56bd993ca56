"""Units of inputs and outputs: text with a unit to SI floats, and SI floats to readable text.

Conversion is decimal, so ``"0.4 um"`` is exactly the double nearest to 4e-7.
"""

from asperity.units.convert import (
    display_unit,
    format_si,
    from_si,
    quantity_text,
    to_radians,
    to_si,
)
from asperity.units.kinds import KINDS, Kind

__all__ = [
    "KINDS",
    "Kind",
    "display_unit",
    "format_si",
    "from_si",
    "quantity_text",
    "to_radians",
    "to_si",
]
