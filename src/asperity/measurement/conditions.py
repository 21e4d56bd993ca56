"""Machine conditions of the recordings of a campaign, from a table or from the names of files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from asperity.errors import Argument, InputError, closest, require
from asperity.parameters.columns import read_headed_columns

#: Fields of a measurement's question by the names that tables have.
MACHINE_FIELDS = {"K": "stiffness", "V": "velocity", "M": "mass", "W0": "normal_load"}
_LABEL = "measure.conditions"
_NUMBER = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_EXAMPLE = "write it like run_k{K N/m}_v{V um/s}, or name a table with a column file"


def conditions_of(files: Sequence[Path], text: str) -> dict[Path, dict[str, float | str]]:
    """K, V, M and W0 of each recording.

    Parameters
    ----------
    files : sequence of Path
    text : str
        A CSV with a column ``file``, a row a recording, with its folder where recordings in
        several folders have one name, and columns K, V, M or W0 in SI or with
        the unit in the heading. Or a pattern of the files' names with quantities in braces, like
        ``run_k{K N/m}_v{V um/s}``.

    Returns
    -------
    dict of Path to dict
        By the fields of `asperity.questions.recording.Measurement`; numbers in SI, or texts.

    Raises
    ------
    InputError
        If the table cannot be read, or does not have one row for each recording, or a name does
        not fit the pattern.
    """
    return _of_names(files, text) if "{" in text else _of_table(files, Path(text))


def _of_names(files: Sequence[Path], text: str) -> dict[Path, dict[str, float | str]]:
    # Literal parts, then a name and its unit, in turn.
    literal, *parts = re.split(r"\{\s*(\w+)\s*([^{}]*?)\s*\}", text)
    names, units = parts[::3], parts[1::3]
    pattern = re.escape(literal)
    for following in parts[2::3]:
        pattern += _NUMBER + re.escape(following)
    for name in names or [text]:
        if name not in MACHINE_FIELDS or names.count(name) > 1:
            rule = f"name each of {', '.join(MACHINE_FIELDS)} once at most"
            raise InputError(Argument(_LABEL), rule, f"'{name}'", _EXAMPLE)
    rule, got = "have text between two quantities", f"'{text}'"
    require(all(parts[2:-1:3]), Argument(_LABEL), rule, got, _EXAMPLE)
    result: dict[Path, dict[str, float | str]] = {}
    for file in files:
        # The whole name, or all of it but the ending.
        match = re.fullmatch(pattern, file.name) or re.fullmatch(pattern, file.stem)
        if match is None:
            rule = "fit the names of all recordings"
            raise InputError(Argument(_LABEL), rule, f"'{file.name}'", _EXAMPLE)
        result[file] = {
            MACHINE_FIELDS[name]: f"{value} {unit}".strip()
            for name, value, unit in zip(names, match.groups(), units, strict=True)
        }
    return result


def _of_table(files: Sequence[Path], path: Path) -> dict[Path, dict[str, float | str]]:
    columns: Mapping[str, list[Any]] = read_headed_columns(
        path, MACHINE_FIELDS, texts=("file",), label=_LABEL, row="a recording"
    )
    rule = f"have the column file and some of {', '.join(MACHINE_FIELDS)}"
    complete = "file" in columns and len(columns) > 1
    require(complete, path.name, rule, ", ".join(columns) or "none", "add them")
    rule = "have one row for each recording"
    result: dict[Path, dict[str, float | str]] = {}
    owners: dict[int, Path] = {}
    for file in files:
        rows = [
            n for n, name in enumerate(columns["file"]) if Path(name).name in (file.name, file.stem)
        ]
        # Recordings of one name in several folders have rows with their folders.
        here = [n for n in rows if file.parent.parts[-1:] == Path(columns["file"][n]).parts[-2:-1]]
        rows = here or rows
        if len(rows) == 1 and owners.setdefault(rows[0], file) != file:
            got = f"one for '{owners[rows[0]]}' and '{file}'"
            raise InputError(path.name, rule, got, "write the folder in the column file too")
        if len(rows) != 1:
            names = [Path(name).name for name in columns["file"]]
            advice = closest(file.name, names) if not rows else "leave one out"
            raise InputError(path.name, rule, f"{len(rows)} for '{file.name}'", advice)
        result[file] = {
            field: columns[name][rows[0]] for name, field in MACHINE_FIELDS.items()
            if name in columns
        }  # fmt: skip
    return result
