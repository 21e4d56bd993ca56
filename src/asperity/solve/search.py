"""The search for periodic orbits: from the fast method to the robust one, each where it is needed.

1. Fourier collocation on two grids, for points whose orbit moves little within a period.
2. Collocation with Newton's method from the averaged limit.
3. Collocation along a path in amplitude, then in frequency.
4. Whatever stages 2 and 3 found is solved on finer and finer meshes, until mean, first and second
   harmonic and multipliers agree between two meshes to `AGREEMENT`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.floquet import from_logs, log_multipliers
from asperity.solve.homotopy import along_amplitude, along_frequency, follow
from asperity.solve.kernels import (
    Problem,
    Reading,
    fast_solve,
    first_orbit,
    follow_orbit,
    refine_orbit,
    split_reading,
    stiffness_of_steady_sliding,
)
from asperity.solve.mesh import STAGES, Orbit
from asperity.solve.outcome import Outcome

Float = NDArray[np.float64]

#: Agreement between two meshes, relative, at which the finer one is trusted to 1e-8: its own error
#: is smaller by at least the factor 2^5 of a stiff orbit, by 2^8 otherwise.
AGREEMENT = 5e-9

#: (nodes, grading, points a chunk) of the Fourier stages, and the error they must reach.
_FOURIER = ((32, 0.3, 512), (128, 0.5, 128))
_FOURIER_ERROR = 1e-9
#: Rate per radian above which Fourier collocation cannot contract, from experience.
_FOURIER_STIFFNESS = 1.0

#: Orbits are followed on this mesh, and refined up to the last of these.
_FOLLOWED = 48
_REFINED = (48, 96, 192, 384, 768)
#: Interval-points in a chunk: keeps the working set of collocation within a core's cache.
_CHUNK_INTERVALS = 3072
#: Points whose orbits are kept in memory at a time.
_BLOCK = 2048

#: Multipliers below this modulus are compared absolutely: no experiment sees them.
_VANISHING = 1e-12


class Found(NamedTuple):
    """Results of a search, points along the last axis; NaN where no orbit was found."""

    mean_friction: Float
    harmonics: NDArray[np.complex128]
    log_multipliers: NDArray[np.complex128]
    waveform: Float
    iterations: NDArray[np.int64]
    outcome: NDArray[np.int64]
    detail: Float


class _Options(NamedTuple):
    harmonics: int
    phases: int
    progress: Callable[[int], None]


def find_orbits(
    problem: Problem,
    points: int,
    *,
    harmonics: int,
    phases: int,
    progress: Callable[[int], None],
    methods: tuple[str, ...] = ("fourier", "collocation"),
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
    size = problem.system.size
    found = Found(
        np.full(points, np.nan),
        np.full((harmonics, points), np.nan + 0j),
        np.full((size, points), np.nan + 0j),
        np.full((2, phases, points), np.nan),
        np.zeros(points, dtype=np.int64),
        np.full(points, int(Outcome.NO_ORBIT)),
        np.zeros(points),
    )
    options = _Options(harmonics, phases, progress)
    left = np.arange(points)
    if "fourier" in methods:
        left = _fourier_stages(problem, found, left, options)
    if "collocation" in methods:
        for start in range(0, len(left), _BLOCK):
            _collocate(problem, found, left[start : start + _BLOCK], options)
    return found


def _store(found: Found, index: Indices, reading: Reading, logs: np.ndarray) -> None:
    found.mean_friction[index] = reading.mean_friction
    found.harmonics[:, index] = reading.harmonics
    found.log_multipliers[:, index] = logs
    found.waveform[..., index] = reading.waveform
    found.outcome[index] = Outcome.CONVERGED


def _logs(reading: Reading) -> np.ndarray:
    return log_multipliers(
        np.asarray(reading.monodromy),
        np.asarray(reading.log_scale),
        np.asarray(reading.log_determinant),
    )


def _fourier_stages(
    problem: Problem, found: Found, index: Indices, options: _Options
) -> Indices:
    """Run the Fourier stages; returns the points they leave."""
    stiffness = np.full(found.outcome.shape, np.inf)
    for part, value in run_chunks(stiffness_of_steady_sliding, problem, index, 4096):
        stiffness[part] = value
    candidates = index[stiffness[index] < _FOURIER_STIFFNESS]
    # Chunks run until their slowest point is done: points of like difficulty belong together.
    candidates = candidates[np.argsort(stiffness[candidates], kind="stable")]
    for nodes, grading, chunk in _FOURIER:
        solve = partial(
            fast_solve,
            nodes=nodes,
            grading=grading,
            harmonics=options.harmonics,
            phases=options.phases,
        )
        for part, (reading, error, steps) in run_chunks(solve, problem, candidates, chunk):
            good = error < _FOURIER_ERROR
            kept = take(reading, np.flatnonzero(good))
            _store(found, part[good], kept, _logs(kept))
            found.iterations[part] += steps
            options.progress(int(good.sum()))
        candidates = candidates[found.outcome[candidates] != Outcome.CONVERGED]
    return index[found.outcome[index] != Outcome.CONVERGED]


def _chunk(intervals: int) -> int:
    return max(4, _CHUNK_INTERVALS // intervals)


def _empty_orbits(size: int, intervals: int, points: int) -> Orbit:
    return Orbit(
        np.zeros((intervals + 1, points)),
        np.zeros((size, points)),
        np.zeros((size, intervals, points)),
        np.zeros((size, STAGES, intervals, points)),
    )


def _collocate(problem: Problem, found: Found, block: Indices, options: _Options) -> None:
    """Stages 2 to 4 for a block of points."""
    part = take(problem, block)
    points = len(block)
    everything = np.arange(points)
    orbit = _empty_orbits(problem.system.size, _FOLLOWED, points)

    solved = _from_averaged(part, orbit, everything)
    reached = solved.astype(float)
    lost = np.flatnonzero(~solved)
    if len(lost):
        reached[lost] = _from_steady(part, orbit, lost)[lost]
        solved = reached >= 1
    found.detail[block] = reached * np.asarray(part.load.epsilon)
    lost = np.flatnonzero(~solved)
    if len(lost):
        solved[lost] = _from_high_frequency(part, orbit, lost)[lost]
    options.progress(int((~solved).sum()))
    _refine(part, found, block, orbit, np.flatnonzero(solved), options)


def _from_averaged(problem: Problem, orbit: Orbit, index: Indices) -> NDArray[np.bool_]:
    solved = np.zeros(orbit.centre.shape[-1], dtype=bool)
    solve = partial(first_orbit, intervals=_FOLLOWED)
    for part, (first, error) in run_chunks(solve, problem, index, _chunk(_FOLLOWED)):
        good = error < 1e-6
        put(orbit, part[good], take(first, np.flatnonzero(good)))
        solved[part] = good
    return solved


def _from_steady(problem: Problem, orbit: Orbit, index: Indices) -> Float:
    """Amplitude path from epsilon = 0; returns the share of epsilon reached."""
    steady = np.asarray(jax.jit(lambda s: s.steady())(problem.system))
    orbit.mesh[:, index] = np.linspace(0, 2 * np.pi, _FOLLOWED + 1)[:, None]
    orbit.centre[:, index] = np.broadcast_to(steady, orbit.centre.shape)[:, index]
    orbit.nodes[..., index] = 0.0
    orbit.slopes[..., index] = 0.0
    return follow(
        problem, along_amplitude, orbit, index, chunk=_chunk(_FOLLOWED), first_step=0.05
    )


def _from_high_frequency(problem: Problem, orbit: Orbit, index: Indices) -> NDArray[np.bool_]:
    """Frequency path from where the averaged limit holds; returns whether the end was reached."""
    stiffness = np.zeros(orbit.centre.shape[-1])
    for part, value in run_chunks(stiffness_of_steady_sliding, problem, index, 4096):
        stiffness[part] = value
    omega = np.asarray(problem.system.omega)
    path = along_frequency(omega * np.maximum(stiffness / 0.02, 1.0))
    started = _from_averaged(path(problem, np.zeros_like(omega)), orbit, index)
    reached = follow(
        problem,
        path,
        orbit,
        index[started[index]],
        chunk=_chunk(_FOLLOWED),
        first_step=0.02,
    )
    return reached >= 1


def _refine(
    problem: Problem,
    found: Found,
    block: Indices,
    orbit: Orbit,
    index: Indices,
    options: _Options,
) -> None:
    """Solve on finer meshes until two agree; writes the results of the finer one."""
    previous: dict[int, tuple[float, np.ndarray, np.ndarray]] = {}
    for intervals in _REFINED:
        finer = _empty_orbits(problem.system.size, intervals, len(block))
        solve = partial(
            refine_orbit,
            intervals=intervals,
            harmonics=options.harmonics,
            phases=options.phases,
        )
        unsettled = []
        for part, (fine, reading, error) in run_chunks(
            solve, (problem, orbit), index, _chunk(intervals)
        ):
            put(finer, part, fine)
            logs = _logs(reading)
            for k, point in enumerate(part):
                state = (
                    reading.mean_friction[k],
                    reading.harmonics[:2, k],
                    logs[:, k],
                )
                gap = _disagreement(previous.get(point), state) if error[k] < 1e-6 else None
                previous[point] = state
                here = block[point : point + 1]
                one = take(reading, np.array([k]))
                found.iterations[here] = intervals
                if gap is None:
                    found.outcome[here] = Outcome.NOT_RESOLVED
                    found.detail[here] = np.inf
                    unsettled.append(point)
                elif max(gap) <= AGREEMENT:
                    _store(found, here, one, logs[:, k : k + 1])
                    options.progress(1)
                else:
                    orbit_gap, multiplier_gap = gap
                    resolved = orbit_gap <= AGREEMENT
                    found.outcome[here] = (
                        Outcome.MULTIPLIERS_NOT_RESOLVED if resolved else Outcome.NOT_RESOLVED
                    )
                    found.detail[here] = multiplier_gap if resolved else orbit_gap
                    unsettled.append(point)
        orbit = finer
        index = np.array(unsettled, dtype=np.intp)
        if not len(index):
            return
    options.progress(len(index))


def _disagreement(
    before: tuple[float, np.ndarray, np.ndarray] | None,
    now: tuple[float, np.ndarray, np.ndarray],
) -> tuple[float, float] | None:
    """Relative change of mean and harmonics, and of multipliers, between two meshes."""
    if before is None or not all(np.all(np.isfinite(a)) for a in now):
        return None
    mean = abs(now[0] - before[0]) / abs(now[0])
    # Round-off of the mean bounds what a vanishing second harmonic can mean.
    floor = 1e-15 * abs(now[0]) / AGREEMENT
    harmonics = np.max(np.abs(now[1] - before[1]) / (np.abs(now[1]) + floor))
    old, new = from_logs(before[2]), from_logs(now[2])
    scale = np.maximum(np.abs(new), _VANISHING)
    with np.errstate(invalid="ignore"):
        gaps = np.where(old == new, 0.0, np.abs(old - new) / scale)
    huge = now[2].real > 700  # beyond doubles: the logarithms are compared
    gaps = np.where(huge, np.abs(now[2] - before[2]) / np.abs(now[2]), gaps)
    return max(mean, harmonics), float(np.max(gaps))
