"""MATLAB files of version 5 and older; those of version 7.3 are HDF5."""

from __future__ import annotations

import io
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.instrument.finding import Finding
from asperity.instrument.readers.matlab_elements import is_sound
from asperity.instrument.readers.named_arrays import group_columns
from asperity.instrument.readers.recorded import (
    Column,
    Recorded,
    one_table,
    refuse_truncated,
    truncated,
)

_HEADER = 128


def load(path: Path, group: str | None = None) -> Recorded:
    """Columns of a MAT file; of one that is cut, the variables before the cut.

    Parameters
    ----------
    path : Path
        The file.
    group : str or None
        The struct to read, where several hold recordings.
    """
    import scipy.io

    raw = path.read_bytes()
    raw, findings = _whole_variables(path, raw)
    try:
        variables = scipy.io.loadmat(io.BytesIO(raw), simplify_cells=True)
    # The library raises whatever the damage makes of the data: type, value, memory, zlib errors.
    except Exception:
        raise refuse_truncated(path, "which is damaged or not whole") from None
    groups: dict[str, list[Column]] = {}
    steps: list[float | None] = []
    _visit({k: v for k, v in variables.items() if not k.startswith("__")}, "", groups, steps)
    columns, left_out = one_table(groups, path, group)
    step = next((s for s in steps if s is not None), None)
    provenance = {"format": "matlab 5", "group": group or ""}
    return Recorded(columns, findings + left_out, provenance, step=step)


def _visit(
    arrays: Mapping[str, Any],
    name: str,
    groups: dict[str, list[Column]],
    steps: list[float | None],
) -> None:
    groups[name], step = group_columns(arrays)
    steps.append(step)
    for key, value in arrays.items():
        if isinstance(value, Mapping):
            _visit(value, f"{name}/{key}".strip("/"), groups, steps)


def _whole_variables(path: Path, raw: bytes) -> tuple[bytes, list[Finding]]:
    """The file up to the last variable that is whole: each begins with its type and its size."""
    # Version 4 has no header; the library goes by these two bytes.
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:128])
    if order is None or 0 in raw[:4]:
        return raw, []
    position = _HEADER
    count = 0
    while position + 8 <= len(raw):
        _, size = struct.unpack_from(f"{order}II", raw, position)
        if position + 8 + size > len(raw):
            break
        position += 8 + size
        count += 1
    missing = len(raw) - position
    if not count:
        raise refuse_truncated(path, "which is cut within its first variable")
    if not is_sound(raw[:position], _HEADER, order):
        raise refuse_truncated(path, "which is damaged")
    if not missing:
        return raw, []
    where = f"byte {position}"
    sentence = f"variables behind the first {count} are not whole, and were left out."
    return raw[:position], [truncated(path, missing, where, sentence)]
