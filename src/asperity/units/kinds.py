"""Kinds of quantities of inputs and outputs, with their SI unit and display units."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from asperity.errors import InputTypeError, require_known


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
    also : mapping of str to int
        Further units that `to_si` reads without loading pint.
    """

    noun: str
    si: str
    example: str
    ladder: tuple[tuple[str, int], ...]
    also: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))


_TABLE = tomllib.loads(files("asperity.units").joinpath("kinds.toml").read_text("utf-8"))
#: All kinds of quantities.
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        name: Kind(**{**fields, "ladder": tuple(fields["ladder"].items())})
        for name, fields in _TABLE.items()
    }
)


def shown(value: Any) -> str:
    """A value of any kind in a few words for a message."""
    if value is None or isinstance(value, bool | int | float | np.generic):
        if isinstance(value, int) and abs(value) > 10**30:
            return "a huge integer"
        return repr(value.item() if isinstance(value, np.generic) else value)
    if isinstance(value, str):
        return f"'{value}'" if len(value) < 60 else f"a text of {len(value)} characters"
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(getattr(value, "shape", None), tuple):
        kind = getattr(value, "dtype", np.dtype(float))
        numbers = getattr(kind, "kind", "f") in "iuf"
        return f"an array of {'' if numbers else f'{kind} of '}shape {value.shape}"
    if isinstance(value, list | tuple):
        return f"a {type(value).__name__} of {len(value)}"
    if callable(value):
        return f"the function {getattr(value, '__name__', type(value).__name__)}"
    return with_article(type(value).__name__)


def with_article(name: str) -> str:
    """A noun with "a" or "an"."""
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def require_text(value: object, name: str) -> None:
    """Refuse any value but a text; this room cannot import `typed` of `asperity.parameters`."""
    if not isinstance(value, str):
        raise InputTypeError(name, "be a text", shown(value))


def kind_of(kind: str) -> Kind:
    """Look a kind up by name; an unknown name raises `InputError`."""
    require_text(kind, "units.kind")
    require_known(kind, KINDS, "units.kind", "be a kind of quantity")
    return KINDS[kind]
