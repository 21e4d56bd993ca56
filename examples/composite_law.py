"""A friction law written outside the package: the composite law of Kato and Tullis (2001).

Friction is that of Rice-Ruina (Eq. 1 of Bureau et al. 2000). Below a velocity Vc contacts age, as
in the ageing law; above it the state changes with slip only, as in the slip law:

    dPhi/dt = exp(-v / Vc) - (v Phi / D0) ln(v Phi / D0).

Only the equations of the law are written here. Periodic response, stability and linear response are
computed by the package.
"""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np

import asperity as asp
from asperity.laws import Law, parameter, register


@register
class Composite(Law):
    """Rice-Ruina friction with the composite law; state: ``phi = ln(V0 Phi / D0)``."""

    name: ClassVar[str] = "composite"
    source: ClassVar[str] = "kato2001"
    state_names: ClassVar[tuple[str, ...]] = ("log_age",)

    mu0: float = parameter("law.mu0", "dimensionless")
    A: float = parameter("law.A", "dimensionless")
    B: float = parameter("law.B", "dimensionless")
    D0: float = parameter("law.D0", "length")
    V0: float = parameter("law.V0", "velocity")
    Vc: float = parameter("law.Vc", "velocity")

    def friction(self, v, state, w):
        """F/W = mu0 + A ln(v/V0) + B phi."""
        return self.mu0 + self.A * jnp.log(v / self.V0) + self.B * state[0]

    def state_rate(self, v, v_plastic, state, w):
        """dphi/dt = exp(-v/Vc)/Phi - (v/D0) ln(v Phi/D0)."""
        ageing = jnp.exp(-v_plastic / self.Vc - state[0]) * self.V0 / self.D0
        slip = v_plastic / self.D0 * (state[0] + jnp.log(v_plastic / self.V0))
        return (ageing - slip,)

    def steady_state(self, v):
        """The solution of x ln x = exp(-v/Vc), x = v Phi/D0, by Newton's method on ln x."""
        log_x = target = jnp.exp(-v / self.Vc)
        for _ in range(6):
            x = jnp.exp(log_x)
            log_x = log_x - (x * log_x - target) / (x * (1 + log_x))
        return (log_x - jnp.log(v / self.V0),)


def main():
    parameters = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": "0.4 um", "V0": "1 um/s"}
    get = asp.laws.get_law
    laws = {
        "rice-ruina": get("rice-ruina")(**parameters),
        "composite": get("composite")(**parameters, Vc="1 um/s"),
        "ruina-slip": get("ruina-slip")(**parameters),
    }
    epsilon = np.array([0.05, 0.10, 0.15])
    for name, law in laws.items():
        slider = asp.Slider(law, spring="0.2 N/um", load="7 N")
        response = asp.periodic_response(
            slider, velocity="1 um/s", epsilon=epsilon, frequency="120 Hz"
        )
        for eps, drop, result in zip(epsilon, response.delta_mu, response.result, strict=True):
            print(f"{name:10}  eps = {eps:.2f}  delta_mu = {drop:.5f}  {result}")


if __name__ == "__main__":
    main()
