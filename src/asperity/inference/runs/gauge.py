"""The recording of a motion by a force gauge: samples or block means, after its low-pass.

A linear function of the friction at computed times, in JAX. The low-pass is a convolution with its
response to one sample, by fast Fourier transforms.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.fft import next_fast_len

from asperity.arrays import Float
from asperity.tribometer.sensors import between, filtered, low_pass

#: Name of the gauge's gain: in the motion of a run, and for all runs in priors.
GAIN = "gain"
#: Computed times, and samples, are padded to this number times a power of two, or 3/2 of that.
_ROUNDED = 1024
#: Number of later samples that the filter of evenly spaced samples uses.
_LATER_SAMPLES = 2
#: Number of computed samples in the quickest part of the gauge's response.
_FILTER_SAMPLES = 8.0
#: Computed samples of the filtered motion in a block.
_BLOCK_SAMPLES = 4


class GaugeReading(eqx.Module):
    """Arrays that turn a computed motion into recorded samples, or means over blocks.

    Attributes
    ----------
    times : array, shape (m,)
        Times at which the motion is computed (s), in order, padded with the last time.
    index : array of int, shape (n, k)
        Indices of the computed or filtered values for each sample; for means after a low-pass, of
        the values before the edges of the block.
    weight : array, shape (n, k)
        Weights of these values; for means after a low-pass, the distance from the value to the
        edge, as a share of the interval.
    response : array, shape (size,)
        Response of the low-pass to one sample, from two samples before it, padded with zeros; empty
        without a low-pass.
    per_length : array, shape (n,)
        1 over the length of each block, in intervals; empty unless there are means after a
        low-pass.
    means : bool
        Whether the motion is averaged between successive times: blocks without a low-pass.
    """

    times: Any
    index: Any
    weight: Any
    response: Any
    per_length: Any
    means: bool = eqx.field(static=True)

    def filled_up(self) -> GaugeReading:
        """The reading padded with its last sample, to one of a few lengths."""
        extra = _padding(len(self.index))

        def filled(rows: Float) -> Float:
            return np.concatenate([rows, np.repeat(rows[-1:], extra, axis=0)])

        return replace(
            self,
            index=filled(self.index),
            weight=filled(self.weight),
            per_length=filled(self.per_length),
        )

    def recorded(self, friction: Array) -> Array:
        """Recorded samples, shape (n,).

        Parameters
        ----------
        friction : array
            Friction at the times, or means between successive times; assumed constant before the
            first and after the last.
        """
        if not self.response.size:
            return jnp.sum(self.weight * friction[self.index], axis=1)
        first = friction[0]
        shown = self._filtered(friction - first)
        if not self.per_length.size:
            return first + jnp.sum(self.weight * shown[self.index], axis=1)
        steps = (shown[1:] + shown[:-1]) / 2
        rises = jnp.append(jnp.zeros(1), jnp.cumsum(steps))
        before, rise = shown[self.index], shown[self.index + 1] - shown[self.index]
        at_edges = rises[self.index] + self.weight * (before + self.weight * rise / 2)
        return first + (at_edges[:, 1] - at_edges[:, 0]) * self.per_length

    def _filtered(self, values: Array) -> Array:
        """Values at evenly spaced times, the first of which is 0, after the low-pass."""
        m, size = values.size, self.response.size
        moved = jnp.append(values, jnp.full(_LATER_SAMPLES, values[-1]))
        transfer = jnp.fft.rfft(self.response)
        whole = jnp.fft.irfft(jnp.fft.rfft(moved, size) * transfer, size)
        return whole[_LATER_SAMPLES : _LATER_SAMPLES + m]


def reading_at(times: Float, gauge: tuple[int, float] | None = None) -> GaugeReading:
    """The reading of samples at the given times, or of means over the given blocks.

    Parameters
    ----------
    times : array, shape (n,) or (n, 2)
        Times of samples, or beginning and end of each block (s); the last is the latest.
    gauge : (int, float), optional
        Order, and corner frequency (Hz), of a Butterworth low-pass.
    """
    nothing = np.zeros(0)
    if gauge is None:
        at = times if times.ndim == 1 else np.unique(times)
        index = np.arange(at.size) if times.ndim == 1 else np.searchsorted(at, times[:, 0])
        weight = np.ones((index.size, 1))
        return GaugeReading(_padded(at), index[:, None], weight, nothing, nothing, times.ndim == 2)
    apart = np.median(np.diff(times if times.ndim == 1 else times.mean(axis=1)))
    inside = 1 if times.ndim == 1 else _BLOCK_SAMPLES
    rate = max(inside / float(apart), _FILTER_SAMPLES * gauge[1])
    end = float(times.flat[-1])
    count = math.ceil(end * rate) + 1
    at = _padded(np.minimum(np.arange(count) / rate, end))
    impulse = np.zeros(at.size + 3 * _LATER_SAMPLES)
    impulse[2 * _LATER_SAMPLES] = 1.0
    response = filtered(impulse, rate, *low_pass(*gauge))[_LATER_SAMPLES:]
    # Longer than signal and response together: the circular convolution does not wrap around.
    length = next_fast_len(2 * at.size + 2 * _LATER_SAMPLES, real=True)
    response = np.append(response, np.zeros(length - response.size))
    position = np.clip(times * rate, 0, count - 1)
    if times.ndim == 1:
        # The cubic through four samples is linear in each of them.
        k = np.minimum(position.astype(np.intp), max(count - 2, 0))
        index = np.clip(k[:, None] + np.arange(-1, 3), 0, count - 1)
        cubic = [between(row, 1.0, 1.0 + position - k) for row in np.eye(4)]
        return GaugeReading(at, index, np.stack(cubic, axis=1), response, nothing, False)
    index = np.minimum(position.astype(np.intp), count - 2)
    per_length = 1 / (np.diff(times)[:, 0] * rate)
    return GaugeReading(at, index, position - index, response, per_length, False)


def _padded(times: Float) -> Float:
    """Times padded with the last time, to one of a few lengths."""
    return np.concatenate([times, np.full(_padding(times.size), times[-1])])


def _padding(size: int) -> int:
    """Number of elements that are missing to the next of a few lengths."""
    power = _ROUNDED << max(math.ceil(math.log2(size / _ROUNDED)), 0)
    return (power * 3 // 4 if power > _ROUNDED and size <= power * 3 // 4 else power) - size
