"""Running a protocol into a file: whole, interrupted and resumed, and with a motion that ends."""

import json

import numpy as np
import pytest
import xarray

from asperity.errors import InputError
from asperity.measurement.sliding.signals import sliding_signals
from asperity.outputs import Interrupted
from asperity.protocol import (
    Protocol,
    load_protocol,
    outline,
    run_protocol,
    write_csv,
)
from asperity.recording.readers import read

ROWS = 300


@pytest.fixture(scope="session")
def whole(short, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "run.nc"
    done = run_protocol(short, out, rows=ROWS)
    assert (done.rows, done.stopped, done.out) == (2001, None, out)
    return out


def interrupted_at(limit: float):
    def progress(time: float, end: float) -> None:
        if time > limit:
            raise KeyboardInterrupt

    return progress


def test_the_file_holds_the_motion(short, whole) -> None:
    direct = short.trajectory()
    with xarray.open_dataset(whole) as run:
        np.testing.assert_array_equal(run.time, np.arange(2001) / 2000)
        # Two runs of one solver that differ in where their steps begin.
        np.testing.assert_allclose(run.force, direct.force, rtol=1e-6)
        np.testing.assert_array_equal(run["load"], direct.load)
        np.testing.assert_allclose(run.displacement, direct.displacement, rtol=1e-6, atol=1e-12)
        assert list(run.event_kind.values) == [event.kind for event in direct.events]
        np.testing.assert_allclose(run.event_time, [e.time for e in direct.events], atol=1e-6)
        assert not (whole.parent / "run.nc.partial").exists()
        assert not (whole.parent / "run.nc.partial.json").exists()


def test_the_file_says_where_it_comes_from(short, whole) -> None:
    with xarray.open_dataset(whole) as run:
        attributes = run.attrs
        assert attributes["title"] == "a short run"
        assert attributes["law"] == "elasto-plastic"
        assert attributes["asperity_version"]
        assert "K = 500000.0 N/m" in attributes["parameters"]
        assert "K: protocol" in attributes["origin_of_parameters"]
        assert "A: bureau2000" in attributes["origin_of_parameters"]
        assert attributes["protocol"] == "; ".join(short.lines)
        assert "Bureau" in attributes["citation"]
        assert attributes["relative_tolerance"] == 1e-9
        assert attributes["steps"] > 100
        assert attributes["stopped"] == "end of the programme"
        assert {run[name].attrs["units"] for name in ("force", "load")} == {"N"}
        assert run.time.attrs["units"] == "s"


@pytest.mark.parametrize("limit", [0.25, 0.55])
def test_an_interrupted_run_goes_on_to_the_same_file(short, whole, tmp_path, limit) -> None:
    out = tmp_path / "run.nc"
    with pytest.raises(Interrupted, match="--resume") as caught:
        run_protocol(short, out, rows=ROWS, progress=interrupted_at(limit))
    assert not out.exists()
    with xarray.open_dataset(tmp_path / "run.nc.partial") as partial:
        kept = partial.sizes["time"]
        assert kept % ROWS == 0
        assert 0 < kept < 2001
        assert f"interrupted with {float(partial.time[-1]):.6g} s of 1 s finished" in str(
            caught.value
        )
        with xarray.open_dataset(whole) as other:
            np.testing.assert_array_equal(partial.force, other.force[:kept])
    run_protocol(short, out, rows=ROWS, resume=True)
    with xarray.open_dataset(out) as mine, xarray.open_dataset(whole) as other:
        assert mine.identical(other)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.nc"]


def test_a_block_that_was_never_finished_is_written_again(short, whole, tmp_path) -> None:
    out = tmp_path / "run.nc"
    with pytest.raises(Interrupted):
        run_protocol(short, out, rows=ROWS, progress=interrupted_at(0.55))
    note = tmp_path / "run.nc.partial.json"
    # As if the machine had stopped between the last block and its record.
    import h5netcdf

    with h5netcdf.File(tmp_path / "run.nc.partial", "r+") as file:
        rows = file.dimensions["time"].size
        file.resize_dimension("time", rows + 50)
        file.variables["force"][rows:] = np.full(50, 99.0)
    assert json.loads(note.read_text())["progress"]["lengths"]["time"] == rows
    run_protocol(short, out, rows=ROWS, resume=True)
    with xarray.open_dataset(out) as mine, xarray.open_dataset(whole) as other:
        assert mine.identical(other)


def test_an_interruption_before_the_first_block_leaves_nothing(short, tmp_path) -> None:
    with pytest.raises(Interrupted, match="nothing was written"):
        run_protocol(short, tmp_path / "run.nc", progress=interrupted_at(0.0))
    assert list(tmp_path.iterdir()) == []


def test_an_unfinished_run_is_not_overwritten(short, short_file, tmp_path) -> None:
    out = tmp_path / "run.nc"
    with pytest.raises(Interrupted):
        run_protocol(short, out, rows=ROWS, progress=interrupted_at(0.5))
    with pytest.raises(InputError, match="go on with --resume"):
        run_protocol(short, out, rows=ROWS)
    text = short_file.read_text().replace("9 N", "8 N")
    other = tmp_path / "other.toml"
    other.write_text(text)
    different = r"same inputs, got segment 4\.load1 = 9\.0 there and 8\.0 here"
    with pytest.raises(InputError, match=different):
        run_protocol(load_protocol(other), out, rows=ROWS, resume=True)
    (tmp_path / "run.nc.partial.json").write_text("{")
    with pytest.raises(InputError, match="must be the record of finished blocks"):
        run_protocol(short, out, rows=ROWS, resume=True)


def test_a_damaged_unfinished_file_is_named(short, tmp_path) -> None:
    out = tmp_path / "run.nc"
    with pytest.raises(Interrupted):
        run_protocol(short, out, rows=ROWS, progress=interrupted_at(0.5))
    data = tmp_path / "run.nc.partial"
    data.write_bytes(data.read_bytes()[:1000])
    with pytest.raises(InputError, match=r"run\.nc\.partial"):
        run_protocol(short, out, rows=ROWS, resume=True)


def test_rows_at_the_steps_of_the_integrator_come_once(short, tmp_path) -> None:
    free = Protocol(
        law=short.law, material=short.material, parameters=short.parameters,
        start=short.start, steps=short.steps,
    )  # fmt: skip
    out = tmp_path / "run.nc"
    run_protocol(free, out, rows=ROWS)
    with xarray.open_dataset(out) as run:
        assert run.sizes["time"] > 2 * ROWS
        assert np.all(np.diff(run.time) > 0)
        assert run.time[-1] == pytest.approx(1.0, rel=1e-12)


def test_a_motion_that_ends_says_why(short, tmp_path) -> None:
    lost = Protocol(
        law=short.law, material=short.material, parameters=short.parameters,
        start=short.start, solver=short.solver, steps=("ramp load to -1 N in 1 s",),
    )  # fmt: skip
    done = run_protocol(lost, tmp_path / "run.nc", rows=ROWS)
    # From 7 N at 8 N/s.
    assert done.time == pytest.approx(7 / 8, abs=1 / 2000)
    assert "contact was lost" in done.stopped
    with xarray.open_dataset(done.out) as run:
        assert run.attrs["stopped"] == done.stopped
        assert run.event_kind.values[-1] == "loss of contact"


def test_a_place_that_cannot_be_written(short, tmp_path) -> None:
    with pytest.raises(InputError, match="folder that exists"):
        run_protocol(short, tmp_path / "nowhere" / "run.nc")
    with pytest.raises(InputError, match="name of a file"):
        run_protocol(short, tmp_path)


def test_text_has_the_same_rows(whole, tmp_path) -> None:
    path = write_csv(whole, tmp_path / "run.csv")
    heading = path.read_text().splitlines()[0].split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    with xarray.open_dataset(whole) as run:
        for name, column in (("time (s)", "time"), ("shear force (N)", "force")):
            np.testing.assert_allclose(rows[:, heading.index(name)], run[column], rtol=1e-11)
        # What a drive moves is read, and not the slider.
        motion = sliding_signals(read(path), "W", "F", None).displacement
        np.testing.assert_allclose(motion, run.load_point_displacement, rtol=1e-11)
    with pytest.raises(InputError, match="--csv"):
        write_csv(whole, tmp_path / "nowhere" / "run.csv")


def test_the_outline_encloses_the_motion(whole) -> None:
    drawn = outline(whole, stretches=100)
    with xarray.open_dataset(whole) as run:
        assert len(drawn.time) == 100
        for name in ("load", "force", "velocity"):
            assert drawn.low[name].min() == run[name].values.min()
            assert drawn.high[name].max() == run[name].values.max()
        inside = (run.time >= 0.30 - 1e-9) & (run.time < 0.31 - 1e-9)
        at = int(np.argmin(np.abs(drawn.time - 0.305)))
        assert drawn.high["load"][at] == run["load"].values[inside].max()
        assert drawn.events == list(zip(run.event_time.values, run.event_kind.values, strict=True))
