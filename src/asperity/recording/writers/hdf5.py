"""HDF5: a dataset for time and for each channel, its unit in an attribute."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from asperity.recording.trace import Trace


def save(trace: Trace, columns: Mapping[str, tuple[str, NDArray[np.float64]]], path: Path) -> None:
    """Write double precision as it is; provenance goes into an attribute of the file."""
    import h5py

    with h5py.File(path, "w") as file:
        file.attrs["provenance"] = json.dumps(trace.provenance, default=str)
        file.create_dataset("time", data=trace.time).attrs["units"] = "s"
        for name, (unit, values) in columns.items():
            # A slash would make a group of the channel's name.
            made = file.create_dataset(name.replace("/", " per "), data=values)
            made.attrs["units"] = unit or "1"
