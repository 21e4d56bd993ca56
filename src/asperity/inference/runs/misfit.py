"""Whether the innovations of a recording show a law that fails.

Innovations are independent and normal with unit variance if law and noise are right. A law, a gauge
or a drive that is not that of the recording shows in the samples after the changes, where the
motion is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

Float = NDArray[np.float64]

#: Samples after a change in which a misfit is looked for, and before it: its time is uncertain.
_AFTER, _BEFORE = (5, 20, 80), 5


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
        chance = float(chdtrc(int(inside.sum()), ratio * inside.sum()))
        if chance < lowest:
            lowest, size = chance, ratio**0.5
    return min(1.0, len(_AFTER) * lowest), size
