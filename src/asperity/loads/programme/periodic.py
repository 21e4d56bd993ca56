"""Segments of a periodic modulation of any form."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.loads.excitation import Excitation
from asperity.loads.modulation import Modulation
from asperity.loads.programme.segment import ProgrammeSegment, Scalar


class PeriodicSegment(ProgrammeSegment):
    """A periodic modulation of any form about constant levels.

    Parameters
    ----------
    duration : array
        Seconds.
    modulation : Modulation
        Over its means, such as `Periodic`.
    frequency : array
        Hz.
    load1, pull1 : array
        Mean load (N) and mean pulling velocity (m/s).
    """

    duration: Scalar = eqx.field(converter=jnp.asarray)
    modulation: Modulation
    frequency: Scalar = eqx.field(converter=jnp.asarray)
    load1: Scalar = eqx.field(converter=jnp.asarray)
    pull1: Scalar = eqx.field(converter=jnp.asarray)

    @property
    def _omega(self) -> Array:
        return 2 * jnp.pi * self.frequency

    def _excitation(self, t: ArrayLike) -> Excitation:
        return self.modulation.at(self._omega * t)

    def load(self, t: ArrayLike) -> tuple[Array, Array]:
        """W and dW/dt."""
        at = self._excitation(t)
        return self.load1 * at.w, self.load1 * at.w_slope * self._omega

    def shear(self, t: ArrayLike) -> tuple[Array, Array]:
        """Shear force S and dS/dt."""
        at = self._excitation(t)
        return self.load1 * at.shear, self.load1 * at.shear_slope * self._omega

    def pull(self, t: ArrayLike) -> Array:
        """Pulling velocity V."""
        return self.pull1 * self._excitation(t).pull * jnp.ones_like(t)

    def position(self, t: ArrayLike) -> Array:
        """Integral of V, term by term."""
        way = self.pull1 * jnp.asarray(t)
        for k, (a, b) in enumerate(getattr(self.modulation, "pull", ()), start=1):
            angle = k * self._omega * t
            swing = a * jnp.sin(angle) + b * (1 - jnp.cos(angle))
            way = way + self.pull1 * swing / (k * self._omega)
        return way

    def _over_a_period(self) -> np.ndarray:
        return np.linspace(0, 1 / float(self.frequency), 513)

    @property
    def lowest_load(self) -> float:
        """Of 512 instants of a period."""
        return float(np.min(self.load(self._over_a_period())[0]))

    @property
    def fastest_pull(self) -> float:
        """Of 512 instants of a period."""
        return float(np.max(np.abs(self.pull(self._over_a_period()))))

    @property
    def longest_step(self) -> float:
        """A tenth of the period of the highest harmonic."""
        series = [getattr(self.modulation, name, ()) for name in ("load", "shear", "pull")]
        return 0.1 / float(self.frequency) / max(1, *map(len, series))

    @property
    def period(self) -> float | None:
        """1/f."""
        return 1 / float(self.frequency)
