"""Ageing or slip? Two laws with one linear response, distinguished by the mean under modulation.

Both have the friction of Eq. (1) of Bureau et al. (2000). The state grows at rest in the ageing
law, and changes only while the slider slips in the law of Ruina (1983):

    dPhi/dt = 1 - v Phi / D0        dPhi/dt = -(v Phi / D0) ln(v Phi / D0).
"""

import numpy as np

import asperity as asp


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
