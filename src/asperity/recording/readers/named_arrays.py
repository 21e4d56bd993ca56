"""Named arrays, as HDF5 and MATLAB files hold them, to columns: vectors, tables and their texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from asperity.recording.readers.raw import RawColumn, interval_of

#: Names of the lists that name the columns of a matrix, or their units.
_NAMES = frozenset({"columns", "columnnames", "names", "channels", "channelnames", "labels"})
_NAMES |= {"headers", "header", "varnames", "variablenames"}
_UNITS = frozenset({"units", "unit", "columnunits", "channelunits", "unitnames"})
_MOST_COLUMNS = 256


def plain(name: str) -> str:
    """A name in lower case without separators, to be looked up."""
    return name.lower().replace("_", "").replace(" ", "")


def columns_of(name: str, values: Any, attributes: Mapping[str, Any]) -> list[RawColumn]:
    """Columns of one array: itself if it is a vector, the fields of a table, or those of a matrix.

    Parameters
    ----------
    name : str
        Name of the array.
    values : array
        Of one or two dimensions; anything else is no recording.
    attributes : mapping
        What stands beside the array: lists of names and of units count for a matrix.
    """
    array = np.asarray(values)
    if array.dtype.names:
        flat = array.reshape(-1)
        units = texts_in(attributes, _UNITS, len(array.dtype.names))
        return [
            RawColumn(field, np.ascontiguousarray(flat[field]), unit)
            for field, unit in zip(array.dtype.names, units or [""] * flat.size, strict=False)
            if flat[field].dtype.kind in "iuf" and flat[field].ndim == 1
        ]
    if array.dtype.kind not in "iuf":
        return []
    array = np.squeeze(array)
    if array.ndim == 1 and array.size > 1:
        unit = texts_in(attributes, _UNITS, 1)
        return [RawColumn(name, array, unit[0] if unit else None)]
    if array.ndim != 2 or min(array.shape) > _MOST_COLUMNS:
        return []
    # Rows are samples, of which a recording has more than channels.
    matrix = array if array.shape[0] >= array.shape[1] else array.T
    width = matrix.shape[1]
    names = texts_in(attributes, _NAMES, width) or [f"{name}[{i}]" for i in range(width)]
    units = texts_in(attributes, _UNITS, width)
    return [
        RawColumn(names[i], np.ascontiguousarray(matrix[:, i]), units[i] if units else None)
        for i in range(width)
    ]


def texts_in(
    attributes: Mapping[str, Any], wanted: frozenset[str], number: int
) -> list[str] | None:
    """The list of so many texts among `attributes` under one of the wanted names."""
    for name, value in attributes.items():
        if plain(name) in wanted:
            texts = as_texts(value)
            if texts is not None and len(texts) == number:
                return texts
    return None


def as_texts(value: Any) -> list[str] | None:
    """A value as a list of texts: one text, or an array of texts; None for anything else."""
    if isinstance(value, bytes):
        return [value.decode("utf-8", errors="replace")]
    if isinstance(value, str):
        parts = [p.strip() for p in value.split(",")]
        return parts if len(parts) > 1 else [value]
    if not isinstance(value, np.ndarray | Sequence) or np.asarray(value).dtype.kind not in "OSU":
        return None
    found = [
        v.decode("utf-8", errors="replace") if isinstance(v, bytes) else v
        for v in np.asarray(value).reshape(-1).tolist()
    ]
    return found if found and all(isinstance(v, str) for v in found) else None


def group_columns(
    arrays: Mapping[str, Any], attributes: Mapping[str, Mapping[str, Any]] | None = None
) -> tuple[list[RawColumn], float | None]:
    """Columns and sampling interval of the arrays of one group.

    Units may stand in an array's attributes, in a text beside it called like it with ``_unit`` or
    ``_units`` behind, or in a group ``units`` with a text of its name.
    """
    beside = {key: v for key, v in arrays.items() if as_texts(v) is not None}
    inner = next(
        (v for k, v in arrays.items() if plain(k) in _UNITS and isinstance(v, Mapping)), {}
    )
    columns = []
    for name, values in arrays.items():
        if isinstance(values, Mapping) or name in beside:
            continue
        own = {**beside, **(attributes or {}).get(name, {})}
        for key in (f"{name}_unit", f"{name}_units"):
            if key in beside:
                own = {"units": beside[key], **own}
        if name in inner:
            own = {"units": inner[name], **own}
        columns += columns_of(name, values, own)
    return columns, interval_of({k: v for k, v in arrays.items() if np.size(v) == 1})
