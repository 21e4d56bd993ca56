"""Sweeps whose solve is a closed form, in this process or on any workers."""

import os
import signal
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np

from asperity.parameters import OUTPUTS
from asperity.study import SweepPlan, run_sweep
from asperity.study.points import Answers, SweepOutcome
from asperity.study.solve import SOLVES, SolveKind
from asperity.study.workers import Workers


class ThisProcess(Workers):
    """The process of the driver: `submit` runs the task before it returns."""

    count = 1
    about = "this process"
    lost = ()
    gone = ()

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        """As in `Workers`; Ctrl-C is raised at once."""
        future: Future[Any] = Future()
        try:
            future.set_result(task(*args))
        except Exception as error:  # an executor stores exceptions in the future, too
            future.set_exception(error)
        return future

    def close(self, *, kill: bool) -> None:
        """As in `Workers`."""


class ClosedForm(SolveKind):
    """mu1 = epsilon K, mu2 = epsilon^2 K."""

    name = "periodic"
    outputs = (OUTPUTS["mu1"], OUTPUTS["mu2"])
    defaults = ("mu1", "mu2")

    def __init__(self) -> None:
        self.solved: set[tuple[float, float]] = set()

    def chunk_points(self, points: int, record: Any) -> int:
        return 10

    def solve_law(self, law: Any, points: Any, record: Any) -> Answers:
        epsilon, K = points.values["epsilon"], points.values["K"]
        self.solved |= set(zip(K.tolist(), epsilon.tolist(), strict=True))
        answers = Answers.empty(self.defaults, len(points))
        answers.numbers["mu1"][:], answers.numbers["mu2"][:] = epsilon * K, epsilon**2 * K
        answers.outcome[:] = SweepOutcome.CONVERGED
        # A whole chunk without an answer, and a few single points.
        answers.fail(np.flatnonzero(K == 3.0), 4, 0.25)
        answers.fail(np.flatnonzero(epsilon > 0.9), SweepOutcome.STOPPED, 2.5)
        return answers


class InClosedForm(Workers):
    """Wraps other workers, on which every task uses the closed form.

    The first task of the third chunk writes the file `mark` and kills its process.
    """

    def __init__(self, workers: Workers, mark: str) -> None:
        self.workers, self.mark = workers, mark
        self.count, self.about, self.lost = workers.count, workers.about, workers.lost

    def submit(self, task: Callable[..., Any], *args: Any) -> Future[Any]:
        return self.workers.submit(_in_closed_form, self.mark, task, *args)

    def restart(self) -> None:
        self.workers.restart()

    def close(self, *, kill: bool) -> None:
        self.workers.close(kill=kill)


def _in_closed_form(mark: str, task: Callable[..., Any], chunk: int, *args: Any) -> Any:
    SOLVES["periodic"] = ClosedForm()
    if chunk == 2:
        try:
            os.close(os.open(mark, os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            pass
        else:
            os.kill(os.getpid(), signal.SIGKILL)
    return task(chunk, *args)


class _Slow(ClosedForm):
    def solve(self, points: Any, record: Any) -> Answers:
        time.sleep(0.2)
        return super().solve(points, record)


def slow_driver(out: str) -> None:
    """A driver that takes a fifth of a second for a chunk."""
    os.environ["NPROC"] = "1"
    SOLVES["periodic"] = _Slow()
    run_sweep(plan_of(), out, workers=ThisProcess())


def plan_of(epsilon: int = 20, stiffness: tuple[float, ...] = (1.0, 2.0, 3.0)) -> SweepPlan:
    return SweepPlan(
        law="rice-ruina",
        material="bureau2000",
        parameters={"V": 1e-6, "frequency": 120.0},
        axes={
            "K": {"values": stiffness},
            "epsilon": {"from": 0.05, "to": 0.05 * epsilon - (0.02 if epsilon == 20 else 0.0),
                        "count": epsilon},
        },
    )  # fmt: skip


def files_of(store: Path) -> dict[str, bytes]:
    """All files of a store except its attributes, which have the version and the machine."""
    return {
        str(file.relative_to(store)): file.read_bytes()
        for file in sorted(store.rglob("*"))
        if file.is_file() and file != store / "zarr.json"
    }
