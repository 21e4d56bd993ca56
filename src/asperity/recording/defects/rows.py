"""Rows of a recording that can be used, and those among them that a reading avoids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from asperity.recording.defects.levels import saturated
from asperity.recording.defects.sampling import gap_rows
from asperity.recording.defects.spikes import spikes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def usable_rows(time: Array, columns: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether all columns are finite and time is later than in every usable row before.

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


def rows_to_avoid(
    time: Array, columns: Sequence[Array], kept: NDArray[np.bool_] | None = None
) -> NDArray[np.intp]:
    """Rows that are saturated, stand out, or follow a gap or a row that was left out.

    Parameters
    ----------
    time : array, shape (n,)
        Seconds, rising.
    columns : sequence of array, shape (n,)
    kept : array of bool, optional
        Which rows of the recording these are.

    Returns
    -------
    array of int
        In rising order.
    """
    avoided = [gap_rows(time)]
    if kept is not None:
        avoided.append(np.flatnonzero(np.diff(np.flatnonzero(kept)) > 1) + 1)
    for values in columns:
        avoided.append(spikes(values))
        for level in saturated(values):
            # A single largest value is none: saturation stands still.
            avoided.append(level.rows[1:][np.diff(level.rows) == 1])
    return np.unique(np.concatenate(avoided))
