"""The velocity at which a law without closed-form inverse carries a given force.

Newton's method on ln v, in which rate-and-state laws are close to linear. Bisection keeps ln v
between a velocity that is known to be too low and one that is too high. The search itself is not
differentiated. Two plain Newton steps follow it, and these are: each doubles the order to which the
velocity is exact, so that first, second and third derivatives are exact, in forward and in reverse
mode.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

if TYPE_CHECKING:
    from asperity.laws.law import Law

#: Initial guess of the search: ln of a micrometre per second.
_START = math.log(1e-6)

#: Bounds on ln v, next to where e^(ln v) leaves the range of doubles.
_LOWEST, _HIGHEST = -700.0, 700.0

#: Longest Newton step: where friction saturates its slope vanishes, and steps grow without bound.
_LEAP = 30.0

#: Error of ln v at which the search ends; two further Newton steps reach round-off.
_HAND_OVER = 1e-6

#: Bisection alone halves 1400 units of ln v to `_HAND_OVER` in 31 steps.
_MAX_STEPS = 100

Tangent = Callable[[Array], tuple[Array, Array]]


@partial(jax.jit, inline=True)  # on the host one program, not one for every operation
def invert_friction(law: Law, friction: ArrayLike, state: tuple[Array, ...], w: ArrayLike) -> Array:
    """ln(v in m/s) at which `law` carries F_i/W = `friction`.

    Parameters
    ----------
    law : Law
        Its friction must not decrease with the velocity at constant state.
    friction, state, w
        As for `Law.log_velocity`.

    Returns
    -------
    array
        -inf where the force is too small to be carried at any velocity, +inf where it is too
        large.
    """
    shape = jnp.broadcast_shapes(*(jnp.shape(a) for a in (friction, w, *state)))
    frozen = jax.tree.map(_constant, (law, friction, state, w))
    root = _search(_residual(*frozen), jnp.full(shape, _START))
    too_low, too_high = root < _LOWEST + 1, root > _HIGHEST - 1
    root = jnp.where(too_low | too_high, _START, root)
    residual = _residual(law, friction, state, w)
    for _ in range(2):
        value, slope = residual(root)
        root = root - value / slope
    return jnp.where(too_low, -jnp.inf, jnp.where(too_high, jnp.inf, root))


def _constant(leaf: object) -> object:
    """A leaf without derivatives."""
    return jax.lax.stop_gradient(leaf) if eqx.is_array_like(leaf) else leaf


def _residual(law: Law, friction: ArrayLike, state: tuple[Array, ...], w: ArrayLike) -> Tangent:
    """Friction of the law minus `friction`, and its slope, as functions of ln v."""

    def excess(log_v: Array) -> Array:
        return law.friction(jnp.exp(log_v), state, w) - friction

    return lambda log_v: jax.jvp(excess, (log_v,), (jnp.ones_like(log_v),))


def _search(residual: Tangent, start: Array) -> Array:
    """The root of every element to about `_HAND_OVER`."""

    def unfinished(carry: tuple) -> Array:
        *_, change, steps = carry
        return (steps < _MAX_STEPS) & jnp.any(jnp.abs(change) > _HAND_OVER)

    def body(carry: tuple) -> tuple:
        log_v, low, high, last, steps = carry
        value, slope = residual(log_v)
        low = jnp.where(value < 0, log_v, low)
        high = jnp.where(value > 0, log_v, high)
        step = jnp.where(slope > 0, -value / slope, -_LEAP * jnp.sign(value))
        step = jnp.clip(step, -_LEAP, _LEAP)
        aim = log_v + step
        # A Newton step is used if it stays between the bounds and is half of the last one.
        astray = (aim < low) | (aim > high) | (jnp.abs(step) > 0.5 * jnp.abs(last))
        change = jnp.where(astray, 0.5 * (low + high) - log_v, step)
        change = jnp.where(jnp.abs(last) > _HAND_OVER, change, 0.0)
        return log_v + change, low, high, change, steps + 1

    first = (start, start * 0 + _LOWEST, start * 0 + _HIGHEST, start * 0 + 4 * _LEAP, 0)
    return jax.lax.while_loop(unfinished, body, first)[0]
