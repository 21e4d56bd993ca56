"""Fixed points of contractions: their derivatives, and linear systems.

Derivatives follow from the implicit function theorem. Where R(p, Y) = 0 fixes the unknowns Y as
functions of the parameters p,

    dY = -R_Y^-1 R_p dp.

No iteration of a solver is differentiated. The rule refers to itself, so that derivatives of any
order follow from R; the linear solve has a transpose, so that they do in forward and reverse mode.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

#: Largest last change of a solution, relative to its size.
_TOLERANCE = 1e-8
#: Largest number of rounds of steps.
_ROUNDS = 12


def contracted(
    contract: Callable[[Any], Any], right: Any, steps: Array | int, *, points_first: bool = False
) -> Any:
    """Solve y = right + contract(y) by repetition; NaN at points where it does not converge.

    All points take a round of the same number of steps before their last changes are tested: when
    derivatives in many directions are solved for together, a test at every step would cost as much
    as the step. If a point has not converged but its changes become smaller, all points take
    another round.

    Parameters
    ----------
    contract : callable
        Linear.
    right : pytree of arrays
        Arrays of shape (points,), (..., points) or, with `points_first`, (points, ...).
    steps : int
        Number of steps in a round.
    """

    def step(_: Any, y: Any) -> Any:
        return jax.tree.map(jnp.add, right, contract(y))

    def largest(tree: Any) -> Array:
        """Largest entry for each point."""
        leaves = jax.tree.leaves(tree)
        return jnp.stack(
            [
                jnp.abs(a).max(range(1, a.ndim) if points_first else range(a.ndim - 1))
                for a in leaves
            ]
        ).max(0)

    def take_round(carry: tuple) -> tuple:
        y, _, change, rounds = carry
        last = jax.lax.fori_loop(0, steps, step, y)
        new = step(0, last)
        now = largest(jax.tree.map(jnp.subtract, new, last))
        good = now <= _TOLERANCE * largest(new)
        return new, jnp.where(good, 0.0, jnp.where(now < change, now, jnp.inf)), now, rounds + 1

    def unfinished(carry: tuple) -> Array:
        _, left, _, rounds = carry
        return (rounds < _ROUNDS) & jnp.any((left > 0) & (left < jnp.inf))

    first = jax.tree.leaves(right)[0]
    # Not the size of the right-hand side, which may be a constant: XLA takes seconds to fold it.
    far = jnp.full(first.shape[0] if points_first else first.shape[-1], jnp.inf)
    start = (right, far, far, 0)
    new, left, _, _ = jax.lax.while_loop(unfinished, take_round, take_round(start))

    def kept(y: Array) -> Array:
        good = (left == 0).reshape(-1, *(1,) * (y.ndim - 1)) if points_first else left == 0
        return jnp.where(good, y, jnp.nan)

    return jax.tree.map(kept, new)


class Equations(ABC):
    """Equations R(p, Y) = 0 of many operating points; hashable, without arrays.

    R is the unknowns less the result of one step of a contraction.
    """

    @abstractmethod
    def residual(self, parameters: Any, unknowns: Any, at: Any) -> Any:
        """R, a pytree like the unknowns, each leaf of which depends on the parameters.

        Parameters
        ----------
        parameters, unknowns : pytree
        at : pytree
            From `prepare`; of no derivative. It may scale and combine the equations.
        """

    @abstractmethod
    def prepare(self, parameters: Any, unknowns: Any) -> tuple[Any, Array]:
        """What `residual` needs at a solution, and the steps that linear systems take."""

    def solve(
        self, product: Callable[[Any], Any], right: Any, at: Any, steps: Array, *, transposed: bool
    ) -> Any:
        """Solve R_Y y = right, or the transposed system, by repeating y -> right + y - R_Y y.

        `product` is R_Y y, or its transpose, as a function of y; NaN where it fails.
        """
        return contracted(lambda y: jax.tree.map(jnp.subtract, y, product(y)), right, steps)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def implicit_solution(equations: Equations, parameters: Any, solution: Any) -> Any:
    """`solution` as a function of the parameters.

    Parameters
    ----------
    equations : Equations
    parameters : pytree of arrays
    solution : pytree of arrays
        Unknowns that solve the equations to round-off; derivatives that they carry are ignored.

    Returns
    -------
    pytree
        `solution`, with the derivatives of all orders to `parameters`.
    """
    return solution


@implicit_solution.defjvp
def _implicit_rule(equations: Equations, primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    parameters, solution = primals
    unknowns = implicit_solution(equations, parameters, solution)
    at, steps = jax.lax.stop_gradient(equations.prepare(parameters, unknowns))
    _, right = jax.jvp(lambda p: equations.residual(p, unknowns, at), (parameters,), (tangents[0],))
    _, product = jax.linearize(lambda Y: equations.residual(parameters, Y, at), unknowns)
    moved = jax.lax.custom_linear_solve(
        product,
        jax.tree.map(lambda a: -a, right),
        solve=lambda multiply, b: equations.solve(multiply, b, at, steps, transposed=False),
        transpose_solve=lambda m, b: equations.solve(m, b, at, steps, transposed=True),
    )
    return unknowns, moved
