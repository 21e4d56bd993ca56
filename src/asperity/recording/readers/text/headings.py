"""Headings over a table of text: names, the row of units below them, and what is neither."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from asperity.recording.readers.text.lines import TextLine, cells_of, decoded
from asperity.recording.readers.units import is_empty, usual
from asperity.recording.roles import ROLES, candidates

_DELIMITERS = ("\t", ";", ",", "|", None)
_WIDE = re.compile(r"\s{2,}|\t")
#: Cells that name nothing: numbers, and the counts of records that xlook writes.
_COUNT = re.compile(r"[-+\d.,eE]*\d[-+\d.,eE]*(\s*recs?)?")
_LONGEST_UNIT = 14
#: Lines above the table in which names of another number than the columns are looked for.
_LAST = 2
_WITH_UNIT = re.compile(r".*[\[({<]([^\[\](){}<>]*)[\])}>]\s*", re.S)
_TYPES = frozenset({"float", "float32", "float64", "double", "single", "real", "number", "int"})


@dataclass(frozen=True)
class Headings:
    """Names and units of the columns of a text.

    Attributes
    ----------
    names : list of str
        One a column, as written, unit included; empty where the file has none.
    units : list of str or None
        The row of units, where there is one.
    step : float or None
        Interval (s) of LabVIEW's text, which may leave its column of times empty.
    found : int or None
        Names in the file, where they are more or fewer than its columns; the first columns have
        the first names then.
    """

    names: list[str]
    units: list[str] | None
    step: float | None = None
    found: int | None = None


def headings(
    above: Sequence[TextLine], delimiter: str | None, width: int, counted: bool
) -> Headings:
    """Headings among the lines above the first row of numbers.

    The last lines with as many cells as the table are taken; commented ones only where no other
    fits.

    Parameters
    ----------
    above : sequence of TextLine
    delimiter : str or None
    width : int
        Columns of the table.
    counted : bool
        Whether the first column counts the rows, and needs no name.
    """
    plain = [line.text for line in above if not line.comment and not line.blank]
    rows = _fitting(plain, (delimiter,), width, counted)
    if not rows:
        bare = [line.text.strip().strip('"').lstrip("#%!/ ") for line in above if line.comment]
        rows = _fitting(bare, (delimiter, *_DELIMITERS), width, counted)
    step = next((_interval(row) for row in rows if row[0] == "Delta_X"), None)
    rows = [row for row in rows if not _names_nothing(row)]
    if not rows:
        return Headings([""] * width, None)
    if len(rows) > 1 and _are_units(rows[-1], rows[-2]):
        return Headings(
            _bare(rows[-2]), [c if _bracketed(c) is None else str(_bracketed(c)) for c in rows[-1]]
        )
    # LabVIEW's text has the units above the names, and time in seconds.
    labview = next((row[1:] for row in rows[:-1] if row[0] == "Y_Unit_Label"), None)
    return Headings(_bare(rows[-1]), ["s", *labview] if labview else None, step)


def names_of_another_width(
    above: Sequence[TextLine], delimiter: str | None, width: int
) -> Headings:
    """Names that are fewer or more than the columns, if a line of names is beyond doubt.

    It is the last line of words, or stands over the row of units, and two of its names at least
    are those of a role or carry a unit.
    """
    plain = [line.text for line in above if not line.comment and not line.blank]
    rows = []
    for text in plain[-_LAST:]:
        line = decoded(text)
        cells = cells_of(line, delimiter) if delimiter else _WIDE.split(line.strip())
        while cells and not cells[-1].strip():
            cells.pop()
        rows.append([cell.strip('" ') for cell in cells])
    units: list[str] | None = None
    if len(rows) > 1 and len(rows[-1]) == len(rows[-2]) and _are_units(rows[-1], rows[-2]):
        units = [_bracketed(c) or c for c in rows.pop()]
    if not rows or len(rows[-1]) < 2 or _names_nothing(rows[-1]):
        return Headings([""] * width, None)
    names = _bare(rows[-1])
    known = sum(_names_a_quantity(name) for name in names)
    if known < 2 or len(names) == width:
        return Headings([""] * width, None)
    missing = [""] * max(0, width - len(names))
    return Headings(
        [*names, *missing][:width],
        None if units is None else [*units, *missing][:width],
        None,
        len(names),
    )


def _names_a_quantity(cell: str) -> bool:
    """Whether a heading is the name of a role or holds a usual unit in brackets."""
    match = _WITH_UNIT.fullmatch(cell)
    if match and usual(match[1]):
        return True
    return any(candidates(role, {cell: None}) for role in ROLES)


def _names_nothing(row: Sequence[str]) -> bool:
    """Whether a row is of numbers, or of the types of the columns."""
    numbers = sum(bool(_COUNT.fullmatch(cell)) for cell in row)
    return 2 * numbers > len(row) or all(cell.lower() in _TYPES for cell in row)


def _bare(row: Sequence[str]) -> list[str]:
    return [cell[1:-1] if re.fullmatch("'.*'", cell) else cell for cell in row]


def _interval(row: Sequence[str]) -> float | None:
    try:
        step = float(row[1].replace(",", "."))
    except ValueError:
        return None
    return step if step > 0 else None


def _fitting(
    texts: Sequence[str], delimiters: Sequence[str | None], width: int, counted: bool
) -> list[list[str]]:
    """Rows of `width` cells, the first delimiter that gives them being used for each line."""
    rows = []
    for text in texts:
        for delimiter in delimiters:
            row = _row(decoded(text), delimiter, width, counted)
            if row is not None:
                rows.append(row)
                break
    return rows


def _row(text: str, delimiter: str | None, width: int, counted: bool) -> list[str] | None:
    ways = [cells_of(text, delimiter)]
    if delimiter is None:
        # Names with blanks in them over a table that blanks divide.
        ways += [
            [cell.strip('" ') for cell in _WIDE.split(text.strip())],
            _quoted(text),
            _with_units(text.split()),
        ]
    for cells in ways:
        if len(cells) == width:
            return cells
        # LabVIEW has a column of comments, and no delimiter where there is none.
        if len(cells) == width + 1 and cells[-1].lower() in ("", "comment", "comments"):
            return cells[:-1]
    for cells in ways if counted else ():
        if len(cells) == width - 1 and width > 2 and all(cells):
            return ["row", *cells]
    return None


def _quoted(text: str) -> list[str]:
    return [a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', text)]


def _with_units(tokens: list[str]) -> list[str]:
    """Words with a unit in brackets that follows joined to the name before it."""
    joined: list[str] = []
    for token in tokens:
        if joined and token[0] in "([{" and token[-1] in ")]}":
            joined[-1] += " " + token
        else:
            joined.append(token)
    return joined


def _bracketed(cell: str) -> str | None:
    match = re.fullmatch(r"[\[({<](.*)[\])}>]", cell.strip())
    return match[1].strip() if match else None


def _are_units(row: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a row holds units: a third of it at least does, under names that are none."""
    known = sum(_is_unit(cell) for cell in row)
    short = all(len(cell) <= _LONGEST_UNIT for cell in row)
    return short and 3 * known >= len(row) and sum(map(_is_unit, above)) < known


def _is_unit(cell: str) -> bool:
    return not is_empty(cell) and (usual(cell) is not None or _bracketed(cell) is not None)
