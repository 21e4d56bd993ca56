"""Newton's method on the stroboscopic map, the motion over one period, by the implicit integrator.

With inertia on rigid asperities a slider stops within 10^-8 of the period, and ln v falls by dozens
of units there. On a mesh the instant of the stop moves by about one interval in each step of
Newton's method, because the linearised equations of intervals that stick forget the velocity before
them. The integrator finds the instant of the stop by its step size, and the states after a period
depend smoothly on those before. The initial guess is the end of a transient from steady sliding.
Where slip would reverse in that transient, the branch of orbits from steady sliding may still reach
the requested amplitude: it is followed to there, or to where the interface force of its orbits
vanishes.

A tighter integration checks the orbit.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import numpy as np
from jax import Array

from asperity.algebra.runge_kutta import gauss_legendre, radau_iia
from asperity.arrays import Float
from asperity.loads import CyclicLoading, Excitation, Programme
from asperity.orbit.batches import take
from asperity.orbit.floquet import AGREEMENT, multiplier_gap
from asperity.orbit.observables import Observables, response_gap, waveform_of
from asperity.orbit.outcome import Outcome
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider.inertial import StiffInertial
from asperity.slider.problem import Problem
from asperity.theory.limits import even_phases
from asperity.transients.dense_output import DenseOutput
from asperity.transients.equations import SegmentEquations, motion_samples
from asperity.transients.events import Termination
from asperity.transients.implicit import STAGES
from asperity.transients.inputs import checked_integration, first_checkpoint
from asperity.transients.integration import Checkpoint, Integration
from asperity.transients.variational_equations import stage_times, variations

#: Shares of the modulation in the first periods of a transient, since a sudden start may throw the
#: slider back; number of periods after these; tolerance; and most steps of an integration.
_SHARES, _PERIODS, _ROUGH, _MOST_STEPS = (0.25, 0.5, 0.75), 12, 1e-6, 100_000
#: Tolerances of two integrations that are compared; the error of the second is a hundredth of their
#: difference or less.
_TOLERANCES = (1e-10, 1e-12)
#: Periods integrated for each tolerance; largest change of a logarithm in a Newton step; and change
#: of a state over the period, in tolerances, at which an orbit is closed.
_PASSES, _LARGEST_CHANGE, _CLOSED = 20, 2.0, 10.0
#: Along the branch from steady sliding: tolerance, first and shortest step in shares of the
#: amplitude, factors on a step that succeeds and that fails, and most steps.
_ALONG, _FIRST_STEP, _SHORTEST_STEP, _LONGER, _SHORTER, _MOST = 1e-8, 0.1, 1e-6, 1.5, 0.3, 100
#: Smallest F_i/W of the last orbit below which a branch ends because this force vanishes.
_VANISHING = 1e-4
#: Points of the quadrature in each step of the integrator, whose dense output is of degree 5.
_QUADRATURE = gauss_legendre(8)


class StroboscopicMap(Method):
    """Newton's method on the states at theta = 0; the integrator chooses the steps."""

    name = "stroboscopic map"
    choice = "collocation"
    on_mesh = False

    def suits(self, problem: Problem) -> bool:
        """With inertia on rigid asperities, where an orbit may stop and start again."""
        return isinstance(problem.system, StiffInertial)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`."""
        solution = Solution.unsolved(problem, options)
        for i in range(len(solution.outcome)):
            row = np.array([i])
            point = take(problem, row)
            scalar = jax.tree.map(lambda a: a.item(), point)
            Y, share = _settled_states(scalar)
            orbit, gap = _orbit(scalar, Y, options.harmonics)
            amplitude = float(np.ravel(point.load.amplitude)[0])
            if share < 1 and amplitude > 0:
                solution.outcome[row] = Outcome.REVERSES
                solution.detail[row] = share * amplitude
            if orbit is not None:
                solution.store(row, orbit.observables)
                solution.detail[row] = gap
                solution.iterations[row] = len(orbit.period.begin)
                if options.phases:
                    theta = even_phases(options.phases)
                    Y = orbit.period.evaluate(theta[:, 0] / point.system.omega)[:-1, :, None]
                    solution.waveform[..., row] = waveform_of(point, Y, theta)
                options.progress(1)
        return solution


class _ClosedOrbit(NamedTuple):
    """An orbit, and its steps over the period in seconds."""

    observables: Observables
    period: DenseOutput
    system: SegmentEquations

    @property
    def start(self) -> Float:
        """States at theta = 0."""
        return np.asarray(self.observables.start[:, 0])

    @property
    def least_friction(self) -> float:
        """Smallest F_i/W of the period."""
        times = self.period.refined()
        return float(motion_samples(self.system, times, self.period.evaluate(times)).friction.min())


def _orbit(point: Problem, Y: Float | None, harmonics: int) -> tuple[_ClosedOrbit | None, float]:
    """The orbit near states at theta = 0, and the difference of tolerances.

    None without an orbit, or if the difference is too large.
    """
    orbits = list[_ClosedOrbit]()
    for rtol in _TOLERANCES:
        orbit = None if Y is None else _closed(point, Y, rtol, harmonics)
        if orbit is None:
            return None, np.inf
        Y = orbit.start
        orbits.append(orbit)
    first, second = (orbit.observables for orbit in orbits)
    of_response = response_gap(first.numbers, second.numbers)
    of_multipliers = multiplier_gap(first.log_multipliers, second.log_multipliers)
    gap = float(max(of_response[0], of_multipliers[0]))
    return (orbits[-1] if gap <= AGREEMENT else None), gap


def _integration(point: Problem, steps: list[tuple[Any, float]], rtol: float) -> Integration:
    """Integration of modulations, each over a number of periods, in ln v."""
    system, period = point.system, 2 * np.pi / point.system.omega
    cycles = (CyclicLoading(count * period, load, 1 / period) for load, count in steps)
    integration = checked_integration(
        system.slider,
        Programme(*cycles, load=system.slider.W0, velocity=system.V),
        inertia=True,
        radiation_damping=system.eta or None,
        rtol=rtol,
        method="implicit",
        most_steps=_MOST_STEPS,
    )
    motion = StiffInertial(
        integration.motion.slider, integration.motion.V, integration.motion.omega, system.eta
    )
    return replace(integration, motion=motion)


def _settled_states(point: Problem) -> tuple[Float | None, float]:
    """States after some periods from steady sliding, or at the end of the branch of orbits.

    The second number is the share of the amplitude at which the interface force vanishes on the
    branch; 1 if it does not, or is not known to.
    """
    rise = [(point.load.scaled(share), 1) for share in _SHARES]
    integration = _integration(point, [*rise, (point.load, _PERIODS)], _ROUGH)
    integration.checkpoint = first_checkpoint(integration.motion, integration.programme, "steady")
    steady = integration.checkpoint.states[:-1]
    run = integration.last_segment()
    if not isinstance(run, Termination):
        return run[1].last_states[:-1], 1.0
    # A sudden modulation may throw back a slider that has an orbit.
    return _branch_end(point, steady) if run.kind == "reversal" else (None, 1.0)


def _branch_end(point: Problem, steady: Float) -> tuple[Float | None, float]:
    """As `_settled_states`, by orbits at larger and larger shares of the amplitude."""
    Y, slope, share, step, orbit = steady, np.zeros_like(steady), 0.0, _FIRST_STEP, None
    for _ in range(_MOST):
        step = min(step, 1 - share)
        scaled = Problem(point.system, point.load.scaled(share + step))
        farther = _closed(scaled, Y + step * slope, _ALONG, 1)
        if farther is not None:
            slope, orbit = (farther.start - Y) / step, farther
            Y, share, step = farther.start, share + step, _LONGER * step
            if share == 1:
                return Y, share
        elif orbit is not None and orbit.least_friction < _VANISHING:
            return None, share
        elif (step := _SHORTER * step) < _SHORTEST_STEP:
            break
    return None, 1.0


def _closed(point: Problem, Y: Float, rtol: float, harmonics: int) -> _ClosedOrbit | None:
    """The orbit near states at theta = 0; where Newton's method fails, the motion goes on."""
    marched = None
    for _ in range(_PASSES):
        integration = _integration(point, [(point.load, 1)], rtol)
        integration.checkpoint = Checkpoint(0, 0.0, np.append(Y, 0.0))
        run = integration.last_segment()
        if isinstance(run, Termination):
            if marched is None:
                return None
            Y, marched = marched, None
            continue
        marched, monodromy = run[1].last_states[:-1], _monodromy(*run)
        if np.abs(marched - Y).max() < _CLOSED * rtol:
            observables = _observables(Y, *run, monodromy, harmonics)
            return _ClosedOrbit(observables, run[1], run[0])
        try:
            step = np.linalg.solve(np.eye(len(Y)) - monodromy, marched - Y)
        except np.linalg.LinAlgError:
            return None
        largest = np.abs(step[integration.motion.logarithms]).max()
        Y = Y + step * min(1.0, _LARGEST_CHANGE / largest)
    return None


def _at_shares(steps: DenseOutput, shares: Float) -> Float:
    """States at the same shares of all steps, (size, steps, shares).

    Where a slider stops, steps are shorter than the spacing of doubles at the time.
    """
    powers = shares ** np.arange(len(steps.coefficients))[:, None]
    return np.einsum("kns,kc->nsc", steps.coefficients[:, :-1], powers)


def _monodromy(system: SegmentEquations, steps: DenseOutput) -> Float:
    """Derivatives of the states at the end by those at the beginning."""
    states = _at_shares(steps, radau_iia(STAGES).c)
    at = _excitation(system, stage_times(steps.begin, steps.length))
    return variations(system.motion, steps.begin, steps.length, states, at=at)[0]


@jax.jit
def _excitation(system: SegmentEquations, t: Array) -> Excitation:
    return system.at(t)


def _observables(
    start: Float, system: SegmentEquations, steps: DenseOutput, monodromy: Float, harmonics: int
) -> Observables:
    """Observables of an orbit, by quadrature over each step; one point."""
    scheme, omega = _QUADRATURE, 2 * np.pi / steps.end
    phases = omega * (steps.begin[:, None] + steps.length[:, None] * scheme.c)
    weights = steps.length[:, None] / steps.end * scheme.b
    # The first state is F/W0.
    force = _at_shares(steps, scheme.c)[0] - start[0]
    turns = np.exp(-1j * np.arange(1, harmonics + 1)[:, None, None] * phases)
    none = np.zeros(1)
    return Observables(
        start[:1] + (weights * force).sum(),
        2 * (turns * weights * force).sum((1, 2))[:, None],
        monodromy[..., None],
        none,
        np.linalg.slogdet(monodromy)[1] + none,
        np.full((*monodromy.shape, 1), np.nan),
        none,
        start[:, None],
        none + np.inf,
    )
