"""What the innovations of a recording show besides noise: jumps of the gauge, and a law that fails.

Innovations are independent and normal with unit variance if law and noise are right. A jump of the
gauge's offset that no velocity or load change explains bends every parameter; a law, a gauge or a
drive that is not that of the recording shows in the samples after the changes, where the motion is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from asperity.inference.runs.noise import Autoregression

Float = NDArray[np.float64]

#: Part of a jump's size that the fitted curves must leave for it to be told from them.
_LEFT = 0.05
#: Samples after a change in which a misfit is looked for, and before it: its time is uncertain.
_AFTER, _BEFORE = (5, 20, 80), 5


def departures_of_jumps(model: Autoregression, white: Float, curves: Float) -> Float:
    """How far a jump of the level at each sample is off zero, in standard deviations.

    Parameters
    ----------
    model : Autoregression
    white : array, shape (n,)
        Innovations.
    curves : array, shape (n, columns)
        Whitened curves that were fitted besides, orthonormal.

    Returns
    -------
    array, shape (n,)
        0 where the other curves take the place of a jump.

    Notes
    -----
    The level shift of Chen and Liu (J. Am. Stat. Assoc. 88, 284, 1993), estimated together with
    the curves.
    """
    n, p = white.size, model.order
    taps = np.concatenate([[1.0], -model.coefficients[-1]]) / model.innovation
    rise = np.cumsum(taps)

    def along(y: Float) -> Float:
        """Inner products with a whitened unit jump at each sample."""
        after = np.concatenate([np.cumsum(y[::-1])[::-1], np.zeros(p + 1)])
        near = np.correlate(np.concatenate([y, np.zeros(p)]), rise[: p + 1], mode="valid")
        return np.asarray(near + rise[-1] * after[p + 1 : p + 1 + n])

    left = np.minimum(np.arange(n, 0, -1), p + 1)
    size = np.cumsum(rise**2)[left - 1] + rise[-1] ** 2 * np.maximum(np.arange(n, 0, -1) - p - 1, 0)
    shared = np.column_stack([along(c) for c in curves.T]) if curves.size else np.zeros((n, 0))
    own = size - np.einsum("ij,ij->i", shared, shared)
    result = along(white) - shared @ (curves.T @ white)
    seen = own > _LEFT * size
    return np.asarray(np.where(seen, result / np.sqrt(np.where(seen, own, 1.0)), 0.0))


def misfit_after_changes(white: Float, first: Sequence[int]) -> tuple[float, float]:
    """Probability of innovations as large as those after the changes, and their size.

    Parameters
    ----------
    white : array, shape (n,)
    first : sequence of int
        First sample after each change.

    Returns
    -------
    (float, float)
        Probability by chi-squared, over the spans that are looked at; root mean square of the
        innovations in the span of the lowest one, over that of the others.
    """
    lowest, size = 1.0, 1.0
    for span in _AFTER:
        inside = np.zeros(white.size, bool)
        for k in first:
            inside[max(k - _BEFORE, 0) : k + span] = True
        if not inside.any() or inside.mean() > 0.25:
            continue
        other = float(np.mean(white[~inside] ** 2))
        ratio = float(np.mean(white[inside] ** 2)) / max(other, 1e-300)
        chance = float(chi2.sf(ratio * inside.sum(), int(inside.sum())))
        if chance < lowest:
            lowest, size = chance, ratio**0.5
    return min(1.0, len(_AFTER) * lowest), size
