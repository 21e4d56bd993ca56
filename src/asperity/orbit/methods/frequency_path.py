"""Orbits followed in frequency, from a modulation so fast that the averaged limit holds."""

from __future__ import annotations

from collections.abc import Iterator

import equinox as eqx
import numpy as np
from numpy.typing import NDArray

from asperity._jax import jit_large
from asperity.algebra.continuation import Attempt, Curves, StepControl, follow
from asperity.arrays import Float, Index
from asperity.orbit.batches import mesh_chunk, put, run_chunks, take
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import remeshed, solve
from asperity.orbit.methods.collocation import orbits_from_averaged_limit, refine
from asperity.orbit.outcome import WITHOUT_ORBIT, Outcome
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import perturbation_rate
from asperity.slider.problem import Problem

#: Rate per radian of a perturbation at which the averaged limit is close enough to start from.
_FAST_MODULATION = 0.02
#: Length of the first step (a fraction of the path), and largest number of steps.
_FIRST_STEP, _MOST_STEPS = 0.02, 250
#: A step is accepted when Newton's method has converged to this; the end point is solved again.
_ACCEPTED, _NEWTON_STEPS = 1e-5, 10

_rate = jit_large(perturbation_rate)


class FrequencyPath(Method):
    """Orbits of branches that are not connected with steady sliding."""

    name = "frequency path"
    choice = "collocation"

    def candidates(self, solution: Solution) -> Index:
        """Points whose branch from steady sliding has no orbit at the requested amplitude."""
        return np.flatnonzero(np.isin(solution.outcome, WITHOUT_ORBIT))

    def solve(self, problem: Problem, options: SearchOptions) -> Solution:
        """As in `Method`; an orbit that is not resolved may not exist, and is not reported."""
        solution = Solution.unsolved(problem, options)
        refine(problem, solution, *_orbits_from_high_frequency(problem), options)
        lost = solution.outcome == Outcome.NOT_RESOLVED
        solution.outcome[lost], solution.detail[lost] = Outcome.NO_ORBIT, 0.0
        options.progress(int(solution.converged.sum()))
        return solution


def _orbits_from_high_frequency(problem: Problem) -> tuple[Orbit, Index]:
    """Orbits of the points that reach the end of their path in frequency, and these points."""
    rate = np.zeros(problem.system.V.shape[-1])
    everyone = np.arange(len(rate))
    chunk = mesh_chunk(problem.system.size)
    for part, value in run_chunks(_rate, (problem,), everyone, chunk):
        rate[part] = value
    faster = np.maximum(rate / _FAST_MODULATION, 1.0)
    orbit, rows = orbits_from_averaged_limit(_faster(problem, faster), everyone)
    paths = FrequencyPaths(problem, faster, orbit)
    why = follow(paths, np.full(len(rate), _FIRST_STEP), rows=rows, most=_MOST_STEPS)
    return paths.orbit, np.flatnonzero(np.array(why) == _ARRIVED)


#: Reason why a path ends at the frequency of its point.
_ARRIVED = "arrived"


class FrequencyPaths(Curves):
    """Orbits at falling frequency, evenly in its logarithm.

    Parameters
    ----------
    problem : Problem
    faster : array, shape (points,)
        Frequency at the beginning of each path over that of its point.
    orbit : Orbit
        Orbits there.
    """

    control = StepControl(
        shortest=1e-4,  # in fractions of the path
        longest=1.0,
        growth=1.6,
        easy=_NEWTON_STEPS,
        hard=_NEWTON_STEPS,
        sharpest_turn=-1.0,
        farthest=np.inf,
        most_failures=_MOST_STEPS,
    )

    def __init__(self, problem: Problem, faster: Float, orbit: Orbit) -> None:
        self.problem, self.faster, self.orbit = problem, faster, orbit
        self.left = np.ones_like(faster)

    def aimed(self, length: Float, failures: NDArray[np.int_]) -> Float:
        """No further than the frequency of the point."""
        return np.minimum(length, self.left)

    def attempts(
        self, rows: Index, length: Float, failures: NDArray[np.int_]
    ) -> Iterator[tuple[Index, Attempt]]:
        """Collocation from the orbit at a higher frequency."""
        inputs = _faster(self.problem, self.faster ** (self.left - length)), self.orbit
        for part, (moved, error) in run_chunks(
            _advance, inputs, rows, mesh_chunk(self.problem.system.size)
        ):
            # The re-meshed orbit, which is the next guess, must also be finite.
            good = (error < _ACCEPTED) & np.isfinite(moved.slopes).all((0, 1, 2))
            none = np.zeros(len(part))
            yield part, Attempt(moved, good, none, none, none, length[part])

    def accept(self, rows: Index, chosen: Index, attempt: Attempt) -> list[str]:
        """Keep the orbits; a path ends at the frequency of its point."""
        put(self.orbit, rows, take(attempt.next, chosen))
        self.left[rows] -= attempt.length[chosen]
        return [_ARRIVED if left == 0 else "" for left in self.left[rows]]


def _faster(problem: Problem, factor: Float) -> Problem:
    """The problem at a frequency that is higher by a factor."""
    omega = np.asarray(problem.system.omega) * factor
    return problem._replace(system=eqx.tree_at(lambda q: q.omega, problem.system, omega))


def _advance(problem: Problem, guess: Orbit) -> tuple[Orbit, Float]:
    """Collocation from a neighbouring orbit; the result lies on a mesh made for it."""
    result = solve(problem, guess, _NEWTON_STEPS)
    return remeshed(problem, result.orbit, len(guess.mesh) - 1), result.error
