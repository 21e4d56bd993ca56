"""The compiled programs of a law: its equation of motion at single phases, with derivatives.

Solvers of orbits on meshes work on these arrays, independent of the law. A program works on
`ROWS` phases of all operating points, so that one serves all meshes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import value_and_jacobian
from asperity.arrays import Float
from asperity.loads import Excitation, Modulation
from asperity.slider.motion import Motion
from asperity.slider.problem import Problem

#: Phases in a call: the collocation points of 72 intervals.
ROWS = 288


class PointValues(NamedTuple):
    """An equation of motion at phases and states of any shape (...).

    Attributes
    ----------
    rates : array, shape (size, ...)
        dY/dtheta.
    jacobian : array, shape (size, size, ...)
        [row, column]: derivatives of the rates to the states.
    log_slip : array, shape (...)
        ln(v_pl/V).
    slip_gradient : array, shape (size, ...)
        Derivatives of `log_slip` to the states.
    force_mean, force_rest : array, shape (...)
        F/W0 as a constant and a remainder, as from `Motion.force_split`.
    reversal_margin : array, shape (...)
        As from `Motion.reversal_margin`.
    """

    rates: Array
    jacobian: Array
    log_slip: Array
    slip_gradient: Array
    force_mean: Array
    force_rest: Array
    reversal_margin: Array

    @property
    def force(self) -> Array:
        """F/W0."""
        return self.force_mean + self.force_rest


_excitation = jax.jit(lambda load, theta: load.at(theta))


@cache
def _values(structure: Any) -> Callable[..., PointValues]:
    """The program for an equation of motion of a tree structure, whose arrays come as a list.

    JAX takes a list apart in a tenth of the time that it needs for the modules of a slider.
    """

    def values(numbers: list[Array], at: Any, centre: Array, deviations: Array) -> PointValues:
        system, at = jax.tree.unflatten(structure, numbers), Excitation(*at)
        centre = centre[:, None]

        def rates_and_slip(Y: Array) -> Array:
            return jnp.concatenate([system.rates(Y, at), system.log_slip(Y, at)[None]])

        Y = centre + deviations
        values, slopes = value_and_jacobian(rates_and_slip, Y)
        parts = *system.force_split(centre, deviations, at), system.reversal_margin(Y, at)
        others = (a * jnp.ones_like(values[0]) for a in parts)
        return PointValues(values[:-1], slopes[:-1], values[-1], slopes[-1], *others)

    return jit_large(values)


@jit_large
def _slopes(
    problem: Problem, directions: Problem, theta: Array, states: Array
) -> tuple[Array, Array, Array]:
    def rates_and_force(problem: Problem, Y: Array) -> tuple[Array, Array]:
        at = problem.load.at(theta)
        return problem.system.rates(Y, at), problem.system.force(Y, at)

    _, push = jax.linearize(lambda problem: rates_and_force(problem, states), problem)
    # Phases and points do not depend on each other: the gradient of the sum holds the derivative at
    # each phase and point.
    gradient = jax.grad(lambda Y: rates_and_force(problem, Y)[1].sum())(states)
    return *jax.vmap(push)(directions), gradient


@jit_large
def _curvature(
    problem: Problem,
    direction: Problem,
    theta: Array,
    states: Array,
    change: Array,
    vector: Array,
) -> Array:
    def jacobian_times_vector(problem: Problem, Y: Array) -> Array:
        at = problem.load.at(theta)
        return jax.jvp(lambda Y: problem.system.rates(Y, at), (Y,), (vector,))[1]

    return jax.jvp(jacobian_times_vector, (problem, states), (direction, change))[1]


def excitation_at(load: Modulation, theta: Float) -> Excitation:
    """The excitation at phases of shape (..., points), for NumPy arrays."""
    return _by_rows(partial(_excitation, load), theta)


def values_at(system: Motion, at: Excitation, centre: Any, deviations: Float) -> PointValues:
    """The equation of motion at the states `centre + deviations`, for NumPy arrays.

    Parameters
    ----------
    system : Motion
        Parameters of shape (points,).
    at : Excitation
        Arrays of shape (..., points), as `excitation_at` returns them.
    centre : array, shape (size, points)
    deviations : array, shape (size, ..., points)
        States minus the centre, so that small deviations keep their digits.
    """
    numbers, structure = jax.tree.flatten(system)
    program = _values(structure)

    def values(at: Any, deviations: Any) -> PointValues:
        return program(numbers, at, centre, deviations)

    return _by_rows(values, tuple(at), deviations)


def slopes_along(
    problem: Problem, directions: Problem, theta: Float, states: Float
) -> tuple[Float, Float, Float]:
    """Derivatives along directions of the parameters, and those of the force to the states.

    Parameters
    ----------
    problem : Problem
        Parameters of shape (points,).
    directions : Problem
        How they change, arrays (directions, points).
    theta : array, shape (..., points)
    states : array, shape (size, ..., points)

    Returns
    -------
    rates : array, shape (directions, size, ..., points)
    force : array, shape (directions, ..., points)
        Derivatives of F/W0 along the directions.
    gradient : array, shape (size, ..., points)
        Derivatives of F/W0 with respect to the states.
    """
    return _by_rows(partial(_slopes, problem, directions), theta, states)


def curvature_along(
    problem: Problem,
    direction: Problem,
    theta: Float,
    states: Float,
    change: Float,
    vector: Float,
) -> Float:
    """Derivative of the product of the Jacobian with `vector`, (size, ..., points).

    Parameters
    ----------
    problem, direction : Problem
        Parameters of shape (points,), and how they change.
    theta : array, shape (..., points)
    states, change, vector : array, shape (size, ..., points)
        States, how they change, and the vector.
    """
    return _by_rows(partial(_curvature, problem, direction), theta, states, change, vector)


def _by_rows(function: Callable[..., Any], *trees: Any) -> Any:
    """Apply a function to arrays (..., rows, points) in blocks of `ROWS` rows.

    The first tree has arrays (*shape, points), the others may have further axes in front; arrays
    without axes are passed on. The last block is filled up with its last row.
    """
    leaves, structure = jax.tree.flatten(trees)
    lead = next(a for a in leaves if np.ndim(a))
    shape, points = lead.shape[:-1], lead.shape[-1]
    rows = math.prod(shape)
    flat = [
        a.reshape(*a.shape[: a.ndim - lead.ndim], rows, points) if np.ndim(a) else a for a in leaves
    ]
    parts = []
    for start in range(0, rows, ROWS):
        chosen: Any = slice(start, start + ROWS)
        if start + ROWS > rows:
            chosen = np.minimum(np.arange(start, start + ROWS), rows - 1)
        cut = [a[..., chosen, :] if np.ndim(a) else a for a in flat]
        parts.append(function(*jax.tree.unflatten(structure, cut)))

    def joined(*blocks: Any) -> Any:
        whole = np.asarray(blocks[0])
        if not whole.ndim:
            return whole
        if len(blocks) > 1:
            whole = np.concatenate(blocks, axis=-2)
        whole = whole[..., :rows, :]
        return whole.reshape(*whole.shape[:-2], *shape, points)

    return jax.tree.map(joined, *parts)
