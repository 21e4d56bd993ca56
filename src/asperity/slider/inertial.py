"""Equations of motion with inertia, radiation damping, or both.

    M dv/dt = F + S - F_i - eta v,      dF/dt = K (V p - v),

F the spring force, S an additional shear force, F_i = W F_i/W the interface force, eta v the force
that waves radiated into the half-spaces take (Rice, 1993), the substitute for inertia in models
of faults. With asperities of stiffness W/lambda, F_i/W is a further state,

    d(F_i/W)/dt = (v - v_pl) / lambda,

without dW/dt, and the equations are no longer stiff: the slider swings on the asperities near
sqrt(W0 / (lambda M)). Without asperities the friction law acts on v itself, and ln v is the state.

Source: Bureau et al. (2000), Eqs. (8), (26)-(29).
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from asperity.loads import Excitation
from asperity.slider.motion import Motion


class Damped(Motion):
    """Equations with the spring force F/W0 as the first state, and with radiation damping.

    Parameters
    ----------
    eta : array
        Radiation damping, force per velocity (N s/m); 0 for none.
    """

    eta: ArrayLike = 0.0

    @property
    def damping(self) -> Array:
        """Force of radiation damping at the pulling velocity, over W0."""
        return self.eta * self.V / self.slider.W0

    @property
    def mobility(self) -> Array:
        """W0 / (M V omega): gain of v/V per radian and unit force over W0."""
        return self.slider.W0 / (self.slider.M * self.V * self.omega)

    def force(self, Y: Array, at: Excitation) -> Array:
        """F/W0."""
        return Y[0]

    def _net_force(self, friction: Array, v: Array, Y: Array, at: Excitation) -> Array:
        """Force that accelerates the slider, over W0, at F_i/W and v/V."""
        return Y[0] + at.shear - at.w * friction - self.damping * v

    def mechanical_states(
        self, friction: Array, velocity: ArrayLike, log_slip: ArrayLike, at: Excitation
    ) -> tuple[ArrayLike, ...]:
        """As in `Motion`; the spring force balances friction and damping."""
        force = at.w * friction + self.damping * velocity - at.shear
        states = {
            "force": force,
            "velocity": velocity,
            "log_velocity": log_slip,
            "friction": friction,
        }
        return tuple(states[name] for name in self.mechanical)

    def log_slip(self, Y: Array, at: Excitation) -> Array:
        """ln(v_pl / V), where F_i/W is a state."""
        law = self.slider.law
        return law.log_velocity(self.friction(Y, at), self.law_state(Y), at.w) - jnp.log(self.V)


class _OnAsperities(Damped):
    """Elastic asperities: the state "friction" is F_i/W."""

    def friction(self, Y: Array, at: Excitation) -> Array:
        """F_i/W."""
        return Y[self.mechanical.index("friction")]

    @property
    def strain(self) -> Array:
        """V / (lambda omega): gain of F_i/W per radian while the slider moves at V on its joint."""
        return self.V / (self.slider.law.elastic_length * self.omega)

    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta."""
        v = self.slider_velocity(Y, at)
        slip = self.slip_velocity(self.friction(Y, at), Y, at)
        rates = [self.kappa * (at.pull - v), self.strain * (v - slip)]
        rates[1:1] = self._acceleration(Y, at)
        return jnp.stack(jnp.broadcast_arrays(*rates, *self._law_rates(v, slip, Y, at)))

    def _acceleration(self, Y: Array, at: Excitation) -> list[Array]:
        return []


class Inertial(_OnAsperities):
    """Inertia on elastic asperities; states Y = (F/W0, v/V, F_i/W, *law states)."""

    name: ClassVar[str] = "inertial"
    mechanical: ClassVar[tuple[str, ...]] = ("force", "velocity", "friction")
    logarithmic: ClassVar[tuple[bool, ...]] = (False, False, False)

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V."""
        return Y[1]

    def _acceleration(self, Y: Array, at: Excitation) -> list[Array]:
        return [self.mobility * self._net_force(Y[2], Y[1], Y, at)]


class RadiatingAsperities(_OnAsperities):
    """Radiation damping on elastic asperities, no mass; states Y = (F/W0, F_i/W, *law states)."""

    name: ClassVar[str] = "radiation-damped"
    mechanical: ClassVar[tuple[str, ...]] = ("force", "friction")
    logarithmic: ClassVar[tuple[bool, ...]] = (False, False)

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V."""
        return (Y[0] + at.shear - at.w * Y[1]) / self.damping


class StiffInertial(Damped):
    """Inertia without asperities; states Y = (F/W0, ln(v/V), *law states).

    Singularly perturbed: velocities relax at the rate A W / (M v), which grows without bound as
    v -> 0.
    """

    name: ClassVar[str] = "inertial"
    mechanical: ClassVar[tuple[str, ...]] = ("force", "log_velocity")
    logarithmic: ClassVar[tuple[bool, ...]] = (False, True)

    def reversal_margin(self, Y: Array, at: Excitation) -> Array:
        """As in `Motion`: F_i/W, because a slider on rigid asperities stops where it vanishes."""
        friction = self.friction(Y, at)
        return jnp.full_like(friction, jnp.inf) if self.signed else friction

    def log_slip(self, Y: Array, at: Excitation) -> Array:
        """ln(v / V), a state."""
        return Y[1]

    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V."""
        return jnp.exp(Y[1])

    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta."""
        v = jnp.exp(Y[1])
        friction = self.slider.law.friction(self.V * v, self.law_state(Y), at.w)
        net_force = self._net_force(friction, v, Y, at)
        rates = [self.kappa * (at.pull - v), self.mobility * net_force * jnp.exp(-Y[1])]
        return jnp.stack(jnp.broadcast_arrays(*rates, *self._law_rates(v, v, Y, at)))
