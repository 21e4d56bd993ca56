"""What a store and its workers must share: versions, the solver's code, and laws of one's own."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

import asperity.study.run as run_module
from asperity.errors import InputError
from asperity.laws import registry
from asperity.study import job, open_store, run_sweep
from asperity.study.workers import local_cluster
from references.closed_form_sweep import (
    ClosedForm,
    InClosedForm,
    ThisProcess,
    files_of,
    plan_of,
)

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
        found = run_sweep(plan, out, workers=InClosedForm(workers, str(mark)))
    # The worker that made the mark died by SIGKILL in the middle of a task.
    assert mark.exists()
    assert (found.points, found.lost) == (120, 0)
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
