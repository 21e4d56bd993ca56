"""Harmonic modulation of the normal load, W = W0 (1 + eps cos wt)."""

from __future__ import annotations

import jax.numpy as jnp
from jax.typing import ArrayLike

from asperity.loads.excitation import Excitation
from asperity.loads.modulation import Modulation


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
