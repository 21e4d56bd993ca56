"""Continuation in amplitude, from steady sliding to the requested amplitude, through folds.

The method of the search refines the orbit at the end of each branch, or reports why the branch ends
before the requested amplitude. Branches are followed in batches.
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
from asperity.algebra.predictor_corrector import Attempt, Curves, StepControl, follow
from asperity.arrays import Bool, Float, Index
from asperity.loads import Excitation
from asperity.orbit.batches import put, run_chunks, take
from asperity.orbit.mesh.arclength import (
    MOVING,
    BranchStep,
    ParameterLine,
    PointPair,
    amplitude_line,
    branch_step,
    first_point,
    straight,
)
from asperity.orbit.mesh.mesh import Orbit, scheme_for
from asperity.orbit.methods.collocation import refine
from asperity.orbit.outcome import WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider.problem import Problem

#: Branches that are followed in a call; one or two, which may need by far the most steps, take half
#: of the time in a smaller call.
CHUNK = (8, 2)


class BranchMesh(NamedTuple):
    """Intervals of a moving mesh, and most steps along a branch on it."""

    intervals: int
    most_steps: int


#: First mesh, and a finer mesh for points without a definite outcome.
MESHES = (BranchMesh(216, 200), BranchMesh(648, 1000))
#: Exponent of the slip rate beyond which a pulse is so narrow, below 1e-7 of the period, that
#: round-off in the phase limits it.
RUNAWAY = 13.0

#: Direct effect, over that of steady sliding, at whose smallest value over the period the slider
#: comes to rest: the share reached is then as close to that at which it does.
_AT_REST = 1e-6

#: Distance from the requested amplitude below which steps aim at it, and at which it is reached.
_NEAR, _ARRIVED = 1e-2, 1e-6
#: How far the exponent may exceed `RUNAWAY` on a branch within `_NEAR` of the requested amplitude.
_AHEAD = 0.5
#: A branch counts as returning when it is this far behind its fold (share of the amplitude).
_BACK = 1e-3
_NEWTON_STEPS = 10
#: Distance that the motion of the mesh may cause; shorter steps do not reduce it.
_NOISE = 0.15
#: Length of the first step.
_FIRST = 0.02
#: Number of failures after which a step is predicted along the tangent.
_RESTART = 4
#: Factor on the distance to the limit at which pulses run away, for what is reported.
_DOUBT = 1.5
#: Extrapolation of the share to where pulses run away: smallest exponent at which it begins, rise
#: of the exponent over which the gain of the share is measured, and factor on the extrapolated gain
#: that makes the estimate a cautious one.
_RUNNING, _RISE, _CAUTION = 5.0, 0.3, 2.0


def follow_from_steady_sliding(problem: Problem, mesh: BranchMesh) -> MovingBranches:
    """Follow all points of `problem` (NumPy arrays) from steady sliding.

    The branch starts at steady sliding on every mesh, because a coarse mesh is inaccurate long
    before the branch is lost.
    """
    line, system = amplitude_line(problem), problem.system
    points = len(system.V)
    orbit = Orbit.empty(scheme_for(system), system.size, mesh.intervals, points)
    orbit.mesh[:] = np.linspace(0, 2 * np.pi, mesh.intervals + 1)[:, None]
    steady = jax.jit(lambda s: s.steady())(system)
    orbit.centre[:] = np.broadcast_to(np.asarray(steady), orbit.centre.shape)
    return followed_branches(line, orbit, mesh.most_steps)


def followed_branches(line: ParameterLine, orbit: Orbit, most_steps: int) -> MovingBranches:
    """Branches followed from orbits at the beginning of a line of parameters towards its end."""

    def begin(line: ParameterLine, orbit: Orbit, t: Float) -> PointPair:
        return straight(first_point(line, orbit, t), np.full(len(t), _FIRST))

    points = orbit.centre.shape[1]
    everyone, start = np.arange(points), (line, orbit, np.zeros(points))
    parts = [pair for _, pair in run_chunks(begin, start, everyone, CHUNK)]
    branches = MovingBranches(line, jax.tree.map(lambda *a: np.concatenate(a, axis=-1), *parts))
    follow(branches, np.full(points, _FIRST), most=most_steps)
    return branches


def continues(share: Float, fastest: Float) -> Bool:
    """Whether to follow a branch further: it has not arrived, run away or returned to the start."""
    left = np.abs(share - 1)
    fastest = np.where(left < _NEAR, fastest - _AHEAD, fastest)
    return (left > _ARRIVED) & (share > -0.01) & (fastest < RUNAWAY)


class MovingBranches(Curves):
    """Branches along lines of parameters on moving meshes, predicted from their last two points.

    A share is the coordinate on the line: of the amplitude, for branches from steady sliding.

    Attributes
    ----------
    line : ParameterLine
    pair : PointPair
        The last two points of each branch.
    span : array, shape (points,)
        Distance between these two.
    fold : array, shape (points,)
        Share at the fold that is farthest from the beginning, NaN where there was none.
    farthest : array, shape (points,)
        Largest share on the branch.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the last orbit.
    rests : bool array, shape (points,)
        Whether the branch ends because the slider comes to rest.
    limit : array, shape (points,)
        Share at which pulses would reach e^`RUNAWAY`, extrapolated from their latest growth; inf
        where they do not grow.
    watched_share, watched_exponent : array, shape (points,)
        Share and exponent from which the present rise of the exponent is counted.
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
        """At the beginning of the line."""
        self.line, self.pair = line, pair
        zero = np.zeros_like(pair.t_before)
        self.span, self.fold, self.limit = zero + _FIRST, zero + np.nan, zero + np.inf
        self.farthest, self.fastest = zero.copy(), zero.copy()
        self.rests = np.zeros(zero.shape, dtype=bool)
        self.watched_share, self.watched_exponent = zero.copy(), zero.copy()

    @property
    def share(self) -> Float:
        """Share reached; about 1 where a branch succeeded."""
        return self.pair.point.t

    @property
    def arrived(self) -> Bool:
        """Whether the end of the line was reached."""
        return np.abs(self.share - 1) <= _ARRIVED

    @property
    def folded(self) -> Bool:
        """Whether the branch was abandoned while it returned from its farthest fold."""
        with np.errstate(invalid="ignore"):
            back = (self.fold >= self.farthest - _BACK) & (self.share < self.farthest - _BACK)
        return ~self.arrived & back

    @property
    def end(self) -> Float:
        """Share before which pulses pass e^`RUNAWAY`; inf where they are not known to."""
        return np.where(self.fastest >= RUNAWAY, self.share, self.limit)

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """Lengths that are not predicted to pass the end of the line.

        The length is negative where the last step has passed it. After several failures along the
        secant the next step is predicted along the tangent.
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
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """Steps on the moving mesh."""
        advance = partial(branch_step, remeshing=MOVING, max_steps=_NEWTON_STEPS)
        inputs = (self.line, self.pair, length / self.span)
        for part, step in run_chunks(advance, inputs, rows, CHUNK):
            miss = np.where(step.miss * step.length < _NOISE, 0.0, step.miss)
            converged = np.isfinite(step.error)
            yield part, Attempt(step, converged, step.iterations, step.turn, miss, step.length)

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Update folds, shares and exponents; a branch ends where it arrives or runs away."""
        step, before = attempt.next, self.pair.point.tangent.t[rows]
        turned = before * step.next.point.tangent.t[chosen] < 0
        extremum = np.where(turned, _extremum(self.pair, step, rows, chosen), np.nan)
        self.fold[rows] = np.fmax(self.fold[rows], extremum)
        put(self.pair, rows, take(step.next, chosen))
        self.span[rows], self.fastest[rows] = step.length[chosen], step.fastest[chosen]
        share = self.share[rows]
        self.farthest[rows] = np.maximum(self.farthest[rows], share)
        self._watch(rows, share)
        goes_on = continues(share, self.fastest[rows])
        if "log_velocity" in self.line.origin.system.mechanical:
            line, orbit = take((self.line, self.pair.point.orbit), rows)
            direct = np.asarray(_least_direct_effect(line.at(share), orbit))
            self.rests[rows] = goes_on & (direct < _AT_REST)
        return ["" if more else "ended" for more in goes_on & ~self.rests[rows]]

    def _watch(self, rows: Index, share: Float) -> None:
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


@jit_large
def _least_direct_effect(problem: Problem, orbit: Orbit) -> Array:
    """Smallest d(F_i/W)/d ln v at the nodes of an orbit, over that of steady sliding, (points,).

    It is A of most laws; of a law with a friction at rest it vanishes there with the velocity.
    """
    system, load = problem
    place = system.mechanical.index("log_velocity")

    def direct_effect(states: Array, at: Excitation) -> Array:
        def friction(log_v: Array) -> Array:
            return system.slider.law.friction(
                system.V * jnp.exp(log_v), system.law_state(states), at.w
            )

        _, slope = jax.jvp(friction, (states[place],), (jnp.ones_like(states[place]),))
        return jnp.asarray(slope)

    along = direct_effect(orbit.centre[:, None] + orbit.nodes, load.at(orbit.mesh[:-1]))
    steady = direct_effect(system.steady(), Excitation(jnp.ones_like(system.V)))
    return (along / steady).min(0)


@jit_large
def _largest_exponent(problem: Problem, orbit: Orbit) -> Array:
    """Largest ln(v/V) that the forces of an orbit permit, with inertia or radiation damping.

    Friction opposes sliding: eta v is at most the pulling force F, and the kinetic energy M v^2/2
    at most the energy F^2/(2 K) of the spring. Slip on elastic asperities may be faster than the
    slider: inf, shape (points,).
    """
    system, load = problem
    if "friction" in system.mechanical:
        return jnp.full_like(system.V, jnp.inf)
    at = load.at(orbit.mesh[:-1])
    pulling = (orbit.centre[0] + orbit.nodes[0] + at.shear).max(0)
    limits = [pulling / system.damping]
    if "log_velocity" in system.mechanical:
        slider = system.slider
        limits.append(pulling * slider.W0 / (system.V * jnp.sqrt(slider.K * slider.M)))
    return jnp.log(jnp.stack(limits).min(0))


def _extremum(pair: PointPair, step: BranchStep, rows: Index, chosen: Index) -> Float:
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


class AmplitudeContinuation(Method):
    """Follows branches from steady sliding by their arclength, on finer and finer meshes."""

    name = "continuation in amplitude"
    choice = "collocation"

    def __init__(self, meshes: tuple[BranchMesh, ...] = MESHES) -> None:
        """`meshes` are tried in turn, each on the points without a definite outcome."""
        self.meshes = meshes

    def candidates(self, solution: Solution) -> Index:
        """Points without an orbit, or whose orbit was lost on every finer mesh.

        Where the interface force vanishes on the branch, its end is known.
        """
        known = solution.outcome == Outcome.REVERSES
        return np.flatnonzero(_without_orbit(solution) & ~known)

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; `detail` is the amplitude at which the branch ends."""
        solution = Solution.unsolved(problem, options)
        definite = np.zeros_like(solution.converged)
        for mesh in self.meshes:
            rows = np.flatnonzero(_without_orbit(solution) & ~definite)
            if len(rows):
                part = take(problem, rows)
                attempt = Solution.unsolved(part, options)
                definite[rows] = solve_along_branches(part, attempt, options, mesh)
                solution.merge(rows, attempt)
                options.progress(int(attempt.converged.sum()))
        return solution


def _without_orbit(solution: Solution) -> Bool:
    lost = (solution.outcome == Outcome.NOT_RESOLVED) & np.isinf(solution.detail)
    return np.isin(solution.outcome, WITHOUT_ORBIT) | lost


def solve_along_branches(
    problem: Problem, solution: Solution, options: SearchOptions, mesh: BranchMesh
) -> Bool:
    """Refine the orbits at the ends of the branches, or give the reason why a branch has none.

    Returns
    -------
    bool array, shape (points,)
        Whether the outcome does not depend on the mesh.
    """
    branch = follow_from_steady_sliding(problem, mesh)
    if problem.system.mechanical[0] == "force":
        # Growth towards a velocity that cannot be reached ends on the way.
        largest = _largest_exponent(branch.line.at(branch.share), branch.pair.point.orbit)
        branch.limit[np.asarray(largest) < RUNAWAY] = np.inf
    arrived, folded = branch.arrived, branch.folded
    ran_away = ~arrived & ~folded & ~branch.rests & (branch.end < 1)
    # Of 19 branches with this below 1, none has an orbit on the finer mesh: the pulses of 15 run
    # away, at most 1.1 times as far beyond the last orbit as the limit, and 3 branches turn back.
    beyond = branch.share + _DOUBT * (branch.end - branch.share)
    amplitude = np.broadcast_to(problem.load.amplitude, arrived.shape)
    solution.detail[:] = branch.farthest
    for which, outcome, share in (
        (folded, Outcome.FOLDED, branch.fold),
        (branch.rests, Outcome.RESTS, branch.farthest),
        (ran_away, Outcome.RUNAWAY, np.minimum(beyond, 1.0)),
    ):
        rows = np.flatnonzero(which & (amplitude > 0))
        solution.outcome[rows] = outcome
        solution.detail[rows] = share[rows] * amplitude[rows]
    refine(problem, solution, branch.pair.point.orbit, np.flatnonzero(arrived), options)
    return arrived | folded | branch.rests | (branch.fastest >= RUNAWAY) | (beyond < 1)
