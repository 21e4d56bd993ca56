"""The low-pass of a force gauge in a compiled program: linear, as `RunTerm` applies it by NumPy.

The filter is a convolution with its response to one sample, by fast Fourier transforms; what it
gives is read at the samples, or averaged over blocks.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from asperity.tribometer.filters import between, filtered, low_pass

Float = NDArray[np.float64]

#: Samples ahead that the filter of evenly spaced samples reads.
_AHEAD = 2


class GaugeArrays(NamedTuple):
    """Numbers of a gauge.

    Attributes
    ----------
    response : array, shape (size,)
        To one sample, from two samples before it on; filled up by zeros.
    index : array of int, shape (n, 4) or (n, 2)
        Filtered samples that each recorded one is read from; for means, those before the edges.
    weight : array, of the same shape
        Of those samples; for means, the share of an interval from there to the edge.
    per_length : array, shape (n,)
        1 over the length of each block, in intervals; empty where there are no means.
    """

    response: Any
    index: Any
    weight: Any
    per_length: Any

    def recorded(self, motion: Array) -> Array:
        """What the gauge shows of the motion at evenly spaced times.

        Parameters
        ----------
        motion : array, shape (m,)
            Steady before the first, and as the last afterwards.
        """
        m, size = motion.size, self.response.size
        moved = jnp.append(motion - motion[0], jnp.full(_AHEAD, motion[-1] - motion[0]))
        transfer = jnp.fft.rfft(self.response)
        whole = jnp.fft.irfft(jnp.fft.rfft(moved, size) * transfer, size)
        shown = whole[_AHEAD : _AHEAD + m]
        if not self.per_length.size:
            return motion[0] + jnp.sum(self.weight * shown[self.index], axis=1)
        steps = (shown[1:] + shown[:-1]) / 2
        rises = jnp.append(jnp.zeros(1), jnp.cumsum(steps))
        first, rise = shown[self.index], shown[self.index + 1] - shown[self.index]
        at_edges = rises[self.index] + self.weight * (first + self.weight * rise / 2)
        return motion[0] + (at_edges[:, 1] - at_edges[:, 0]) * self.per_length


def gauge_arrays(
    gauge: tuple[int, float], rate: float, count: int, times: Float, size: int
) -> GaugeArrays:
    """Numbers of a gauge for samples at some times, or means between them.

    Parameters
    ----------
    gauge : (int, float)
        Order, and corner frequency (Hz).
    rate : float
        Of the computed motion (Hz).
    count : int
        Its samples.
    times : array, shape (n,) or (n, 2)
        Of recorded samples, or edges of blocks (s).
    size : int
        Length to which the computed motion is filled up by its last sample.
    """
    impulse = np.zeros(size + 3 * _AHEAD)
    impulse[2 * _AHEAD] = 1.0
    response = filtered(impulse, rate, *low_pass(*gauge))[_AHEAD:]
    # Longer than the two together, so that the end does not reach the beginning.
    length = next_fast_len(2 * size + 2 * _AHEAD, real=True)
    response = np.append(response, np.zeros(length - response.size))
    if times.ndim == 1:
        # The cubic through four samples is linear in each of them.
        last = count - 1
        k = np.minimum(np.clip(times * rate, 0, last).astype(np.intp), max(last - 1, 0))
        index = np.clip(k[:, None] + np.arange(-1, 3), 0, last)
        u = np.clip(times * rate, 0, last) - k
        cubic = [between(row, 1.0, 1.0 + u) for row in np.eye(4)]
        return GaugeArrays(response, index, np.stack(cubic, axis=1), np.zeros(0))
    position = np.clip(times * rate, 0, count - 1)
    index = np.minimum(position.astype(np.intp), count - 2)
    return GaugeArrays(response, index, position - index, 1 / (np.diff(times)[:, 0] * rate))
