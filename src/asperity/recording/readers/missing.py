"""Numbers that stand for a missing value, such as -9999 or -999.25.

Loggers and spreadsheets write such numbers where a sensor gave no value. They differ from readings
by their digits, which are nines, and by their distance from every other value of the column, which
is larger than the distance of any of these values from zero.
"""

from __future__ import annotations

import re

import numpy as np

from asperity.arrays import Float
from asperity.recording.finding import Finding

#: Three nines or more, with further nines behind the decimal mark; -999.25 is that of well logs.
_CODE = re.compile(r"-?9{3,}(?:\.(?:9+|25))?")


def without_codes(values: Float, name: str) -> tuple[Float, list[Finding]]:
    """Values of a column, NaN in place of numbers that stand for a missing value.

    Parameters
    ----------
    values : array, shape (n,)
        As recorded, in any unit.
    name : str
        Name of the column.

    Returns
    -------
    (array, list of Finding)
        The same array and no finding if it contains no such code.
    """
    kept = np.isfinite(values)
    codes: list[float] = []
    while (code := _code_among(values, kept)) is not None:
        codes.append(code)
        kept &= values != code
    if not codes:
        return values, []
    rows = np.flatnonzero(np.isin(values, codes))
    listed = " or ".join(f"{code:.12g}" for code in codes)
    text = (
        f"{rows.size} of {values.size} values of '{name}' {'is' if rows.size == 1 else 'are'} "
        f"{listed}, the first in row {rows[0]}, far from all others: read as missing."
    )
    finding = Finding("missing code", "warning", rows.size, f"{name}, row {rows[0]}", text)
    return np.where(np.isin(values, codes), np.nan, values), [finding]


def _code_among(values: Float, kept: np.ndarray) -> float | None:
    """The smallest or the largest value, if it stands for a missing one."""
    if np.count_nonzero(kept) < 2:
        return None
    others = np.asarray(values, float)
    for extreme in (np.min, np.max):
        end = float(extreme(others, where=kept, initial=np.inf if extreme is np.min else -np.inf))
        if _CODE.fullmatch(f"{end:.12g}"):
            rest = others[kept & (others != end)]
            if rest.size and np.abs(rest - end).min() > np.abs(rest).max():
                return end
    return None
