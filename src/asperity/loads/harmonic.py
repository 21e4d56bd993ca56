"""Harmonic modulation of the normal load, W = W0 (1 + eps cos wt)."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike


class Harmonic(eqx.Module):
    """One period of w(theta) = 1 + eps cos(theta), theta = omega t.

    Parameters
    ----------
    epsilon : array
        Relative amplitude, 0 <= eps < 1 (contact is never lost). Where an air
        layer bears part of the modulation this is the part that the contacts carry.
    """

    epsilon: ArrayLike

    def load(self, theta: ArrayLike) -> Array:
        """W/W0 at the phase `theta` (rad)."""
        return 1 + self.epsilon * jnp.cos(theta)

    def slope(self, theta: ArrayLike) -> Array:
        """d(W/W0)/d(theta)."""
        return -self.epsilon * jnp.sin(theta)
