"""TDMS, the format of LabVIEW, written by npTDMS: one group, waveforms of one clock."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import InputError
from asperity.recording.writers.write import interval

if TYPE_CHECKING:
    from asperity.recording.trace import Trace

_GROUP = "recording"


def save(trace: Trace, columns: Mapping[str, tuple[str, NDArray[np.float64]]], path: Path) -> None:
    """Write channels as waveforms; an uneven clock is a channel of its own."""
    try:
        import nptdms
    except ImportError:
        raise InputError(
            f"write.path must be in a format that can be written here, got '{path.name}', which "
            "is TDMS; install npTDMS, as 'pip install asperity[lab]' does"
        ) from None
    step = interval(trace)
    clock: dict[str, Any] = {}
    if step is not None:
        start = float(trace.time[0])
        clock = {"wf_increment": step, "wf_start_offset": start, "wf_samples": len(trace)}
    channels = [
        nptdms.ChannelObject(_GROUP, name, np.asarray(values), {**clock, "unit_string": unit})
        for name, (unit, values) in columns.items()
    ]
    if step is None:
        stamps = {"unit_string": "s"}
        channels.insert(0, nptdms.ChannelObject(_GROUP, "time", np.asarray(trace.time), stamps))
    title = nptdms.RootObject({"name": str(trace.provenance.get("title", ""))})
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment([title, nptdms.GroupObject(_GROUP), *channels])
