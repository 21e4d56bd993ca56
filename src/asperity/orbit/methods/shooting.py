"""Shooting: Newton's method on the states at theta = 0.

1. Newton's method from the averaged limit, on a coarse division of the period.
2. The orbit on finer divisions, each with twice the steps of the one before, until mean, harmonics
   and multipliers of two of them agree: the error of a method of order 8 falls by 2^8.

The determinant of the monodromy matrix is compared with Liouville's formula, a quadrature that
does not use the integrated derivatives. Points that fail a check are left to other methods.

States and their derivatives with respect to the initial states are integrated by the explicit
method of order 8 of Dormand and Prince, all operating points in lock step and without step-size
control: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section II.5. The derivatives at the end of the period are the monodromy matrix.

The initial guess is the averaged limit of a slider that swings on its asperities, as that of
`asperity.orbit.methods.inertial_fourier`, with a mean relaxation by slip.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from asperity._jax import jit_large
from asperity.algebra.fourier_grid import interpolation
from asperity.algebra.runge_kutta import dormand_prince_8
from asperity.algebra.small_systems import solve_columns, value_and_jacobian
from asperity.arrays import Bool, Complex, Float, Index
from asperity.loads import Excitation
from asperity.orbit.batches import points_of, run_chunks, take
from asperity.orbit.floquet import multiplier_gap
from asperity.orbit.mesh.mesh import eccentric_phase
from asperity.orbit.methods.inertial_fourier import sticking_joint
from asperity.orbit.observables import Observables, response_gap, waveform_of
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider import Inertial, Motion, QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.limits import averaged_limit, even_phases

#: Samples of the load for the averaged limit.
_NODES = 48


@jit_large
def averaged_start(problem: Problem) -> tuple[Array, Array]:
    """Initial states, (size, points), and the fastest relaxation by slip, per radian."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    theta = 2 * np.pi * np.arange(_NODES)[:, None] / _NODES
    points = jnp.ones(points_of(problem))
    at = load.at(jnp.asarray(theta))
    at = at._replace(w=at.w * points)
    softening = _softening(problem, points)
    swing, velocity = sticking_joint(problem, at, theta, softening)
    # The load under which a joint without inertia carries the same force.
    w = 1 / swing - quasi_static.compliance_ratio
    centre = averaged_limit(quasi_static, at._replace(w=w), np.full(_NODES, 1 / _NODES)).centre
    Y = jnp.stack(centre)[:, None]
    force = quasi_static.force(Y, Excitation(points)) + 0 * w
    friction = quasi_static.friction(Y, Excitation(w))
    mechanical = force + system.damping, 1 + velocity * Y[0], friction
    states = jnp.stack(jnp.broadcast_arrays(*mechanical, *quasi_static.law_state(Y)))
    # The states of the law follow the elastic motion, by a small amount.
    orders = np.arange(1, _NODES // 2)[:, None]
    integral = -2 / _NODES * (np.sin(orders * theta[:, 0]) / orders).sum(0)
    n = len(system.mechanical)
    law_states = states[n:, 0] + jnp.einsum("k,nkb->nb", integral, system.rates(states, at)[n:])
    relaxation = system.strain * softening * jnp.exp(system.log_slip(states, at)).max(0)
    return jnp.concatenate([states[:n, 0], law_states]), relaxation


def _softening(problem: Problem, points: Array) -> Array:
    """Change of ln(v_pl) with F_i/W in steady sliding, (points,)."""
    system = problem.system
    steady = jnp.broadcast_to(system.steady(), (system.size, len(points)))
    carried = jnp.zeros_like(steady).at[system.mechanical.index("friction")].set(1.0)
    return jax.jvp(lambda Y: system.log_slip(Y, Excitation(points)), (steady,), (carried,))[1]


class _Divisions(NamedTuple):
    """Numbers of steps in the period: for Newton's method, and for the refinement."""

    fastest: float  # relaxation by slip per radian that they resolve
    coarse: int  # number of steps of Newton's method
    finer: tuple[int, ...]  # numbers of steps of the refinement
    grading: float  # of the steps towards the pulse of slip


_DIVISIONS = (
    _Divisions(2.0, 16, (24, 48, 96), 0.0),
    _Divisions(5.0, 16, (28, 56, 112), 0.2),
    _Divisions(40.0, 24, (40, 80, 160), 0.3),
    # Sharp pulses of slip at deep modulation.
    _Divisions(40.0, 32, (64, 128, 256, 512), 0.6),
)

#: Points in a call while many are left, and when few are left; no powers of two, at which arrays
#: share cache lines.
_CHUNK, _FEW = 240, 24

#: Newton steps on a division, and the largest change of an exponent in one.
_NEWTON_STEPS, _LARGEST_CHANGE = 12, 3.0
#: Largest Newton change on the coarse division, at which the finer divisions begin (the next change
#: would be about its square); on the first of two finer divisions that are compared; and on the
#: second of them.
_NEAR, _CLOSED, _ACCEPTED = 2e-2, 1e-6, 1e-9
#: Largest number of chord steps on a finer division, each of which makes a change a hundred times
#: smaller or more, and the change below which no further chord step is taken.
_CHORDS, _NEARLY_CLOSED = 4, 1e-5
#: Agreement of two divisions, relative; the finer one is then good to 2e-6 / 2^8.
_AGREEMENT = 2e-6
#: Agreement of the determinant with Liouville's formula, a check of the finer division alone.
_LIOUVILLE = 1e-8


class Shooting(Method):
    """Newton's method on the first states, and the orbit on finer and finer divisions."""

    name = "shooting"
    choice = "fourier"
    on_mesh = False
    block = 100 * _CHUNK

    def suits(self, problem: Problem) -> bool:
        """With inertia on elastic asperities, whose equations are not stiff."""
        return isinstance(problem.system, Inertial)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; slower relaxation by slip allows coarser divisions of the period."""
        size, rows = problem.system.size, np.arange(problem.system.V.shape[-1])
        solution = Solution.unsolved(problem, options)
        guess, relaxation = np.empty((size, len(rows))), np.empty(len(rows))
        for members, values in run_chunks(averaged_start, (problem,), rows, _chunk(rows)):
            guess[:, members], relaxation[members] = values
        # Points of similar difficulty belong together.
        rows = np.argsort(relaxation, kind="stable")
        for divisions in _DIVISIONS:
            chosen = rows[relaxation[rows] <= divisions.fastest]
            _refine(problem, solution, options, divisions, guess.copy(), chosen)
            rows = rows[~solution.converged[rows]]
        return solution


def _refine(
    problem: Problem,
    solution: Solution,
    options: SearchOptions,
    divisions: _Divisions,
    first: Float,
    rows: Index,
) -> None:
    """Solve points on finer and finer divisions of the period until two divisions agree.

    Parameters
    ----------
    problem : Problem
    solution : Solution
        Receives orbits.
    options : SearchOptions
    divisions : _Divisions
    first : array, shape (size, points)
        Guess of the first states; changed.
    rows : array of int
        In the order in which they are solved.
    """
    size, points = first.shape
    inverse = np.zeros((size, size, points))  # of the unit matrix minus the monodromy matrix
    # Results on the previous division; NaN before the first.
    numbers = np.full((1 + options.harmonics, points), np.nan + 0j)
    logs = np.full(first.shape, np.nan + 0j)
    limits = (_NEAR, _CLOSED, *[_ACCEPTED] * len(divisions.finer))
    for count, limit in zip((divisions.coarse, *divisions.finer), limits, strict=False):
        steps = period_steps(count, divisions.grading, options.harmonics)
        if limit < _NEAR:
            rows = _chords(problem, first, inverse, rows, steps)
        unresolved = []
        for _ in range(_NEWTON_STEPS):
            far = []
            for members, reached in run_chunks(
                partial(newton_pass, steps=steps), (problem, first), rows, _chunk(rows)
            ):
                inverse[..., members] = reached.inverse
                finite = np.isfinite(reached.leap) & np.isfinite(reached.step).all(0)
                closed = np.flatnonzero(finite & (reached.change <= limit))
                at, agreed = members[closed], np.zeros(len(closed), bool)
                if limit < _NEAR:
                    observed = take(reached.observables, closed)
                    agreed = _agreed(observed, numbers[:, at], logs[:, at])
                    agreed &= reached.change[closed] <= _ACCEPTED
                    numbers[:, at], logs[:, at] = observed.numbers, observed.log_multipliers
                    kept = np.flatnonzero(agreed)
                    solution.store(at[kept], take(observed, kept))
                    solution.iterations[at[kept]] = count
                    options.progress(len(kept))
                    _sample(problem, solution, first, at[kept], steps, divisions.grading)
                shortened = np.minimum(1.0, _LARGEST_CHANGE / np.maximum(reached.leap, 1e-300))
                first[:, members[finite]] += (shortened * reached.step)[:, finite]
                unresolved.append(at[~agreed])
                far.append(members[finite & (reached.change > limit)])
            rows = _joined(far)
        rows = _joined(unresolved)


def _chords(problem: Problem, first: Float, inverse: Float, rows: Index, steps: Steps) -> Index:
    """Chord steps with the matrices of a coarser division, in place; the rows that stay finite."""
    solve, nearly = partial(chord_step, steps=steps), []
    for _ in range(_CHORDS):
        far = []
        inputs = (problem, first, inverse)
        for members, (start, change) in run_chunks(solve, inputs, rows, _chunk(rows)):
            good = np.isfinite(change)
            first[:, members[good]] = start[:, good]
            nearly.append(members[change < _NEARLY_CLOSED])
            far.append(members[good & (change >= _NEARLY_CLOSED)])
        rows = _joined(far)
    return _joined([*nearly, rows])


def _agreed(observed: Observables, numbers: Complex, logs: Complex) -> Bool:
    """Points that agree with the preceding division and with Liouville's determinant."""
    determinant = np.linalg.det(np.moveaxis(observed.monodromy, -1, 0))
    with np.errstate(all="ignore"):
        liouville = np.abs(determinant * np.exp(-observed.log_determinant) - 1)
    agreed = response_gap(numbers, observed.numbers) <= _AGREEMENT
    agreed &= multiplier_gap(logs, observed.log_multipliers) <= _AGREEMENT
    return np.asarray(agreed & (liouville <= _LIOUVILLE))


def _sample(
    problem: Problem,
    solution: Solution,
    first: Float,
    rows: Index,
    steps: Steps,
    grading: float,
) -> None:
    """Write the waveforms of the points `rows`, if they were requested."""
    phases = solution.waveform.shape[1]
    if not phases:
        return
    solve = partial(
        shot_waveform, steps=steps, count=int(steps.number), grading=grading, phases=phases
    )
    for members, samples in run_chunks(solve, (problem, first), rows, _chunk(rows)):
        solution.waveform[..., members] = samples


def _chunk(rows: Index) -> int:
    return _CHUNK if len(rows) > 3 * _FEW else _FEW


def _joined(parts: list[Index]) -> Index:
    """Rows in order, so that points of similar difficulty stay together."""
    return np.sort(np.concatenate([np.empty(0, dtype=int), *parts]))


#: Most steps in a period. All tables have this length, so that one compiled program serves all.
MOST_STEPS = 512


class Steps(NamedTuple):
    """The steps of a period, the first `number` rows of each table."""

    number: Array
    phases: Array  # (MOST_STEPS, stages), theta at the stages
    lengths: Array  # (MOST_STEPS,)
    spectrum: Array  # (MOST_STEPS, 1 + 2 harmonics): weights of mean, cosines and minus sines


class PeriodIntegration(NamedTuple):
    """Result of an integration over the period from given initial states.

    Attributes
    ----------
    observables : Observables
        Observables of an orbit if the period closes.
    step : array, shape (size, points)
        Newton's step, to be added to the initial states.
    leap : array, shape (points,)
        Largest change of the slip exponent and of a logarithmic state by the step.
    change : array, shape (points,)
        The larger of `leap` and the change of the velocity; inf if the slider sticks.
    inverse : array, shape (size, size, points)
        Inverse of the unit matrix minus the monodromy matrix.
    """

    observables: Observables
    step: Array
    leap: Array
    change: Array
    inverse: Array


def period_steps(count: int, grading: float, harmonics: int) -> Steps:
    """`count` steps per period, at most `MOST_STEPS`, uniform in tau = theta - g sin(tau).

    A `grading` g, 0 <= g < 1, makes the steps shorter where a harmonic load is smallest.
    """
    tau = 2 * np.pi * np.arange(count + 1) / count
    theta = tau + grading * np.sin(tau)
    share = (1 + grading * np.cos(tau[:-1])) / count
    angle = theta[:-1, None] * np.arange(1, harmonics + 1)
    waves = np.concatenate([np.ones((count, 1)), np.cos(angle), -np.sin(angle)], axis=1)
    lengths = np.diff(theta)
    phases = theta[:-1, None] + lengths[:, None] * dormand_prince_8().C[:12]
    tables = phases, lengths, share[:, None] * waves
    return Steps(np.asarray(count), *map(_padded, tables))


def _padded(table: np.ndarray) -> np.ndarray:
    padded = np.zeros((MOST_STEPS, *table.shape[1:]))
    padded[: len(table)] = table
    return padded


def _slopes(problem: Problem, theta: Array, flow: tuple[Array, ...]) -> tuple[Array, ...]:
    """Slopes of the states and, if `flow` has them, of their derivatives."""
    at = problem.load.at(theta)
    states, *derivatives = flow
    if not derivatives:
        return (problem.system.rates(states, at),)
    rates, push = jax.linearize(lambda Y: problem.system.rates(Y, at), states)
    return rates, jax.vmap(push, in_axes=1, out_axes=1)(derivatives[0])


def _advance(problem: Problem, steps: Steps, k: Array, flow: Any) -> Any:
    """States, and derivatives if `flow` has them, one step later.

    The stages are a loop, so that the rates are compiled once and not for each stage.
    """
    table = jnp.asarray(dormand_prince_8().A)
    stages, length = table.shape[1], steps.lengths[k]

    def combined(j: Any, slopes: Any) -> Any:
        return jax.tree.map(lambda a, s: a + length * jnp.tensordot(table[j], s, 1), flow, slopes)

    def stage(j: Array, slopes: Any) -> Any:
        slope = _slopes(problem, steps.phases[k, j], combined(j, slopes))
        put = partial(jax.lax.dynamic_update_index_in_dim, index=j, axis=0)
        return jax.tree.map(put, slopes, slope)

    none = jax.tree.map(lambda a: jnp.zeros((stages, *a.shape)), flow)
    return combined(stages, jax.lax.fori_loop(0, stages, stage, none))


@jax.jit
def chord_step(
    problem: Problem, start: Array, inverse: Array, *, steps: Steps
) -> tuple[Array, Array]:
    """Initial states after a step with a given `inverse`, and the change of `PeriodIntegration`."""

    def body(k: Array, flow: Any) -> Any:
        return _advance(problem, steps, k, flow)

    (end,) = jax.lax.fori_loop(0, steps.number, body, (start,))
    step = (inverse * (end - start)[None]).sum(1)
    return start + step, _changes(problem, start, step)[1]


@jax.jit
def newton_pass(problem: Problem, start: Array, *, steps: Steps) -> PeriodIntegration:
    """Integrate states and derivatives over the period.

    Parameters
    ----------
    problem : Problem
    start : array, shape (size, points)
        First states.
    steps : Steps
    """
    n, points = start.shape

    def body(k: Array, carry: tuple) -> tuple:
        flow, spectrum, trace, slips, margin = carry
        at = problem.load.at(steps.phases[k, 0])
        _, force = problem.system.force_split(start, flow[0] - start, at)
        weights = steps.spectrum[k]
        spectrum = spectrum + weights[:, None] * force
        trace = trace + weights[0] * _trace(problem, steps.phases[k, 0], flow[0])
        slips = slips & jnp.isfinite(problem.system.log_slip(flow[0], at))
        margin = jnp.minimum(margin, problem.system.reversal_margin(flow[0], at))
        return _advance(problem, steps, k, flow), spectrum, trace, slips, margin

    identity = jnp.eye(n)[:, :, None] * jnp.ones(points)
    nothing = jnp.zeros((steps.spectrum.shape[1], points)), jnp.zeros(points)
    least = jnp.ones(points, dtype=bool), jnp.full(points, jnp.inf)
    (end, monodromy), spectrum, trace, slips, margin = jax.lax.fori_loop(
        0, steps.number, body, ((start, identity), *nothing, *least)
    )
    inverse = solve_columns(identity - monodromy, identity)
    step = (inverse * (end - start)[None]).sum(1)
    leap, change = _changes(problem, start, step)
    constant, _ = problem.system.force_split(start, jnp.zeros_like(start), problem.load.at(0.0))
    cosine, sine = jnp.split(spectrum[1:], 2)
    zero = jnp.zeros_like(trace)
    observables = Observables(
        constant + spectrum[0],
        2 * jax.lax.complex(cosine, sine),
        monodromy,
        zero,
        2 * jnp.pi * trace,
        jnp.full_like(monodromy, jnp.nan),
        zero,
        start,
        margin,
    )
    # An interface that sticks for part of the period has kinks, which no high order resolves.
    change = jnp.where(slips, change, jnp.inf)
    return PeriodIntegration(observables, step, leap, change, inverse)


def _trace(problem: Problem, theta: Array, states: Array) -> Array:
    """Trace of the Jacobian of the rates."""
    at = problem.load.at(theta)
    _, J = value_and_jacobian(lambda Y: problem.system.rates(Y, at), states)
    return sum((J[i, i] for i in range(len(states))), jnp.zeros_like(states[0]))


def _exponent_change(system: Motion, at: Excitation, states: Array, step: Array) -> Array:
    """Largest first-order change of the slip exponent and of the logarithmic states.

    Parameters
    ----------
    system : Motion
    at : Excitation
        At the phases of the states.
    states, step : array, shape (size, ...)

    Returns
    -------
    array, shape (...)
    """
    _, exponent = jax.jvp(lambda Y: system.log_slip(Y, at), (states,), (step,))
    return jnp.abs(jnp.stack([exponent, *step[system.logarithms]])).max(0)


def _changes(problem: Problem, start: Array, step: Array) -> tuple[Array, Array]:
    """Largest change of slip exponent and logarithmic states by a step, without and with velocity.

    The spring force counts as if the asperities carried all of it. The velocity does not make the
    equations nonlinear, but may still be far from its solution.
    """
    system, at = problem.system, problem.load.at(0.0)
    names = system.mechanical
    force, velocity, friction = (names.index(n) for n in ("force", "velocity", "friction"))
    carried = jnp.zeros_like(step).at[friction].set(step[force] / at.w)
    leap = jnp.maximum(
        _exponent_change(system, at, start, step), _exponent_change(system, at, start, carried)
    )
    leap = jnp.where(jnp.isfinite(leap), leap, jnp.inf)
    return leap, jnp.maximum(leap, jnp.abs(step[velocity]))


@partial(jax.jit, static_argnames=("count",))
def _path(problem: Problem, start: Array, steps: Steps, *, count: int) -> Array:
    """States at the beginnings of `count` steps minus the initial states, (count, size, points)."""

    def body(flow: Any, k: Array) -> tuple[Any, Array]:
        return _advance(problem, steps, k, flow), flow[0] - start

    _, path = jax.lax.scan(body, (start,), jnp.arange(count))
    return path


def shot_waveform(
    problem: Problem, start: Array, *, steps: Steps, count: int, grading: float, phases: int
) -> Float:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points).

    By trigonometric interpolation in tau between the ends of `count` steps.
    """
    path = np.asarray(_path(problem, start, steps, count=count))
    theta, nodes = even_phases(phases), 2 * np.pi * np.arange(count) / count
    kernel = interpolation(eccentric_phase(theta[:, 0], grading), nodes)
    return waveform_of(problem, start[:, None] + np.einsum("pk,knb->npb", kernel, path), theta)
