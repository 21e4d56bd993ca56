"""The interface between solvers and equations of motion."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity.algebra.small_systems import value_and_jacobian
from asperity.arrays import Bool
from asperity.laws import Law
from asperity.loads import Excitation
from asperity.slider.slider import Slider
from asperity.slider.steady_state import steady_state

#: Slip rate over V, in either direction, that changes no result by more than a hundredth of the
#: accuracy that is promised, 1e-8.
_NEGLIGIBLE_SLIP = 1e-10


class Motion(eqx.Module):
    """Rates of the states Y per radian of the modulation, for one law, slider and drive.

    The states begin with mechanical ones and end with those of the law. With omega = 1 rad/s
    a radian is a second, and the same equations serve for transients.

    Class attributes
    ----------------
    name : str
        Name of the equation of motion in results.
    mechanical : tuple of str
        Names of the mechanical states.
    logarithmic : tuple of bool
        Which mechanical states are logarithms, as the law's states are.

    Parameters
    ----------
    slider : Slider
    V : array
        Pulling velocity (m/s): where it is modulated, its mean.
    omega : array
        Angular frequency of the modulation (rad/s).
    """

    name: ClassVar[str]
    mechanical: ClassVar[tuple[str, ...]]
    logarithmic: ClassVar[tuple[bool, ...]]

    slider: Slider
    V: ArrayLike
    omega: ArrayLike

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.mechanical) + len(self.slider.law.state_names)

    @property
    def has_elastic_asperities(self) -> bool:
        """Whether lambda is in the equations; with inertia or damping rigid asperities lack it."""
        return not {"elongation", "friction"}.isdisjoint(self.mechanical)

    @property
    def damping(self) -> ArrayLike:
        """Force of radiation damping at the pulling velocity, over W0."""
        return 0.0

    @property
    def logarithms(self) -> Bool:
        """Mask of the states that are logarithms: those of the law are, shape (size,)."""
        of_law = [True] * (self.size - len(self.logarithmic))
        return np.array([*self.logarithmic, *of_law])

    @property
    def kappa(self) -> Array:
        """Spring force gained per radian while the slider sticks, over W0."""
        return self.V * self.slider.K / (self.omega * self.slider.W0)

    @property
    def compliance_ratio(self) -> Array:
        """The ratio l = lambda K / W0: stiffness of the spring over that of the asperities."""
        return self.slider.law.elastic_length * self.slider.K / self.slider.W0

    @property
    def signed(self) -> bool:
        """Whether the law is defined at rest and in reversed motion."""
        return type(self.slider.law).velocity is not Law.velocity

    def law_state(self, Y: Array) -> tuple[Array, ...]:
        """The law's states."""
        return tuple(Y[len(self.mechanical) :])

    def steady(self) -> Array:
        """States of steady sliding under constant load, shape (size, ...)."""
        law = self.slider.law
        mechanical = self.mechanical_states(law.mu_ss(self.V), 1.0, 0.0, Excitation(jnp.ones(())))
        return jnp.stack(jnp.broadcast_arrays(*mechanical, *law.steady_state(self.V)))

    def steady_under(self, at: Excitation) -> Array:
        """States of steady sliding under the load and at the pull of `at`, shape (size, ...)."""
        law, v = self.slider.law, jnp.asarray(self.V * at.pull * jnp.ones_like(at.w))
        state = steady_state(law, v, at.w)
        friction = law.friction(v, state, at.w)
        mechanical = self.mechanical_states(friction, at.pull, jnp.log(at.pull), at)
        return jnp.stack(jnp.broadcast_arrays(*mechanical, *state))

    @abstractmethod
    def force(self, Y: Array, at: Excitation) -> Array:
        """Spring force over W0, F/W0."""

    def force_split(self, centre: Array, y: Array, at: Excitation) -> tuple[Array, Array]:
        """F/W0 at Y = centre + y as a constant plus a remainder that is small when y is small.

        The split keeps the relative accuracy of harmonics that are many orders of magnitude
        smaller than the mean.
        """
        return centre[0], y[0]

    def friction(self, Y: Array, at: Excitation) -> Array:
        """F_i/W."""
        v = self.V * self.slider_velocity(Y, at)
        return self.slider.law.friction(v, self.law_state(Y), at.w)

    def reversal_margin(self, Y: Array, at: Excitation) -> Array:
        """Negative where a law without backward slip should have some; inf if the law has.

        That is where a law that is odd in F_i, as 'regularised' is, would slip backwards. A small
        negative force, such as that of a slider that swings on its asperities, causes no slip in
        either direction: ln v_pl is below that of steady sliding by (mu - |F_i|/W)/A.
        """
        friction, law = self.friction(Y, at), self.slider.law
        if self.signed:
            return jnp.full_like(friction, jnp.inf)
        backwards = law.log_velocity(jnp.abs(friction), self.law_state(Y), at.w) - jnp.log(self.V)
        return jnp.maximum(friction, np.log(_NEGLIGIBLE_SLIP) - backwards)

    @abstractmethod
    def log_slip(self, Y: Array, at: Excitation) -> Array:
        """ln(v_pl / V), the exponent that makes the equations stiff."""

    def slip_velocity(self, friction: Array, Y: Array, at: Excitation) -> Array:
        """v_pl over V where the interface carries F_i/W = `friction`; signed if the law is."""
        law = self.slider.law
        if self.signed:
            return law.velocity(friction, self.law_state(Y), at.w) / self.V
        return jnp.exp(self.log_slip(Y, at))

    @abstractmethod
    def slider_velocity(self, Y: Array, at: Excitation) -> Array:
        """dx/dt over V; may be negative."""

    @abstractmethod
    def mechanical_states(
        self, friction: Array, velocity: ArrayLike, log_slip: ArrayLike, at: Excitation
    ) -> tuple[ArrayLike, ...]:
        """The mechanical states from F_i/W, v/V and ln(v_pl/V), without inertia."""

    @abstractmethod
    def rates(self, Y: Array, at: Excitation) -> Array:
        """dY/dtheta, same shape as Y, (size, ...)."""

    def _law_rates(self, v: ArrayLike, slip: ArrayLike, Y: Array, at: Excitation) -> list[Array]:
        """Rates of the law's states per radian, for the velocities dx/dt and v_pl over V."""
        law = self.slider.law
        rates = law.state_rate(self.V * v, self.V * slip, self.law_state(Y), at.w)
        return [r / self.omega for r in rates]

    def steady_jacobian(self) -> Array:
        """Derivatives [row, column] of the rates in steady sliding, shape (size, size, points)."""
        steady = self.steady()
        at = Excitation(jnp.ones(steady.shape[1:]))
        return value_and_jacobian(lambda Y: self.rates(Y, at), steady)[1]

    def inertness(self, Y: Array, at: Excitation) -> ArrayLike:
        """Factors, shape as Y, that make the rates times them as linear in Y as possible.

        Newton's method for a stiff step needs it where a rate relaxes faster by orders of
        magnitude at one end of the step than at the other.
        """
        return 1.0
