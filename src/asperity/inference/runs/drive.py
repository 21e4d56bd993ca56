"""Drive of a recording: pulling velocity and load over time.

Both are linear in each of a few pieces. Derivatives to the delays of the changes are exact: a
change moves the pieces on either side of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.loads import Excitation

Float = NDArray[np.float64]


class Drive(NamedTuple):
    """Pulling velocity and load over time, linear in each piece.

    Attributes
    ----------
    edges : array, shape (pieces + 1,)
        Times of the changes (s), the first 0.
    pull, pull_slope : array, shape (pieces,)
        Pulling velocity over that of the first piece at the beginning of each piece, and its
        slope (1/s).
    load, load_slope : array, shape (pieces,)
        W/W0 at the beginning of each piece and its slope (1/s).
    """

    edges: Any
    pull: Any
    pull_slope: Any
    load: Any
    load_slope: Any

    def load_at(self, times: Float) -> Float:
        """W/W0 at times (s) from the beginning."""
        piece = np.searchsorted(self.edges, times, side="right") - 1
        piece = np.clip(piece, 0, len(self.load) - 1)
        return np.asarray(
            self.load[piece] + self.load_slope[piece] * (times - self.edges[piece]), np.float64
        )


def filled_up(drive: Drive) -> Drive:
    """The drive with empty pieces at its end, to one of a few lengths."""
    pieces = len(drive.pull)
    size = 8
    while size < pieces:
        size *= 2
    extra = size - pieces
    edges = np.concatenate([drive.edges, np.full(extra, drive.edges[-1])])
    # Their values are those at the end, where a sample may lie.
    last = float(drive.edges[-1] - drive.edges[-2])

    def padded(values: Float, slopes: Float) -> tuple[Float, Float]:
        end = values[-1] + slopes[-1] * last
        return (
            np.concatenate([values, np.full(extra, end)]),
            np.concatenate([slopes, np.zeros(extra)]),
        )

    return Drive(
        edges, *padded(drive.pull, drive.pull_slope), *padded(drive.load, drive.load_slope)
    )


def shifted(drive: Drive, values: Mapping[str, Array]) -> Drive:
    """The drive whose edges are later by the values `shift` (s)."""
    drive = Drive(*map(jnp.asarray, drive))
    return drive._replace(edges=drive.edges + values["shift"])


def excitation(drive: Drive, values: Mapping[str, Array], piece: Array, t: Array) -> Excitation:
    """What acts on the slider at a time of a piece; `eps_ratio` of the load's change reaches it."""
    since = t - drive.edges[piece]
    ratio = values.get("eps_ratio", 1.0)
    load = drive.load[piece] + drive.load_slope[piece] * since
    return Excitation(
        w=1 + ratio * (load - 1),
        w_slope=ratio * drive.load_slope[piece],
        pull=drive.pull[piece] + drive.pull_slope[piece] * since,
    )
