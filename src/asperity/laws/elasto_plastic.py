"""The elasto-plastic extension ("EXT"): the rate term depends on the plastic velocity only.

Bureau et al. (2000), section III.C, Eqs. (26)-(29). Asperities of shear stiffness W / lambda carry
the interface force F_i; sliding at dx/dt strains them elastically and the joint plastically::

    v_plastic = d/dt (x - F_i lambda / W)
    F_i / W   = mu0 + A ln(v_plastic / V0) + B ln(V0 Phi / D0)
    dPhi/dt   = 1 - (dx/dt) Phi / D0        (as printed: with the slider's velocity)

The relation between v_plastic, the spring and the load is kinematics and is written once, in
`asperity.slider`; the law contributes lambda.
"""

from __future__ import annotations

from typing import ClassVar

from jax.typing import ArrayLike

from asperity.laws.parameter import parameter
from asperity.laws.rice_ruina import RiceRuina


class ElastoPlastic(RiceRuina):
    """Elasto-plastic law, age law on the slider velocity as printed.

    Parameters
    ----------
    lambda_ : float
        Shear elastic length (m), >= 0; lambda -> 0 is Rice-Ruina.
    mu0, A, B, D0, V0 : float
        As in `RiceRuina`.
    """

    name: ClassVar[str] = "elasto-plastic"
    source: ClassVar[str] = "bureau2000"
    equations: ClassVar[tuple[str, ...]] = (
        r"F_i=W\left[\mu_0+A\ln\frac{\dot x_\mathrm{pl}}{V_0}+B\ln\frac{V_0\Phi}{D_0}\right]",
        r"\dot x_\mathrm{pl}=\frac{d}{dt}\left(x-\frac{F_i\lambda}{W}\right)",
        r"\dot\Phi=1-\frac{\dot x\Phi}{D_0}",
    )

    lambda_: ArrayLike = parameter("law.lambda", "length", "not negative")

    @property
    def elastic_length(self) -> ArrayLike:
        """Lambda (m)."""
        return self.lambda_
