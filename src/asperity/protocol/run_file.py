"""The NetCDF file of a run: writing block by block, export as text, and outline for figures.

Memory does not grow with the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Float
from asperity.outputs import output_file, written_file
from asperity.outputs.atomic import writable
from asperity.parameters.arguments import FilePath, typed
from asperity.parameters.columns import readable

if TYPE_CHECKING:
    import xarray

#: Dimensions that grow, with the rows of a chunk on disk: a quarter of a megabyte each.
CHUNKS: Mapping[str, int] = {"time": 32_768, "event": 1024}

#: Columns of the text, with the heading of each.
_COLUMNS = {
    "time": "time (s)",
    "load": "normal load (N)",
    "force": "shear force (N)",
    "friction": "friction",
    "velocity": "velocity (m/s)",
    "slip_velocity": "plastic velocity (m/s)",
    "displacement": "displacement of the slider (m)",
    "load_point_displacement": "load point displacement (m)",
}

#: Rows read at a time.
_ROWS = 4 * CHUNKS["time"]


def append(path: Path, block: xarray.Dataset, done: Mapping[str, int]) -> None:
    """Append a block to the finished blocks; an unfinished block is overwritten.

    The file is closed again, so that it is whole and readable between blocks.

    Parameters
    ----------
    path : Path
        Created where nothing is done yet.
    block : xarray.Dataset
        Variables over ``time`` or ``event``, and further variables, which are written once.
    done : mapping of str to int
        Length of each growing dimension so far; empty at the beginning.

    Raises
    ------
    InputError
        If the file cannot be written or is damaged.
    """
    import h5netcdf

    with writable(path):
        if not done:
            # Without a fill value, which every reader would take for a missing row.
            stored: dict[Any, Any] = {name: {"_FillValue": None} for name in block.variables}
            for name, variable in block.variables.items():
                if variable.dims[0] in CHUNKS:
                    sizes = (CHUNKS.get(str(d), block.sizes[d]) for d in variable.dims)
                    stored[name]["chunksizes"] = tuple(sizes)
            block.to_netcdf(path, engine="h5netcdf", unlimited_dims=CHUNKS, encoding=stored)
            return
        with h5netcdf.File(path, "r+") as file:
            for dimension in CHUNKS:
                file.resize_dimension(dimension, done[dimension] + block.sizes[dimension])
            for name, variable in block.variables.items():
                head = str(variable.dims[0])
                if head in CHUNKS and variable.size:
                    values = variable.values
                    text = values.dtype.kind == "U"
                    file.variables[name][done[head] :] = values.astype(object) if text else values


def describe(path: Path, attributes: Mapping[str, Any]) -> None:
    """Set attributes of the whole file."""
    import h5netcdf

    with h5netcdf.File(path, "r+") as file:
        file.attrs.update(attributes)


@dataclass(frozen=True, eq=False)
class RunOutline:
    """Extremes of a run over intervals of time, and its events, for a figure.

    Attributes
    ----------
    time : array, shape (n,)
        Middle of each stretch (s).
    low, high : dict of str to array, shape (n,)
        Extremes of ``load``, ``force``, ``velocity`` over each stretch, in SI; of ``age`` too
        where the file has it.
    events : list of (float, str)
        Time (s) and kind.
    title : str
    law : str
    """

    time: Float
    low: dict[str, Float]
    high: dict[str, Float]
    events: list[tuple[float, str]]
    title: str
    law: str


@typed
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
        for block in _blocks(Path(run), _COLUMNS):
            rows = np.column_stack([block[name] for name in _COLUMNS])
            np.savetxt(stream, rows, "%.12g", ",")
    return Path(out)


@typed
def outline(run: FilePath, stretches: int = 2000) -> RunOutline:
    """Extremes of load, force, velocity and age over stretches of equal length.

    Parameters
    ----------
    run : str or path
        NetCDF file of `run_protocol`.
    stretches : int
        Largest number of intervals; fewer for fewer rows.
    """
    import h5netcdf

    with readable(Path(run), "run", "NetCDF file of a run"), h5netcdf.File(run, "r") as file:
        time = file.variables["time"]
        first, last, rows = float(time[0]), float(time[-1]), time.shape[0]
        kinds = [k.decode() if isinstance(k, bytes) else k for k in file.variables["event_kind"][:]]
        events = list(zip(map(float, file.variables["event_time"][:]), kinds, strict=True))
        title, law = str(file.attrs["title"]), str(file.attrs["law"])
        ages = ("age",) if "age" in file.variables else ()
    count = max(1, min(stretches, rows))
    names = ("load", "force", "velocity", *ages)
    low = {name: np.full(count, np.inf) for name in names}
    high = {name: np.full(count, -np.inf) for name in names}
    width = (last - first) / count or 1.0
    for block in _blocks(Path(run), ("time", *names)):
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


def _blocks(run: Path, names: Iterable[str]) -> Iterator[dict[str, Float]]:
    import h5netcdf

    with h5netcdf.File(run, "r") as file:
        rows = file.variables["time"].shape[0]
        for begin in range(0, rows, _ROWS):
            yield {n: np.asarray(file.variables[n][begin : begin + _ROWS]) for n in names}
