"""Mistakes that pydantic finds in a record, worded as every other bad input is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel

from asperity.errors import InputError, MistakesError, closest
from asperity.parameters.arguments import shown as shown_value

#: Characters of a part of a field's place.
_LONGEST = 60
_TYPES = frozenset({"bool", "float", "int", "str"})


def shown(value: Any) -> str:
    """A value of a record in a few words for a message."""
    if isinstance(value, Mapping):
        return f"a table of {len(value)} fields"
    return shown_value(value)


def worded(
    mistake: Mapping[str, Any],
    subject: str,
    models: Mapping[str, type[BaseModel]] | None = None,
    *,
    prefix: str = "",
    shown: Callable[[Any], str] = shown,
) -> list[str]:
    """A mistake as ``<field> must <rule>, got <value>; <what to do>``.

    Parameters
    ----------
    mistake : mapping
        One of ``ValidationError.errors()``.
    subject : str
        What is mistaken where no field is named, such as ``"protocol"``.
    models : mapping of str to type of BaseModel, optional
        Model of each table of the record, its own under ``""``, to suggest names of fields.
    prefix : str
        What stands before the place of a field.
    shown : callable
        Words for a value.

    Returns
    -------
    list of str
        One, or all that a validator of the record itself has found.
    """
    error = mistake.get("ctx", {}).get("error")
    if isinstance(error, MistakesError):
        return list(error.mistakes)
    if isinstance(error, InputError):
        return [str(error)]
    place = [str(part)[:_LONGEST] for part in mistake["loc"]]
    # Of a field that may be of several types pydantic names each of them.
    if len(place) > 1 and place[-1] in _TYPES:
        place.pop()
    field = prefix + ".".join(place) if place else subject
    if mistake["type"] == "missing":
        return [f"{field} must be given, got nothing; add it"]
    value = shown(mistake["input"])
    if mistake["type"] == "extra_forbidden":
        model = (models or {}).get(place[0] if len(place) > 1 else "")
        known = {} if model is None else model.model_fields
        names = [f.alias or name for name, f in known.items()]
        advice = closest(place[-1], names) if names else "leave it out"
        return [f"{field} must be a known field, got {value}; {advice}"]
    if mistake["type"] == "value_error":
        # Raised by a validator of the record, which leaves only the field to be named.
        return [f"{field} must {error}"]
    rule = " ".join(mistake["msg"].split()).removeprefix("Input should be ")
    return [f"{field} must be {rule}, got {value}; correct the value"]
