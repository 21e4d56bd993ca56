"""Strict JSON: arrays as lists, and numbers that are not finite as null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


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


def json_content(file: Path) -> Any:
    """Content of a JSON file of this package; None if it is missing or damaged.

    Devices and pipes have no end, and count as damaged.
    """
    try:
        return json.loads(file.read_bytes()) if file.is_file() else None
    except (OSError, ValueError, RecursionError):
        return None
