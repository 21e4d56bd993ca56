"""Explicit steps: the method of order 8 of Dormand and Prince, with dense output of order 7.

In logarithms of velocity and age the equations of motion are not stiff as long as the velocity
follows from the force; then an explicit method of high order is the fastest.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section II.5 (error estimate, coefficients) and II.6 (dense output); the
coefficients are those of SciPy's integrator of the same name.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.runge_kutta import dormand_prince_8
from asperity.transients.dense_output import Interval, StepChunk
from asperity.transients.equations import SegmentEquations, Tolerances
from asperity.transients.one_kernel import one_kernel
from asperity.transients.step_size import TrialStep, run_steps

_SAFETY = 0.9
#: Smallest and largest factor by which a step may change its length.
LIMITS = 0.2, 6.0

#: The method becomes unstable where the product of step and eigenvalue is about 6.1; from this
#: smaller value on a step counts as limited by stability.
_STIFF = 5.0

#: Product far beyond the limit of stability. The end of such a step is a huge number, and the
#: estimated error relative to it is small; the step is rejected independent of the estimate.
_UNSTABLE = 100.0


def advance(system: SegmentEquations, interval: Interval, tolerances: Tolerances) -> StepChunk:
    """Integrate over an interval, as `run_steps`, with dense output."""
    chunk = _run(system, interval, tolerances)
    dense = _dense(system, chunk.begin, chunk.length, *chunk.coefficients)
    return chunk._replace(coefficients=dense)


@one_kernel
def _run(system: SegmentEquations, interval: Interval, tolerances: Tolerances) -> StepChunk:
    def attempt(t: Array, Y: Array, h: Array, slope: Array) -> TrialStep:
        return attempt_step(system, t, Y, h, slope, tolerances)

    slope = system.rates(system.at(interval.t), interval.Y)
    return run_steps(system, interval, attempt, slope, LIMITS)


def attempt_step(
    system: SegmentEquations,
    t: Array,
    Y: Array,
    h: Array,
    slope: Array,
    tolerances: Tolerances,
    *,
    rolled: bool = False,
) -> TrialStep:
    """One step of length `h` (s) from `Y`, whose rates are `slope`.

    `rolled` compiles the stages as a loop: a twelfth of the program, for many motions at once.
    """
    table, size = dormand_prince_8(), Y.shape[0]
    # Excitation of all stages at once: it does not depend on the states. The last two coincide.
    C = jnp.asarray(table.C[1:12])
    drive = jax.tree.map(lambda a: jnp.broadcast_to(a, C.shape), system.at(t + C * h))
    stages = jnp.zeros((13, size)).at[0].set(slope)

    def stage(k: Array | int, weights: Array, stages: Array) -> tuple[Array, Array]:
        new = Y + h * _combined(weights, stages)
        at = jax.tree.map(lambda a: a[jnp.minimum(k, 11) - 1], drive)
        return new, stages.at[k].set(system.rates(at, new))

    before = new = Y
    if rolled:
        rows = jnp.asarray(table.A)

        def one(k: Array, carry: tuple) -> tuple:
            _, before, stages = carry
            return before, *stage(k, rows[k], stages)

        before, new, stages = jax.lax.fori_loop(1, 13, one, (Y, Y, stages))
    else:
        # The number of terms in the sum differs from stage to stage.
        for k in range(1, 13):
            before = new
            new, stages = stage(k, table.A[k, :k], stages)
    slope = stages[12]
    scale = system.scale(jnp.maximum(jnp.abs(Y), jnp.abs(new)), tolerances)
    fifth = jnp.square(_combined(table.E5, stages) / scale).sum()
    third = jnp.square(_combined(table.E3, stages) / scale).sum()
    error = h * fifth / jnp.sqrt((fifth + 0.01 * third + 1e-300) * size)
    # The last two stages lie at the end of the step: two slopes, and two states.
    steep = jnp.square(h * (stages[12] - stages[11]) / scale).sum()
    distance = jnp.square((new - before) / scale).sum()
    at_limit = steep > _STIFF**2 * distance
    error = jnp.where(steep > _UNSTABLE**2 * distance, jnp.inf, error)
    return TrialStep(new, error, _SAFETY * error ** (-1 / 8), slope, at_limit, (Y, stages))


def _combined(weights: np.ndarray, stages: Array) -> Array:
    """Sum of the first stages, weighted, shape (size,)."""
    return (weights[:, None] * stages[: len(weights)]).sum(0)


@jit_large
def _dense(
    system: SegmentEquations, begin: Array, length: Array, states: Array, stages: Array
) -> Array:
    """Polynomials of all steps at once, shape (STEPS, 8, size)."""
    table, first = dormand_prince_8(), stages.shape[1]
    further = len(table.extra_A)
    # Steps last: operations on all of them run along memory.
    states, stages = states.T, jnp.moveaxis(stages, 0, -1)

    def stage(k: Array, stages: Array) -> Array:
        inner = states + length * jnp.tensordot(rows[k], stages, 1)
        slope = system.rates(system.at(begin + C[k] * length), inner)
        return stages.at[first + k].set(slope)

    # A loop: the law is compiled once and not for each stage.
    rows, C = jnp.asarray(table.extra_A), jnp.asarray(table.extra_C)
    room = jnp.zeros((further, *stages.shape[1:]))
    stages = jax.lax.fori_loop(0, further, stage, jnp.concatenate([stages, room]))
    powers = length * jnp.tensordot(table.powers, stages, 1)
    return jnp.moveaxis(powers.at[0].add(states), -1, 0)
