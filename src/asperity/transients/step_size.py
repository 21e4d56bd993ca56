"""Step-size control, common to the explicit and the implicit method.

Loops over small arrays are compiled as one kernel of the processor. XLA runs every operation of the
body of a loop as a separate kernel. For arrays of a few numbers, calling the kernels takes several
times as long as their computation. A call with the attributes below is compiled to a single kernel
with its control flow; compilers without these attributes ignore them.

XLA cannot compile every program to one kernel, and may abort the process (jaxlib 0.10.2). Only
programs of element-wise operations on scalar parameters are compiled this way: every law with a
closed form for its velocity, under any load except a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, wraps
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.experimental.xla_metadata import set_xla_metadata

from asperity.slider import ReversingInertial, StiffInertial
from asperity.transients.dense_output import GOING_ON, STEPS, UNDERFLOW, Interval, StepChunk
from asperity.transients.equations import SegmentEquations

_ATTRIBUTES = {"xla_cpu_small_call": "true", "inlineable": "false"}
_NO_ATTRIBUTES = dict.fromkeys(_ATTRIBUTES)

#: Primitives known to compile; rates and excitation must use no others.
# fmt: off
_ALLOWED = frozenset((
    "abs", "add", "add_any", "and", "asinh", "broadcast_in_dim", "clamp", "concatenate",
    "convert_element_type", "copy", "cos", "cosh", "div", "eq", "exp", "exp2", "expm1", "floor",
    "ge", "gt", "integer_pow", "is_finite", "le", "log", "log1p", "lt", "max", "min", "mul", "ne",
    "neg", "not", "or", "pow", "reduce_sum", "rem", "reshape", "round", "select_n", "sign", "sin",
    "sinh", "slice", "sqrt", "square", "squeeze", "stack", "stop_gradient", "sub", "tan", "tanh",
    "unstack", "xor",
))
# fmt: on


def one_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile as `jax.jit` does, to one kernel where XLA can.

    Parameters
    ----------
    function : callable
        Function of a `SegmentEquations` and other arguments.
    """
    many, single = jax.jit(function), jax.jit(_as_one_kernel(function))

    @wraps(function)
    def call(system: SegmentEquations, *arguments: Any) -> Any:
        run = single if _compiles_to_one(system) else many
        return run(system, *arguments)

    return call


def _as_one_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    def within(*arguments: Any) -> Any:
        with set_xla_metadata(**_NO_ATTRIBUTES):
            return function(*arguments)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        with set_xla_metadata(**_ATTRIBUTES):
            return jax.jit(within)(*arguments)

    return call


def _compiles_to_one(system: SegmentEquations) -> bool:
    leaves, structure = jax.tree.flatten(system)
    return all(np.ndim(leaf) == 0 for leaf in leaves) and _elementwise(structure)


@cache
def _elementwise(structure: Any) -> bool:
    """Whether rates and excitation of a system of scalars are element-wise."""
    system = jax.tree.unflatten(structure, [np.ones(())] * structure.num_leaves)

    def evaluate(system: SegmentEquations, t: jax.Array, Y: jax.Array) -> tuple:
        return system.rates(system.at(t), Y), system.segment.next_kink(t)

    with set_xla_metadata(**_NO_ATTRIBUTES):
        jaxpr = jax.make_jaxpr(evaluate)(system, np.ones(()), np.ones(system.motion.size + 1))
    return _ALLOWED.issuperset(_primitives(jaxpr.jaxpr))


def _primitives(jaxpr: Any) -> Iterator[str]:
    """Names of the primitives of a program and of the functions that it calls."""
    for equation in jaxpr.eqns:
        inner = [getattr(p, "jaxpr", p) for p in equation.params.values()]
        called = [p for p in inner if hasattr(p, "eqns")]
        if equation.primitive.name in ("jit", "pjit", "custom_jvp_call"):
            for part in called:
                yield from _primitives(part)
        else:
            yield equation.primitive.name


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
