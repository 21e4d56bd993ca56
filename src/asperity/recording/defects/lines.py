"""Spectral lines such as hum of the mains: detection above the local background, and removal.

Amplitude and phase of a line are linear over pieces of 100 periods, since mains wander.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from asperity.arrays import Float

#: Resolution of the spectrum (Hz), height over the spectrum about it, spectral values that are
#: compared, how many lines, and periods in a piece that is fitted.
_RESOLUTION, _HEIGHT, _ABOUT, _LINES, _PERIODS = 0.1, 8.0, 101, 12, 100


def find_lines(x: Float, step: float, lowest: float) -> list[float]:
    """Frequencies (Hz) of lines high above the spectrum around them.

    Parameters
    ----------
    x : array, shape (n,)
        Evenly sampled.
    step : float
        Between samples (s).
    lowest : float
        Lowest frequency (Hz) of lines that are searched.
    """
    size = min(2 ** round(math.log2(1 / (_RESOLUTION * step))), x.size // 4)
    if size < 4 * _ABOUT:
        return []
    # scipy.signal loads the whole of scipy.stats, and short recordings need neither.
    from scipy.signal import welch

    frequency, power = welch(x, 1 / step, nperseg=size, detrend="linear")
    height = power / np.maximum(median_filter(power, _ABOUT), 1e-300)
    height[frequency < lowest] = 0.0
    result: list[float] = []
    for k in np.argsort(-height):
        if height[k] < _HEIGHT or len(result) >= _LINES:
            break
        around = power[k - 1 : k + 2]
        if (
            around.size < 3
            or around.argmax() != 1
            or any(abs(frequency[k] - f) < 1 for f in result)
        ):
            continue
        low, top, high = np.log(around)
        result.append(
            float(frequency[k] + frequency[1] * (low - high) / 2 / (low - 2 * top + high))
        )
    return result


def subtract_line(x: Float, turns: float) -> None:
    """Subtract a line of `turns` cycles a sample, in place, in pieces of 100 periods.

    Amplitude and phase are fitted to the signal minus its running mean over a period, because a
    step of friction has components of every frequency.
    """
    m = min(math.ceil(_PERIODS / turns), x.size)
    k = np.arange(m)
    u = 2 * k / m - 1
    wave = np.exp(2j * np.pi * turns * k)
    columns = np.stack([wave.real, wave.imag, u * wave.real, u * wave.imag], axis=1)
    inverse = np.linalg.pinv(columns)
    fast = x - uniform_filter1d(x, round(1 / turns))
    whole = x.size // m * m
    last = (fast[-m:] @ inverse.T) @ columns.T
    x[:whole].reshape(-1, m)[:] -= (fast[:whole].reshape(-1, m) @ inverse.T) @ columns.T
    x[whole:] -= last[m - (x.size - whole) :]
