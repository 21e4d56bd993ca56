"""Excitation of the slider at an instant, the interface of a modulation, and `Harmonic`."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple, Self

import equinox as eqx
import jax.numpy as jnp
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
