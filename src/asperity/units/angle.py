"""Angles: numbers in radians, or texts with their unit."""

from __future__ import annotations

import math
from typing import Any

from asperity.errors import InputError
from asperity.units.convert import shortened

#: Radians in each unit; a text without one is in radians.
_RADIANS = {"": 1.0, "rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "degrees": math.pi / 180}


def to_radians(value: Any, name: str) -> Any:
    """Convert an angle to radians.

    Parameters
    ----------
    value : str, number or array
        A text has its unit, ``"5 deg"`` or ``"0.09 rad"``; numbers are in radians and returned as
        they are.
    name : str
        What messages call the value.

    Raises
    ------
    InputError
        If a text is no angle.
    """
    if not isinstance(value, str):
        return value
    number, _, unit = value.strip().replace("°", " deg").partition(" ")
    try:
        angle = float(number) * _RADIANS[unit.strip()]
    except (KeyError, ValueError):
        angle = math.nan
    if not math.isfinite(angle):
        raise InputError(
            f"{name} must be an angle in rad or deg, got '{shortened(value)}'; write it "
            "like '5 deg'"
        )
    return angle
