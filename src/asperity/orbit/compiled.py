"""The compiled building blocks of the search: one jitted function per method and shape."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.small_systems import jacobian_columns, scaled_product, spectral_radius
from asperity.loads import Excitation, Harmonic
from asperity.orbit.methods.collocation.condensation import condense, localise, transfer_maps
from asperity.orbit.methods.collocation.inertial_guess import inertial_guess
from asperity.orbit.methods.collocation.mesh import Orbit, resampled, split
from asperity.orbit.methods.collocation.newton import (
    NewtonResult,
    averaged_orbit,
    collocation_observables,
    newton_orbit,
    refined,
)
from asperity.orbit.methods.fourier.observables import (
    fourier_observables,
)
from asperity.orbit.methods.fourier.orbit import FourierOrbit, fourier_orbit
from asperity.orbit.observables import Observables, waveform
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.adiabatic import even_phases
from asperity.theory.averaged import slip_pulse

#: Bounds on an exponent's change per Newton step: bold from a rough guess, since the change of
#: the slip rate is e to that.
_LARGEST_CHANGE = 2.0
_NEWTON_TOLERANCE = 1e-8

#: Meshes with fewer intervals are not read for the growth along the orbit, which takes as long as
#: the rest and matters for stiff orbits only.
_COARSE = 100

#: Phases at which the extremes of a load that is not harmonic are looked for.
_PHASES = 64

#: Times that a mesh is laid and Newton's method tried on it.
_ROUNDS = 4

#: Points in a block of the fast method; no power of two, at which arrays share cache lines.
FAST_BLOCK = 240

#: Points in a call of `stiffness_of_steady_sliding` and `sharpness_of_slip`.
STIFFNESS_CHUNK = 4096

#: Samples of waveforms in a call.
_SAMPLES = 2**17

#: A Newton change below this counts as converged: the one before it was about its square root.
ACCEPTED = 1e-6


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
    phases = even_phases(2 if isinstance(load, Harmonic) else _PHASES) * jnp.ones(_points(problem))
    return slip_pulse(system, load.at(phases)).sharpness


@jax.jit
def deepest_unloading(problem: Problem) -> Array:
    """Largest share of W0 that the modulation takes off the contacts: epsilon, or 1 - min w."""
    if isinstance(problem.load, Harmonic):
        return jnp.abs(jnp.asarray(problem.load.epsilon))
    w = problem.load.at(even_phases(_PHASES) * jnp.ones(_points(problem))).w
    return 1 - jnp.min(w, axis=0) * jnp.ones(_points(problem))


@partial(jit_large, static_argnames=("nodes", "grading", "harmonics"))
def fast_solve(
    problem: Problem, *, nodes: int, grading: float, harmonics: int
) -> tuple[Observables, Array, FourierOrbit]:
    """Fourier collocation: the observables, their estimated error and the orbits.

    Works on blocks of points that fit into a core's cache, each until its slowest point is done.
    """
    points = _points(problem)

    def solve(block: Problem) -> tuple[Observables, Array, FourierOrbit]:
        return _fast_block(block, nodes, grading, harmonics)

    blocks = jax.tree.map(lambda a: a.reshape(-1, FAST_BLOCK), problem)
    results = jax.lax.map(solve, blocks)
    return jax.tree.map(lambda a: jnp.moveaxis(a, 0, -2).reshape(*a.shape[1:-1], points), results)


def _fast_block(
    problem: Problem, nodes: int, grading: float, harmonics: int
) -> tuple[Observables, Array, FourierOrbit]:
    system, load = problem
    points = _points(problem)
    orbit = fourier_orbit(
        system, load, points, nodes=nodes, grading=grading, tolerance=1e-10, max_steps=40
    )
    observables, error = fourier_observables(system, load, orbit, harmonics=harmonics, max_steps=40)
    each = {name: jnp.full(points, getattr(orbit, name)) for name in ("steps", "grading")}
    return observables, error, orbit._replace(**each)


def samples_chunk(phases: int) -> int:
    """Points in a call that samples waveforms at so many phases."""
    return min(max(_SAMPLES // phases, 1), FAST_BLOCK)


@partial(jax.jit, static_argnames=("grading", "phases"))
def sample_fourier_orbit(
    problem_and_orbit: tuple[Problem, FourierOrbit], *, grading: float, phases: int
) -> Array:
    """The waveform of orbits of the fast method, shape (2, phases, points)."""
    problem, orbit = problem_and_orbit
    return waveform(problem, orbit._replace(grading=grading), phases)


@partial(jax.jit, static_argnames=("phases",))
def sample_orbit(problem_and_orbit: tuple[Problem, Orbit], *, phases: int) -> Array:
    """The waveform of orbits on a mesh, shape (2, phases, points)."""
    return waveform(*problem_and_orbit, phases)


def _observables(problem: Problem, orbit: Orbit, harmonics: int) -> Observables:
    fine = orbit.mesh.shape[0] > _COARSE
    return collocation_observables(*problem, orbit, harmonics=harmonics, growth=fine)


@partial(jit_large, static_argnames=("intervals",))
def first_orbit(problem: Problem, *, intervals: int) -> tuple[Orbit, Array]:
    """Collocation from the averaged limit, of which only the quasi-static equations are sure."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    guess = averaged_orbit(quasi_static, load, _points(problem), intervals=intervals, grading=0.5)
    result = _newton(Problem(quasi_static, load), guess, 30)
    if not isinstance(system, QuasiStatic):
        result = _newton(problem, inertial_guess(quasi_static, system, load, result.orbit), 30)
    return result.orbit, result.error


@partial(jit_large, static_argnames=("intervals", "max_steps"))
def follow_orbit(
    problem_and_orbit: tuple[Problem, Orbit], *, intervals: int, max_steps: int
) -> tuple[Orbit, Array]:
    """Collocation from a neighbouring orbit; the result lies on a mesh made for it."""
    problem, guess = problem_and_orbit
    result = _newton(problem, guess, max_steps)
    return refined(*problem, result.orbit, intervals), result.error


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
        result = _newton(problem, mesh, 15)
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
    start = (cut, cut, jnp.full(_points(problem), jnp.inf), 0)
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


def _newton(problem: Problem, guess: Orbit, max_steps: int) -> NewtonResult:
    return newton_orbit(
        *problem,
        guess,
        tolerance=_NEWTON_TOLERANCE,
        max_steps=max_steps,
        largest_change=_LARGEST_CHANGE,
    )
