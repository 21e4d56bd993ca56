"""Kinds of quantities of inputs and outputs, with their SI unit and display units."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from asperity.errors import InputError, InputTypeError, closest


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


_TABLE = tomllib.loads(files("asperity.units").joinpath("kinds.toml").read_text("utf-8"))
#: All kinds of quantities.
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        name: Kind(**{**fields, "ladder": tuple(fields["ladder"].items())})
        for name, fields in _TABLE.items()
    }
)


def shown(value: Any) -> str:
    """A value as a line of text; arrays by their type."""
    if np.ndim(value):
        return f"an array of {np.asarray(value).dtype}"
    if value is None or isinstance(value, int | float):
        return repr(value)
    name = type(value).__name__
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def require_text(value: object, name: str) -> None:
    """Refuse what is no text; `asperity.parameters.arguments.typed` stands above this package."""
    if not isinstance(value, str):
        raise InputTypeError(name, "be a text", shown(value))


def kind_of(kind: str) -> Kind:
    """Look a kind up by name; an unknown name raises `InputError`."""
    require_text(kind, "units.kind")
    try:
        return KINDS[kind]
    except KeyError:
        rule = "be a kind of quantity"
        raise InputError("units.kind", rule, f"'{kind}'", closest(kind, KINDS)) from None
