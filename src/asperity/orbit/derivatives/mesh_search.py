"""The search for orbits to differentiate: each orbit on the coarsest mesh that is accurate enough.

The whole search takes the orbits of `asperity.orbit.search`; it follows branches from steady
sliding and may take a minute for one point. The direct search solves each point by itself, from the
orbit of an earlier call or from an initial guess that is cheap to compute; it takes some
milliseconds a point. Fits call the direct search at the same points again and again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, NamedTuple

import jax
import numpy as np
from numpy.typing import NDArray

from asperity.arrays import Bool, Complex, Float, Index
from asperity.orbit.batches import mesh_chunk, put, run_chunks, take
from asperity.orbit.derivatives.parametrised import ParametrisedProblem
from asperity.orbit.floquet import AGREEMENT, sorted_logs
from asperity.orbit.mesh.equations import collocated, mean_and_harmonics, read_orbit
from asperity.orbit.mesh.mesh import Orbit
from asperity.orbit.mesh.newton import ACCEPTED, FIRST_MESH, refined_orbit, remeshed
from asperity.orbit.methods.collocation import orbits_from_averaged_limit
from asperity.orbit.methods.fourier_series import NODES, follows_steady_sliding, series_orbits
from asperity.orbit.methods.from_transient import settled_orbits
from asperity.orbit.observables import response_gap, without_round_off
from asperity.orbit.outcome import Outcome
from asperity.orbit.search import find_orbits
from asperity.orbit.solution import SearchOptions
from asperity.parameters.arguments import at_least, typed
from asperity.slider.problem import Problem

#: Numbers of intervals of the meshes for derivatives; an orbit uses the first that is accurate.
MESHES = (216, 648, 1944)
#: Largest relative difference between mean and harmonics on a mesh and those of the search, at
#: which the mesh is accurate enough. The second number is for the last mesh and equals the accuracy
#: of the search. The first is smaller because a steep slip pulse that moves along the mesh makes
#: the relative error of the derivatives some thousand times larger (the pulse's shift divided by
#: its width).
_AGREEMENT = (1e-10, 1e-8)
#: Largest relative difference between two successive meshes. The error of the finer mesh is smaller
#: by 3^8, for a stiff orbit by 3^4.
_MESH_AGREEMENT = (1e-8, AGREEMENT)


#: Numbers of nodes of the series in a direct search. An orbit that these do not resolve is solved
#: on a mesh, which takes less time than the dense equations of a longer series.
_FEW_NODES = NODES[:2]


#: Attempts of Newton's method, each on a new mesh. Of 9,100 orbits of fits under slow modulation
#: the first attempt found 7,500 and the second 98. A third and a fourth attempt would find 21 and
#: 10 more, in half as much time again.
_ROUNDS = 2
#: Patience of Newton's method for coarse orbits, in a single attempt. Of 36,000 orbits 136 converge
#: only after three steps without a smaller change, and 62 % of the steps of failed attempts come
#: after three such steps. A fit may miss some coarse orbits; accurate orbits have no such bound,
#: because it would lose one in 140.
_PATIENCE = 3


class MeshOrbits(NamedTuple):
    """Converged orbits on one mesh, NumPy arrays with the points along the last axis.

    Attributes
    ----------
    orbit : Orbit
    numbers : complex array, shape (1 + count, points)
        Mean and harmonics.
    log_multipliers : complex array, shape (states, points), or None
        As `sorted_logs` sorts them; None after a direct search, which does not resolve them.
    """

    orbit: Orbit
    numbers: Complex
    log_multipliers: Complex | None = None


class SearchedOrbits(NamedTuple):
    """Orbits of a search.

    Attributes
    ----------
    outcome : int array, shape (points,)
        Outcome of every point; `Outcome.NO_ORBIT` where no orbit was requested.
    parts : list of (array of int, MeshOrbits)
        Indices and orbits of converged points, one part for each number of intervals.
    """

    outcome: NDArray[np.int64]
    parts: list[tuple[Index, MeshOrbits]]

    def add(self, index: Index, orbits: MeshOrbits) -> None:
        """Add converged orbits of the points `index`."""
        self.outcome[index] = Outcome.CONVERGED
        for k, (others, before) in enumerate(self.parts):
            if len(before.orbit.mesh) == len(orbits.orbit.mesh):
                joined = jax.tree.map(lambda *a: np.concatenate(a, axis=-1), before, orbits)
                self.parts[k] = np.concatenate([others, index]), joined
                return
        self.parts.append((index, orbits))


@typed
@dataclass
class KnownOrbits:
    """The latest orbit of each point, the initial guess of the next call.

    Attributes
    ----------
    points : int
        Number of points; calls must have as many, in the same order.
    orbit : Orbit or None
        Points along the last axis; None where no orbit is known.
    known : bool array, shape (points,)
        Whether an orbit of each point is known.
    near : bool array, shape (points,)
        Whether the known orbit belongs to nearly the same parameters. Where Newton's method fails
        from such an orbit, a direct search tries only a transient: of 204 such rows of twelve
        tables the other initial guesses led to two orbits, and transients to 126.
    """

    points: Annotated[int, at_least(0)]
    orbit: Orbit | None = None
    known: Bool = field(init=False)
    near: Bool = field(init=False)

    def __post_init__(self) -> None:
        self.known, self.near = np.zeros((2, self.points), bool)

    def keep(self, problem: Problem, index: Index, orbit: Orbit) -> None:
        """Keep the orbits of the points `index` of a problem, on `FIRST_MESH` intervals."""
        size = problem.system.size
        if self.orbit is None:
            self.orbit = Orbit.empty(orbit.scheme, size, FIRST_MESH, self.points)
        self.known[index] = True
        if len(orbit.mesh) == len(self.orbit.mesh):
            put(self.orbit, index, orbit)
            return
        remesh = partial(remeshed, intervals=FIRST_MESH)
        inputs, points = (take(problem, index), orbit), np.arange(len(index))
        for part, kept in run_chunks(remesh, inputs, points, mesh_chunk(size)):
            put(self.orbit, index[part], kept)

    def complete(self, other: KnownOrbits, *, near: bool = False) -> None:
        """Copy orbits of the same points from `other` to those without one."""
        new = np.flatnonzero(other.known & ~self.known)
        if other.orbit is None or not len(new):
            return
        if self.orbit is None:
            size, intervals, _ = other.orbit.nodes.shape
            self.orbit = Orbit.empty(other.orbit.scheme, size, intervals, self.points)
        put(self.orbit, new, take(other.orbit, new))
        self.known[new], self.near[new] = True, near

    def picked(self, index: Index) -> KnownOrbits:
        """The known orbits of the points `index`, which may repeat a point."""
        orbit = None if self.orbit is None else take(self.orbit, index)
        picked = KnownOrbits(len(index), orbit)
        picked.known[:], picked.near[:] = self.known[index], self.near[index]
        return picked


def followed_orbits(
    problem: Problem,
    guess: Orbit,
    index: Index,
    harmonics: int,
    meshes: tuple[int, ...],
    numbers: Complex | None = None,
    *,
    patient: bool = True,
) -> Iterator[tuple[Index, MeshOrbits]]:
    """Orbits that Newton's method reaches from a guess, on the first mesh that is accurate.

    Parameters
    ----------
    problem : Problem
    guess : Orbit
        Orbits of the points of the problem; only those of `index` are used.
    index : array of int
    harmonics : int
    meshes : tuple of int
        Numbers of intervals, rising. If empty, orbits are coarse: on `FIRST_MESH`, unchecked.
    numbers : complex array, shape (1 + harmonics, points), optional
        Mean and harmonics, if they are known. Otherwise each mesh is compared with the preceding
        mesh, the first with `FIRST_MESH`, and points at which Newton's method fails are left out.
    patient : bool
        Whether Newton's method makes all attempts. Otherwise it makes a single attempt, which ends
        after `_PATIENCE` steps without a smaller change.

    Yields
    ------
    array of int, MeshOrbits
        Points, and their orbits without multipliers.
    """
    size, points = guess.centre.shape
    known, agreements = numbers is not None, _MESH_AGREEMENT if numbers is None else _AGREEMENT
    before = np.full((1 + harmonics, points), np.nan + 0j) if numbers is None else numbers
    read = partial(_numbers, harmonics=harmonics)
    rounds, patience = (_ROUNDS, math.inf) if patient else (1, _PATIENCE)
    for intervals in meshes if known else (FIRST_MESH, *meshes):
        agreement = agreements[(intervals,) == meshes[-1:]]
        solve = partial(
            refined_orbit, intervals=intervals, read=read, rounds=rounds, patience=patience
        )
        finer = Orbit.empty(guess.scheme, size, intervals, points)
        left = [index[:0]]
        for part, (fine, now, error) in run_chunks(
            solve, (problem, guess), index, mesh_chunk(size)
        ):
            put(finer, part, fine)
            solved = error < ACCEPTED
            accurate = solved & (response_gap(before[:, part], now, each=1) < agreement)
            accurate |= solved & (not meshes)
            kept = np.flatnonzero(accurate)
            if len(kept):
                yield part[kept], MeshOrbits(take(fine, kept), now[:, kept])
            left.append(part[~accurate & (known | solved)])
            if not known:
                before[:, part] = now
        index, guess = np.concatenate(left), finer
        if not len(index):
            return


def search_orbits(
    equations: ParametrisedProblem,
    harmonics: int,
    parameters: dict[str, Float],
    wanted: Bool,
    *,
    direct: bool = False,
    coarse: bool = False,
    motions: bool | None = None,
    known: KnownOrbits | None = None,
    every: bool = False,
) -> SearchedOrbits:
    """Search for the orbits of the points `wanted`.

    Parameters
    ----------
    equations : ParametrisedProblem
    harmonics : int
    parameters : dict of str to array, shape (points,)
    wanted : bool array, shape (points,)
    direct : bool
        Whether to solve each point by itself, without following branches: from the known orbits, by
        series under slow modulation, from the averaged limit, and from transients.
    coarse : bool
        Whether a direct search takes orbits on the coarsest mesh, unchecked.
    motions : bool, optional
        Whether a direct search integrates a transient for each point without an orbit from other
        initial guesses; by default it does unless `coarse`.
    known : KnownOrbits, optional
        Orbits of the first points. The search stores the orbits that it finds there, and a direct
        search takes its initial guesses from there.
    every : bool
        Whether a direct search may end at the first point without an orbit.
    """
    search = _MeshSearch(equations.problem(parameters), harmonics, wanted, known)
    if direct:
        search.try_each_point(coarse=coarse, motions=motions, every=every)
    else:
        search.try_all_methods()
    return search.result


class _MeshSearch:
    """The inputs of a search, and its orbits so far."""

    def __init__(
        self, problem: Problem, harmonics: int, wanted: Bool, known: KnownOrbits | None
    ) -> None:
        self.problem, self.harmonics, self.known = problem, harmonics, known
        self.index = np.flatnonzero(wanted)
        self.result = SearchedOrbits(np.full(len(wanted), int(Outcome.NO_ORBIT)), [])
        self.part = take(problem, self.index)
        self.options = SearchOptions(max(harmonics, 2), intervals=MESHES[0])

    def try_all_methods(self) -> None:
        """Orbits of `find_orbits`, each on the first mesh that agrees with them."""
        solution = find_orbits(self.part, self.options)
        solved = solution.converged
        unresolved = int(Outcome.NOT_RESOLVED)
        self.result.outcome[self.index] = np.where(solved, unresolved, solution.outcome)
        rows = np.flatnonzero(solved)
        numbers = without_round_off(solution.numbers[: 1 + self.harmonics])
        for some, orbits in followed_orbits(
            self.part, solution.orbit, rows, self.harmonics, MESHES, numbers
        ):
            logs = solution.log_multipliers[:, some]
            logs = np.asarray(sorted_logs(logs)) if len(logs) > 2 else logs
            self._keep(self.index[some], orbits._replace(log_multipliers=logs))

    def try_each_point(self, *, coarse: bool, motions: bool | None, every: bool) -> None:
        """The initial guesses of a direct search, the cheapest first."""
        outcome, known = self.result.outcome, self.known
        # A search without methods marks the points out of range.
        options = self.options._replace(intervals=0)
        outcome[self.index] = find_orbits(self.part, options, methods=()).outcome
        meshes = () if coarse else MESHES
        motions = not coarse if motions is None else motions
        follow = partial(self._follow, meshes=meshes, patient=motions)
        near = np.zeros(len(outcome), bool)
        if known is not None and known.orbit is not None:
            rows = self._left()
            follow(known.orbit, rows[known.known[rows]])
            near[: known.points] = known.near
        self._try_series(self._left(but=near), (*meshes, FIRST_MESH)[0], follow)
        if len(rows := self._left(but=near)):
            patience = _PATIENCE if coarse else math.inf
            follow(*orbits_from_averaged_limit(self.problem, rows, patience))
        hopeless = every and (outcome == Outcome.OUT_OF_RANGE).any()
        if motions and not hopeless and len(rows := self._left()):
            settled, periodic = settled_orbits(self.problem, rows, every=every)
            if len(periodic) >= (len(rows) if every else 1):
                follow(settled, periodic)

    def _try_series(
        self, rows: Index, intervals: int, follow: Callable[[Orbit, Index], None]
    ) -> None:
        """Series under slow modulation, and orbits on a mesh from those that are not exact."""
        slow = follows_steady_sliding(self.problem, rows)
        series, exact = series_orbits(self.problem, slow, intervals, _FEW_NODES)
        read = partial(_numbers, harmonics=self.harmonics)
        chunk = mesh_chunk(self.problem.system.size)
        for some, numbers in run_chunks(read, (self.problem, series), exact, chunk):
            self._keep(some, MeshOrbits(take(series, some), numbers))
        follow(series, np.setdiff1d(slow, exact))

    def _follow(self, guess: Orbit, rows: Index, *, meshes: tuple[int, ...], patient: bool) -> None:
        """Keep the orbits that Newton's method reaches from a guess."""
        for some, orbits in followed_orbits(
            self.problem, guess, rows, self.harmonics, meshes, patient=patient
        ):
            self._keep(some, orbits)

    def _keep(self, rows: Index, orbits: MeshOrbits) -> None:
        self.result.add(rows, orbits)
        if self.known is not None:
            self.known.keep(self.problem, rows, orbits.orbit)

    def _left(self, but: Bool | None = None) -> Index:
        """Points that have no orbit yet and are not out of range, without those of a mask."""
        done = np.isin(self.result.outcome, (Outcome.CONVERGED, Outcome.OUT_OF_RANGE))
        done = done if but is None else done | but
        return self.index[~done[self.index]]


def growth_of(
    equations: ParametrisedProblem, parameters: dict[str, Float], known: KnownOrbits | None
) -> Float:
    """Growth of perturbations in a period at orbits of a coarse search, shape (points,).

    The arguments are those of `search_orbits`. The growth is ln |m| of the largest multiplier m,
    on `FIRST_MESH` intervals; NaN without an orbit.
    """
    problem = equations.problem(parameters)
    growth = np.full(len(problem.system.V), np.nan)
    all_points = np.ones(growth.size, bool)
    found = search_orbits(
        equations, 1, parameters, all_points, direct=True, coarse=True, known=known
    )
    read, chunk = partial(read_orbit, harmonics=1), mesh_chunk(problem.system.size)
    for index, orbits in found.parts:
        inputs, rows = (take(problem, index), orbits.orbit), np.arange(len(index))
        for part, observables in run_chunks(read, inputs, rows, chunk):
            growth[index[part]] = observables.log_multipliers[0].real
    return growth


def _numbers(problem: Problem, orbit: Orbit, harmonics: int) -> Complex:
    """Mean and harmonics of F/W0, shape (1 + harmonics, points)."""
    with np.errstate(all="ignore"):
        mean, phasors = mean_and_harmonics(collocated(problem, orbit), orbit, harmonics)
    return without_round_off(np.concatenate([mean[None], phasors]))
