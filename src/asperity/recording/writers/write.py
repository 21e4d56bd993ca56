"""One door for all formats that are written."""

from __future__ import annotations

import importlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError, closest
from asperity.outputs import output_file, written_file
from asperity.units import KINDS

if TYPE_CHECKING:
    from asperity.recording.trace import Trace

_FORMATS = {
    ".csv": "text",
    ".txt": "text",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".tdms": "tdms",
}


def write(
    trace: Trace,
    path: str | os.PathLike[str],
    *,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Write a recording as a laboratory would; `asperity.recording.read` reads it back.

    Parameters
    ----------
    trace : Trace
    path : str or path
        ``.csv`` (comma separated), ``.txt`` (tabs), ``.h5`` or ``.hdf5``, ``.tdms``.
    units : mapping of str to str, optional
        Unit in which a channel is written, by name, such as ``{"load": "kN"}``; SI by default.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the format is unknown, a unit does not fit, or the file cannot be written.
    """
    file = check_path(path)
    for name in units or {}:
        if name not in trace.channels:
            raise InputError(
                f"write.units must name channels, got '{name}'; {closest(name, trace.channels)}"
            )
    columns = _columns(trace, units or {})
    name = _FORMATS[file.suffix.lower()]
    module: Any = importlib.import_module(f"asperity.recording.writers.{name}")
    target = output_file(file, "write.path", example="recording.csv")
    with written_file(target, "write.path") as complete:
        module.save(trace, columns, complete)
    return file


def check_path(path: str | os.PathLike[str]) -> Path:
    """The path, if its end names a format; raises `InputError` if not."""
    file = Path(path)
    if file.suffix.lower() not in _FORMATS:
        raise InputError(
            f"write.path must end in the name of a format, got '{file.name}'; "
            f"{closest(file.suffix.lower(), _FORMATS)}"
        )
    return file


def _columns(trace: Trace, units: Mapping[str, str]) -> dict[str, tuple[str, NDArray[np.float64]]]:
    """Unit and values of each channel, as they are to be written."""
    columns = {}
    for name, channel in trace.channels.items():
        if channel.kind is None:
            columns[name] = (channel.recorded_unit, channel.values)
            continue
        unit = units.get(name, KINDS[channel.kind].si)
        values = channel.values if unit == channel.unit else channel.to(unit)
        columns[name] = (unit, values)
    return columns


def interval(trace: Trace) -> float | None:
    """Seconds between the samples of an even clock, None for one that is not."""
    rate = trace.sample_rate
    return None if rate is None else 1 / rate
