"""Clock, converter and filter of the recorder, and the round trip through files."""

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.recording import Channel, Trace, read
from asperity.recording.writers import write
from asperity.tribometer.sensors import (
    Accelerometer,
    DisplacementGauge,
    LoadCell,
    SpringGauge,
)
from asperity.tribometer.tribometer import Recorder, Tribometer, channel_gain

RATE, F = 20_000.0, 120.0
TIME = np.arange(0, 2, 1 / RATE)


def load(time):
    return 7 * (1 + 0.24 * np.cos(2 * np.pi * F * time))


def recorded(recorder, cell=None, seed=0) -> Trace:
    # A corner far above: 10 kHz shifts 120 Hz by 0.012 rad, and is in the closed forms.
    sensors = {"normal force": cell or LoadCell(bandwidth="10 kHz")}
    tribometer = Tribometer(sensors=sensors, recorder=recorder)
    return tribometer.record(TIME, {"normal force": load(TIME)}, seed=seed)


def gain(trace, frequency=F):
    late = trace.time > 0.5
    angle = 2 * np.pi * frequency * trace.time[late]
    columns = np.c_[np.cos(angle), -np.sin(angle), np.ones_like(angle)]
    a, b, _ = np.linalg.lstsq(columns, trace.channels["normal force"].values[late], rcond=None)[0]
    return (a + 1j * b) / (7 * 0.24)


CELL = 1 / (1 + 1j * F / 10_000)


def test_a_plain_recorder_writes_what_the_cell_reads() -> None:
    trace = recorded(Recorder(rate="2 kHz"))
    assert trace.sample_rate == pytest.approx(2000, rel=1e-12)
    assert len(trace) == 4000
    assert trace.findings == ()
    assert abs(gain(trace) - CELL) < 1e-6


def test_a_delay_is_a_phase() -> None:
    trace = recorded(Recorder(rate="2 kHz"), LoadCell(bandwidth="10 kHz", delay="130 us"))
    assert abs(gain(trace) - CELL * np.exp(-2j * np.pi * F * 130e-6)) < 1e-6


def test_the_filter_before_the_converter_has_its_gain() -> None:
    trace = recorded(Recorder(rate="2 kHz", cut_off="300 Hz", order=1))
    assert abs(gain(trace) - CELL / (1 + 1j * F / 300)) < 1e-6


def test_a_wrong_clock_shifts_the_frequency() -> None:
    trace = recorded(Recorder(rate="2 kHz", clock_error=1e-2))
    assert abs(gain(trace, F * (1 + 1e-2))) == pytest.approx(abs(CELL), rel=1e-6)
    assert abs(gain(trace, F)) < 0.3


def test_jitter_scatters_by_the_slope_of_the_signal() -> None:
    jitter = 1e-5
    clean, shaken = (recorded(Recorder(rate="2 kHz", jitter=j), seed=3) for j in (0.0, jitter))
    np.testing.assert_array_equal(clean.time, shaken.time)
    difference = shaken.channels["normal force"].values - clean.channels["normal force"].values
    # rms slope of the modulation; second order in w jitter = 0.0075 is left out.
    expected = jitter * 7 * 0.24 * 2 * np.pi * F / np.sqrt(2) * abs(CELL)
    assert difference.std() == pytest.approx(expected, rel=5 / np.sqrt(2 * len(clean)))


def test_the_converter_has_steps_and_limits() -> None:
    recorder = Recorder(rate="2 kHz", bits=8, ranges={"normal force": ("0 N", "8.16 N")})
    values = recorded(recorder).channels["normal force"].values
    step = 8.16 / 255
    np.testing.assert_allclose(values / step, np.rint(values / step), atol=1e-9)
    assert values.max() == pytest.approx(8.16)
    exact = recorded(Recorder(rate="2 kHz")).channels["normal force"].values
    inside = exact < 8.1
    assert np.abs(values - exact)[inside].max() <= 0.5 * step * (1 + 1e-9)
    # An error evenly spread over a step.
    assert (values - exact)[inside].std() == pytest.approx(step / np.sqrt(12), rel=0.1)
    assert [f.name for f in recorded(recorder).findings] == ["saturation"]


def test_a_converter_without_steps_has_limits_too() -> None:
    recorder = Recorder(rate="2 kHz", bits=0, ranges={"normal force": ("0 N", "8.16 N")})
    values = recorded(recorder).channels["normal force"].values
    exact = recorded(Recorder(rate="2 kHz")).channels["normal force"].values
    np.testing.assert_array_equal(values, np.minimum(exact, 8.16))


def test_a_recording_keeps_its_clock_and_where_it_comes_from() -> None:
    tribometer = Tribometer(
        sensors={"normal force": LoadCell(bandwidth="10 kHz")}, recorder=Recorder(rate=1000.0)
    )
    signals = {"normal force": load(TIME)}
    trace = tribometer.record(TIME + 30.0, signals, provenance={"law": "rice-ruina"})
    assert trace.time[0] == 30.0
    assert trace.provenance == {"format": "virtual tribometer", "law": "rice-ruina"}
    assert trace.channel("W") is trace.channels["normal force"]


@pytest.fixture(scope="module")
def laboratory() -> Trace:
    tribometer = Tribometer(
        sensors={
            "shear force": SpringGauge(stiffness="0.2 N/um", bandwidth="1 kHz", noise="5 nm"),
            "normal force": LoadCell(bandwidth="5 kHz", noise="2 mN"),
            "displacement": DisplacementGauge(bandwidth="500 Hz", noise="4 nm"),
        },
        recorder=Recorder(rate="2 kHz", cut_off="800 Hz"),
    )
    signals = {
        "shear force": 3 + 0.01 * np.cos(2 * np.pi * F * TIME),
        "normal force": load(TIME),
        "displacement": 1e-5 * TIME,
    }
    return tribometer.record(TIME, signals, seed=5)


@pytest.mark.parametrize(
    ("suffix", "digits"), [("csv", 1e-8), ("txt", 1e-8), ("h5", 1e-15), ("tdms", 1e-15)]
)
def test_a_recording_comes_back_from_its_file(laboratory, tmp_path, suffix, digits) -> None:
    if suffix == "tdms":
        pytest.importorskip("nptdms")
    units = {"normal force": "kN", "displacement": "um"}
    path = write(laboratory, tmp_path / f"recording.{suffix}", units=units)
    back = read(path)
    assert back.findings == ()
    np.testing.assert_allclose(back.time, laboratory.time, rtol=1e-13, atol=1e-15)
    for name, role in (("shear force", "F"), ("normal force", "W"), ("displacement",) * 2):
        channel = back.channel(role)
        assert channel is back.channels[name]
        assert channel.recorded_unit == units.get(name, "N")
        kept = laboratory.channels[name].values
        np.testing.assert_allclose(channel.values, kept, rtol=0, atol=digits * np.abs(kept).max())


@pytest.mark.parametrize("suffix", ["csv", "txt", "h5", "tdms"])
def test_names_and_units_of_any_channel_come_back(tmp_path, suffix) -> None:
    if suffix == "tdms":
        pytest.importorskip("nptdms")
    time = np.arange(50) / 10
    channels = {
        "Load, filtered": Channel(7 + time, "force", "N"),
        "F/N": Channel(0.3 + time, "dimensionless"),
        "Gauge": Channel(3 + time),
    }
    back = read(write(Trace(time, channels), tmp_path / f"a.{suffix}"))
    assert [f.name for f in back.findings] == ["unknown unit"]
    assert {c.kind: c.values[0] for c in back.channels.values()} == {
        "force": 7,
        "dimensionless": 0.3,
        None: 3,
    }
    assert back.channels["Load, filtered"].kind == "force"
    assert back.channels["Gauge"].kind is None


@pytest.mark.parametrize("suffix", ["csv", "h5", "tdms"])
@pytest.mark.parametrize("name", ["time", "Time", "Zeit"])
def test_recorded_times_do_not_replace_the_clock(tmp_path, suffix, name) -> None:
    if suffix == "tdms":
        pytest.importorskip("nptdms")
    time = np.arange(50) / 10
    channels = {name: Channel(time * 3, "time", "s"), "load": Channel(7 + time, "force", "N")}
    back = read(write(Trace(time, channels), tmp_path / f"a.{suffix}"))
    np.testing.assert_allclose(back.time, time, atol=1e-12)
    assert len(back.channels) == 2


def test_an_uneven_clock_comes_back_from_tdms(laboratory, tmp_path) -> None:
    pytest.importorskip("nptdms")
    time = laboratory.time.copy()
    time[1000:] += 0.3
    gapped = Trace(time, laboratory.channels)
    back = read(write(gapped, tmp_path / "gap.tdms"))
    np.testing.assert_array_equal(back.time, time)
    assert [f.name for f in back.findings] == ["gap"]


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda t, p: write(t, p / "x.xlsx"), r"write\.path must end in the name of a format"),
        (lambda t, p: write(t, p / "x.csv", units={"load": "N"}), "must name channels"),
        (lambda t, p: write(t, p / "x.csv", units={"normal force": "um"}), "um"),
        (
            lambda t, p: write(Trace(TIME, {"g": Channel(TIME)}), p / "x.csv", units={"g": "N"}),
            "be known to be converted",
        ),
        (lambda t, p: write(t, p / "nowhere" / "x.csv"), "folder that exists"),
        (lambda t, p: Recorder(rate="0 Hz"), "Recorder.rate must be positive"),
        (lambda t, p: Recorder(rate="1 kHz", bits=40), "Recorder.bits"),
        # It would add the mean to a signal that has it.
        (lambda t, p: Accelerometer(bandwidth=1e3, mean=7, high_pass=0), "high_pass must be posit"),
        (lambda t, p: Recorder(rate="1 kHz", cut_off="100 Hz", order=0), "Recorder.order"),
        (lambda t, p: Recorder(rate="1 kHz", order="4"), "order must be a whole number, got '4'"),
        (lambda t, p: Recorder(rate="1 kHz", bits=16.5), "bits must be a whole number, got 16.5"),
        (lambda t, p: Recorder(rate="1 kHz", ranges={"F": 3}), "ranges.* must be a tuple, got 3"),
        (lambda t, p: Tribometer(sensors={}, recorder=None), "must be a Recorder, got None"),
        (
            lambda t, p: channel_gain(Tribometer(sensors={}, recorder=Recorder(rate=1)), "g", 3.0),
            "channel must be one of .*, got 'g'",
        ),
        (lambda t, p: recorded(Recorder(rate="50 kHz")), "at least as fine"),
        (lambda t, p: recorded(Recorder(rate=1e3, ranges={"normal force": (8, 0)})), "must rise"),
    ],
)
def test_bad_input_is_named(laboratory, tmp_path, act, message) -> None:
    with pytest.raises(InputError, match=message):
        act(laboratory, tmp_path)


def test_signals_and_sensors_belong_together() -> None:
    tribometer = Tribometer(
        sensors={"normal force": LoadCell(bandwidth=1e3)}, recorder=Recorder(rate=1e3)
    )
    with pytest.raises(InputError, match="must be those of the sensors"):
        tribometer.record(TIME, {"force": load(TIME)})
    with pytest.raises(InputError, match="must be as long as time"):
        tribometer.record(TIME, {"normal force": load(TIME)[:-1]})
    with pytest.raises(InputError, match="evenly spaced"):
        tribometer.record(TIME**2, {"normal force": load(TIME)})
