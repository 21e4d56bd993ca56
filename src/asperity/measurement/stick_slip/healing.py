"""Healing from stick-slip: how the friction at onset grows with the logarithm of the stick time.

The peak of the force after a stick of duration t is mu_1 + B ln t + m, with friction m that varies
along the track. Within a recording the stick ends where the force reaches the peak, so that a
larger m makes a longer stick: peaks rise with stick times without any healing, and a straight line
through them tells nothing. The drop before a stick makes it longer as well and knows nothing of the
m at its end: it is the instrument of an estimate of two stages, B = cov(peak, drop before)/cov(ln
t, drop before). The slow variation along the track is taken off as panel studies do, by the mean of
the next peaks (Arellano and Bover, J. Econometrics 68, 29, 1995): a mean that holds earlier ones
would know of the drop.

Friction that correlates from one event to the next looks like healing at one velocity: the peaks of
both follow each other alike. `of_campaign` compares recordings, whose stick times the velocity
sets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from asperity.measurement.stick_slip.events import SlipEvents

Array = NDArray[np.float64]

#: Sticks whose mean is the slow variation along the track.
_NEAR = 10
#: Fewest sticks, and smallest F of the first stage of an instrument that is not weak.
_FEWEST, _WEAK = 40, 10.0
#: Recordings that tell a slope, and passes in which their scatter about it settles.
_FEWEST_RECORDINGS, _PASSES = 3, 30
#: Sticks over which residuals may be correlated.
_LAGS = 12
#: What no recording at one velocity can rule out.
ASSUMPTION = "if friction along the track does not correlate from one event to the next"


@dataclass(frozen=True)
class StickSlipHealing:
    """Growth of friction with the logarithm of the stick time.

    Attributes
    ----------
    per_efold, uncertainty : float
        B of the peak of F/W, and its standard uncertainty; NaN with too few sticks.
    interval_95 : (float, float)
        Of that of the peak within a recording, and of the drop among recordings.
    drop_per_efold, drop_uncertainty : float
        The same of the drop: 2 B where a slip overshoots, B where it does not.
    efolds : float
        Standard deviation of ln t.
    sticks : int
        Sticks, or recordings, that were compared.
    reason : str
        Why it cannot be told; empty where it can.
    """

    per_efold: float
    uncertainty: float
    interval_95: tuple[float, float]
    drop_per_efold: float
    drop_uncertainty: float
    efolds: float
    sticks: int
    reason: str


def healing(events: SlipEvents, first: int = 0, stop: int | None = None) -> StickSlipHealing:
    """Healing from the sticks of a train of events.

    Parameters
    ----------
    events : SlipEvents
    first, stop : int
        Events of the train, as a slice.
    """
    stop = len(events) if stop is None else stop
    here = slice(first + 1, stop)
    sticks = max(stop - first - 1, 0)
    if sticks < _FEWEST:
        return _untold(sticks, f"{sticks} sticks are too few; {_FEWEST} can tell")
    log_time = np.log(np.maximum(events.stick_duration[here], 1e-300))
    before = events.drop[first : stop - 1]
    x, peak, drop = (
        _less_next(v) for v in (log_time, events.force_before[here], events.drop[here])
    )
    z = _less_last(before)
    freedom = sticks - _NEAR - 2
    correlation = _correlation(x, z)
    strength = correlation**2 * freedom / max(1 - correlation**2, 1e-12)
    slope, doubt = _two_stages(x, z, peak)
    drop_slope, drop_doubt = _two_stages(x, z, drop)
    half = float(student.ppf(0.975, freedom)) * doubt
    interval = slope - half, slope + half
    reason = ""
    if strength < _WEAK or correlation <= 0:
        reason = (
            f"stick times hardly follow the drops before them (F = {strength:.2g}): their range is "
            "too small, or friction along the track makes them"
        )
    elif interval[0] <= 0 <= interval[1]:
        reason = f"the 95 % interval, {interval[0]:.2g} to {interval[1]:.2g}, holds zero"
    return StickSlipHealing(
        slope, doubt, interval, drop_slope, drop_doubt, float(np.std(log_time)), sticks, reason
    )


def of_campaign(stick_durations: Array, drops: Array, uncertainties: Array) -> StickSlipHealing:
    """Healing from the mean drops of recordings at several velocities or stiffnesses.

    Parameters
    ----------
    stick_durations : array, (n,)
        Means (s).
    drops, uncertainties : array, (n,)
        Mean drops of F/W and their standard uncertainties.

    Returns
    -------
    StickSlipHealing
        The growth of the drop; that of the peak, which varies from track to track, is NaN.

    Notes
    -----
    Recordings scatter by more than their uncertainties say, as tracks differ: the scatter about
    the line is added to each (Mandel and Paule, Anal. Chem. 42, 1194, 1970).
    """
    x = np.log(np.asarray(stick_durations, float))
    y, doubt = np.asarray(drops, float), np.asarray(uncertainties, float)
    n = x.size
    if n < _FEWEST_RECORDINGS:
        return _untold(n, f"{n} recordings are too few; {_FEWEST_RECORDINGS} can tell")
    extra = 0.0
    for _ in range(_PASSES):
        weight = 1 / (doubt**2 + extra)
        centre = float(weight @ x) / float(weight.sum())
        power = float(weight @ (x - centre) ** 2)
        if power == 0:
            return _untold(n, "all recordings have one and the same stick time")
        slope = float(weight @ ((x - centre) * y)) / power
        level = float(weight @ (y - slope * (x - centre))) / float(weight.sum())
        squares = (y - level - slope * (x - centre)) ** 2
        excess = float(weight @ squares) - (n - 2)
        extra = max(extra + excess / float((weight**2) @ squares), 0.0)
    spread = 1 / np.sqrt(power)
    half = float(student.ppf(0.975, n - 2)) * spread
    interval = slope - half, slope + half
    reason = ""
    if np.ptp(x) < 1:
        reason = f"stick times range over {np.ptp(x):.2g} e-folds; one or more can tell"
    elif interval[0] <= 0 <= interval[1]:
        reason = f"the 95 % interval, {interval[0]:.2g} to {interval[1]:.2g}, holds zero"
    none = float("nan")
    return StickSlipHealing(none, none, interval, slope, float(spread), float(np.std(x)), n, reason)


def _untold(sticks: int, reason: str) -> StickSlipHealing:
    none = float("nan")
    return StickSlipHealing(none, none, (none, none), none, none, none, sticks, reason)


def _less_next(values: Array) -> Array:
    """Values less the mean of the next ones, which the past does not know.

    Means on both sides would make each value depend on the drop before it. Values without as many
    next ones are left out.
    """
    total = np.concatenate([[0.0], np.cumsum(values)])
    at = np.arange(values.size - _NEAR)
    return np.asarray(values[at] - (total[at + 1 + _NEAR] - total[at + 1]) / _NEAR)


def _less_last(values: Array) -> Array:
    """Values less the mean over themselves and those before, as long as `_less_next`."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    at = np.arange(values.size - _NEAR)
    first = np.maximum(at - _NEAR, 0)
    centred = values[at] - (total[at + 1] - total[first]) / (at + 1 - first)
    return np.asarray(centred - centred.mean())


def _two_stages(x: Array, z: Array, y: Array) -> tuple[float, float]:
    """Slope of y over x by the instrument z, and its standard uncertainty.

    The uncertainty holds for residuals that scatter unevenly and correlate over some events
    (Newey and West, Econometrica 55, 703, 1987).
    """
    power = float(z @ x)
    if power == 0:
        return np.nan, np.nan
    slope = float(z @ y) / power
    residual = y - slope * x
    moment = z * residual
    variance = float(moment @ moment)
    for lag in range(1, _LAGS + 1):
        weight = 1 - lag / (_LAGS + 1)
        variance += 2 * weight * float(moment[lag:] @ moment[:-lag])
    spread = max(variance, 0.5 * float(moment @ moment))
    return slope, float(np.sqrt(spread)) / abs(power)


def _correlation(a: Array, b: Array) -> float:
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size else 0.0
