"""Lines and cells of a text recording: encodings, comments, and what counts as a number."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

#: What a comment begins with.
COMMENTS = ("#", "%", "!", "//")
#: Cells without a value, as recording programs write them.
MISSING = (
    "",
    "-",
    "--",
    "NaN",
    "nan",
    "NAN",
    "NA",
    "N/A",
    "n/a",
    "null",
    "None",
    "#N/A",
    "1.#QNAN",
)
_NUMBER = {
    mark: re.compile(
        rf"[+-]?(?:\d+(?:{re.escape(mark)}\d*)?|{re.escape(mark)}\d+)(?:[eE][+-]?\d+)?"
    )
    for mark in (".", ",")
}
#: Thousands set apart count only before decimals: without them nothing tells the marks apart.
_GROUPED = {
    mark: re.compile(rf"[+-]?\d{{1,3}}(?:{re.escape(other)}\d{{3}})+{re.escape(mark)}\d*")
    for mark, other in ((".", ","), (",", "."))
}
_ENDLESS = re.compile(r"[+-]?inf(?:inity)?", re.I)
_STAMP = re.compile(r"\d{1,4}[-/:.]\d{1,2}[-/:.]\d{1,4}(?:[T ]\d{1,2}:\d{2}.*|[.,]\d+)?")
_WORD = re.compile(
    r"(?<![^\W\d_])(?!nan\b|inf\b|na\b|none\b|null\b|[eEtTzZ]\b)[^\W\d_]+(?!\d)", re.I
)
_LINE = re.compile(rb"([^\r\n]*)(\r\n|\n|\r|\Z)")


@dataclass(frozen=True)
class TextLine:
    """A line of the head of a file.

    Attributes
    ----------
    text : str
        Without its end, one character a byte.
    start : int
        Offset of its first byte in the file.
    ended : bool
        Whether a line end follows.
    """

    text: str
    start: int
    ended: bool

    @property
    def blank(self) -> bool:
        """Whether nothing stands on it."""
        return not self.text.strip()

    @property
    def comment(self) -> str:
        """The sign that makes it a comment; empty if it is none."""
        bare = self.text.lstrip(' "')
        return next((sign for sign in COMMENTS if bare.startswith(sign)), "")


def lines_of(head: bytes, start: int) -> list[TextLine]:
    """Lines of `head`, which begins at byte `start` of its file."""
    found = []
    for match in _LINE.finditer(head):
        if match[0]:
            ended = bool(match[2])
            found.append(TextLine(match[1].decode("latin-1"), start + match.start(), ended))
    return found


def decoded(text: str) -> str:
    """Text of one character a byte as it was meant: UTF-8, else Windows' Western code page."""
    raw = text.encode("latin-1")
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def cells_of(text: str, delimiter: str | None) -> list[str]:
    """Cells of a line, without quotes and blanks around them; `delimiter` None is blanks."""
    if delimiter is None:
        return [cell.strip('"') for cell in text.split()]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)]
    row = next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number written with this decimal mark."""
    found = _NUMBER[decimal].fullmatch(cell) or _ENDLESS.fullmatch(cell)
    return bool(found) or is_grouped(cell, decimal)


def is_grouped(cell: str, decimal: str) -> bool:
    """Whether a number has its thousands set apart by the other mark."""
    return bool(_GROUPED[decimal].fullmatch(cell))


def is_value(cell: str, decimal: str) -> bool:
    """Whether a cell can stand in a table of numbers: a number, nothing, or a date."""
    return is_number(cell, decimal) or cell in MISSING or bool(_STAMP.fullmatch(cell))


def has_words(text: str) -> bool:
    """Whether a line holds letters that belong to no number, date or missing value."""
    return bool(_WORD.search(text))


def digits(cell: str, decimal: str) -> tuple[int, int]:
    """Digits behind the decimal mark and in the exponent; (0, 0) for what is no number."""
    if not is_number(cell, decimal):
        return 0, 0
    mantissa, _, exponent = cell.lower().partition("e")
    return len(mantissa.partition(decimal)[2]), len(exponent.strip("+-"))
