"""The columns of a lock-in reading.

A reading is least squares on

    u^0 .. u^d,  cos k phi, sin k phi,  u cos k phi, u sin k phi   (k = 1..n)

with u = (t - centre)/half_width and phi = omega (t - centre). The last 2n columns are the
derivatives with respect to the frequency. The set is closed under a shift of time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Basis:
    """The columns of a reading.

    Attributes
    ----------
    omega : float
        Angular frequency (rad/s).
    harmonics : int
        n, at least 1.
    degree : int
        Degree d of the drift, 0 to 2.
    centre, half_width : float
        Middle and half length (s) of the window.
    """

    omega: float
    harmonics: int
    degree: int
    centre: float
    half_width: float

    @property
    def drift(self) -> int:
        """Number of drift columns."""
        return self.degree + 1

    @property
    def linear(self) -> int:
        """Number of columns without those of the frequency."""
        return self.drift + 2 * self.harmonics

    @property
    def size(self) -> int:
        """Number of all columns."""
        return self.drift + 4 * self.harmonics

    def columns(self, time: Array, out: Array | None = None) -> Array:
        """Columns at some times.

        Parameters
        ----------
        time : array, (n,)
            Seconds.
        out : array, (size, n), optional
            Output array.

        Returns
        -------
        array, (size, n)
        """
        out = np.empty((self.size, time.size)) if out is None else out
        shifted = time - self.centre
        u = shifted / self.half_width
        out[0] = 1.0
        for power in range(1, self.drift):
            np.multiply(out[power - 1], u, out=out[power])
        cosine, sine = self._cosines_and_sines(out)
        np.multiply(shifted, self.omega, out=shifted)
        np.cos(shifted, out=cosine[0])
        np.sin(shifted, out=sine[0])
        for k in range(1, self.harmonics):
            # e^(i(k+1)phi) = e^(ik phi) e^(i phi): two sines a sample, however many harmonics.
            np.multiply(cosine[k - 1], cosine[0], out=cosine[k])
            cosine[k] -= sine[k - 1] * sine[0]
            np.multiply(sine[k - 1], cosine[0], out=sine[k])
            sine[k] += cosine[k - 1] * sine[0]
        np.multiply(out[self.drift : self.linear], u, out=out[self.linear :])
        return out

    def _cosines_and_sines(self, columns: Array) -> tuple[Array, Array]:
        trigonometric = columns[self.drift : self.linear]
        return trigonometric[: self.harmonics], trigonometric[self.harmonics :]

    def shift(self, start: Array) -> Array:
        """Matrices that transform the columns at `centre + s` into those at `start + s`.

        Parameters
        ----------
        start : array, (blocks,)
            Seconds.

        Returns
        -------
        array, (blocks, size, size)
        """
        n, first, second = self.harmonics, self.drift, self.linear
        turned = np.zeros((start.size, self.size, self.size))
        u = (start - self.centre) / self.half_width
        for power in range(self.drift):
            for j in range(power + 1):
                turned[:, power, j] = _binomial(power, j) * u ** (power - j)
        k = np.arange(n)
        angle = self.omega * (start - self.centre)[:, None] * (k + 1)
        cosine, sine = np.cos(angle), np.sin(angle)
        for at in (first, second):
            turned[:, at + k, at + k] = turned[:, at + n + k, at + n + k] = cosine
            turned[:, at + k, at + n + k] = -sine
            turned[:, at + n + k, at + k] = sine
        rotation = turned[:, first:second, first:second]
        turned[:, second:, first:second] = u[:, None, None] * rotation
        return turned


def _binomial(n: int, k: int) -> int:
    return (1, n, n * (n - 1) // 2)[k]
