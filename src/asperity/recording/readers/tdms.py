"""TDMS, the format of LabVIEW, read by npTDMS."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import InputError, known_as
from asperity.recording.finding import Finding
from asperity.recording.readers.raw import (
    Group,
    RawColumn,
    RawRecording,
    Stated,
    beginning,
    interval_of,
    one_recording,
    truncated,
    unusable,
)

#: Properties that hold the unit of a channel.
_UNITS = ("units", "unit", "Units", "Unit", "UNITS", "UNIT", "unit_string", "NI_UnitDescription")


def is_format(path: Path) -> bool:
    """Recognise the mark of a segment, or of its index."""
    return beginning(path).startswith((b"TDSm", b"TDSh"))


def read(path: Path, *, group: str | None = None) -> RawRecording:
    """Columns of a TDMS file; of one that is cut, the rows that all channels have.

    Parameters
    ----------
    path : Path
        The file.
    group : str or None
        The group to read, where they differ in length.
    """
    nptdms = library("recording", "be in a format that can be read here", path)
    with _quiet(nptdms):
        file = nptdms.TdmsFile.read(path)
        members = {member.name: member.channels() for member in file.groups()}
        wanted = (group or "").strip("/")
        read_channels = members.get(wanted) or [c for every in members.values() for c in every]
        begin = min((t for c in read_channels if (t := _begin(c)) is not None), default=None)
        groups = {name: _group(channels, begin) for name, channels in members.items()}
    if not any(columns for columns, _ in groups.values()):
        raise unusable(path, "which is cut before its first channel, or has none")
    findings: list[Finding] = []
    if file.file_status.incomplete_final_segment:
        groups, finding = _whole_rows(path, groups)
        findings.append(finding)
    provenance = {"format": "tdms", "title": str(file.properties.get("name", ""))}
    return one_recording(groups, path, group, provenance, findings)


def library(name: str, rule: str, path: Path) -> Any:
    """npTDMS; `InputError` about a file, its argument and rule, where it is not installed."""
    try:
        import nptdms
    except ImportError:
        advice = "install npTDMS, as 'pip install asperity[lab]' does"
        raise InputError(name, rule, f"'{known_as(path).name}', which is TDMS", advice) from None
    return nptdms


@contextmanager
def _quiet(nptdms: Any) -> Iterator[None]:
    """Suppress the log of the library about cut files; a finding reports them."""
    manager = nptdms.log.log_manager
    level = manager.log_level
    manager.set_level(logging.ERROR)
    try:
        yield
    finally:
        manager.set_level(level)


def _begin(channel: Any) -> np.datetime64 | None:
    """Date and time to which the clock of a waveform refers; None without."""
    about = channel.properties
    begin = about.get("wf_start_time") if "wf_increment" in about else None
    return begin if isinstance(begin, np.datetime64) and not np.isnat(begin) else None


def _group(channels: list[Any], begin: np.datetime64 | None) -> Group:
    """Columns of channels, and the clocks of those that are waveforms, in seconds since `begin`."""
    columns, clocks = [], []
    for channel in channels:
        about = channel.properties
        values = np.asarray(channel[:] if len(channel) else np.empty(0))
        unit = next((u for n in _UNITS if isinstance(u := about.get(n), str)), None)
        columns.append(RawColumn(channel.name, values, unit))
        step = interval_of({"dt": about.get("wf_increment")})
        if step is not None:
            start = float(about.get("wf_start_offset", 0.0))
            if begin is not None and (own := _begin(channel)) is not None:
                start += float((own - begin) / np.timedelta64(1, "s"))
            clocks.append(Stated(start, step, values.size))
    return Group(columns, clocks)


def _whole_rows(path: Path, groups: dict[str, Group]) -> tuple[dict[str, Group], Finding]:
    """Columns of each group cut to the shortest, and the finding that says so."""
    cut = {}
    lost = 0
    for name, (columns, clocks) in groups.items():
        filled = [c for c in columns if c.values.size]
        if not filled:
            continue
        rows = [c.values.size for c in filled]
        kept = min(rows)
        lost += sum(rows) - kept * len(rows)
        cut[name] = Group(
            [RawColumn(c.label, c.values[:kept], c.unit) for c in filled],
            [clock._replace(rows=kept) for clock in clocks if clock.rows],
        )
    if not cut:
        raise unusable(path, "which is cut before its first value")
    sentence = "its last segment is not whole; the rows that all channels have were read."
    last = min(group.columns[0].values.size for group in cut.values())
    return cut, truncated(lost, f"row {last}", sentence)
