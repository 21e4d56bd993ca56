"""Checks of a recording: sampling, missing values, saturation; and the rows that can be used.

A check never changes a value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from asperity.arrays import Bool, Float, Index
from asperity.recording.defects.sampling import check_sampling, gap_rows
from asperity.recording.defects.saturation import CROWDED, NONE, saturated
from asperity.recording.defects.spikes import spikes
from asperity.recording.finding import Finding, Severity, at_row

#: Names of the findings of `defects`; a reader has further ones.
CHECKED = frozenset(
    {
        "backward time",
        "constant",
        "gap",
        "infinite",
        "missing values",
        "repeated time",
        "rounded time",
        "saturation",
        "spike",
        "uneven sampling",
    }
)


def defects(time: Float, columns: Mapping[str, Float]) -> list[Finding]:
    """Findings of `asperity.recording.check`, in the time and in channels by name."""
    # Sums and differences of a damaged file may overflow; another check reports such values.
    with np.errstate(over="ignore", invalid="ignore"):
        findings = [*_missing(time, time, "time"), *check_sampling(time)]
        for name, values in columns.items():
            at = spikes(values)
            findings += _missing(values, time, name)
            findings += saturation(values, time, name, at=at)
            findings += _spikes(values, time, name, at)
    return findings


def _missing(values: Float, time: Float, name: str) -> list[Finding]:
    # A finite sum means that all values are finite; this takes one pass without a copy.
    if np.isfinite(values.sum()):
        return []
    findings = []
    for slug, bad in (("missing values", np.isnan(values)), ("infinite", np.isinf(values))):
        count = int(bad.sum())
        if not count:
            continue
        first = int(np.argmax(bad))
        what = "not a number" if slug == "missing values" else "infinite"
        grave: Severity = "error" if count == values.size or name == "time" else "warning"
        text = f"{count} of {values.size} values of '{name}' are {what}, the first in row {first}."
        findings.append(Finding(slug, grave, count, at_row(name, first, time), text))
    return findings


def saturation(
    values: Float, time: Float, name: str, crowded: float = CROWDED, at: Index = NONE
) -> list[Finding]:
    """Findings ``"saturation"`` for the top and the bottom, or ``"constant"``.

    Parameters
    ----------
    values, time : array, (n,)
    name : str
        Name of the channel.
    crowded : float
        As in `saturated`.
    at : array of int
        Samples that are spikes.
    """
    finite = values if np.isfinite(values.sum()) else values[np.isfinite(values)]
    if finite.size < 2:
        return []
    if finite.min() == finite.max():
        text = f"'{name}' has one and the same value in the whole recording."
        return [Finding("constant", "note", float(finite[0]), at_row(name, 0, time), text)]
    findings = []
    for side, value, rows, usual in saturated(values, crowded, at):
        text = (
            f"{rows.size} of {values.size} samples of '{name}' have exactly its {side} value, "
            f"{value:.6g}, and at most {usual} have a neighbouring value: saturated, or held "
            "constant by the machine."
        )
        share, where = rows.size / values.size, at_row(name, int(rows[0]), time)
        findings.append(Finding("saturation", "warning", share, where, text))
    return findings


def _spikes(values: Float, time: Float, name: str, at: Index) -> list[Finding]:
    """Finding ``"spike"``, for samples that differ from the samples before and after them.

    A step, a slip event or a change of the amplitude differs on one side only, and is no spike.
    """
    if not at.size:
        return []
    first = int(at[0])
    usual = np.nanmedian(values[max(0, first - 100) : first + 100])
    text = (
        f"{at.size} of {values.size} samples of '{name}' jump out and back, the first, "
        f"{values[first]:.6g} where {usual:.6g} is usual, in row {first}."
    )
    return [Finding("spike", "warning", at.size, at_row(name, first, time), text)]


def usable_rows(time: Float, columns: Sequence[Float]) -> Bool:
    """Rows in which all columns are finite and time is later than in all usable rows before.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds.
    columns : sequence of array, shape (n,)
    """
    use = np.isfinite(time)
    for values in columns:
        use &= np.isfinite(values)
    latest = np.maximum.accumulate(np.where(use, time, -np.inf))
    use[1:] &= time[1:] > latest[:-1]
    return use


def rows_to_avoid(time: Float, columns: Sequence[Float], kept: Bool | None = None) -> Index:
    """Rows that are saturated, are spikes, or follow a gap or a row that was left out.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds, rising.
    columns : sequence of array, shape (n,)
    kept : array of bool, optional
        Which rows of the recording `time` and `columns` hold; all by default.

    Returns
    -------
    array of int
        Indices of the rows, in rising order.
    """
    avoided = [gap_rows(time)]
    if kept is not None:
        avoided.append(np.flatnonzero(np.diff(np.flatnonzero(kept)) > 1) + 1)
    for values in columns:
        at = spikes(values)
        avoided.append(at)
        # A run of usable samples ends after a saturated one.
        avoided += [level.rows for level in saturated(values, spikes=at)]
    return np.unique(np.concatenate(avoided))
