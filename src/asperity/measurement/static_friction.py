"""Friction without modulation, F(0)/W0, from the pauses next to a modulated stretch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from asperity.arrays import Float
from asperity.lock_in.quantisation import rounding_variance
from asperity.lock_in.reading import LockInReading
from asperity.measurement.levels_and_trends import (
    MeanLevel,
    Rate,
    bin_means,
    columns,
    effective_dof,
    fit_trend,
    mean_level,
)
from asperity.measurement.samples import Samples
from asperity.measurement.verdicts.checks import drift_rate
from asperity.measurement.verdicts.verdict import LOCK_IN
from asperity.measurement.window import LoadInterval, settled, settling_from, under_the_same_load

#: A drift counts above this multiple of its standard uncertainty.
_DRIFTS = 3.0
#: Lowest frequency of the lines that are fitted in a pause, in periods of the pause.
_PAUSE_PERIODS = 64
#: Fewest samples of a pause from which a rate is estimated.
_FEWEST = 64


class Pause(NamedTuple):
    """Levels without modulation next to the stretch that is read."""

    force: MeanLevel
    load: MeanLevel
    friction: MeanLevel
    #: Standard error of the friction by the steps of the recorder, the same in all pauses.
    rounding: float
    #: Rate at which the force changes; None of a short pause.
    rate: Rate | None


def pauses_around(
    samples: Samples,
    parts: list[LoadInterval],
    chosen: LoadInterval,
    mean_load: float,
    steps: tuple[float, float],
) -> tuple[Pause | None, Pause | None]:
    """Steady pauses before and after the stretch that is read; None where there is none.

    `steps` are those of the recorder, of load and of force.
    """
    at, most = parts.index(chosen), chosen.stop - chosen.first
    sides: list[Pause | None] = [None, None]
    for side, step in enumerate((-1, 1)):
        pause = parts[at + step] if 0 <= at + step < len(parts) else None
        if pause is None or pause.modulated or pause.stop - pause.first < 16:
            continue
        first, stop = pause.first, pause.stop
        # Parts of a pause that are far from the stretch are left out.
        if step > 0:
            stop = min(stop, first + 2 * most)
        else:
            first = max(first, stop - most)
        # After a modulation the force recovers.
        recovers = step > 0 or any(part.modulated for part in parts[: at - 1])
        if recovers:
            time = samples.time[first:stop]
            first += settled(time, samples.force[first:stop], _no_modulation(time), 1)
        first, stop = under_the_same_load(samples.load, first, stop, mean_load, before=step < 0)
        if stop - first >= 16:
            cut = slice(first, stop)
            values = samples.time[cut], samples.force[cut], samples.load[cut]
            sides[side] = _pause(*values, steps, recovers=recovers)
    return _steady_pauses(*sides)


def _steady_pauses(before: Pause | None, after: Pause | None) -> tuple[Pause | None, Pause | None]:
    """The two pauses; the second is left out if it still recovers from the modulation."""
    if after and before and before.rate and after.rate:
        # The force drifts after the modulation more than before it.
        change = after.rate.beyond(before.rate) * (after.force.end - after.force.start)
        if change > LOCK_IN["transient"][0] * abs(after.force.value):
            return before, None
    return before, after


def _no_modulation(time: Float) -> float:
    """A frequency (Hz) far above the slow motion in a pause."""
    return min(_PAUSE_PERIODS, time.size / 8) / float(time[-1] - time[0])


def _pause(
    time: Float, force: Float, load: Float, steps: tuple[float, float], *, recovers: bool
) -> Pause | None:
    """Levels of a pause; of a force that recovers, the level to which it settles.

    None if that level is not determined.
    """
    rate = None
    if time.size > _FEWEST:
        at, means = bin_means(time, force)
        rate = fit_trend(columns(at - at[0], 1), means).rate(1)
    shift = variance = 0.0
    settling = settling_from(time, force, _no_modulation(time), 1) if recovers else None
    if settling is not None and settling.possible:
        shift, variance = float(settling.shift[0]), float(settling.covariance[0, 0])
        if settling.present:
            force = force - settling.at(time - time[0])
    level, of_load = mean_level(time, force), mean_level(time, load)
    if settling is not None and settling.possible and settling.present and not settling.determined:
        limit = LOCK_IN["transient"][0]
        if abs(settling.amplitude) > limit * abs(level.value):
            return None
    of_steps = [
        float(rounding_variance(step, float(np.std(values)))[0])
        for step, values in zip(steps, (load, force), strict=True)
    ]
    doubts = level.uncertainty, np.sqrt(variance), np.sqrt(of_steps[1])
    level = level._replace(value=level.value + shift, uncertainty=float(np.linalg.norm(doubts)))
    # The ratio has the noise of both channels, less what they share.
    ratio = level.value / of_load.value
    noise = mean_level(time, force - ratio * load)
    doubt = float(np.hypot(noise.uncertainty, np.sqrt(variance))) / abs(of_load.value)
    rounding = float(np.sqrt(of_steps[1] + ratio**2 * of_steps[0])) / abs(of_load.value)
    friction = noise._replace(value=ratio, uncertainty=doubt)
    return Pause(level, of_load, friction, rounding, rate)


def static_friction(
    reading: LockInReading, sides: list[Pause], pauses: list[Rate]
) -> tuple[float, float, float]:
    """F(0)/W0, its standard uncertainty, drift between the sides included, and its dof."""
    if not sides:
        return np.nan, np.nan, 1.0
    ratios = [side.friction.value for side in sides]
    doubts = [side.friction.uncertainty / len(sides) for side in sides]
    # A drift is somewhere between its ends: an even distribution about the mean.
    drifted = abs(ratios[-1] - ratios[0]) / np.sqrt(12)
    if len(sides) == 1:
        # F(0) at the other end was not recorded, but the force drifts in the window or the pause.
        level, load = sides[0].force, sides[0].load
        rates = [*pauses, drift_rate(reading)] if reading.drift.shape[1] else pauses
        rate = min(rates, key=lambda each: each.uncertainty, default=Rate(0.0, 0.0, 1.0))
        if abs(rate.value) > _DRIFTS * rate.uncertainty:
            away = (reading.start + reading.end - level.start - level.end) / 2
            drifted = abs(rate.value * away / load.value) / np.sqrt(3)
    parts = [(doubt, side.friction.dof) for doubt, side in zip(doubts, sides, strict=True)]
    dof = effective_dof([*parts, (float(drifted), 30.0)])
    whole = np.linalg.norm([*doubts, drifted, max(side.rounding for side in sides)])
    return float(np.mean(ratios)), float(whole), dof
