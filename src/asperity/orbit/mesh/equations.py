"""The collocation equations of orbits on meshes, linearised and condensed.

The law's part comes from `asperity.slider.pointwise`, one compiled program for each law; the
condensation is one for each number of states, whatever the mesh.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.loads import Excitation
from asperity.orbit.mesh.condensation import condense
from asperity.orbit.mesh.mesh import Orbit
from asperity.slider.pointwise import PointValues, excitation_at, slopes_along, values_at
from asperity.slider.problem import Problem

Float = NDArray[np.float64]

#: Intervals that are condensed in a call, of few and of many.
_FEW, _MANY = 576, 1728

_condense = jit_large(condense)


class CondensedEquations(NamedTuple):
    """The linearised equations of orbits.

    Attributes
    ----------
    values : PointValues
        At the collocation points, arrays of shape (..., STAGES, intervals, points).
    response : array, shape (n, STAGES, n, intervals, points)
        Change of the slopes for a change at the left node.
    constant : array, shape (n, STAGES, sides, intervals, points)
        Change of the slopes for each right-hand side.
    """

    values: PointValues
    response: Float
    constant: Float


def collocated(problem: Problem, orbit: Orbit, at: Excitation | None = None) -> PointValues:
    """The equation of motion at the collocation points of an orbit.

    Parameters
    ----------
    problem : Problem
        NumPy arrays (points,).
    orbit : Orbit
    at : Excitation, optional
        At the collocation points, where it is known.
    """
    at = excitation_at(problem.load, orbit.stage_phases) if at is None else at
    return values_at(problem.system, at, orbit.centre, orbit.stage_deviations)


def parameter_slopes(problem: Problem, direction: Problem, orbit: Orbit) -> Float:
    """Derivative of the rates at the collocation points along a direction of the parameters."""
    states = orbit.stage_states
    return slopes_along(problem, direction, orbit.stage_phases, states, np.zeros_like(states))[0]


def condensed(
    problem: Problem,
    orbit: Orbit,
    direction: Problem | None = None,
    *,
    at: Excitation | None = None,
    closed: bool = True,
) -> CondensedEquations:
    """The equations of an orbit, linearised and condensed.

    Parameters
    ----------
    problem : Problem
        NumPy arrays (points,).
    orbit : Orbit
    direction : Problem, optional
        Of the parameters, for a second right-hand side.
    at : Excitation, optional
        As in `collocated`.
    closed : bool
        Whether the first right-hand side is the defect of the equations, or zero.
    """
    values = collocated(problem, orbit, at)
    right = np.zeros((*orbit.slopes.shape[:2], 1 + (direction is not None), *orbit.widths.shape))
    if closed:
        right[:, :, 0] = values.rates - orbit.slopes
    if direction is not None:
        right[:, :, 1] = parameter_slopes(problem, direction, orbit)
    return CondensedEquations(values, *condensed_jacobian(values.jacobian, right, orbit))


def condensed_jacobian(jacobian: Float, right: Float, orbit: Orbit) -> tuple[Float, Float]:
    """`condense` of NumPy arrays (..., intervals, points) on the mesh of an orbit."""
    a, shape = np.asarray(orbit.scheme.a), orbit.widths.shape
    block = _FEW if shape[0] * shape[1] <= _FEW else _MANY
    jacobian, right, widths = (_flat(a, block) for a in (jacobian, right, orbit.widths))
    solved = []
    for start in range(0, widths.shape[-1], block):
        at = slice(start, start + block)
        solved.append(_condense(jacobian[..., at], right[..., at], widths[at], a))
    response, constant = (_joined(parts, shape) for parts in zip(*solved, strict=True))
    return response, constant


def _flat(array: Float, block: int) -> Float:
    """Intervals and points along one axis, filled up to whole blocks with the last interval."""
    flat = np.reshape(array, (*array.shape[:-2], -1))
    missing = -flat.shape[-1] % block
    if not missing:
        return flat
    filling = np.broadcast_to(flat[..., -1:], (*flat.shape[:-1], missing))
    return np.concatenate([flat, filling], axis=-1)


def _joined(parts: tuple[Any, ...], shape: tuple[int, ...]) -> Float:
    """Blocks as one array (..., intervals, points)."""
    whole = np.asarray(parts[0]) if len(parts) == 1 else np.concatenate(parts, axis=-1)
    return whole[..., : shape[0] * shape[1]].reshape(*whole.shape[:-1], *shape)
