"""Periodic modulations of load, shear force and pulling velocity, by Fourier coefficients.

    w(theta)     = 1 + sum a_k cos k theta + b_k sin k theta,     theta = omega t,

and the same, without the 1, for the shear force over W0, and with it for the velocity over V.
"""

from __future__ import annotations

from typing import TypeAlias

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.loads.modulation import Excitation, Modulation

#: Pairs (a_k, b_k) for k = 1, 2, ...; arrays over the operating points.
Series: TypeAlias = tuple[tuple[ArrayLike, ArrayLike], ...]


class Periodic(Modulation):
    """One period of an excitation given by Fourier coefficients.

    Parameters
    ----------
    load, shear, pull : tuple of pairs
        (a_k, b_k) for k = 1, 2, ...; empty where nothing is modulated. The load must stay
        positive; `modulated` and `sampled` check it.
    """

    load: Series = ()
    shear: Series = ()
    pull: Series = ()

    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad)."""
        w, w_slope = _sum(self.load, theta)
        shear, shear_slope = _sum(self.shear, theta)
        pull, _ = _sum(self.pull, theta)
        return Excitation(1 + w, w_slope, shear, shear_slope, 1 + pull)

    @property
    def amplitude(self) -> ArrayLike:
        """Amplitude of the first harmonic of the load; 0 where the load is constant."""
        return jnp.hypot(*self.load[0]) if self.load else 0.0

    @property
    def even(self) -> bool:
        """Whether there are no sines."""
        series = (*self.load, *self.shear, *self.pull)
        return not any(np.any(sine) for _, sine in series)

    @property
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
        parts = {"w(t)": ("1", self.load), "shear/W0": ("", self.shear), "V(t)/V": ("1", self.pull)}
        return ", ".join(
            f"{name} = {_written(mean, series)}" for name, (mean, series) in parts.items() if series
        )

    def scaled(self, share: ArrayLike) -> Periodic:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""
        parts = (self.load, self.shear, self.pull)
        return Periodic(*(tuple((share * a, share * b) for a, b in s) for s in parts))


def _sum(series: Series, theta: ArrayLike) -> tuple[Array, Array]:
    """Value and slope of a series."""
    value = slope = jnp.zeros(jnp.shape(theta))
    for k, (a, b) in enumerate(series, start=1):
        cos, sin = jnp.cos(k * theta), jnp.sin(k * theta)
        value = value + a * cos + b * sin
        slope = slope + k * (b * cos - a * sin)
    return value, slope


def _written(mean: str, series: Series) -> str:
    terms = [mean] if mean else []
    for k, pair in enumerate(series, start=1):
        for value, function in zip(pair, ("cos", "sin"), strict=True):
            low, high = float(np.min(value)), float(np.max(value))
            if low == high == 0:
                continue
            number = f"({low!r})" if low == high else f"({low!r} to {high!r})"
            terms.append(f"{number} {function}({k} w t)")
    return " + ".join(terms) or "0"
