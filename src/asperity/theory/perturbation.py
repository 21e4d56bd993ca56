"""Exact first- and second-order response to a small modulation, for any law at any frequency.

Steady sliding Y0 is expanded in the amplitude of w = 1 + eps cos(theta)::

    Y = Y0 + eps Re(Y1 e^{i theta}) + eps^2 [Y20 + Re(Y22 e^{2i theta})] + O(eps^3)

With the rates R(Y, w, dw/dtheta), their Jacobian J in Y at steady sliding, and the first-order
direction u = (Y1, 1, i) of all three arguments (dw/dtheta = -sin theta = Re(i e^{i theta}))::

    (i - J)  Y1  = R'[0, 1, i]
       - J   Y20 = R''[u, u*] / 4
    (2i - J) Y22 = R''[u, u] / 4

R' and R'' are directional derivatives, taken by automatic differentiation, so that nothing here
depends on the law. The output F/W0 is expanded in the same way. The expansion holds while the slip
rate is weakly modulated, eps mu / A << 1 (Bureau et al. 2000, Eq. 24), which is far below the
amplitudes of most experiments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from asperity._jax import jit_large
from asperity.algebra.small_systems import solve_points, value_and_jacobian
from asperity.loads import Excitation
from asperity.parameters import DRIVE
from asperity.parameters.arguments import broadcast_shape, typed
from asperity.slider import Motion, Slider
from asperity.slider.problem import checked_problem

#: (Y, w, dw/dtheta): the three arguments of the rates.
RateArguments: TypeAlias = tuple[Array, Array, Array]


class PerturbedHarmonics(NamedTuple):
    """Response at one amplitude, to the order at which each quantity first appears.

    Attributes
    ----------
    delta_mu : array
        Mean of F/W0 minus its value in steady sliding.
    mu1, mu2 : array
        Peak amplitudes of the first and second harmonics of F/W0.
    phase1, phase2 : array
        Their phases in (-pi, pi]: F/W0 contains mu_n cos(n theta + phase_n).
    """

    delta_mu: Array
    mu1: Array
    mu2: Array
    phase1: Array
    phase2: Array


class PerturbationResponse(eqx.Module):
    """Coefficients of the expansion in eps, one per operating point.

    Attributes
    ----------
    transfer : complex array, shape (...)
        c1 / eps, with F/W0 = mean + sum Re(c_n e^{i n theta}).
    mean_curvature : array, shape (...)
        (mean - mean in steady sliding) / eps^2.
    second_harmonic : complex array, shape (...)
        c2 / eps^2.
    eigenvalues : complex array, shape (..., states)
        Growth rates of small disturbances of unmodulated sliding (1/s), fastest growing first;
        empty for a law without rate or state.
    omega : array, shape (...)
        Angular frequency of the modulation (rad/s).
    """

    transfer: Array
    mean_curvature: Array
    second_harmonic: Array
    eigenvalues: Array
    omega: Array

    @property
    def eigenvalues_per_radian(self) -> Array:
        """Growth rates per radian of the modulation, shape (..., states)."""
        return self.eigenvalues / self.omega[..., None]

    @property
    def multipliers(self) -> Array:
        """Floquet multipliers in the limit eps -> 0, shape (..., states)."""
        return self.omega.__array_namespace__().exp(2 * np.pi * self.eigenvalues_per_radian)

    @property
    def stable(self) -> Array:
        """Whether unmodulated sliding is stable, shape (...)."""
        return self.omega.__array_namespace__().all(self.eigenvalues.real < 0, axis=-1)

    def at(self, epsilon: ArrayLike) -> PerturbedHarmonics:
        """Leading-order response at the amplitude `epsilon` (broadcasts with the points)."""
        arrays = self.omega.__array_namespace__()
        first = arrays.asarray(DRIVE["epsilon"].check(epsilon, "epsilon"))
        second = first**2
        c1, c2 = first * self.transfer, second * self.second_harmonic
        return PerturbedHarmonics(
            delta_mu=second * self.mean_curvature,
            mu1=arrays.abs(c1),
            mu2=arrays.abs(c2),
            phase1=arrays.angle(c1),
            phase2=arrays.angle(c2),
        )


@typed
def perturbation_response(
    slider: Slider,
    *,
    velocity: object,
    frequency: object,
    inertia: bool = False,
    radiation_damping: object = None,
) -> PerturbationResponse:
    """First- and second-order response of a slider to a small harmonic modulation of its load.

    Parameters
    ----------
    slider : Slider
        Its parameters may be arrays; they broadcast with the two below.
    velocity : float, array or str
        Pulling velocity: SI (m/s), or text with its unit ("1 um/s").
    frequency : float, array or str
        Frequency of the modulation: SI (Hz), or text with its unit ("120 Hz").
    inertia : bool
        Whether the mass of the slider counts.
    radiation_damping : float, array or str, optional
        eta (N s/m), positive.

    Returns
    -------
    PerturbationResponse
        NumPy arrays. `perturb` is the same as a function that JAX differentiates.

    Raises
    ------
    InputError
        If the velocity or the frequency is not positive, or has a wrong unit; as
        `asperity.slider.equation_of_motion`.

    Examples
    --------
    >>> import asperity as asp
    >>> pmma = asp.materials.load("bureau2000")
    >>> slider = asp.Slider(pmma.law("rice-ruina"), spring="0.2 N/um", load=pmma.W0)
    >>> asp.perturbation_response(slider, velocity="1 um/s", frequency="120 Hz").transfer
    """
    problem = checked_problem(
        slider,
        velocity=velocity,
        epsilon=0.0,
        frequency=frequency,
        inertia=inertia,
        radiation_damping=radiation_damping,
    )
    return jax.tree.map(np.asarray, perturb(problem.system))


def perturb(system: Motion) -> PerturbationResponse:
    """First- and second-order response of an equation of motion.

    Parameters
    ----------
    system : Motion
        Its parameters broadcast against each other.

    Returns
    -------
    PerturbationResponse
        One operating point for each element of the broadcast leaves.

    Raises
    ------
    InputError
        If the shapes of the leaves do not broadcast.
    """
    shape = broadcast_shape("parameters", *jax.tree.leaves(system))
    # One axis of points, as the linear solver takes them.
    points = jax.tree.map(lambda x: jnp.broadcast_to(jnp.asarray(x, float), shape).ravel(), system)
    expand = _rate_independent if not system.slider.law.rate_dependent else _expand
    response = expand(points)
    return jax.tree.map(lambda leaf: leaf.reshape(shape + leaf.shape[1:]), response)


@jit_large
def _expand(system: Motion) -> PerturbationResponse:
    """Solve the three linear problems; every leaf of `system` has shape (points,)."""
    Y0 = system.steady()
    one = jnp.ones_like(Y0[0])
    steady: RateArguments = (Y0, one, jnp.zeros_like(one))

    def rates(point: RateArguments) -> Array:
        return system.rates(point[0], Excitation(*point[1:]))

    def force(point: RateArguments) -> Array:
        return system.force(point[0], Excitation(*point[1:]))[None]

    _, jacobian = value_and_jacobian(lambda Y: rates((Y, *steady[1:])), Y0)
    _, (force_gradient,) = value_and_jacobian(lambda Y: force((Y, *steady[1:])), Y0)
    load = (jnp.zeros_like(Y0) + 0j, one + 0j, 1j * one)
    Y1 = _harmonic_response(jacobian, _first(rates, steady, load), 1)
    u: RateArguments = (Y1, load[1], load[2])

    mean_forcing, double_forcing = _quadratic(rates, steady, u)
    mean_force, double_force = _quadratic(force, steady, u)
    Y20 = solve_points(-jacobian, mean_forcing)
    Y22 = _harmonic_response(jacobian, double_forcing, 2)
    return PerturbationResponse(
        transfer=_first(force, steady, u)[0],
        mean_curvature=mean_force[0] + (force_gradient * Y20).sum(0),
        second_harmonic=double_force[0] + (force_gradient * Y22).sum(0),
        eigenvalues=_eigenvalues(jacobian) * jnp.asarray(system.omega)[:, None],
        omega=jnp.asarray(system.omega),
    )


def _rate_independent(system: Motion) -> PerturbationResponse:
    """F = mu0 w: proportional to the load for any spring and frequency."""
    omega = jnp.asarray(system.omega)
    mu = system.slider.law.mu_ss(system.V)
    return PerturbationResponse(
        transfer=mu + 0j,
        mean_curvature=jnp.zeros_like(mu),
        second_harmonic=jnp.zeros_like(mu) + 0j,
        eigenvalues=jnp.zeros((*omega.shape, 0)) + 0j,
        omega=omega,
    )


def _harmonic_response(jacobian: Array, forcing: Array, harmonic: int) -> Array:
    """Solve (i n - J) Y = forcing at every point."""
    identity = jnp.eye(jacobian.shape[0])[:, :, None]
    return solve_points(1j * harmonic * identity - jacobian, forcing)


def _first(
    function: Callable[[RateArguments], Array], at: RateArguments, u: RateArguments
) -> Array:
    """Derivative of a real function along the complex direction `u`."""
    real, imaginary = _parts(u)
    return jax.jvp(function, (at,), (real,))[1] + 1j * jax.jvp(function, (at,), (imaginary,))[1]


def _quadratic(
    function: Callable[[RateArguments], Array], at: RateArguments, u: RateArguments
) -> tuple[Array, Array]:
    """Mean, and complex amplitude at 2 theta, of (1/2) function''[Re(u e^{i theta}), same]."""

    def second(first: RateArguments, then: RateArguments) -> Array:
        return jax.jvp(lambda point: jax.jvp(function, (point,), (first,))[1], (at,), (then,))[1]

    a, b = _parts(u)
    aa, ab, bb = second(a, a), second(a, b), second(b, b)
    return (aa + bb) / 4, (aa - bb + 2j * ab) / 4


def _parts(u: RateArguments) -> tuple[RateArguments, RateArguments]:
    """Real and imaginary parts of a complex direction."""
    return tuple(part.real for part in u), tuple(part.imag for part in u)


def _eigenvalues(jacobian: Array) -> Array:
    """Eigenvalues at every point, shape (points, size), by decreasing real part."""
    values = jnp.linalg.eigvals(jnp.moveaxis(jacobian, -1, 0))
    order = jnp.argsort(-values.real, axis=-1)
    return jnp.take_along_axis(values, order, axis=-1)
