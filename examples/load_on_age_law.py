"""A law written outside the package: elastic asperities, and an age that depends on the load.

The elasto-plastic law of Bureau et al. (2000) with the ageing law of Linker and Dieterich (1992),
for the question how a modulation of the load acts on the age (`load_on_age.toml`)::

    F_i / W = mu0 + A ln(v_plastic / V0) + B ln(V0 Phi / D0)
    dPhi/dt = 1 - (dx/dt) Phi / D0 - (alpha / B) (dW/dt / W) Phi
"""

from __future__ import annotations

from typing import ClassVar

from jax.typing import ArrayLike

from asperity.laws import LinkerDieterich
from asperity.laws.parameter import parameter


class LoadOnAge(LinkerDieterich):
    """Linker-Dieterich ageing with elastic asperities.

    Parameters
    ----------
    lambda_ : float
        Shear elastic length (m), >= 0.
    mu0, A, B, D0, V0, alpha : float
        As in `asperity.laws.LinkerDieterich`.
    """

    name: ClassVar[str] = "load-on-age"

    lambda_: ArrayLike = parameter("law.lambda", "length", "not negative")

    @property
    def elastic_length(self) -> ArrayLike:
        """Lambda (m)."""
        return self.lambda_
