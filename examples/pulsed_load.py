"""A load written outside the package: pulses that never lose contact.

    W / W0 = exp(a cos theta) / I_0(a),      theta = omega t,

with the mean 1 and positive for any a. The harmonics are 2 I_n(a) / I_0(a), with the modified
Bessel functions I_n; for small a the load is harmonic, with epsilon = a.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import i0, i1
from jax.typing import ArrayLike

import asperity as asp
from asperity.loads import Excitation, Modulation, sampled


class Pulses(Modulation):
    """Pulses of the load; a larger `a` makes them sharper."""

    a: ArrayLike

    def at(self, theta: ArrayLike) -> Excitation:
        """Load and slope at the phase `theta` (rad)."""
        w = jnp.exp(self.a * jnp.cos(theta)) / i0(self.a)
        return Excitation(w, w_slope=-self.a * jnp.sin(theta) * w)

    @property
    def amplitude(self) -> Array:
        """Amplitude of the first harmonic of W/W0."""
        return 2 * i1(self.a) / i0(self.a)

    @property
    def formula(self) -> str:
        """What is modulated and how, as a text for provenance."""
        return "w(t) = exp(a cos(w t)) / I0(a)"

    def scaled(self, share: ArrayLike) -> "Pulses":
        """The modulation with `share` of its strength: 0 is steady sliding."""
        return Pulses(self.a * share)


def main():
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("elasto-plastic"), spring=pmma.K, load=pmma.W0)
    drive = {"velocity": "1 um/s", "frequency": "120 Hz"}
    theta = 2 * np.pi * np.arange(64) / 64
    for name, load in {
        "pulses": Pulses(0.5),
        "the same, sampled": sampled(np.asarray(Pulses(0.5).at(theta).w)),
        "weak pulses": Pulses(0.01),
    }.items():
        r = asp.periodic_response(slider, modulation=load, **drive)
        print(f"{name:18} drop {r.delta_mu:.6f}  mu1 {r.mu1:.4e}")


if __name__ == "__main__":
    main()
