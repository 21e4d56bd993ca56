"""The regimes of a recording of friction: stick-slip, oscillation about sliding, steady sliding.

Events that follow each other make a train. The spring loads through every stick of a train; where
the force does not rise between two events as it does in the sticks, the slider slides.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np
from scipy.ndimage import median_filter

from asperity.arrays import Bool, Float
from asperity.measurement.stick_slip.events import STICKING, SlipEvents

#: Regimes whose mean drop is that of a cycle.
REPEATED = ("regular stick-slip", "irregular stick-slip")

Kind = Literal[
    "regular stick-slip",
    "irregular stick-slip",
    "growing stick-slip",
    "dying stick-slip",
    "oscillation about sliding",
    "steady sliding",
    "loading",
    "cannot tell",
]

#: Fewest events of a train, and of a train whose trend is judged.
_FEWEST, _FEWEST_OF_TREND = 3, 8
#: A part without events that lasts longer than this many cycles is a separate regime.
_LONG = 5.0
#: Number of events on each side that give the usual loading slope; ratio of the two slopes above
#: which the velocity or the stiffness has changed.
_NEIGHBOURS, _CHANGED = 5, 1.5
#: A part without events is a stick if the force rises by more than this share of usual loading.
_LOADED = 0.5
#: Largest relative spread of the loading slopes of a spring, for many events and for few: that of
#: friction with a spectrum of 1/f^2 is 0.6 and more, by chance 0.23 for few.
_ALIKE, _ALIKE_OF_FEW, _MANY_EVENTS = 0.5, 0.2, 20
#: Relative spread of drops and recurrences of a regular train.
_REGULAR = 0.15
#: Smallest ratio of the last drop to the first, by a straight line, of a train that grows; and
#: largest probability that this is chance.
_GROWTH, _GROWTH_CHANCE = 1.5, 1e-4
#: A stick shorter than this many slips is that of an oscillation.
_SYMMETRICAL = 1.5
#: Relative difference of a cycle from 2 pi sqrt(M/K).
_INERTIAL = 0.25
#: Share of impulses above which they may be the motion.
_MANY = 0.05
#: Sliding counts as steady if the smallest drop that could be detected and the trend are below this
#: share of the mean friction.
_BLIND = 0.2


@dataclass(frozen=True)
class Regime:
    """A part of a recording and what it is.

    Attributes
    ----------
    kind : str
        As in `Kind`.
    start, end : float
        Seconds.
    first, stop : int
        Events of it, as a slice.
    evidence : str
        A sentence with the numbers.
    """

    kind: Kind
    start: float
    end: float
    first: int
    stop: int
    evidence: str

    @property
    def sticks(self) -> bool:
        """Whether the slider stops between slips."""
        return self.kind.endswith("stick-slip")


def regimes(
    time: Float,
    force: Float,
    events: SlipEvents,
    smallest_drop: float,
    *,
    falls: int = 0,
    impulses: float = 0.0,
    natural_period: float = np.nan,
) -> tuple[Regime, ...]:
    """Divide a recording into trains of events and what lies between.

    Parameters
    ----------
    time, force : array, (n,)
    events : SlipEvents
    smallest_drop : float
        That could have been seen.
    falls : int
        Number of falls of the force, slip events or not.
    impulses : float
        Share of the samples that were taken for impulses.
    natural_period : float
        2 pi sqrt(M/K) (s); NaN where it is not known.
    """
    if not len(events):
        return (_without_events(time, force, smallest_drop, falls, impulses),)
    cycle, slope = _neighbours_median(events.recurrence), _neighbours_median(events.loading_slope)
    cycle = np.where(np.isfinite(cycle), cycle, float(time[-1] - time[0]) / 2)
    quiet = events.onset[1:] - events.end[:-1]
    rise = events.force_before[1:] - events.force_after[:-1]
    loads = rise > _LOADED * np.minimum(slope[:-1], slope[1:]) * quiet
    slides = (quiet > _LONG * np.maximum(cycle[:-1], cycle[1:])) & ~loads
    last_events = np.flatnonzero(slides | loading_changes(events.loading_slope))
    parts: list[Regime] = []
    edge, first = float(time[0]), 0
    for stop in [*(last_events + 1), len(events)]:
        begin, end = float(events.onset[first]), float(events.end[stop - 1])
        usual = float(cycle[first]), float(slope[first])
        parts += _between(time, force, (edge, begin), first, *usual)
        parts.append(_train(events, first, stop, (begin, end), natural_period))
        edge, first = end, int(stop)
    usual = float(cycle[-1]), float(slope[-1])
    parts += _between(time, force, (edge, float(time[-1])), first, *usual)
    return tuple(_without_single_events(parts))


def _without_single_events(parts: list[Regime]) -> list[Regime]:
    """Join parts in which sliding and trains too short for a regime alternate, as "cannot tell"."""
    merged: list[Regime] = []
    for short, group in groupby(parts, lambda r: r.stop - r.first < _FEWEST):
        run = list(group)
        trains = sum(r.stop > r.first for r in run)
        if short and trains > 1:
            first, last = run[0], run[-1]
            text = f"{last.stop - first.first} events in {trains} groups of fewer than {_FEWEST}"
            run = [Regime("cannot tell", first.start, last.end, first.first, last.stop, text)]
        merged += run
    return merged


def _neighbours_median(values: Float) -> Float:
    """Medians over the neighbours on both sides; NaN for a single event, which has no stick."""
    if values.size < 2:
        return values
    known = np.concatenate([values[1:2], values[1:]])
    return np.asarray(median_filter(known, 2 * _NEIGHBOURS - 1, mode="reflect"))


def loading_changes(slope: Float) -> Bool:
    """Whether the loading slope changes after each event but the last.

    The velocity or the stiffness has then changed.
    """
    changed = np.zeros(max(slope.size - 1, 0), bool)
    # The first event has no stick before it.
    known = slope[1:]
    if known.size < 2 * _NEIGHBOURS + 1:
        return changed
    windows = np.lib.stride_tricks.sliding_window_view(known, _NEIGHBOURS)
    # The stick in which the loading changes belongs to neither side.
    before, after = windows[: -_NEIGHBOURS - 1], windows[_NEIGHBOURS + 1 :]
    first, second = np.median(before, 1), np.median(after, 1)
    jump = np.abs(second - first)
    scatter = np.ptp(before, 1) + np.ptp(after, 1)
    loading = np.minimum(first, second) > 0
    differs = jump > (_CHANGED - 1) * np.minimum(first, second)
    clear = np.flatnonzero(loading & differs & (jump > 2 * scatter))
    # Among neighbouring places, the one with the most uniform slopes on both sides.
    for group in np.split(clear, np.flatnonzero(np.diff(clear) > 1) + 1):
        if group.size:
            changed[group[np.argmin(scatter[group])] + _NEIGHBOURS] = True
    return changed


def _without_events(
    time: Float, force: Float, smallest_drop: float, falls: int, impulses: float
) -> Regime:
    mean, change = abs(float(np.mean(force))), _rise(force)
    share, moved = (size / mean if mean else np.inf for size in (smallest_drop, abs(change)))
    seen = f"no fall of the force is larger than noise makes, {smallest_drop:.2g}"
    kind: Kind = "steady sliding" if share < _BLIND else "cannot tell"
    if kind == "cannot tell":
        seen += f", which is {100 * share:.2g} % of the mean: smaller drops cannot be seen"
    if abs(change) > max(_BLIND * mean, smallest_drop):
        kind = "cannot tell"
        seen += (
            f", and it {'rises' if change > 0 else 'falls'} by {100 * moved:.2g} % of its mean "
            "throughout: sliding, or a stick longer than the recording"
        )
    if falls:
        kind = "cannot tell"
        seen = (
            f"the force falls by more than noise makes {falls} time{'s' * (falls > 1)}, but not "
            "from one straight line to another: a transient of sliding, or slips unlike any other"
        )
    if impulses > _MANY:
        kind = "cannot tell"
        seen = (
            f"{100 * impulses:.2g} % of the samples stand out of their neighbours: slips faster "
            "than the sampling, or impulses; a higher sampling rate distinguishes them"
        )
    return Regime(kind, float(time[0]), float(time[-1]), 0, 0, seen)


def _rise(force: Float) -> float:
    """Change from the beginning to the end, from the means of its first and its last tenth."""
    tenth = max(force.size // 10, 1)
    return float(np.mean(force[-tenth:]) - np.mean(force[:tenth])) / 0.9


def _between(
    time: Float, force: Float, span: tuple[float, float], event: int, cycle: float, slope: float
) -> list[Regime]:
    """The part before, between or after trains, if it is long."""
    if not span[1] - span[0] > _LONG * cycle:
        return []
    rise = _rise(force[slice(*np.searchsorted(time, span))])
    load = slope * (span[1] - span[0])
    share = rise / load if load else np.nan
    kind: Kind = "loading" if rise > _LOADED * load else "steady sliding"
    text = f"no event in {(span[1] - span[0]) / cycle:.3g} cycles"
    if np.isfinite(share):
        text += f", and the force rises by {100 * share:.2g} % of what the sticks load in that time"
    return [Regime(kind, *span, event, event, text)]


def _train(
    events: SlipEvents,
    first: int,
    stop: int,
    span: tuple[float, float],
    natural_period: float,
) -> Regime:
    number = stop - first
    if number < _FEWEST:
        count = f"{number} event{'s' if number > 1 else ''}"
        text = f"{count} cannot tell stick-slip from a single slip"
        return Regime("cannot tell", *span, first, stop, f"{text}; {_FEWEST} can")
    cut, inner = slice(first, stop), slice(first + 1, stop)
    drop, recurrence = events.drop[cut], events.recurrence[inner]
    spread = _spread(drop, events.drop_uncertainty[cut])
    uneven = _spread(recurrence, events.timing_uncertainty[inner])
    ratio = float(np.median(events.stick_duration[inner] / events.slip_duration[inner]))
    text = (
        f"{number} events, drop {np.mean(drop):.3g} with a spread of {100 * spread:.2g} %, "
        f"recurrence {np.mean(recurrence):.3g} s with one of {100 * uneven:.2g} %, sticks "
        f"{ratio:.2g} times as long as slips"
    )
    slope = events.loading_slope[inner]
    usual = float(np.median(slope))
    other = 1.4826 * float(np.median(np.abs(slope - usual)))
    if not other < (_ALIKE if number >= _MANY_EVENTS else _ALIKE_OF_FEW) * usual:
        text += ": the force does not rise alike in the sticks, as a spring loads"
        return Regime("cannot tell", *span, first, stop, text)
    cycle = float(np.median(recurrence))
    inertial = abs(cycle / natural_period - 1) < _INERTIAL
    if np.isfinite(natural_period):
        text += f", median cycle {cycle / natural_period:.3g} times 2 pi sqrt(M/K)"
    if ratio < _SYMMETRICAL or (inertial and ratio < STICKING):
        return Regime("oscillation about sliding", *span, first, stop, text + _mains(cycle))
    if ratio < STICKING and not np.isfinite(natural_period):
        text += ": between stick-slip and an oscillation; give stiffness and mass to decide"
        return Regime("cannot tell", *span, first, stop, text)
    kind: Kind = "irregular stick-slip"
    if number >= _FEWEST_OF_TREND:
        # scipy.stats takes half a second to load, which a fit without events need not wait for.
        from scipy.stats import kendalltau

        tau = kendalltau(np.arange(number), drop)
        line = np.polynomial.polynomial.polyfit(np.linspace(0, 1, number), drop, 1)
        growth = float((line[0] + line[1]) / line[0]) if line[0] > 0 else np.inf
        if tau.pvalue < _GROWTH_CHANCE and not 1 / _GROWTH < growth < _GROWTH:
            kind = "growing stick-slip" if growth > 1 else "dying stick-slip"
            text += f", drops grow by a factor of {growth:.3g}"
    if kind == "irregular stick-slip" and max(spread, uneven) < _REGULAR:
        kind = "regular stick-slip"
    return Regime(kind, *span, first, stop, text)


def _spread(values: Float, uncertainty: Float) -> float:
    """Relative standard deviation without what noise adds."""
    variance = float(np.var(values)) - float(np.mean(uncertainty**2))
    return float(np.sqrt(max(variance, 0.0))) / float(np.mean(values))


def _mains(cycle: float) -> str:
    for mains in (50.0, 60.0):
        if abs(cycle * mains - 1) < 0.01:
            return f"; {mains:g} Hz is that of the mains"
    return ""
