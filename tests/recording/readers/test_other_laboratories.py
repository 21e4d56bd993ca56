"""Unusual texts of recorders, packed texts, and damaged packed and MATLAB files."""

from __future__ import annotations

import gzip
import io
import struct
import tracemalloc

import numpy as np
import pytest
import scipy.io

from asperity.errors import InputError
from asperity.recording import read
from asperity.recording.readers import text as text_reader

ROWS = 60
TIME = np.arange(ROWS) / 1000
LOAD = np.round(7012 + 1700 * np.cos(0.23 * np.arange(ROWS)), 3)
SHEAR = np.round(2806 + 20 * np.cos(0.23 * np.arange(ROWS) + 1), 3)


def rows(stamps, *more, sep=",", load=LOAD, shear=SHEAR, form="{:.3f}"):
    cells = zip(stamps, map(form.format, load), map(form.format, shear), *more, strict=True)
    return "".join(sep.join(row) + "\n" for row in cells)


def seconds(form="{:.4f}"):
    return list(map(form.format, TIME))


def clock(begin=40271.0):
    """Times of day from 11:11:11 on."""
    of_day = [(begin + t) % 86400 for t in TIME]
    return [f"{int(t // 3600):02d}:{int(t % 3600 // 60):02d}:{t % 60:06.3f}" for t in of_day]


NAMES = "Time (s),Normal force (N),Shear force (N)\n"
PLAIN = NAMES + rows(seconds())
LVM = (
    "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tNo\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\nSamples\t60\t60\t\nY_Unit_Label\tNewtons\tNewtons\t\n"
    "X0\t0.0\t0.0\t\nDelta_X\t0.001000\t0.001000\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tNormal Force\tShear Force\tComment\n"
)

#: Content of a file, and the names of its findings; None where the times are tested separately.
TEXTS = {
    "thousands in quotes": (
        NAMES
        + "".join(
            f'{t:.4f},"{w:,.3f}","{f:,.3f}"\n' for t, w, f in zip(TIME, LOAD, SHEAR, strict=True)
        ),
        set(),
    ),
    "thousands in German": (
        "Zeit (s);Normalkraft (N);Reibkraft (N)\n"
        + "".join(
            f"{t:.4f};{w:,.3f};{f:,.3f}\n".translate(str.maketrans(",.", ".,"))
            for t, w, f in zip(TIME, LOAD, SHEAR, strict=True)
        ),
        set(),
    ),
    "LabVIEW without times": (LVM + rows([""] * ROWS, sep="\t"), set()),
    "minutes and seconds": (NAMES + rows([c[3:] for c in clock()]), set()),
    "over midnight": (NAMES + rows(clock(begin=86399.97)), set()),
    "American dates": (NAMES + rows([f"5/2/2019 {c}" for c in clock()]), set()),
    "days that can be months": (
        NAMES + rows([f"{'01' if i < 30 else '02'}.02.2019 {c}" for i, c in enumerate(clock())]),
        None,
    ),
    "days and hours between tabs": (
        NAMES.replace(",", "\t") + rows([f"2019-05-02 {c}" for c in clock()], sep="\t"),
        set(),
    ),
    "American afternoon": (NAMES + rows([f"05/02/2019 {c} PM" for c in clock()]), set()),
    "German dates": (
        "Datum;Normalkraft (N);Reibkraft (N)\n"
        + rows([f"02-05-2019 {c}" for c in clock()], sep=";").replace(".", ","),
        set(),
    ),
    "headings again": (
        NAMES
        + "".join(rows(seconds()).splitlines(True)[:30])
        + NAMES
        + "".join(rows(seconds()).splitlines(True)[30:]),
        {"text row"},
    ),
    "remarks below": (PLAIN + "\nEnd of test\nOperator: me\n", {"text row"}),
    "types below the names": (
        "Time;Normal force;Shear force\ns;N;N\nfloat;float;float\n" + rows(seconds(), sep=";"),
        set(),
    ),
    "names in single quotes": (
        "'Time (s)','Normal force (N)','Shear force (N)'\n" + rows(seconds()),
        set(),
    ),
    "a long header": ("Setting: some words and a value\n" * 4000 + PLAIN, set()),
    "axial force": (PLAIN.replace("Normal force", "Axial Force"), set()),
    "UTF-16 without its mark": (PLAIN.encode("utf-16-le"), set()),
    "UTF-16 of the other order": (PLAIN.encode("utf-16-be"), set()),
    "gzip": (gzip.compress(PLAIN.encode()), set()),
    "gzip in two pieces": (
        gzip.compress(PLAIN[:600].encode()) + gzip.compress(PLAIN[600:].encode()),
        set(),
    ),
}


@pytest.mark.parametrize("text", TEXTS)
def test_texts_of_other_recorders_are_read(written, text):
    content, expected = TEXTS[text]
    trace = read(written(content))
    assert len(trace) == ROWS
    if expected is not None:
        # Times of day are read to a nanosecond.
        assert trace.time == pytest.approx(TIME, abs=2e-9)
        assert {f.name for f in trace.findings} == expected
    assert np.array_equal(trace.channel("W").values, LOAD)
    assert np.array_equal(trace.channel("F").values, SHEAR)


def test_the_order_of_day_and_month_with_the_shorter_recording_is_taken(written):
    # 01.02. and 02.02. are two days of February, or 2 January and 2 February.
    trace = read(written(TEXTS["days that can be months"][0]))
    assert trace.time[-1] == pytest.approx(86400 + TIME[-1], abs=1e-6)
    american = TEXTS["days that can be months"][0].replace(".02.2019", "/2/2019")
    american = american.replace("\n01/2", "\n1/30").replace("\n02/2/2019", "\n1/31/2019")
    trace = read(written(american))
    assert trace.time[-1] == pytest.approx(86400 + TIME[-1], abs=1e-6)


def test_a_recording_across_the_midnight_of_a_twelfth_day_has_all_its_times(written):
    # Half of it would be on 1 December, and the other half on no day.
    stamps = ["12/01/2024 23:59:58", "12/01/2024 23:59:59", "13/01/2024 00:00:00"]
    rows = [f"{stamp},{10 + k},{5 + k}\n" for k, stamp in enumerate(stamps)]
    trace = read(written("Time,Load (N),Shear (N)\n" + "".join(rows)))
    assert trace.time.tolist() == [0, 1, 2]
    assert trace.provenance["time"].endswith("2024-01-12 23:59:58")


@pytest.mark.parametrize("date", ["2024-10-{}", "{}.10.2024", "10/{}/2024"])
@pytest.mark.parametrize("clocks", [("10:00:00", "13:00:00"), ("10:00:00 AM", "01:00:00 PM")])
def test_times_of_day_belong_to_the_dates_next_to_them(written, date, clocks):
    # A pause of two days and three hours.
    rows = [f"{date.format(27)},{clocks[0]},10,5\n", f"{date.format(29)},{clocks[1]},11,6\n"]
    trace = read(written("Date,Time,Load (N),Shear (N)\n" + "".join(rows)))
    assert trace.time.tolist() == [0, 2 * 86400 + 3 * 3600]
    assert trace.findings == ()
    assert list(trace.channels) == ["Load", "Shear"]


def test_one_date_in_all_rows_is_that_of_the_beginning(written):
    text = "Date,Time,Load (N),Shear (N)\n12.03.2024,23:59:59,10,5\n12.03.2024,00:00:01,11,6\n"
    assert read(written(text)).time.tolist() == [0, 2]


@pytest.mark.parametrize("part", [0.01, 0.6])
def test_gzip_that_is_cut_is_refused(written, part):
    packed = gzip.compress(PLAIN.encode())
    with pytest.raises(InputError, match=r"must be a whole file of format 'text'.*may be cut"):
        read(written(packed[: max(3, int(part * len(packed)))]))


@pytest.mark.parametrize("at", [-6, -2, 40])
def test_gzip_that_is_damaged_is_refused(written, at):
    packed = bytearray(gzip.compress(PLAIN.encode()))
    packed[at] ^= 1
    with pytest.raises(InputError, match=r"must be a whole file of format 'text'.*or damaged"):
        read(written(bytes(packed)))


def test_gzip_that_unpacks_to_too_much_is_refused_early(tmp_path, monkeypatch):
    limit = 2**22
    monkeypatch.setattr(text_reader, "LARGEST", limit)
    row = b"1.5,2.5,3.5\n"
    for size, members in ((limit, 1), (limit + len(row), 1), (2**26, 500)):
        packed = gzip.compress(row * (size // len(row) // members)) * members
        path = tmp_path / "a.csv.gz"
        path.write_bytes(packed)
        tracemalloc.start()
        try:
            if size <= limit:
                assert len(read(path, rate="1 kHz")) == size // len(row)
                continue
            with pytest.raises(InputError, match=r"must unpack to at most 4 MB.*'a.csv.gz'"):
                read(path, rate="1 kHz")
            # A piece unpacks to up to a thousand times its size.
            assert tracemalloc.get_traced_memory()[1] < 16 * limit
        finally:
            tracemalloc.stop()


def test_a_packed_binary_format_is_refused_with_a_remedy(written):
    with pytest.raises(InputError, match=r"must hold a text if it is packed.*; unpack it"):
        read(written(gzip.compress(matlab()), "run.mat.gz"))


@pytest.mark.parametrize("head", [b"PK\x03\x04", b"BZh91AY", b"\xfd7zXZ\0", b"7z\xbc\xaf\x27\x1c"])
def test_archives_are_refused_with_a_remedy(written, head):
    with pytest.raises(InputError, match="unpack it, or save the sheet as CSV"):
        read(written(head + bytes(range(256))))


def test_a_cut_in_a_quoted_number_leaves_its_row_out(written):
    quoted = NAMES + "".join(
        f'"{t:.4f}","{w:.3f}","{f:.3f}"\n' for t, w, f in zip(TIME, LOAD, SHEAR, strict=True)
    )
    length = len('"0.0590","1234.567","1234.567"\n')
    for lost in range(1, length):
        trace = read(written(quoted[:-lost]))
        kept = len(trace)
        assert np.array_equal(trace.channel("F").values, SHEAR[:kept])
        # A row without its line end only is whole.
        assert kept == ROWS - 1 + (lost == 1)
        assert ("truncated" in {f.name for f in trace.findings}) == (lost > 1)


def test_a_quote_without_end_is_refused(written):
    lines = PLAIN.splitlines(True)
    lines[7] = '"' + lines[7]
    with pytest.raises(InputError, match="EOF inside string starting at row"):
        read(written("".join(lines)))


def matlab():
    """A file that is not compressed, with numbers, texts, a cell and a struct."""
    file = io.BytesIO()
    content = {"time": TIME, "W": LOAD, "F": SHEAR, "units": {"W": "N", "F": "N", "time": "s"}}
    content |= {"notes": np.array(["a", "bb"], dtype=object), "z": TIME * 1j, "n": np.int16([1, 2])}
    scipy.io.savemat(file, content)
    return file.getvalue()


def test_damaged_elements_of_a_matlab_file_are_refused(written):
    raw = matlab()
    trace = read(written(raw, "whole.mat"))
    assert np.array_equal(trace.channel("W").values, LOAD)
    # Type and size of the first variable's numbers follow 128 bytes of the header of the file, 8 of
    # that of the variable, 16 of flags, 16 of dimensions and 8 of a short name.
    place = 128 + 8 + 16 + 16 + 8
    assert struct.unpack_from("<II", raw, place) == (9, 8 * ROWS)
    for kind, size in ((99, 8 * ROWS), (9, 8 * ROWS - 8), (7, 8 * ROWS), (9, 1 << 31)):
        broken = bytearray(raw)
        struct.pack_into("<II", broken, place, kind, size)
        with pytest.raises(InputError, match="cut or damaged"):
            read(written(bytes(broken), "broken.mat"))
