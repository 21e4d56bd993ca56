"""Drive of a recording: pulling velocity and load over time.

Both are piecewise linear. Derivatives with respect to the delays of changes are exact: a delay
moves the pieces on both sides. The velocities are measured or given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.arrays import Float
from asperity.errors import Argument, InputError, require
from asperity.loads import Excitation
from asperity.measurement.sliding.segments import Cut, Partition, partition, partition_at
from asperity.measurement.sliding.signals import SlidingSignals


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
    """The drive padded with empty pieces at its end, to one of a few lengths."""
    pieces = len(drive.pull)
    size = 8
    while size < pieces:
        size *= 2
    extra = size - pieces
    edges = np.concatenate([drive.edges, np.full(extra, drive.edges[-1])])
    # The empty pieces have the final values, because a sample may lie at the end.
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
        pull=drive.pull[piece] + drive.pull_slope[piece] * since,
    )


#: Smallest number of samples of a segment, for its velocity.
_SAMPLES = 3


class ConstantVelocities(NamedTuple):
    """Segments of a recording in which the drive has a constant velocity or rests.

    Attributes
    ----------
    cuts : list of Cut
        Times between the segments.
    speeds : list of float
        m/s, positive, 0 in a hold; one more than cuts.
    doubts : list of str
        Sentences on other possible segments, or on velocities that the recording contradicts.
    """

    cuts: list[Cut]
    speeds: list[float]
    doubts: list[str]


def constant_velocities(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> ConstantVelocities:
    """Segments of a recording; parameters as in `recorded_run`.

    Raises
    ------
    InputError
        If the numbers of velocities and segments differ, if the motion of the drive is neither
        recorded nor given, if the recording begins with a hold, or if the direction reverses.
    """
    result, speeds, holds = _given_or_measured(signals, name, steps, velocities)
    moving = [v for v, hold in zip(speeds, holds, strict=True) if not hold]
    if not moving or holds[0]:
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
    speeds = [0.0 if hold else sign * v for v, hold in zip(speeds, holds, strict=True)]
    # Two neighbouring holds are joined.
    kept = [k for k in range(len(result.cuts)) if speeds[k] or speeds[k + 1]]
    return ConstantVelocities(
        [result.cuts[k] for k in kept],
        [speeds[0], *(speeds[k + 1] for k in kept)],
        list(result.doubts),
    )


def _given_or_measured(
    signals: SlidingSignals,
    name: str,
    steps: Sequence[float] | None,
    velocities: Sequence[float] | None,
) -> tuple[Partition, list[float], list[bool]]:
    """The cuts, the signed velocities between them, and which segments are holds."""
    time, displacement = signals.time, signals.displacement
    if steps is not None:
        _require_segments(time, steps, name)
    if velocities is not None:
        if steps is None or len(velocities) != len(steps) + 1:
            got = f"{len(velocities)} for {len(steps or ())}"
            raise InputError("velocities", "be one more than the steps", got, "give both")
        speeds = [float(v) for v in velocities]
        result = partition_at(time, displacement, np.array(steps), speeds)
        return result, list(result.velocities), list(result.holds)
    if displacement is None:
        raise InputError(
            name,
            "have the displacement or velocity of the drive",
            f"none: {signals.no_motion}",
            f"name a channel, like {Argument('columns', 'displacement', 'x')}, or give "
            f"{Argument('steps')} and {Argument('velocities')}",
        )
    result = (
        partition(time, displacement)
        if steps is None
        else partition_at(time, displacement, np.array(steps))
    )
    return result, list(result.velocities), list(result.holds)


def _require_segments(time: Float, steps: Sequence[float], name: str) -> None:
    """Refuse steps that leave no samples between them.

    Raises
    ------
    InputError
    """
    edges = [float(time[0]), *map(float, steps), float(time[-1])]
    for begin, end in pairwise(edges):
        count = int(np.sum((time >= begin) & (time <= end))) if end > begin else 0
        if count < _SAMPLES:
            rule = (
                f"rise, with {_SAMPLES} samples or more between them and the ends of {name} "
                f"({edges[0]:.6g} to {edges[-1]:.6g} s)"
            )
            got = f"{count} between {begin:.6g} and {end:.6g} s"
            raise InputError("steps", rule, got, "correct them, or the window")
