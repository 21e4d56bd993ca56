"""Explicit steps: the method of order 8 of Dormand and Prince, with dense output of order 7.

In logarithms of velocity and age the equations of motion are not stiff as long as the velocity
follows from the force; then an explicit method of high order is the fastest.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section II.5 (error estimate, coefficients) and II.6 (dense output); the
coefficients are those that SciPy gives with its integrator of the same name.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.polynomial import Polynomial

from asperity.solve.transients.equations import System
from asperity.solve.transients.one_kernel import one_kernel
from asperity.solve.transients.pieces import Chunk
from asperity.solve.transients.steps import Limits, Run, Trial, run_steps

_SAFETY = 0.9
_LIMITS = Limits(shrink=0.2, grow=6.0)

#: Product of step and eigenvalue near which the method becomes unstable is 6.1; below it, steps
#: that are limited by stability are seen before they fail.
_STIFF = 5.0


class _Tableau(NamedTuple):
    A: np.ndarray  # (13, 12), the last row yields the end of the step
    C: np.ndarray  # (13,)
    E5: np.ndarray  # (13,)
    E3: np.ndarray
    extra_A: np.ndarray  # (3, 16)
    extra_C: np.ndarray  # (3,)
    powers: np.ndarray  # (8, 16): dense output in rising powers, of all stages


@cache
def _tableau() -> _Tableau:
    # SciPy's integrators take a while to load, and only transients need them.
    from scipy.integrate import DOP853 as METHOD

    change, first, last = np.append(METHOD.B, np.zeros(4)), np.eye(16)[0], np.eye(16)[12]
    F = np.vstack([change, first - change, 2 * change - last - first, METHOD.D])
    return _Tableau(
        A=np.vstack([METHOD.A[:12, :12], METHOD.B[:12]]),
        C=np.append(METHOD.C[:12], 1.0),
        E5=np.asarray(METHOD.E5),
        E3=np.asarray(METHOD.E3),
        extra_A=np.asarray(METHOD.A_EXTRA),
        extra_C=np.asarray(METHOD.C_EXTRA),
        powers=_power_basis() @ F,
    )


def _power_basis() -> np.ndarray:
    """Dense output y + x (F0 + (1-x) (F1 + x (F2 + (1-x) (F3 + ...)))) in powers of x: (8, 7)."""
    x, rest = Polynomial([0.0, 1.0]), Polynomial([1.0, -1.0])
    matrix, factor = np.zeros((8, 7)), Polynomial([1.0])
    for i in range(7):
        factor = factor * (x if i % 2 == 0 else rest)
        matrix[: len(factor.coef), i] = factor.coef
    return matrix


def advance(
    system: System, t: Array, Y: Array, h: Array, end: Array, rtol: Array, atol: Array
) -> Chunk:
    """March from `t` towards `end`, at most `STEPS` accepted steps; as `run_steps`.

    Parameters
    ----------
    rtol, atol : array
        Tolerances of `System.scale`.
    """
    run = _run(system, t, Y, h, end, system.segment.longest_step, rtol, atol)
    return run.chunk(_dense(system, run.begin, run.length, *run.records))


@one_kernel
def _run(
    system: System,
    t: Array,
    Y: Array,
    h: Array,
    end: Array,
    longest: Array,
    rtol: Array,
    atol: Array,
) -> Run:
    def attempt(t: Array, Y: Array, h: Array, slope: Array) -> Trial:
        return _attempt(system, t, Y, h, slope, rtol, atol)

    slope = system.rates(system.at(t), Y)
    return run_steps(system, t, Y, h, end, longest, attempt, slope, _LIMITS)


def _attempt(
    system: System, t: Array, Y: Array, h: Array, slope: Array, rtol: Array, atol: Array
) -> Trial:
    table, size = _tableau(), Y.shape[0]
    # All stages at once: what drives them does not depend on the states. The last two coincide.
    C = jnp.asarray(table.C[1:12])
    drive = jax.tree.map(lambda a: jnp.broadcast_to(a, C.shape), system.at(t + C * h))
    stages = jnp.zeros((13, size)).at[0].set(slope)
    new = Y
    # One by one, not in a loop: each knows how many there are before it.
    for k in range(1, 13):
        before, new = new, Y + h * _combined(table.A[k, :k], stages)
        at = jax.tree.map(lambda a, k=k: a[min(k, 11) - 1], drive)
        slope = system.rates(at, new)
        stages = stages.at[k].set(slope)
    scale = system.scale(jnp.maximum(jnp.abs(Y), jnp.abs(new)), rtol, atol)
    fifth = jnp.square(_combined(table.E5, stages) / scale).sum()
    third = jnp.square(_combined(table.E3, stages) / scale).sum()
    error = h * fifth / jnp.sqrt((fifth + 0.01 * third + 1e-300) * size)
    # The last two stages lie at the end of the step: two slopes, and two states.
    steep = jnp.square(h * (stages[12] - stages[11]) / scale).sum()
    at_limit = steep > _STIFF**2 * jnp.square((new - before) / scale).sum()
    return Trial(new, error, _SAFETY * error ** (-1 / 8), slope, at_limit, (Y, stages))


def _combined(weights: np.ndarray, stages: Array) -> Array:
    """Sum of the first stages, weighted, shape (size,)."""
    return (weights[:, None] * stages[: len(weights)]).sum(0)


@jax.jit
def _dense(system: System, begin: Array, length: Array, states: Array, stages: Array) -> Array:
    """Polynomials of all steps at once, shape (STEPS, 8, size)."""
    table = _tableau()
    # Steps last: what is done to all of them runs along memory.
    states, stages = states.T, jnp.moveaxis(stages, 0, -1)
    for row, c in zip(table.extra_A, table.extra_C, strict=True):
        inner = states + length * jnp.tensordot(row[: len(stages)], stages, 1)
        slope = system.rates(system.at(begin + c * length), inner)
        stages = jnp.concatenate([stages, slope[None]])
    powers = length * jnp.tensordot(table.powers, stages, 1)
    return jnp.moveaxis(powers.at[0].add(states), -1, 0)
