"""Noise of a force that loads and drops: impulses, and the scatter of averages of every length.

The force is taken to be straight lines between fast drops, in Gaussian noise that may be
correlated, with impulses of one or two samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import ndtri

from asperity.arrays import Float, Index
from asperity.recording.defects.resolution import recorder_step

#: Width of a median filter whose output two neighbouring impulses do not change.
_FILTER = 5
#: An impulse differs from the median by this many standard deviations, including the median's
#: noise. Two samples that stand out by less, one up and one down, make no fall.
_IMPULSE = 4.5
#: Quantile of second differences that gives their scatter, as up to two thirds of the blocks may
#: hold a slip or a peak; largest share of differences on one level of a coarse recorder.
_QUANTILE, _MOST = 0.25, 0.99
#: Fewest blocks that give a scatter; with fewer than `_MANY_BLOCKS` the scatter of shorter means
#: bounds it. Relative standard error of a scatter times the root of the number of blocks.
_FEWEST_BLOCKS, _MANY_BLOCKS = 32, 256
_QUANTILE_ERROR = 1.8
#: Second differences from which a scatter is estimated, to 1.4 %; of more, an even selection.
_MOST_BENDS = 1 << 14
#: Probability of a false event in a recording of Gaussian noise.
FALSE_ALARM = 0.01


@dataclass(frozen=True)
class Noise:
    """Scatter of means, from their second differences.

    Attributes
    ----------
    scatter : array, (m, m)
        Entry (k, j), j >= k: standard deviation of means over 2^k samples, by second differences at
        a lag of 2^j samples, in the unit of the force. Noise counts that is faster than the lag.
    samples : int
        Number of samples of the recording.
    """

    scatter: Float
    samples: int

    @property
    def longest(self) -> int:
        """Exponent k of the longest means, over 2^k samples."""
        return self.scatter.shape[0] - 1

    def of_means(self, longest: int, noisy: int) -> Float:
        """Standard deviation of means over 1, 2, 4, ... 2^longest samples.

        Parameters
        ----------
        longest : int
        noisy : int
            log2 of the longest lag at which noise alone is seen; at a longer one the motion is too.

        Returns
        -------
        array, (longest + 1,)
        """
        noisy = min(noisy, longest)
        scatter = np.diagonal(self.scatter)[: longest + 1].copy()
        scatter[: noisy + 1] = self.scatter[: noisy + 1, : noisy + 1].max(1)
        # Longer means of a noise scatter less.
        return np.asarray(np.minimum.accumulate(scatter))

    def threshold(self, scatter: float, width: int) -> float:
        """Fall between two means that noise exceeds anywhere with probability `FALSE_ALARM`.

        Parameters
        ----------
        scatter : float
            Standard deviation of a mean.
        width : int
            Samples of a mean.

        Notes
        -----
        Union bound over all pairs of the 2 n/width overlapping means.
        """
        means = 2.0 * self.samples / width
        return float(np.sqrt(2.0) * scatter * -ndtri(FALSE_ALARM / means**2))


def estimate(force: Float) -> Noise:
    """Noise from second differences of means, in which straight loading cancels.

    Parameters
    ----------
    force : array, (n,)
        Without impulses, evenly sampled.
    """
    n = force.size
    # Scatter below this is rounding error.
    floor = 4 * np.finfo(float).eps * float(np.abs(force).max(initial=0.0))
    total = np.concatenate([[0.0], np.cumsum(force - force.mean())])
    # A saturated sample has no noise.
    ends = (force == force.max()) | (force == force.min())
    saturated = np.concatenate([[0], np.cumsum(ends)])
    size = max(int(np.log2(max(n // _FEWEST_BLOCKS, 1))) + 1, 1)
    scatter = np.zeros((size, size))
    for j in range(size):
        lag = 1 << j
        stop = n - 3 * lag + 1
        hop = max(1, min(lag // 4, stop // _MOST_BENDS))
        inside = saturated[3 * lag :: hop] == saturated[:stop:hop]
        if np.count_nonzero(inside) < _FEWEST_BLOCKS:
            inside[:] = True
        # Bends whose first mean is within a lag share samples.
        count = min(int(np.count_nonzero(inside)), n / lag)
        for k in range(j + 1):
            width = 1 << k
            before, here, after = (
                total[step + width : step + width + stop : hop] - total[step : step + stop : hop]
                for step in (0, lag, 2 * lag)
            )
            # The variance of the bend of white means is six times theirs.
            one = _deviation(np.abs(after - 2 * here + before)[inside]) / (np.sqrt(6.0) * width)
            # Two standard errors are added, so that thresholds are rarely too low.
            scatter[k, j] = max(one * (1 + 2 * _QUANTILE_ERROR / np.sqrt(count)), floor)
        if j and n / lag < _MANY_BLOCKS:
            # Few blocks may scatter little by chance: means of white noise bound the scatter.
            scatter[j, j] = max(scatter[j, j], scatter[j - 1, j - 1] / np.sqrt(2.0))
    return Noise(scatter, n)


def _deviation(sizes: Float) -> float:
    """Standard deviation of a normal variable, from its smaller absolute values.

    Values on the levels of a coarse recorder count up to the middle between two levels.
    """
    level = float(np.quantile(sizes, _QUANTILE, method="lower"))
    level += 1e-9 * float(sizes.max(initial=0.0))
    above = sizes[sizes > level]
    if not above.size:
        return 0.0
    share = min(1 - above.size / sizes.size, _MOST)
    return (level + float(above.min())) / 2 / float(ndtri(0.5 + share / 2))


def without_impulses(force: Float) -> tuple[Float, Index]:
    """The force with impulses of one or two samples replaced by the median around them.

    Parameters
    ----------
    force : array, (n,)
        Evenly sampled.

    Returns
    -------
    clean : array, (n,)
    impulses : int array
        Samples that were replaced, in rising order.

    Notes
    -----
    An impulse stands out of the median of five samples, and of the lines that the medians before
    and behind it make: the sharp peak of a cycle lies on one of these. Of 10,000 samples without
    impulses less than one is replaced. What is left lies within the smallest fall that counts.
    """
    middle = median_filter(force, _FILTER, mode="nearest")
    away = force - middle
    scatter = float(np.quantile(np.abs(np.diff(force, 2)), 0.5)) / (0.6745 * np.sqrt(6.0))
    # Steps of the recorder: rounding noise has no quantile of zero.
    scatter = max(scatter, recorder_step(force) / np.sqrt(12.0))
    limit = _IMPULSE * scatter
    at = np.flatnonzero(np.abs(away) > limit)
    for step in (-3, 3):
        near = np.clip(at + step, 0, force.size - 1)
        far = np.clip(at + 2 * step, 0, force.size - 1)
        out = force[at] - (2 * middle[near] - middle[far])
        # The noise of the line is in this too.
        at = at[(np.abs(out) > limit / 2) & (out * away[at] > 0)]
    clean = force.copy()
    clean[at] = middle[at]
    return clean, at
