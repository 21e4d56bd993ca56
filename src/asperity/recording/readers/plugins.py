"""Readers that other packages bring, found by their entry points in ``asperity.readers``.

An entry point names a module, or any object, with

- ``is_format(path) -> bool``: whether a file is of the format, by what it holds;
- ``read(path) -> RawRecording``: its columns as recorded.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from numbers import Real
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np

from asperity.errors import InputError
from asperity.recording.finding import Finding
from asperity.recording.readers.detect import FORMATS
from asperity.recording.readers.raw import RawColumn, RawRecording

GROUP = "asperity.readers"


class Reader(Protocol):
    """What an entry point of `GROUP` has to offer."""

    def is_format(self, path: Path) -> bool:
        """Whether a file is of the format."""
        ...

    def read(self, path: Path) -> RawRecording:
        """Columns of a file, as recorded."""
        ...


@lru_cache(maxsize=1)
def reader_points() -> dict[str, EntryPoint]:
    """Entry points by the name of the format; none of them is loaded yet.

    Raises
    ------
    InputError
        If one has the name of a format of the package.
    """
    found = {point.name: point for point in entry_points(group=GROUP)}
    for name in sorted(set(found) & set(FORMATS)):
        raise InputError(
            f"read.format must have a name of its own, got '{name}' of '{found[name].value}', "
            "which asperity reads itself; rename the entry point"
        )
    return found


def reader_named(name: str) -> Reader:
    """Load a reader.

    Raises
    ------
    InputError
        If it cannot be imported or lacks one of its two functions.
    """
    point = reader_points()[name]
    try:
        reader: Reader = point.load()
    # Another package's code: whatever it raises, the user hears of it in a sentence.
    except Exception as error:
        raise InputError(
            f"read.format must be a reader that can be loaded, got '{name}' of '{point.value}' "
            f"({error}); correct or remove that package"
        ) from None
    for wanted in ("is_format", "read"):
        if not callable(getattr(reader, wanted, None)):
            raise InputError(
                f"read.format must be a reader with {wanted}(path), got '{name}' of "
                f"'{point.value}' without; add the function"
            )
    return reader


def plugin_format_of(path: Path) -> str | None:
    """Name of the first reader that takes a file for one of its own; None if none does."""
    for name in reader_points():
        reader = reader_named(name)
        try:
            if reader.is_format(path):
                return name
        # A reader that fails on a foreign file has not recognised it.
        except Exception:
            continue
    return None


def read_by_plugin(name: str, path: Path) -> RawRecording:
    """Columns of a file by a reader of another package.

    Raises
    ------
    InputError
        If the reader fails or returns something else.
    """
    try:
        recorded: Any = reader_named(name).read(path)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"recording.path must be a file of format '{name}', got '{path.name}', which its "
            f"reader could not read ({type(error).__name__}: {error}); check the file or the reader"
        ) from None
    if (
        not isinstance(recorded, RawRecording)
        or not isinstance(columns := cast(Any, recorded.columns), list | tuple)
        or not columns
        or not all(isinstance(column, RawColumn) for column in columns)
    ):
        raise InputError(
            f"read.format must be a reader that returns a RawRecording of RawColumns, got "
            f"{type(recorded).__name__} of '{name}'; correct the reader"
        )
    for column in recorded.columns:
        values: Any = column.values
        if not isinstance(values, np.ndarray) or values.ndim != 1:
            raise InputError(
                f"read.format must be a reader whose columns hold arrays of one dimension, got "
                f"another thing in '{column.label}' of '{name}'; write numpy.asarray around it"
            )
        unit: Any = column.unit
        label: Any = column.label
        if not isinstance(label, str) or not (unit is None or isinstance(unit, str)):
            raise InputError(
                f"read.format must be a reader whose columns have texts for label and unit, got "
                f"{label!r} and {unit!r} of '{name}'; correct the reader"
            )
    step: Any = recorded.step
    if step is not None and not (isinstance(step, Real) and 0 < float(step) < np.inf):
        raise InputError(
            f"read.format must be a reader whose step is a positive number of seconds, got "
            f"{step!r} of '{name}'; correct the reader"
        )
    start: Any = recorded.start
    if not (isinstance(start, Real) and np.isfinite(float(start))):
        raise InputError(
            f"read.format must be a reader whose start is a number of seconds, got {start!r} of "
            f"'{name}'; correct the reader"
        )
    provenance: Any = recorded.provenance
    findings: Any = recorded.findings
    if not isinstance(provenance, dict) or not (
        isinstance(findings, list) and all(isinstance(f, Finding) for f in findings)
    ):
        raise InputError(
            f"read.format must be a reader with a list of Findings and a dict of provenance, got "
            f"others of '{name}'; leave them out or correct the reader"
        )
    sizes = {c.values.size for c in recorded.columns}
    if len(sizes) > 1:
        raise InputError(
            f"read.format must be a reader of columns of one length, got {sorted(sizes)} rows of "
            f"'{name}'; correct the reader"
        )
    recorded.provenance.setdefault("format", name)
    return recorded
