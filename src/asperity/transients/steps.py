"""Steps of controlled length, one after the other, whatever the method that makes them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.transients.dense_output import GOING_ON, STEPS, UNDERFLOW, StepChunk
from asperity.transients.equations import SegmentEquations

#: Factor by which a rejected step is shortened at least.
_SAFETY = 0.9

#: Steps that a compiled program tries before it returns, so that Ctrl-C is heard.
_TRIALS = 4 * STEPS


class TrialStep(NamedTuple):
    """A step that may be accepted or rejected.

    Attributes
    ----------
    end : array, shape (size,)
        States at its end.
    error : array
        Over the tolerated error: below 1 the step is accepted.
    factor : array
        Proposed length of the next step over that of this one.
    memory : pytree of arrays
        Passed to the next step if this one is accepted.
    doubtful : array
        Whether the other method might have taken it more cheaply.
    record : tuple of arrays
        Data of the dense output.
    """

    end: Array
    error: Array
    factor: Array
    memory: Any
    doubtful: Array
    record: tuple[Array, ...]


class LengthLimits(NamedTuple):
    """Smallest and largest factor by which a step may change its length."""

    shrink: float
    grow: float


#: Time, states, length and memory -> a trial.
StepAttempt = Callable[[Array, Array, Array, Any], TrialStep]


class AcceptedSteps(NamedTuple):
    """Accepted steps; attributes as in `StepChunk`, `records` those of the trials, (STEPS, ...)."""

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

    def chunk(self, coefficients: Array) -> StepChunk:
        """The chunk, with the polynomials of the steps."""
        return StepChunk(
            self.begin, self.length, coefficients, self.taken, self.t, self.Y, self.next_length,
            self.rejected, self.status, self.doubtful,
        )  # fmt: skip


def run_steps(
    system: SegmentEquations,
    t: Array,
    Y: Array,
    h: Array,
    end: Array,
    longest: Array,
    attempt: StepAttempt,
    memory: Any,
    limits: LengthLimits,
) -> AcceptedSteps:
    """Integrate from `t` towards `end`: at most `STEPS` accepted steps of `_TRIALS` that are tried.

    Parameters
    ----------
    system : SegmentEquations
    t, end : array
        Times of the segment (s).
    Y : array, shape (size + 1,)
    h : array
        Length of the first step to try (s), 0 for a guess.
    longest : array
        Length that no step may exceed (s).
    attempt : callable
    memory : pytree of arrays
        Passed to the first step.
    limits : LengthLimits
    """

    def unfinished(run: AcceptedSteps) -> Array:
        tried = run.taken + run.rejected
        room = (run.taken < STEPS) & (tried < _TRIALS)
        return (run.t < end) & room & (run.status == GOING_ON)

    def body(run: AcceptedSteps) -> AcceptedSteps:
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
        # Neither does a length that is no number go on.
        lost = ~good & ~(t + h_next > t)

        def accepted(new: Array, old: Array) -> Array:
            return jnp.where(good, new, old)

        def kept(value: Array, rows: Array) -> Array:
            return jax.lax.dynamic_update_index_in_dim(rows, value, i, 0)

        return AcceptedSteps(
            accepted(jnp.where(cut, target, t + h), t),
            accepted(trial.end, run.Y),
            # A step cut short at `target` does not limit the next one.
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
    first = AcceptedSteps(
        t, Y, h, memory, none, none, none, jnp.asarray(GOING_ON), empty, empty, rows
    )  # fmt: skip
    return jax.lax.while_loop(unfinished, body, first)
