"""A protocol's tribometer: described in the file, applied to the run."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.protocol import load_protocol, record_run, run_protocol

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
        ("5 nm", "5 mN", "SpringGauge.noise must be a length"),
        ("seed = 3", "seed = -3", "tribometer.seed must be a whole number"),
        ('noise = "5 nm"', "noise = [1, 2]", "SpringGauge.noise must be one number"),
        ("seed = 3", "order = true", "tribometer.order must be a whole number, got True"),
        ('bandwidth = "500 Hz"', 'bandwidth = "2 kHz"', "solver.sampling must be at least 4000 Hz"),
        ("sensors", "sensor", "tribometer.sensors must have a table"),
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


CELL = """
[tribometer]
rate = "1 kHz"

[tribometer.sensors."{channel}"]
type = "{kind}"
bandwidth = "1 kHz"
"""


@pytest.mark.parametrize(
    ("channel", "measures", "variable"),
    [
        ("shear force", "shear force", "force"),
        ("normal force", "normal load", "load"),
        ("cell 2", None, "load"),
        ("cell 3", "shear force", "force"),
    ],
)
def test_what_a_load_cell_measures_is_a_field(write, tmp_path, channel, measures, variable) -> None:
    table = CELL.format(channel=channel, kind="load cell")
    protocol = load_protocol(write(table + (f"measures = '{measures}'\n" if measures else "")))
    done = run_protocol(protocol, tmp_path / "run.nc")
    trace = record_run(protocol.setup, done.out)
    expected = getattr(protocol.trajectory(), variable)[0]
    assert trace.channels[channel].values[:50].mean() == pytest.approx(expected, rel=1e-6)


def test_a_load_cell_by_the_name_of_a_shear_force_has_to_say_what_it_measures(write) -> None:
    with pytest.raises(InputError, match="must be given for a load cell in a channel of this name"):
        load_protocol(write(CELL.format(channel="shear force", kind="load cell")))
    table = CELL.format(channel="F", kind="spring gauge") + "stiffness = '1 N/um'\n"
    path = write(table + "measures = 'normal load'\n")
    with pytest.raises(InputError, match="must be something that a spring gauge can measure"):
        load_protocol(path)


def test_the_load_point_moves_as_the_drive_does(write, tmp_path) -> None:
    table = CELL.format(channel="load point", kind="displacement gauge")
    protocol = load_protocol(write(table + "measures = 'load-point displacement'\n"))
    done = run_protocol(protocol, tmp_path / "run.nc")
    trace = record_run(protocol.setup, done.out)
    steady = (trace.time > 0.05) & (trace.time < 0.19)
    speed = np.polyfit(trace.time[steady], trace.channels["load point"].values[steady], 1)[0]
    assert speed == pytest.approx(protocol.programme.level.velocity, rel=1e-6)
