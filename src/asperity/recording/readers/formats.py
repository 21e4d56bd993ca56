"""The choice of the reader of a file: readers of this package, and plugins of other packages.

A reader is a module, or any object, with

- ``is_format(path) -> bool``: whether a file is of the format, by what it holds;
- ``read(path) -> RawRecording``: its columns as recorded. A reader that has them as keywords
  takes the user's ``group``, ``delimiter`` or ``decimal`` too, None where the user names none.

Readers of other packages are entry points in the group ``asperity.readers``, and are tried first.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from asperity.errors import Argument, InputError, closest
from asperity.recording.readers.raw import RawRecording

GROUP = "asperity.readers"
#: The formats of this package, each a module next to this one, in the order in which they are
#: tried: formats with a signature first.
FORMATS = ("hdf5", "tdms", "look", "matlab", "text")


@lru_cache(maxsize=1)
def reader_points() -> dict[str, EntryPoint]:
    """Entry points by the name of the format; they are not loaded.

    Raises
    ------
    InputError
        If one has the name of a format of the package.
    """
    points = {point.name: point for point in entry_points(group=GROUP)}
    for name in sorted(set(points) & set(FORMATS)):
        got = f"'{name}' of '{points[name].value}', which asperity reads itself"
        raise InputError("read.format", "have a name of its own", got, "rename the entry point")
    return points


def reader_named(name: str) -> Any:
    """Load the reader of a format.

    Raises
    ------
    InputError
        If no reader has the name, it cannot be imported, or lacks one of its two functions.
    """
    if name in FORMATS:
        return importlib.import_module(f"asperity.recording.readers.{name}")
    points = reader_points()
    if name not in points:
        known = closest(name, [*FORMATS, *points])
        raise InputError("read.format", "be a format", f"'{name}'", known)
    try:
        reader = points[name].load()
    # Code of another package: any exception becomes a sentence for the user.
    except Exception as error:
        rule = "be a reader that can be loaded"
        got = f"'{name}' of '{points[name].value}' ({error})"
        raise InputError("read.format", rule, got, "correct or remove that package") from None
    for wanted in ("is_format", "read"):
        if not callable(getattr(reader, wanted, None)):
            got, advice = f"'{name}' of '{points[name].value}' without", "add the function"
            raise InputError("read.format", f"be a reader with {wanted}(path)", got, advice)
    return reader


def format_of(path: Path) -> str:
    """Name of the first format whose reader recognises a file.

    Raises
    ------
    InputError
        If none does.
    """
    for name in reader_points():
        reader = reader_named(name)
        try:
            if reader.is_format(path):
                return name
        # A reader that fails on a foreign file has not recognised it.
        except Exception:
            continue
    for name in FORMATS:
        if reader_named(name).is_format(path):
            return name
    rule = "be CSV or other text, HDF5, MATLAB, TDMS or LOOK"
    got = f"'{path.name}', which looks like none of them"
    advice = f"give {Argument('format', value='...')} if it is one of them"
    raise InputError("recording.path", rule, got, advice)


def raw_recording(
    path: Path,
    format: str | None,
    options: Mapping[str, str | None],
    defaults: Mapping[str, str | None],
) -> RawRecording:
    """Columns of a file by the reader of its format.

    Parameters
    ----------
    path : Path
    format : str or None
        None to recognise the format from the file.
    options : mapping of str to str or None
        Layout of this file, which its reader must be able to take.
    defaults : mapping of str to str or None
        Layout for files of any format, of which a reader takes what it can.

    Raises
    ------
    InputError
        If the file cannot be read; with the message of the format's library.
    """
    name = format_of(path) if format is None else format
    reader = reader_named(name)
    taken = inspect.signature(reader.read).parameters
    for option, value in options.items():
        if value is not None and option not in taken:
            rule = f"be left out for format '{name}'"
            raise InputError(f"read.{option}", rule, f"'{value}'", "its reader takes none")
    layout = {k: v if v is not None else defaults.get(k) for k, v in options.items() if k in taken}
    try:
        recorded: Any = reader.read(path, **layout)
    except InputError:
        raise
    except MemoryError:
        got = f"'{path.name}', which holds more"
        raise InputError("recording.path", "fit into memory", got, "cut it") from None
    # For damaged files libraries raise many types: TypeError, ValueError, MemoryError, zlib errors.
    except Exception as error:
        raise InputError(
            "recording.path",
            f"be a whole file of format '{name}'",
            f"'{path.name}', which may "
            f"be cut or damaged: its reader could not read it ({type(error).__name__}: {error})",
            "copy it again from where it was recorded",
        ) from None
    if not isinstance(recorded, RawRecording):
        rule, advice = "be a reader that returns a RawRecording", "correct the reader"
        raise InputError("read.format", rule, f"{type(recorded).__name__} of '{name}'", advice)
    recorded.provenance.setdefault("format", name)
    return recorded
