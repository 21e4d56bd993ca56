"""Columns of a parsed table: rows that are none, words among numbers, and words only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.recording.finding import Finding

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = 60


def malformed(lines: list[int]) -> Finding:
    """The finding of rows, by their lines, that have too many cells."""
    return Finding(
        "malformed row",
        "error",
        len(lines),
        f"line {max(lines[0], 1)} of the table",
        f"{len(lines)} {'row has' if len(lines) == 1 else 'rows have'} more cells than the table "
        "has columns, and could not be read.",
    )


def without_text_rows(frame: pd.DataFrame, width: int) -> tuple[pd.DataFrame, list[Finding]]:
    """A table of numbers without its rows of words: headings between parts, remarks below.

    Parameters
    ----------
    frame : DataFrame
        Columns 0 to `width` - 1; one that holds words only, such as dates, leaves all rows.
    width : int
    """
    import pandas as pd

    texts = [i for i, kind in enumerate(frame.dtypes) if i < width and kind.kind not in "iuf"]
    if not texts:
        return frame, []
    numbers = frame[list(range(width))].copy()
    for i in texts:
        numbers[i] = pd.to_numeric(frame[i], errors="coerce")
    if any(2 * numbers[i].notna().sum() < frame[i].notna().sum() for i in texts):
        return frame, []
    words = (frame[texts].notna().any(axis=1) & numbers.isna().all(axis=1)).to_numpy()
    count = int(words.sum())
    if not count:
        return frame, []
    first = int(np.argmax(words))
    line = " ".join(cell for cell in frame.iloc[first] if isinstance(cell, str))[:_SHOWN]
    found = Finding(
        "text row",
        "note",
        count,
        f"row {first}",
        f"{count} {'row holds' if count == 1 else 'rows hold'} words and no number, the first "
        f"'{line}' in row {first}, and {'was' if count == 1 else 'were'} left out.",
    )
    return frame[~words].reset_index(drop=True), [found]


def numbers_of(column: pd.Series[Any], name: str) -> tuple[np.ndarray[Any, Any], list[Finding]]:
    """Numbers of a column, NaN where a text stands among them; a column of texts as it is."""
    if column.dtype.kind in "iuf":
        return column.to_numpy(dtype=np.float64), []
    import pandas as pd

    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
    texts = np.flatnonzero(np.isnan(numbers) & column.notna().to_numpy())
    if 2 * texts.size > numbers.size:
        return column.to_numpy(dtype=object), []
    if not texts.size:
        return numbers, []
    first = int(texts[0])
    return numbers, [
        Finding(
            "text in numbers",
            "warning",
            texts.size,
            f"{name}, row {first}",
            f"{texts.size} of {numbers.size} cells of '{name}' hold text, the first '"
            f"{column.iloc[first]}' in row {first}; they were read as missing.",
        )
    ]
