"""Equation of motion without inertia: the interface force equals the spring force.

With f = F/W0, w = W/W0, theta = omega t and the plastic velocity v_pl that the law yields from
(f/w, state, w), the spring and the asperities are two springs in series with the
joint. Their joint elongation over W0/K,

    z = f (1 + l / w),      l = lambda K / W0,      dz/dtheta = kappa (1 - v_pl / V),
    kappa = V K / (omega W0),

contains no dW/dt, so that z is continuous through a step of the load. From z follow

    f = z w / (w + l),      dx/dt = V - (omega W0 / K) df/dtheta.

Source: Bureau et al. (2000), Eqs. (8) and (29) with M = 0.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.slider.slider import Slider


class QuasiStatic(eqx.Module):
    """Rates of the states Y = (z, *law states) per radian of the modulation.

    Parameters
    ----------
    slider : Slider
        Law, spring stiffness K (N/m) and mean load W0 (N).
    V : array
        Pulling velocity (m/s).
    omega : array
        Angular frequency of the modulation (rad/s).
    """

    slider: Slider
    V: ArrayLike
    omega: ArrayLike

    @property
    def size(self) -> int:
        """Number of states."""
        return 1 + len(self.slider.law.state_names)

    @property
    def compliance_ratio(self) -> Array:
        """L = lambda K / W0: stiffness of the spring over that of the asperities."""
        return self.slider.law.elastic_length * self.slider.K / self.slider.W0

    @property
    def kappa(self) -> Array:
        """Spring force gained per radian while the slider sticks, over W0."""
        return self.V * self.slider.K / (self.omega * self.slider.W0)

    def steady(self) -> Array:
        """States of steady sliding under constant load, shape (size, ...)."""
        law = self.slider.law
        z = law.mu_ss(self.V) * (1 + self.compliance_ratio)
        return jnp.stack(jnp.broadcast_arrays(z, *law.steady_state(self.V)))

    def force(self, Y: Array, w: ArrayLike) -> Array:
        """Spring force over W0, F/W0."""
        return Y[0] * w / (w + self.compliance_ratio)

    def force_split(self, centre: Array, y: Array, w: ArrayLike) -> tuple[Array, Array]:
        """F/W0 at Y = centre + y as a constant plus a rest that is small when y is.

        The split keeps the relative accuracy of harmonics that are many orders of magnitude
        smaller than the mean.
        """
        ratio = self.compliance_ratio
        constant = centre[0] / (1 + ratio)
        rest = (y[0] * w + constant * ratio * (w - 1)) / (w + ratio)
        return constant, rest

    def log_slip(self, Y: Array, w: ArrayLike) -> Array:
        """ln(v_pl / V), the exponent that makes the equations stiff."""
        f_over_w = Y[0] * (1 / (w + self.compliance_ratio))
        return self.slider.law.log_velocity(f_over_w, tuple(Y[1:]), w) - jnp.log(self.V)

    def rates(self, Y: Array, w: ArrayLike, w_slope: ArrayLike) -> Array:
        """dY/dtheta, same shape as Y.

        Parameters
        ----------
        Y : array, shape (size, ...)
        w, w_slope : arrays
            W/W0 and its derivative with respect to theta.
        """
        law, ratio = self.slider.law, self.compliance_ratio
        # Of the load alone: loops over the states divide once, before they start.
        per_stiffness = 1 / (w + ratio)
        load_rate = ratio / self.kappa * w_slope * per_stiffness**2
        slip = jnp.exp(self.log_slip(Y, w))
        z_rate = self.kappa * (1 - slip)
        v = self.V * (1 - (1 - slip) * (w * per_stiffness) - Y[0] * load_rate)
        state_rates = law.state_rate(v, self.V * slip, tuple(Y[1:]), w)
        return jnp.stack([z_rate, *(r / self.omega for r in state_rates)])
