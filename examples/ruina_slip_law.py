"""A friction law written outside the package: Ruina's slip law.

Friction as in Rice-Ruina (Eq. 1 of Bureau et al. 2000); the state moves only while the slider
slips, whereas in the ageing law it grows at rest, too:

    dPhi/dt = -(v Phi / D0) ln(v Phi / D0).

The law's equations are all there is to write:
periodic response, stability and linear response come with the package.
"""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np

import asperity as asp
from asperity.laws import Law, parameter, register


@register
class RuinaSlip(Law):
    """Rice-Ruina friction with the slip law (Ruina 1983); state: ``phi = ln(V0 Phi / D0)``."""

    name: ClassVar[str] = "ruina-slip"
    source: ClassVar[str] = "ruina1983"
    state_names: ClassVar[tuple[str, ...]] = ("log_age",)

    mu0: float = parameter("law.mu0", "dimensionless")
    A: float = parameter("law.A", "dimensionless")
    B: float = parameter("law.B", "dimensionless")
    D0: float = parameter("law.D0", "length")
    V0: float = parameter("law.V0", "velocity")

    def friction(self, v, state, w):
        """F/W = mu0 + A ln(v/V0) + B phi."""
        return self.mu0 + self.A * jnp.log(v / self.V0) + self.B * state[0]

    def state_rate(self, v, v_plastic, state, w):
        """dphi/dt = -(v/D0) [phi + ln(v/V0)]."""
        return (-v_plastic / self.D0 * (state[0] + jnp.log(v_plastic / self.V0)),)

    def steady_state(self, v):
        """Phi = D0/v."""
        return (-jnp.log(v / self.V0),)


def main():
    parameters = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": "0.4 um", "V0": "1 um/s"}
    sliders = {
        name: asp.Slider(
            asp.laws.get_law(name)(**parameters), spring="0.2 N/um", load="7 N", mass="1.6 kg"
        )
        for name in ("rice-ruina", "ruina-slip")
    }
    point = {"velocity": "1 um/s", "frequency": "120 Hz"}
    epsilon = np.array([0.05, 0.10, 0.15, 0.24])

    print("linear response and stability of unmodulated sliding")
    for name, slider in sliders.items():
        small = asp.perturbation_response(slider, **point)
        growth = small.eigenvalues.real.max()
        print(
            f"  {name:10}  |c1|/eps = {abs(small.transfer):.4e}"
            f"  delta_mu/eps^2 = {small.mean_curvature:.4f}  growth rate = {growth:+.4f} 1/s"
        )

    print("periodic response")
    for name, slider in sliders.items():
        response = asp.periodic_response(slider, epsilon=epsilon, **point)
        leading = np.abs(response.multipliers).max(-1)
        for i, eps in enumerate(epsilon):
            print(
                f"  {name:10}  eps = {eps:.2f}  delta_mu = {response.delta_mu[i]:.5f}"
                f"  mu1 = {response.mu1[i]:.3e}  mu2 = {response.mu2[i]:.3e}"
                f"  |multiplier| = {leading[i]:.5f}  {response.result[i]}"
            )


if __name__ == "__main__":
    main()
