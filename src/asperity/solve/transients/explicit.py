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
from asperity.solve.transients.pieces import GOING_ON, STEPS, UNDERFLOW, Chunk

_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 6.0

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
    D: np.ndarray  # (4, 16)


@cache
def _tableau() -> _Tableau:
    # SciPy's integrators take a while to load, and only transients need them.
    from scipy.integrate import DOP853 as METHOD

    return _Tableau(
        A=np.vstack([METHOD.A[:12, :12], METHOD.B[:12]]),
        C=np.append(METHOD.C[:12], 1.0),
        E5=np.asarray(METHOD.E5),
        E3=np.asarray(METHOD.E3),
        extra_A=np.asarray(METHOD.A_EXTRA),
        extra_C=np.asarray(METHOD.C_EXTRA),
        D=np.asarray(METHOD.D),
    )


def _power_basis() -> np.ndarray:
    """Dense output y + x (F0 + (1-x) (F1 + x (F2 + (1-x) (F3 + ...)))) in powers of x: (8, 7)."""
    x, rest = Polynomial([0.0, 1.0]), Polynomial([1.0, -1.0])
    matrix, factor = np.zeros((8, 7)), Polynomial([1.0])
    for i in range(7):
        factor = factor * (x if i % 2 == 0 else rest)
        matrix[: len(factor.coef), i] = factor.coef
    return matrix


_POWERS = _power_basis()


class _Carry(NamedTuple):
    t: Array
    Y: Array
    h: Array
    slope: Array
    taken: Array
    rejected: Array
    stiff: Array
    status: Array
    begin: Array
    length: Array
    states: Array
    stages: Array


def advance(
    system: System, t: Array, Y: Array, h: Array, end: Array, rtol: Array, atol: Array
) -> Chunk:
    """March from `t` towards `end`, at most `STEPS` accepted steps.

    Parameters
    ----------
    system : System
    t, end : array
        Times of the segment (s).
    Y : array, shape (size + 1,)
    h : array
        Length of the first step to try (s), 0 for a guess.
    rtol, atol : array
        Tolerances of `System.scale`.
    """
    return _advance(system, t, Y, h, end, system.segment.longest_step, rtol, atol)


@jax.jit
def _advance(
    system: System,
    t: Array,
    Y: Array,
    h: Array,
    end: Array,
    longest: Array,
    rtol: Array,
    atol: Array,
) -> Chunk:
    size = Y.shape[0]
    table = _tableau()
    A, C = jnp.asarray(table.A), jnp.asarray(table.C)

    def unfinished(carry: _Carry) -> Array:
        return (carry.t < end) & (carry.taken < STEPS) & (carry.status == GOING_ON)

    def body(carry: _Carry) -> _Carry:
        t, Y, i = carry.t, carry.Y, carry.taken
        h = jnp.minimum(carry.h, longest)
        target = jnp.minimum(end, system.segment.next_kink(t))
        cut = t + h >= target
        h = jnp.where(cut, target - t, h)

        # All stages at once: what drives them does not depend on the states.
        drive = jax.tree.map(lambda a: jnp.broadcast_to(a, C.shape), system.at(t + C * h))

        def stage(k: Array, stages: Array) -> Array:
            at = jax.tree.map(lambda a: a[k], drive)
            return stages.at[k].set(system.rates(at, Y + h * (A[k] @ stages[:12])))

        stages = jnp.zeros((13, size)).at[0].set(carry.slope)
        stages = jax.lax.fori_loop(1, 13, stage, stages)
        new = Y + h * (A[12] @ stages[:12])
        scale = system.scale(jnp.maximum(jnp.abs(Y), jnp.abs(new)), rtol, atol)
        fifth = (jnp.square(table.E5 @ stages / scale)).sum()
        third = (jnp.square(table.E3 @ stages / scale)).sum()
        error = h * fifth / jnp.sqrt((fifth + 0.01 * third + 1e-300) * size)
        good = error < 1
        factor = jnp.clip(_SAFETY * error ** (-1 / 8), _SHRINK, _GROW)
        factor = jnp.where(jnp.isfinite(error), factor, _SHRINK)
        # The last stage lies at the end of the step too: two slopes, and two states.
        before = Y + h * (A[11] @ stages[:12])
        steep = jnp.square(h * (stages[12] - stages[11]) / scale).sum()
        at_limit = steep > _STIFF**2 * jnp.square((new - before) / scale).sum()
        h_next = h * factor
        lost = ~good & (t + h_next <= t)
        return _Carry(
            jnp.where(good, jnp.where(cut, target, t + h), t),
            jnp.where(good, new, Y),
            jnp.where(good & cut, jnp.maximum(h_next, carry.h), h_next),
            jnp.where(good, stages[12], carry.slope),
            i + good,
            carry.rejected + ~good,
            carry.stiff + (good & at_limit),
            jnp.where(lost, UNDERFLOW, GOING_ON),
            carry.begin.at[i].set(t),
            carry.length.at[i].set(h),
            carry.states.at[i].set(Y),
            carry.stages.at[i].set(stages),
        )

    none = jnp.asarray(0)
    empty = jnp.zeros(STEPS)
    h = jnp.where(h > 0, h, system.first_length(t, Y))
    first = _Carry(
        t, Y, h, system.rates(system.at(t), Y), none, none, none,
        jnp.asarray(GOING_ON), empty, empty, jnp.zeros((STEPS, size)), jnp.zeros((STEPS, 13, size)),
    )  # fmt: skip
    run = jax.lax.while_loop(unfinished, body, first)
    coefficients = _dense(system, run)
    return Chunk(
        run.begin, run.length, coefficients, run.taken, run.t, run.Y, run.h,
        run.rejected, run.status, run.stiff,
    )  # fmt: skip


def _dense(system: System, run: _Carry) -> Array:
    """Polynomials of all steps at once, shape (STEPS, 8, size)."""
    table = _tableau()
    h = run.length[:, None]
    stages = run.stages
    for row, c in zip(table.extra_A, table.extra_C, strict=True):
        reached = stages.shape[1]
        inner = run.states + h * jnp.einsum("k,skn->sn", row[:reached], stages)
        slope = system.rates(system.at(run.begin + c * run.length), inner.T).T
        stages = jnp.concatenate([stages, slope[:, None]], axis=1)
    change = h * jnp.einsum("k,skn->sn", table.A[12], stages[:, :12])
    first, last = h * stages[:, 0], h * stages[:, 12]
    high = h[:, None] * jnp.einsum("ik,skn->sin", table.D, stages)
    F = jnp.stack([change, first - change, 2 * change - last - first], axis=1)
    powers = jnp.einsum("pi,sin->spn", _POWERS, jnp.concatenate([F, high], axis=1))
    return powers.at[:, 0].add(run.states)
