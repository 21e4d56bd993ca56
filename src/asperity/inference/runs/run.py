"""A recording as data of a fit: friction over time, and the drive."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.linalg import solveh_banded
from scipy.optimize import minimize_scalar
from scipy.special import ndtri

from asperity.arrays import Float, Index
from asperity.errors import InputError, require
from asperity.inference.runs.drive import Drive, constant_velocities
from asperity.inference.runs.levels import LevelRate, level_rates
from asperity.measurement.samples import compressive, load_channel, shear_channel
from asperity.measurement.sliding.segments import Cut
from asperity.measurement.sliding.signals import sliding_signals
from asperity.parameters.arguments import typed
from asperity.recording import Trace
from asperity.recording.defects.levels import coarsely_rounded, saturated
from asperity.recording.defects.sampling import even_times, rate_stretches
from asperity.recording.readers import read
from asperity.units import KINDS, quantity_text

#: Kind of quantity of a stiffness, by the unit of the load.
STIFFNESS = {"N": "stiffness", "Pa": "stress_per_length", "": "per_length"}
#: A load that varies by less than this share of its mean is taken as constant.
_CONSTANT_LOAD = 1e-3
#: The piecewise linear load follows the recorded load to this many standard deviations of its
#: noise.
_LOAD_NOISE = 5.0
#: Two corners of the load closer than this many samples may be one.
_CORNERS_MERGE = 5
#: Number of samples on each side of a corner from which its time is computed.
_SAMPLES_NEAR_CORNER = 50
#: Largest number of samples that are compared one by one.
LONGEST = 20_000
#: For longer recordings: number of blocks over which the load between its quick changes is
#: averaged, and probability that noise moves a sample beyond the limit.
_LOAD_BLOCKS, _LOAD_BY_CHANCE = 4_000, 1e-3
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

    @typed
    def rows_at(self, times: Sequence[float]) -> Index:
        """Indices of the samples, or of the blocks, at given times (s) of samples."""
        begin = self.time if self.blocks is None else self.blocks.edges[:, 0]
        return np.searchsorted(begin, times, side="right") - 1

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
    speeds, doubts = segments.velocities, list(segments.doubts)
    origin = float(time[0])
    cut_times = [cut.time - origin for cut in segments.cuts]
    times = time - origin
    W, unit, varies, knots, load_values = _load(trace, load, label, time, signals.load_unit)
    cut_times = _with_corners(times, cut_times, knots - origin)
    drive, cuts = _drive(times, cut_times, speeds, knots - origin, load_values / W)
    slip = np.interp(
        times,
        [0.0, *cut_times, times[-1]],
        np.concatenate([[0.0], np.cumsum(np.array(speeds) * np.diff([0, *cut_times, times[-1]]))]),
    )
    # No recorder resolves 1e-9 of its range.
    changes = bool(np.ptp(friction) > 1e-9 * np.abs(friction).max())
    got = f"{friction[0]:.6g} throughout"
    advice = "it holds nothing to fit; name the channel of the shear force"
    require(changes, f"the friction of {label}", "vary", got, advice)
    doubts += [finding.sentence for finding in signals.signs]
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
        slip=slip,
        drive=drive,
        cuts=tuple(cuts),
        cut_uncertainty=_cut_uncertainty(time, segments.cuts),
        velocity=speeds[0],
        velocities=speeds,
        origin=origin,
        W0=W,
        load_unit=unit,
        load_varies=varies,
        stretches=rate_stretches(times),
        doubts=tuple(doubts),
        spikes=_sample_times(spikes, origin, times, "spikes"),
        jumps=_sample_times(jumps, origin, times, "jumps"),
        wrong=None if spikes is None else (),
        level_rates=level_rates(times, friction, drive.load_at(times), cut_times, speeds),
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


def _cut_uncertainty(time: Float, cuts: Sequence[Cut]) -> tuple[float, ...]:
    """Standard uncertainty of the time of each cut (s)."""
    uncertain = []
    for cut in cuts:
        i = int(np.clip(np.searchsorted(time, cut.time), 1, time.size - 1))
        interval = float(np.median(np.diff(time[max(0, i - 3) : i + 3])))
        uncertain.append(max(interval, cut.doubt / 2))
    return tuple(uncertain)


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


def recorded_load(
    trace: Trace, load: str, time: Float, subject: str, advice: str
) -> tuple[Float, Float] | None:
    """Times and load, positive in compression, of the samples within the span of `time`.

    None if no load is recorded.

    Raises
    ------
    InputError
        If the load is not positive.
    """
    channel = load_channel(trace, load)
    if channel is None:
        return None
    good = np.isfinite(channel.values) & (trace.time >= time[0]) & (trace.time <= time[-1])
    t, W = trace.time[good], compressive(channel.values[good], channel.values[good])[0]
    if t.size < 2:
        return None
    if not (W > 0).all():
        lowest = int(np.argmin(W))
        got = f"{quantity_text(W[lowest], channel.unit)} at {t[lowest]:.6g} s"
        raise InputError(subject, "be under a positive load", got, advice)
    order = np.argsort(t, kind="stable")
    return t[order], W[order]


def _load(
    trace: Trace, load: str, name: str, time: Float, unit: str
) -> tuple[float, str, bool, Float, Float]:
    """Load at the first sample, its unit, whether it varies, and its piecewise linear course."""
    ends = time[[0, -1]]
    recorded = recorded_load(
        trace, load, time, name, "give a window in which the slider is in contact"
    )
    if recorded is None:
        return 1.0, "", False, ends, np.ones(2)
    t, W = recorded
    mean = float(W.mean())
    noise = float(np.median(np.abs(np.diff(W, 2)))) / 0.6745 / np.sqrt(6.0) if W.size > 4 else 0.0
    knots = _load_knots(t, W, noise, _CONSTANT_LOAD * mean)
    if len(knots) == 2 and abs(W[0] - W[-1]) < _CONSTANT_LOAD * mean + _LOAD_NOISE * noise:
        return mean, unit, False, ends, np.full(2, mean)
    at = _corner_times(t, W, knots, max(_LOAD_NOISE * noise, _CONSTANT_LOAD * mean))
    at = _fitted_corners(t, W, at)
    values = _line_through(t, W, at)
    at[0], at[-1] = time[0], time[-1]
    return float(values[0]), unit, True, at, values


def _load_knots(t: Float, W: Float, noise: float, least: float) -> list[int]:
    """Samples at the corners of a piecewise linear load that follows the recorded load.

    Among very many samples, noise alone moves some beyond the limit. Quick changes are therefore
    detected with a wider limit, and slow changes between them in block means.
    """
    if t.size <= LONGEST:
        knots = _line_knots(t, W, max(_LOAD_NOISE * noise, least))
        return _needed_knots(t, W, knots, noise, least)
    chance = -float(ndtri(_LOAD_BY_CHANCE / t.size))
    knots = _line_knots(t, W, max(2 * chance * noise, least))
    result = set(knots)
    for a, b in pairwise(knots):
        q = max(1, (b - a) // _LOAD_BLOCKS)
        if q == 1:
            continue
        whole = (b - a) // q * q
        means = [x[a : a + whole].reshape(-1, q).mean(1) for x in (t, W)]
        limit = max(_LOAD_NOISE * noise / np.sqrt(q), least)
        result |= {a + k * q + q // 2 for k in _line_knots(means[0], means[1], limit)[1:-1]}
    return _needed_knots(t, W, sorted(result), noise, least)


def _corner_times(t: Float, y: Float, knots: Sequence[int], tolerance: float) -> Float:
    """Times of the corners; a corner between two samples is placed where the lines meet.

    A corner between two samples may appear as two corners at these samples, or at samples further
    away, because the line follows the load within a tolerance only. Friction responds to the load
    within a fraction of a sampling interval, so that the exact time matters.
    """
    at = t[list(knots)]
    values = _line_through(t, y, at)
    slope = np.diff(values) / np.diff(at)
    size = np.diff(knots)
    kept = list(at[:1])
    k = 1
    while k < at.size:
        if k + 2 < at.size and size[k] <= min(_CORNERS_MERGE, size[k - 1] - 1, size[k + 1] - 1):
            before, after = slope[k - 1], slope[k + 1]
            gap = values[k + 1] - after * at[k + 1] - (values[k] - before * at[k])
            meeting = gap / (before - after) if before != after else np.nan
            near = slice(knots[k], knots[k + 1] + 1)
            line = np.where(
                t[near] < meeting,
                values[k] + before * (t[near] - at[k]),
                values[k + 1] + after * (t[near] - at[k + 1]),
            )
            if at[k] < meeting < at[k + 1] and np.abs(line - y[near]).max() <= tolerance:
                kept.append(meeting)
                k += 2
                continue
        kept.append(at[k])
        k += 1
    return np.array(kept)


def _fitted_corners(t: Float, y: Float, at: Float) -> Float:
    """Corners moved by up to an interval, to the best fit of the lines on both sides to y."""
    placed = at.copy()
    for k in range(1, at.size - 1):
        middle = int(np.searchsorted(t, at[k]))
        first = max(middle - _SAMPLES_NEAR_CORNER, int(np.searchsorted(t, placed[k - 1])))
        last = min(middle + _SAMPLES_NEAR_CORNER, int(np.searchsorted(t, at[k + 1], side="right")))
        near, values = t[first:last], y[first:last]
        if not first + 1 < middle < last - 2:
            continue

        def squares(corner: float, near: Float = near, values: Float = values) -> float:
            knots = np.array([near[0], corner, near[-1]])
            line = np.interp(near, knots, _line_through(near, values, knots))
            return float(np.sum((line - values) ** 2))

        inside = max(t[middle - 1], near[1]), min(t[middle + 1], near[-2])
        result = minimize_scalar(squares, bounds=inside, method="bounded")
        if result.fun < squares(at[k]):
            placed[k] = result.x
    return placed


def _line_through(t: Float, y: Float, at: Float) -> Float:
    """Values at the knots of the piecewise linear function that fits y best."""
    i = np.clip(np.searchsorted(at, t, side="right") - 1, 0, at.size - 2)
    share = (t - at[i]) / (at[i + 1] - at[i])
    # Normal equations of the hat functions; each has a sample at its knot or next to it.
    bands = np.zeros((2, at.size))
    bands[1] = np.bincount(i, (1 - share) ** 2, at.size) + np.bincount(i + 1, share**2, at.size)
    bands[0, 1:] = np.bincount(i, share * (1 - share), at.size)[:-1]
    right = np.bincount(i, (1 - share) * y, at.size) + np.bincount(i + 1, share * y, at.size)
    return np.asarray(solveh_banded(bands, right))


def _line_knots(t: Float, y: Float, tolerance: float) -> list[int]:
    """Corners of a polyline through y within a tolerance (Ramer, Douglas, Peucker)."""

    def away(a: int, b: int) -> Float:
        """Distances from the chord."""
        chord = y[a] + (y[b] - y[a]) * (t[a : b + 1] - t[a]) / max(t[b] - t[a], 1e-300)
        return np.abs(y[a : b + 1] - chord)

    kept = {0, t.size - 1}
    parts = [(0, t.size - 1)]
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        apart = away(a, b)
        k = int(np.argmax(apart))
        if apart[k] > tolerance:
            kept.add(a + k)
            parts += [(a, a + k), (a + k, b)]
    return sorted(kept)


def _needed_knots(
    t: Float, y: Float, knots: Sequence[int], noise: float, least: float
) -> list[int]:
    """Knots that are needed: without them, the best piecewise linear fit to y is too poor.

    The corners come from chords through noisy samples, and some of them are no corners of the load.
    Without a corner, the line between its neighbours has a larger sum of squares; the increase is
    compared with the penalty of the Bayesian information criterion for a corner's time and value.
    """
    at = np.asarray(knots)
    span = float(t[-1] - t[0])
    x, v = (t - t[0]) / span, y - y.mean()
    columns = np.stack([np.ones_like(x), x, x * x, v, x * v])
    sums = np.pad(np.cumsum(columns, axis=1), ((0, 0), (1, 0)))
    penalty = 2 * np.log(t.size)
    while at.size > 2:
        a, k, b = at[:-2], at[1:-1], at[2:]
        n, x1, x2, v1, xv = sums[:, b + 1] - sums[:, a]
        m, h1, h2, hv1, hxv = sums[:, b + 1] - sums[:, k]
        here = x[k]
        # The hinge function (x - here)+ less its best linear fit.
        h, hx = h1 - here * m, h2 - here * h1
        hh, hv = hx - here * h, hxv - here * hv1
        spread = x2 - x1 * x1 / n
        slope = (hx - x1 * h / n) / spread
        size = hh - h * h / n - slope * (hx - x1 * h / n)
        bend = (hv - h * v1 / n - slope * (xv - x1 * v1 / n)) / np.maximum(size, 1e-300)
        gain = bend * bend * size
        high = np.abs(bend) * (here - x[a]) * (x[b] - here) / (x[b] - x[a])
        worth = np.minimum(gain / (penalty * noise**2), high / least) if noise else high / least
        # Among neighbours that are not needed, the less needed corner is removed first.
        lower = np.concatenate([[np.inf], worth, [np.inf]])
        gone = (worth < 1) & (worth <= lower[:-2]) & (worth < lower[2:])
        if not gone.any():
            break
        at = np.delete(at, 1 + np.flatnonzero(gone))
    return at.tolist()


def _with_corners(times: Float, cut_times: Sequence[float], knots: Float) -> list[float]:
    """Times of velocity changes; those within a sampling interval of a load corner move to it.

    The drive then changes velocity and load at once. The time of a corner is known to a fraction of
    the interval, that of a velocity change is not; a short piece between them would leave no room
    for the delay of the change.
    """
    moved = []
    for cut in cut_times:
        k = int(np.clip(np.searchsorted(times, cut), 1, times.size - 1))
        corner = float(knots[np.argmin(np.abs(knots - cut))])
        close = 0 < corner < times[-1] and abs(corner - cut) < times[k] - times[k - 1]
        moved.append(corner if close else cut)
    return sorted(set(moved)) if len(set(moved)) == len(moved) else list(cut_times)


def _drive(
    times: Float, cut_times: Sequence[float], speeds: Sequence[float], knots: Float, load: Float
) -> tuple[Drive, list[int]]:
    """The drive, and the indices of its edges at which the velocity changes."""
    edges = np.unique(np.concatenate([[0.0, times[-1]], cut_times, knots]))
    middle = (edges[1:] + edges[:-1]) / 2
    piece = np.searchsorted(np.asarray(cut_times), middle)
    pull = np.asarray(speeds)[piece] / speeds[0]
    at_edges = np.interp(edges, knots, load)
    slope = np.diff(at_edges) / np.diff(edges)
    cuts = [int(np.searchsorted(edges, c)) for c in cut_times]
    return Drive(edges, pull, at_edges[:-1], slope), cuts
