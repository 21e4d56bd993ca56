"""Flat tops: samples crowded at exactly the largest or the smallest value of a channel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from asperity.recording.finding import Finding

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Values next to the extreme that say how crowded a level is without saturation.
_LEVELS = 3
#: The extreme of a smooth signal that is quantised holds at most 2.4 times the samples of the next
#: level where it is a parabola, and 5.3 times where it is as flat as a fourth power.
_CROWDED = 8
_FEWEST = 5


def check_saturation(values: Array, time: Array, name: str) -> list[Finding]:
    """Findings ``"saturation"`` for the top and the bottom, or ``"constant"``.

    A channel of three values or fewer, such as a switch, has no flat top of its own.
    """
    finite = values if np.isfinite(values.sum()) else values[np.isfinite(values)]
    if finite.size < 2:
        return []
    low, high = float(finite.min()), float(finite.max())
    if low == high:
        return [
            Finding(
                "constant",
                "note",
                high,
                f"{name}, row 0, t = {time[0]:.10g} s",
                f"'{name}' has one and the same value in the whole recording.",
            )
        ]
    found = []
    for side, extreme in (("largest", high), ("smallest", low)):
        at_extreme = values == extreme
        count = int(np.count_nonzero(at_extreme))
        # The usual case, and the cheap one.
        if count < _FEWEST or not (at_extreme[1:] & at_extreme[:-1]).any():
            continue
        usual = _most_at_a_level(finite, extreme, side)
        if usual is None or count <= _CROWDED * usual:
            continue
        first = int(np.argmax(at_extreme))
        sentence = (
            f"{count} of {values.size} samples of '{name}' stand at exactly its {side} value, "
            f"{extreme:.6g}, and at most {usual} at any value next to it: saturated, or held there "
            "by a command."
        )
        where = f"{name}, row {first}, t = {time[first]:.10g} s"
        found.append(Finding("saturation", "warning", count / values.size, where, sentence))
    return found


def _most_at_a_level(values: Array, extreme: float, side: str) -> int | None:
    """Samples at the fullest of the values next to the extreme; None if there are too few."""
    rest, most = values, 0
    level = extreme
    for _ in range(_LEVELS):
        rest = rest[rest < level] if side == "largest" else rest[rest > level]
        if not rest.size:
            return None
        level = rest.max() if side == "largest" else rest.min()
        most = max(most, int(np.count_nonzero(rest == level)))
    return most
