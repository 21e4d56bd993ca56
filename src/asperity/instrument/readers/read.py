"""One door for all formats."""

from __future__ import annotations

import importlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.errors import InputError, closest
from asperity.instrument.readers.assemble import assemble
from asperity.instrument.readers.detect import FORMATS, format_of

if TYPE_CHECKING:
    from asperity.instrument.trace import Trace


def read(
    path: str | os.PathLike[str],
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    *,
    rate: float | str | None = None,
    group: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    format: str | None = None,
) -> Trace:
    """Read a recording of a laboratory into a checked `Trace`.

    Parameters
    ----------
    path : str or path
        A file: CSV, tab or blank separated text, HDF5, MATLAB (v4 to v7.3), TDMS, or the LOOK
        binary of xlook.
    columns : mapping of str to str or int, optional
        Which column plays a role, such as ``{"F": "Shear", "time": 0}``. Roles are ``time``, ``W``
        (load), ``F`` (shear force), ``velocity``, ``displacement`` and ``friction``; a column is
        given by its name or its place, counted from 0. What is not given goes by name when asked
        for, and an ambiguity is an error then.
    units : mapping of str to str, optional
        Units of columns, by name or role, where the file has none or a wrong one, such as
        ``{"Shear": "MPa"}``; or what one recorded unit is, as ``{"Gauge": "12.5 N"}``.
    rate : float or str, optional
        Samples per second (Hz, or a text such as ``"10 kHz"``), in place of the file's own times.
    group : str, optional
        The group of an HDF5, MATLAB (a struct) or TDMS file to read, where groups differ in length.
    delimiter, decimal : str, optional
        Layout of a text, where it cannot be told from the file.
    format : {"text", "hdf5", "matlab", "tdms", "look"}, optional
        In place of what the file looks like.

    Returns
    -------
    Trace
        In SI. Its findings tell everything that was noticed: defects of the file (``"truncated"``,
        ``"malformed row"``), assumptions (``"unknown unit"``), and those of `check`.

    Raises
    ------
    InputError
        If the file cannot be read, or can be read in more than one way.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"recording.path must be a file, got '{path}'; check the name")
    if file.stat().st_size == 0:
        raise InputError(
            f"recording.path must hold a recording, got '{file.name}', which is empty; copy it "
            "again from where it was recorded"
        )
    name = format or format_of(file)
    if name not in FORMATS:
        raise InputError(f"read.format must be a format, got '{name}'; {closest(name, FORMATS)}")
    # Each format loads what it needs only when it is met.
    module: Any = importlib.import_module(f"asperity.instrument.readers.{FORMATS[name]}")
    layout = {"delimiter": delimiter, "decimal": decimal} if name == "text" else {"group": group}
    recorded = module.load(file, **layout)
    return assemble(recorded, file, columns, units, rate)
