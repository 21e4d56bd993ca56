"""Following the orbit from an easier operating point to one where Newton's method alone fails.

Two paths: in amplitude, from steady sliding at epsilon = 0, where the orbit is known; and
in frequency, from a modulation so fast that the averaged limit holds. Each point takes its own
steps along its path: longer after a success, shorter after a failure.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.kernels import Problem, follow_orbit
from asperity.solve.mesh import Orbit

Float = NDArray[np.float64]
Path = Callable[[Problem, Float], Problem]

_GROWTH, _SHRINKAGE = 1.6, 0.35


class Patience(NamedTuple):
    """Smallest step of a path, and how many of them it may take."""

    smallest_step: float
    most_steps: int


#: For paths that arclength continuation takes up where they fail, and for those that it does not.
BRIEF, LONG = Patience(1e-3, 60), Patience(1e-4, 250)

_CHUNK = 16
#: A step is accepted when Newton's method has converged to this; the end point is solved again.
_ACCEPTED = 1e-5


def along_amplitude(problem: Problem, t: Float) -> Problem:
    """Epsilon reaches t of its value."""
    return problem._replace(load=problem.load.scaled(t))


def along_rest(share: Float) -> Path:
    """The last of the path in amplitude, from `share` of epsilon, which may be beyond it."""

    def path(problem: Problem, t: Float) -> Problem:
        return along_amplitude(problem, share + (1 - share) * t)

    return path


def along_frequency(start: Float) -> Path:
    """Path down from omega = `start` (rad/s) to the omega asked for, even in its logarithm."""

    def path(problem: Problem, t: Float) -> Problem:
        omega = start * (problem.system.omega / start) ** t
        return problem._replace(system=eqx.tree_at(lambda q: q.omega, problem.system, omega))

    return path


def follow(
    problem: Problem,
    path: Path,
    orbit: Orbit,
    index: Indices,
    *,
    first_step: float,
    patience: Patience = BRIEF,
) -> Float:
    """Follow the orbits of the points `index` along `path` from t = 0 to t = 1.

    Parameters
    ----------
    problem : Problem
        At t = 1; NumPy arrays.
    path : callable
        (problem, t) -> problem, `t` an array over the points.
    orbit : Orbit
        Orbits at t = 0, NumPy arrays; overwritten with the orbits at the t reached.
    index : array of int
        Points to work on.
    first_step : float
    patience : Patience

    Returns
    -------
    array, shape (points of the problem,)
        The t reached; 1 where it succeeded.
    """
    points = orbit.centre.shape[-1]
    intervals = orbit.mesh.shape[0] - 1
    t, step = np.zeros(points), np.full(points, first_step)
    active = index

    def advance(inputs: tuple[Problem, Orbit]) -> tuple[Orbit, Float]:
        return follow_orbit(inputs, intervals=intervals, max_steps=10)

    for _ in range(patience.most_steps):
        if not len(active):
            break
        trial = np.minimum(1.0, t + step)
        inputs = (path(problem, trial), orbit)
        for part, (moved, error) in run_chunks(advance, inputs, active, _CHUNK):
            # Also the re-meshed orbit must be finite: it is the next guess.
            good = (error < _ACCEPTED) & np.isfinite(moved.slopes).all((0, 1, 2))
            put(orbit, part[good], take(moved, np.flatnonzero(good)))
            t[part[good]] = trial[part[good]]
            step[part] *= np.where(good, _GROWTH, _SHRINKAGE)
        active = active[(t[active] < 1) & (step[active] > patience.smallest_step)]
    return t
