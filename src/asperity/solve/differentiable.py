"""The fast solve as a function that JAX can differentiate, map and compile into larger programs.

By the implicit function theorem: the orbit is a fixed point Y = T(Y, p) of the iteration of
`asperity.solve.fourier`, so a cotangent c of Y is carried to the parameters by the solution of

    l = c + T_Y^T l,

found by the same contraction, transposed. The derivatives of the rates inside T may be held
constant there: they multiply a residual that is zero.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.solve.fourier import (
    States,
    advance,
    fourier_orbit,
    jacobian,
    load_cycle,
    rates_on,
    together,
)
from asperity.solve.fourier_reading import force_spectrum
from asperity.solve.linear import inverse_points

_Parts = tuple[States, States]
_Parameters = tuple[QuasiStatic, Harmonic]


class _Options(NamedTuple):
    nodes: int
    grading: float
    tolerance: float
    max_steps: int


def harmonic_response(
    system: QuasiStatic,
    load: Harmonic,
    *,
    harmonics: int = 2,
    nodes: int = 32,
    grading: float = 0.3,
    tolerance: float = 1e-10,
    max_steps: int = 40,
) -> tuple[Array, Array]:
    """Mean and harmonics of F/W0, differentiable in reverse mode with respect to every parameter.

    For modulation that is fast beside the interface, where Fourier collocation contracts and
    `nodes` resolve the slip pulse; nothing is checked here. `asperity.periodic_response` finds
    out whether that holds, and `asperity.sensitivities` has no such restriction.

    Parameters
    ----------
    system : QuasiStatic
        Parameters of shape (points,).
    load : Harmonic
        Amplitudes of shape (points,).
    harmonics : int
    nodes, grading, tolerance, max_steps
        As `asperity.solve.fourier.fourier_orbit`.

    Returns
    -------
    mean : array, shape (points,)
    harmonics : complex array, shape (harmonics, points)
        F/W0 = mean + sum Re(c_n e^{i n theta}).
    """
    orbit = _orbit(_Options(nodes, grading, tolerance, max_steps), (system, load))
    return force_spectrum(system, load_cycle(load, nodes, grading), *orbit, harmonics)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _orbit(options: _Options, parameters: _Parameters) -> _Parts:
    points = jnp.shape(parameters[1].epsilon)[-1]
    return fourier_orbit(*parameters, points, **options._asdict())[:2]


def _forward(options: _Options, parameters: _Parameters) -> tuple[_Parts, tuple]:
    orbit = _orbit(options, parameters)
    return orbit, (parameters, orbit)


def _backward(options: _Options, kept: tuple, cotangent: _Parts) -> tuple[_Parameters]:
    parameters, orbit = kept
    system, load = parameters
    cycle = load_cycle(load, options.nodes, options.grading)
    states = together(*orbit)
    J = jacobian(jax.linearize(rates_on(system, cycle), *states)[1], states)
    inverse = inverse_points([[cycle.share @ entry for entry in row] for row in J])

    def push(*change: Array) -> States:
        return tuple(sum(a * c for a, c in zip(row, change, strict=True)) for row in J)

    def linear(parts: _Parts) -> _Parts:
        return advance(cycle, inverse, parts[0], push(*together(*parts)), push)[:2]

    def iterate(parameters: _Parameters) -> _Parts:
        system, load = parameters
        cycle = load_cycle(load, options.nodes, options.grading)
        return advance(cycle, inverse, orbit[0], rates_on(system, cycle)(*states), push)[:2]

    transposed = jax.linear_transpose(linear, orbit)

    def body(carry: tuple) -> tuple:
        total, _, steps = carry
        new = jax.tree.map(jnp.add, cotangent, transposed(total)[0])
        size = _sum(jax.tree.map(jnp.abs, new))
        change = _sum(jax.tree.map(lambda a, b: jnp.abs(a - b), new, total))
        return new, change / (size + 1e-300), steps + 1

    def unfinished(carry: tuple) -> Array:
        return (carry[2] < options.max_steps) & (carry[1] > options.tolerance)

    total, _, _ = jax.lax.while_loop(unfinished, body, (cotangent, jnp.inf, 0))
    return jax.vjp(iterate, parameters)[1](total)


_orbit.defvjp(_forward, _backward)


def _sum(parts: _Parts) -> Array:
    return jnp.stack([a.sum() for a in jax.tree.leaves(parts)]).sum()
