"""Text: a line of headings with units, then a row a sample."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from asperity.recording.trace import Trace

_ROWS = 100_000


def save(trace: Trace, columns: Mapping[str, tuple[str, NDArray[np.float64]]], path: Path) -> None:
    """Write times and columns; a pure number has no unit in its heading."""
    delimiter = "\t" if path.suffix.lower() == ".txt" else ","
    headings = [f"{name} ({unit})" if unit else name for name, (unit, _) in columns.items()]
    values = [trace.time, *(column for _, column in columns.values())]
    # Time stamps keep the digits of their interval however long the recording is.
    formats = ["%.15g", *["%.9g"] * len(columns)]
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(delimiter.join(["time (s)", *headings]) + "\n")
        for begin in range(0, len(trace), _ROWS):
            rows = np.column_stack([column[begin : begin + _ROWS] for column in values])
            np.savetxt(stream, rows, formats, delimiter)
