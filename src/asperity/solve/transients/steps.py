"""Steps of controlled length, one after the other, whatever the method that makes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.solve.transients.equations import System
from asperity.solve.transients.pieces import GOING_ON, STEPS, UNDERFLOW, Chunk

#: What a step that failed is shortened by, at least.
_SAFETY = 0.9


class Trial(NamedTuple):
    """A step that has been tried.

    Attributes
    ----------
    end : array, shape (size,)
        States at its end.
    error : array
        Over what is tolerated: below 1 it is accepted.
    factor : array
        Length to try next over its own.
    memory : pytree of arrays
        What the next step is told, if it is accepted.
    doubtful : array
        Whether another method might have made it more cheaply.
    record : tuple of arrays
        What the dense output is made of.
    """

    end: Array
    error: Array
    factor: Array
    memory: Any
    doubtful: Array
    record: tuple[Array, ...]


class Limits(NamedTuple):
    """Between which a step may change its length at once."""

    shrink: float
    grow: float


#: Time, states, length and memory -> a trial.
Attempt = Callable[[Array, Array, Array, Any], Trial]


class Run(NamedTuple):
    """Accepted steps; attributes as in `Chunk`, `records` those of the trials, (STEPS, ...)."""

    t: Array
    Y: Array
    next_length: Array
    memory: Any
    taken: Array
    rejected: Array
    doubtful: Array
    status: Array
    begin: Array
    length: Array
    records: tuple[Array, ...]

    def chunk(self, coefficients: Array) -> Chunk:
        """What is handed over, with the polynomials of the steps."""
        return Chunk(
            self.begin, self.length, coefficients, self.taken, self.t, self.Y, self.next_length,
            self.rejected, self.status, self.doubtful,
        )  # fmt: skip


def run_steps(
    system: System,
    t: Array,
    Y: Array,
    h: Array,
    end: Array,
    longest: Array,
    attempt: Attempt,
    memory: Any,
    limits: Limits,
) -> Run:
    """March from `t` towards `end`, at most `STEPS` accepted steps.

    Parameters
    ----------
    system : System
    t, end : array
        Times of the segment (s).
    Y : array, shape (size + 1,)
    h : array
        Length of the first step to try (s), 0 for a guess.
    longest : array
        Length that no step may exceed (s).
    attempt : callable
    memory : pytree of arrays
        What the first step is told.
    limits : Limits
    """

    def unfinished(run: Run) -> Array:
        return (run.t < end) & (run.taken < STEPS) & (run.status == GOING_ON)

    def body(run: Run) -> Run:
        t, i = run.t, run.taken
        h = jnp.minimum(run.next_length, longest)
        target = jnp.minimum(end, system.segment.next_kink(t))
        cut = t + h >= target
        h = jnp.where(cut, target - t, h)
        trial = attempt(t, run.Y, h, run.memory)
        good = trial.error < 1
        factor = jnp.clip(trial.factor, limits.shrink, limits.grow)
        factor = jnp.where(jnp.isfinite(trial.error), factor, limits.shrink)
        h_next = h * jnp.where(good, factor, jnp.minimum(factor, _SAFETY))
        lost = ~good & (t + h_next <= t)

        def accepted(new: Array, old: Array) -> Array:
            return jnp.where(good, new, old)

        def kept(value: Array, rows: Array) -> Array:
            return jax.lax.dynamic_update_index_in_dim(rows, value, i, 0)

        return Run(
            accepted(jnp.where(cut, target, t + h), t),
            accepted(trial.end, run.Y),
            # A step cut short tells little of how long the next one may be.
            jnp.where(good & cut, jnp.maximum(h_next, run.next_length), h_next),
            jax.tree.map(accepted, trial.memory, run.memory),
            i + good,
            run.rejected + ~good,
            run.doubtful + (good & trial.doubtful),
            jnp.where(lost, UNDERFLOW, GOING_ON),
            kept(t, run.begin),
            kept(h, run.length),
            jax.tree.map(kept, trial.record, run.records),
        )

    none, empty = jnp.asarray(0), jnp.zeros(STEPS)
    h = jnp.where(h > 0, h, system.first_length(t, Y))
    record = jax.eval_shape(attempt, t, Y, h, memory).record
    rows = jax.tree.map(lambda a: jnp.zeros((STEPS, *a.shape), a.dtype), record)
    first = Run(
        t, Y, h, memory, none, none, none, jnp.asarray(GOING_ON), empty, empty, rows
    )  # fmt: skip
    return jax.lax.while_loop(unfinished, body, first)
