"""Derivatives of a periodic response with respect to every parameter.

By the implicit function theorem: with R(Y, p) = 0 the equations of the orbit, one Newton step

    N(Y, p) = Y - R_Y^-1 R(Y, p)

from a converged orbit Y* has the derivative dN/dp = -R_Y^-1 R_p = dY*/dp. So the step and
everything read off its result are differentiated, and no derivative of an iteration is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike
from numpy.typing import NDArray

from asperity.laws import law_parameters
from asperity.slider import QuasiStatic, Slider
from asperity.solve.batch import run_chunks, take
from asperity.solve.collocation import CollocationResponse, collocation_response, newton_update
from asperity.solve.kernels import ACCEPTED, Problem, refine_orbit
from asperity.solve.mesh import Orbit
from asperity.solve.multipliers import chunk_size
from asperity.solve.periodic import checked_problem, flatten
from asperity.solve.starts import starting_orbits

#: Orbits are differentiated on this mesh.
_INTERVALS = 144

_SCALARS = ("mean_friction", "mu1", "mu2", "phase1", "phase2")


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives at one or many operating points.

    Attributes
    ----------
    parameters : tuple of str
        Names, in the order of the last axis: those of the law, then K, W0, M, V, frequency, eta
        (with inertia or radiation damping only) and epsilon.
    converged : bool array, shape (...)
        False where no orbit was found; the derivatives there are NaN.
    mean_friction, mu1, mu2, phase1, phase2 : array, shape (..., parameters)
        d(output)/d(parameter) in SI; phases in rad.
    log_multipliers : complex array, shape (..., states, parameters)
        Derivatives of ln|m| + i arg m, sorted as in `PeriodicResponse`.
    """

    parameters: tuple[str, ...]
    converged: NDArray[np.bool_]
    mean_friction: NDArray[np.float64]
    mu1: NDArray[np.float64]
    mu2: NDArray[np.float64]
    phase1: NDArray[np.float64]
    phase2: NDArray[np.float64]
    log_multipliers: NDArray[np.complex128]


def sensitivities(
    slider: Slider,
    *,
    velocity: ArrayLike | str,
    epsilon: ArrayLike | str,
    frequency: ArrayLike | str,
    inertia: bool = False,
    radiation_damping: ArrayLike | str | None = None,
) -> Sensitivities:
    """Derivatives of mean, harmonics and multipliers with respect to every parameter.

    Parameters
    ----------
    slider : Slider
        With a rate-dependent law.
    velocity, epsilon, frequency, inertia, radiation_damping
        As in `periodic_response`; arrays broadcast.

    Returns
    -------
    Sensitivities

    Raises
    ------
    InputError
        As `periodic_response`.
    """
    asked = checked_problem(
        slider,
        velocity=velocity,
        epsilon=epsilon,
        frequency=frequency,
        inertia=inertia,
        radiation_damping=radiation_damping,
    )
    problem, shape = flatten(asked)
    points = int(np.prod(shape, dtype=int))
    start = starting_orbits(problem, points)
    damping = () if isinstance(problem.system, QuasiStatic) else ("eta",)
    drive = ("K", "W0", "M", "V", "frequency", *damping, "epsilon")
    names = (*law_parameters(type(slider.law)), *drive)
    size = problem.system.size
    outputs = np.full((len(names), len(_SCALARS) + size, points), np.nan, dtype=complex)
    converged = np.zeros(points, dtype=bool)
    for part, (values, tangents, error) in run_chunks(
        _differentiate,
        (problem, start.orbit),
        np.flatnonzero(start.found),
        chunk_size(_INTERVALS, size),
    ):
        converged[part] = error < ACCEPTED
        kept = np.flatnonzero(error < ACCEPTED)
        outputs[..., part[kept]] = _outputs(take(values, kept), take(tangents, kept))
    outputs[names.index("frequency")] *= 2 * np.pi  # the equations know omega
    table = np.moveaxis(outputs, (0, 2), (-1, 0)).reshape(*shape, -1, len(names))
    scalars = {name: table[..., i, :].real for i, name in enumerate(_SCALARS)}
    return Sensitivities(
        parameters=names,
        converged=converged.reshape(shape),
        log_multipliers=table[..., len(_SCALARS) :, :],
        **scalars,
    )


@jax.jit
def _differentiate(inputs: tuple[Problem, Orbit]) -> tuple[CollocationResponse, Any, Array]:
    """Readings, their derivatives along every parameter, and the error of the orbit."""
    problem, guess = inputs
    orbit, _, error = refine_orbit((problem, guess), intervals=_INTERVALS, harmonics=2, phases=0)
    leaves, structure = jax.tree.flatten(problem)

    def reading(*leaves: Array) -> CollocationResponse:
        system, load = jax.tree.unflatten(structure, leaves)
        return collocation_response(system, load, newton_update(system, load, orbit), harmonics=2)

    values, push = jax.linearize(reading, *leaves)
    unit = jnp.eye(len(leaves))
    directions = [unit[:, i, None] * jnp.ones_like(leaf) for i, leaf in enumerate(leaves)]
    return values, jax.vmap(push)(*directions), error


def _outputs(values: CollocationResponse, tangents: CollocationResponse) -> NDArray[np.complex128]:
    """Derivatives (parameters, outputs, points) of the scalars and of the multipliers' logs."""
    first, second = (tangents.harmonics[:, i] / values.harmonics[i] for i in (0, 1))
    amplitude = np.abs(values.harmonics)
    scalars = [
        tangents.mean_friction,
        first.real * amplitude[0],
        second.real * amplitude[1],
        first.imag,
        second.imag,
    ]
    return np.concatenate([np.stack(scalars, axis=1), _multiplier_logs(values, tangents)], axis=1)


def _multiplier_logs(
    values: CollocationResponse, tangents: CollocationResponse
) -> NDArray[np.complex128]:
    """First-order perturbation of the eigenvalues: dm = (left . dM right) / (left . right)."""
    monodromy = np.moveaxis(values.monodromy, -1, 0)
    eigenvalues, right = np.linalg.eig(monodromy)
    order = np.argsort(-np.abs(eigenvalues), axis=-1, kind="stable")
    eigenvalues = np.take_along_axis(eigenvalues, order, axis=-1)
    right = np.take_along_axis(right, order[:, None, :], axis=-1)
    left = np.linalg.inv(right)
    change = np.moveaxis(tangents.monodromy, -1, 1)  # (parameters, points, n, n)
    moved = np.einsum("bki,pbij,bjk->pkb", left, change, right) / eigenvalues.T
    return moved + tangents.log_scale[:, None]
