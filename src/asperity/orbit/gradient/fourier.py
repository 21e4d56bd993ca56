"""The equations of a Fourier orbit and of its Floquet factor, for the implicit-function rule.

Both are fixed points of contractions, those of `asperity.orbit.methods.fourier`, so that their
linear systems are solved by repeating a contraction, transposed or not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity.algebra.contraction import contracted
from asperity.algebra.small_systems import Matrix, inverse_points
from asperity.orbit.methods.fourier.orbit import (
    LoadCycle,
    States,
    advance,
    grid,
    jacobian,
    load_cycle,
    rates_on,
    together,
)
from asperity.slider.problem import Problem

#: Iterations of a linear system in addition to those that the orbit took.
_MORE_STEPS = 1
#: Last change of the Floquet factor.
_FLOQUET_TOLERANCE = 1e-11


class FourierUnknowns(NamedTuple):
    """A Fourier orbit: mean states (points,) and zero-mean parts (nodes, points)."""

    mean: States
    zero_mean: States


class _InvertedJacobian(NamedTuple):
    inverse: Matrix
    jacobian: Matrix
    steps: Array


@dataclass(frozen=True)
class FourierEquations:
    """Orbit equations on a grid; the parameters are (problem, steps that the orbit took).

    Parameters
    ----------
    nodes : int
    grading : float
    """

    nodes: int
    grading: float

    def cycle(self, problem: Problem) -> LoadCycle:
        """The load on the grid."""
        return load_cycle(problem.load, self.nodes, self.grading)

    def jacobian(self, problem: Problem, unknowns: FourierUnknowns) -> Matrix:
        """Derivatives of the rates on the grid to the states, [i][j] of shape (nodes, points)."""
        states = together(*unknowns)
        _, push = jax.linearize(rates_on(problem.system, self.cycle(problem)), *states)
        return jacobian(push, states)

    def prepare(
        self, parameters: tuple[Problem, Array], unknowns: FourierUnknowns
    ) -> _InvertedJacobian:
        """Jacobian, and the inverse of its mean."""
        problem, steps = parameters
        J = self.jacobian(problem, unknowns)
        share = self.cycle(problem).share
        inverse = inverse_points([[share @ entry for entry in row] for row in J])
        return _InvertedJacobian(inverse, J, steps)

    def residual(
        self, parameters: tuple[Problem, Array], unknowns: FourierUnknowns, at: _InvertedJacobian
    ) -> FourierUnknowns:
        """The unknowns minus the result of one iteration step from them."""
        problem, _ = parameters
        cycle = self.cycle(problem)
        rates = rates_on(problem.system, cycle)(*together(*unknowns))

        def push(*change: Array) -> States:
            return _times(at.jacobian, change)

        mean, zero_mean, _ = advance(cycle, at.inverse, unknowns.mean, rates, push)
        return _less(unknowns, FourierUnknowns(mean, zero_mean))

    def solve(
        self, product: Callable[[Any], Any], right: FourierUnknowns, at: _InvertedJacobian
    ) -> FourierUnknowns:
        """As in `Equations`, by the contraction that solves for the orbit."""
        J, share, integral = self._transposed(at)

        def contract(y: FourierUnknowns) -> FourierUnknowns:
            states = tuple(m[:, None] + z for m, z in zip(y.mean, y.zero_mean, strict=True))
            rates = _times(J, states)
            change = tuple(-c for c in _times(at.inverse, tuple(r @ share for r in rates)))
            follow = _times(J, tuple(c[:, None] for c in change))
            zero_mean = tuple((r + f) @ integral for r, f in zip(rates, follow, strict=True))
            return FourierUnknowns(together(y.mean, change), zero_mean)

        return _turned(
            contracted(contract, _turned(right), at.steps + _MORE_STEPS, points_last=False)
        )

    def solve_transposed(
        self, product: Callable[[Any], Any], right: FourierUnknowns, at: _InvertedJacobian
    ) -> FourierUnknowns:
        """As in `Equations`, by the transpose of the contraction of `solve`."""
        J, share, integral = self._transposed(at)
        n = range(len(J))

        def contract(y: FourierUnknowns) -> FourierUnknowns:
            zero_mean = tuple(z @ integral.T for z in y.zero_mean)
            change = [y.mean[j] + sum((J[i][j] * zero_mean[i]).sum(1) for i in n) for j in n]
            mean = [-sum(at.inverse[i][j] * change[i] for i in n) for j in n]
            rates = [r + m[:, None] * share for r, m in zip(zero_mean, mean, strict=True)]
            states = tuple(sum(J[i][j] * rates[i] for i in n) for j in n)
            means_too = tuple(m + s.sum(1) for m, s in zip(y.mean, states, strict=True))
            return FourierUnknowns(means_too, states)

        return _turned(
            contracted(contract, _turned(right), at.steps + _MORE_STEPS, points_last=False)
        )

    def _transposed(self, at: _InvertedJacobian) -> tuple[Matrix, Any, Any]:
        """Jacobian (points, nodes), weights of a mean, and the integral as a right factor.

        With the nodes last, products with the integral need no transposition, however many
        right-hand sides there are.
        """
        tau, integral = grid(self.nodes)
        stretch = 1 + self.grading * np.cos(tau)
        J = [[entry.T for entry in row] for row in at.jacobian]
        return J, stretch / self.nodes, (integral * stretch).T


@dataclass(frozen=True)
class FloquetEquations:
    """Equations of the periodic factor Q = 1 + q of the fundamental matrix, q of zero mean.

        dq/dtau = J (1 + q) - (1 + q) L,     L = < J (1 + q) >.

    The parameters are J, [i][j] of shape (nodes, points), per unit of tau, and the steps to take.
    """

    nodes: int

    def product(self, J: Matrix, q: Matrix) -> Matrix:
        """J (1 + q)."""
        n = range(len(J))
        return [[J[i][c] + sum(J[i][j] * q[j][c] for j in n) for c in n] for i in n]

    def slope(self, J: Matrix, q: Matrix) -> Matrix:
        """dq/dtau."""
        n, P = range(len(J)), self.product(J, q)
        L = means(P)
        return [[P[i][c] - L[i][c] - sum(q[i][k] * L[k][c] for k in n) for c in n] for i in n]

    def prepare(self, parameters: tuple[Matrix, Array], unknowns: Matrix) -> Array:
        """The steps to take."""
        return parameters[1]

    def residual(self, parameters: tuple[Matrix, Array], unknowns: Matrix, at: Array) -> Matrix:
        """Q minus the result of one iteration step from it."""
        integral = grid(self.nodes)[1]
        slope = self.slope(parameters[0], unknowns)
        return [
            [q - integral @ s for q, s in zip(*rows, strict=True)]
            for rows in zip(unknowns, slope, strict=True)
        ]

    def solve(self, product: Callable[[Any], Any], right: Any, at: Array) -> Any:
        """As in `Equations`, by the contraction that solves for Q."""
        return contracted(lambda y: _less(y, product(y)), right, at + _MORE_STEPS, points_last=True)

    def solve_transposed(self, product: Callable[[Any], Any], right: Any, at: Array) -> Any:
        """As in `Equations`; the transposed system contracts as fast."""
        return self.solve(product, right, at)


def floquet_factor(nodes: int, J: Matrix, max_steps: int) -> tuple[Matrix, Array, Array]:
    """q, whether it converged (points,), and the number of steps."""
    equations, integral = FloquetEquations(nodes), grid(nodes)[1]
    zero = [[jnp.zeros_like(entry) for entry in row] for row in J]

    def body(carry: tuple) -> tuple:
        q, _, steps = carry
        new = [[integral @ s for s in row] for row in equations.slope(J, q)]
        change = jnp.stack([jnp.abs(d).max(0) for d in jax.tree.leaves(_less(new, q))]).max(0)
        return new, change, steps + 1

    def unfinished(carry: tuple) -> Array:
        _, change, steps = carry
        return (steps < max_steps) & jnp.any((change > _FLOQUET_TOLERANCE) & (change < 1e3))

    q, change, steps = jax.lax.while_loop(unfinished, body, (zero, jnp.ones(J[0][0].shape[1]), 0))
    return q, change <= _FLOQUET_TOLERANCE, steps


def means(entries: Matrix) -> Matrix:
    """Means over tau, entries of shape (points,)."""
    return [[entry.mean(0) for entry in row] for row in entries]


def _less(a: Any, b: Any) -> Any:
    return jax.tree.map(jnp.subtract, a, b)


def _turned(tree: Any) -> Any:
    """Transposed arrays."""
    return jax.tree.map(jnp.transpose, tree)


def _times(matrix: Matrix, vector: States) -> States:
    return tuple(sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix)
