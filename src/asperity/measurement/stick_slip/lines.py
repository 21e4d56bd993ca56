"""Straight lines through many runs of samples of a recording."""

from __future__ import annotations

import numpy as np

from asperity.arrays import Float, Index


class Sums:
    """Sums over samples from which a straight line through any run of them follows.

    Times and forces of each event's cell are counted from its middle, so that squares of long
    recordings lose no digits.
    """

    def __init__(self, force: Float, edges: Index, origin: Index) -> None:
        # What lies before the first edge belongs to the first cell.
        inner = np.minimum(edges[1:], force.size)
        cells = np.append(inner, force.size) - np.append(0, inner)
        t = np.arange(force.size) - np.repeat(origin.astype(float), cells)
        y = force - np.repeat(force[origin], cells)
        self.origin, self.level = origin.astype(float), force[origin]
        self.t, self.tt, self.y, self.ty, self.yy = (
            np.concatenate([[0.0], np.cumsum(v)]) for v in (t, t * t, y, t * y, y * y)
        )

    def line(self, first: Index, stop: Index) -> tuple[Float, Float, Float, Float]:
        """Level and slope at the origin of the cell, sum of squared residuals, mean of t.

        `first` and `stop` bound runs inside one cell each.
        """
        n = (stop - first).astype(float)
        t, tt, y, ty, yy = (s[stop] - s[first] for s in (self.t, self.tt, self.y, self.ty, self.yy))
        n = np.maximum(n, 1.0)
        power = np.maximum(tt - t * t / n, 1e-9)
        slope = (ty - t * y / n) / power
        rest = yy - y * y / n - slope * (ty - t * y / n)
        return (y - slope * t) / n, slope, np.maximum(rest, 0.0), t / n
