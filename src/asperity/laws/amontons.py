"""Amontons-Coulomb friction, F = mu0 W: the null model of Bureau et al. (2000), section I.

A load modulation changes the force in proportion and does not change its mean. The law has
neither rate nor state, hence no dynamics and no Floquet multipliers.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.laws.law import Law, State
from asperity.laws.parameter import parameter


class Amontons(Law):
    """Amontons-Coulomb law.

    Parameters
    ----------
    mu0 : float
        Friction coefficient (dimensionless).
    """

    name: ClassVar[str] = "amontons"
    source: ClassVar[str] = "bureau2000"
    equations: ClassVar[tuple[str, ...]] = (r"F_i=\mu_0W",)
    state_names: ClassVar[tuple[str, ...]] = ()
    rate_dependent: ClassVar[bool] = False

    mu0: ArrayLike = parameter("law.mu0", "dimensionless")

    def friction(self, v: ArrayLike, state: State, w: ArrayLike) -> Array:
        """F/W = mu0 at any velocity."""
        return self.mu0 * jnp.ones_like(jnp.asarray(v * w, float))

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """No state."""
        return ()

    def steady_state(self, v: ArrayLike) -> State:
        """No state."""
        return ()
