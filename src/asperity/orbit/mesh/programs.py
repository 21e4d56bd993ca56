"""The compiled programs of orbits on meshes: solved, read and sampled, one for each shape."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import scaled_product
from asperity.orbit.batches import points_of
from asperity.orbit.mesh.condensation import condense, localise, transfer_maps
from asperity.orbit.mesh.mesh import Orbit, resampled, split
from asperity.orbit.mesh.newton import (
    NewtonResult,
    collocation_observables,
    newton_orbit,
    refined,
)
from asperity.orbit.observables import Observables, waveform
from asperity.slider.problem import Problem

#: Bounds on an exponent's change per Newton step: bold from a rough guess, since the change of
#: the slip rate is e to that.
_LARGEST_CHANGE = 2.0
_NEWTON_TOLERANCE = 1e-8

#: Meshes with fewer intervals are not read for the growth along the orbit, which takes as long as
#: the rest and matters for stiff orbits only.
_COARSE = 100

#: Times that a mesh is laid and Newton's method tried on it.
_ROUNDS = 4

#: A Newton change below this counts as converged: the one before it was about its square root.
ACCEPTED = 1e-6


@partial(jax.jit, static_argnames=("phases",))
def sample_orbit(problem_and_orbit: tuple[Problem, Orbit], *, phases: int) -> Array:
    """The waveform of orbits on a mesh, shape (2, phases, points)."""
    return waveform(*problem_and_orbit, phases)


def _observables(problem: Problem, orbit: Orbit, harmonics: int) -> Observables:
    fine = orbit.mesh.shape[0] > _COARSE
    return collocation_observables(*problem, orbit, harmonics=harmonics, growth=fine)


@partial(jit_large, static_argnames=("intervals",))
def remeshed(problem_and_orbit: tuple[Problem, Orbit], *, intervals: int) -> Orbit:
    """The orbit on an equidistributed mesh of `intervals` intervals."""
    problem, orbit = problem_and_orbit
    return refined(*problem, orbit, intervals)


@partial(jit_large, static_argnames=("intervals", "harmonics"))
def refine_orbit(
    problem_and_orbit: tuple[Problem, Orbit], *, intervals: int, harmonics: int
) -> tuple[Orbit, Observables, Array]:
    """The orbit on an equidistributed mesh of `intervals`, its observables and last Newton change.

    Where Newton's method failed, the orbit is the guess on the new mesh, a better initial guess for
    a finer one than the last iterate.
    """
    problem, guess = problem_and_orbit

    def unfinished(carry: tuple) -> Array:
        *_, error, rounds = carry
        return (rounds < _ROUNDS) & jnp.any(error > ACCEPTED)

    def body(carry: tuple) -> tuple:
        best, first, error, rounds = carry
        mesh = refined(*problem, best, intervals)
        result = solve_on_mesh(problem, mesh, 15)
        done = error < ACCEPTED
        # Even a failed attempt puts the mesh where the orbit is steep.
        usable = jnp.isfinite(result.error)
        moved = _where(usable, result.orbit, mesh)
        return (
            _where(done, best, moved),
            _where(rounds == 0, mesh, first),
            jnp.where(done, error, result.error),
            rounds + 1,
        )

    cut = resampled(guess, intervals)
    start = (cut, cut, jnp.full(points_of(problem), jnp.inf), 0)
    orbit, first, error, _ = jax.lax.while_loop(unfinished, body, start)
    orbit = _where(error < ACCEPTED, orbit, first)
    return orbit, _observables(problem, orbit, harmonics), error


def _where(condition: Array, yes: Orbit, no: Orbit) -> Orbit:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


@partial(jit_large, static_argnames=("harmonics",))
def read_orbit(problem_and_orbit: tuple[Problem, Orbit], *, harmonics: int) -> Observables:
    """The observables of an orbit as it is."""
    problem, orbit = problem_and_orbit
    return _observables(problem, orbit, harmonics)


@partial(jit_large, static_argnames=("parts",))
def split_observables(problem_and_orbit: tuple[Problem, Orbit], *, parts: int) -> Observables:
    """Multipliers by transfer maps over parts of the intervals, for stiff but smooth orbits."""
    problem, orbit = problem_and_orbit
    return _observables(problem, split(orbit, parts), 1)


@partial(jit_large, static_argnames=("parts",))
def piece_map(problem_and_piece: tuple[Problem, Orbit], *, parts: int) -> tuple[Array, Array]:
    """Transfer map (n, n, points) over a piece of an orbit, and the logarithm of its scale.

    From maps over the parts that each interval of the piece is cut into.
    """
    problem, piece = problem_and_piece
    fine = split(piece, parts)
    (response,) = condense(localise(*problem, fine), fine)
    return scaled_product(transfer_maps(response, fine))


def solve_on_mesh(problem: Problem, guess: Orbit, max_steps: int) -> NewtonResult:
    """Newton's method on the mesh of a guess, which may be rough."""
    return newton_orbit(
        *problem,
        guess,
        tolerance=_NEWTON_TOLERANCE,
        max_steps=max_steps,
        largest_change=_LARGEST_CHANGE,
    )
