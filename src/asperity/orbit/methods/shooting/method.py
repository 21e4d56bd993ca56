"""Shooting: Newton's method on a coarse division of the period, and refinement of the orbit.

1. Newton's method from the averaged limit, on a coarse division of the period.
2. The orbit on finer divisions, each with twice the steps of the one before, until mean, harmonics
   and multipliers of two of them agree: the error of a method of order 8 falls by 2^8.

The determinant of the monodromy matrix is compared with Liouville's formula, a quadrature that
does not use the integrated derivatives. Points that fail a check are left to other methods.

The initial guess is the averaged limit of a slider that swings on its asperities. While the joint
sticks, spring force f and slider obey

    dv/dtheta = m (f - w g - d v),      dg/dtheta = s v - c (g - <g>),

g = F_i/W, m the mobility, d the damping, s the strain, c a mean relaxation by slip. Under
w = 1 + eps cos(theta) the harmonics of g = f G follow from a three-term recurrence, whose minimal
solution is a continued fraction. The averaged limit under the load 1/G, which asks the same
friction of the contacts, then gives f and the states of the law.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.loads import Excitation, Harmonic
from asperity.orbit.batches import Indices, run_chunks, take
from asperity.orbit.floquet import from_logs, log_multipliers
from asperity.orbit.methods.method import Method
from asperity.orbit.methods.shooting.flow import (
    PeriodIntegration,
    Steps,
    chord_step,
    newton_pass,
    period_steps,
    shot_waveform,
)
from asperity.orbit.observables import Observables
from asperity.orbit.solution import Float, SearchOptions, Solution
from asperity.slider import Inertial, QuasiStatic
from asperity.slider.problem import Problem
from asperity.theory.averaged import averaged_limit

#: Samples of the load for the averaged limit, and harmonics of G.
_NODES, _HARMONICS = 48, 12

#: G below this is beyond a resonance with the modulation itself, where the start means nothing.
_LEAST = 0.2


@jit_large
def averaged_start(problem: Problem) -> tuple[Array, Array]:
    """Initial states, (size, points), and the fastest relaxation by slip, per radian."""
    system, load = problem
    quasi_static = QuasiStatic(system.slider, system.V, system.omega)
    theta = 2 * np.pi * np.arange(_NODES)[:, None] / _NODES
    points = jnp.ones(jax.tree.leaves(problem)[0].shape[-1])
    at = load.at(jnp.asarray(theta))
    w, velocity = at.w * points, jnp.zeros((_NODES, 1))
    softening = _softening(problem, points)
    if isinstance(load, Harmonic):
        swing, velocity_swing = _elastic_swing(problem, system.strain * softening, theta)
        usable = (swing > _LEAST).all(0)
        # Without inertia the joint carries z / (w + l): the load under which that is z G / (1 + l).
        ratio = quasi_static.compliance_ratio
        w = jnp.where(usable, (1 + ratio) / jnp.where(usable, swing, 1.0) - ratio, w)
        velocity = jnp.where(usable, velocity_swing, 0.0)
    centre = averaged_limit(quasi_static, at._replace(w=w), np.full(_NODES, 1 / _NODES)).centre
    Y = jnp.stack(centre)[:, None]
    force = quasi_static.force(Y, Excitation(points)) + 0 * w
    friction = quasi_static.friction(Y, Excitation(w))
    mechanical = force + system.damping, 1 + velocity * force, friction
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


def _elastic_swing(problem: Problem, relaxation: Array, theta: np.ndarray) -> tuple[Array, Array]:
    """G and the part of v/V that follows f, over f, at the phases `theta`, (nodes, points)."""
    system, half = problem.system, 0.5 * problem.load.epsilon
    ratios: list[Array] = []  # of a harmonic to the one before, highest first
    last = jnp.zeros_like(relaxation, dtype=complex)
    for n in range(_HARMONICS, 0, -1):
        inertia = (1j * n / system.mobility + system.damping) * (1j * n + relaxation)
        last = -half / (1 + inertia / system.strain + half * last)
        ratios.append(last)
    harmonic = 1 / (1 + 2 * half * last.real) + 0j
    swing, velocity = harmonic.real, 0.0
    for n, ratio in enumerate(reversed(ratios), 1):
        harmonic = harmonic * ratio
        wave = 2 * harmonic * np.exp(1j * n * theta)
        swing = swing + wave.real
        velocity = velocity + ((1j * n + relaxation) * wave).real
    return swing, velocity / system.strain


class _Divisions(NamedTuple):
    """Numbers of steps in the period, coarse to fine."""

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

#: Points in a call, where there are many and where few are left; no powers of two, at which
#: arrays share cache lines.
_CHUNK, _FEW = 240, 24

#: Newton steps on the coarse division, the largest change of an exponent in one, and the change
#: below which its square is small enough to go on.
_NEWTON_STEPS, _LARGEST_CHANGE, _NEAR = 12, 3.0, 2e-2
#: Chord steps on a finer division, which shrink a change by a hundred and more, and the change
#: below which there need be no further one.
_CHORDS, _NEARLY_CLOSED = 4, 1e-5
#: Largest remaining Newton change: where two divisions are compared, and on the finer one.
_CLOSED, _ACCEPTED = 1e-6, 1e-9
#: Agreement of two divisions, relative; the finer one is then good to 2e-6 / 2^8.
_AGREEMENT = 2e-6
#: Agreement of the determinant with Liouville's formula, a check of the finer division alone.
_LIOUVILLE = 1e-8

#: Multipliers smaller than this, or than this share of the largest, are compared absolutely.
_VANISHING, _DROWNED = 1e-6, 1e-7


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
        solution = Solution.unsolved(problem, len(rows), options)
        guess, relaxation = np.empty((size, len(rows))), np.empty(len(rows))
        for members, values in run_chunks(averaged_start, (problem,), rows, _chunk(rows)):
            guess[:, members], relaxation[members] = values
        # Points of like difficulty belong together.
        rows = np.argsort(relaxation, kind="stable")
        for divisions in _DIVISIONS:
            chosen = rows[relaxation[rows] <= divisions.fastest]
            if len(chosen):
                _Refinement(problem, solution, options, divisions, guess.copy()).run(chosen)
            rows = rows[~solution.converged[rows]]
        return solution


class _Refinement:
    """The orbits of some points on finer and finer divisions; arrays have points last."""

    def __init__(
        self,
        problem: Problem,
        solution: Solution,
        options: SearchOptions,
        divisions: _Divisions,
        guess: Float,
    ) -> None:
        size, points = guess.shape
        self.problem, self.solution = problem, solution
        self.options, self.divisions = options, divisions
        self.first = guess
        self.inverse = np.zeros((size, size, points))  # of 1 less the monodromy matrix
        # Results on the previous division; NaN where the orbit did not close.
        self.mean_friction = np.full(points, np.nan)
        self.harmonics = np.zeros((options.harmonics, points), dtype=complex)
        self.polynomial = np.zeros((size + 1, points))

    def run(self, rows: Indices) -> None:
        """Refine the orbits of `rows` from the coarse division to the first two that agree."""
        rows = self._near_orbits(rows)
        for count in self.divisions.finer:
            rows, left = self._closed(rows, count), []
            for members, reached in self._passes(rows, count):
                resolved = self._compare(members, reached, count)
                good = ~resolved & np.isfinite(reached.step).all(0)
                self.first[:, members[good]] += reached.step[:, good]
                left.append(members[good])
            rows = _joined(left)

    def _steps(self, count: int) -> Steps:
        return period_steps(count, self.divisions.grading, self.options.harmonics)

    def _passes(self, rows: Indices, count: int) -> Iterator[tuple[Indices, PeriodIntegration]]:
        """Integrate `rows` on `count` steps; the inverse is kept for chord steps."""
        solve = partial(newton_pass, steps=self._steps(count))
        for members, reached in run_chunks(solve, (self.problem, self.first), rows, _chunk(rows)):
            self.inverse[..., members] = reached.inverse
            yield members, reached

    def _near_orbits(self, rows: Indices) -> Indices:
        """Newton's method on the coarse division; returns the rows that it brings near an orbit."""
        near = []
        for _ in range(_NEWTON_STEPS):
            far = []
            for members, reached in self._passes(rows, self.divisions.coarse):
                leap = reached.leap
                good = np.isfinite(leap) & np.isfinite(reached.step).all(0)
                damping = np.minimum(1.0, _LARGEST_CHANGE / np.maximum(leap[good], 1e-300))
                self.first[:, members[good]] += damping * reached.step[:, good]
                near.append(members[good & (leap < _NEAR)])
                far.append(members[good & (leap >= _NEAR)])
            rows = _joined(far)
        return _joined(near)

    def _closed(self, rows: Indices, count: int) -> Indices:
        """Chord steps on a finer division; returns the rows whose orbits they close."""
        solve, closed = partial(chord_step, steps=self._steps(count)), []
        for _ in range(_CHORDS):
            far = []
            inputs = (self.problem, self.first, self.inverse)
            for members, (start, change) in run_chunks(solve, inputs, rows, _chunk(rows)):
                good = np.isfinite(change)
                self.first[:, members[good]] = start[:, good]
                closed.append(members[change < _NEARLY_CLOSED])
                far.append(members[good & (change >= _NEARLY_CLOSED)])
            rows = _joined(far)
        return _joined(closed)

    def _compare(
        self, members: Indices, reached: PeriodIntegration, count: int
    ) -> NDArray[np.bool_]:
        """Compare with the division before; writes the points that agree and returns which do."""
        gap = _gap(self.mean_friction[members], self.harmonics[:, members], reached)
        resolved = (reached.change <= _ACCEPTED) & (gap <= _AGREEMENT)
        resolved &= _liouville_gap(reached) <= _LIOUVILLE
        agreed = np.flatnonzero(resolved)
        kept = take(reached, agreed)
        logs = log_multipliers(kept.monodromy, np.zeros(len(agreed)), kept.log_determinant)
        before = self.polynomial[:, members[agreed]]
        multiplier_gap = _multiplier_gap(before, kept.polynomial, from_logs(logs))
        resolved[agreed] = multiplier_gap <= _AGREEMENT
        closed = reached.change <= _CLOSED
        self.mean_friction[members] = np.where(closed, reached.mean_friction, np.nan)
        self.harmonics[:, members] = reached.harmonics
        self.polynomial[:, members] = reached.polynomial
        if resolved.any():
            logs = logs[:, resolved[agreed]]
            self._store(members[resolved], take(reached, resolved), logs, count)
        return resolved

    def _store(
        self, rows: Indices, reached: PeriodIntegration, logs: NDArray[np.complex128], count: int
    ) -> None:
        start, zero = self.first[:, rows], np.zeros(len(rows))
        observables = Observables(
            reached.mean_friction,
            reached.harmonics,
            reached.monodromy,
            zero,
            reached.log_determinant,
            np.full_like(reached.monodromy, np.nan),
            zero,
            start,
        )
        self.solution.store(rows, observables, logs)
        self._sample(rows, count)
        self.solution.iterations[rows] = count
        self.options.progress(len(rows))

    def _sample(self, rows: Indices, count: int) -> None:
        phases = self.options.phases
        if phases:
            solve = partial(
                shot_waveform,
                steps=self._steps(count),
                count=count,
                grading=self.divisions.grading,
                phases=phases,
            )
            for members, samples in run_chunks(
                solve, (self.problem, self.first), rows, _chunk(rows)
            ):
                self.solution.waveform[..., members] = samples


def _chunk(rows: Indices) -> int:
    return _CHUNK if len(rows) > 3 * _FEW else _FEW


def _joined(parts: list[Indices]) -> Indices:
    """Rows in order, so that points of like difficulty stay together."""
    return np.sort(np.concatenate([np.empty(0, dtype=int), *parts]))


def _gap(
    mean_friction: Float, harmonics: NDArray[np.complex128], reached: PeriodIntegration
) -> Float:
    """Relative change of mean and harmonics; inf without a previous division."""
    with np.errstate(all="ignore"):
        mean = np.abs(mean_friction / reached.mean_friction - 1)
        scale = np.abs(reached.harmonics)
        # Harmonics above the second are compared relative to the first.
        scale[2:] = scale[0]
        gap = np.maximum(mean, (np.abs(harmonics - reached.harmonics) / scale).max(0))
    return np.where(np.isfinite(gap), gap, np.inf)


def _liouville_gap(reached: PeriodIntegration) -> Float:
    """Relative difference of the determinant from that by Liouville's formula."""
    determinant = (-1) ** len(reached.monodromy) * reached.polynomial[-1]
    with np.errstate(all="ignore"):
        gap = np.abs(determinant * np.exp(-reached.log_determinant) - 1)
    return np.where(np.isfinite(gap), gap, np.inf)


def _multiplier_gap(before: Float, now: Float, multipliers: NDArray[np.complex128]) -> Float:
    """Relative change of the multipliers, from that of the characteristic polynomial.

    To first order a root m moves by the change of the polynomial at m over its slope there.
    """
    with np.errstate(all="ignore"):
        change = np.zeros_like(multipliers)
        for coefficient in now - before:
            change = change * multipliers + coefficient
        differences = multipliers[:, None] - multipliers[None]
        differences[np.diag_indices(len(multipliers))] = 1.0
        size = np.abs(multipliers)
        floor = np.maximum(_VANISHING, _DROWNED * size.max(0))
        gap = np.abs(change / differences.prod(1)) / np.maximum(size, floor)
        gap = gap.max(0)
    return np.where(np.isfinite(gap), gap, np.inf)
