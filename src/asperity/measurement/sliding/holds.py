"""Slide-hold-slide: relaxation during a hold, peak on sliding again, healing and its rate.

Healing is the peak of friction after a hold less the sliding level before it (Dieterich, J.
Geophys. Res. 77, 3690, 1972; Marone, Nature 391, 69, 1998); the level is extrapolated to the hold
through the trend of the sliding before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.special import stdtrit

from asperity.arrays import Float
from asperity.lock_in.quantisation import rounding_variance
from asperity.measurement.levels_and_trends import (
    bin_means,
    columns,
    effective_dof,
    fit_trend,
    neighbour_scatter,
    slope_of,
    weighted_line,
)
from asperity.measurement.sliding.segments import Cut

#: Fewest samples at the end of a hold whose line gives the relaxation.
_FEWEST_AT_END = 6
#: Samples of the shortest peak that noise may hide.
_HIDDEN = 5
#: Friction between these shares of the rise on sliding again gives the stiffness.
_RISE = (0.1, 0.5)
#: The top of a peak: where smoothed friction is within one of these shares of the peak's height.
_TOPS = (0.15, 0.3, 0.5)
#: Degree of the polynomial through a top. A parabola through a top of 15 % is 0.2 % of the peak's
#: height too low, one of this degree 0.01 %.
_DEGREE = 4
#: Fewest samples of a top, and the most that are fitted one by one and not in bins.
_FEWEST, _MOST = 16, 400
#: Points among which the maximum of the polynomial is taken.
_POINTS = 201


@dataclass(frozen=True)
class HoldReading:
    """One hold between two slidings.

    Attributes
    ----------
    start, end : float
        Begin and end of the hold (s).
    hold_time : float
        Its length (s).
    velocity : float
        Velocity of the sliding after the hold (m/s); NaN where no motion is recorded.
    level, level_uncertainty : float
        Sliding friction before the hold, extrapolated to its beginning.
    relaxation, relaxation_uncertainty : float
        Level less friction at the end of the hold; positive where friction falls.
    peak, peak_time : float
        Highest friction after the hold, and when (s).
    healing, healing_uncertainty : float
        Peak less level.
    dof : float
        Degrees of freedom of the uncertainty of `healing`.
    interval_95 : float
        Half of the 95 % interval of `healing`.
    reload_slope, reload_uncertainty : float
        Slope of friction over load-point displacement on sliding again (1/m), which is the
        machine's stiffness over the normal load while the contact does not slip; its uncertainty
        has an estimate of that slip. NaN without displacement or with fewer than four samples on
        the rise.
    """

    start: float
    end: float
    hold_time: float
    velocity: float
    level: float
    level_uncertainty: float
    relaxation: float
    relaxation_uncertainty: float
    peak: float
    peak_time: float
    healing: float
    healing_uncertainty: float
    dof: float
    interval_95: float
    reload_slope: float
    reload_uncertainty: float


@dataclass(frozen=True)
class HealingRate:
    """Healing over the decimal logarithm of the hold time.

    Attributes
    ----------
    per_decade, uncertainty : float
        Slope and its standard uncertainty, the scatter of the holds about the line included.
    dof : float
    interval_95 : float
        Half of the 95 % interval of `per_decade`.
    at_one_second : float
        Healing of the line at a hold of 1 s.
    holds : int
    """

    per_decade: float
    uncertainty: float
    dof: float
    interval_95: float
    at_one_second: float
    holds: int


def read_hold(
    time: Float,
    friction: Float,
    displacement: Float | None,
    samples: tuple[int, int],
    ends: tuple[Cut, Cut],
    velocity: float,
    *,
    degree: int,
    resolution: float,
) -> HoldReading:
    """Read one hold.

    Parameters
    ----------
    time, friction, displacement : array, (n,)
        Times, friction and displacement of the recording; displacement None if it is not recorded.
    samples : (int, int)
        First sample of the steady sliding before, and the sample after the sliding that follows.
    ends : (Cut, Cut)
        Begin and end of the hold.
    velocity : float
        Velocity of the sliding after the hold (m/s).
    degree : int
        Degree of the trend before the hold: 0 or 1.
    resolution : float
        Step of the recorder in friction.
    """

    def rounding(values: Float) -> float:
        return float(rounding_variance(resolution, float(np.std(values)))[0])

    (begin, stop), (start, end) = samples, ends
    hold, again = start.sample, end.sample
    slid, mu = bin_means(time[begin:hold] - start.time, friction[begin:hold])
    fit = fit_trend(columns(slid, min(degree, 1)), mu)
    level = float(fit.beta[0])
    doubt = float(np.sqrt(fit.variance * fit.inverse[0, 0] + rounding(friction[begin:hold])))
    scatter = neighbour_scatter(friction[begin:hold])
    # Noise slower than a bin is the same in all samples of the short ends of a hold and of a peak.
    left = mu - columns(slid, min(degree, 1)) @ fit.beta
    slow_variance = max(float(np.var(left)) - scatter**2 * mu.size / (hold - begin), 0.0)
    # Samples that may belong to the reloading already are left out.
    rest = slice(hold, max(hold + 1, int(np.searchsorted(time, end.time - end.doubt))))
    low, low_doubt, falls = _end_of_hold(time[rest] - end.time, friction[rest], scatter)
    low_doubt = np.sqrt(low_doubt**2 + slow_variance + rounding(friction[rest][-_FEWEST_AT_END:]))
    peak, peak_doubt, dof, at = _peak(time, friction, again, stop, level, scatter)
    peak_doubt = float(np.sqrt(peak_doubt**2 + slow_variance + rounding(np.array([peak]))))
    dof = effective_dof([(doubt, fit.dof), (peak_doubt, dof)])
    healing_doubt = float(np.hypot(doubt, peak_doubt))
    creep = -falls / abs(velocity) if velocity else np.nan
    slope, slope_doubt = _reload(friction, displacement, again, at, low, peak, creep)
    return HoldReading(
        start=start.time,
        end=end.time,
        hold_time=end.time - start.time,
        velocity=velocity,
        level=level,
        level_uncertainty=doubt,
        relaxation=level - low,
        relaxation_uncertainty=float(np.hypot(doubt, low_doubt)),
        peak=peak,
        peak_time=float(time[at]),
        healing=peak - level,
        healing_uncertainty=healing_doubt,
        dof=dof,
        interval_95=float(stdtrit(dof, 0.975)) * healing_doubt,
        reload_slope=slope,
        reload_uncertainty=slope_doubt,
    )


def _end_of_hold(since: Float, friction: Float, scatter: float) -> tuple[float, float, float]:
    """Friction at the end of a hold, its uncertainty by noise, and its rate (1/s).

    It falls with the logarithm of time: a line through the last part of the hold is extrapolated to
    its end. Its last sample may hold the beginning of the loading.
    """
    if friction.size > _FEWEST_AT_END:
        first = max(0, friction.size - 1 - max(_FEWEST_AT_END, friction.size // 20))
        since, friction = since[first:-1], friction[first:-1]
    away = since - since.mean()
    power = float(away @ away)
    slope, lever = slope_of(since, friction), (since.mean() ** 2 / power if power else 0.0)
    end = float(friction.mean() - slope * since.mean())
    return end, scatter * float(np.sqrt(1 / friction.size + lever)), slope


def healing_rate(holds: list[HoldReading]) -> HealingRate | None:
    """Slope of healing per decade of hold time; None with fewer than two different hold times.

    Parameters
    ----------
    holds : list of HoldReading
        Each counts by its uncertainty, and by the scatter about the line where that is larger.
    """
    decades = np.log10([h.hold_time for h in holds]) if holds else np.empty(0)
    if len(holds) < 2 or np.ptp(decades) < 0.1:
        return None
    healing = np.array([h.healing for h in holds])
    doubt = np.array([h.healing_uncertainty for h in holds])
    doubt = np.maximum(doubt, max(1e-3 * float(np.median(doubt)), 1e-12))
    line = weighted_line(decades, healing, doubt)
    uncertainty = float(np.sqrt(line.covariance[1, 1] * max(line.excess, 1.0)))
    # Scatter that exceeds the uncertainties is known from the few holds only.
    dof = float(len(holds) - 2) if line.excess > 1 else min(h.dof for h in holds)
    return HealingRate(
        per_decade=float(line.beta[1]),
        uncertainty=uncertainty,
        dof=dof,
        interval_95=float(stdtrit(dof, 0.975)) * uncertainty,
        at_one_second=float(line.beta[0]),
        holds=len(holds),
    )


def _peak(
    time: Float, friction: Float, again: int, stop: int, level: float, scatter: float
) -> tuple[float, float, float, int]:
    """Top of the peak after a hold, its uncertainty with degrees of freedom, and its sample.

    The largest of many noisy samples is too high: polynomials are fitted to the samples about the
    top of smoothed friction instead. Samples of a narrow top are chosen by their noise, and a wide
    top is no polynomial: tops of several widths are read, and their spread is a part of the
    uncertainty.
    """
    values = friction[again:stop]
    # The peak is over within half of the sliding.
    values = values[: max(8, values.size // 2)]
    rise = float(values.max()) - float(values[0])
    wide = 1
    seen = scatter < 0.02 * rise
    while not seen and wide < values.size // 8:
        seen = float(_smoothed(values, wide).max()) - level > 10 * scatter / np.sqrt(wide)
        wide = wide if seen else 2 * wide + 1
    smooth = _smoothed(values, wide)
    top = int(np.argmax(smooth))
    height = max(
        float(smooth[top]) - max(level, float(values[0])), 3 * scatter / np.sqrt(wide), 0.2 * rise
    )
    tops = []
    for share in _TOPS:
        low = smooth <= float(smooth[top]) - max(share * height, 2 * scatter / np.sqrt(wide))
        left = int(np.flatnonzero(low[:top]).max(initial=-1)) + 1
        right = top + int(np.argmax(np.append(low[top:], True)))
        if right - left >= _FEWEST:
            tops.append(_top(time[again + left : again + right], values[left:right], scatter))
    if not tops:
        near = values[max(top - wide // 2, 0) : top + wide // 2 + 1]
        return float(near.mean()), float(scatter / np.sqrt(near.size)), np.inf, again + top
    heights, doubts, dofs, places = np.array(tops).T
    weight = 1 / np.maximum(doubts, 1e-150) ** 2
    weight /= weight.sum()
    height = float(weight @ heights)
    doubt = float(np.hypot(weight @ doubts, np.sqrt(weight @ (heights - height) ** 2)))
    if not seen:
        # A short peak may be hidden by the noise of as few samples.
        doubt = float(np.hypot(doubt, (float(_smoothed(values, _HIDDEN).max()) - height) / 2))
    at = int(np.searchsorted(time, weight @ places))
    return height, doubt, float(dofs.min()), min(max(at, again), again + values.size - 1)


def _top(time: Float, friction: Float, scatter: float) -> tuple[float, float, float, float]:
    """Maximum of the polynomial through a top, its uncertainty with its dof, and its time."""
    middle, half = float(time[-1] + time[0]) / 2, float(time[-1] - time[0]) / 2
    at, means = (time - middle) / half, friction
    if at.size > _MOST:
        at, means = bin_means(at, means)
    fit = fit_trend(columns(at, _DEGREE), means)
    points = np.linspace(at[0], at[-1], _POINTS)
    curves = columns(points, _DEGREE)
    k = int(np.argmax(curves @ fit.beta))
    # The few slow waves of a residual may be weak by chance; many samples show the white noise.
    noise = max(fit.variance, scatter**2 * at.size / friction.size)
    variance = noise * float(curves[k] @ fit.inverse @ curves[k])
    return (
        float(curves[k] @ fit.beta),
        float(np.sqrt(variance)),
        float(fit.dof),
        middle + half * float(points[k]),
    )


def _smoothed(values: Float, wide: int) -> Float:
    return np.asarray(uniform_filter1d(values, wide, mode="nearest"))


def _reload(
    friction: Float,
    displacement: Float | None,
    again: int,
    top: int,
    low: float,
    peak: float,
    creep: float,
) -> tuple[float, float]:
    """Slope of friction over displacement on the rise, and its uncertainty.

    The contact slips a little on the rise, so that the slope is below the stiffness. When the drive
    starts, the rate of friction jumps by the stiffness times the velocity of the drive: the slope
    at the beginning of the rise plus `creep`, the fall of friction during the hold over that
    velocity (1/m). The difference is a part of the uncertainty.
    """
    if displacement is None or not np.isfinite(low) or top - again < 4:
        return np.nan, np.nan
    mu = friction[again : top + 1]
    above, below = low + _RISE[0] * (peak - low), low + _RISE[1] * (peak - low)
    begin = int(np.argmax(mu > above))
    end = int(np.argmax(mu > below))
    if end - begin < 4:
        return np.nan, np.nan
    x = np.abs(displacement[again : again + end] - displacement[again])
    if not np.ptp(x[begin:]) > 0:
        return np.nan, np.nan
    line, rise = columns(x[begin:], 1), mu[begin:end]
    fit = fit_trend(line, rise)
    left = rise - line @ fit.beta
    # The few slow waves of a residual may be weak by chance.
    noise = max(fit.variance, float(left @ left) / (rise.size - 2))
    slope, doubt = float(fit.beta[1]), float(np.sqrt(noise * fit.inverse[1, 1]))
    # A coarse displacement may have two values, and no bend.
    if not np.isfinite(creep) or np.unique(x).size < 3:
        return slope, doubt
    start = float(np.polynomial.Polynomial.fit(x, mu[:end], 2).deriv()(0.0))
    return slope, float(np.hypot(doubt, start + creep - slope))
