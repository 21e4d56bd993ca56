"""Stability of unmodulated steady sliding, in closed form.

Linearised about steady sliding at V, with l = lambda K/W0 and perturbations growing as e^{s t}, the
quasi-static equations of section III give, the age law being on the slider's velocity::

    (1 + l) A W0/V s^2 + [K - (B - (1 + l) A) W0/D0] s + K V/D0 = 0.

For l = 0 the bracket changes sign at the paper's Kc = (B - A) W0/D0. Load rates are absent, hence
Linker-Dieterich ageing has the stability of Rice-Ruina's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.papers.bureau2000.numbers.machine import Float
from asperity.slider import Slider


def growth_rate(slider: Slider, V: ArrayLike) -> Float:
    """Largest real part of s (1/s); positive where steady sliding is unstable."""
    V = np.asarray(V, dtype=float)
    A, B, D0, length, K, W0 = _numbers(slider)
    A = A * (1 + length * K / W0)
    quadratic, constant = A * W0 / V, K * V / D0
    linear = K - (B - A) * W0 / D0
    root = np.sqrt(linear**2 - 4 * quadratic * constant + 0j)
    return np.asarray(((root - linear) / (2 * quadratic)).real)


def floquet_max(slider: Slider, V: ArrayLike, frequency: ArrayLike) -> Float:
    """Growth of a perturbation of steady sliding over one period 1/frequency (Hz)."""
    return np.exp(growth_rate(slider, V) / np.asarray(frequency))


def stiffness_ratio(slider: Slider) -> float:
    """K/Kc with the paper's Kc = (B - A) W0/D0: sliding on rigid asperities is stable above 1."""
    A, B, D0, _, K, W0 = _numbers(slider)
    return float(K * D0 / ((B - A) * W0))


def _numbers(slider: Slider) -> tuple[Float, ...]:
    """A, B, D0, lambda, K and W0 of a slider with one of the paper's laws."""
    law: Any = slider.law
    values = (law.A, law.B, law.D0, law.elastic_length, slider.K, slider.W0)
    return tuple(np.asarray(value, dtype=float) for value in values)
