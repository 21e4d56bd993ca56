"""Running a protocol into a file, recorded by a tribometer: whole, interrupted, resumed, drawn."""

import json

import numpy as np
import pytest
import xarray

from asperity.errors import InputError
from asperity.figures.style import style
from asperity.figures.trajectory import draw_run
from asperity.measurement.sliding.signals import sliding_signals
from asperity.outputs import Interrupted
from asperity.protocol import (
    Protocol,
    RunOutline,
    load_protocol,
    outline,
    record_run,
    run_protocol,
    write_csv,
)
from asperity.recording.readers import read
from references.populations import population

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


@pytest.mark.parametrize("limit", population([0.25, 0.55]))
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


def drawn(low, high, events=()):
    time = np.linspace(0, 10, 50)
    flat = np.full(50, 7.0)
    run = RunOutline(
        time,
        {"load": flat, "force": 0.4 * flat, "velocity": low},
        {"load": flat, "force": 0.5 * flat, "velocity": high},
        list(events),
        "a title",
        "rice-ruina",
    )
    with style():
        figure = draw_run(run)
        figure.canvas.draw()
    return run, figure.axes


def test_edges_of_the_bands_are_the_extremes() -> None:
    slow = np.full(50, 1e-5)
    run, (load, force, velocity) = drawn(0.9 * slow, 1.1 * slow)
    low, high = (line.get_ydata() for line in force.lines)
    np.testing.assert_array_equal(low, run.low["force"])
    np.testing.assert_array_equal(high, run.high["force"])
    np.testing.assert_allclose(velocity.lines[1].get_ydata(), 11.0)
    assert velocity.get_yscale() == "linear"
    assert velocity.get_xlim() == (0, 10)
    below, above = load.get_ylim()
    assert below < 7 < above
    assert load.get_title() == "a title"


@pytest.mark.parametrize(("least", "scale"), [(1e-9, "log"), (-1e-6, "symlog")])
def test_pulses_are_seen_beside_slow_sliding(least, scale) -> None:
    low, high = np.full(50, least), np.full(50, 1e-5)
    high[20] = 1e-3
    _, (_, _, velocity) = drawn(low, high)
    assert velocity.get_yscale() == scale
    below, above = velocity.get_ylim()
    assert below < 1e6 * least
    assert above > 1e3


def test_events_are_marked_unless_there_are_too_many() -> None:
    slow = np.full(50, 1e-5)
    _, (_, force, _) = drawn(slow, slow, [(2.0, "steady"), (3.0, "slip start"), (4.0, "slip end")])
    assert sorted(line.get_xdata()[0] for line in force.lines[2:]) == [2.0, 3.0]
    _, (_, force, _) = drawn(slow, slow, [(0.1 * i, "slip start") for i in range(100)])
    assert len(force.lines) == 2


TABLE = """
[tribometer]
rate = "1 kHz"
cut_off = "400 Hz"
seed = 3
ranges = { "normal force" = ["0 N", "20 N"] }

[tribometer.sensors."shear force"]
type = "spring gauge"
stiffness = "0.5 N/um"
bandwidth = "1 kHz"
noise = "5 nm"

[tribometer.sensors."normal force"]
type = "load cell"
bandwidth = "1 kHz"

[tribometer.sensors.displacement]
type = "displacement gauge"
bandwidth = "500 Hz"
"""


@pytest.fixture
def write(short_file, tmp_path):
    def written(table: str, **changes: str):
        text = short_file.read_text(encoding="utf-8")
        for old, new in changes.items():
            text = text.replace(old, new)
        path = tmp_path / "protocol.toml"
        path.write_text(text + table, encoding="utf-8")
        return path

    return written


def test_the_recording_is_of_the_run(write, tmp_path) -> None:
    protocol = load_protocol(write(TABLE))
    done = run_protocol(protocol, tmp_path / "run.nc")
    trace = record_run(protocol.setup, done.out)
    assert trace.sample_rate == pytest.approx(1000)
    assert len(trace) == 1001
    assert trace.provenance["law"] == "elasto-plastic"
    motion = protocol.trajectory()
    before = trace.time < 0.19
    F, W, x = (trace.channel(role).values for role in ("F", "W", "displacement"))
    # Steady sliding: filters change nothing; the gauge adds 5 nm of the spring.
    noise = 0.5e6 * 5e-9
    assert F[before].mean() == pytest.approx(motion.force[0], abs=noise)
    assert 0.3 * noise < F[before].std() < noise
    assert np.abs(W[before] - 7).max() <= 0.5 * 20 / (2**16 - 1)
    # A first-order and a fourth-order filter lag behind a ramp by 1/w and 2.6131/w.
    lag = 1 / (2 * np.pi * 500) + 2.6131 / (2 * np.pi * 400)
    late = before & (trace.time > 0.05)
    np.testing.assert_allclose(x[late], 1e-5 * (trace.time[late] - lag), atol=1e-12)


def test_the_tribometer_does_not_change_the_motion(write) -> None:
    assert load_protocol(write(TABLE)).inputs == load_protocol(write("")).inputs
    assert load_protocol(write("")).setup is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cut_off", "cutoff", "tribometer.cutoff must be a known field, got '400 Hz'; did you"),
        ("spring gauge", "spring gage", "got 'spring gage'; did you mean 'spring gauge'"),
        ("stiffness =", "noise_ =", "noise_ must be a known field"),
        ('stiffness = "0.5 N/um"', "", "sensors.shear force.stiffness must be given"),
        ('rate = "1 kHz"', "", "tribometer.rate must be given"),
        ("5 nm", "5 mN", "sensors.shear force.noise must be a length"),
        ("seed = 3", "seed = -3", "tribometer.seed must be at least 0"),
        ('noise = "5 nm"', "noise = [1, 2]", "sensors.shear force.noise must be one number"),
        ("seed = 3", "order = true", "tribometer.order must be a whole number, got True"),
        ('bandwidth = "500 Hz"', 'bandwidth = "2 kHz"', "solver.sampling must be at least 4000 Hz"),
        ('noise = "5 nm"', 'resonance = "3 kHz"', "solver.sampling must be at least 6000 Hz"),
        ("sensors", "sensor", "tribometer.sensors must have a table"),
        ('"5 nm"', "5e-9", "sensors.shear force.noise must carry a unit, got 5e-09"),
        ('"1 kHz"', "1000", "tribometer.rate must carry a unit, got 1000"),
        ('["0 N", "20 N"]', "[0, 20]", "tribometer.ranges['normal force'] must carry a unit"),
        ('["0 N", "20 N"]', '["20 N", "0 N"]', "tribometer.ranges['normal force'] must rise"),
        ('{ "normal', '{ "other', "tribometer.ranges must be of channels with a sensor, got 'oth"),
    ],
)
def test_a_mistake_says_where(write, old, new, message) -> None:
    assert old in TABLE
    with pytest.raises(InputError) as caught:
        load_protocol(write(TABLE.replace(old, new)))
    assert message in str(caught.value)


def test_a_recording_needs_even_samples(write) -> None:
    with pytest.raises(InputError, match=r"solver\.sampling must be at least"):
        load_protocol(write(TABLE, **{'sampling = "2 kHz"': ""}))


RATE = """
[tribometer]
rate = "1 kHz"
"""
CELL = """
[tribometer.sensors."{channel}"]
type = "{kind}"
bandwidth = "1 kHz"
"""


def test_what_a_load_cell_measures_is_a_field(write, whole) -> None:
    cells = {
        "shear force": ("shear force", "force"),
        "normal force": ("normal load", "load"),
        "cell 2": (None, "load"),
        "cell 3": ("shear force", "force"),
    }
    table = RATE
    for channel, (measures, _) in cells.items():
        table += CELL.format(channel=channel, kind="load cell")
        table += f"measures = '{measures}'\n" if measures else ""
    trace = record_run(load_protocol(write(table)).setup, whole)
    with xarray.open_dataset(whole) as run:
        for channel, (_, variable) in cells.items():
            read = trace.channels[channel].values[:50].mean()
            assert read == pytest.approx(float(run[variable][0]), rel=1e-6)


def test_a_load_cell_by_the_name_of_a_shear_force_has_to_say_what_it_measures(write) -> None:
    with pytest.raises(InputError, match="must be given for a load cell in a channel of this name"):
        load_protocol(write(RATE + CELL.format(channel="shear force", kind="load cell")))
    table = RATE + CELL.format(channel="F", kind="spring gauge") + "stiffness = '1 N/um'\n"
    path = write(table + "measures = 'normal load'\n")
    with pytest.raises(InputError, match="must be something that a spring gauge can measure"):
        load_protocol(path)


def test_the_load_point_moves_as_the_drive_does(write, tmp_path) -> None:
    table = RATE + CELL.format(channel="load point", kind="displacement gauge")
    protocol = load_protocol(write(table + "measures = 'load-point displacement'\n"))
    done = run_protocol(protocol, tmp_path / "run.nc")
    trace = record_run(protocol.setup, done.out)
    steady = (trace.time > 0.05) & (trace.time < 0.19)
    speed = np.polyfit(trace.time[steady], trace.channels["load point"].values[steady], 1)[0]
    assert speed == pytest.approx(protocol.programme.level.velocity, rel=1e-6)
