"""The search for periodic orbits: methods in order, each for the points not solved so far.

`METHODS` is the order in which methods are tried, fast methods first; each method is described in
its module.

The search is limited to a range of dimensionless numbers, which is wider than the tested range
(`docs/theory/numerical_method.md`). A point outside gets `Outcome.OUT_OF_RANGE` at once: a search
there takes up to a minute and fails, or gives a stability that only round-off decides.

On several cores each core runs a process, because an XLA program gains little from several cores.
Worker processes are started once and kept; each loads the compiled programs from the cache.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from asperity._processes import process_pool
from asperity.errors import require
from asperity.orbit.batches import put, run_chunks, take
from asperity.orbit.methods.amplitude_continuation import AmplitudeContinuation
from asperity.orbit.methods.collocation import Collocation
from asperity.orbit.methods.fourier import Fourier
from asperity.orbit.methods.fourier_series import FourierSeries
from asperity.orbit.methods.frequency_continuation import FrequencyContinuation
from asperity.orbit.methods.from_transient import SettledMotion
from asperity.orbit.methods.shooting import Shooting
from asperity.orbit.methods.stroboscopic import StroboscopicMap
from asperity.orbit.methods.unmodulated import Unmodulated
from asperity.orbit.outcome import (
    LARGEST_GROWTH,
    LARGEST_RATE,
    LARGEST_UNLOADING,
    SMALLEST_RATE,
    Outcome,
)
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.orbit.steady_sliding import steady_sliding
from asperity.parameters.arguments import one_of
from asperity.slider.problem import Problem
from asperity.theory.limits import adiabatic_growth


def mark_out_of_range(problem: Problem, solution: Solution) -> None:
    """Give the points outside the limits the outcome OUT_OF_RANGE."""
    rate, _, unloading = steady_sliding(problem)
    good_rate = (rate >= SMALLEST_RATE) & (rate <= LARGEST_RATE)
    for outside, values in ((~good_rate, rate), (~(unloading <= LARGEST_UNLOADING), unloading)):
        solution.outcome[outside], solution.detail[outside] = Outcome.OUT_OF_RANGE, values[outside]


def mark_reversed(solution: Solution) -> None:
    """Give orbits on which slip would reverse a negative `detail`."""
    rows = np.flatnonzero(solution.converged & (solution.reversal_margin < 0))
    solution.detail[rows] = solution.reversal_margin[rows]


#: Points in a call that integrates the growth of disturbances.
_GROWTH_CHUNK = 8


def mark_too_unstable(problem: Problem, solution: Solution) -> None:
    """Give failed points the outcome SENSITIVE where disturbances of slow sliding grow too much."""
    failed = np.isin(solution.outcome, (Outcome.NO_ORBIT, Outcome.NOT_RESOLVED))
    amplitude = np.broadcast_to(problem.load.amplitude, failed.shape)
    # Without a first harmonic of the load there is no epsilon at which the branch is lost.
    rows = np.flatnonzero(failed & solution.informed & (amplitude > 0))
    for part, growth in run_chunks(adiabatic_growth, (problem,), rows, _GROWTH_CHUNK):
        part = part[growth > LARGEST_GROWTH]
        share = np.where(solution.outcome[part] == Outcome.NO_ORBIT, solution.detail[part], 1.0)
        solution.detail[part] = np.minimum(share, 1.0) * amplitude[part]
        solution.outcome[part] = Outcome.SENSITIVE


METHODS: tuple[Method, ...] = (
    Unmodulated(),
    Fourier(),
    Shooting(),
    FourierSeries(),
    Collocation(),
    StroboscopicMap(),
    SettledMotion(),
    AmplitudeContinuation(),
    FrequencyContinuation(),
)

#: Names that a user may choose.
CHOICES = tuple(dict.fromkeys(method.choice for method in METHODS))

#: Earlier names of choices.
_SYNONYMS = {"smooth": "series"}


def chosen_methods(choices: Sequence[str]) -> tuple[Method, ...]:
    """The methods that a user chose, in the order of the search.

    Raises
    ------
    InputError
        If there is no method of a name.
    """
    require(choices, "methods", "name a method", "none", "leave it out for all")
    known = (*CHOICES, *_SYNONYMS)
    names = {_SYNONYMS.get(n, n) for n in (one_of(c, known, "methods") for c in choices)}
    return tuple(method for method in METHODS if method.choice in names)


def find_orbits(
    problem: Problem, options: SearchOptions, methods: tuple[Method, ...] = METHODS
) -> Solution:
    """Find the periodic orbit of every operating point within the limits.

    Parameters
    ----------
    problem : Problem
        NumPy arrays with the points along the last axis.
    options : SearchOptions
    methods : tuple of Method
    """
    solution = Solution.unsolved(problem, options)
    mark_out_of_range(problem, solution)
    outside = solution.outcome == Outcome.OUT_OF_RANGE
    for method in methods:
        if not method.suits(problem) or (options.intervals and not method.on_mesh):
            continue
        left = method.candidates(solution)
        left = left[~outside[left]]
        for start in range(0, len(left), method.block):
            rows = left[start : start + method.block]
            solution.merge(rows, method.solve(take(problem, rows), options), method.name)
    mark_reversed(solution)
    mark_too_unstable(problem, solution)
    options.progress(int((~solution.converged).sum()))
    return solution


#: Points handed to a process at a time: a fraction of a second of work.
_SLICE = 20_000

#: With fewer points than this, starting processes (a second or two) takes longer than it saves.
WORTHWHILE = 200_000


def find_orbits_on_cores(
    problem: Problem, options: SearchOptions, methods: tuple[Method, ...], workers: int
) -> Solution:
    """`find_orbits` with the points divided among `workers` processes; same results and order.

    Orbits on meshes are not returned.
    """
    points = problem.system.V.shape[-1]
    solution = Solution.unsolved(problem, options)
    slices = [np.arange(k, min(k + _SLICE, points)) for k in range(0, points, _SLICE)]
    problems = [take(problem, index) for index in slices]
    silent = SearchOptions(options.harmonics, options.phases)
    with process_pool(workers, "workers") as executor:
        results = executor.map(partial(find_orbits, options=silent, methods=methods), problems)
        for index, result in zip(slices, results, strict=True):
            put(solution[:-1], index, result[:-1])
            options.progress(len(index))
    return solution
