"""Trust in an orbit: it is solved on finer and finer meshes until two of them agree."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.solve.batch import Indices, put, run_chunks, take
from asperity.solve.found import Found, Options, logs_of, store
from asperity.solve.kernels import (
    ACCEPTED,
    Problem,
    Reading,
    read_orbit,
    refine_orbit,
)
from asperity.solve.mesh import Orbit
from asperity.solve.multipliers import (
    AGREEMENT,
    chunk_size,
    multiplier_gap,
    resolve_multipliers,
    settle_beyond_doubles,
)
from asperity.solve.outcome import Outcome

#: Intervals of the mesh that orbits are followed on, and of those that they are refined on.
FIRST_MESH = 48
MESHES = (72, 216, 648, 1296)

#: The same between the mesh of the start and the first, and between the last two, which are closer.
_CLOSE_AGREEMENT = 1e-8


class _State(NamedTuple):
    """What two meshes are compared by."""

    mean: float
    harmonics: NDArray[np.complex128]
    logs: NDArray[np.complex128]


def refine(
    problem: Problem,
    found: Found,
    block: Indices,
    orbit: Orbit,
    index: Indices,
    options: Options,
    meshes: tuple[int, ...] = MESHES,
) -> None:
    """Refine the orbits of the points `index` and write what settles into `found`.

    Parameters
    ----------
    problem : Problem
        The points of a block.
    found : Found
        Results of all points.
    block : array of int
        Where the points of the block stand in `found`.
    orbit : Orbit
        Orbits of the block on the first mesh.
    index : array of int
        Points of the block that have an orbit.
    options : Options
    """
    size = problem.system.size
    previous = _states(problem, orbit, index, options)
    for intervals in meshes:
        close = intervals in (meshes[0], meshes[-1])
        agreement = _CLOSE_AGREEMENT if close else AGREEMENT
        finer = Orbit.empty(orbit.scheme, size, intervals, len(block))
        solve = partial(
            refine_orbit,
            intervals=intervals,
            harmonics=options.harmonics,
            phases=options.phases,
        )
        settled = np.zeros(len(block), dtype=bool)
        for part, (fine, reading, error) in run_chunks(
            solve, (problem, orbit), index, chunk_size(intervals, size)
        ):
            put(finer, part, fine)
            found.iterations[block[part]] = intervals
            settled[part] = _compare(found, block[part], part, previous, reading, error, agreement)
        options.progress(int(settled[index].sum()))
        orbit, index = finer, index[~settled[index]]
        if not len(index):
            return
    stiff = index[found.outcome[block[index]] == Outcome.MULTIPLIERS_NOT_RESOLVED]
    resolve_multipliers(problem, found, block, orbit, stiff)
    found.discard(block[index[found.outcome[block[index]] != Outcome.CONVERGED]])
    options.progress(len(index))


def accept(problem: Problem, found: Found, rows: Indices, orbit: Orbit, options: Options) -> None:
    """Write orbits that are exact already into `found`, once their multipliers settle.

    Parameters
    ----------
    problem : Problem
        The points of the orbits.
    found : Found
        Results of all points.
    rows : array of int
        Where the orbits' points stand in `found`.
    orbit : Orbit
    options : Options
    """
    intervals = orbit.mesh.shape[0] - 1
    read = partial(read_orbit, harmonics=options.harmonics, phases=options.phases)
    chunk = chunk_size(intervals, problem.system.size)
    unsettled = []
    for part, reading in run_chunks(read, (problem, orbit), np.arange(len(rows)), chunk):
        logs = logs_of(reading)
        settled = [settle_beyond_doubles(reading, logs, k) for k in range(len(part))]
        store(found, rows[part], reading, logs)
        found.iterations[rows[part]] = intervals
        unsettled.append(part[~np.array(settled)])
    index = np.concatenate(unsettled)
    found.outcome[rows[index]] = Outcome.MULTIPLIERS_NOT_RESOLVED
    resolve_multipliers(problem, found, rows, orbit, index)
    lost = rows[found.outcome[rows] != Outcome.CONVERGED]
    found.discard(lost)
    options.progress(len(rows) - len(lost))


def _states(problem: Problem, orbit: Orbit, index: Indices, options: Options) -> dict[int, _State]:
    """What the orbits on the mesh that they were found on are worth."""
    states: dict[int, _State] = {}
    solve = partial(read_orbit, harmonics=options.harmonics)
    chunk = chunk_size(FIRST_MESH, problem.system.size)
    for part, reading in run_chunks(solve, (problem, orbit), index, chunk):
        logs = logs_of(reading)
        for k, point in enumerate(part):
            states[point] = _State(reading.mean_friction[k], reading.harmonics[:, k], logs[:, k])
    return states


def _compare(
    found: Found,
    rows: Indices,
    part: Indices,
    previous: dict[int, _State],
    reading: Reading,
    error: NDArray[np.float64],
    agreement: float,
) -> NDArray[np.bool_]:
    """Hold each point against its previous mesh; returns which of them are settled."""
    settled = np.zeros(len(part), dtype=bool)
    logs = logs_of(reading)
    for k, point in enumerate(part):
        if error[k] > ACCEPTED:
            found.outcome[rows[k]], found.detail[rows[k]] = Outcome.NOT_RESOLVED, np.inf
            continue
        state = _State(reading.mean_friction[k], reading.harmonics[:, k], logs[:, k])
        before, previous[point] = previous.get(point), state
        orbit_gap, multiplier_gap = _gaps(before, state)
        if orbit_gap <= agreement and settle_beyond_doubles(reading, logs, k):
            multiplier_gap = 0.0
        if orbit_gap > agreement:
            found.outcome[rows[k]], found.detail[rows[k]] = Outcome.NOT_RESOLVED, orbit_gap
        elif multiplier_gap > agreement:
            found.outcome[rows[k]] = Outcome.MULTIPLIERS_NOT_RESOLVED
            found.detail[rows[k]] = multiplier_gap
        else:
            settled[k] = True
    kept = np.flatnonzero(settled)
    store(found, rows[kept], take(reading, kept), logs[:, kept])
    # Kept until the multipliers settle, so that only they are computed again.
    resolved = np.flatnonzero(found.outcome[rows] == Outcome.MULTIPLIERS_NOT_RESOLVED)
    outcome = found.outcome[rows[resolved]]
    store(found, rows[resolved], take(reading, resolved), logs[:, resolved])
    found.outcome[rows[resolved]] = outcome
    return settled


def _gaps(before: _State | None, now: _State) -> tuple[float, float]:
    """Relative change of mean and harmonics, and of multipliers, between two meshes."""
    if before is None or not all(np.all(np.isfinite(a)) for a in now[:2]):
        return np.inf, np.inf
    mean = abs(now.mean - before.mean) / abs(now.mean)
    # Round-off bounds what a harmonic that vanishes beside the first, or beside the mean, can mean.
    floor = (1e-14 * abs(now.harmonics[0]) + 1e-17 * abs(now.mean)) / AGREEMENT
    scale = np.abs(now.harmonics) + floor
    # Beyond the second they count beside the first.
    scale[2:] = np.abs(now.harmonics[0]) + floor
    harmonics = np.abs(now.harmonics - before.harmonics) / scale
    return float(max(mean, harmonics.max())), multiplier_gap(before.logs, now.logs)
