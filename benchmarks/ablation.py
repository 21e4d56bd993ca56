"""Ablation of the stages of the search: random points are solved again without each stage.

    python -m benchmarks.ablation --law rice-ruina --points 10000 --seed 11

The points are those of `benchmarks.whole_range`. They are solved once with all stages. Then, for
each stage, the points whose outcome comes from this stage are solved without it. The table counts
the points that are lost, and has the processor time with and without the stage.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, NamedTuple

import jax
import numpy as np

from asperity.orbit import Outcome
from asperity.orbit.batches import take
from asperity.orbit.methods import collocation, fourier_series
from asperity.orbit.methods.amplitude_continuation import MESHES, AmplitudeContinuation
from asperity.orbit.search import METHODS, find_orbits
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider.problem import Problem
from benchmarks.residual import LAWS, draw, problem_of

#: Points solved at a time.
_SLICE = 2000
#: Outcomes that are reasons why the branch from steady sliding has no orbit.
_ANSWERS = (Outcome.FOLDED, Outcome.RUNAWAY, Outcome.SENSITIVE)


class Stage(NamedTuple):
    """A stage of the search, the points that it concerns, and the search without it."""

    name: str
    concerned: Callable[[Solution], np.ndarray]
    methods: tuple[Method, ...] = METHODS
    constant: tuple[ModuleType, str, Any] | None = None


def _without(name: str) -> tuple[Method, ...]:
    return tuple(method for method in METHODS if method.name != name)


def _finished_by(*names: str) -> Callable[[Solution], np.ndarray]:
    return lambda solution: np.isin(solution.method, names)


def _coarse_branches() -> tuple[Method, ...]:
    coarse = AmplitudeContinuation(MESHES[:1])
    return tuple(coarse if method.name == coarse.name else method for method in METHODS)


STAGES = (
    Stage("Fourier collocation", _finished_by("fourier"), _without("fourier")),
    Stage("series", _finished_by("series"), _without("series")),
    Stage(
        "series of 191 nodes",
        _finished_by("series"),
        constant=(fourier_series, "NODES", fourier_series.NODES[:-1]),
    ),
    Stage("averaged limit", _finished_by("collocation"), _without("collocation")),
    Stage("transients", _finished_by("transient"), _without("transient")),
    Stage(
        "continuation in amplitude",
        _finished_by("continuation in amplitude"),
        _without("continuation in amplitude"),
    ),
    Stage(
        f"the same on {MESHES[1].intervals} intervals",
        _finished_by("continuation in amplitude", "continuation in frequency"),
        _coarse_branches(),
    ),
    Stage(
        "continuation in frequency",
        _finished_by("continuation in frequency"),
        _without("continuation in frequency"),
    ),
    Stage(
        f"refinement to {collocation.MESHES[-1]} intervals",
        lambda s: s.converged & (s.iterations == collocation.MESHES[-1]),
        constant=(collocation, "MESHES", collocation.MESHES[:-1]),
    ),
    Stage(
        "finer transfer maps",
        _finished_by("series"),
        constant=(collocation, "_MOST_INTERVALS", 0),
    ),
)


@contextmanager
def _changed(constant: tuple[ModuleType, str, Any] | None) -> Iterator[None]:
    if constant is None:
        yield
        return
    module, name, value = constant
    kept = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, kept)


def solve(
    problem: Problem, rows: np.ndarray, methods: tuple[Method, ...] = METHODS
) -> tuple[Solution, float]:
    """The points `rows` of a problem and the processor time (s)."""
    parts = []
    begun = time.process_time()
    for start in range(0, len(rows), _SLICE):
        part = rows[start : start + _SLICE]
        parts.append(find_orbits(take(problem, part), SearchOptions(2), methods))
    seconds = time.process_time() - begun
    return jax.tree.map(lambda *a: np.concatenate(a, axis=-1), *parts), seconds


def _row(stage: Stage, problem: Problem, whole: Solution, at_most: int) -> str:
    rows = np.flatnonzero(stage.concerned(whole))
    total = len(rows)
    rows = np.sort(np.random.default_rng(0).permutation(rows)[:at_most])
    if not len(rows):
        return f"| {stage.name} | 0 | | | | | |"
    # The first call compiles, so that both times are without compilation.
    with _changed(stage.constant):
        solve(problem, rows, stage.methods)
        without, seconds_without = solve(problem, rows, stage.methods)
    _, seconds = solve(problem, rows)
    before, after = whole.outcome[rows], without.outcome
    solved = before == Outcome.CONVERGED
    lost = solved & (after != Outcome.CONVERGED)
    answered = np.isin(after, _ANSWERS)
    failed = (after != Outcome.CONVERGED) & ~answered & ~_failed(before)
    counts = (total, len(rows), lost.sum(), failed.sum())
    times = f"{seconds:.1f} | {seconds_without:.1f}"
    return f"| {stage.name} | " + " | ".join(map(str, counts)) + f" | {times} |"


def _failed(outcome: np.ndarray) -> np.ndarray:
    return np.asarray((outcome != Outcome.CONVERGED) & ~np.isin(outcome, _ANSWERS))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ablation", description=__doc__)
    parser.add_argument("--law", choices=LAWS, default="rice-ruina")
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--most", type=int, default=300, help="points solved again for each stage")
    arguments = parser.parse_args()
    problem = problem_of(arguments.law, draw(arguments.law, arguments.points, arguments.seed))
    whole, seconds = solve(problem, np.arange(arguments.points))
    print(f"{arguments.points} points of {arguments.law}: {seconds:.0f} s")
    for outcome in Outcome:
        print(f"  {outcome.name:26s} {(whole.outcome == outcome).sum():7d}")
    print("| stage | points | solved again | not solved | no answer | s with | s without |")
    print("|---|---|---|---|---|---|---|")
    for stage in STAGES:
        print(_row(stage, problem, whole, arguments.most), flush=True)


if __name__ == "__main__":
    main()
