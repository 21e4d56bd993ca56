"""Units at the door: text with a unit in, SI floats inside, readable text out.

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
