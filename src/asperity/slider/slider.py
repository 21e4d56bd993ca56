"""A slider pulled through a spring: the parameters of the mechanical system."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jax.typing import ArrayLike

from asperity.laws import Law
from asperity.laws.consistency import checked_law
from asperity.parameters import MACHINE
from asperity.parameters.arguments import typed
from asperity.parameters.parameter import Displayed, SummaryLine, parameter_line


class Slider(Displayed, eqx.Module):
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

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load="7 N")
    """

    law: Law
    K: ArrayLike
    W0: ArrayLike
    M: ArrayLike

    @typed
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
            If a value breaks its rule or has a unit of another kind, or a user's law fails
            `asperity.laws.consistency.checked_law`.
        """
        self.law = checked_law(law)
        self.K = jnp.asarray(MACHINE["K"].check(spring))
        self.W0 = jnp.asarray(MACHINE["W0"].check(load))
        self.M = jnp.asarray(MACHINE["M"].check(mass))

    def summary(self) -> tuple[str, list[SummaryLine]]:
        """Law and parameters."""
        law, lines = self.law.summary()
        of_machine = [
            parameter_line(MACHINE[name], getattr(self, name)) for name in ("K", "W0", "M")
        ]
        return f"Slider, {law}", lines + of_machine
