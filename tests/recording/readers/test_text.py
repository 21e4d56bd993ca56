"""Tables of text as laboratories write them: their numbers are read, or the defect is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.recording import read


def table(planted, sep=",", decimal=".", end="\n", last="", scale=(1, 1, 1)):
    rows = []
    for row in zip(*planted, strict=True):
        cells = [
            f"{value * s:.6f}".replace(".", decimal) for value, s in zip(row, scale, strict=True)
        ]
        rows.append(sep.join(cells) + last)
    return end.join(rows) + end


def names(trace):
    return [f.name for f in trace.findings]


HEADS = {
    "brackets": "Time (s),Load [N],Shear force {N}\n",
    "slash": "t/s,W/N,F/N\n",
    "suffix": "time_s,W_N,F_N\n",
    "comma": '"Time, s","Load, N","Shear, N"\n',
    "in": "Time in s,Normal load in N,Shear force in N\n",
    "unit row": "Time,Normal force,Shear force\ns,N,N\n",
    "unit row in brackets": "Time,Load,Shear\n(s),[N],[N]\n",
    "words": "Time (sec),Load (Newton),Shear (newtons)\n",
    "comment": "# time_s,load_N,shear_N\n",
    "percent": "% rig 3\n% time [s],load [N],shear [N]\n",
    "preamble": "Rig: BRAVA\nOperator,somebody\n\nTime (s),Load (N),Shear (N)\n",
    "comment above": "# recorded on a Monday, by hand\ntime_s,W_N,F_N\n",
    "quoted": '"Time (s)","Load (N)","Shear (N)"\n',
    "blanks": "  Time (s) , Load (N) , Shear (N) \n",
}


@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS.keys())
def test_names_and_units_are_read_from_headings(written, planted, head):
    trace = read(written(head + table(planted)))
    assert trace.findings == ()
    assert np.array_equal(trace.time, planted.time)
    for role in ("W", "F"):
        channel = trace.channel(role)
        assert np.array_equal(channel.values, getattr(planted, role))
        assert (channel.kind, channel.unit) == ("force", "N")
    assert trace.sample_rate == pytest.approx(1000, rel=1e-12)


LAYOUTS = {
    "tab": ("\t", "."),
    "semicolon": (";", "."),
    "semicolon, decimal comma": (";", ","),
    "tab, decimal comma": ("\t", ","),
    "bar": ("|", "."),
    "blanks": ("   ", "."),
    "blanks, decimal comma": ("  ", ","),
    "comma and blank": (", ", "."),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_separators_decimals_and_line_ends_are_recognised(written, planted, layout):
    (sep, decimal), at = LAYOUTS[layout], [*LAYOUTS].index(layout)
    end = ("\n", "\r\n", "\r")[at % 3]
    head = sep.join(["Time (s)", "Load (kN)", "Shear (mN)"]) + end
    scale = (1, 1e-3, 1e3)
    trace = read(written(head + table(planted, sep, decimal, end, scale=scale)))
    assert trace.findings == ()
    assert np.allclose(trace.time, planted.time, rtol=1e-15, atol=0)
    # Six decimals of a kilonewton end at a millinewton.
    assert np.allclose(trace.channel("W").values, planted.W, rtol=0, atol=0.6e-3)
    assert np.allclose(trace.channel("F").values, planted.F, rtol=1e-14, atol=0)


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le with mark"]
)
def test_encodings_are_recognised(written, planted, encoding):
    text = "Time (s)\tKraft größer [µN]\n" + table(planted[:2], "\t", scale=(1, 1e6))
    if encoding.endswith("mark"):
        path = written(b"\xff\xfe" + text.encode("utf-16-le"))
    else:
        path = written(text, encoding=encoding)
    trace = read(path)
    assert list(trace.channels) == ["Kraft größer"]
    assert np.allclose(trace.channels["Kraft größer"].values, planted.W, rtol=1e-14, atol=0)
    assert trace.findings == ()


def test_a_delimiter_at_the_end_of_every_line_makes_no_column(written, planted):
    for head in ("time_s;W_N;F_N;\n", "time_s;W_N;F_N\n"):
        trace = read(written(head + table(planted, ";", last=";")))
        assert list(trace.channels) == ["W", "F"]
        assert trace.findings == ()


def test_a_named_column_may_be_empty(written, planted):
    trace = read(written("time_s;W_N;F_N;T_K\n" + table(planted, ";", last=";")))
    assert list(trace.channels) == ["W", "F", "T"]
    assert names(trace) == ["missing values"]


def test_without_a_header_the_first_column_is_time_with_a_finding(written, planted):
    path = written(table(planted, "\t"))
    trace = read(path)
    assert list(trace.channels) == ["column 1", "column 2"]
    assert names(trace) == ["no header", "unknown unit", "unknown unit", "unknown unit"]
    assert np.array_equal(trace.time, planted.time)
    chosen = read(
        path,
        columns={"time": 0, "load": 1, "F": "column 2"},
        units={"time": "ms", "W": "N", "column 2": "kN"},
    )
    assert chosen.findings == ()
    assert np.allclose(chosen.time, planted.time / 1000, rtol=1e-15)
    assert np.array_equal(chosen.channel("W").values, planted.W)
    assert np.array_equal(chosen.channel("force").values, planted.F * 1000)


def test_without_a_header_a_first_column_that_falls_is_refused(written):
    path = written("3,1\n2,1\n1,2\n")
    with pytest.raises(InputError, match=r"columns\['time'\] must be a column.*rate='10 kHz'"):
        read(path)
    trace = read(path, rate="2 Hz")
    assert np.array_equal(trace.time, [0, 0.5, 1])


def test_the_text_of_xlook_is_read(written, planted):
    """Rows are numbered; headings of fixed width have units and counts of records below them."""
    head = "number of records = 400\n        col 1       col 2       col 3\n"
    head += "     " + "".join(f"{name:>12}" for name in ("LP_disp", "Shr_stress", "Time")) + "\n"
    head += "     " + "".join(f"{unit:>12}" for unit in ("micron", "MPa", "sec")) + "\n"
    head += "     " + "".join(f"{'400recs':>12}" for _ in range(3)) + "\n"
    body = "".join(
        f"{i:>5}{w:>12.6f}{f:>12.6f}{t:>12.6f}\n"
        for i, (t, w, f) in enumerate(zip(*planted, strict=True))
    )
    trace = read(written(head + body, name="p001_data.txt"))
    assert np.array_equal(trace.time, planted.time)
    assert np.allclose(trace.channel("displacement").values, planted.W * 1e-6, rtol=1e-15)
    assert np.allclose(trace.channel("F").values, planted.F * 1e6, rtol=1e-15)


@pytest.mark.parametrize(
    ("stamp", "step"),
    [
        (lambda i: f"2024-02-29 23:59:{59 + i / 100:09.6f}" if i < 100 else None, 0.01),
        (lambda i: f"2024-02-29T12:00:{i / 100:09.6f}", 0.01),
        (lambda i: f"00:{i // 60:02d}:{i % 60:02d}.250", 1.0),
    ],
    ids=["date and time", "ISO", "clock"],
)
def test_dates_become_seconds_since_the_first(written, stamp, step):
    rows = [f"{stamp(i)},{i}.5\n" for i in range(50)]
    trace = read(written("Time,W (N)\n" + "".join(rows)))
    assert np.allclose(trace.time, np.arange(50) * step, atol=1e-9)


def test_a_column_of_words_is_left_out_and_named(written, planted):
    body = table(planted, last=",sliding")
    trace = read(written("time_s,W_N,F_N,phase\n" + body))
    assert names(trace) == ["text column"]
    assert list(trace.channels) == ["W", "F"]


def test_missing_cells_and_words_among_numbers_are_named(written, planted):
    lines = table(planted).splitlines()
    lines[7] = "0.007000,,2.8"
    lines[9] = "0.009000,NaN,2.8"
    lines[11] = "0.011000,overload,2.8"
    trace = read(written("time_s,W_N,F_N\n" + "\n".join(lines) + "\n"))
    assert names(trace) == ["text in numbers", "missing values"]
    text, nan = trace.findings
    assert (text.number, nan.number) == (1, 3)
    assert "'overload' in row 11" in text.sentence
    assert "row 7" in nan.where
    assert np.array_equal(np.flatnonzero(np.isnan(trace.channel("W").values)), [7, 9, 11])


@pytest.mark.parametrize("cell", ["overload", "(600.0)", "1 001.68"])
def test_words_in_the_first_rows_are_missing_values(written, planted, cell):
    lines = table(planted).splitlines()
    lines[0] = f"0.000000,{cell},2.8"
    lines[1] = f"0.001000,{cell},2.8"
    trace = read(written("time_s,W_N,F_N\n" + "\n".join(lines) + "\n"))
    assert names(trace) == ["text in numbers", "missing values"]
    assert np.array_equal(trace.time, planted.time)
    assert np.array_equal(np.flatnonzero(np.isnan(trace.channel("W").values)), [0, 1])


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("0,007;overload;2,8", ["text in numbers", "missing values"]),
        ("0,007;1.234,5;2,8", ["text in numbers", "missing values"]),
        ("0,007;1.234;2,8", ["text in numbers", "missing values"]),
        ("end of part one;;", ["text row", "gap"]),
    ],
)
def test_words_among_numbers_with_decimal_commas_are_named(written, planted, row, expected):
    lines = table(planted, ";", ",").splitlines()
    lines[7] = row
    trace = read(written("time_s;W_N;F_N\n" + "\n".join(lines) + "\n"))
    assert names(trace) == expected
    assert np.array_equal(trace.channel("W").values[:7], planted.W[:7])


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        ("time_s,W_N,F_N", ["text row"]),
        ("time_s,F_N,W_N", ["text row", "heading mismatch"]),
        ("time (ms),W_N,F_N", ["text row", "heading mismatch"]),
        ("second,part,here", ["text row"]),
    ],
)
def test_another_heading_between_the_rows_is_named(written, planted, second, expected):
    lines = table(planted).splitlines()
    body = "\n".join([*lines[:200], second, *lines[200:]])
    assert names(read(written(f"time_s,W_N,F_N\n{body}\n"))) == expected


def test_rows_with_too_many_cells_are_named(written, planted):
    lines = table(planted).splitlines()
    lines[5] += ",9"
    trace = read(written("time_s,W_N,F_N\n" + "\n".join(lines) + "\n"))
    assert names(trace) == ["malformed row", "gap"]
    assert len(trace) == len(planted.time) - 1


@pytest.mark.parametrize("behind", ["comma", "cell", "row", "point"])
def test_a_cut_in_the_middle_is_named_and_the_whole_rows_are_right(written, planted, behind):
    whole = "time_s,W_N,F_N\n" + table(planted)
    start = whole.index("0.200000,")
    ends = {
        "comma": start + len("0.200000,"),
        "cell": start + len("0.200000,8.5"),
        "row": whole.index("\n", start) - 3,
        "point": start + 2,
    }
    trace = read(written(whole[: ends[behind]]))
    assert names(trace) == ["truncated"]
    assert trace.findings[0].severity == "error"
    assert len(trace) == 200
    assert np.array_equal(trace.channel("F").values, planted.F[:200])


def test_a_last_number_of_free_length_without_line_end_is_left_out(written):
    """0.12 may be the beginning of 0.125: the numbers of the other rows differ in length."""
    trace = read(written("time_s,W_N\n0,0.5\n1,0.125\n2,0.25\n3,0.12"))
    assert names(trace)[0] == "truncated"
    assert np.array_equal(trace.channel("W").values, [0.5, 0.125, 0.25])


def test_a_last_number_below_few_rows_without_line_end_is_left_out(written):
    """The last number may be the beginning of 2.825, though the row above has one decimal."""
    trace = read(written("time_s,W_N\n0,2.8\n1,2.8"))
    assert "truncated" in names(trace)
    assert len(trace) == 1


def test_a_missing_line_end_alone_costs_no_row(written, planted):
    trace = read(written("time_s,W_N,F_N\n" + table(planted).rstrip("\n")))
    assert trace.findings == ()
    assert len(trace) == len(planted.time)


def test_empty_bytes_behind_the_last_row_are_named(written, planted):
    text = ("time_s,W_N,F_N\n" + table(planted)).encode() + bytes(4096)
    trace = read(written(text))
    assert names(trace) == ["truncated"]
    assert np.array_equal(trace.channel("F").values, planted.F)


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "must hold data"),
        ("Time (s),Load (N)\n", "must hold a table of numbers"),
        ("once upon a time\nthere was a slider\n", "must hold a table of numbers"),
    ],
)
def test_files_without_numbers_are_refused(written, text, rule):
    with pytest.raises(InputError, match=rf"recording {rule}"):
        read(written(text))


def test_layout_of_the_user_takes_precedence_over_that_of_the_file(written):
    path = written("t;x\n1,5;2\n2,5;4\n")
    assert np.array_equal(read(path, decimal=",", delimiter=";").time, [1.5, 2.5])
    with pytest.raises(InputError, match=r"read.decimal must be"):
        read(path, decimal="·")
    with pytest.raises(InputError, match=r"read.delimiter must be"):
        read(path, delimiter="tabs")


def test_the_text_of_labview_is_read(written, planted):
    """Two headers, units above the names, and the name of a column of comments that is absent."""
    head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\n***End_of_Header***\t\n\t\n"
    head += "Channels\t2\t\nSamples\t400\t400\t\nY_Unit_Label\tNewton\tkN\t\nX0\t0.0\t0.0\t\n"
    head += "***End_of_Header***\t\t\nX_Value\tLoad\tShear\tComment\n"
    trace = read(written(head + table(planted, "\t"), name="a.lvm"))
    assert trace.findings == ()
    assert np.array_equal(trace.time, planted.time)
    assert np.array_equal(trace.channel("W").values, planted.W)
    assert np.array_equal(trace.channel("F").values, planted.F * 1000)


def test_quoted_numbers_under_quoted_units_are_read(written, planted):
    body = table(planted, '","').replace("\n", '"\n"')[:-1]
    text = '"Time ","Normal load","Shear load"\n"(sec)","(N)","(kN)"\n"' + body
    trace = read(written(text))
    assert trace.findings == ()
    assert np.array_equal(trace.channel("F").values, planted.F * 1000)


@pytest.mark.parametrize(
    "head",
    [
        "time,normal load,shear load\ns,N,kN\nclock,cell of the piston,cell of the arm\n",
        "time,normal load,shear load\nclock,cell of the piston,cell of the arm\ns,N,kN\n",
        "AI 0,AI 1,AI 2\ns,N,kN\ntime,normal load,shear load\n",
    ],
)
def test_descriptions_next_to_names_and_units_are_skipped(written, planted, head):
    trace = read(written(head + table(planted)))
    assert trace.findings == ()
    assert np.array_equal(trace.channel("W").values, planted.W)
    assert np.array_equal(trace.channel("F").values, planted.F * 1000)


@pytest.mark.parametrize("number", ["{:.6f}", "{!r}", "{:.5e}", "{:.0f}"])
def test_no_cut_anywhere_gives_a_wrong_number(written, number):
    """A cut at any byte leaves the first rows of the truth."""
    rng = np.random.default_rng(3)
    truth = np.round(rng.normal(size=(8, 3)) * 1000, 3)
    truth[:, 0] = np.arange(8)
    rows = [",".join(number.format(float(v)) for v in row) for row in truth]
    whole = "time_s,W_N,F_N\n" + "\n".join(rows) + "\n"
    shown = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    ends = {i for i, c in enumerate(whole) if c == "\n"}
    for length in range(60, len(whole)):
        trace = read(written(whole[:length]))
        assert np.array_equal(trace.time, shown[: len(trace), 0])
        assert np.array_equal(trace.channel("F").values, shown[: len(trace), 2])
        if length not in ends and length - 1 not in ends:
            assert "truncated" in names(trace), whole[:length][-20:]


@pytest.mark.parametrize(
    "head",
    [
        "Zeit (s);Auflast (N);Reibungskraft (N)",
        "Zeit;Normalkraft;Schubkraft\ns;N;N",
        "temps (s);force normale (N);frottement (N)",
        "tempo [s];carico [N];attrito [N]",
        "Tiempo (s);fuerza normal (N);fuerza de rozamiento (N)",
        "t (s);\u03c3n (Pa);\u03c4 (Pa)",
        "t (s);Last (N);Tau (N)",
        "t (s);Pr\u00fcfkraft Fn (N);Kraft Ft (N)",
    ],
)
def test_names_in_other_languages_and_letters_are_recognised(written, planted, head):
    trace = read(written(head + "\n" + table(planted, ";")))
    assert np.array_equal(trace.channel("W").values, planted.W)
    assert np.array_equal(trace.channel("F").values, planted.F)


def test_a_french_coefficient_of_friction_needs_no_unit(written, planted):
    trace = read(written("temps (s);charge (N);frottement\n" + table(planted, ";")))
    assert trace.channel("friction").kind == "dimensionless"
    assert trace.channel("W").recorded_name == "charge (N)"


def test_quoted_decimal_commas_between_commas_are_read(written, planted):
    rows = table(planted, ";").replace(".", ",").splitlines()
    quoted = "\n".join(",".join(f'"{cell}"' for cell in row.split(";")) for row in rows)
    trace = read(written('"time (s)","W (N)","F (N)"\n' + quoted + "\n"))
    assert np.array_equal(trace.time, planted.time)
    assert np.array_equal(trace.channel("W").values, planted.W)
    assert trace.provenance["decimal"] == ","


@pytest.mark.parametrize(
    ("head", "names", "number"),
    [
        ("time (s),W (N)", ["W", "column 2"], 1),
        ("time (s),W (N),F (N),velocity (m/s),spare", ["W", "F"], 2),
    ],
)
def test_a_mismatch_of_names_and_columns_is_named(written, planted, head, names, number):
    trace = read(written(f"Rig 3, sample 12\n{head}\n" + table(planted, ",")))
    assert list(trace.channels) == names
    assert np.array_equal(trace.channel("W").values, planted.W)
    (finding,) = [f for f in trace.findings if f.name == "heading mismatch"]
    assert (finding.severity, finding.number) == ("warning", number)


def test_a_remark_above_a_table_is_not_taken_for_names(written, planted):
    trace = read(written("Rig 3, sample 12\n" + table(planted, ",")))
    assert list(trace.channels) == ["column 1", "column 2"]


def test_a_first_row_with_surplus_cells_moves_no_column(written, planted):
    text = "time (s),W (N),F (N)\n0.0,1.0,2.0,3.0\n" + table(planted, ",")
    trace = read(written(text))
    assert np.array_equal(trace.channel("W").values, planted.W)
    assert [f.name for f in trace.findings if f.severity == "error"] == ["malformed row"]


def test_a_table_of_400_columns_is_read_with_one_finding(written):
    values = np.round(np.random.default_rng(0).normal(size=(6, 400)), 4)
    values[:, 0] = np.arange(6) / 100
    names = ["time (s)", "W (N)", "F (N)", *(f"channel {i}" for i in range(3, 400))]
    rows = "\n".join(",".join(map(str, row)) for row in values.tolist())
    trace = read(written(",".join(names) + "\n" + rows + "\n"))
    assert len(trace.channels) == 399
    assert np.array_equal(trace.channel("channel 399").values, values[:, -1])
    # One finding describes all columns without a unit.
    (finding,) = [f for f in trace.findings if f.name == "unknown unit"]
    assert finding.number == 397


def test_a_real_file_of_a_triaxial_rig_is_read():
    file = Path(__file__).parents[4] / "shared" / "data" / "liverpool_raw_header_mismatch.txt"
    if not file.is_file():
        pytest.skip("the recordings of other laboratories are not here")
    trace = read(file)
    assert trace.channels["Conf.Press."].unit == "Pa"
    assert trace.channels["Force."].unit == "N"
    (finding,) = [f for f in trace.findings if f.name == "heading mismatch"]
    assert finding.number == 9
