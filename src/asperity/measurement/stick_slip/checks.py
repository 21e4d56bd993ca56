"""Checks of a stick-slip measurement: regimes, events, sticks, channels and resolution."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from asperity.arrays import Float, Index
from asperity.measurement.samples import about_channels
from asperity.measurement.sliding.signals import SlidingSignals
from asperity.measurement.stick_slip.events import SlipEvents
from asperity.measurement.stick_slip.regimes import loading_changes
from asperity.measurement.verdicts.checks import findings
from asperity.measurement.verdicts.verdict import STICK_SLIP, Check, percent
from asperity.recording.defects.check import saturation
from asperity.recording.defects.resolution import coarsely_rounded, recorder_step
from asperity.recording.defects.saturation import CROWDED
from asperity.recording.trace import Trace

if TYPE_CHECKING:
    from asperity.measurement.stick_slip.measure import StickSlipMeasurement

#: Events below this multiple of the smallest detectable drop show that smaller ones may be missing.
_NEAR = 1.5
#: Above this ratio of the samples at the extreme level of the recorder to those at the next level,
#: the signal is saturated. Straight loading fills all levels alike: of 480 extremes of simulated
#: recordings without saturation, 474 stay below; the other 6 have three samples or fewer.
_CROWDED = 1.5


def checks_of(
    result: StickSlipMeasurement, trace: Trace, signals: SlidingSignals, *, upside_down: bool
) -> list[Check]:
    """All checks of a measurement.

    Parameters
    ----------
    result : StickSlipMeasurement
    trace : Trace
        The recording.
    signals : SlidingSignals
        Signals that were read from it.
    upside_down : bool
        Whether the sign of friction was reversed, because it rose in the slips.
    """
    return [
        *_checks(result),
        *_channel_checks(result, trace, signals),
        *_sign_checks(signals.turned, upside_down),
        *_resolution_checks(signals.friction, result.events),
    ]


def _checks(result: StickSlipMeasurement) -> list[Check]:
    """Checks of the regimes; of complete events, if there are any, and of their sticks."""
    count = len(result.events)
    text = f"{count} complete event{'' if count == 1 else 's'}"
    doubt = "; means and spreads of so few events are uncertain"
    checks = [_check("events", count, text, doubt), _regime_check(result)]
    if not count:
        return checks
    trains = [np.arange(r.first + 1, r.stop) for r in result.regimes if r.sticks]
    after = np.concatenate([np.empty(0, np.intp), *trains])
    return [*checks, *_event_checks(result), *_stick_checks(result, after), *_stiffness(result)]


def _check(name: str, number: float, text: str, doubt: str = "", error: float = 0.0) -> Check:
    """A check whose sentence ends with `doubt` if it is not ok; `error` is a standard error."""
    check = STICK_SLIP.check(name, number, text, significant=not abs(number) < 3 * error)
    return check if check.verdict == "ok" else replace(check, sentence=text + doubt)


def _regime_check(result: StickSlipMeasurement) -> Check:
    unknown = [regime for regime in result.regimes if regime.kind == "cannot tell"]
    kind = result.kind
    for regime in unknown[:1]:
        kind = (
            f"cannot tell the regime from {regime.start:.4g} to {regime.end:.4g} s: "
            f"{regime.evidence}"
        )
    # The measured drop of a sine is a third too small: a sine has no stick before the slip.
    swings = [regime for regime in result.regimes if regime.kind.startswith("oscillation")]
    doubt = "; its cycles have no sticks, so that drops and durations of slips do not apply"
    number = len(unknown) + len(swings)
    return _check("regime", number, kind, doubt if swings and not unknown else "")


def _event_checks(result: StickSlipMeasurement) -> list[Check]:
    """Whether loading and drops stay the same, and events are large and long enough."""
    events, least = result.events, result.smallest_drop
    changes = int(np.count_nonzero(loading_changes(events.loading_slope)))
    changed = (
        ", as velocity or stiffness does; V, slope and means are those of all cycles: give a window"
    )
    drop = float(np.median(events.drop))
    step = float(result.time[-1] - result.time[0]) / (result.time.size - 1)
    near = float(np.mean(events.drop < _NEAR * least))
    small = (
        f"drops below {least:.2g}, {percent(least / drop)} of the median, may not be detected; "
        f"{percent(near)} of the events are smaller than {_NEAR:g} times this limit"
    )
    missing = ": some events below the limit may be missing"
    fast = float(np.mean(events.slip_duration < 2 * step))
    short = (
        f"{percent(fast)} of the slips last for less than two samples: their durations and "
        "velocities are bounds; a higher sampling rate resolves them"
    )
    drift = float(np.ptp(events.force_before + events.force_after)) / 2 / drop
    varies = f"the middle of the drops varies along the track by {drift:.2g} drops"
    return [
        _check("loading", changes, f"the loading slope changes {changes} times", changed),
        _check("threshold", near, small, missing),
        _check("sampling", fast, short),
        _check("drift", drift, varies),
    ]


def _stick_checks(result: StickSlipMeasurement, after: Index) -> list[Check]:
    """Whether the sticks that end in the events `after` load in straight lines."""
    checks = []
    if after.size:
        ringing = _ringing(result, after)
        text = (
            "after a slip the mean force departs from the line of the stick by up to "
            f"{percent(ringing)} of the drop"
        )
        doubt = (
            ": the gauge or the slider rings or follows slowly; drops and ends are uncertain by as "
            "much"
        )
        checks.append(_check("ringing", ringing, text, doubt))
    hidden, error = _undetected_share(result, after)
    if np.isfinite(hidden):
        than = f"{percent(abs(hidden))} {'less' if hidden > 0 else 'more'} than"
        text = f"the mean loading of the sticks is {than} the usual loading"
        doubt = ": small events are missing, or drops are measured too small"
        checks.append(_check("hidden events", hidden, text, doubt, error))
    return checks


def _stiffness(result: StickSlipMeasurement) -> list[Check]:
    stiffness, error = result.stiffness_from_slope
    stated = result.machine.stiffness
    if stated is None or not np.isfinite(stiffness):
        return []
    text = (
        f"loading slope, load and velocity make a stiffness of {stiffness:.4g} +- "
        f"{error:.1g} N/m, {stiffness / stated:.3g} times the stated {stated:.4g} N/m"
    )
    return [_check("stiffness", abs(stiffness / stated - 1), text, error=error / stated)]


def _channel_checks(
    result: StickSlipMeasurement, trace: Trace, signals: SlidingSignals
) -> list[Check]:
    """Findings of the channels that were read; saturation by the limit for their regimes."""
    left_out = ("spike", "saturation")
    about = [f for f in about_channels(trace, signals.names) if f.name not in left_out]
    about += signals.signs
    crowded = _CROWDED if any(regime.sticks for regime in result.regimes) else CROWDED
    for name in signals.names:
        cut_off = saturation(trace.channel(name).values, trace.time, name, crowded)
        about += [f for f in cut_off if f.name == "saturation"]
    return findings(about, len(trace), float(result.time[-1] - result.time[0]))


def _sign_checks(turned: bool, upside_down: bool) -> list[Check]:
    if not (turned or upside_down):
        return []
    text = (
        "the force is recorded with the opposite sign, with which it falls slowly and rises "
        "fast; its sign was reversed"
        if turned != upside_down
        else "the force is negative on average, but rises slowly and falls fast: drops are "
        "right, but forces before and after a drop lack the zero of the gauge"
    )
    return [STICK_SLIP.check("sign", 1.0, text)]


def _resolution_checks(friction: Float, events: SlipEvents) -> list[Check]:
    steps = coarsely_rounded(friction)
    if not (steps and len(events)):
        return []
    coarse = steps[1] / float(np.median(events.drop))
    text = f"the recorder's steps, {steps[1]:.2g}, are {percent(coarse)} of the median drop"
    return [STICK_SLIP.check("resolution", coarse, text)]


def _stick_lines(events: SlipEvents, after: Index, time: Float) -> Float:
    """Force on the line of the stick that ends in each event `after`, at times (s)."""
    ahead = events.force_before[after] + events.creep[after]
    return np.asarray(ahead + events.loading_slope[after] * (time - events.onset[after]))


def _ringing(result: StickSlipMeasurement, after: Index) -> float:
    """Largest mean departure of the force after slips from the lines of the sticks, over the drop.

    The departures are means over a quarter of the slip duration, within three slip durations after
    the end, averaged over all events. A gauge that rings as slowly as the slider slips bends the
    lines that give drops and ends.
    """
    events, (time, force) = result.events, (result.time, result.friction)
    width = max(float(np.median(events.slip_duration)) / 4, 2 * (time[1] - time[0]))
    total = np.concatenate([[0.0], np.cumsum(force - force.mean())])
    # One row for each time after the slip, one column for each stick.
    edges = events.end[after - 1] + width * np.arange(13)[:, None]
    at = np.searchsorted(time, edges)
    count = np.diff(at, axis=0)
    mean = np.diff(total[at], axis=0) / np.maximum(count, 1) + force.mean()
    off = mean - _stick_lines(events, after, (edges[1:] + edges[:-1]) / 2)
    quarter = events.stick_duration[after] / 4
    inside = (edges[1:] <= events.end[after - 1] + quarter) & (count > 0)
    largest = 0.0
    for column, known in zip(off, inside, strict=True):
        values = column[known]
        error = float(np.std(values) / np.sqrt(values.size)) if values.size > 2 else np.inf
        usual = abs(float(np.mean(values))) if values.size else 0.0
        largest = max(largest, usual if usual >= 4 * error else 0.0)
    return largest / float(np.median(events.drop))


def _undetected_share(result: StickSlipMeasurement, after: Index) -> tuple[float, float]:
    """Share of the loading that undetected small events release, and its standard error.

    If such events are few, sticks load less in their first half than their slope predicts; creep
    acts in the second half. If they are many, they lower the slope of every stick. Differences
    between neighbouring means in the middle half of a stick then show them: their median is that
    of the loading alone, because noise is symmetrical, and their mean includes the falls. The
    result is the most significant of these estimates over all widths of means; NaN with few sticks.
    """
    events, time, force = result.events, result.time, result.friction
    if after.size < STICK_SLIP["events"][1] or not result.loading_slope > 0:
        return np.nan, np.nan
    total = np.concatenate([[0.0], np.cumsum(force - force.mean())])
    begin, end, half = events.end[after - 1], events.onset[after], events.stick_duration[after] / 2
    first, stop = np.searchsorted(time, [begin + half / 2, end - half / 2])
    rise = _stick_lines(events, after, begin + half) - events.force_after[after - 1]
    load = result.loading_slope * half
    lack = 1 - rise.sum() / load.sum()
    off = rise - (1 - lack) * load
    best = float(lack), float(np.std(off, ddof=1) * np.sqrt(rise.size) / load.sum())
    rounding = recorder_step(force) / np.sqrt(12.0)
    for share in (8, 16, 32):
        width = int(np.median(stop - first)) // share
        if not width:
            break
        at = np.arange(0, time.size - 2 * width, max(width // 4, 1))
        owner = np.searchsorted(first, at, side="right") - 1
        at = at[(owner >= 0) & (at + 2 * width < stop[owner])]
        change = total[at + 2 * width] - 2 * total[at + width] + total[at]
        usual, spread = np.median(change), np.diff(np.quantile(change, [0.16, 0.84]))[0] / 2
        # The median of n normal values less their mean scatters by sqrt((pi/2 - 1)/n). Eight
        # overlapping differences count as one. Sums are whole steps of the recorder.
        error = np.hypot(spread * np.sqrt((np.pi / 2 - 1) * 8 / at.size), rounding)
        if usual > 0 and (usual - change.mean()) * best[1] > best[0] * error:
            best = float(1 - change.mean() / usual), float(error / usual)
    return best
