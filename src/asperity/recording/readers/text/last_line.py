"""The last line of a text: is it whole? A file that was cut tells by it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, BinaryIO

from asperity.recording.readers.text.lines import cells_of, digits, lines_of

if TYPE_CHECKING:
    from asperity.recording.readers.text.layout import Layout

_TAIL = 1 << 16
#: Rows that must agree before a last line without its end is trusted.
_ENOUGH = 5


@dataclass(frozen=True)
class Ending:
    """Where the whole rows of a text end.

    Attributes
    ----------
    stop : int
        Offset in bytes behind the last row that counts.
    rows : int
        Rows left out behind it.
    sentence : str
        Why; empty where the text ends as it should.
    sure : bool
        Whether the file must have been cut, or only may have been.
    """

    stop: int
    rows: int = 0
    sentence: str = ""
    sure: bool = True


def ending_of(file: BinaryIO, size: int, layout: Layout) -> Ending:
    """Judge the last line by its end, its cells and its digits.

    A line without its end is whole if all its cells are there and the last one has as many digits
    behind its mark as the rows before it, all of which must agree; programs that leave out the last
    line end are that regular. Otherwise its last number may be short, and the row is left out.
    """
    begin = max(layout.start, size - _TAIL)
    file.seek(begin)
    tail = file.read(size - begin)
    padded = len(tail) - len(tail.rstrip(b"\0"))
    tail = tail.rstrip(b"\0\x1a")
    stop = begin + len(tail)
    every = lines_of(tail, begin)
    lines = [line for line in every if not line.blank]
    if not lines or (lines[-1].ended and not padded):
        indented = bool(lines) and lines[-1].text[:1] == " "
        if indented and every[-1].blank and not every[-1].ended:
            return Ending(stop, 0, "it ends with the blanks that its rows begin with.", sure=False)
        return Ending(stop)
    last = lines[-1]
    if padded and last.ended:
        return Ending(stop, 0, f"it ends with {padded} empty bytes where rows should be.")
    if last.text.count('"') % 2:
        return Ending(last.start, 1, "its last row has an open quote, and was left out.")
    cells = cells_of(last.text, layout.delimiter)
    width = layout.width + layout.closed
    if last.comment:
        return Ending(stop)
    if len(cells) < width:
        why = f"its last row has {len(cells)} of {width} cells, and was left out."
        return Ending(last.start, 1, why)
    whole = _is_whole(cells, layout)
    if whole:
        return Ending(stop)
    why = "its last row has no line end and its last number may be short; it was left out."
    return Ending(last.start, 1, why, sure=whole is not None)


def _is_whole(cells: list[str], layout: Layout) -> bool | None:
    """Whether the last number has all its digits; None where nothing tells."""
    if layout.closed:
        # The delimiter behind the last number is there.
        return True
    column = layout.width - 1
    last = digits(cells[column], layout.decimal)
    usual = {digits(row[column], layout.decimal) for row in layout.sample}
    # Whole numbers can be cut and look whole; and few rows may agree by chance.
    if len(usual) > 1 or len(layout.sample) < _ENOUGH or usual == {(0, 0)}:
        return None
    return usual == {last}
