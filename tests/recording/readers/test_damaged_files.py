"""Damaged files of every format give a recording or one sentence, and no warning of a library.

The suite turns warnings into errors, so that a library's warning fails these tests.
"""

from __future__ import annotations

import gzip
import io
import struct

import h5py
import nptdms
import numpy as np
import pytest
import scipy.io

import asperity as asp
from asperity.errors import InputError
from asperity.recording import read

ROWS = 60
TIME = np.arange(ROWS) / 100
LOAD = 7 + np.round(np.cos(TIME), 4)
SHEAR = 2.8 + np.round(0.1 * np.sin(TIME), 4)


def table(head: str, line: str) -> bytes:
    rows = (line.format(t=t, w=w, f=f) for t, w, f in zip(TIME, LOAD, SHEAR, strict=True))
    return (head + "".join(rows)).encode()


def stamps() -> bytes:
    rows = (
        f"2024-03-0{1 + i // 40} 10:0{i % 10}:{i:02d}.5,{w:.4f},{f:.4f}\n"
        for i, (w, f) in enumerate(zip(LOAD, SHEAR, strict=True))
    )
    return ("time,W (N),F (N)\n" + "".join(rows)).encode()


def durations() -> bytes:
    rows = (f"{i} S;{w:.4f};{w:.4f}\n" for i, w in enumerate(LOAD))
    return ("time;W (N);F (N)\n" + "".join(rows)).encode()


def matlab(version: str, compressed: bool = False) -> bytes:
    file = io.BytesIO()
    content = {"time": TIME, "W": LOAD, "F": SHEAR}
    scipy.io.savemat(file, content, format=version, do_compression=compressed, oned_as="column")
    return file.getvalue()


def hdf5() -> bytes:
    file = io.BytesIO()
    with h5py.File(file, "w") as output:
        for name, values in (("time", TIME), ("W", LOAD), ("F", SHEAR)):
            dataset = output.create_dataset(name, data=values)
            dataset.attrs["units"] = "s" if name == "time" else "N"
    return file.getvalue()


def tdms() -> bytes:
    file = io.BytesIO()
    with nptdms.TdmsWriter(file) as writer:
        waves = {"wf_increment": 0.01, "wf_samples": ROWS}
        writer.write_segment(
            [nptdms.ChannelObject("g", n, v, waves) for n, v in (("W", LOAD), ("F", SHEAR))]
        )
    return file.getvalue()


def look(dtype: str) -> bytes:
    channels = [("Time", "sec", TIME), ("Nor_load", "N", LOAD), ("Shr_load", "N", SHEAR)]
    raw = struct.pack(">20siiif", b"p1", ROWS, len(channels), 0, 0.01)
    for name, unit, values in channels:
        raw += struct.pack(">13s13sf50si", name.encode(), unit.encode(), 1.0, b"none", values.size)
    for _ in range(16 - len(channels)):
        raw += struct.pack(">13s13sf50si", b"no_val", b"no_val", 0.0, b"none", 0)
    return raw + b"".join(values.astype(dtype).tobytes() for _, _, values in channels)


PLAIN = table("time (s),W (N),F (N)\n", "{t:.3f},{w:.4f},{f:.4f}\n")
FILES = {
    "a.csv": PLAIN,
    "german.csv": table("Zeit;Auflast;Reibungskraft\ns;N;N\n", "{t};{w};{f}\n").replace(b".", b","),
    "blanks.txt": table("# t W F\n", "  {t:.3f} {w:.4f} {f:.4f}\n"),
    "quoted.csv": table('"time","W","F"\n', '"{t:.3f}","{w:.4f}","{f:.4f}"\n'),
    "stamps.csv": stamps(),
    "durations.csv": durations(),
    "wide.csv": PLAIN.decode().encode("utf-16"),
    "packed.csv": gzip.compress(PLAIN, mtime=0),
    "five.mat": matlab("5"),
    "packed.mat": matlab("5", compressed=True),
    "four.mat": matlab("4"),
    "a.h5": hdf5(),
    "a.tdms": tdms(),
    "look4": look(">f4"),
    "look8": look("<f8"),
}


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """The content with some bytes changed, a piece left out or doubled, or the end cut off."""
    broken = bytearray(content)
    for at in rng.integers(0, len(broken), rng.integers(1, 6)):
        # Half of the damage is in the beginning, where headers are.
        place = at if rng.random() < 0.5 else at % 200
        broken[place] = rng.choice([0, 10, 27, 34, 44, 127, 255, broken[place] ^ 1 << 6])
    if rng.random() < 0.3:
        at, length = rng.integers(0, len(broken)), rng.integers(1, 40)
        broken[at : at + length] = broken[at : at + length] * int(rng.integers(0, 3))
    if rng.random() < 0.4:
        broken = broken[: rng.integers(1, len(broken) + 1)]
    return bytes(broken)


@pytest.mark.parametrize("name", FILES)
def test_a_damaged_file_is_a_recording_or_one_sentence(tmp_path, name):
    rng = np.random.default_rng([*name.encode()])
    path = tmp_path / name
    for _ in range(20):
        path.write_bytes(damaged(FILES[name], rng) or b"\0")
        try:
            trace = read(path)
        except InputError as error:
            texts = [str(error)]
        else:
            texts = [str(finding) for finding in trace.findings] + list(trace.channels)
        for text in texts:
            assert text.isprintable(), text
            assert len(text) < 1400


@pytest.mark.parametrize("name", [n for n in FILES if n != "durations.csv"])
def test_the_undamaged_files_are_read(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(FILES[name])
    trace = read(path)
    assert len(trace) == ROWS
    grave = [f for f in trace.findings if f.severity == "error"]
    assert not [f for f in grave if f.name != "backward time"]
    assert np.allclose(trace.channel("W").values, LOAD, rtol=1e-6)


def test_json_and_html_are_refused_by_name(tmp_path):
    for name, text in (
        ("a.json", '[{"t": 1, "F": 2.5}]'),
        ("b.json", '{"time": [' + "1.0, " * 60_000 + "2.0]}"),
        ("c.json", "[" + "1.5, " * 60_000 + "2.0]"),
        ("d.html", "<!DOCTYPE html><table><tr><td>1</td><td>2</td></tr></table>"),
    ):
        path = tmp_path / name
        path.write_text(text)
        with pytest.raises(InputError, match=r"which is (JSON|XML or HTML); save it as CSV"):
            read(path)


def test_headings_in_brackets_are_not_taken_for_json(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(table("[s], [N], [kN]\n", "{t:.3f},{w:.4f},{f:.4f}\n"))
    assert len(read(path, columns={"time": 0})) == ROWS


def test_a_mismatched_heading_is_named_where_a_column_is_not_found(tmp_path):
    """The mismatch of names and columns may be why the load is not found."""
    rows = "\n".join(f"{k / 100},{k % 7},{k % 5},1" for k in range(ROWS))
    path = tmp_path / "rig.csv"
    path.write_text(f"time (s),slip (um),F (N)\n{rows}\n")
    with pytest.raises(InputError, match="heading has 3 names for 4 columns"):
        read(path).channel("W")
    with pytest.raises(InputError, match="heading has 3 names for 4 columns"):
        read(path, columns={"W": "Fn"})


def hdf5_of(path, **arrays):
    with h5py.File(path, "w") as output:
        for name, values in arrays.items():
            output[name] = values
    return path


def test_complex_numbers_are_left_out_by_name(tmp_path):
    """A load that is missing for no stated reason sends the user astray."""
    arrays = {"time": TIME, "W": LOAD + 0j, "F": SHEAR, "on": SHEAR > 2.85}
    scipy.io.savemat(tmp_path / "a.mat", arrays)
    for path in (hdf5_of(tmp_path / "a.h5", **arrays), tmp_path / "a.mat"):
        trace = read(path)
        assert set(trace.channels) == {"F", "on"}
        (left_out,) = [f for f in trace.findings if f.name == "text column"]
        assert left_out.sentence == "'W' holds text or complex numbers, and was left out."
        np.testing.assert_array_equal(trace.channel("on").values, SHEAR > 2.85)


def test_values_that_were_never_written_are_not_created(tmp_path):
    """80 TB of fill values in a file of some kilobytes."""
    path = hdf5_of(tmp_path / "a.h5", time=TIME, F=SHEAR)
    with h5py.File(path, "a") as output:
        output.create_dataset("W", (10**13,), "f8", chunks=(1000,))
    with pytest.raises(InputError, match="whose 'W' has 10000000000000 values; remove"):
        read(path)


@pytest.mark.parametrize("interval", [-0.01, float("nan"), float("inf"), "x"])
def test_an_interval_that_is_none_is_the_users_to_give(tmp_path, interval):
    path = tmp_path / "a.tdms"
    wave = {"wf_increment": interval}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [nptdms.ChannelObject("g", n, v, wave) for n, v in (("W", LOAD), ("F", SHEAR))]
        )
    with pytest.raises(InputError, match="give the sampling rate"):
        read(path)
    assert read(path, rate="100 Hz").time[-1] == pytest.approx((ROWS - 1) / 100)


@pytest.mark.parametrize("rate", [1e-320, 0.0, -1.0])
def test_a_rate_without_an_interval_is_none(tmp_path, rate):
    path = hdf5_of(tmp_path / "a.h5", W=LOAD, F=SHEAR, fs=rate)
    with pytest.raises(InputError, match="give the sampling rate"):
        read(path)


def test_infinite_times_and_loads_of_both_signs_are_refused_without_a_warning(tmp_path):
    """Differences and sums of infinities are no numbers; warnings fail the suite."""
    path = hdf5_of(tmp_path / "a.h5", W=LOAD, F=SHEAR, dt=1e308)
    with pytest.raises(InputError, match="'time' holds a number in 2 rows"):
        asp.measure(read(path))
    huge = np.where(np.arange(ROWS) % 2, 1e308, -1e308)
    path = hdf5_of(tmp_path / "b.h5", time=TIME, W=huge, F=SHEAR)
    with pytest.raises(InputError, match=r"1e\+308 as the largest of 'W'"):
        asp.measure(read(path), modulated=True)
