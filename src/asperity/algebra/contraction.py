"""Linear systems solved by repeating a contraction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

#: Largest last change of a solution, relative to its size.
_TOLERANCE = 1e-8


def contracted(
    contract: Callable[[Any], Any], right: Any, steps: Array | int, *, points_last: bool
) -> Any:
    """Solve y = right + contract(y) by repetition; NaN at points where it does not converge.

    All points take the same number of steps, known beforehand: a test within the loop would cost
    as much as the step when derivatives in many directions are solved for together.

    Parameters
    ----------
    contract : callable
        Linear.
    right : pytree of arrays
        Of shape (points,), (..., points) or (points, ...).
    steps : int
    points_last : bool
        Whether the points are the last axis of the arrays, or the first.
    """

    def step(_: Any, y: Any) -> Any:
        return jax.tree.map(jnp.add, right, contract(y))

    def largest(tree: Any) -> Array:
        """Largest entry for each point."""
        leaves = jax.tree.leaves(tree)
        return jnp.stack(
            [jnp.abs(a).max(range(a.ndim - 1) if points_last else range(1, a.ndim)) for a in leaves]
        ).max(0)

    last = jax.lax.fori_loop(0, steps, step, right)
    new = step(0, last)
    good = largest(jax.tree.map(jnp.subtract, new, last)) <= _TOLERANCE * largest(new)

    def kept(y: Array) -> Array:
        shape = (1,) * (y.ndim - 1)
        return jnp.where(good.reshape((*shape, -1) if points_last else (-1, *shape)), y, jnp.nan)

    return jax.tree.map(kept, new)
