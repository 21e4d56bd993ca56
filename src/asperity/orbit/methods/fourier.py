"""The fast method: Fourier collocation for orbits that move little within a period.

The states are split into means and zero-mean parts. One step of the iteration

1. evaluates the rates on a uniform grid in tau,
2. moves the means by a Newton step, so that the mean rates vanish,
3. integrates the zero-mean part of the rates spectrally, which gives the new zero-mean part.

It is a linear iteration that contracts by about the change of the slip exponent in a period, a few
hundredths in the regime of Bureau et al.; where it does not contract, the orbit is left to
`asperity.orbit.methods.collocation`. The means need to contract no faster than the zero-mean parts,
so their Newton matrix stays that of the averaged limit. The zero-mean part is a separate unknown,
so the harmonics keep their relative accuracy however small they are.

Grid: theta = tau + g sin(tau) puts the nodes where the load is lightest and the slip pulse narrow.

States and rates are tuples with an array for each state, not stacks: a stack is written to memory
before it is read, and access to memory limits these programs.

Mean, harmonics and the logarithm of the monodromy matrix are read on the same grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.contraction import Equations
from asperity.algebra.fourier_grid import antiderivative, grid, interpolation
from asperity.algebra.small_systems import Matrix, apply, inverse_points, jacobian
from asperity.arrays import Float
from asperity.loads import Excitation, Harmonic
from asperity.orbit.batches import FAST_BLOCK, FEW, chunk_of, points_of, run_chunks, take
from asperity.orbit.floquet import floquet_form
from asperity.orbit.mesh.mesh import eccentric_phase
from asperity.orbit.observables import Observables, waveform
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.slider import QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.limits import averaged_limit

States = tuple[Array, ...]

#: Round-off of the slip exponent; changes do not fall below this value.
_ROUND_OFF = 1e-12

#: The averaged limit is itself no closer to the orbit than this.
_AVERAGED_TOLERANCE = 1e-2
#: Bound on the error estimated from the observed contraction, and the largest number of steps.
_TOLERANCE, _MOST_STEPS = 1e-10, 40

#: Convergence is checked at every third node: the changes are smooth.
_LOOKED_AT = slice(1, None, 3)


class FourierOrbit(NamedTuple):
    """An orbit on the grid theta = tau + g sin(tau), one array for each state.

    A zero-mean part of 1e-9 of the mean keeps its digits, and hundreds of points fit into the cache
    of a core; `asperity.orbit.mesh.mesh.Orbit` is for orbits that are steep.

    Attributes
    ----------
    mean : tuple of arrays, shape (points,)
    zero_mean : tuple of arrays, shape (nodes, points)
        Arrays of zero mean in tau.
    error : array, shape (points,)
    steps : int
    grading : float
        g.
    """

    mean: States
    zero_mean: States
    error: Array
    steps: Array
    grading: float

    @property
    def start(self) -> Array:
        """States at theta = 0, shape (size, points)."""
        return self._interpolated(np.zeros(1))[:, 0]

    def states(self, theta: np.ndarray) -> Array:
        """States at the phases `theta`, a column: shape (size, phases, points)."""
        return self._interpolated(eccentric_phase(theta[:, 0], self.grading))

    def _interpolated(self, tau: np.ndarray) -> Array:
        kernel = interpolation(tau, grid(len(self.zero_mean[0]))[0])
        # NumPy or JAX, as the arrays are.
        xp = self.zero_mean[0].__array_namespace__()
        return xp.stack([m + kernel @ y for m, y in zip(self.mean, self.zero_mean, strict=True)])


class LoadCycle(NamedTuple):
    """The load cycle on the grid."""

    theta: np.ndarray  # (nodes,)
    stretch: np.ndarray  # (nodes,), dtheta/dtau
    integral: np.ndarray  # (nodes, nodes), zero-mean antiderivative in tau
    at: Excitation  # arrays (nodes, points)

    @property
    def share(self) -> np.ndarray:
        """Weight of each node in a mean over theta, shape (nodes,)."""
        return self.stretch / len(self.stretch)


def load_cycle(problem: Problem, nodes: int, grading: float) -> LoadCycle:
    """The load cycle on a grid of `nodes` per period."""
    tau, integral = grid(nodes)
    theta = tau + grading * np.sin(tau)
    at = problem.load.at(jnp.asarray(theta)[:, None])
    shape = (nodes, points_of(problem))
    at = jax.tree.map(lambda a: jnp.broadcast_to(a, shape) if jnp.ndim(a) else a, at)
    return LoadCycle(theta, 1 + grading * np.cos(tau), integral, at)


@dataclass(frozen=True)
class GridEquations(Equations):
    """Equations of an orbit on the grid theta = tau + g sin(tau).

    Parameters
    ----------
    nodes : int
    grading : float
        g.
    """

    nodes: int
    grading: float

    def cycle(self, problem: Problem) -> LoadCycle:
        """The load on the grid."""
        return load_cycle(problem, self.nodes, self.grading)


def rates_on(system: QuasiStatic, cycle: LoadCycle) -> Callable[..., States]:
    """The rates per radian on the grid, as a function of the states one by one."""

    def rates(*states: Array) -> States:
        return tuple(system.rates(jnp.stack(states), cycle.at))

    return rates


def jacobian_on(system: QuasiStatic, cycle: LoadCycle, states: States) -> Matrix:
    """Derivatives of the rates on the grid to the states, [i][j] of shape (nodes, points)."""
    _, push = jax.linearize(rates_on(system, cycle), *states)
    return jacobian(push, states)


def together(mean: States, zero_mean: States) -> States:
    """The states on the grid."""
    return tuple(m + y for m, y in zip(mean, zero_mean, strict=True))


def advance(
    cycle: LoadCycle,
    inverse: Matrix,
    mean: States,
    rates: States,
    push: Callable[..., States],
    largest: float = jnp.inf,
) -> tuple[States, States, States]:
    """One step of the iteration: the new means and zero-mean parts, and the change of the means.

    Parameters
    ----------
    inverse : Matrix
        Approximate inverse of the derivatives of the mean rates to the means.
    rates : States
        At the present states.
    push : callable
        Change of the rates with the states, to first order.
    largest : float
        Bound on the change of a mean.
    """
    half = len(cycle.theta) // 2
    # Sum mirror images first: odd functions of theta then cancel exactly.
    residual = [cycle.share[:half] @ (r[:half] + r[half:]) for r in rates]
    change = tuple(-c for c in apply(inverse, residual))
    if largest < jnp.inf:
        change = tuple(jnp.clip(c, -largest, largest) for c in change)
    follow = push(*(c + jnp.zeros_like(r) for c, r in zip(change, rates, strict=True)))
    integral = cycle.integral * cycle.stretch
    zero_mean = tuple(antiderivative(integral, r + f) for r, f in zip(rates, follow, strict=True))
    return together(mean, change), zero_mean, change


def _largest_change(change: States, new: States, old: States, kappa: Array) -> Array:
    """Largest change of means and zero-mean parts: z relative to its size, log states absolutely.

    The rate of z is kappa times a number with the round-off of 1, which bounds what a vanishing
    z can mean.
    """
    moved = [jnp.abs(a - b)[_LOOKED_AT].max(0) for a, b in zip(new, old, strict=True)]
    size = jnp.abs(new[0])[_LOOKED_AT].max(0) + 1e-3 * kappa
    return jnp.stack([moved[0] / size, *moved[1:], *map(jnp.abs, change)]).max(0)


def iterated(
    step: Callable[[Any, Array], tuple[Any, Array]],
    start: Any,
    points: int,
    tolerance: float,
    round_off: float,
    max_steps: int,
) -> tuple[Any, Array, Array]:
    """Repeat a contraction until the estimated error of every point is below a tolerance.

    Parameters
    ----------
    step : callable
        Takes unknowns and their last change, (points,), inf before the first step; returns new
        unknowns and their change.
    start : pytree
    points : int
    tolerance : float
        Bound on the error estimated from the observed contraction.
    round_off : float
        Round-off of a change.
    max_steps : int

    Returns
    -------
    unknowns : pytree
    error : array, shape (points,)
        inf where the iteration does not contract.
    steps : array, shape ()
    """

    def unfinished(carry: tuple) -> Array:
        _, change, error, steps = carry
        return (steps < max_steps) & jnp.any((error > tolerance) & ~jnp.isnan(change))

    def body(carry: tuple) -> tuple:
        unknowns, last, reached, steps = carry
        unknowns, change = step(unknowns, last)
        # A contraction by r leaves an error of r / (1 - r) times the change.
        r = jnp.where(jnp.isinf(last), 0.5, change / last)
        error = jnp.where(r < 1, change * r / (1 - r), jnp.inf)
        error = jnp.where(change < round_off, change, error)
        # Further steps change converged points by round-off only.
        return unknowns, change, jnp.where(reached <= tolerance, reached, error), steps + 1

    far = jnp.full(points, jnp.inf)
    unknowns, change, error, steps = jax.lax.while_loop(unfinished, body, (start, far, far, 0))
    return unknowns, jnp.where(jnp.isnan(change), jnp.inf, error), steps


def fourier_orbit(problem: Problem, *, nodes: int, grading: float) -> FourierOrbit:
    """Iterate to the periodic orbit of every operating point.

    Parameters
    ----------
    problem : Problem
        Of a `QuasiStatic` system, parameters of shape (points,).
    nodes : int
        Grid points per period, even.
    grading : float
        g in theta = tau + g sin(tau), 0 <= g < 1.

    Returns
    -------
    FourierOrbit
        `error` holds the estimate; inf where the iteration does not contract.
    """
    (system, load), points = problem, points_of(problem)
    cycle = load_cycle(problem, nodes, grading)
    # Of a load that is known to be even, half of the symmetric grid suffices.
    part = nodes // 2 if isinstance(load, Harmonic) else nodes
    at = jax.tree.map(lambda a: a[:part] if jnp.ndim(a) else a, cycle.at)
    share = cycle.share[:part] / cycle.share[:part].sum()
    averaged = averaged_limit(system, at, share, tolerance=_AVERAGED_TOLERANCE)
    inverse = inverse_points(averaged.matrix)
    rates_of = rates_on(system, cycle)
    zero = (jnp.zeros((nodes, points)),) * system.size

    def step(unknowns: tuple[States, States], _: Array) -> tuple[tuple[States, States], Array]:
        mean, zero_mean = unknowns
        rates, push = jax.linearize(rates_of, *together(mean, zero_mean))
        mean, new, moved = advance(cycle, inverse, mean, rates, push)
        return (mean, new), _largest_change(moved, new, zero_mean, system.kappa)

    start = averaged.centre, zero
    (mean, zero_mean), error, steps = iterated(
        step, start, points, _TOLERANCE, _ROUND_OFF, _MOST_STEPS
    )
    return FourierOrbit(mean, zero_mean, error, steps, grading)


def per_tau(cycle: LoadCycle, J: Matrix) -> Matrix:
    """Derivatives of the rates per unit of tau, from those per radian."""
    return [[cycle.stretch[:, None] * entry for entry in row] for row in J]


def fourier_observables(
    problem: Problem, orbit: FourierOrbit, harmonics: int
) -> tuple[Observables, Array]:
    """Observables of a converged orbit, and their estimated error, (points,).

    The error is the largest of those of the orbit, of the Floquet iteration and of the truncation.

    Parameters
    ----------
    problem : Problem
        As for `fourier_orbit`.
    orbit : FourierOrbit
    harmonics : int
        Their number.
    """
    system = problem.system
    cycle = load_cycle(problem, len(orbit.zero_mean[0]), orbit.grading)
    mean, phasors = force_spectrum(system, cycle, orbit.mean, orbit.zero_mean, harmonics)
    states = together(orbit.mean, orbit.zero_mean)
    J = jacobian_on(system, cycle, states)
    trace = sum(cycle.share @ row[i] for i, row in enumerate(J))
    floquet = floquet_form(per_tau(cycle, J), cycle.integral)
    error = orbit_error(system, cycle, orbit, harmonics)
    zero = jnp.zeros_like(mean)
    observables = Observables(
        mean,
        phasors,
        jnp.full_like(floquet.exponent, jnp.nan),
        zero,
        2 * jnp.pi * trace,
        floquet.exponent,
        jnp.full_like(mean, jnp.inf),
        orbit.start,
        system.reversal_margin(jnp.stack(states), cycle.at).min(0),
    )
    return observables, jnp.where(floquet.converged, error, jnp.inf)


def orbit_error(
    system: QuasiStatic, cycle: LoadCycle, orbit: FourierOrbit, harmonics: int
) -> Array:
    """Estimated error of mean and harmonics: of the iteration or of the truncation, (points,)."""
    error = jnp.maximum(orbit.error, truncation(orbit.zero_mean[0], harmonics))
    # An interface that sticks for part of the period has kinks, which no Fourier series resolves.
    states = jnp.stack(together(orbit.mean, orbit.zero_mean))
    sticks = jnp.isneginf(system.log_slip(states, cycle.at)).any(0)
    return jnp.where(sticks, jnp.inf, error)


def force_spectrum(
    system: QuasiStatic, cycle: LoadCycle, mean: States, zero_mean: States, harmonics: int
) -> tuple[Array, Array]:
    """Mean of F/W0 and its complex harmonics, shape (harmonics, points)."""
    constant, force = system.force_split(jnp.stack(mean), jnp.stack(zero_mean), cycle.at)
    return spectrum(cycle, constant, force, harmonics)


def spectrum(
    cycle: LoadCycle, constant: Array, force: Array, harmonics: int
) -> tuple[Array, Array]:
    """Spectrum of a constant, (points,), plus a zero-mean part on the grid, (nodes, points)."""
    angle = np.arange(harmonics + 1)[:, None] * cycle.theta
    # One product for all: a mean, cosines and sines.
    waves = (np.concatenate([np.cos(angle), -np.sin(angle[1:])]) * cycle.share) @ force
    cosine, sine = waves[1 : harmonics + 1], waves[harmonics + 1 :]
    return constant + waves[0], 2 * jax.lax.complex(cosine, sine)


def truncation(waves: Array, harmonics: int) -> Array:
    """Estimate of the aliasing error of the harmonics from the end of the spectrum in tau.

    Parameters
    ----------
    waves : array, shape (nodes, points)
    harmonics : int

    Returns
    -------
    array, shape (points,)

    Notes
    -----
    A coefficient of order nodes - n aliases into order n. The spectra fall off at least
    geometrically, so that coefficient is about the square of the one at (nodes - n) / 2.
    """
    nodes = len(waves)
    orders = np.array([1, 2, *range((nodes - harmonics) // 2, nodes // 2)])[:, None]
    angle = orders * grid(nodes)[0]
    power = (np.cos(angle) @ waves) ** 2 + (np.sin(angle) @ waves) ** 2
    scale = jnp.sqrt(power[0]) * jnp.sqrt(jnp.minimum(power[0], power[1]))
    return power[2:].max(0) / (scale + 1e-300)


def fast_solve(
    problem: Problem, *, nodes: int, grading: float, harmonics: int, orbits: bool
) -> tuple[Observables, Array, Array, FourierOrbit | None]:
    """Fourier collocation: the observables, their estimated error, steps, and orbits if wanted.

    Works on blocks of points that fit into a core's cache, each until its slowest point is done.
    """
    points = points_of(problem)

    def solve(block: Problem) -> tuple[Observables, Array, Array, FourierOrbit | None]:
        count = points_of(block)
        orbit = fourier_orbit(block, nodes=nodes, grading=grading)
        observables, error = fourier_observables(block, orbit, harmonics)
        each = {name: jnp.full(count, getattr(orbit, name)) for name in ("steps", "grading")}
        return observables, error, each["steps"], orbit._replace(**each) if orbits else None

    blocks = jax.tree.map(lambda a: a.reshape(-1, min(points, FAST_BLOCK)), problem)
    results = jax.lax.map(solve, blocks)
    return jax.tree.map(lambda a: jnp.moveaxis(a, 0, -2).reshape(*a.shape[1:-1], points), results)


_STATIC = ("nodes", "grading", "harmonics", "orbits")
_solve_many = jit_large(fast_solve, _STATIC)
#: A few points take 2.4 ms in place of 1.9, and the first of them 0.7 s in place of 1.2.
_solve_few = jit_large(fast_solve, _STATIC, brief=True)


#: Grids (nodes, grading), each after the sharpness of the slip pulse it is fine enough for: the
#: nodes that a pulse needs grow with the root of it.
_GRIDS = ((5.0, 24, 0.3), (18.0, 32, 0.3), (300.0, 128, 0.5))
#: Points in a call: enough to spread the cost of a call.
_CHUNK = 4 * FAST_BLOCK
#: Estimated error that is accepted.
_ERROR = 1e-9
#: Rate per radian of a disturbance above which the iteration does not contract fast enough: of
#: 2,600 points of eight laws, drawn at random with rates from 0.75 to 1, it converged at 23, nearly
#: all with epsilon below 1e-6. Without modulation the iteration takes a single step at any rate,
#: but the linear systems of derivatives take many.
LARGEST_CONTRACTING_RATE = 0.75


class Fourier(Method):
    """Fourier collocation, for orbits that move little within a period."""

    name = "fourier"
    choice = "fourier"
    on_mesh = False
    block = 2**20

    def suits(self, problem: Problem) -> bool:
        """Without inertia and damping."""
        return isinstance(problem.system, QuasiStatic)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; a grid gives its failures to the next, finer one."""
        points = np.arange(problem.system.V.shape[-1])
        solution = Solution.unsolved(problem, options)
        rate, sharpness, _ = steady_sliding(problem)
        left = points[rate < LARGEST_CONTRACTING_RATE]
        # A block runs until its slowest point has converged, so points are sorted by difficulty.
        left = left[np.argsort(rate[left], kind="stable")]
        for sharpest, nodes, grading in _GRIDS:
            # A few points take the finest grid at once: its time is short, compiling grids is not.
            if len(left) <= FAST_BLOCK and nodes < _GRIDS[-1][1]:
                continue
            chosen = left[sharpness[left] <= sharpest]
            size = chunk_of(chosen, _CHUNK)
            solve = partial(
                _solve_few if size == FEW else _solve_many,
                nodes=nodes,
                grading=grading,
                harmonics=options.harmonics,
                orbits=options.phases > 0,
            )
            for part, (observables, error, steps, orbit) in run_chunks(
                solve, (problem,), chosen, size
            ):
                good = np.flatnonzero(error < _ERROR)
                every = len(good) == len(part)
                solution.store(part[good], observables if every else take(observables, good))
                solution.iterations[part] += steps
                if options.phases:
                    sample = partial(_sample, grading=grading, phases=options.phases)
                    inputs = (take(problem, part), orbit)
                    size = chunk_of(good, FAST_BLOCK)
                    for some, samples in run_chunks(sample, inputs, good, size):
                        solution.waveform[..., part[some]] = samples
                options.progress(len(good))
            left = left[~solution.converged[left]]
        return solution


def _sample(problem: Problem, orbit: FourierOrbit, *, grading: float, phases: int) -> Float:
    return waveform(problem, orbit._replace(grading=grading), phases)
