"""Step-size control, common to the explicit and the implicit method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.slider import ReversingInertial, StiffInertial
from asperity.transients.dense_output import GOING_ON, STEPS, UNDERFLOW, Interval, StepChunk
from asperity.transients.equations import SegmentEquations

#: Factor by which a rejected step is shortened at least.
_SAFETY = 0.9

#: Shortest step (s) where the clock does not matter.
_SHORTEST = 1e-200

#: Trial steps in a call of a compiled program; between calls Python can handle Ctrl-C.
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
        Whether the other method might take this step at lower cost.
    record : pytree of arrays
        Data of the dense output.
    """

    end: Array
    error: Array
    factor: Array
    memory: Any
    doubtful: Array
    record: Any


def next_length(h: Array, trial: TrialStep, limits: tuple[float, float]) -> Array:
    """Length of the next step (s) after a trial of length `h`: shorter if that is rejected.

    `limits` are the smallest and the largest factor.
    """
    factor = jnp.clip(trial.factor, *limits)
    factor = jnp.where(jnp.isfinite(trial.error), factor, limits[0])
    return h * jnp.where(trial.error < 1, factor, jnp.minimum(factor, _SAFETY))


#: Time, states, length and memory -> a trial.
StepAttempt = Callable[[Array, Array, Array, Any], TrialStep]


def run_steps(
    system: SegmentEquations,
    interval: Interval,
    attempt: StepAttempt,
    memory: Any,
    limits: tuple[float, float],
) -> StepChunk:
    """Integrate over an interval: at most `STEPS` accepted steps and `_TRIALS` trial steps.

    The chunk has the records of the trials, (STEPS, ...), in place of the coefficients.

    Parameters
    ----------
    system : SegmentEquations
    interval : Interval
    attempt : callable
    memory : pytree of arrays
        Passed to the first step.
    limits : (float, float)
        Smallest and largest factor by which a step may change its length.
    """
    # Where a slip ends, the logarithm of the velocity changes within times far below the resolution
    # of the clock, over which load and drive are constant.
    by_rest = isinstance(system.motion, StiffInertial | ReversingInertial)
    shortest = _SHORTEST if by_rest else 0.0
    t, Y, h, end, longest = interval

    def unfinished(carry: tuple[StepChunk, Any]) -> Array:
        run, _ = carry
        tried = run.taken + run.rejected
        room = (run.taken < STEPS) & (tried < _TRIALS)
        return (run.t < end) & room & (run.status == GOING_ON)

    def body(carry: tuple[StepChunk, Any]) -> tuple[StepChunk, Any]:
        run, memory = carry
        t, i = run.t, run.taken
        h = jnp.minimum(run.next_length, longest)
        target = jnp.minimum(end, system.segment.next_kink(t))
        cut = t + h >= target
        h = jnp.where(cut, target - t, h)
        trial = attempt(t, run.Y, h, memory)
        good = trial.error < 1
        h_next = next_length(h, trial, limits)
        # A length of NaN ends the loop, too.
        lost = ~good & ~(h_next > shortest if shortest else t + h_next > t)

        def accepted(new: Array, old: Array) -> Array:
            return jnp.where(good, new, old)

        def kept(value: Array, rows: Array) -> Array:
            return jax.lax.dynamic_update_index_in_dim(rows, value, i, 0)

        chunk = StepChunk(
            begin=kept(t, run.begin),
            length=kept(h, run.length),
            coefficients=jax.tree.map(kept, trial.record, run.coefficients),
            taken=i + good,
            t=accepted(jnp.where(cut, target, t + h), t),
            Y=accepted(trial.end, run.Y),
            # A step cut short at `target` does not limit the next one.
            next_length=jnp.where(good & cut, jnp.maximum(h_next, run.next_length), h_next),
            rejected=run.rejected + ~good,
            status=jnp.where(lost, UNDERFLOW, GOING_ON),
            doubtful=run.doubtful + (good & trial.doubtful),
        )
        return chunk, jax.tree.map(accepted, trial.memory, memory)

    none, empty = jnp.asarray(0), jnp.zeros(STEPS)
    h = jnp.where(h > 0, h, system.first_length(t, Y))
    record = jax.eval_shape(attempt, t, Y, h, memory).record
    rows = jax.tree.map(lambda a: jnp.zeros((STEPS, *a.shape), a.dtype), record)
    first = StepChunk(empty, empty, rows, none, t, Y, h, none, jnp.asarray(GOING_ON), none)
    return jax.lax.while_loop(unfinished, body, (first, memory))[0]
