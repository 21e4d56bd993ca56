"""Curves as the page draws them: in few points, of few digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.recording.extremes import extremes

Array = NDArray[np.float64]


def thinned(x: Array, y: Array, blocks: int) -> dict[str, Array]:
    """The `asperity.recording.extremes` of a curve as ``x`` and ``y``."""
    kept = extremes(y, blocks)
    return {"x": _rounded(x[kept]), "y": _rounded(y[kept])}


def _rounded(values: Array) -> Array:
    """Values rounded to seven digits of the largest: more than a picture shows."""
    finite = values[np.isfinite(values)]
    size = float(np.abs(finite).max()) if finite.size else 0.0
    if not size:
        return values
    places = 7 - int(np.floor(np.log10(size)))
    return np.round(values, places) if abs(places) < 300 else values
