"""Variational equations: derivatives of a motion with respect to initial states and parameters.

Along a motion Y(t) with the rates f(Y, p) the derivatives D obey the linear equations

    dD/dt = f_Y D + f_p,

with a column of D for each initial state, which begins as a column of the unit matrix, and for each
parameter, which begins at 0. Only columns of parameters have the term f_p. The equations are solved
by Radau collocation with five stages on the steps of the motion. Where the implicit method took
these steps, the results are the exact derivatives of the steps at fixed lengths; elsewhere their
error is that of a method of order 9.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section I.14.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import jax
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.runge_kutta import radau_iia
from asperity.algebra.small_systems import value_and_jacobian
from asperity.arrays import Float
from asperity.loads import Excitation
from asperity.slider import Motion
from asperity.slider.parameters import equation_parameters, with_value
from asperity.slider.problem import Problem
from asperity.transients.dense_output import DenseOutput
from asperity.transients.implicit import STAGES

#: Fewest instants in a call of the compiled program; more are padded to a power of two.
_FEWEST = 1024

_CONSTANT = Excitation(np.ones(()))


def stage_times(begin: Float, length: Float) -> Float:
    """Times of the collocation points of steps, shape (steps, stages)."""
    return begin[:, None] + length[:, None] * radau_iia(STAGES).c


def variations(
    motion: Motion,
    begin: Float,
    length: Float,
    states: Float,
    names: Sequence[str] = (),
    at: Excitation = _CONSTANT,
) -> tuple[Float, DenseOutput]:
    """Derivatives of the states along a motion.

    Parameters
    ----------
    motion : Motion
        With scalar parameters and omega = 1 rad/s.
    begin, length : array, shape (steps,)
        Of the steps (s); the derivatives refer to the beginning of the first step.
    states : array, shape (size, steps, stages)
        States at `stage_times`.
    names : sequence of str
        Parameters of the law or the machine, in SI.
    at : Excitation
        Numbers, or arrays at `stage_times`; constant load and drive by default.

    Returns
    -------
    at_end : array, shape (size, size + parameters)
        Derivatives at the end of the last step. Columns are the initial states, then the
        parameters.
    of_first_state : DenseOutput
        The first row of such arrays at all times. With a mass the first state is F/W0.
    """
    scheme, size, shape = radau_iia(STAGES), motion.size, states.shape[1:]
    jacobian, sides = _linearised(motion, names, at, states)
    # (steps, stages, size, size) and (steps, stages, size, size + parameters)
    jacobian = jacobian.reshape(size, size, *shape).transpose(2, 3, 0, 1)
    sides = sides.reshape(len(names), size, *shape).transpose(2, 3, 1, 0)
    sides = np.concatenate([jacobian, sides], axis=3)
    weights = length[:, None, None] * scheme.a
    unknowns = STAGES * size
    matrix = np.eye(unknowns) - np.einsum("njk,nkrc->njrkc", weights, jacobian).reshape(
        -1, unknowns, unknowns
    )
    known = np.einsum("njk,nkrc->njrc", weights, sides).reshape(len(length), unknowns, -1)
    stages = np.linalg.solve(matrix, known).reshape(len(length), STAGES, size, -1)
    # Changes over each step by power of time: for unit derivatives at its beginning, and the
    # contribution of the parameters.
    powers = np.einsum("kj,njrc->knrc", scheme.monomials / scheme.c, stages)
    derivatives = np.eye(size, size + len(names))
    first = np.empty((STAGES + 1, size + len(names), len(length)))
    for i in range(len(length)):
        changes = powers[:, i, :, :size] @ derivatives
        changes[..., size:] += powers[:, i, :, size:]
        first[0, :, i], first[1:, :, i] = derivatives[0], changes[:, 0]
        derivatives = derivatives + changes.sum(0)
    return derivatives, DenseOutput(begin, length, first)


def _linearised(
    motion: Motion, names: Sequence[str], at: Excitation, Y: Float
) -> tuple[Float, Float]:
    """Derivatives of the rates by states (size, size, n) and parameters (parameters, size, n)."""
    size, count = len(Y), Y[0].size
    padded = max(_FEWEST, 1 << (count - 1).bit_length())
    filled = np.minimum(np.arange(padded), count - 1)

    def flat(a: Any) -> Float:
        return np.broadcast_to(a, Y.shape[1:]).ravel()[filled]

    directions = _directions(jax.tree.structure(motion), tuple(names))
    rows = Y.reshape(size, count)[:, filled]
    jacobian, sides = _slopes(motion, directions, Excitation(*map(flat, at)), rows)
    by_parameter = np.reshape(sides, (len(names), size, padded))
    return np.asarray(jacobian)[:, :, :count], by_parameter[:, :, :count]


@cache
def _directions(structure: Any, names: tuple[str, ...]) -> list[Any]:
    """Derivative of an equation of motion of scalars with respect to each parameter."""
    none = jax.tree.unflatten(structure, [np.zeros(())] * structure.num_leaves)
    known = equation_parameters(none)
    return [with_value(Problem(none, None), known[name], 1.0).system for name in names]


@jit_large
def _slopes(
    motion: Motion, directions: list[Any], at: Excitation, Y: Array
) -> tuple[Array, list[Array]]:
    _, jacobian = value_and_jacobian(lambda Y: motion.rates(Y, at), Y)
    sides = [jax.jvp(lambda m: m.rates(Y, at), (motion,), (d,))[1] for d in directions]
    return jacobian, sides
