"""From steady sliding to the amplitude asked for, through folds and canards, in batches."""

from __future__ import annotations

from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.continuation.arclength import Point, Tangent, first_tangent
from asperity.solve.continuation.line import Line, amplitude_line
from asperity.solve.continuation.moving_mesh import Advance, Pair, moving_step, straight
from asperity.solve.kernels import Problem
from asperity.solve.mesh import Orbit
from asperity.solve.scheme import scheme_for

Float = NDArray[np.float64]

#: Intervals of the moving mesh: enough for a jump of e^20 in the slip rate.
INTERVALS = 96
#: Exponent of the slip rate beyond which a pulse is so narrow, below 1e-7 of the period, that
#: round-off in the phase limits it.
RUNAWAY = 13.0

_CHUNK = 16
_MOST_STEPS = 600
#: Distance from the amplitude asked for below which steps aim at it, and at which it is reached.
_NEAR, _ARRIVED = 1e-2, 1e-3
#: A branch this far back from a fold, as a share of the amplitude, is on its way back.
_BACK = 1e-3
_NEWTON_STEPS = 10
_ACCEPTED = 1e-5
#: Distance from the prediction, in steps, above which a step is not trusted.
_MISS = 0.5
_FIRST = 0.02
#: Longest step in the space of states, phase and share, and its change by what Newton needed.
_LONGEST, _GROWTH, _SHRINKAGE = 1.0, 1.4, 0.4
_EASY, _HARD = 4, 6
#: Failures after which the last step is no guide any more, and those after which all ends.
_RESTART, _GIVE_UP = 4, 10


class Pursuit(NamedTuple):
    """What came of following branches from steady sliding.

    Attributes
    ----------
    orbit : Orbit
        Orbits at the share reached, on `INTERVALS` intervals.
    share : array, shape (points,)
        Share of the amplitude reached; about 1 where it succeeded.
    fold : array, shape (points,)
        Share at the fold that is farthest from steady sliding, NaN where there was none.
    farthest : array, shape (points,)
        Largest share on the branch.
    fastest : array, shape (points,)
        Largest exponent of the slip rate of the last orbit.
    """

    orbit: Orbit
    share: Float
    fold: Float
    farthest: Float
    fastest: Float

    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether the amplitude asked for was reached."""
        return np.abs(self.share - 1) <= _ARRIVED

    @property
    def ran_away(self) -> NDArray[np.bool_]:
        """Whether slip became too fast to be followed."""
        return ~self.arrived & (self.fastest >= RUNAWAY)

    @property
    def folded(self) -> NDArray[np.bool_]:
        """Whether the branch was left on its way back from its farthest fold."""
        with np.errstate(invalid="ignore"):
            back = (self.fold >= self.farthest - _BACK) & (self.share < self.farthest - _BACK)
        return ~self.arrived & ~self.ran_away & back


def pursue(problem: Problem, index: Indices) -> Pursuit:
    """Follow the points `index` of `problem` (NumPy arrays) from steady sliding."""
    points = len(problem.system.V)
    line = amplitude_line(problem)
    pair = _steady_pair(line, points, index)
    result = Pursuit(
        pair.point.orbit,
        np.zeros(points),
        np.full(points, np.nan),
        np.zeros(points),
        np.zeros(points),
    )
    for start in range(0, len(index), _CHUNK):
        part = index[start : start + _CHUNK]
        put(result, part, _pursue_chunk(*take((line, pair), part)))
    return result


def _steady_pair(line: Line, points: int, index: Indices) -> Pair:
    system = line.origin.system
    orbit = Orbit.empty(scheme_for(system), system.size, INTERVALS, points)
    orbit.mesh[:] = np.linspace(0, 2 * np.pi, INTERVALS + 1)[:, None]
    steady = jax.jit(lambda s: s.steady())(system)
    orbit.centre[:] = np.broadcast_to(np.asarray(steady), orbit.centre.shape)
    t = np.zeros(points)
    tangent = Tangent(np.zeros_like(orbit.nodes), np.zeros_like(orbit.slopes), np.zeros(points))
    for part, found in run_chunks(first_tangent, (line, orbit, t), index, _CHUNK):
        put(tangent, part, found)
    pair = Pair(orbit, np.zeros(points), Point(orbit, t, tangent))
    lengths = np.full(points, _FIRST)
    pair = jax.tree.map(np.array, pair)
    for part, found in run_chunks(straight, (line, pair.point, lengths), index, _CHUNK):
        put(pair, part, found)
    return pair


def _pursue_chunk(line: Line, pair: Pair) -> Pursuit:
    """Follow the points of a chunk, each with its own steps."""
    points = len(pair.t_before)
    everyone = np.arange(points)
    ratio, last = np.ones(points), np.full(points, _FIRST)
    failures, active = np.zeros(points, int), np.ones(points, bool)
    fold, farthest = np.full(points, np.nan), np.zeros(points)
    fastest = np.zeros(points)
    advance = jax.tree_util.Partial(moving_step, max_steps=_NEWTON_STEPS)
    for _ in range(_MOST_STEPS):
        at = np.flatnonzero(active)
        if not len(at):
            break
        ratio = _towards_the_end(pair, ratio)
        for part, step in run_chunks(advance, (line, pair, ratio), at, _CHUNK):
            good = (step.error < _ACCEPTED) & (step.miss < _MISS)
            kept, chosen = part[good], np.flatnonzero(good)
            turned = pair.point.tangent.t[kept] * step.next.point.tangent.t[chosen] < 0
            extremum = np.where(turned, _extremum(pair, step, kept, chosen), np.nan)
            fold[kept] = np.fmax(fold[kept], extremum)
            put(pair, kept, take(step.next, chosen))
            farthest[kept] = np.maximum(farthest[kept], pair.point.t[kept])
            last[kept], fastest[kept] = step.length[chosen], step.fastest[chosen]
            failures[part] = np.where(good, 0, failures[part] + 1)
            ratio[part] = _next_ratio(ratio[part], good, step.iterations, step.length)
        stuck = active & (failures >= _RESTART)
        if stuck.any():
            lengths = last * 0.1 * _SHRINKAGE ** (failures - _RESTART)
            fresh = jax.tree.map(np.array, straight((line, pair.point, lengths)))
            put(pair, everyone[stuck], take(fresh, np.flatnonzero(stuck)))
            ratio[stuck] = 1.0
        here = pair.point.t
        active &= (np.abs(here - 1) > _ARRIVED) & (here > -0.01) & (fastest < RUNAWAY)
        active &= failures < _GIVE_UP
    return Pursuit(pair.point.orbit, pair.point.t, fold, farthest, fastest)


def _towards_the_end(pair: Pair, ratio: Float) -> Float:
    """Steps that are not predicted to pass the amplitude asked for; back where one passed it."""
    last, left = pair.point.t - pair.t_before, 1 - pair.point.t
    near = (last != 0) & (np.abs(left) < _NEAR)
    near |= (last > 0) & ((ratio * last > left) | (left < 0))
    secant = left / np.where(near, last, 1.0)
    return np.where(near, np.clip(secant, -1.0, 2.0), ratio)


def _next_ratio(ratio: Float, good: NDArray[np.bool_], iterations: Float, length: Float) -> Float:
    """Next step over the last one."""
    change = np.where(iterations <= _EASY, _GROWTH, np.where(iterations <= _HARD, 1.0, 0.7))
    longest = _LONGEST / np.maximum(length, 1e-9)
    return np.where(good, np.minimum(change, longest), ratio * _SHRINKAGE)


def _extremum(pair: Pair, step: Advance, rows: Indices, chosen: Indices) -> Float:
    """Largest or smallest t between two points, of the cubic through values and directions."""
    t, slope = pair.point.t[rows], pair.point.tangent.t[rows]
    t_next = step.next.point.t[chosen]
    slope_next = step.next.point.tangent.t[chosen]
    # The parabola of the slope has its zero at x; the area under the slope to there is the rise.
    x = slope / (slope - slope_next)
    rise = 0.5 * x * slope
    whole = 0.5 * (slope + slope_next)
    scale = np.where(np.abs(whole) > 1e-12, (t_next - t) / np.where(whole == 0, 1.0, whole), 0.0)
    scale = np.where(scale > 0, np.minimum(scale, step.length[chosen]), step.length[chosen])
    return t + scale * rise
