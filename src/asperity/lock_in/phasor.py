"""A harmonic with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Standard deviation (rad) of an angle that is uniform over the circle, pi/sqrt(3).
_UNKNOWN_PHASE = math.pi / math.sqrt(3)


@dataclass(frozen=True)
class Phasor:
    """Complex amplitude c of Re(c e^(i n phi)), phi the phase of the load.

    Attributes
    ----------
    value : complex
        Its modulus is the peak amplitude, its argument the phase against the load.
    covariance : array, (2, 2)
        Of the real and the imaginary part.
    dof : float
        Degrees of freedom of the covariance.
    """

    value: complex
    covariance: Array
    dof: float

    @property
    def amplitude(self) -> float:
        """Peak amplitude."""
        return abs(self.value)

    @property
    def phase(self) -> float:
        """Phase (rad) in (-pi, pi]."""
        angle = math.atan2(self.value.imag, self.value.real)
        return math.pi if angle == -math.pi else angle

    @property
    def amplitude_uncertainty(self) -> float:
        """Standard uncertainty of the amplitude, to first order (valid below a third of it)."""
        return self._along(self._direction)

    @property
    def phase_uncertainty(self) -> float:
        """Standard uncertainty (rad) of the phase; at most pi/sqrt(3), an unknown phase."""
        along = self._direction
        across = self._along(np.array([-along[1], along[0]]))
        return min(across / self.amplitude if self.amplitude else math.inf, _UNKNOWN_PHASE)

    def excludes(self, value: complex, level: float = 0.95) -> bool:
        """Whether `value` lies outside the confidence ellipse of probability `level`."""
        from scipy.special import fdtri

        away = np.array([value.real - self.value.real, value.imag - self.value.imag])
        # Without noise the ellipse is a point.
        spread = np.linalg.eigvalsh(self.covariance)
        if not spread[0] > 1e-14 * spread[1]:
            return bool(away.any())
        distance = float(away @ np.linalg.solve(self.covariance, away)) / 2
        return bool(distance > fdtri(2, self.dof, level))

    @property
    def _direction(self) -> Array:
        if not self.amplitude:
            return np.array([1.0, 0.0])
        return np.array([self.value.real, self.value.imag]) / self.amplitude

    def _along(self, direction: Array) -> float:
        return math.sqrt(max(float(direction @ self.covariance @ direction), 0.0))
