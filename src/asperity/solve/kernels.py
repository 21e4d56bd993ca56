"""The compiled building blocks of the search: one jitted function per method and shape."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.loads import Excitation
from asperity.slider import QuasiStatic
from asperity.solve.averaged import slip_pulse
from asperity.solve.collocation import (
    NewtonResult,
    averaged_orbit,
    collocation_response,
    newton_orbit,
    refined,
)
from asperity.solve.condensation import condense, localise, transfer_maps
from asperity.solve.fourier import fourier_orbit
from asperity.solve.fourier_reading import fourier_response, fourier_start, fourier_waveform
from asperity.solve.lift import lifted
from asperity.solve.linear import jacobian_columns, product, spectral_radius
from asperity.solve.mesh import Orbit, evaluate, split

#: Bounds on an exponent's change per Newton step: bold from a rough guess, since the change of
#: the slip rate is e to that.
_LARGEST_CHANGE = 2.0
_NEWTON_TOLERANCE = 1e-8

#: Meshes with fewer intervals are not read for the growth along the orbit, which takes as long as
#: the rest and matters for stiff orbits only.
_COARSE = 100

#: Times that a mesh is laid and Newton's method tried on it.
_ROUNDS = 4

#: Points in a block of the fast method; no power of two, at which arrays share cache lines.
FAST_BLOCK = 240

#: A Newton change below this counts as converged: the one before it was about its square root.
ACCEPTED = 1e-6


class Problem(NamedTuple):
    """Equations and load of many operating points, parameters along the last axis."""

    system: Any
    load: Any


class Reading(NamedTuple):
    """What every method reads off an orbit, points along the last axis."""

    mean_friction: Array
    harmonics: Array
    monodromy: Array
    log_scale: Array
    log_determinant: Array
    growth: Array
    start: Array  # (size, points): the states at theta = 0
    waveform: Array  # (2, phases, points): F/W0 and ln(v_pl/V)


def _points(problem: Problem) -> int:
    return jax.tree.leaves(problem)[0].shape[-1]


@jax.jit
def stiffness_of_steady_sliding(problem: Problem) -> Array:
    """Largest rate per radian of a perturbation of steady sliding: small for fast modulation."""
    system = problem.system
    steady = jnp.broadcast_to(system.steady(), (system.size, _points(problem)))
    at = Excitation(jnp.ones(steady.shape[1:]))
    _, columns = jacobian_columns(lambda Y: system.rates(Y, at), steady)
    return spectral_radius(jnp.stack(columns, axis=1))


@jax.jit
def sharpness_of_slip(problem: Problem) -> Array:
    """Half the range of the exponent of the slip rate over the cycle."""
    system, load = problem
    extremes = load.at(jnp.array([[0.0], [jnp.pi]])).w * jnp.ones(_points(problem))
    return slip_pulse(system, extremes).sharpness


@partial(jax.jit, static_argnames=("nodes", "grading", "harmonics", "phases"))
def fast_solve(
    problem: Problem, *, nodes: int, grading: float, harmonics: int, phases: int
) -> tuple[Reading, Array, Array]:
    """Fourier collocation: the reading, its error estimate and the number of steps.

    Works on blocks of points that fit into a core's cache, each until its slowest point is done.
    """
    points = _points(problem)

    def solve(block: Problem) -> tuple[Reading, Array, Array]:
        return _fast_block(block, nodes, grading, harmonics, phases)

    blocks = jax.tree.map(lambda a: a.reshape(-1, FAST_BLOCK), problem)
    results = jax.lax.map(solve, blocks)
    return jax.tree.map(lambda a: jnp.moveaxis(a, 0, -2).reshape(*a.shape[1:-1], points), results)


def _fast_block(
    problem: Problem, nodes: int, grading: float, harmonics: int, phases: int
) -> tuple[Reading, Array, Array]:
    system, load = problem
    points = _points(problem)
    orbit = fourier_orbit(
        system, load, points, nodes=nodes, grading=grading, tolerance=1e-10, max_steps=40
    )
    response = fourier_response(
        system, load, orbit, grading=grading, harmonics=harmonics, max_steps=40
    )
    zero = jnp.zeros(points)
    reading = Reading(
        response.mean_friction,
        response.harmonics,
        response.monodromy,
        zero,
        response.log_determinant,
        zero,
        fourier_start(orbit),
        fourier_waveform(system, load, orbit, grading=grading, phases=phases),
    )
    return reading, response.error, jnp.full(points, orbit.steps)


def _read(problem: Problem, orbit: Orbit, harmonics: int, phases: int) -> Reading:
    system, load = problem
    fine = orbit.mesh.shape[0] > _COARSE
    response = collocation_response(system, load, orbit, harmonics=harmonics, growth=fine)
    theta = jnp.asarray(2 * np.pi * np.arange(phases) / max(phases, 1))[:, None]
    theta = theta * jnp.ones(_points(problem))
    if phases:
        Y = orbit.centre[:, None] + evaluate(orbit, theta)[0]
        at = load.at(theta)
        waveform = jnp.stack([system.force(Y, at), system.log_slip(Y, at)])
    else:
        waveform = jnp.zeros((2, 0, _points(problem)))
    return Reading(*response, orbit.centre, waveform)


@partial(jit_large, static_argnames=("intervals",))
def first_orbit(problem: Problem, *, intervals: int) -> tuple[Orbit, Array]:
    """Collocation from the averaged limit, of which only the quasi-static equations are sure."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    guess = averaged_orbit(quasi_static, load, _points(problem), intervals=intervals, grading=0.5)
    result = _newton(Problem(quasi_static, load), guess, 30)
    if not isinstance(system, QuasiStatic):
        result = _newton(problem, lifted(quasi_static, system, load, result.orbit), 30)
    return result.orbit, result.error


@partial(jit_large, static_argnames=("intervals", "max_steps"))
def follow_orbit(
    problem_and_orbit: tuple[Problem, Orbit], *, intervals: int, max_steps: int
) -> tuple[Orbit, Array]:
    """Collocation from a neighbouring orbit; the result lies on a mesh made for it."""
    problem, guess = problem_and_orbit
    result = _newton(problem, guess, max_steps)
    return refined(*problem, result.orbit, intervals), result.error


@partial(jit_large, static_argnames=("intervals", "harmonics", "phases"))
def refine_orbit(
    problem_and_orbit: tuple[Problem, Orbit], *, intervals: int, harmonics: int, phases: int
) -> tuple[Orbit, Reading, Array]:
    """The orbit on an equidistributed mesh of `intervals`, its reading and last Newton change.

    Where Newton's method failed, the orbit is the guess on the new mesh: a better start for a finer
    one than what the failure left.
    """
    problem, guess = problem_and_orbit

    def unfinished(carry: tuple) -> Array:
        _, error, rounds = carry
        return (rounds < _ROUNDS) & jnp.any(error > ACCEPTED)

    def body(carry: tuple) -> tuple:
        best, error, rounds = carry
        mesh = refined(*problem, best, intervals)
        result = _newton(problem, mesh, 15)
        done = error < ACCEPTED
        # What a failure left has at least put the mesh where the orbit is steep.
        usable = jnp.isfinite(result.error)
        moved = _where(usable, result.orbit, mesh)
        return (
            _where(done, best, moved),
            jnp.where(done, error, result.error),
            rounds + 1,
        )

    first = refined(*problem, guess, intervals)
    start = (first, jnp.full(_points(problem), jnp.inf), 0)
    orbit, error, _ = jax.lax.while_loop(unfinished, body, start)
    orbit = _where(error < ACCEPTED, orbit, first)
    return orbit, _read(problem, orbit, harmonics, phases), error


def _where(condition: Array, yes: Orbit, no: Orbit) -> Orbit:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


@partial(jit_large, static_argnames=("harmonics", "phases"))
def read_orbit(
    problem_and_orbit: tuple[Problem, Orbit], *, harmonics: int, phases: int = 0
) -> Reading:
    """The reading of an orbit as it is."""
    problem, orbit = problem_and_orbit
    return _read(problem, orbit, harmonics, phases)


@partial(jit_large, static_argnames=("parts",))
def split_reading(problem_and_orbit: tuple[Problem, Orbit], *, parts: int) -> Reading:
    """Multipliers by transfer maps over parts of the intervals, for stiff but smooth orbits."""
    problem, orbit = problem_and_orbit
    return _read(problem, split(orbit, parts), 1, 0)


@partial(jit_large, static_argnames=("parts",))
def piece_map(problem_and_piece: tuple[Problem, Orbit], *, parts: int) -> tuple[Array, Array]:
    """Transfer map (n, n, points) over a piece of an orbit, and the logarithm of its scale.

    From maps over the parts that each interval of the piece is cut into.
    """
    problem, piece = problem_and_piece
    fine = split(piece, parts)
    (response,) = condense(localise(*problem, fine), fine)
    maps, log_scale = transfer_maps(response, fine), jnp.zeros(_points(problem))
    while maps.shape[2] > 1:  # neighbours first: much is done side by side
        if maps.shape[2] % 2:
            identity = jnp.broadcast_to(jnp.eye(len(maps))[..., None, None], maps[:, :, :1].shape)
            maps = jnp.concatenate([maps, identity], axis=2)
        maps = product(maps[:, :, 1::2], maps[:, :, ::2])
        size = jnp.abs(maps).max((0, 1))
        size = jnp.where(size > 0, size, 1.0)
        maps = maps / size
        log_scale = log_scale + jnp.log(size).sum(0)
    return maps[:, :, 0], log_scale


def _newton(problem: Problem, guess: Orbit, max_steps: int) -> NewtonResult:
    return newton_orbit(
        *problem,
        guess,
        tolerance=_NEWTON_TOLERANCE,
        max_steps=max_steps,
        largest_change=_LARGEST_CHANGE,
    )
