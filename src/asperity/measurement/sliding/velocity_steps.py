"""Velocity steps: change of steady friction, A - B, and the transient between.

`asperity.measurement.sliding.segments` finds the steps; this module reads each of them. The levels
of friction before and after a step are extrapolated to the step along a trend over slip. The
transient is left out, or fitted with two exponentials, as a spring-slider with one state variable
has them after a small step.

The data do not fix how much is left out, how long the windows are and whether the trend has one
slope or two. The step is therefore read with every choice. The result is the mean of these
readings, weighted by precision, and their spread is part of its uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from asperity.arrays import Float
from asperity.lock_in.quantisation import rounding_variance
from asperity.measurement.levels_and_trends import (
    Rate,
    TrendFit,
    bin_means,
    columns,
    effective_dof,
    fit_trend,
    moving_mean,
)

#: Lengths of windows, over the slip of the shorter side.
_WINDOWS = (1.0, 1.5, 2.25)
#: Multiples of the settling slip that are left out after the step.
_LEFT_OUT = (1.0, 1.4, 2.0)
#: Longest decay of a transient over the slip of the shorter side; share of its largest value below
#: which it has settled.
_LONGEST_DECAY, _SETTLED = 0.125, 0.03
#: Two slopes differ if noise alone has less than this probability of such a difference.
_CHANCE = 0.05
#: Number of decays from which the two of the exponentials are chosen.
_DECAYS = 14
#: Largest share of the sliding before a step that is left out for an earlier transient.
_MOST_CUT = 0.5
#: Bins that a level with its trend needs.
_FEWEST = 8


@dataclass(frozen=True)
class StepChoice:
    """One way to read a step.

    Attributes
    ----------
    change, uncertainty : float
        Change of steady friction at the step, and its standard uncertainty from noise.
    trend : {"none", "one slope", "two slopes"}
    left_out : float
        Slip (m; s without displacement) after the step that was not used; 0 if the transient was
        fitted.
    window : float
        Slip after the step that was used or left out.
    """

    change: float
    uncertainty: float
    trend: str
    left_out: float
    window: float


@dataclass(frozen=True)
class VelocityStep:
    """Change of steady friction where the velocity steps.

    Attributes
    ----------
    time : float
        Seconds.
    velocity_before, velocity_after : float
        m/s; NaN where no motion is recorded.
    change, uncertainty : float
        Steady friction after the step less that before, both extrapolated to the step, and the
        standard uncertainty of this change from noise and choice together.
    noise_uncertainty, choice_uncertainty : float
        Parts of `uncertainty`: correlated noise and rounding; the spread over trends and windows.
    dof : float
        Degrees of freedom of the uncertainty.
    interval_95 : float
        Half of the 95 % interval of `change`.
    rate_dependence, rate_uncertainty, rate_interval_95 : float
        A - B = change/ln(V2/V1): positive where friction rises with velocity (a - b of
        geophysics); NaN without velocities, where the direction turns or where both velocities are
        the same. The uncertainty includes that of measured velocities.
    peak : float
        Extreme of friction after the step, in the direction of the velocity's change, less the
        level before; NaN where `rate_dependence` is.
    trend : str
        "none", "one slope" or "two slopes", as the data require.
    slope_before, slope_after : float
        Trend over slip (1/m; 1/s without displacement).
    settling_slip : float
        Slip (m; s without displacement) after which the transient has decayed to 3 %.
    choices : tuple of StepChoice
    """

    time: float
    velocity_before: float
    velocity_after: float
    change: float
    uncertainty: float
    noise_uncertainty: float
    choice_uncertainty: float
    dof: float
    interval_95: float
    rate_dependence: float
    rate_uncertainty: float
    rate_interval_95: float
    peak: float
    trend: str
    slope_before: float
    slope_after: float
    settling_slip: float
    choices: tuple[StepChoice, ...] = field(repr=False)


class _Side(NamedTuple):
    """Bin means on one side of a step over slip from the step."""

    slip: Float
    friction: Float


def read_step(
    time: float,
    before: tuple[Float, Float, Rate],
    after: tuple[Float, Float, Rate],
    *,
    degree: int,
    first_settling: float = 0.0,
    resolution: float = 0.0,
) -> VelocityStep | None:
    """Read one step; None if too little of the sliding after it is free of the transient.

    Parameters
    ----------
    time : float
        Time of the step (s).
    before, after : (array (n,), array (n,), Rate)
        Times, friction and velocity (m/s, NaN if unknown) of the segments on its two sides.
    degree : int
        0 for levels without trend, 1 for a linear trend, 2 for a quadratic trend.
    first_settling : float
        Slip at the beginning of the segment before the step during which an earlier transient
        decays.
    resolution : float
        Step of the recorder in friction.
    """
    velocities = [side[2].value for side in (before, after)]
    known = all(np.isfinite(velocity) and velocity != 0 for velocity in velocities)
    speeds = [abs(velocity) if known else 1.0 for velocity in velocities]
    slips = [speed * (side[0] - time) for side, speed in zip((before, after), speeds, strict=True)]
    usable = slips[0] >= slips[0][0] + min(first_settling, _MOST_CUT * -float(slips[0][0]))
    earlier = _Side(slips[0][usable], before[1][usable])
    later = _Side(slips[1], after[1])
    lengths = -float(earlier.slip[0]), float(later.slip[-1])
    shorter = min(lengths)
    settling = 0.0
    readings: list[tuple[StepChoice, StepChoice | None, float, TrendFit, TrendFit]] = []
    windows = sorted(
        {(min(lengths[0], w * shorter), min(lengths[1], w * shorter)) for w in _WINDOWS}
    )
    for window in windows:
        first = _windowed(earlier, -window[0], 0.0)
        second = _windowed(later, 0.0, window[1])
        if first is None or second is None:
            continue
        decays, settled = _transient(first, second, shorter, window[1], degree)
        settling = settling or settled
        left = fit_trend(columns(first.slip, degree), first.friction)
        for share in (*_LEFT_OUT, 0.0):
            start = share * settled
            keep = second.slip >= start
            if keep.sum() < _FEWEST + degree:
                continue
            right = fit_trend(
                columns(second.slip[keep], degree, () if share else decays), second.friction[keep]
            )
            readings.append((*_combined(left, right, degree, start, window[1]), left, right))
    if not readings:
        return None
    steady = earlier.friction, later.friction[later.slip >= min(settling, shorter / 2)]
    rounding = sum(rounding_variance(resolution, float(np.std(side)))[0] for side in steady)
    return _result(time, before, after, readings, settling, known, degree, float(rounding) ** 0.5)


def _windowed(side: _Side, low: float, high: float) -> _Side | None:
    """Bin means of a part; None if the part has fewer than two samples, as next to a gap."""
    inside = (side.slip >= low) & (side.slip <= high)
    if inside.sum() < 2:
        return None
    return _Side(*bin_means(side.slip[inside], side.friction[inside]))


def _transient(
    before: _Side, after: _Side, shorter: float, window: float, degree: int
) -> tuple[tuple[float, float], float]:
    """Decay slips of the best two exponentials, continuous at the step, and the slip to settle."""
    slip = np.concatenate([before.slip, after.slip])
    friction = np.concatenate([before.friction, after.friction])
    stepped = np.concatenate([np.zeros(before.slip.size), np.ones(after.slip.size)])
    finest = float(np.median(np.diff(after.slip)))
    longest = _LONGEST_DECAY * shorter
    decays = np.geomspace(min(max(shorter / 300, finest), longest / 4), longest, _DECAYS)
    waves = [stepped * np.exp(-np.clip(slip, 0, None) / decay) for decay in decays]
    powers = [slip**power for power in range(degree + 1)]
    base = np.linalg.qr(np.stack([p / max(np.abs(p).max(), 1e-300) for p in powers], axis=1))[0]

    def free(values: Float) -> Float:
        return np.asarray(values - base @ (base.T @ values))

    free_friction = free(friction)
    free_waves = np.stack([free(stepped - wave) for wave in waves])
    gram, moment = free_waves @ free_waves.T, free_waves @ free_friction
    gain, chosen, amplitudes = -1.0, (0, 1), np.zeros(2)
    for fast, slow in combinations(range(decays.size), 2):
        # Columns wave[slow] and wave[slow] - wave[fast], which vanish at the step.
        ss, sf, ff = gram[slow, slow], gram[slow, fast], gram[fast, fast]
        matrix = np.array([[ss, ss - sf], [ss - sf, ss - 2 * sf + ff]])
        aim = np.array([moment[slow], moment[slow] - moment[fast]])
        beta = np.linalg.pinv(matrix, rcond=1e-10, hermitian=True) @ aim
        if float(beta @ aim) > gain:
            gain, chosen, amplitudes = float(beta @ aim), (fast, slow), beta
    quickest, slowest = (float(decays[k]) for k in chosen)
    a, b = amplitudes
    shape = np.abs(b * np.exp(-after.slip / quickest) - (a + b) * np.exp(-after.slip / slowest))
    left = np.flatnonzero(shape > _SETTLED * max(float(shape.max()), 1e-300))
    settled = float(after.slip[left[-1]]) if left.size else 0.0
    return (quickest, slowest), min(max(settled, float(after.slip[0])), window / 3)


def _combined(
    left: TrendFit, right: TrendFit, degree: int, start: float, window: float
) -> tuple[StepChoice, StepChoice | None, float]:
    """The step with two slopes and with one, and how far slopes differ (squared, over noise)."""
    size = degree + 1
    covariance = (
        left.inverse[:size, :size] * left.variance + right.inverse[:size, :size] * right.variance
    )
    difference = right.beta[:size] - left.beta[:size]
    trend = "two slopes" if degree else "none"
    two = StepChoice(float(difference[0]), float(np.sqrt(covariance[0, 0])), trend, start, window)
    if not degree:
        return two, None, 0.0
    # One trend on both sides: the differences of the coefficients of slip are zero.
    gain = np.linalg.pinv(covariance[1:, 1:], hermitian=True)
    change = float(difference[0] - covariance[0, 1:] @ gain @ difference[1:])
    variance = float(covariance[0, 0] - covariance[0, 1:] @ gain @ covariance[1:, 0])
    one = StepChoice(change, float(np.sqrt(max(variance, 0.0))), "one slope", start, window)
    return two, one, float(difference[1:] @ gain @ difference[1:]) / degree


def _result(
    time: float,
    before: tuple[Float, Float, Rate],
    after: tuple[Float, Float, Rate],
    readings: list[tuple[StepChoice, StepChoice | None, float, TrendFit, TrendFit]],
    settling: float,
    known: bool,
    degree: int,
    rounding: float,
) -> VelocityStep:
    dof = float(min(min(left.dof, right.dof) for *_, left, right in readings))
    # Student's t of the difference of the slopes, for the choice with the clearest difference.
    apart = max(ratio for _, _, ratio, _, _ in readings)
    one_slope = degree > 0 and apart < stdtrit(dof, 1 - _CHANCE / 2) ** 2
    choices = [two for two, *_ in readings]
    if one_slope:
        choices += [one for _, one, *_ in readings if one is not None]
    change = np.array([c.change for c in choices])
    noise = np.array([c.uncertainty for c in choices])
    # A window that looks quiet by chance gets no more weight than the others of its trend.
    kinds = np.array([c.trend for c in choices])
    trusted = noise.copy()
    for kind in set(kinds.tolist()):
        same = kinds == kind
        trusted[same] = np.maximum(noise[same], np.median(noise[same]))
    weight = 1 / np.maximum(trusted, 1e-150) ** 2
    weight /= weight.sum()
    mean = float(weight @ change)
    from_noise = float(np.hypot(weight @ trusted, rounding))
    spread = float(np.sqrt(weight @ (change - mean) ** 2))
    uncertainty = float(np.hypot(from_noise, spread))
    half = float(stdtrit(dof, 0.975)) * uncertainty
    velocities = before[2].value, after[2].value
    changed = known and velocities[0] * velocities[1] > 0 and velocities[0] != velocities[1]
    lever = float(np.log(velocities[1] / velocities[0])) if changed else np.nan
    middle = readings[len(readings) // 2]
    slopes = [float(fit.beta[1]) if degree else 0.0 for fit in middle[3:]]
    level = float(np.mean([left.beta[0] for *_, left, _ in readings]))
    rate = mean / lever
    # The logarithm of the velocities' ratio is as uncertain as the velocities.
    parts = [(uncertainty / abs(lever), dof)]
    parts += [
        (float(np.divide(abs(rate) * v.uncertainty, abs(v.value * lever))), v.dof)
        for v in (before[2], after[2])
    ]
    rate_uncertainty = float(np.sqrt(sum(part**2 for part, _ in parts)))
    return VelocityStep(
        time=time,
        velocity_before=velocities[0],
        velocity_after=velocities[1],
        change=mean,
        uncertainty=uncertainty,
        noise_uncertainty=from_noise,
        choice_uncertainty=spread,
        dof=dof,
        interval_95=half,
        rate_dependence=rate,
        rate_uncertainty=rate_uncertainty,
        rate_interval_95=float(stdtrit(effective_dof(parts), 0.975)) * rate_uncertainty,
        peak=_peak(after[0], after[1], time, lever, settling, abs(velocities[1])) - level,
        trend="one slope" if one_slope else ("two slopes" if degree else "none"),
        slope_before=slopes[0],
        slope_after=slopes[1],
        settling_slip=settling,
        choices=tuple(choices),
    )


def _peak(
    times: Float, friction: Float, step: float, lever: float, settling: float, speed: float
) -> float:
    """Extreme of friction, smoothed over five samples, until the transient has settled."""
    if not np.isfinite(lever):
        return np.nan
    near = times <= step + 1.5 * settling / speed
    near[: max(8, int(0.02 * times.size))] = True
    values = friction[near]
    smooth = moving_mean(values, 5)
    return float(smooth.max() if lever > 0 else smooth.min())
