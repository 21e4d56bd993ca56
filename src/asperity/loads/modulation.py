"""Excitation of the slider at an instant, and modulations: harmonic, or by Fourier coefficients."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple, Self, TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike


class Excitation(NamedTuple):
    """Values and slopes at a phase theta = omega t; slopes are derivatives with respect to theta.

    Constant quantities keep their default, a number that compiled programs fold away.

    Attributes
    ----------
    w, w_slope : array
        Normal load W/W0 and its slope.
    shear, shear_slope : array
        Force on the slider along the pulling direction in addition to the spring's, over W0, and
        its slope, such as from an exciter at an angle.
    pull : array
        Velocity of the far end of the spring over its mean V.
    """

    w: Array
    w_slope: ArrayLike = 0.0
    shear: ArrayLike = 0.0
    shear_slope: ArrayLike = 0.0
    pull: ArrayLike = 1.0


class Modulation(eqx.Module):
    """One period of an excitation; its arrays carry the operating points along the last axis."""

    @abstractmethod
    def at(self, theta: ArrayLike) -> Excitation:
        """Values and slopes at the phase `theta` (rad)."""

    @property
    @abstractmethod
    def amplitude(self) -> ArrayLike:
        """Amplitude of the first harmonic of W/W0."""

    @abstractmethod
    def scaled(self, share: ArrayLike) -> Self:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""

    @property
    def even(self) -> bool:
        """Whether load, shear force and pulling velocity are known to be even in theta."""
        return False

    @property
    @abstractmethod
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""


class Harmonic(Modulation):
    """One period of w(theta) = 1 + eps cos(theta), theta = omega t.

    Parameters
    ----------
    epsilon : array
        Relative amplitude, 0 <= eps < 1 (contact is never lost). Where an air
        layer bears part of the modulation this is the part that the contacts carry.
    """

    epsilon: ArrayLike

    def at(self, theta: ArrayLike) -> Excitation:
        """Load and slope at the phase `theta` (rad)."""
        return Excitation(
            w=jnp.asarray(1 + self.epsilon * jnp.cos(theta)), w_slope=-self.epsilon * jnp.sin(theta)
        )

    @property
    def amplitude(self) -> ArrayLike:
        """Relative amplitude epsilon."""
        return self.epsilon

    @property
    def even(self) -> bool:
        """True: there is a cosine only."""
        return True

    @property
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
        return "w(t) = 1 + eps cos(w t)"

    def scaled(self, share: ArrayLike) -> Harmonic:
        """The modulation with `share` of its amplitude: 0 is steady sliding."""
        return Harmonic(self.epsilon * share)


#: Pairs (a_k, b_k) for k = 1, 2, ...; arrays over the operating points.
Series: TypeAlias = tuple[tuple[ArrayLike, ArrayLike], ...]


class Periodic(Modulation):
    """One period of an excitation given by Fourier coefficients.

    w(theta) = 1 + sum a_k cos k theta + b_k sin k theta with theta = omega t, and the same, without
    the 1, for the shear force over W0, and with it for the pulling velocity over V.

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
