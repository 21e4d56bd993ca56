"""A slider pulled through a spring: the parameters of the mechanical system."""

from __future__ import annotations

import equinox as eqx
from jax.typing import ArrayLike

from asperity.laws import Law
from asperity.laws.parameter import checked


class Slider(eqx.Module):
    """Law, spring, mass and mean load.

    Attributes
    ----------
    law : Law
        Friction law of the interface.
    K : array
        Spring stiffness (N/m).
    W0 : array
        Mean normal load (N).
    M : array
        Slider mass (kg); the quasi-static equations do not use it.
    """

    law: Law
    K: ArrayLike
    W0: ArrayLike
    M: ArrayLike

    def __init__(
        self,
        law: Law,
        *,
        spring: ArrayLike | str,
        load: ArrayLike | str,
        mass: ArrayLike | str = 0.0,
    ) -> None:
        """Build a slider from SI numbers or texts with units.

        Parameters
        ----------
        law : Law
        spring : array or str
            Spring stiffness K (N/m), positive.
        load : array or str
            Mean normal load W0 (N), positive.
        mass : array or str
            Mass M (kg), not negative.

        Raises
        ------
        InputError
            If a value breaks its rule or has a unit of another kind.
        """
        self.law = law
        self.K = checked(spring, name="slider.K", kind="stiffness", rule="positive")
        self.W0 = checked(load, name="slider.W0", kind="force", rule="positive")
        self.M = checked(mass, name="slider.M", kind="mass", rule="not negative")
