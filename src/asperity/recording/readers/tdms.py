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
    RawColumn,
    RawRecording,
    beginning,
    interval_of,
    one_table,
    refuse_truncated,
    truncated,
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
        channels = {g.name: g.channels() for g in file.groups()}
        groups = {name: [_column(c) for c in inside] for name, inside in channels.items()}
    if not any(groups.values()):
        raise refuse_truncated(path, "which is cut before its first channel, or has none")
    findings: list[Finding] = []
    if file.file_status.incomplete_final_segment:
        groups, finding = _whole_rows(path, groups)
        findings.append(finding)
    columns, left_out = one_table(groups, path, group, findings)
    used = channels[group.strip("/")] if group else [c for f in channels.values() for c in f]
    start, step = _clock([c.properties for c in used], path)
    provenance = {
        "format": "tdms",
        "group": group or "",
        "title": str(file.properties.get("name", "")),
    }
    return RawRecording(columns, findings + left_out, provenance, start, step)


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


def _column(channel: Any) -> RawColumn:
    values = channel[:] if len(channel) else np.empty(0)
    unit = next((u for n in _UNITS if isinstance(u := channel.properties.get(n), str)), None)
    return RawColumn(channel.name, np.asarray(values), unit)


def _whole_rows(
    path: Path, groups: dict[str, list[RawColumn]]
) -> tuple[dict[str, list[RawColumn]], Finding]:
    """Columns of each group cut to the shortest, and the finding that says so."""
    cut = {}
    lost = 0
    for name, columns in groups.items():
        rows = [c.values.size for c in columns if c.values.size]
        if not rows:
            continue
        kept = min(rows)
        lost += sum(rows) - kept * len(rows)
        cut[name] = [RawColumn(c.label, c.values[:kept], c.unit) for c in columns if c.values.size]
    if not cut:
        raise refuse_truncated(path, "which is cut before its first value")
    sentence = "its last segment is not whole; the rows that all channels have were read."
    last = min(columns[0].values.size for columns in cut.values())
    return cut, truncated(lost, f"row {last}", sentence)


def _clock(properties: list[Any], path: Path) -> tuple[float, float | None]:
    """Start and interval of the waveforms, which must be one clock."""
    stated = (interval_of({"dt": p["wf_increment"]}) for p in properties if "wf_increment" in p)
    steps = {step for step in stated if step is not None}
    if not steps:
        return 0.0, None
    if len(steps) > 1:
        listed = " and ".join(f"{s:g} s" for s in sorted(steps))
        rule, got = (
            "be chosen where channels differ in interval",
            f"{listed} in '{known_as(path).name}'",
        )
        raise InputError("read.group", rule, got, "choose a group, or give rate= to override them")
    starts = [float(p.get("wf_start_offset", 0.0)) for p in properties if "wf_increment" in p]
    return starts[0], steps.pop()
