"""The file of a run as text, and its extremes over intervals of time; read in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from asperity.outputs import output_file, written_file
from asperity.protocol.growing_file import CHUNKS

#: Columns of the text, with the heading of each.
_COLUMNS = {
    "time": "time (s)",
    "load": "normal load (N)",
    "force": "shear force (N)",
    "friction": "friction",
    "velocity": "velocity (m/s)",
    "slip_velocity": "plastic velocity (m/s)",
    "displacement": "displacement (m)",
}

#: Rows read at a time.
_ROWS = 4 * CHUNKS["time"]


@dataclass(frozen=True, eq=False)
class RunOutline:
    """Extremes of a run over intervals of time, and its events, for a figure.

    Attributes
    ----------
    time : array, shape (n,)
        Middle of each stretch (s).
    low, high : dict of str to array, shape (n,)
        Extremes of ``load``, ``force``, ``velocity`` over each stretch, in SI.
    events : list of (float, str)
        Time (s) and kind.
    title : str
    law : str
    """

    time: NDArray[np.float64]
    low: dict[str, NDArray[np.float64]]
    high: dict[str, NDArray[np.float64]]
    events: list[tuple[float, str]]
    title: str
    law: str


def write_csv(run: str | Path, out: str | Path) -> Path:
    """Write the rows of a run as comma-separated text with units in the headings.

    Parameters
    ----------
    run : str or path
        NetCDF file of `run_protocol`.
    out : str or path

    Raises
    ------
    InputError
        If `out` cannot be written.
    """
    target = output_file(out, "--csv", example="run.csv", inputs={"run": run})
    with (
        written_file(target, "--csv") as file,
        file.open("w", encoding="utf-8", newline="\n") as stream,
    ):
        stream.write(",".join(_COLUMNS.values()) + "\n")
        for block in _blocks(Path(run)):
            rows = np.column_stack([block[name] for name in _COLUMNS])
            np.savetxt(stream, rows, "%.12g", ",")
    return Path(out)


def outline(run: str | Path, stretches: int = 2000) -> RunOutline:
    """Extremes of load, force and velocity over stretches of equal length.

    Parameters
    ----------
    run : str or path
        NetCDF file of `run_protocol`.
    stretches : int
        At most; fewer where there are fewer rows.
    """
    import h5netcdf

    with h5netcdf.File(run, "r") as file:
        time = file.variables["time"]
        first, last, rows = float(time[0]), float(time[-1]), time.shape[0]
        kinds = [k.decode() if isinstance(k, bytes) else k for k in file.variables["event_kind"][:]]
        events = list(zip(map(float, file.variables["event_time"][:]), kinds, strict=True))
        title, law = str(file.attrs["title"]), str(file.attrs["law"])
    count = max(1, min(stretches, rows))
    names = ("load", "force", "velocity")
    low = {name: np.full(count, np.inf) for name in names}
    high = {name: np.full(count, -np.inf) for name in names}
    width = (last - first) / count or 1.0
    for block in _blocks(Path(run)):
        index = np.minimum(((block["time"] - first) / width).astype(int), count - 1)
        for name in names:
            np.minimum.at(low[name], index, block[name])
            np.maximum.at(high[name], index, block[name])
    filled = np.isfinite(low["load"])
    middle = first + width * (np.arange(count) + 0.5)
    return RunOutline(
        middle[filled],
        {name: values[filled] for name, values in low.items()},
        {name: values[filled] for name, values in high.items()},
        events,
        title,
        law,
    )


def _blocks(run: Path) -> Iterator[dict[str, NDArray[np.float64]]]:
    import h5netcdf

    with h5netcdf.File(run, "r") as file:
        rows = file.variables["time"].shape[0]
        for begin in range(0, rows, _ROWS):
            yield {n: np.asarray(file.variables[n][begin : begin + _ROWS]) for n in _COLUMNS}
