"""A NetCDF file that grows block by block, so that memory does not grow with it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import InputError

if TYPE_CHECKING:
    import xarray

#: Dimensions that grow, with the rows of a chunk on disk: a quarter of a megabyte each.
CHUNKS: Mapping[str, int] = {"time": 32_768, "event": 1024}


def append(path: Path, block: xarray.Dataset, done: Mapping[str, int]) -> None:
    """Add a block after the finished ones; an unfinished block behind them is overwritten.

    The file is closed again, so that it is whole and readable between blocks.

    Parameters
    ----------
    path : Path
        Created where nothing is done yet.
    block : xarray.Dataset
        Variables over ``time`` or ``event``, and others, which are written once.
    done : mapping of str to int
        Length of each growing dimension so far; empty at the beginning.

    Raises
    ------
    InputError
        If the file cannot be written or is damaged.
    """
    import h5netcdf

    new = not done
    try:
        with h5netcdf.File(path, "w" if new else "r+") as file:
            if new:
                _lay_out(file, block)
            begin = {name: done.get(name, 0) for name in CHUNKS}
            end = {name: begin[name] + block.sizes[name] for name in CHUNKS}
            for dimension, length in end.items():
                file.resize_dimension(dimension, length)
            for name, variable in block.variables.items():
                head = str(variable.dims[0])
                if head in CHUNKS and variable.sizes[head]:
                    file.variables[name][begin[head] : end[head]] = _writable(variable.values)
    except OSError as error:
        why = error.strerror or "it is damaged"
        raise InputError(
            f"out must be a file that can be written, got '{path}' ({why}); choose a folder that "
            "exists, is writable and has room"
        ) from None


def describe(path: Path, attributes: Mapping[str, Any]) -> None:
    """Set attributes of the whole file."""
    import h5netcdf

    with h5netcdf.File(path, "r+") as file:
        file.attrs.update(attributes)


def _lay_out(file: Any, block: xarray.Dataset) -> None:
    import h5py

    file.dimensions = {
        str(name): None if name in CHUNKS else size for name, size in block.sizes.items()
    }
    file.attrs.update(block.attrs)
    for name, variable in block.variables.items():
        text = variable.dtype.kind in "UO"
        shape = tuple(CHUNKS.get(str(d), block.sizes[d]) for d in variable.dims)
        made = file.create_variable(
            name,
            variable.dims,
            dtype=h5py.string_dtype() if text else variable.dtype,
            chunks=shape if variable.dims[0] in CHUNKS else None,
        )
        for key, value in variable.attrs.items():
            made.attrs[key] = value
        if variable.dims[0] not in CHUNKS:
            made[...] = _writable(variable.values)


def _writable(values: np.ndarray) -> np.ndarray:
    return values.astype(object) if values.dtype.kind == "U" else values
