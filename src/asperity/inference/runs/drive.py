"""Drive of a recording: pulling velocity and load over time.

The velocity is piecewise constant, the load piecewise linear. Derivatives with respect to the
delays of changes are exact: a delay moves the pieces on both sides. The velocities are measured or
given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.loads import Excitation
from asperity.measurement.sliding.segments import (
    Partition,
    partition,
    partition_at,
    require_cuts,
)
from asperity.measurement.sliding.signals import SlidingSignals


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


def constant_velocities(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> Partition:
    """Segments in which the drive has a constant velocity, positive, or rests.

    Parameters as in `recorded_run`.

    Raises
    ------
    InputError
        If the numbers of velocities and segments differ, if the motion of the drive is neither
        recorded nor given, if the recording begins with a hold, or if the direction reverses.
    """
    result = _given_or_measured(signals, name, steps, velocities)
    both = list(zip(result.velocities, result.holds, strict=True))
    moving = [v for v, hold in both if not hold]
    if not moving or result.holds[0]:
        raise InputError(
            f"{name} must begin with sliding at a constant velocity, got "
            f"{'no sliding' if not moving else 'a hold'}; give a window that does"
        )
    sign = float(np.sign(moving[0]))
    advice = "give another channel of the displacement, or a window that slides"
    require(sign != 0, f"the displacement of {name}", "move", "noise alone", advice)
    if any(sign * v <= 0 for v in moving):
        raise InputError(
            f"{name} must slide in one direction, got a reversal; give a window without"
        )
    speeds = [0.0 if hold else sign * float(v) for v, hold in both]
    # Two neighbouring holds are joined.
    kept = [k for k in range(len(result.cuts)) if speeds[k] or speeds[k + 1]]
    speeds = [speeds[0], *(speeds[k + 1] for k in kept)]
    return Partition(
        tuple(result.cuts[k] for k in kept),
        tuple(speeds),
        tuple(v == 0 for v in speeds),
        result.doubts,
    )


def _given_or_measured(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> Partition:
    """The segments, with signed velocities."""
    time, displacement = signals.time, signals.displacement
    if velocities is not None and (steps is None or len(velocities) != len(steps) + 1):
        got = f"{len(velocities)} for {len(steps or ())}"
        raise InputError("velocities", "be one more than the steps", got, "give both")
    if displacement is None and velocities is None:
        raise InputError(
            name,
            "have the displacement or velocity of the drive",
            f"none: {signals.no_motion}",
            f"name a channel, like {Argument('columns', 'displacement', 'x')}, or give "
            f"{Argument('steps')} and {Argument('velocities')}",
        )
    if steps is None:
        return partition(time, displacement)
    require_cuts(time, steps, "steps")
    return partition_at(time, displacement, np.array(steps), velocities)
