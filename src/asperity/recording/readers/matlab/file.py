"""MATLAB files of version 5 and older; those of version 7.3 are HDF5."""

from __future__ import annotations

import io
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.recording.finding import Finding
from asperity.recording.readers.matlab.version_4 import whole_part
from asperity.recording.readers.matlab.version_5 import is_sound
from asperity.recording.readers.named_arrays import group_columns
from asperity.recording.readers.raw import (
    RawColumn,
    RawRecording,
    one_table,
    refuse_truncated,
    truncated,
)

_HEADER = 128


def load(path: Path, group: str | None = None) -> RawRecording:
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
    groups: dict[str, list[RawColumn]] = {}
    steps: list[float | None] = []
    _visit({k: v for k, v in variables.items() if not k.startswith("__")}, "", groups, steps)
    columns, left_out = one_table(groups, path, group, findings)
    step = next((s for s in steps if s is not None), None)
    provenance = {"format": "matlab 5", "group": group or ""}
    return RawRecording(columns, findings + left_out, provenance, step=step)


def _visit(
    arrays: Mapping[str, Any],
    name: str,
    groups: dict[str, list[RawColumn]],
    steps: list[float | None],
) -> None:
    groups[name], step = group_columns(arrays)
    steps.append(step)
    for key, value in arrays.items():
        if isinstance(value, Mapping):
            _visit(value, f"{name}/{key}".strip("/"), groups, steps)


def _whole_variables(path: Path, raw: bytes) -> tuple[bytes, list[Finding]]:
    """The file up to the last variable that is whole: each begins with its type and its size."""
    # Version 4 has no header: a zero in the first four bytes tells it, as the library has it.
    if 0 in raw[:4]:
        return _whole_of_version_4(path, raw)
    order = {b"IM": "<", b"MI": ">"}.get(raw[126:128])
    if order is None:
        why = "which ends within its header" if len(raw) < _HEADER else "whose header is damaged"
        raise refuse_truncated(path, why)
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
    return raw[:position], [_cut(path, position, count, missing)]


def _whole_of_version_4(path: Path, raw: bytes) -> tuple[bytes, list[Finding]]:
    whole = whole_part(raw)
    missing = len(raw) - whole.stop
    if not whole.variables:
        why = "is damaged" if whole.damaged else "is cut within its first variable"
        raise refuse_truncated(path, f"which {why}")
    if not missing:
        return raw, []
    if not whole.damaged:
        return raw[: whole.stop], [_cut(path, whole.stop, whole.variables, missing)]
    said = (
        f"{path.name} is damaged behind its first {whole.variables} variables; what follows, "
        f"{missing} bytes, was left out."
    )
    found = Finding("damaged", "error", missing, f"byte {whole.stop}", said)
    return raw[: whole.stop], [found]


def _cut(path: Path, position: int, count: int, missing: int) -> Finding:
    sentence = f"variables behind the first {count} are not whole, and were left out."
    return truncated(path, missing, f"byte {position}", sentence)
