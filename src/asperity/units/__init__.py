"""Units of inputs and outputs: text with a unit to SI floats, and SI floats to readable text.

Conversion is decimal, so ``"0.4 um"`` is exactly the double nearest to 4e-7.
"""

from asperity._lazy import public_names
from asperity.units.convert import (
    display_unit as display_unit,
    format_si as format_si,
    from_si as from_si,
    quantity_text as quantity_text,
    to_radians as to_radians,
    to_si as to_si,
)
from asperity.units.kinds import KINDS as KINDS, Kind as Kind

__all__ = public_names(globals())
