"""Writers of recordings in the formats of laboratories: text, HDF5 and TDMS."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Float
from asperity.errors import InputError, closest, require_known
from asperity.outputs import output_file, written_file
from asperity.parameters.arguments import typed
from asperity.recording.readers.units import split_labels
from asperity.recording.roles import candidates, words
from asperity.recording.trace import Trace
from asperity.units import KINDS

#: Unit and values of each channel in the file. The unit of a pure number is 1, an unknown one is
#: empty.
_Columns = Mapping[str, tuple[str, Float]]

#: Rows that are formatted at a time.
_ROWS = 100_000
#: Group of a TDMS file.
_GROUP = "recording"


@typed
def write(
    trace: Trace, path: str | os.PathLike[str], *, units: Mapping[str, str] | None = None
) -> Path:
    """Write a recording to a file, which `asperity.recording.read` reads back.

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
        require_known(name, trace.channels, "write.units", "name channels")
    columns = _columns(trace, units or {})
    target = output_file(file, "write.path", example="recording.csv")
    with written_file(target, "write.path") as complete:
        WRITERS[file.suffix.lower()](trace, columns, complete)
    return file


def check_path(path: str | os.PathLike[str], label: str = "write.path") -> Path:
    """The path, if its end names a format; raises `InputError` about `label` if not."""
    file = Path(path)
    if file.suffix.lower() not in WRITERS:
        advice = closest(file.suffix.lower(), WRITERS)
        raise InputError(label, "end in the name of a format", f"'{file.name}'", advice)
    return file


def _columns(trace: Trace, units: Mapping[str, str]) -> _Columns:
    columns = {}
    for name, channel in trace.channels.items():
        recorded = channel.recorded_unit if channel.kind is None else KINDS[channel.kind].si or "1"
        converted = channel.to(units[name]) if name in units else channel.values
        # Times that a rate of the user has replaced are not the clock of the file.
        kept = f"recorded {name}" if "".join(words(name)) in ("time", "t") else name
        columns[kept] = (units.get(name, recorded), converted)
    return columns


def _heading(name: str, unit: str) -> str:
    """Name with its unit in brackets; a pure number has none unless its name looks like one."""
    if unit != "1":
        return f"{name} ({unit})" if unit else name
    return name if split_labels([name]) == [(name, "")] else f"{name} (-)"


def _write_text(trace: Trace, columns: _Columns, path: Path) -> None:
    """A line of headings with units where there are some, then a row a sample."""
    delimiter = "\t" if path.suffix.lower() == ".txt" else ","
    headings = [_heading(name, unit) for name, (unit, _) in columns.items()]
    values = [trace.time, *(column for _, column in columns.values())]
    # Time stamps keep the digits of their interval however long the recording is.
    formats = ["%.15g", *["%.9g"] * len(columns)]
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        # A name that holds the delimiter stands in quotes.
        csv.writer(stream, delimiter=delimiter, lineterminator="\n").writerow(
            ["time (s)", *headings]
        )
        for begin in range(0, len(trace), _ROWS):
            rows = np.column_stack([column[begin : begin + _ROWS] for column in values])
            np.savetxt(stream, rows, formats, delimiter)


def _write_hdf5(trace: Trace, columns: _Columns, path: Path) -> None:
    """A dataset for time and each channel with its unit in an attribute, and the provenance."""
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["provenance"] = json.dumps(trace.provenance, default=str)
        file.create_dataset("time", data=trace.time).attrs["units"] = "s"
        for name, (unit, values) in columns.items():
            # A slash would make a group of the channel's name.
            made = file.create_dataset(name.replace("/", " per "), data=values)
            made.attrs["units"] = unit


def _write_tdms(trace: Trace, columns: _Columns, path: Path) -> None:
    """One group of waveforms of one clock.

    A clock that is uneven, or not the only one, is a further channel.
    """
    from asperity.recording.readers.tdms import library

    nptdms = library("write.path", "be in a format that can be written here", path)
    rate = trace.sample_rate
    clock: dict[str, Any] = {}
    if rate is not None:
        start = float(trace.time[0])
        clock = {"wf_increment": 1 / rate, "wf_start_offset": start, "wf_samples": len(trace)}
    channels = [
        nptdms.ChannelObject(_GROUP, name, np.asarray(values), {**clock, "unit_string": unit})
        for name, (unit, values) in columns.items()
    ]
    if rate is None or candidates("time", dict.fromkeys(columns)):
        stamps = {"unit_string": "s"}
        channels.insert(0, nptdms.ChannelObject(_GROUP, "time", np.asarray(trace.time), stamps))
    title = nptdms.RootObject({"name": str(trace.provenance.get("title", ""))})
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([title, nptdms.GroupObject(_GROUP), *channels])


#: Writers of files by their suffix.
WRITERS: dict[str, Callable[[Trace, _Columns, Path], None]] = {
    ".csv": _write_text,
    ".txt": _write_text,
    ".h5": _write_hdf5,
    ".hdf5": _write_hdf5,
    ".tdms": _write_tdms,
}
