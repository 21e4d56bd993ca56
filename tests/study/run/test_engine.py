"""The engine's arithmetic, with workers whose durations and deaths are planted."""

import math
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from asperity.errors import InputError
from asperity.study import run_sweep, store_status
from asperity.study.engine import DoneChunk, SweepProgress, solve_chunks
from asperity.study.job import Job
from asperity.study.workers import Workers
from references.closed_form_sweep import ClosedForm, plan_of

#: Points of a chunk, and seconds that it takes.
POINTS, EACH = 100, 2.0


class Planted(Workers):
    """One worker that says how long its chunks took, and does nothing.

    The store has the chunks `stored`; the process of a task of one of `deadly` dies.
    """

    count, about = 1, "planted"

    def __init__(self, stored: set[int], deadly: tuple[int, ...] = ()) -> None:
        self.stored, self.deadly = stored, deadly
        self.submitted: list[int] = []

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        chunk, give_up = args
        self.submitted.append(chunk)
        future: Future[Any] = Future()
        if chunk in self.deadly and not give_up:
            future.set_exception(BrokenExecutor())
            return future
        seconds = None if chunk in self.stored else EACH
        future.set_result(DoneChunk(POINTS, POINTS if give_up else 0, seconds))
        return future

    def close(self, *, kill: bool) -> None:
        pass


def states_of(chunks: int, workers: Planted, lines: list[str] | None = None) -> list[SweepProgress]:
    """Progress each time that chunks have come back."""
    stored = len(workers.stored) * POINTS
    progress = SweepProgress(Path(), total=chunks * POINTS, chunk_total=chunks, stored=stored)
    seen: list[SweepProgress] = []
    log = [].append if lines is None else lines.append
    solve_chunks(
        Job("", "", ""),
        range(chunks),
        workers,
        progress,
        lambda now: seen.append(replace(now)),
        log,
    )
    return seen


CHUNKS = 20
#: Of three chunks two: what an earlier run has done lies among what it has not.
STORED = {k for k in range(CHUNKS) if k % 3}


@pytest.mark.parametrize("stored", [set(), STORED, set(range(CHUNKS))])
def test_the_time_left_is_that_of_what_is_left(stored: set[int]) -> None:
    states = states_of(CHUNKS, Planted(stored))
    fresh = CHUNKS - len(stored)
    for state in states:
        if math.isfinite(state.left):
            assert state.left == pytest.approx(EACH * fresh - state.spent)
    known = [s for s in states if math.isfinite(s.left)]
    assert len(known) > len(states) / 2
    last = states[-1]
    assert (last.left, last.spent) == (0, EACH * fresh)
    assert (last.points, last.chunks) == (CHUNKS * POINTS, CHUNKS)
    # Only what this run solved is in its rate.
    assert last.kept == len(stored) * POINTS


def test_a_chunk_that_kills_its_process_is_given_up_and_no_other() -> None:
    workers, lines = Planted(set(), deadly=(5,)), []
    last = states_of(CHUNKS, workers, lines)[-1]
    assert (last.points, last.failed, last.chunks) == (CHUNKS * POINTS, POINTS, CHUNKS)
    # It dies three times, and is then written without being solved.
    assert (last.lost, workers.submitted.count(5)) == (3, 4)
    assert "chunk 5 kills its process each time" in lines[-1]


class Ended(Planted):
    """A cluster that ends after some tasks: Dask cancels those that are left."""

    tasks = 0

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        self.tasks += 1
        if self.tasks < 4:
            return super().submit(task, *args)
        future: Future[Any] = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future


def test_a_cluster_that_ends_is_a_sentence(tmp_path: Path, closed_form: ClosedForm) -> None:
    with pytest.raises(
        InputError, match=r"got no answer any more \(planted\) after \d+ of 60 points; start a cl"
    ):
        run_sweep(plan_of(), tmp_path / "s.zarr", workers=Ended(set()))
    assert store_status(tmp_path / "s.zarr").points == 60


@pytest.mark.parametrize(
    ("step", "error"),
    [("LocalCluster", RuntimeError("Nanny failed to start.")), ("Client", TimeoutError())],
)
def test_a_worker_of_dask_that_ends_while_it_starts_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, error: Exception
) -> None:
    distributed = pytest.importorskip("distributed")

    def start(*args: Any, **options: Any) -> Any:
        if step == "LocalCluster":
            raise error
        return nullcontext()

    def connect(*args: Any, **options: Any) -> Any:
        raise error

    monkeypatch.setattr(distributed, "LocalCluster", start)
    monkeypatch.setattr(distributed, "Client", connect)
    with pytest.raises(InputError, match=r"some ended while they started.*repeat the command"):
        run_sweep(plan_of(), tmp_path / "s.zarr", cluster=2)
    assert list(tmp_path.iterdir()) == []
