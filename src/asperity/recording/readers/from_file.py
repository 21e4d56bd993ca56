"""`read`: a file of any format to a checked `Trace`, by the reader of its format.

A reader is a module, or any object, with

- ``is_format(path) -> bool``: whether the content of a file has the format;
- ``read(path) -> RawRecording``: the columns of a file as recorded. If this function has keywords
  ``group``, ``delimiter`` or ``decimal``, it gets the user's values, None by default.

Readers of other packages are entry points in the group ``asperity.readers``, and are tried first.
"""

from __future__ import annotations

import importlib
import inspect
import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.errors import Argument, InputError, known_as, require, require_known
from asperity.parameters.arguments import FilePath, shown, typed
from asperity.questions.recording import ReadingRecipe, Source
from asperity.recording.derived import derive, stress_to_force
from asperity.recording.finding import Finding
from asperity.recording.readers.assemble import assemble
from asperity.recording.readers.raw import RawRecording, unusable
from asperity.recording.roles import role_of

if TYPE_CHECKING:
    from asperity.recording.trace import Trace

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
    require_known(name, [*FORMATS, *points], "read.format", "be a format")
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
    advice = f"give {Argument('format', value='...')} if it is one of them"
    raise unusable(path, "which looks like none of them", rule, advice)


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
        raise unusable(path, "which holds more", "fit into memory", "cut it") from None
    # For damaged files libraries raise many types: TypeError, ValueError, MemoryError, zlib errors.
    except Exception as error:
        # The text of an OSError has the path, which the user may know by another name.
        text = getattr(error, "strerror", None) or error
        rule, why = f"be a whole file of format '{name}'", f"{type(error).__name__}: {text}"
        why = f"which may be cut or damaged: its reader could not read it ({why})"
        raise unusable(path, why, rule) from None
    if not isinstance(recorded, RawRecording):
        rule, advice = "be a reader that returns a RawRecording", "correct the reader"
        raise InputError("read.format", rule, f"{type(recorded).__name__} of '{name}'", advice)
    recorded.provenance.setdefault("format", name)
    return recorded


@typed
def read(
    path: FilePath,
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    *,
    channels: Mapping[str, str] | None = None,
    recipe: ReadingRecipe | FilePath | None = None,
    rate: float | str | None = None,
    group: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    format: str | None = None,
) -> Trace:
    r"""Read a recording of a laboratory into a checked `Trace`.

    Parameters
    ----------
    path : str or path
        A file: CSV, tab or blank separated text, HDF5, MATLAB (v4 to v7.3), TDMS, or the LOOK
        binary of xlook; and what readers of other packages recognise
        (`asperity.recording.readers.from_file`).
    columns : mapping of str to str or int, optional
        Which column plays a role, such as ``{"F": "Shear", "time": 0}``. Roles are ``time``, ``W``
        (load), ``F`` (shear force), ``velocity``, ``displacement`` and ``friction``; a column is
        given by its name or its place, counted from 0. What is not given goes by name when asked
        for, and an ambiguity is an error then.
    units : mapping of str to str, optional
        Units of columns, by name or role, where the file has none or a wrong one, such as
        ``{"Shear": "MPa"}``; or what one recorded unit is, as ``{"Gauge": "12.5 N"}``.
    channels : mapping of str to str, optional
        Channels that are made of others, such as ``{"load": "Conf.Press - Pore.Press"}``; see
        `asperity.recording.derive`.
    recipe : ReadingRecipe, str or path, optional
        A reduction file with any of these arguments; what is given here goes before it, and
        mappings are joined.
    rate : float or str, optional
        Samples per second (Hz, or a text such as ``"10 kHz"``), in place of the times in the file.
    group : str, optional
        The group of an HDF5, MATLAB (a struct) or TDMS file to read, where groups differ in length.
    delimiter, decimal : str, optional
        Layout of a text, where it cannot be seen from the file.
    format : str, optional
        ``"text"``, ``"hdf5"``, ``"matlab"``, ``"tdms"``, ``"look"`` or the name of a reader of
        another package, in place of what the file looks like.

    Returns
    -------
    Trace
        In SI. Its findings are everything that was noticed: defects of the file (``"truncated"``,
        ``"malformed row"``), assumptions (``"unknown unit"``), and those of `check`.

    Raises
    ------
    InputError
        If the file cannot be read, or can be read in more than one way.

    Examples
    --------
    >>> import asperity as asp
    >>> from asperity.recording.writers import write
    >>> path = write(asp.samples.velocity_steps(), "steps.csv")
    >>> print(asp.read(path))
    >>> text = "Time (s),Shear\n0,30.1\n0.01,30.2\n0.02,30.4\n0.03,30.3\n"
    >>> with open("run7.csv", "w") as file:
    ...     _ = file.write(text)
    >>> print(asp.read("run7.csv", {"F": "Shear"}, {"Shear": "kN"}, channels={"load": "50 kN"}))
    """
    if recipe is not None and not isinstance(recipe, ReadingRecipe):
        recipe = ReadingRecipe.from_file(recipe)
    rules = ReadingRecipe() if recipe is None else recipe
    layout = {"group": group, "delimiter": delimiter, "decimal": decimal}
    _require_one_each(rules.columns, rules.channels, rules.rate)
    _require_one_each(columns or {}, channels or {}, rate)
    # A role that the user gives goes before an expression of the recipe for it, and so do times.
    chosen = {role_of(name) for name in columns or {}} | ({"time"} if rate is not None else set())
    kept = {n: text for n, text in rules.channels.items() if (role_of(n) or n) not in chosen}
    if rate is None and "time" not in chosen:
        rate = rules.rate
    expressions = {**kept, **(channels or {})}
    file = Path(path)
    with _quiet() as warned:
        # The recorded clock is an ordinary column until the expression for time is evaluated.
        no_clock = rate is None and any(role_of(name) == "time" for name in expressions)
        recorded = raw_recording(
            _with_content(file),
            rules.format if format is None else format,
            layout,
            {name: getattr(rules, name) for name in layout},
        )
        trace = assemble(
            recorded,
            file,
            {**rules.columns, **(columns or {})},
            (rules.units, units or {}),
            "1 Hz" if no_clock else rate,
        )
        if no_clock:
            trace = replace(trace, time=np.full(len(trace), np.nan))
        if expressions:
            trace = derive(trace, expressions)
    if recipe is not None:
        provenance = {**trace.provenance, "recipe": rules.model_dump(exclude_defaults=True)}
        trace = replace(trace, provenance=provenance)
    return replace(trace, findings=(*trace.findings, *_library_warnings(warned)))


def _require_one_each(
    columns: Mapping[str, Any], channels: Mapping[str, str], rate: float | str | None
) -> None:
    """Refuse two columns or expressions for one role, as F and force, and two ways to times."""
    names: dict[str, str] = {}
    for name in (*columns, *channels):
        role = role_of(name) or name
        rule, got = "be one column or channel", f"'{names.get(role)}' and '{name}'"
        advice = "leave one out; an expression can have the column by its own name"
        require(role not in names, Argument("columns", role), rule, got, advice)
        names[role] = name
    for kind, given in (("columns", columns), ("channels", channels)):
        clock = next((name for name in given if role_of(name) == "time"), "")
        rule, got = "be left out next to a sampling rate", shown(given.get(clock))
        require(rate is None or not clock, Argument(kind, "time"), rule, got, "give one of them")


def read_source(path: str | os.PathLike[str], source: Source) -> Trace:
    """Read a recording with the settings of a question.

    Parameters
    ----------
    path : str or path
    source : Source

    Raises
    ------
    InputError
        As in `read`; or if the area makes no force of a stress.
    """
    trace = read(path, **source.arguments)
    return trace if source.area is None else stress_to_force(trace, source.area)


def _with_content(file: Path) -> Path:
    require(file.is_file(), "recording", "be a file", f"'{known_as(file)}'", "check the name")
    if not file.stat().st_size:
        raise unusable(file, "which is empty", "hold data")
    return file


@contextmanager
def _quiet() -> Iterator[list[warnings.WarningMessage]]:
    """Collect the warnings of libraries, and shorten errors that quote a file to one line."""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
        warnings.simplefilter("always")
        try:
            yield caught
        except InputError as error:
            raise error.shortened() from None


def _library_warnings(caught: list[warnings.WarningMessage]) -> list[Finding]:
    """Findings of the warnings of a library, one for each text."""
    texts = dict.fromkeys(str(w.message) for w in caught)
    return [
        Finding("library warning", "warning", 1.0, "the file", f"While it was read: {text}")
        for text in texts
    ]
