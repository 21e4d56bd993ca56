"""Steps that follow a recorded load or velocity."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from asperity.errors import InputError, closest
from asperity.loads import Follow
from asperity.recording import read
from asperity.recording.rounded_time import even_times

#: What a recording can prescribe: the role of its channel, and the kind that it must be of.
_CHANNELS = {"load": ("W", "force"), "velocity": ("velocity", "velocity")}

#: Findings that make a recording unusable here: interpolation would hide them.
_UNUSABLE = frozenset({"gap", "truncated", "malformed row", "repeated time", "backward time"})


def follow(channels: str, file: str, folder: Path) -> Follow:
    """The step that follows channels of a recording.

    Parameters
    ----------
    channels : str
        ``load``, ``velocity``, or both joined by ``and``.
    file : str
        Any recording that `asperity.recording.read` reads; relative to `folder`.
    folder : Path

    Raises
    ------
    InputError
        If the recording cannot be read, lacks a channel or its unit, or is not whole.
    """
    names = [name.strip().lower() for name in channels.split(" and ")]
    for name in names:
        if name not in _CHANNELS:
            raise InputError(
                f"follow must name what is followed, got '{name}'; {closest(name, _CHANNELS)}"
            )
    path = Path(file.strip("\"'"))
    trace = read(path if path.is_absolute() else folder / path)
    for finding in trace.findings:
        if finding.name in _UNUSABLE:
            raise InputError(
                f"follow must take a recording without '{finding.name}', got '{path.name}': "
                f"{finding.sentence} Cut it to a part that is whole"
            )
    values: dict[str, np.ndarray] = {}
    for name in names:
        role, kind = _CHANNELS[name]
        channel = trace.channel(role)
        if channel.kind != kind:
            raise InputError(
                f"follow must take the {name} from a channel of its unit, got "
                f"'{channel.recorded_name}' in '{channel.recorded_unit}' of '{path.name}'; "
                "write the unit into its heading, as in 'load (N)' or 'velocity (um/s)'"
            )
        values[name] = channel.values
    finite = np.isfinite(trace.time)
    for column in values.values():
        finite &= np.isfinite(column)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputError(
            f"follow must have a number in every row, got none in row {row} of '{path.name}'; "
            "cut or fill the recording first"
        )
    return Follow(even_times(trace.time), values.get("load"), values.get("velocity"))
