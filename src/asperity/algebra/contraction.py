"""Linear systems solved by a fixed-point iteration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

#: Largest last change of a solution, relative to its size.
_TOLERANCE = 1e-8
#: Largest number of rounds of steps.
_PASSES = 12


def contracted(
    contract: Callable[[Any], Any], right: Any, steps: Array | int, *, points_last: bool
) -> Any:
    """Solve y = right + contract(y) by repetition; NaN at points where it does not converge.

    All points take the same number of steps before it is looked how much they still change: a test
    at every step would cost as much as the step when derivatives in many directions are solved for
    together. Where one is not done then but on its way, all take as many steps again.

    Parameters
    ----------
    contract : callable
        Linear.
    right : pytree of arrays
        Of shape (points,), (..., points) or (points, ...).
    steps : int
        That are enough, as a rule.
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

    def several(carry: tuple) -> tuple:
        y, _, change, passes = carry
        last = jax.lax.fori_loop(0, steps, step, y)
        new = step(0, last)
        now = largest(jax.tree.map(jnp.subtract, new, last))
        good = now <= _TOLERANCE * largest(new)
        return new, jnp.where(good, 0.0, jnp.where(now < change, now, jnp.inf)), now, passes + 1

    def unfinished(carry: tuple) -> Array:
        _, left, _, passes = carry
        return (passes < _PASSES) & jnp.any((left > 0) & (left < jnp.inf))

    size = largest(right)
    start = (right, jnp.full_like(size, jnp.nan), size, 0)
    new, left, _, _ = jax.lax.while_loop(unfinished, several, several(start))

    def kept(y: Array) -> Array:
        shape = (1,) * (y.ndim - 1)
        good = (left == 0).reshape((*shape, -1) if points_last else (-1, *shape))
        return jnp.where(good, y, jnp.nan)

    return jax.tree.map(kept, new)
