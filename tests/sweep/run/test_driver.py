"""The driver's arithmetic, with workers whose durations are planted."""

import math
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from asperity.errors import InputError
from asperity.sweep import run_sweep, store_status
from asperity.sweep.run.driver import Driver, SweepProgress, units_of
from asperity.sweep.run.executors import Workers
from asperity.sweep.run.tasks import Job, Report, Unit
from references.closed_form_sweep import plan_of

#: Points of a chunk; seconds of its first stage; points that it leaves, in two batches; seconds
#: of one of those points.
POINTS, FIRST, LEFT, EACH = 100, 2.0, 10, 0.5


class Planted(Workers):
    """One worker that says how long its units took, and does nothing.

    The store has the chunks `stored`; of those in `begun` an earlier run had done the first stage,
    which left all points but ten.
    """

    count, about = 1, "planted"

    def __init__(self, stored: set[int], begun: set[int]) -> None:
        self.stored, self.begun = stored, begun

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        _, units, _ = args
        future: Future[Any] = Future()
        # Tasks of one unit: the estimate is looked at after each.
        report = Report(rest=list(units[1:]))
        self._do(units[0], report)
        future.set_result(report)
        return future

    def _do(self, unit: Unit, report: Report) -> None:
        if unit.stage == "second":
            report.done.append((unit, EACH * unit.points, 0))
        elif unit.stage == "finish":
            report.done.append((unit, 0.0, 0))
            report.finished.append((unit.chunk, POINTS, 0))
        elif unit.chunk in self.stored:
            report.done.append((unit, -1.0, 0))
            report.finished.append((unit.chunk, POINTS, 0))
        else:
            half_done = unit.chunk in self.begun
            left = POINTS - 10 if half_done else LEFT
            known = Unit("first", unit.chunk, -1, POINTS - left)
            report.done.append((known, -1.0 if half_done else FIRST, 0))
            report.opened += [Unit("second", unit.chunk, k, left // 2) for k in (0, 1)]

    def close(self, *, kill: bool) -> None:
        pass


def states_of(chunks: int, stored: set[int], begun: set[int]) -> list[SweepProgress]:
    """Progress after every task of a run."""
    points = chunks * POINTS
    progress = SweepProgress(total=points, chunk_total=chunks, stored=len(stored) * POINTS)
    seen: list[SweepProgress] = []

    def tick(now: SweepProgress) -> None:
        seen.append(replace(now, spent=dict(now.spent)))

    chunk_units = units_of(chunks, lambda _: POINTS)
    Driver(Job("", "", ""), chunk_units, Planted(stored, begun), progress, tick, print).run()
    return seen


CHUNKS = 20
#: Of three chunks two: what an earlier run has done lies among what it has not.
STORED = {k for k in range(CHUNKS) if k % 3}


@pytest.mark.parametrize(
    ("stored", "begun"), [(set(), set()), (STORED, set()), (STORED, {0, 3}), (set(), {0})]
)
def test_the_time_left_is_that_of_what_is_left(stored: set[int], begun: set[int]) -> None:
    states = states_of(CHUNKS, stored, begun)
    fresh = CHUNKS - len(stored) - len(begun)
    hard = len(begun) * (POINTS - 10) + fresh * LEFT
    whole = FIRST * fresh + EACH * hard
    # There is no estimate before both stages were seen. From then on it is right within what one
    # chunk that was begun holds: nobody knows of those before they are looked at.
    known = [s for s in states if math.isfinite(s.left)]
    assert len(known) > len(states) / 2
    slack = FIRST + EACH * POINTS
    for state in known:
        done = sum(state.spent.values())
        assert state.left == pytest.approx(whole - done, abs=slack)
    assert known[-1].left == 0
    last = states[-1]
    assert last.points == CHUNKS * POINTS
    # Only what this run solved is in its rate.
    assert last.kept == len(stored) * POINTS + len(begun) * 10


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


def test_a_cluster_that_ends_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"got no answer any more \(planted\) after \d+ of 60 points; start a cl"
    ):
        run_sweep(plan_of(), tmp_path / "s.zarr", workers=Ended(set(), set()))
    assert store_status(tmp_path / "s.zarr").points == 60


@pytest.mark.parametrize(
    "error", [RuntimeError("Nanny failed to start."), TimeoutError(), OSError(9, "x")]
)
@pytest.mark.parametrize("step", ["LocalCluster", "Client"])
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
