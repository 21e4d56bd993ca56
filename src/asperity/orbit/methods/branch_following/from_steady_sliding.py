"""From steady sliding to the requested amplitude, through folds and canards, in batches.

`BranchFollowing` is the method of the search that takes the orbits at the ends of these branches,
or the reason why a branch ends before.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.algebra.continuation import Attempt, Curves, StepControl, follow
from asperity.orbit.batches import Indices, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit, scheme_for
from asperity.orbit.mesh.newton import Change
from asperity.orbit.mesh.reading import growth_within
from asperity.orbit.methods.branch_following.arclength import (
    ContinuationPoint,
    ParameterLine,
    amplitude_line,
    first_point,
)
from asperity.orbit.methods.branch_following.moving_mesh import (
    MovingMeshStep,
    PointPair,
    moving_step,
    straight,
)
from asperity.orbit.methods.collocation.initial_guess import InitialGuess
from asperity.orbit.methods.collocation.method import solve_from
from asperity.orbit.methods.method import Method
from asperity.orbit.outcome import LARGEST_GROWTH, WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import SearchOptions, Solution
from asperity.slider.problem import Problem
from asperity.theory.adiabatic import adiabatic_growth

Float = NDArray[np.float64]

#: Branches that are followed in a call.
CHUNK = 8


class BranchMesh(NamedTuple):
    """Intervals of a moving mesh, and most steps along a branch on it."""

    intervals: int
    most_steps: int


#: First mesh, and a finer mesh for points without a definite outcome.
MESHES = (BranchMesh(216, 200), BranchMesh(648, 1000))
#: Exponent of the slip rate beyond which a pulse is so narrow, below 1e-7 of the period, that
#: round-off in the phase limits it.
RUNAWAY = 13.0

#: Distance from the requested amplitude below which steps aim at it, and at which it is reached.
_NEAR, _ARRIVED = 1e-2, 1e-6
#: Rise of the exponent beyond `RUNAWAY` for which a branch is still followed there.
_AHEAD = 0.5
#: A branch counts as returning when it is this far behind its fold (share of the amplitude).
_BACK = 1e-3
_NEWTON_STEPS = 10
#: Distance that the motion of the mesh may cause; shorter steps do not reduce it.
_NOISE = 0.15
_FIRST = 0.02
#: Number of failures after which a step is predicted along the tangent.
_RESTART = 4
#: Exponent from which pulses grow steadily if they do, its rise over which the share is watched,
#: and how many times farther the share may get than where that leads.
_RUNNING, _RISE, _CAUTION = 5.0, 0.3, 2.0


class SteadyBranch(NamedTuple):
    """Ends of branches that were followed from steady sliding.

    Attributes
    ----------
    orbit : Orbit
        Orbits at the share reached.
    share : array, shape (points,)
        Share of the amplitude reached; about 1 where it succeeded.
    fold : array, shape (points,)
        Share at the fold that is farthest from steady sliding, NaN where there was none.
    farthest : array, shape (points,)
        Largest share on the branch.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the last orbit.
    limit : array, shape (points,)
        Share at which, as they grew at last, pulses are to reach e^`RUNAWAY`; inf where they
        do not grow.
    growth : array, shape (points,)
        Exponent by which a disturbance grows while it does, of the last orbit or of steady
        sliding at the requested amplitude, whichever is larger; 0 where the outcome is definite.
    """

    orbit: Orbit
    share: Float
    fold: Float
    farthest: Float
    fastest: Float
    limit: Float
    growth: Float

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether the requested amplitude was reached."""
        return np.abs(self.share - 1) <= _ARRIVED

    @property
    def folded(self) -> NDArray[np.bool_]:
        """Whether the branch was abandoned while it returned from its farthest fold."""
        with np.errstate(invalid="ignore"):
            back = (self.fold >= self.farthest - _BACK) & (self.share < self.farthest - _BACK)
        return ~self.arrived & back

    @property
    def ran_away(self) -> NDArray[np.bool_]:
        """Whether slip becomes too fast to be followed before the requested amplitude."""
        return ~self.arrived & ~self.folded & (self.end < 1)

    @property
    def sensitive(self) -> NDArray[np.bool_]:
        """Whether the branch was lost where its orbits are too unstable for mesh and experiment."""
        return ~(self.arrived | self.folded | self.ran_away) & (self.growth > LARGEST_GROWTH)

    @property
    def definite(self) -> NDArray[np.bool_]:
        """Whether the outcome does not depend on the mesh."""
        return self.arrived | self.folded | (self.fastest >= RUNAWAY)

    @property
    def end(self) -> Float:
        """Share before which pulses pass e^`RUNAWAY`; inf where they are not known to."""
        return np.where(self.fastest >= RUNAWAY, self.share, self.limit)


def follow_from_steady_sliding(problem: Problem, index: Indices, mesh: BranchMesh) -> SteadyBranch:
    """Follow the points `index` of `problem` (NumPy arrays) from steady sliding.

    The branch starts at steady sliding on every mesh, because a coarse mesh is inaccurate long
    before the branch is lost.
    """
    line, points = amplitude_line(problem), len(problem.system.V)
    branches = SteadyBranches(line, _steady_pair(line, points, index, mesh.intervals))
    follow(branches, np.full(points, _FIRST), rows=index, most=mesh.most_steps)
    progress, point = branches.progress, branches.pair.point
    orbit, share = point.orbit, point.t
    known = (progress.fold, progress.farthest, progress.fastest, progress.limit)
    result = SteadyBranch(orbit, share, *known, np.zeros_like(share))
    left = index[~result.definite[index]]

    def growth_of(line: ParameterLine, orbit: Orbit, t: Float) -> Float:
        return growth_within(line.at(t), orbit)

    for part, growth in run_chunks(growth_of, (line, orbit, share), left, CHUNK):
        result.growth[part] = growth
    for part, growth in run_chunks(adiabatic_growth, (problem,), left, CHUNK):
        result.growth[part] = np.fmax(growth, result.growth[part])
    return result


class BranchProgress(NamedTuple):
    """Progress along each branch.

    Attributes
    ----------
    fold, farthest, fastest, limit : array, shape (points,)
        As in `SteadyBranch`.
    watched_share, watched_exponent : array, shape (points,)
        Share and exponent from which the present rise of the exponent is counted.
    """

    fold: Float
    farthest: Float
    fastest: Float
    limit: Float
    watched_share: Float
    watched_exponent: Float

    @classmethod
    def from_steady(cls, points: int) -> BranchProgress:
        """Progress at the start of the branches."""

        def full(value: float) -> Float:
            return np.full(points, value)

        return cls(
            fold=full(np.nan),
            farthest=full(0.0),
            fastest=full(0.0),
            limit=full(np.inf),
            watched_share=full(0.0),
            watched_exponent=full(0.0),
        )

    def continues(self, share: Float) -> NDArray[np.bool_]:
        """Branches that neither arrived nor ran away; one that returns may turn again."""
        left = np.abs(share - 1)
        # A branch that is about to arrive may exceed the limit a little.
        fastest = np.where(left < _NEAR, self.fastest - _AHEAD, self.fastest)
        return (left > _ARRIVED) & (share > -0.01) & (fastest < RUNAWAY)

    def watch(self, rows: Indices, share: Float) -> None:
        """Extrapolate the share to where pulses run away, once they have grown enough."""
        exponent = self.fastest[rows]
        rise = exponent - self.watched_exponent[rows]
        gain = share - self.watched_share[rows]
        grown = (exponent > _RUNNING) & (rise > _RISE) & (gain > 0)
        left = np.maximum(RUNAWAY - exponent, 0.0)
        ahead = share + _CAUTION * left * gain / np.where(grown, rise, 1.0)
        known = np.where(rise < 0, np.inf, self.limit[rows])
        self.limit[rows] = np.where(grown, ahead, known)
        restart = (rise > _RISE) | (rise < 0)
        self.watched_share[rows] = np.where(restart, share, self.watched_share[rows])
        self.watched_exponent[rows] = np.where(restart, exponent, self.watched_exponent[rows])


def _steady_pair(line: ParameterLine, points: int, index: Indices, intervals: int) -> PointPair:
    system = line.origin.system
    orbit = Orbit.empty(scheme_for(system), system.size, intervals, points)
    orbit.mesh[:] = np.linspace(0, 2 * np.pi, intervals + 1)[:, None]
    steady = jax.jit(lambda s: s.steady())(system)
    orbit.centre[:] = np.broadcast_to(np.asarray(steady), orbit.centre.shape)
    t = np.zeros(points)
    tangent = Change(np.zeros_like(orbit.nodes), np.zeros_like(orbit.slopes), np.zeros(points))
    start = ContinuationPoint(orbit, t, tangent, np.zeros_like(orbit.centre))
    pair = jax.tree.map(np.array, PointPair(orbit, t, start))

    def begin(line: ParameterLine, orbit: Orbit, t: Float) -> PointPair:
        return straight(first_point(line, orbit, t), np.full(len(t), _FIRST))

    for part, begun in run_chunks(begin, (line, orbit, t), index, CHUNK):
        put(pair, part, begun)
    return pair


class SteadyBranches(Curves):
    """Branches from steady sliding in the amplitude, predicted from their last two points.

    Attributes
    ----------
    line : ParameterLine
    pair : PointPair
        The last two points of each branch.
    span : array, shape (points,)
        Distance between these two.
    progress : BranchProgress
    """

    control = StepControl(
        shortest=0.0,
        longest=3.0,  # in the space of states, phase and share
        growth=2.0,
        easy=4,
        hard=7,
        sharpest_turn=0.3,
        farthest=0.8,
        most_failures=10,
    )

    def __init__(self, line: ParameterLine, pair: PointPair) -> None:
        """At steady sliding."""
        self.line, self.pair = line, pair
        self.span = np.full(len(pair.t_before), _FIRST)
        self.progress = BranchProgress.from_steady(len(pair.t_before))

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """Not predicted to pass the requested amplitude; back where a step has passed it.

        After several failures along the secant, along the tangent.
        """
        stuck = np.flatnonzero((failures >= _RESTART) & (failures < self.control.most_failures))
        self.span[stuck] = length[stuck] = np.abs(length[stuck])
        for part, fresh in run_chunks(straight, (self.pair.point, length), stuck, CHUNK):
            put(self.pair, part, fresh)
        t, ratio = self.pair.point.t, length / self.span
        last, left = t - self.pair.t_before, 1 - t
        near = (last != 0) & (np.abs(left) < _NEAR)
        near |= (last > 0) & ((ratio * last > left) | (left < 0))
        secant = left / np.where(near, last, 1.0)
        # A step that has just failed is not repeated with the same length.
        longest = np.where(failures > 0, np.abs(ratio), 2.0)
        aimed = np.clip(secant, -np.minimum(longest, 1.0), longest)
        return np.where(near, aimed, ratio) * self.span

    def attempts(
        self, rows: Indices, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Indices, Attempt]]:
        """Steps on the moving mesh."""
        advance = partial(moving_step, max_steps=_NEWTON_STEPS)
        inputs = (self.line, self.pair, length / self.span)
        for part, step in run_chunks(advance, inputs, rows, CHUNK):
            miss = np.where(step.miss * step.length < _NOISE, 0.0, step.miss)
            converged = np.isfinite(step.error)
            yield part, Attempt(step, converged, step.iterations, step.turn, miss, step.length)

    def accept(self, rows: Indices, chosen: Indices, attempt: Attempt) -> list[str]:
        """Update folds, shares and exponents; a branch ends where it arrives or runs away."""
        step, progress = attempt.next, self.progress
        turned = self.pair.point.tangent.t[rows] * step.next.point.tangent.t[chosen] < 0
        extremum = np.where(turned, _extremum(self.pair, step, rows, chosen), np.nan)
        progress.fold[rows] = np.fmax(progress.fold[rows], extremum)
        put(self.pair, rows, take(step.next, chosen))
        self.span[rows] = step.length[chosen]
        share = self.pair.point.t
        progress.farthest[rows] = np.maximum(progress.farthest[rows], share[rows])
        progress.fastest[rows] = step.fastest[chosen]
        progress.watch(rows, share[rows])
        return ["" if goes_on else "ended" for goes_on in progress.continues(share)[rows]]


def _extremum(pair: PointPair, step: MovingMeshStep, rows: Indices, chosen: Indices) -> Float:
    """Largest or smallest t between two points, of the cubic through values and directions."""
    t, slope = pair.point.t[rows], pair.point.tangent.t[rows]
    t_next = step.next.point.t[chosen]
    slope_next = step.next.point.tangent.t[chosen]
    # The parabola of the slope has its zero at x; the area under the slope to there is the rise.
    # Equal slopes have none, and their result is not used.
    parted = slope != slope_next
    x = slope / np.where(parted, slope - slope_next, 1.0)
    rise = 0.5 * x * slope
    whole = 0.5 * (slope + slope_next)
    scale = np.where(np.abs(whole) > 1e-12, (t_next - t) / np.where(whole == 0, 1.0, whole), 0.0)
    scale = np.where(scale > 0, np.minimum(scale, step.length[chosen]), step.length[chosen])
    return t + scale * rise


class BranchFollowing(Method):
    """Follows the branch from steady sliding by its arclength, on finer and finer meshes."""

    name = "branch following"
    choice = "collocation"

    def __init__(self, meshes: tuple[BranchMesh, ...] = MESHES) -> None:
        """`meshes` are tried in turn, each on the points without a definite outcome."""
        self.meshes = meshes

    def suits(self, problem: Problem) -> bool:
        """Any equations and load."""
        return True

    def candidates(self, solution: Solution) -> Indices:
        """Points without an orbit, or with one that was lost on every finer mesh."""
        return np.flatnonzero(_without_orbit(solution))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; `detail` is the amplitude at which the branch ends."""
        points = problem.system.V.shape[-1]
        solution = Solution.unsolved(problem, points, options)
        definite = np.zeros(points, dtype=bool)
        for mesh in self.meshes:
            rows = np.flatnonzero(_without_orbit(solution) & ~definite)
            if len(rows):
                part = take(problem, rows)
                guess, definite[rows] = orbits_along_branches(part, len(rows), mesh)
                attempt = Solution.unsolved(problem, len(rows), options)
                solve_from(part, attempt, guess, options)
                solution.merge(rows, attempt)
                options.progress(int(attempt.converged.sum()))
        return solution


def _without_orbit(solution: Solution) -> NDArray[np.bool_]:
    lost = (solution.outcome == Outcome.NOT_RESOLVED) & np.isinf(solution.detail)
    return np.isin(solution.outcome, WITHOUT_ORBIT) | lost


def orbits_along_branches(
    problem: Problem, points: int, mesh: BranchMesh
) -> tuple[InitialGuess, NDArray[np.bool_]]:
    """Orbits of all points of `problem` (NumPy arrays) at the end of their branch.

    Where a branch does not reach the requested amplitude, `outcome` has the reason. Returned with
    the guess is whether a finer mesh would give the same, shape (points,).
    """
    branch = follow_from_steady_sliding(problem, np.arange(points), mesh)
    guess = InitialGuess.none(problem, points, mesh.intervals)._replace(orbit=branch.orbit)
    guess.detail[:] = branch.farthest
    amplitude = np.broadcast_to(problem.load.amplitude, (points,))
    for which, outcome, share in (
        (branch.folded, Outcome.FOLDED, branch.fold),
        (branch.ran_away, Outcome.RUNAWAY, branch.end),
        (branch.sensitive, Outcome.SENSITIVE, branch.farthest),
    ):
        rows = np.flatnonzero(which & (amplitude > 0))
        guess.outcome[rows] = outcome
        guess.detail[rows] = share[rows] * amplitude[rows]
    guess.solved[:] = branch.arrived
    return guess, branch.definite
