"""Processes that are really killed: the store ends with the bits of an undisturbed run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from asperity.study import run_sweep, store_status
from asperity.study.workers import local_processes
from references.closed_form_sweep import (
    ClosedForm,
    InClosedForm,
    ThisProcess,
    files_of,
    plan_of,
)

TESTS = Path(__file__).parents[2]


@pytest.fixture
def whole(tmp_path: Path, closed_form: ClosedForm) -> dict[str, bytes]:
    """The files of an undisturbed run."""
    run_sweep(plan_of(), tmp_path / "whole.zarr", workers=ThisProcess())
    return files_of(tmp_path / "whole.zarr")


@pytest.mark.skipif(os.name != "posix", reason="no SIGKILL")
def test_a_driver_that_is_killed_costs_nothing(tmp_path: Path, whole: dict[str, bytes]) -> None:
    out = tmp_path / "s.zarr"
    # Each chunk takes a while, so that the kill comes in the middle of the plan.
    script = (
        "import sys; from references.closed_form_sweep import slow_driver; slow_driver(sys.argv[1])"
    )
    path = os.pathsep.join([str(TESTS), *filter(None, sys.path)])
    driver = subprocess.Popen(
        [sys.executable, "-c", script, str(out)], env={**os.environ, "PYTHONPATH": path}
    )
    status = out / "status" / "c"
    deadline = time.monotonic() + 120
    while sum(f.is_file() for f in status.rglob("*")) < 2:
        assert driver.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    assert 0 < store_status(out).chunks_done < 6
    assert (tmp_path / "s.zarr.lock").exists()
    again = run_sweep(plan_of(), out, workers=ThisProcess())
    assert 0 < again.solved < again.points
    assert files_of(out) == whole
    assert not (tmp_path / "s.zarr.lock").exists()


@pytest.mark.skipif(os.name != "posix", reason="no SIGKILL")
def test_workers_of_a_killed_driver_end() -> None:
    script = (
        "import os, time; from asperity.study.workers import LocalProcesses;"
        "print(LocalProcesses(1).submit(os.getpid).result(), flush=True); time.sleep(600)"
    )
    driver = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )  # fmt: skip
    assert driver.stdout is not None
    worker = int(driver.stdout.readline())
    driver.send_signal(signal.SIGKILL)
    driver.communicate()
    deadline = time.monotonic() + 60
    while _runs(worker):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.long  # `test_engine.py` kills one of two workers of a cluster
@pytest.mark.skipif(os.name != "posix", reason="no SIGKILL")
def test_one_of_two_workers_is_killed(tmp_path: Path, whole: dict[str, bytes]) -> None:
    out, mark = tmp_path / "s.zarr", tmp_path / "killed"
    told: list[str] = []
    with local_processes(2) as workers:
        progress = run_sweep(
            plan_of(), out, workers=InClosedForm(workers, str(mark)), log=told.append
        )
    # The worker that made the mark died by SIGKILL in the middle of a task.
    assert mark.exists()
    assert progress.points == 60
    assert store_status(out).outcomes == {"converged": 36, "folded": 18, "stopped": 6}
    assert files_of(out) == whole
    assert progress.lost == 1
    assert "died" in told[0]
