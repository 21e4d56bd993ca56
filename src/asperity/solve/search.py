"""The search for periodic orbits: from the fast method to the robust one, each where it is needed.

1. Fourier collocation, on a grid as fine as the slip pulse needs, for points whose orbit moves
   little within a period; with inertia on elastic asperities shooting takes its place.
2. Fourier series solved directly, for slow modulation: smooth orbits, however stiff the equations.
3. Collocation with Newton's method from the averaged limit.
4. Collocation along a path in amplitude; along the branch from steady sliding, by its arclength;
   along a path in frequency.
5. Whatever stages 3 and 4 found is solved on finer and finer meshes, until mean, first and second
   harmonic and multipliers agree between two meshes to `refinement.AGREEMENT`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from asperity.loads import Harmonic
from asperity.slider import QuasiStatic
from asperity.solve.adiabatic import adiabatic_growth
from asperity.solve.batch import Indices, run_chunks, take
from asperity.solve.continuation.pursuit import CHUNK as PURSUIT_CHUNK
from asperity.solve.continuation.pursuit import HELD
from asperity.solve.continuation.pursuit import MESHES as PURSUIT_MESHES
from asperity.solve.found import Float, Found, Options, logs_of, store
from asperity.solve.kernels import (
    FAST_BLOCK,
    Problem,
    fast_solve,
    sharpness_of_slip,
    stiffness_of_steady_sliding,
)
from asperity.solve.outcome import Outcome
from asperity.solve.refinement import MESHES, accept, refine
from asperity.solve.shooting_search import is_shootable, shooting_stages
from asperity.solve.smooth import smooth_orbits
from asperity.solve.starts import (
    Start,
    near_orbits,
    orbits_along_branches,
    orbits_from_high_frequency,
)

#: All methods, by the names that a user may choose among: the fast one, Fourier collocation or,
#: with inertia on elastic asperities, shooting; series for smooth orbits; and the robust one.
METHODS = ("fourier", "smooth", "collocation")

#: Fourier grids (nodes, grading), each after the sharpness of the slip pulse it is fine enough for:
#: the nodes that a pulse needs grow with the root of it. Sharper ones are left to collocation.
_GRIDS = ((5.0, 24, 0.3), (9.5, 28, 0.3), (18.0, 32, 0.3), (300.0, 128, 0.5))
#: Points in a call: enough for the time that a call costs, few enough for a single point.
_FOURIER_CHUNK = 4 * FAST_BLOCK
#: Error that the fast method must reach.
_FOURIER_ERROR = 1e-9
#: Rate per radian above which Fourier collocation cannot contract, from experience, and from which
#: modulation counts as slow.
_FOURIER_STIFFNESS = 1.0

#: Points whose orbits are kept in memory at a time.
_BLOCK = 2048


def find_orbits(
    problem: Problem,
    points: int,
    *,
    harmonics: int,
    phases: int,
    progress: Callable[[int], None],
    methods: tuple[str, ...] = METHODS,
) -> Found:
    """Find the periodic orbit of every operating point.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    points : int
    harmonics, phases : int
        Harmonics and waveform samples to read off.
    progress : callable
        Told the number of points finished since the last call.
    methods : tuple of str
        Which methods to use; both unless they are to be held against each other.
    """
    found = Found.empty(problem.system.size, points, harmonics, phases)
    options = Options(harmonics, phases, progress)
    left = np.arange(points)
    if "fourier" in methods and _is_fast(problem):
        left = _fourier_stages(problem, found, left, options)
    elif "fourier" in methods and is_shootable(problem):
        left = shooting_stages(problem, found, left, options)
    for start in range(0, len(left), _BLOCK):
        block = left[start : start + _BLOCK]
        if "smooth" in methods:
            block = _smooth(problem, found, block, options)
        if "collocation" in methods and len(block):
            _collocate(problem, found, block, options)
    return found


def _is_fast(problem: Problem) -> bool:
    """Whether the fast method knows these equations: its grid has one weakest contact, at pi."""
    return isinstance(problem.system, QuasiStatic) and isinstance(problem.load, Harmonic)


def _fourier_stages(problem: Problem, found: Found, index: Indices, options: Options) -> Indices:
    """Run the Fourier stages; returns the points they leave."""
    stiffness = _measured(stiffness_of_steady_sliding, problem, index)
    sharpness = _measured(sharpness_of_slip, problem, index)
    candidates = index[stiffness[index] < _FOURIER_STIFFNESS]
    # Blocks run until their slowest point is done: points of like difficulty belong together.
    candidates = candidates[np.argsort(stiffness[candidates], kind="stable")]
    for sharpest, nodes, grading in _GRIDS:
        solve = partial(
            fast_solve,
            nodes=nodes,
            grading=grading,
            harmonics=options.harmonics,
            phases=options.phases,
        )
        chosen = candidates[sharpness[candidates] <= sharpest]
        for part, (reading, error, steps) in run_chunks(solve, problem, chosen, _FOURIER_CHUNK):
            good = error < _FOURIER_ERROR
            kept = take(reading, np.flatnonzero(good))
            store(found, part[good], kept, logs_of(kept))
            found.iterations[part] += steps
            options.progress(int(good.sum()))
        candidates = candidates[found.outcome[candidates] != Outcome.CONVERGED]
    return index[found.outcome[index] != Outcome.CONVERGED]


def _measured(measure: Callable[[Problem], Any], problem: Problem, index: Indices) -> Float:
    """One number for each of the points `index`, inf for the others."""
    values = np.full(problem.system.V.shape, np.inf)
    for part, value in run_chunks(measure, problem, index, 4096):
        values[part] = value
    return values


def _smooth(problem: Problem, found: Found, block: Indices, options: Options) -> Indices:
    """Solve what is smooth of a block; returns the points that are left."""
    system, load = take(problem, block)
    # Mass and damping make equations stiff too, but not their orbits smooth.
    sliding = Problem(QuasiStatic(system.slider, system.V, system.omega), load)
    stiffness = _measured(stiffness_of_steady_sliding, sliding, np.arange(len(block)))
    slow = np.flatnonzero(stiffness >= _FOURIER_STIFFNESS)
    if len(slow):
        part = take(Problem(system, load), slow)
        smooth = smooth_orbits(part, len(slow))
        kept = np.flatnonzero(smooth.found)
        if len(kept):
            rows = block[slow[kept]]
            accept(take(part, kept), found, rows, take(smooth.orbit, kept), options)
    return block[found.outcome[block] != Outcome.CONVERGED]


#: What the branch from steady sliding may have come to; another branch may have an orbit.
_WITHOUT_ORBIT = (Outcome.NO_ORBIT, Outcome.FOLDED, Outcome.RUNAWAY, Outcome.SENSITIVE)


def _collocate(problem: Problem, found: Found, block: Indices, options: Options) -> None:
    """Collocation, however far the start has to be fetched, and refinement of a block."""
    part, points = take(problem, block), len(block)
    silent = options._replace(progress=lambda _: None)
    start = near_orbits(part, points)
    _settle(part, found, block, start, np.arange(points), silent)
    told = _told(found, block, options, 0)
    settled = np.zeros(points, dtype=bool)
    for mesh in PURSUIT_MESHES:
        asked = (Outcome.NO_ORBIT,) if mesh == PURSUIT_MESHES[-1] else _WITHOUT_ORBIT
        lost = np.isin(found.outcome[block], asked) & ~settled
        # Also what was found on a coarse mesh and lost on every finer one is sought again.
        lost |= (found.outcome[block] == Outcome.NOT_RESOLVED) & np.isinf(found.detail[block])
        index = np.flatnonzero(lost)
        if len(index):
            start, definite = orbits_along_branches(part, points, index, mesh)
            settled |= definite
            _settle(part, found, block, start, index, silent)
            told = _told(found, block, options, told)
    index = np.flatnonzero(np.isin(found.outcome[block], _WITHOUT_ORBIT))
    if len(index):
        rows = block[index]
        said = found.outcome[rows], found.detail[rows]
        _settle(part, found, block, orbits_from_high_frequency(part, points, index), index, silent)
        told = _told(found, block, options, told)
        # An orbit of another branch that is not confirmed leaves what was said of this one.
        lost = found.outcome[rows] == Outcome.NOT_RESOLVED
        found.outcome[rows[lost]], found.detail[rows[lost]] = (a[lost] for a in said)
    _tell_sensitive(part, found, block)
    options.progress(points - told)


def _tell_sensitive(problem: Problem, found: Found, block: Indices) -> None:
    """Say of what is left without an answer where it is too unstable for any."""
    lost = np.flatnonzero(np.isin(found.outcome[block], (Outcome.NO_ORBIT, Outcome.NOT_RESOLVED)))
    amplitude = np.broadcast_to(problem.load.amplitude, block.shape)
    for part, growth in run_chunks(adiabatic_growth, problem, lost, PURSUIT_CHUNK):
        part = part[growth > HELD]
        rows = block[part]
        share = np.where(found.outcome[rows] == Outcome.NO_ORBIT, found.detail[rows], 1.0)
        found.detail[rows] = np.minimum(share, 1.0) * amplitude[part]
        found.outcome[rows] = Outcome.SENSITIVE


def _told(found: Found, block: Indices, options: Options, before: int) -> int:
    """Tell how many more points of a block are solved; returns how many are."""
    solved = int((found.outcome[block] == Outcome.CONVERGED).sum())
    options.progress(solved - before)
    return solved


def _settle(
    problem: Problem, found: Found, block: Indices, start: Start, index: Indices, options: Options
) -> None:
    """Refine what was found of the points `index`; keep the reason of the rest."""
    # A path that came to nothing does not take back what an earlier one had to say.
    said = start.found | (start.detail > 0)
    found.outcome[block[said]], found.detail[block[said]] = start.outcome[said], start.detail[said]
    coarse = start.orbit.mesh.shape[0] - 1
    meshes = tuple(intervals for intervals in MESHES if intervals >= coarse)
    chosen = index[start.found[index]]
    if len(chosen):
        refine(problem, found, block, start.orbit, chosen, options, meshes)
