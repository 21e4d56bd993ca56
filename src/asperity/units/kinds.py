"""Kinds of quantities of inputs and outputs, with their SI unit and display units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from asperity.errors import InputError, closest


@dataclass(frozen=True)
class Kind:
    """A kind of quantity: dimension, units and examples.

    Attributes
    ----------
    noun : str
        Noun in messages, with its article.
    si : str
        SI unit in pint's spelling; empty for a pure number.
    example : str
        A text that `to_si` accepts.
    ladder : tuple of (str, int)
        Units to display in, smallest first, each with its power of ten over the SI unit;
        `to_si` reads them without loading pint.
    """

    noun: str
    si: str
    example: str
    ladder: tuple[tuple[str, int], ...]


#: All kinds of quantities.
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "velocity": Kind(
            "a velocity",
            "m/s",
            "1 um/s",
            (("pm/s", -12), ("nm/s", -9), ("um/s", -6), ("mm/s", -3), ("m/s", 0)),
        ),
        "frequency": Kind(
            "a frequency",
            "Hz",
            "120 Hz",
            (("uHz", -6), ("mHz", -3), ("Hz", 0), ("kHz", 3), ("MHz", 6)),
        ),
        "angular_frequency": Kind("an angular frequency", "rad/s", "360 rad/s", (("rad/s", 0),)),
        "force": Kind(
            "a force", "N", "7 N", (("uN", -6), ("mN", -3), ("N", 0), ("kN", 3), ("MN", 6))
        ),
        "stiffness": Kind(
            "a stiffness", "N/m", "0.2 N/um", (("mN/m", -3), ("N/m", 0), ("N/mm", 3), ("N/um", 6))
        ),
        # Of an apparatus whose load is a stress, and where friction alone is recorded.
        "stress_per_length": Kind(
            "a stiffness",
            "Pa/m",
            "0.06 MPa/um",
            (("Pa/m", 0), ("kPa/m", 3), ("MPa/m", 6), ("MPa/mm", 9)),
        ),
        "per_length": Kind("a stiffness over a load", "1/m", "0.003 1/um", (("1/um", 6),)),
        "damping": Kind(
            "a damping",
            "N*s/m",
            "500 N*s/m",
            (("N*s/m", 0), ("kN*s/m", 3), ("MN*s/m", 6)),
        ),
        "mass": Kind("a mass", "kg", "1.6 kg", (("mg", -6), ("g", -3), ("kg", 0))),
        "length": Kind(
            "a length",
            "m",
            "0.4 um",
            (("pm", -12), ("nm", -9), ("um", -6), ("mm", -3), ("m", 0), ("km", 3)),
        ),
        "area": Kind(
            "an area", "m^2", "49 cm^2", (("um^2", -12), ("mm^2", -6), ("cm^2", -4), ("m^2", 0))
        ),
        "pressure": Kind(
            "a pressure",
            "Pa",
            "100 kPa",
            (("mPa", -3), ("Pa", 0), ("kPa", 3), ("MPa", 6), ("GPa", 9)),
        ),
        "viscosity": Kind(
            "a viscosity", "Pa s", "18 uPa s", (("uPa s", -6), ("mPa s", -3), ("Pa s", 0))
        ),
        "time": Kind("a time", "s", "10 s", (("ns", -9), ("us", -6), ("ms", -3), ("s", 0))),
        "temperature": Kind("a temperature", "K", "300 K", (("mK", -3), ("K", 0))),
        "dimensionless": Kind("a pure number", "", "0.24 or 24 %", (("", 0),)),
    }
)


def kind_of(kind: str) -> Kind:
    """Look a kind up by name; an unknown name raises `InputError`."""
    try:
        return KINDS[kind]
    except KeyError:
        raise InputError(
            "units.kind", "be a kind of quantity", f"'{kind}'", closest(kind, KINDS)
        ) from None
