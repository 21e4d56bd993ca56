"""Equation of motion without inertia: the interface force equals the spring force.

With f = F/W0, w = W/W0, theta = omega t and the plastic velocity v_pl that the law yields from
(F_i/W, state, w), the spring and the asperities are two springs in series with the sliding
interface. Their total elongation over W0/K,

    z = f + l F_i/W,      l = lambda K / W0,      dz/dtheta = kappa (p - v_pl / V),
    kappa = V K / (omega W0),

contains no dW/dt, so that z is continuous through a step of the load. p is the pulling velocity
over V. With an additional shear force s W0, F_i/W = (f + s) / w, and

    F_i/W = (z + s) / (w + l),      f = (z w - l s) / (w + l).

Source: Bureau et al. (2000), Eqs. (8) and (29) with M = 0.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.loads import Excitation
from asperity.slider.motion import Motion


class QuasiStatic(Motion):
    """Quasi-static sliding; states Y = (z, *law states)."""

    name: ClassVar[str] = "quasi-static"
    mechanical: ClassVar[tuple[str, ...]] = ("elongation",)
    logarithmic: ClassVar[tuple[bool, ...]] = (False,)

    def force(self, Y: Array, at: Excitation) -> Array:
        """F/W0."""
        ratio = self.compliance_ratio
        return (Y[0] * at.w - ratio * at.shear) / (at.w + ratio)

    def force_split(self, centre: Array, y: Array, at: Excitation) -> tuple[Array, Array]:
        """F/W0 at the centre under w = 1, and the remainder."""
        ratio = self.compliance_ratio
        constant = centre[0] / (1 + ratio)
        rest = (y[0] * at.w + ratio * (constant * (at.w - 1) - at.shear)) / (at.w + ratio)
        return constant, rest

    def friction(self, Y: Array, at: Excitation) -> Array:
        """F_i/W."""
        return (Y[0] + at.shear) * (1 / (at.w + self.compliance_ratio))

    def log_slip(self, Y: Array, at: Excitation) -> Array:
        """ln(v_pl / V)."""
        law = self.slider.law
        return law.log_velocity(self.friction(Y, at), self.law_state(Y), at.w) - jnp.log(self.V)

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V, from the plastic velocity and the strain rate of the asperities."""
        return self._velocity(Y, at, self.slip_velocity(self.friction(Y, at), Y, at))

    def mechanical_states(
        self, friction: Array, velocity: ArrayLike, log_slip: ArrayLike, at: Excitation
    ) -> tuple[ArrayLike, ...]:
        """Total elongation z."""
        return (friction * (at.w + self.compliance_ratio) - at.shear,)

    def _velocity(self, Y: Array, at: Excitation, slip: Array) -> Array:
        ratio = self.compliance_ratio
        # The divisor depends on the excitation only, so that it is computed once per step.
        per_stiffness = 1 / (at.w + ratio)
        scale = ratio / self.kappa * per_stiffness
        load_rate = scale * per_stiffness * at.w_slope
        loading = (at.pull * ratio + slip * at.w) * per_stiffness
        return loading + scale * at.shear_slope - (Y[0] + at.shear) * load_rate

    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta."""
        slip = self.slip_velocity(self.friction(Y, at), Y, at)
        z_rate = self.kappa * (at.pull - slip)
        v = self._velocity(Y, at, slip)
        return jnp.stack(jnp.broadcast_arrays(z_rate, *self._law_rates(v, slip, Y, at)))
