"""Strict JSON: arrays as lists, numbers that are not finite as null, and every key once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError, printable


def to_json(value: Any, *, indent: int | None = None) -> str:
    """JSON, in one line without blanks unless an indent is given."""
    separators = (",", ":") if indent is None else None
    return json.dumps(
        plain(value), allow_nan=False, separators=separators, indent=indent, ensure_ascii=False
    )


def plain(value: Any) -> Any:
    """A tree of JSON types.

    Complex arrays become pairs of real and imaginary part along a last axis.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    array = np.asarray(value)
    if array.dtype.kind == "c":
        return plain(np.stack([array.real, array.imag], axis=-1))
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return plain(array.tolist())
    return array.tolist()


def parsed_json(
    text: str | bytes, label: str, parse_constant: Callable[[str], Any] | None = None
) -> Any:
    """The value of a JSON text.

    Parameters
    ----------
    text : str or bytes
    label : str
        Name of the text in messages.
    parse_constant : callable, optional
        As for `json.loads`.

    Raises
    ------
    InputError
        If an object has a key twice: `json.loads` would use the last value without a warning.
    ValueError, RecursionError
        If the text is no JSON, or is nested too deeply.
    """

    def named_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(pairs)
        if len(value) < len(pairs):
            names = [name for name, _ in pairs]
            twice = printable(next(name for name in value if names.count(name) > 1), 60)
            raise InputError(label, "name every key once", f"'{twice}' twice", "leave one out")
        return value

    return json.loads(text, object_pairs_hook=named_once, parse_constant=parse_constant)


def json_content(file: Path) -> Any:
    """Content of a JSON file of this package; None if it is missing or damaged.

    Devices and pipes have no end, and count as damaged.
    """
    try:
        return parsed_json(file.read_bytes(), str(file)) if file.is_file() else None
    except (OSError, ValueError, RecursionError):
        return None
