"""The implicit-function rule: derivatives of a solution that any method has found.

Where R(p, Y) = 0 fixes the unknowns Y as functions of the parameters p,

    dY = -R_Y^-1 R_p dp.

No iteration of a solver is differentiated. The rule refers to itself, so that derivatives of any
order follow from R; the linear solve has a transpose, so that they do in forward and reverse mode.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import jax


class Equations(Protocol):
    """Equations R(p, Y) = 0 of many operating points; hashable, without arrays."""

    def residual(self, parameters: Any, unknowns: Any, at: Any) -> Any:
        """R, a pytree like the unknowns, each leaf of which depends on the parameters.

        Parameters
        ----------
        parameters, unknowns : pytree
        at : pytree
            From `prepare`; of no derivative. It may scale and combine the equations.
        """
        ...

    def prepare(self, parameters: Any, unknowns: Any) -> Any:
        """What `residual` and `solve` need at a solution, computed once."""
        ...

    def solve(self, product: Callable[[Any], Any], right: Any, at: Any) -> Any:
        """Solve R_Y y = right, given the product R_Y y as a function of y; NaN where it fails."""
        ...

    def solve_transposed(self, product: Callable[[Any], Any], right: Any, at: Any) -> Any:
        """The same with the transpose of R_Y."""
        ...


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def implicit_solution(equations: Equations, parameters: Any, solution: Any) -> Any:
    """`solution` as a function of the parameters.

    Parameters
    ----------
    equations : Equations
    parameters : pytree of arrays
    solution : pytree of arrays
        Unknowns that solve the equations to round-off; a derivative of theirs does not count.

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
    at = jax.lax.stop_gradient(equations.prepare(parameters, unknowns))
    _, right = jax.jvp(lambda p: equations.residual(p, unknowns, at), (parameters,), (tangents[0],))
    _, product = jax.linearize(lambda Y: equations.residual(parameters, Y, at), unknowns)
    moved = jax.lax.custom_linear_solve(
        product,
        jax.tree.map(lambda a: -a, right),
        solve=lambda multiply, b: equations.solve(multiply, b, at),
        transpose_solve=lambda multiply, b: equations.solve_transposed(multiply, b, at),
    )
    return unknowns, moved
