"""Variant of the elasto-plastic law in which the age law, too, has the plastic velocity.

Not printed in Bureau et al. (2000), which keeps dx/dt in the age law; the variant states that only
irreversible slip renews contacts::

    dPhi/dt = 1 - v_plastic Phi / D0
"""

from __future__ import annotations

from typing import ClassVar

from jax.typing import ArrayLike

from asperity.laws.elasto_plastic import ElastoPlastic
from asperity.laws.law import State


class ElastoPlasticAge(ElastoPlastic):
    """Elasto-plastic law, age law on the plastic velocity; parameters as `ElastoPlastic`."""

    name: ClassVar[str] = "elasto-plastic-age"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x_\mathrm{pl}}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot x_\mathrm{pl}=\frac{d}{dt}\left(x-\frac{F_i\lambda}{W}\right)",
        r"\dot\Phi=1-\frac{\dot x_\mathrm{pl}\Phi}{D_0}",
    )

    def state_rate(self, v: ArrayLike, v_plastic: ArrayLike, state: State, w: ArrayLike) -> State:
        """Ageing on the plastic velocity."""
        return (self.ageing(v_plastic, state, w),)
