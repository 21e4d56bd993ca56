"""Healing from stick-slip: how the drop grows with the logarithm of the stick time.

Recordings at several velocities or stiffnesses are compared, as these set the stick times. A single
recording does not show healing: a stick ends where the force reaches the peak, so that a higher
friction on the track makes a longer stick, and peaks rise with stick times without any healing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from asperity.arrays import Float
from asperity.measurement.levels_and_trends import weighted_line

#: Fewest recordings for a slope, and most iterations for their scatter about it.
_FEWEST, _PASSES = 3, 30
#: Growth of the drop per e-fold of stick time over B - A: limit cycles of the Rice-Ruina law with
#: inertia at stiffnesses below 0.5 of the critical one, M V^2 < A D0 W0 and B - A above 0.3 A have
#: 1.27 to 2.54. It is less where the drive is faster or the spring stiffer, and more where B is
#: nearer to A.
FACTOR = 1.2, 2.6


@dataclass(frozen=True)
class StickSlipHealing:
    """Growth of the drop with the logarithm of the stick time.

    Attributes
    ----------
    drop_per_efold, drop_uncertainty : float
        Of F/W for a factor e of stick time, and its standard uncertainty; NaN with too few
        recordings. With a strength that depends on the stick time alone 2 B where a slip overshoots
        and B where it does not; of a rate-and-state law, as the velocity changes the stick time,
        `FACTOR` times B - A for stiffnesses up to half of the critical one, and less above.
    interval_95 : (float, float)
    recordings : int
    reason : str
        Reason without a result; empty with a result.
    """

    drop_per_efold: float
    drop_uncertainty: float
    interval_95: tuple[float, float]
    recordings: int
    reason: str

    @property
    def b_minus_a(self) -> tuple[float, float]:
        """95 % interval of B - A of a rate-and-state law; NaN where `reason` says why.

        The growth is `FACTOR` times B - A: the interval holds every factor.
        """
        if self.reason:
            return float("nan"), float("nan")
        low, high = (bound / np.array(FACTOR) for bound in self.interval_95)
        return float(low.min()), float(high.max())


def of_campaign(stick_durations: Float, drops: Float, uncertainties: Float) -> StickSlipHealing:
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

    Notes
    -----
    Recordings scatter by more than their uncertainties say, as tracks differ: the scatter about
    the line is added to each (Mandel and Paule, Anal. Chem. 42, 1194, 1970).
    """
    x = np.log(np.asarray(stick_durations, float))
    y, uncertainty = np.asarray(drops, float), np.asarray(uncertainties, float)
    n = x.size
    reason = ""
    if n < _FEWEST:
        reason = f"{n} recordings are too few; at least {_FEWEST} are needed"
    elif np.ptp(x) == 0:
        reason = "all recordings have one and the same stick time"
    if reason:
        return StickSlipHealing(np.nan, np.nan, (np.nan, np.nan), n, reason)
    extra = 0.0
    for _ in range(_PASSES):
        variance = uncertainty**2 + extra
        line = weighted_line(x, y, np.sqrt(variance))
        squares = (y - line.beta[0] - line.beta[1] * x) ** 2
        excess = (line.excess - 1) * (n - 2)
        extra = max(extra + excess / float(np.sum(squares / variance**2)), 0.0)
    slope, spread = float(line.beta[1]), float(np.sqrt(line.covariance[1, 1]))
    half = float(stdtrit(n - 2, 0.975)) * spread
    interval = slope - half, slope + half
    if np.ptp(x) < 1:
        reason = f"stick times range over {np.ptp(x):.2g} e-folds; at least one is needed"
    elif interval[0] <= 0 <= interval[1]:
        reason = f"the 95 % interval, {interval[0]:.2g} to {interval[1]:.2g}, holds zero"
    return StickSlipHealing(slope, spread, interval, n, reason)
