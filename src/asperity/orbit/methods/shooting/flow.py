"""Integration over one period for shooting, for equations that are not stiff but oscillate.

With inertia on elastic asperities the slider swings at a few times the frequency of the modulation.
The states and their derivatives to the first states are integrated over the period by the explicit
method of order 8 of Dormand and Prince, all operating points in lock step; Newton's method on the
first states closes the orbit, and the derivatives at its end are the monodromy matrix.

A pass takes the time of some hundred evaluations of the rates, without step-size control. A second
pass with twice as many steps checks the accuracy, see `asperity.orbit.methods.shooting.method`.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
(Springer, 1993), section II.5.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity.algebra.runge_kutta import dormand_prince_8
from asperity.algebra.small_systems import Matrix, inverse_points, jacobian_columns, product
from asperity.loads import Excitation
from asperity.orbit.mesh.mesh import eccentric_phase
from asperity.orbit.observables import waveform_of
from asperity.slider import Motion
from asperity.slider.problem import Problem
from asperity.theory.adiabatic import even_phases

#: Most steps in a period: the tables of a pass have room for as many, so that one program serves.
MOST_STEPS = 512


class Steps(NamedTuple):
    """The steps of a period, the first `number` rows of each table."""

    number: Array
    phases: Array  # (MOST_STEPS, stages), theta at the stages
    lengths: Array  # (MOST_STEPS,)
    spectrum: Array  # (MOST_STEPS, 1 + 2 harmonics): weights of mean, cosines and minus sines


class PeriodIntegration(NamedTuple):
    """Result of an integration over the period from given initial states."""

    step: Array  # (size, points): Newton's, to be added to the first states
    leap: Array  # (points,): what it does to the slip exponent and logarithmic states
    change: Array  # (points,): what it does to these and to the velocity; inf if the slider sticks
    inverse: Array  # (size, size, points): of 1 less the monodromy matrix
    monodromy: Array  # (size, size, points)
    polynomial: Array  # (size + 1, points): its characteristic one, highest power first
    log_determinant: Array  # of the monodromy matrix, by Liouville's formula
    mean_friction: Array
    harmonics: Array  # complex, (harmonics, points)


def period_steps(count: int, grading: float, harmonics: int) -> Steps:
    """`count` steps per period, at most `MOST_STEPS`, uniform in tau = theta - g sin(tau).

    A `grading` g > 0, below 1, makes them shorter where a harmonic load is lightest.
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
    """Slopes of the states and, where they are there, of their derivatives."""
    at = problem.load.at(theta)
    states, *derivatives = flow
    if not derivatives:
        return (problem.system.rates(states, at),)
    rates, push = jax.linearize(lambda Y: problem.system.rates(Y, at), states)
    return rates, jax.vmap(push, in_axes=1, out_axes=1)(derivatives[0])


def _advance(problem: Problem, steps: Steps, k: Array, flow: Any) -> Any:
    """States, and derivatives if any, one step later.

    The stages are a loop, so that the rates are compiled once and not for each of them.
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
    """One chord step: first states, and the change as in `PeriodIntegration`.

    Parameters
    ----------
    problem : Problem
    start : array, shape (size, points)
        First states.
    inverse : array, shape (size, size, points)
        `PeriodIntegration.inverse` of orbits close by.
    steps : Steps
    """

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
        flow, spectrum, trace, slips = carry
        at = problem.load.at(steps.phases[k, 0])
        _, force = problem.system.force_split(start, flow[0] - start, at)
        weights = steps.spectrum[k]
        spectrum = spectrum + weights[:, None] * force
        trace = trace + weights[0] * _trace(problem, steps.phases[k, 0], flow[0])
        slips = slips & jnp.isfinite(problem.system.log_slip(flow[0], at))
        return _advance(problem, steps, k, flow), spectrum, trace, slips

    identity = jnp.eye(n)[:, :, None] * jnp.ones(points)
    nothing = jnp.zeros((steps.spectrum.shape[1], points)), jnp.zeros(points)
    (end, monodromy), spectrum, trace, slips = jax.lax.fori_loop(
        0, steps.number, body, ((start, identity), *nothing, jnp.ones(points, dtype=bool))
    )
    inverse = _stacked(inverse_points([list(row) for row in identity - monodromy]))
    step = (inverse * (end - start)[None]).sum(1)
    leap, change = _changes(problem, start, step)
    constant, _ = problem.system.force_split(start, jnp.zeros_like(start), problem.load.at(0.0))
    cosine, sine = jnp.split(spectrum[1:], 2)
    return PeriodIntegration(
        step,
        leap,
        # An interface that sticks for part of the period has kinks, which no high order resolves.
        jnp.where(slips, change, jnp.inf),
        inverse,
        monodromy,
        _characteristic(monodromy),
        2 * jnp.pi * trace,
        constant + spectrum[0],
        2 * jax.lax.complex(cosine, sine),
    )


def _stacked(matrix: Matrix) -> Array:
    return jnp.stack([jnp.stack(row) for row in matrix])


def _characteristic(matrix: Array) -> Array:
    """Coefficients of det(m - matrix), by the method of Faddeev and LeVerrier."""
    n = matrix.shape[0]
    identity = jnp.eye(n)[:, :, None]
    coefficients, power = [jnp.ones(matrix.shape[2])], jnp.zeros_like(matrix)
    for k in range(1, n + 1):
        power = product(matrix, power) + coefficients[-1] * identity
        coefficients.append(-jnp.trace(product(matrix, power)) / k)
    return jnp.stack(coefficients)


def _trace(problem: Problem, theta: Array, states: Array) -> Array:
    """Trace of the Jacobian of the rates."""
    at = problem.load.at(theta)
    _, columns = jacobian_columns(lambda Y: problem.system.rates(Y, at), states)
    return sum((column[i] for i, column in enumerate(columns)), jnp.zeros_like(states[0]))


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
    logarithms = [step[i] for i in range(system.size) if i not in system.linear]
    return jnp.abs(jnp.stack([exponent, *logarithms])).max(0)


def _changes(problem: Problem, start: Array, step: Array) -> tuple[Array, Array]:
    """Largest change of slip exponent and logarithmic states by a step, without and with velocity.

    The spring force counts as if the asperities carried all of it. The velocity has no part in what
    makes the equations nonlinear, but it may be far off.
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
    """States at the beginnings of `count` steps less those of the first, (count, size, points)."""

    def body(flow: Any, k: Array) -> tuple[Any, Array]:
        return _advance(problem, steps, k, flow), flow[0] - start

    _, path = jax.lax.scan(body, (start,), jnp.arange(count))
    return path


def shot_waveform(
    problem: Problem, start: Array, *, steps: Steps, count: int, grading: float, phases: int
) -> NDArray[np.float64]:
    """F/W0 and ln(v_pl/V) at theta = 2 pi k / phases, shape (2, phases, points).

    By trigonometric interpolation in tau between the ends of `count` steps.
    """
    path = np.asarray(_path(problem, start, steps, count=count))
    theta = even_phases(phases)
    difference = eccentric_phase(theta, grading) - 2 * np.pi * np.arange(count) / count
    k = np.arange(1, (count + 1) // 2)[:, None, None]
    interpolate = (1 + 2 * np.cos(k * difference).sum(0)) / count
    Y = start[:, None] + np.einsum("pk,knb->npb", interpolate, path)
    return waveform_of(problem, Y, theta)
