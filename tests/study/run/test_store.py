"""The store: what is in it, what survives, what is refused, and a slice of it as a picture."""

import errno
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from click.testing import CliRunner
from scipy.stats import circmean, circstd

from asperity.cli.main import main
from asperity.errors import InputError
from asperity.figures.slice import plot_slice
from asperity.parameters import OUTPUTS
from asperity.study import (
    SweepPlan,
    export_store,
    open_store,
    reasons,
    run_sweep,
    store_status,
    summary_statistics,
)
from asperity.study.points import Answers, SweepOutcome
from asperity.study.store import root, store
from asperity.study.store.layout import reset
from asperity.study.store.lock import store_lock
from asperity.study.store.store import SweepStore
from references.closed_form_sweep import ClosedForm, ThisProcess, files_of, plan_of

POINTS, FAILED = 60, 24


def run(out: Path, **options: Any) -> Any:
    plan = options.pop("plan", None) or plan_of()
    return run_sweep(plan, out, workers=ThisProcess(), **options)


def test_numbers_labels_units_and_reasons(tmp_path: Path, closed_form: ClosedForm) -> None:
    summary = run(tmp_path / "s.zarr")
    assert (summary.points, summary.failed, summary.solved) == (POINTS, FAILED, POINTS)
    with open_store(tmp_path / "s.zarr") as dataset:
        K, epsilon = np.meshgrid(dataset["K"], dataset["epsilon"], indexing="ij")
        good = (K != 3.0) & (epsilon <= 0.9)
        assert np.array_equal(dataset["mu1"].values[good], (epsilon * K)[good])
        assert np.isnan(dataset["mu2"].values[~good]).all()
        assert dataset["K"].attrs["units"] == "N/m"
        assert float(dataset["A"]) == 0.013
        words = dict(
            zip(
                dataset["outcome"].attrs["flag_values"],
                dataset["outcome"].attrs["flag_meanings"].split(),
                strict=True,
            )
        )
        assert words[int(dataset["outcome"].sel(K=3.0)[0])] == "folded"
        last = dataset.isel(K=0, epsilon=-1)
        assert reasons(last["outcome"], last["detail"])[()] == (
            "the transient stopped before its end, at 2.5 s"
        )


def test_another_reader_needs_neither_asperity_nor_xarray(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    run(tmp_path / "s.zarr")
    script = (
        "import sys, zarr; g = zarr.open_group(sys.argv[1], mode='r');"
        "a = g['mu1']; print(a.shape, a.metadata.dimension_names, a.attrs['units'], a[1, 3]);"
        "print([m for m in sys.modules if m.startswith(('asperity', 'xarray'))])"
    )
    lines = subprocess.run(
        [sys.executable, "-W", "error", "-c", script, str(tmp_path / "s.zarr")],
        capture_output=True, text=True, check=True, cwd=tmp_path,
    ).stdout.splitlines()  # fmt: skip
    epsilon = open_store(tmp_path / "s.zarr")["epsilon"].values[3]
    assert lines == [f"(3, 20) ('K', 'epsilon') 1 {2.0 * float(epsilon)!r}", "[]"]


def test_xarray_opens_it_as_it_is(tmp_path: Path, closed_form: ClosedForm) -> None:
    run(tmp_path / "s.zarr")
    # Warnings are errors here: nothing is to be explained to the reader first.
    dataset = xarray.open_zarr(tmp_path / "s.zarr", chunks=None)
    assert set(dataset.dims) == {"K", "epsilon", "K_chunk", "epsilon_chunk"}
    assert {"A", "B", "law", "frequency"} <= set(dataset.coords)
    assert str(dataset["law"].values) == "rice-ruina"


def test_a_chunk_without_one_number_is_a_chunk_that_is_done(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    run(tmp_path / "s.zarr")
    closed_form.solved.clear()
    again = run(tmp_path / "s.zarr")
    assert (again.solved, closed_form.solved) == (0, set())
    assert again.failed == FAILED


class Killed(BaseException):
    """Stands for a SIGKILL: no handler of errors may see it."""


def killed_at(step: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything stops at the `step`-th time that something has to reach the disk."""
    count = 0

    real = os.fsync

    def dying(descriptor: int) -> None:
        nonlocal count
        count += 1
        if count == step:
            raise Killed
        real(descriptor)

    monkeypatch.setattr(os, "fsync", dying)


def test_killed_at_any_step_the_next_run_ends_with_the_same_bits(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    run(tmp_path / "whole.zarr")
    whole = files_of(tmp_path / "whole.zarr")
    out = tmp_path / "s.zarr"
    kills = 0
    for step in range(1, 400, 11):
        with pytest.MonkeyPatch.context() as patch:
            killed_at(step, patch)
            try:
                run(out)
            except Killed:
                kills += 1
                # The file that a killed writer of zarr leaves.
                if (out / "mu1").is_dir():
                    (out / "mu1" / "c.0123.partial").write_bytes(b"half")
                continue
        break
    assert kills > 5
    run(out)
    assert files_of(out) == whole
    assert not (tmp_path / "s.zarr.lock").exists()


def test_what_is_done_is_never_solved_again(tmp_path: Path, closed_form: ClosedForm) -> None:
    out = tmp_path / "s.zarr"
    with pytest.MonkeyPatch.context() as patch:
        killed_at(100, patch)
        with pytest.raises(Killed):
            run(out)
    store = SweepStore(out)
    done = list(store.done())
    assert 0 < len(done) < 6
    kept = set()
    for chunk in done:
        values = store.grid.at(chunk).values
        kept |= set(zip(values["K"].tolist(), values["epsilon"].tolist(), strict=True))
    closed_form.solved.clear()
    assert run(out).points == POINTS
    assert closed_form.solved
    assert not closed_form.solved & kept


@pytest.mark.parametrize(
    ("number", "sentence"),
    [
        (errno.ENOSPC, r"the disk is full.*make room and .*continues from there"),
        (errno.EFBIG, r"the limit on the size of a file is reached.*raise .*continues from there"),
        (errno.EIO, r"'s.zarr' \(input/output error.*correct that and .*continues from there"),
    ],
)
def test_a_failed_write_is_a_sentence_and_costs_nothing(
    tmp_path: Path, closed_form: ClosedForm, number: int, sentence: str
) -> None:
    out = tmp_path / "s.zarr"
    written = 0

    def full(file: Path) -> None:
        nonlocal written
        written += 1
        if written > 60:
            raise OSError(number, os.strerror(number))

    with pytest.MonkeyPatch.context() as patch:
        for module in (root, store):
            patch.setattr(module, "sync_folder", full)
        with pytest.raises(InputError, match=sentence):
            run(out)
    assert store_status(out).done < POINTS
    run(out)
    run(tmp_path / "whole.zarr")
    assert files_of(out) == files_of(tmp_path / "whole.zarr")


def test_a_refused_start_leaves_no_store(tmp_path: Path, closed_form: ClosedForm) -> None:
    out = tmp_path / "s.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SweepStore, "share_done", lambda store: -1e30)
        with pytest.raises(InputError, match="fit into the free space"):
            run(out)
        assert not out.exists()
    assert run(out).points == POINTS
    before = files_of(out)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SweepStore, "share_done", lambda store: -1e30)
        with pytest.raises(InputError, match="fit into the free space"):
            run(out)
    assert files_of(out) == before


@pytest.mark.parametrize("of_store", [True, False])
def test_a_disk_that_is_full_at_the_start_is_a_sentence_and_leaves_no_store(
    tmp_path: Path, closed_form: ClosedForm, of_store: bool
) -> None:
    """The record of the run, and the lock, are the first files after those of the plan."""

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    module, name = (store, "write_root") if of_store else (os, "pwrite")
    sentence = "out must .*disk is full|out must .*no space left on device"
    out = tmp_path / "s.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, name, full)
        with pytest.raises(InputError, match=sentence):
            run(out)
    assert not list(tmp_path.iterdir())
    run(out)
    before = files_of(out)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, name, full)
        with pytest.raises(InputError, match=sentence):
            run(out)
    assert files_of(out) == before


def test_damaged_chunks_alone_are_solved_again(tmp_path: Path, closed_form: ClosedForm) -> None:
    """One of six chunks stays."""
    out = tmp_path / "s.zarr"
    run(out)
    whole = files_of(out)
    for place, name, fault in (
        ("0/0", "mu1", "bit"), ("0/1", "mu1", "cut"), ("1/0", "status", "bit"),
        ("1/1", "status", "cut"), ("2/0", "outcome", "bit"),
    ):  # fmt: skip
        file = out / name / "c" / place
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 0x10
        file.write_bytes(content if fault == "bit" else content[: len(content) // 2])
    closed_form.solved.clear()
    again = run(out)
    assert len(closed_form.solved) == again.solved == 50
    assert files_of(out) == whole


@pytest.mark.parametrize("fault", ["bit", "cut", "empty", "missing"])
@pytest.mark.parametrize("name", ["mu1", "status"])
def test_a_damaged_chunk_is_not_read(
    tmp_path: Path, closed_form: ClosedForm, name: str, fault: str
) -> None:
    out = tmp_path / "s.zarr"
    run(out)
    file = out / name / "c" / "0" / "1"
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x10
    left = {"bit": content, "cut": content[: len(content) // 2], "empty": b""}
    file.unlink()
    if fault in left:
        file.write_bytes(left[fault])
    elif name == "status":
        # Without this file the chunk is not done; its values are those of an interrupted run.
        figure = plot_slice(out, "mu1", x="epsilon")
        assert "points have no value: not computed yet" in figure.get_suptitle()
        values = figure.axes[0].lines[0].get_ydata()
        assert np.isnan(values[10:]).all()
        assert np.isfinite(values[:10]).all()
        return
    readers = (
        open_store, summary_statistics, lambda store: plot_slice(store, "mu1", x="epsilon"),
        lambda store: plot_slice(store, "mu1", x="epsilon", y="K"),
        lambda store: export_store(store, tmp_path / "s.nc"),
    )  # fmt: skip
    for reader in readers:
        with pytest.raises(
            InputError, match=r"must be whole, got 's\.zarr', whose chunk 1 is miss"
        ):
            reader(out)
    assert store_status(out).chunks_damaged == 1
    # Another part of the store is whole.
    curve = plot_slice(out, "mu1", x="epsilon", at={"K": 2.0}).axes[0].lines[0]
    assert np.array_equal(curve.get_ydata()[:10], 2 * curve.get_xdata()[:10])


@pytest.mark.parametrize("fault", ["whole", "cut", "empty", "missing"])
def test_an_interrupted_chunk_is_not_exported(
    tmp_path: Path, closed_form: ClosedForm, fault: str
) -> None:
    """A kill may leave any part of its files, those of an earlier run among them."""
    out, target = tmp_path / "s.zarr", tmp_path / "s.nc"
    run(out)
    file = out / "mu1" / "c" / "0" / "1"
    content = file.read_bytes()
    left = {"whole": content, "cut": content[: len(content) // 2], "empty": b""}
    (out / "status" / "c" / "0" / "1").unlink()
    file.unlink()
    if fault in left:
        file.write_bytes(left[fault])
    assert export_store(out, target) == POINTS - 10
    with xarray.open_dataset(target) as exported, open_store(out) as opened:
        for dataset in (exported, opened):
            assert (dataset["outcome"].values[0, 10:] == -1).all()
            for name in ("mu1", "mu2", "detail"):
                assert np.isnan(dataset[name].values[0, 10:]).all()
                assert np.isfinite(dataset[name].values[0, :10]).all()
            assert (dataset["outcome"].values[:, :10] >= 0).all()


def test_any_reader_sees_a_half_written_chunk_as_not_computed(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    out = tmp_path / "s.zarr"
    run(out)
    written = SweepStore(out)
    with pytest.MonkeyPatch.context() as patch:

        def killed(file: Path) -> None:
            if file.match("mu2/c/0/1"):
                raise Killed

        patch.setattr(store, "make_way", killed)
        with pytest.raises(Killed):
            written.write(1, Answers.empty(("mu1", "mu2"), 10))
    with xarray.open_zarr(out, chunks=None) as dataset:
        assert np.isfinite(dataset["mu1"].values[0, 10:18]).all()
        assert (dataset["outcome"].values[0, 10:] == -1).all()


def test_the_second_driver_is_refused(tmp_path: Path, closed_form: ClosedForm) -> None:
    out = tmp_path / "s.zarr"
    # A lock of another process of this machine: locks of one process do not exclude each other
    # on every system.
    script = (
        "import sys, time, pathlib; from asperity.study.store.lock import store_lock;"
        "lock = store_lock(pathlib.Path(sys.argv[1])); lock.__enter__(); print('held', flush=True);"
        "sys.stdin.read()"
    )
    run(out)
    other = subprocess.Popen(
        [sys.executable, "-c", script, str(out)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=rf"not be in use.*process {other.pid} on"):
            run(out)
        assert f"process {other.pid} on" in store_status(out).running
    finally:
        other.kill()
        other.communicate()
    # A killed driver holds nothing.
    assert store_status(out).running == ""
    assert run(out).points == POINTS


def test_a_lock_file_of_another_form_holds_nothing(tmp_path: Path, closed_form: ClosedForm) -> None:
    """What a killed driver, another program or a full disk may leave in its place."""
    out, lock = tmp_path / "s.zarr", tmp_path / "s.zarr.lock"
    draw = np.random.default_rng(0)
    run(out, plan=plan_of(4, (1.0,)))
    record = {"token": "x", "host": "h", "process": 3, "since": "now"}
    others = [None, 7, 0.5, [], {}, ["x"], True]
    texts = [b"", b"null", b"[" * 10**5, b"\xff\xfe", b"9" * 5000, b"{}", draw.bytes(40)]
    for name in record:
        left = {n: v for n, v in record.items() if n != name}
        texts.append(json.dumps(left).encode())
        # True is a number of a process as far as Python is concerned.
        other = others[draw.integers(len(others) - (name == "process"))]
        if not (name == "process" and other == 7):
            texts.append(json.dumps({**record, name: other}).encode())
    for text in texts:
        lock.write_bytes(text)
        assert store_status(out).running == ""
        assert run(out, plan=plan_of(4, (1.0,))).solved == 0
        assert not lock.exists()


def test_a_worker_of_an_older_driver_writes_nothing(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    from asperity.study.job import Job, SupersededError

    out = tmp_path / "s.zarr"
    run(out)
    digest = json.loads((out / "zarr.json").read_text())["attributes"]["plan_sha256"]
    reset(out, SweepStore(out).grid, 0)
    with store_lock(out), pytest.raises(SupersededError):
        Job(str(out), digest, "the token of another driver")(0)
    assert SweepStore(out).failed_in(0) == -1


def test_another_plan_is_refused_with_the_difference(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    out = tmp_path / "s.zarr"
    run(out)
    other = plan_of().model_copy(update={"parameters": {"V": 2e-6, "frequency": 120.0}})
    with pytest.raises(InputError, match=r"numbers\.V = 1e-06 there and 2e-06 here"):
        run(out, plan=other)
    with pytest.raises(InputError, match=r"numbers\.V.*may only become longer"):
        run(out, plan=other, extend_store=True)


def test_extended_it_is_what_the_longer_plan_gives(tmp_path: Path, closed_form: ClosedForm) -> None:
    out = tmp_path / "s.zarr"
    run(out)
    # The step of this grid is another one, although it begins and ends with the same values.
    finer = plan_of().model_copy(
        update={
            "axes": {
                "K": {"values": (1.0, 2.0, 3.0)},
                "epsilon": {"from": 0.05, "to": 0.98, "count": 26},
            }
        }
    )
    with pytest.raises(InputError, match="axes may only become longer"):
        run(out, plan=finer, extend_store=True)
    with pytest.raises(InputError, match="--extend"):
        run(out, plan=plan_of(20, (1.0, 2.0, 3.0, 4.0)))
    closed_form.solved.clear()
    stiff = plan_of(20, (1.0, 2.0, 3.0, 4.0))
    assert run(out, plan=stiff, extend_store=True).solved == 20
    run(tmp_path / "whole.zarr", plan=stiff)
    assert files_of(out) == files_of(tmp_path / "whole.zarr")


def test_an_axis_whose_last_chunk_was_not_full_is_extended(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    out, values = tmp_path / "s.zarr", [0.01 * i for i in range(1, 22)]

    def plan(count: int) -> Any:
        return plan_of().model_copy(
            update={"axes": {"epsilon": {"values": values[:count]}, "K": {"values": [1.0]}}}
        )

    run(out, plan=plan(14))
    killed = 0
    for step in range(1, 60, 3):
        # Stopped anywhere on the way it is taken up again.
        with pytest.MonkeyPatch.context() as patch:
            killed_at(step, patch)
            try:
                run(out, plan=plan(21), extend_store=True)
            except Killed:
                killed += 1
                continue
        break
    assert killed > 2
    run(out, plan=plan(21), extend_store=True)
    with open_store(out) as dataset:
        assert np.array_equal(dataset["epsilon"], values)
        assert np.array_equal(dataset["mu1"][:, 0], values)
    assert store_status(out).done == 21


def test_repairs_of_an_extension_keep_its_chunks(tmp_path: Path, closed_form: ClosedForm) -> None:
    """Whatever is lost of an extended store but its answers, none is solved again."""
    out, longer = tmp_path / "s.zarr", plan_of(20, (1.0, 2.0, 3.0, 4.0))
    run(out)
    run(out, plan=longer, extend_store=True)
    whole = files_of(out)
    for name in ("zarr.json", "attributes", "K", "epsilon/zarr.json", "mu1/zarr.json"):
        file = out / name
        shutil.rmtree(file) if file.is_dir() else file.unlink()
        with pytest.raises(InputError, match=r"whole, got 's\.zarr', whose .*repeat asper"):
            summary_statistics(out)
        closed_form.solved.clear()
        lines: list[str] = []
        assert run(out, plan=longer, log=lines.append).solved == 0
        assert closed_form.solved == set()
        assert f"again: {name}" in lines[0]
        assert files_of(out) == whole
    runs = store_status(out).runs
    assert runs[-1]["points_solved"] == 0


def test_an_interrupted_extension_is_not_read(tmp_path: Path, closed_form: ClosedForm) -> None:
    out, longer = tmp_path / "s.zarr", plan_of(20, (1.0, 2.0, 3.0, 4.0))
    run(out)
    with pytest.MonkeyPatch.context() as patch:
        # Behind the first files of the longer plan, and before its attributes.
        killed_at(4, patch)
        with pytest.raises(Killed):
            run(out, plan=longer, extend_store=True)
    for answer in (store_status, summary_statistics, open_store):
        with pytest.raises(InputError, match=r"must be whole, .*repeat asperity sweep"):
            answer(out)
    run(out, plan=longer, extend_store=True)
    run(tmp_path / "whole.zarr", plan=longer)
    assert files_of(out) == files_of(tmp_path / "whole.zarr")


def test_failed_points_are_tried_again_when_asked(tmp_path: Path, closed_form: ClosedForm) -> None:
    out = tmp_path / "s.zarr"
    run(out)
    whole = files_of(out)
    closed_form.solved.clear()
    assert run(out, retry_failed=True).solved > 0
    # Of the six chunks two have no failed point.
    assert files_of(out) == whole
    assert store_status(out).outcomes == {"converged": 36, "folded": 18, "stopped": 6}


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path, closed_form: ClosedForm) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("...")
    with pytest.raises(InputError, match="must be the folder of a sweep"):
        run(tmp_path / "thesis")
    assert (tmp_path / "thesis" / "chapter1.tex").read_text() == "..."


def test_an_error_of_the_solver_is_the_outcome_of_its_point(
    tmp_path: Path, closed_form: ClosedForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = closed_form.solve

    def fragile(points: Any, record: Any) -> Any:
        if (points.values["epsilon"] == 0.05).any():
            raise ZeroDivisionError("of the solver")
        return solve(points, record)

    monkeypatch.setattr(closed_form, "solve", fragile)
    lines: list[str] = []
    run(tmp_path / "s.zarr", log=lines.append)
    status = store_status(tmp_path / "s.zarr")
    assert status.outcomes["solver_error"] == 3
    assert status.done == POINTS
    assert "ZeroDivisionError: of the solver" in lines[0]


def test_statistics_are_those_of_all_numbers(tmp_path: Path, closed_form: ClosedForm) -> None:
    run(tmp_path / "s.zarr")
    values = open_store(tmp_path / "s.zarr")["mu1"].values
    statistics = summary_statistics(tmp_path / "s.zarr")["mu1"]
    assert statistics["count"] == POINTS - FAILED
    assert statistics["mean"] == pytest.approx(np.nanmean(values), rel=1e-14)
    assert statistics["std"] == pytest.approx(np.nanstd(values), rel=1e-14)
    assert (statistics["min"], statistics["max"]) == (np.nanmin(values), np.nanmax(values))


def test_the_mean_of_a_phase_is_that_of_its_direction(
    tmp_path: Path, closed_form: ClosedForm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Phases next to pi and to -pi had the mean 0."""

    def phases(law, points, record) -> Answers:
        answers = Answers.empty(("phase1",), len(points))
        answers.numbers["phase1"][:] = np.angle(-np.exp(1j * (points.values["epsilon"] - 0.2)))
        answers.outcome[:] = SweepOutcome.CONVERGED
        return answers

    monkeypatch.setattr(closed_form, "outputs", (OUTPUTS["phase1"],))
    monkeypatch.setattr(closed_form, "defaults", ("phase1",))
    monkeypatch.setattr(closed_form, "solve_law", phases)
    axes = {"epsilon": {"values": tuple(np.linspace(0.0, 0.5, 26).tolist())}}
    run(tmp_path / "s.zarr", plan=SweepPlan(**{**dict(plan_of()), "axes": axes}))
    x = open_store(tmp_path / "s.zarr")["phase1"].values
    statistics = summary_statistics(tmp_path / "s.zarr")["phase1"]
    assert statistics["mean"] == pytest.approx(circmean(x, np.pi, -np.pi), abs=1e-12)
    assert statistics["std"] == pytest.approx(circstd(x, np.pi, -np.pi), rel=1e-9)


def test_exports_hold_what_the_store_holds(tmp_path: Path, closed_form: ClosedForm) -> None:
    import pandas as pd

    out = tmp_path / "s.zarr"
    run(out)
    values = open_store(out)["mu1"].values
    for suffix in ("nc", "csv", "parquet"):
        assert export_store(out, tmp_path / f"s.{suffix}") == POINTS
    with xarray.open_dataset(tmp_path / "s.nc") as dataset:
        assert np.array_equal(dataset["mu1"].values, values, equal_nan=True)
        assert dataset["mu1"].attrs["units"] == "1"
        assert str(dataset["law"].values) == "rice-ruina"
        assert set(open_store(out).coords) == set(dataset.coords)
    for table in (pd.read_csv(tmp_path / "s.csv"), pd.read_parquet(tmp_path / "s.parquet")):
        both = table.merge(pd.DataFrame({"K": [1.0, 2.0, 3.0]}), on="K")
        wide = both.pivot_table(index="K", columns="epsilon", values="mu1", dropna=False)
        assert np.array_equal(wide.to_numpy(), values, equal_nan=True)
        assert set(table["outcome"]) == {"converged", "folded", "stopped"}
    with pytest.raises(InputError, match=r"end in \.nc, \.csv, \.parquet"):
        export_store(out, tmp_path / "s.xlsx")
    with pytest.raises(InputError, match="out must lie outside the store"):
        export_store(out, out / "s.csv")


def test_a_position_on_an_axis_of_angles_may_be_in_degrees(
    tmp_path: Path, closed_form: ClosedForm
) -> None:
    angles = {"epsilon": {"values": (0.1, 0.2)}, "tilt": {"values": ("2 deg", "30 deg")}}
    run(tmp_path / "s.zarr", plan=SweepPlan(**{**dict(plan_of()), "axes": angles}))
    curve = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at={"tilt": "25 deg"})
    assert curve.axes[0].get_title().startswith("tilt = 0.5236")


def test_every_run_is_on_record(tmp_path: Path, closed_form: ClosedForm) -> None:
    run(tmp_path / "s.zarr")
    run(tmp_path / "s.zarr")
    first, second = store_status(tmp_path / "s.zarr").runs
    assert (first["points_solved"], second["points_solved"]) == (POINTS, 0)
    assert first["workers"] == "this process"
    assert first["jax"]
    attributes = open_store(tmp_path / "s.zarr").attrs
    # The law has its source, the numbers of the material theirs.
    assert all(name in "".join(attributes["references"]) for name in ("Ruina", "Bureau"))
    assert json.loads(attributes["plan"])["numbers"]["W0"] == 7.0


def test_a_plane_and_a_curve(tmp_path: Path, closed_form: ClosedForm) -> None:
    run_sweep(plan_of(), tmp_path / "s.zarr", workers=ThisProcess())
    values = open_store(tmp_path / "s.zarr")["mu1"].values
    plane = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", y="K")
    (mesh,) = plane.axes[0].collections
    drawn = np.ma.filled(mesh.get_array(), np.nan).reshape(values.shape)
    assert np.array_equal(drawn, values, equal_nan=True)
    labels = [plane.axes[0].get_xlabel(), plane.axes[0].get_ylabel(), plane.axes[1].get_ylabel()]
    assert labels == [
        r"relative amplitude of the load on the contacts $\varepsilon$",
        "stiffness of the pulling spring $K$ (N/m)",
        r"first harmonic of $F/W_0$ $\mu_1$",
    ]
    curve = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at={"K": 2.1})
    assert np.array_equal(curve.axes[0].lines[0].get_ydata(), values[1], equal_nan=True)
    same = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at={"K": "2.1e-6 N/um"})
    assert np.array_equal(same.axes[0].lines[0].get_ydata(), values[1], equal_nan=True)
    for at, sentence in (
        ({"K": "2 N"}, r"at\['K'\] must be a stiffness"),
        ({"K": math.nan}, r"at\['K'\] must be finite"),
        ({"epsilon": 0.1}, "at must name another axis than x and y, got 'epsilon'"),
    ):
        with pytest.raises(InputError, match=sentence):
            plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at=at)
    with pytest.raises(InputError, match="y must be another axis than x"):
        plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", y="epsilon")
    with pytest.raises(InputError, match="did you mean 'epsilon'"):
        plot_slice(tmp_path / "s.zarr", "mu1", x="epsilom")
    with pytest.raises(InputError, match="show must be an output"):
        plot_slice(tmp_path / "s.zarr", "mu9", x="epsilon")


@pytest.mark.parametrize("name", ["slice", "slice.xyz"])
def test_a_picture_of_no_known_format_is_refused(
    tmp_path: Path, closed_form: ClosedForm, name: str
) -> None:
    run(tmp_path / "s.zarr")
    call = ["sweep", "plot", str(tmp_path / "s.zarr"), "--show", "mu1", "--x", "epsilon", "--out"]
    assert CliRunner().invoke(main, [*call, str(tmp_path / "slice.png")]).exit_code == 0
    refused = CliRunner().invoke(main, [*call, str(tmp_path / name)])
    assert refused.exit_code == 2
    assert "--out must be a picture" in refused.stderr


def test_rows_in_any_order_and_without_a_number(tmp_path: Path, closed_form: ClosedForm) -> None:
    axes = {
        "eta": {"values": ("", 1.0, 2.0)},
        "epsilon": {"values": (0.3, 0.1, 0.2)},
        "K": {"values": (1.0,)},
    }
    run(tmp_path / "s.zarr", plan=plan_of().model_copy(update={"axes": axes}))
    curve = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", at={"eta": 1.9}).axes[0]
    # The row without a number is not the nearest one.
    assert "2.0" in curve.get_title()
    assert curve.lines[0].get_ydata().tolist() == [0.1, 0.2, 0.3]
    (mesh,) = plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", y="eta").axes[0].collections
    assert mesh.get_array().reshape(2, 3).tolist() == [[0.1, 0.2, 0.3]] * 2
    # A plane without height would be an empty picture.
    with pytest.raises(InputError, match="y must be an axis of several rows, got 'K' of one"):
        plot_slice(tmp_path / "s.zarr", "mu1", x="epsilon", y="K")
