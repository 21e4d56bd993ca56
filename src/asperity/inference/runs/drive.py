"""Drive of a recording: pulling velocity and load over time.

The velocity is piecewise constant, the load piecewise linear. Derivatives with respect to the
delays of changes are exact: a delay moves the pieces on both sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float
from asperity.loads import Excitation


class Drive(NamedTuple):
    """Pulling velocity, constant in each piece, and load, linear in each piece.

    Attributes
    ----------
    edges : array, shape (pieces + 1,)
        Times of the changes (s), the first 0.
    pull : array, shape (pieces,)
        Pulling velocity over that of the first piece.
    load, load_slope : array, shape (pieces,)
        W/W0 at the beginning of each piece and its slope (1/s).
    """

    edges: Any
    pull: Any
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
    """The drive padded with empty pieces at its end, to one of a few lengths."""
    pieces = len(drive.pull)
    extra = max(8, 1 << (pieces - 1).bit_length()) - pieces
    edges = np.concatenate([drive.edges, np.full(extra, drive.edges[-1])])
    # The empty pieces have the final values, because a sample may lie at the end.
    last = drive.load[-1] + drive.load_slope[-1] * float(drive.edges[-1] - drive.edges[-2])
    return Drive(
        edges,
        np.concatenate([drive.pull, np.full(extra, drive.pull[-1])]),
        np.concatenate([drive.load, np.full(extra, last)]),
        np.concatenate([drive.load_slope, np.zeros(extra)]),
    )


def shifted(drive: Drive, values: Mapping[str, Array]) -> Drive:
    """The drive with edges delayed by the values `shift` (s)."""
    drive = Drive(*map(jnp.asarray, drive))
    return drive._replace(edges=drive.edges + values["shift"])


def excitation(drive: Drive, values: Mapping[str, Array], piece: Array, t: Array) -> Excitation:
    """Excitation at a time of a piece; the slider feels `eps_ratio` of the change of the load."""
    since = t - drive.edges[piece]
    ratio = values.get("eps_ratio", 1.0)
    load = drive.load[piece] + drive.load_slope[piece] * since
    return Excitation(
        w=1 + ratio * (load - 1),
        w_slope=ratio * drive.load_slope[piece],
        pull=drive.pull[piece],
    )
