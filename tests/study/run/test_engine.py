"""The engine with planted workers, and what a store and its workers must share."""

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import asperity.study.run as run_module
from asperity.errors import InputError
from asperity.laws import registry
from asperity.study import job, open_store, run_sweep, store_status
from asperity.study.engine import DoneChunk, SweepProgress, solve_chunks
from asperity.study.job import Job
from asperity.study.workers import Workers, local_cluster
from references.closed_form_sweep import (
    ClosedForm,
    InClosedForm,
    ThisProcess,
    files_of,
    plan_of,
)

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


LAW = """
from asperity.laws import RiceRuina

class Mine(RiceRuina):
    name = "{name}"
"""

PLAN = """
law = "my_law.py:Mine"
material = "bureau2000"
[parameters]
V = "1 um/s"
frequency = "120 Hz"
[axes.K]
values = ["1 N/m", "2 N/m", "3 N/m"]
[axes.epsilon]
from = 0.05
to = 0.98
count = 20
"""


@pytest.fixture(autouse=True)
def _laws_as_before(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))
    return


class Elsewhere(ThisProcess):
    """Workers that know the laws of the package only, as fresh processes do."""

    fresh = True

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        if self.fresh:
            registry._LAWS.pop("mine", None)
            self.fresh = False
        return super().submit(task, *args)


def test_a_law_from_a_file_reaches_the_workers(tmp_path: Path, closed_form: ClosedForm) -> None:
    file, out = tmp_path / "my_law.py", tmp_path / "s.zarr"
    file.write_text(LAW.format(name="mine"))
    plan = tmp_path / "plan.toml"
    plan.write_text(PLAN)
    assert run_sweep(plan, out, workers=Elsewhere()).solved == 60
    assert str(open_store(out)["law"].values) == "mine"
    # Another code is another law, in a process that has loaded the file before, too.
    file.write_text(LAW.format(name="mine") + "    # another one\n")
    with pytest.raises(InputError, match=r"same plan, got law_files\.mine = "):
        run_sweep(plan, out, workers=Elsewhere())


def test_code_next_to_a_law_that_it_imports_is_part_of_the_law(
    tmp_path: Path, closed_form: ClosedForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    out, plan, far = tmp_path / "s.zarr", tmp_path / "plan.toml", tmp_path / "far_numbers.py"
    plan.write_text(PLAN)
    imports = "import os, near_numbers as numbers\n"
    (tmp_path / "my_law.py").write_text(imports + LAW.format(name="mine"))
    (tmp_path / "near_numbers.py").write_text("from far_numbers import SHARE\n")
    far.write_text("SHARE = 0.5\n")
    (tmp_path / "script.py").write_text("")
    run_sweep(plan, out, workers=Elsewhere())
    (tmp_path / "script.py").write_text("print('not part of the law')\n")
    assert run_sweep(plan, out, workers=Elsewhere()).solved == 0
    far.write_text("SHARE = 0.6\n")
    with pytest.raises(InputError, match=r"same plan, got law_files\.mine = "):
        run_sweep(plan, out, workers=Elsewhere())


@pytest.mark.skipif(os.name != "posix", reason="no SIGKILL")
def test_laws_from_a_file_and_a_module_reach_dask_workers_of_which_one_is_killed(
    tmp_path: Path, closed_form: ClosedForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    (tmp_path / "my_law.py").write_text(LAW.format(name="mine"))
    (tmp_path / "my_module.py").write_text(LAW.format(name="other"))
    monkeypatch.syspath_prepend(tmp_path)
    plan, out, mark = tmp_path / "plan.toml", tmp_path / "s.zarr", tmp_path / "killed"
    several = '[axes.law]\nvalues = ["my_law.py:Mine", "my_module:Mine"]'
    plan.write_text(PLAN.replace('law = "my_law.py:Mine"', "") + several)
    with local_cluster(2) as workers:
        progress = run_sweep(plan, out, workers=InClosedForm(workers, str(mark)))
    # The worker that made the mark died by SIGKILL in the middle of a task.
    assert mark.exists()
    assert (progress.points, progress.lost) == (120, 0)
    run_sweep(plan, tmp_path / "whole.zarr", workers=ThisProcess())
    assert files_of(out) == files_of(tmp_path / "whole.zarr")
    assert open_store(out)["law"].values.tolist() == ["mine", "other"]


def test_a_law_that_no_worker_has_is_no_failure_of_its_points(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    from asperity.laws import RiceRuina, register

    register(type("Mine", (RiceRuina,), {"name": "mine"}))
    plan = plan_of().model_copy(update={"law": "mine"})
    with pytest.raises(InputError, match="law must be known to the workers, got 'mine'"):
        run_sweep(plan, tmp_path / "s.zarr", workers=Elsewhere())
    # A store without any chunk would be refused to the next version.
    assert list(tmp_path.iterdir()) == []


def test_a_store_is_continued_by_what_began_it(
    tmp_path: Path, closed_form: ClosedForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "s.zarr"
    run_sweep(plan_of(), out, workers=ThisProcess())
    other = {**run_module.numerics(), "jaxlib": "0.0.1"}
    monkeypatch.setattr(run_module, "numerics", lambda: other)
    with pytest.raises(InputError, match=r'got \'s\.zarr\' with jaxlib = .* there and "0\.0\.1"'):
        run_sweep(plan_of(), out, workers=ThisProcess())
    # Asked to, the new version solves failed points; its workers must have it as well.
    with pytest.raises(InputError, match=r"workers must have the versions of the driver.*jaxlib"):
        run_sweep(plan_of(), out, workers=ThisProcess(), retry_failed=True)
    monkeypatch.setattr(job, "numerics", lambda: other)
    assert run_sweep(plan_of(), out, workers=ThisProcess(), retry_failed=True).solved > 0
