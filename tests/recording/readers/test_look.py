"""LOOK files, written by `struct` after the description of the reader and writer of xlook."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.recording import read


def write_look(path, channels, slots, dtype, *, elements=None, sweep=0, dtime=0.5):
    """Header big-endian with `slots` channels, then column after column in `dtype`."""
    rows = max(len(values) for _, _, values in channels)
    raw = struct.pack(">20siiif", b"p655 intact", rows, len(channels), sweep, dtime)
    for i in range(slots):
        if i < len(channels):
            name, unit, values = channels[i]
            count = len(values) if elements is None else elements
            raw += struct.pack(">13s13sf50si", name.encode(), unit.encode(), 1.0, b"none", count)
        else:
            raw += struct.pack(">13s13sf50si", b"no_val", b"no_val", 0.0, b"none", 0)
    for _, _, values in channels:
        raw += np.asarray(values).astype(dtype).tobytes()
    path.write_bytes(raw)
    return path


def experiment(planted):
    return [
        ("LP_disp", "mic", 8500 + 10 * planted.time),
        ("Shr_stress", "MPa", planted.F),
        ("Nor_stress", "MPa", planted.W),
        ("Time", "sec", planted.time),
        ("mu", ".", planted.F / planted.W),
    ]


@pytest.mark.parametrize("dtype", [">f4", "<f8", ">f8", "<f4"])
@pytest.mark.parametrize("slots", [16, 32])
def test_every_size_and_byte_order_is_read(tmp_path, planted, slots, dtype):
    path = write_look(tmp_path / "p655l", experiment(planted), slots, dtype)
    trace = read(path)
    assert [f.name for f in trace.findings] in ([], ["uneven sampling"])
    assert trace.provenance["data"] == dtype
    assert trace.provenance["title"] == "p655 intact"
    precision = 2e-7 if dtype.endswith("4") else 1e-15
    assert np.allclose(trace.time, planted.time, rtol=precision, atol=0)
    expected = {
        "W": planted.W * 1e6,
        "F": planted.F * 1e6,
        "friction": planted.F / planted.W,
        "displacement": (8500 + 10 * planted.time) * 1e-6,
    }
    for role, values in expected.items():
        assert np.allclose(trace.channel(role).values, values, rtol=precision, atol=0), role
    assert trace.channel("W").unit == "Pa"


@pytest.mark.parametrize("dtype", [">f4", "<f8"])
def test_noise_is_told_from_a_wrong_byte_order(tmp_path, dtype):
    rng = np.random.default_rng(0)
    channels = [("noise", "N", rng.normal(size=500)), ("Time", "sec", np.arange(500) / 8)]
    trace = read(write_look(tmp_path / "noise.l", channels, 32, dtype))
    assert np.allclose(trace.channels["noise"].values, channels[0][2], rtol=1e-7)


def test_an_active_channel_without_a_count_is_full(tmp_path, planted):
    """As xlook reads it."""
    path = write_look(tmp_path / "p655l", experiment(planted), 16, ">f4", elements=0)
    assert len(read(path)) == planted.time.size


def test_a_short_channel_is_padded_and_named(tmp_path, planted):
    channels = experiment(planted)
    channels[1] = ("Shr_stress", "MPa", planted.F[:390])
    trace = read(write_look(tmp_path / "p655l", channels, 32, "<f8"))
    assert [f.name for f in trace.findings] == ["short column", "missing values"]
    assert trace.findings[0].number == 10
    assert np.array_equal(np.isnan(trace.channel("F").values), np.arange(400) >= 390)


@pytest.mark.parametrize("part", [0.6, 0.99])
def test_a_file_that_is_cut_is_refused(tmp_path, planted, cut, part):
    path = write_look(tmp_path / "p655l", experiment(planted), 32, "<f8")
    with pytest.raises(InputError, match=r"must be a whole file.* its LOOK header says"):
        read(cut(path, part))


def test_a_cut_within_the_header_is_refused(tmp_path, planted):
    path = write_look(tmp_path / "p655l", experiment(planted), 16, ">f4")
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(InputError, match=r"recording must be"):
        read(path)


def test_a_file_without_time_needs_a_rate(tmp_path, planted):
    channels = [c for c in experiment(planted) if c[0] != "Time"]
    path = write_look(tmp_path / "p655l", channels, 16, ">f4")
    with pytest.raises(InputError, match=r"columns\['time'\] must be a column"):
        read(path)
    assert read(path, rate=1000.0).sample_rate == pytest.approx(1000)


def test_a_group_is_refused(tmp_path, planted):
    path = write_look(tmp_path / "p655l", experiment(planted), 16, ">f4")
    with pytest.raises(InputError, match=r"read\.group must be left out"):
        read(path, group="run 1")


def test_a_damaged_count_does_not_fill_the_memory(tmp_path, planted):
    """The header counts 2e9 records, and the file has 400."""
    path = write_look(tmp_path / "p655l", experiment(planted), 16, ">f4")
    raw = bytearray(path.read_bytes())
    raw[20:24] = struct.pack(">i", 2_000_000_000)
    raw[36 + 80 : 36 + 84] = struct.pack(">i", 2_000_000_000)
    path.write_bytes(raw)
    with pytest.raises(InputError, match="must be a whole file"):
        read(path)


def test_a_header_of_32_slots_that_is_cut_is_not_read_as_one_of_16(tmp_path, planted):
    # The columns are so short that the last 16 slots would do for the data behind a header of 16.
    short = type(planted)(*(values[:30] for values in planted))
    path = write_look(tmp_path / "p655l", experiment(short), 32, ">f4")
    raw = path.read_bytes()
    for length in range(36 + 16 * 84 + 1, 36 + 32 * 84, 37):
        path.write_bytes(raw[:length])
        with pytest.raises(InputError, match=r"recording must be"):
            read(path, rate="1 kHz")


@pytest.mark.parametrize("unit", ["sec", "n", "no_val", "rec"])
def test_a_time_column_that_counts_samples_is_scaled_by_the_header(tmp_path, planted, unit):
    channels = [
        ("Time", unit, np.arange(planted.time.size)),
        ("Nor_load", "N", planted.W),
        ("Shr_load", "N", planted.F),
    ]
    trace = read(write_look(tmp_path / "p1", channels, 32, "<f8", dtime=1e-3))
    assert np.allclose(trace.time, planted.time, rtol=1e-6)
    assert trace.sample_rate == pytest.approx(1000, rel=1e-6)
    (finding,) = [f for f in trace.findings if f.name == "sample count"]
    assert finding.number == pytest.approx(1e-3)


def test_times_in_seconds_are_not_taken_for_counts(tmp_path, planted):
    trace = read(write_look(tmp_path / "p1", experiment(planted), 32, "<f8", dtime=0.01))
    assert np.array_equal(trace.time, planted.time)
    assert "sample count" not in {f.name for f in trace.findings}
