"""A recording as data of a fit: friction over time, and the drive."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from asperity.arrays import Float, Index
from asperity.errors import InputError, require
from asperity.inference.runs.drive import Drive
from asperity.inference.runs.rate_dependence import LevelRate, level_rates
from asperity.inference.runs.recorded_drive import (
    constant_velocities,
    cut_uncertainty,
    joined_drive,
    load_course,
)
from asperity.measurement.samples import load_channel, shear_channel
from asperity.measurement.sliding.signals import sliding_signals
from asperity.parameters.arguments import typed
from asperity.recording import Trace
from asperity.recording.defects.resolution import coarsely_rounded
from asperity.recording.defects.sampling import even_times, rate_stretches
from asperity.recording.defects.saturation import saturated
from asperity.recording.readers import read
from asperity.units import KINDS

#: Kind of quantity of a stiffness, by the unit of the load.
STIFFNESS = {"N": "stiffness", "Pa": "stress_per_length", "": "per_length"}
#: Friction above this is a mistake of units.
_LARGEST_FRICTION = 5.0


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of samples whose means replace the samples of a long recording.

    Attributes
    ----------
    edges : array, shape (n, 2)
        Beginning and end of each block (s).
    samples : tuple of int
        Number of samples in a block, for each stretch with one sampling rate.
    recorded : int
        Number of samples of the recording.
    lines : tuple of float
        Spectral lines (Hz) that were subtracted from the friction before.
    """

    edges: Float
    samples: tuple[int, ...]
    recorded: int
    lines: tuple[float, ...] = ()

    @property
    def sentence(self) -> str:
        """A sentence on the averaging."""
        lengths = np.unique(np.round(np.diff(self.edges, axis=1)[:, 0], 9))
        spread = [f"{1e3 * x:.4g}" for x in (lengths[0], lengths[-1])]
        lines = ", ".join(f"{hertz:.4g}" for hertz in self.lines)
        return (
            f"{self.recorded} samples are compared as {len(self.edges)} means over blocks of "
            + (" or ".join(map(str, sorted(set(self.samples)))))
            + f" ({' to '.join(dict.fromkeys(spread))} ms)"
            + (f", after lines at {lines} Hz were subtracted" if lines else "")
        )


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A recording with its drive.

    Attributes
    ----------
    name : str
        Name of the run in messages and in names of nuisances.
    time, friction : array, shape (n,)
        Time from the first sample (s), and F/W; block means if `blocks` is set.
    slip : array, shape (n,)
        Displacement of the load point from the first sample (m).
    drive : Drive
    cuts : tuple of int
        Edges of the drive at which the pulling velocity changes.
    cut_uncertainty : tuple of float
        Standard uncertainty of the time of each cut (s).
    velocity : float
        Pulling velocity of the first segment (m/s).
    velocities : tuple of float
        Pulling velocities of all segments (m/s); 0 in a hold.
    origin : float
        Time of the first sample in the recording (s).
    W0 : float
        Load at the first sample, in `load_unit`.
    load_unit : str
        "N", "Pa", or "" if no load was recorded: K is then the stiffness over the load (1/m).
    load_varies : bool
    stretches : tuple of (int, int)
        First sample, and sample after the last, of each stretch with one sampling rate.
    doubts : tuple of str
        Sentences on uncertainties of the drive.
    spikes, jumps : tuple of float, or None
        Times (s) of single wrong samples, and times from which on the level of the gauge differs;
        None before they are searched.
    wrong : tuple of float, or None
        Times (s) of samples, or means, that neither a fitted motion nor its noise explains; None
        before they are searched.
    blocks : Blocks or None
        None if `friction` has single samples.
    level_rates : tuple of (float, float)
        d mu/d ln V with its standard uncertainty, from the steady friction before and after each
        velocity step, without a law; steps without steady friction are left out.
    """

    name: str
    time: Float
    friction: Float
    slip: Float
    drive: Drive
    cuts: tuple[int, ...]
    cut_uncertainty: tuple[float, ...]
    velocity: float
    velocities: tuple[float, ...]
    origin: float
    W0: float
    load_unit: str
    load_varies: bool
    stretches: tuple[tuple[int, int], ...]
    doubts: tuple[str, ...]
    spikes: tuple[float, ...] | None = None
    jumps: tuple[float, ...] | None = None
    wrong: tuple[float, ...] | None = None
    blocks: Blocks | None = None
    level_rates: tuple[LevelRate, ...] = ()

    @property
    def at(self) -> Float:
        """Times (n,) of the samples, or edges (n, 2) of the blocks, in seconds."""
        return self.time if self.blocks is None else self.blocks.edges

    @property
    def begins(self) -> Float:
        """Times of the samples, or of the beginnings of the blocks (s), shape (n,)."""
        return self.time if self.blocks is None else self.blocks.edges[:, 0]

    @typed
    def rows_at(self, times: Sequence[float]) -> Index:
        """Indices of the samples, or of the blocks, at given times (s) of samples."""
        return np.searchsorted(self.begins, times, side="right") - 1

    def recorded_times(self, times: Sequence[float] | Float) -> Float:
        """Times (s) from the first sample as times in the recording, as users give them."""
        return self.origin + np.asarray(times, float)

    @property
    def stiffness_unit(self) -> str:
        """Unit of K: the unit of the load over a length."""
        return KINDS[STIFFNESS[self.load_unit]].si


@typed
def recorded_run(
    recording: Trace | str | os.PathLike[str],
    *,
    name: str | None = None,
    window: tuple[float, float] | None = None,
    steps: Sequence[float] | None = None,
    velocities: Sequence[float] | None = None,
    load: str = "W",
    force: str = "F",
    spikes: Sequence[float] | None = None,
    jumps: Sequence[float] | None = None,
) -> RecordedRun:
    """Friction and drive of a recording, ready for `asperity.inference.fit`.

    Parameters
    ----------
    recording : Trace or path
        Result of `asperity.read`, or a file that it reads without further arguments.
    name : str, optional
        Name of the run; by default that of the file.
    window : (float, float), optional
        First and last time of the fit (s).
    steps : sequence of float, optional
        Times (s) at which the pulling velocity changes; by default detected in the displacement.
    velocities : sequence of float, optional
        Pulling velocities (m/s) of the segments, one more than `steps`, 0 in a hold; by default
        measured.
    load, force : str
        Channels, by name or role.
    spikes, jumps : sequence of float, optional
        Times (s) of single wrong samples, and of jumps of the gauge's level. They replace the
        automatic search; an empty sequence means none.

    Returns
    -------
    RecordedRun

    Raises
    ------
    InputError
        If channels are missing, the friction is constant, the recording begins with a hold, the
        direction reverses, or the load is not positive.
    """
    trace = recording if isinstance(recording, Trace) else read(recording)
    trace = replace(trace, time=even_times(trace.time))
    label = run_name(trace) if name is None else name
    signals = sliding_signals(trace, load, force, window)
    time, friction = signals.time, signals.friction
    segments = constant_velocities(signals, label, steps, velocities)
    course = load_course(trace, load, label, signals)
    drive, cuts = joined_drive(time, segments, course)
    origin, speeds = float(time[0]), segments.velocities
    times = time - origin
    slip_at_edges = speeds[0] * np.append(0.0, np.cumsum(drive.pull * np.diff(drive.edges)))
    # No recorder resolves 1e-9 of its range.
    changes = bool(np.ptp(friction) > 1e-9 * np.abs(friction).max())
    got = f"{friction[0]:.6g} throughout"
    advice = "it holds nothing to fit; name the channel of the shear force"
    require(changes, f"the friction of {label}", "vary", got, advice)
    doubts = [*segments.doubts, *(finding.sentence for finding in signals.signs)]
    doubts += clipped(trace, load, force, window)
    doubts += strange_friction(friction)
    if signals.left_out:
        doubts.append(
            f"{signals.left_out} samples are left out, because a value is no number or time does "
            "not increase"
        )
    return RecordedRun(
        name=label,
        time=times,
        friction=friction,
        slip=np.interp(times, drive.edges, slip_at_edges),
        drive=drive,
        cuts=cuts,
        cut_uncertainty=cut_uncertainty(time, segments.cuts),
        velocity=speeds[0],
        velocities=speeds,
        origin=origin,
        W0=float(course.values[0]),
        load_unit=course.unit,
        load_varies=bool(np.ptp(course.values) > 0),
        stretches=rate_stretches(times),
        doubts=tuple(doubts),
        spikes=_sample_times(spikes, origin, times, "spikes"),
        jumps=_sample_times(jumps, origin, times, "jumps"),
        wrong=None if spikes is None else (),
        level_rates=level_rates(
            times, friction, drive.load_at(times), drive.edges[list(cuts)], speeds
        ),
    )


def run_name(trace: Trace) -> str:
    """Name of a recording without another: that of its file, or "run"."""
    return Path(str(trace.provenance.get("file") or "run")).stem


def _sample_times(
    chosen: Sequence[float] | None, origin: float, times: Float, name: str
) -> tuple[float, ...] | None:
    """Times, from the first sample on, of samples that the user has chosen; None by default."""
    if chosen is None:
        return None
    result = []
    for at in chosen:
        k = int(np.argmin(np.abs(times - (at - origin))))
        if not 0 < k < times.size - 1:
            advice = f"it runs from {origin:.10g} s to {origin + times[-1]:.10g} s"
            raise InputError(name, "lie inside the recording", f"{at:.10g} s", advice)
        result.append(float(times[k]))
    return tuple(sorted(result))


def clipped(trace: Trace, load: str, force: str, window: tuple[float, float] | None) -> list[str]:
    """Sentences on samples at the end of the gauge's range."""
    values = shear_channel(trace, force, load_channel(trace, load))[0].values
    low, high = window or (-np.inf, np.inf)
    use = (trace.time >= low) & (trace.time <= high) & np.isfinite(values)
    time, values = trace.time[use], values[use]
    return [
        f"{level.rows.size} samples from {time[level.rows[0]]:.6g} s on are at the {level.side} "
        f"value, {level.value:.6g}: the gauge seems to be at the end of its range, and a fit to "
        "clipped friction is wrong; give a window without these samples"
        for level in saturated(values)
        # Extreme samples at the beginning or end of a recording are at rest, not clipped.
        if level.rows[0] > 0 and level.rows[-1] < values.size - 1
    ]


def strange_friction(friction: Float) -> list[str]:
    """Sentences on friction of unusual size, and on friction that was rounded too coarsely.

    Parameters
    ----------
    friction : array, shape (n,)
    """
    sentences = []
    usual = float(np.median(np.abs(friction)))
    if usual > _LARGEST_FRICTION:
        sentences.append(
            f"the median friction is {usual:.4g}, more than contacts have: correct the units of "
            "force and load, or the column"
        )
    rounded = coarsely_rounded(friction)
    if rounded is not None:
        sentences.append(
            f"{rounded[0]:.0%} of the values of friction repeat the preceding value, and others "
            f"differ from it by {rounded[1]:.2g}: friction was rounded more coarsely than its "
            "noise, which may change parameters by more than the intervals say; record or write "
            "more digits"
        )
    return sentences
