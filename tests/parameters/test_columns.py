"""Tables as spreadsheets of any language save them."""

import csv

import pytest

from asperity.errors import InputError
from asperity.inference import read_table
from asperity.parameters.columns import read_headed_columns, sheet
from asperity.study.table import run_table

NAMES = ("day", "V", "epsilon", "frequency", "delta_mu", "delta_mu_err")
UNITS = ("", "µm/s", "%", "Hz", "-", "")
ROWS = (("12.03.2024", 1, 10, 120, -0.01, 1e-3), ("13.03.2024", 2.5, 20, 120.5, -0.03, 2e-5))


def written(path, rows, encoding="utf-8", delimiter=",", decimal="."):
    """A CSV with a comment, and with the empty column that spreadsheets leave behind the last."""

    def text(cell):
        return str(cell).replace(".", decimal) if isinstance(cell, float) else str(cell)

    lines = ["# Größe", *(delimiter.join([*map(text, row), ""]) for row in rows)]
    path.write_bytes("".join(f"{line}\r\n" for line in lines).encode(encoding))
    return path


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize(("delimiter", "decimal"), [",.", ";.", ";,", "\t,"])
@pytest.mark.parametrize("below", [False, True])
def test_a_table_of_a_spreadsheet(tmp_path, encoding, delimiter, decimal, below):
    inline = [f"{name} ({unit})" if unit else name for name, unit in zip(NAMES, UNITS, strict=True)]
    heading = [NAMES, UNITS] if below else [inline]
    path = written(tmp_path / "t.csv", [*heading, *ROWS], encoding, delimiter, decimal)
    table = read_table(path)
    assert table.points["V"].tolist() == pytest.approx([1e-6, 2.5e-6], rel=1e-15)
    assert table.points["epsilon"].tolist() == pytest.approx([0.1, 0.2], rel=1e-15)
    assert table.points["frequency"].tolist() == [120, 120.5]
    assert table.values["delta_mu"].tolist() == [-0.01, -0.03]
    assert table.errors["delta_mu"].tolist() == [1e-3, 2e-5]
    assert read_headed_columns(path, ["V"])["V"] == ["1.0 µm/s", "2.5 µm/s"]


def test_an_underscore_in_a_number_is_refused(tmp_path):
    """Python reads a damaged "2.5" as 25."""
    path = written(tmp_path / "t.csv", [NAMES[1:], ("2_5", *ROWS[0][2:])])
    with pytest.raises(InputError, match="in column V, got '2_5'"):
        read_table(path)
    points = tmp_path / "p.csv"
    points.write_text("law,V,epsilon,frequency\nrice-ruina,2_5e-6,0.2,120\n")
    with pytest.raises(InputError, match="in column 'V', got '2_5e-6' in row 1"):
        run_table(points, tmp_path / "out.csv")
    with pytest.raises(InputError, match="a number in column x, got '2_5'"):
        read_headed_columns(written(tmp_path / "h.csv", [("x",), ("2_5",)]), ["x"])


def test_a_row_of_more_cells_than_the_heading_is_refused(tmp_path):
    """The comma of a thousand moves all cells after it."""
    path = tmp_path / "t.csv"
    path.write_text("V,K\n1e-6,2e5\n1,000,2e5\n")
    with pytest.raises(InputError, match="as many cells as the heading, got 3 in row 2"):
        read_headed_columns(path, ["V", "K"])


def test_brackets_within_a_unit_belong_to_it(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("V,eta (N/(m/s))\n1e-6,20\n")
    assert read_headed_columns(path, ["V", "eta"])["eta"] == ["20.0 N/(m/s)"]


def test_commas_next_to_points_are_no_decimal_marks(tmp_path):
    # 1,234 may be a thousand.
    rows = [("V", "W0"), ("0.5", "1,234"), ("0.6", "1,5")]
    path = written(tmp_path / "t.csv", rows, delimiter=";")
    assert not sheet(path, {"V", "W0"}.__contains__).decimal_comma
    with pytest.raises(InputError, match="'1,234'"):
        read_headed_columns(path, ["V", "W0"])


@pytest.mark.parametrize("row", [("1", "2"), ("", ""), ("nan", "x"), ("-", "-")])
def test_a_row_of_numbers_or_of_nothing_is_no_row_of_units(tmp_path, row):
    path = written(tmp_path / "t.csv", [("V", "W0"), row, ("1", "2")])
    assert not sheet(path, {"V", "W0"}.__contains__).units_below


def test_responses_are_written_next_to_the_points_as_they_were_read(tmp_path):
    rows = [("V", "epsilon", "frequency"), ("µm/s", "%", "Hz"), (1.5, 24.0, 120.0)]
    path = written(tmp_path / "in.csv", rows, "cp1252", ";", ",")
    machine = {"mu0": 0.5, "K": 2e5, "W0": 7.0}
    out = tmp_path / "out.csv"
    run_table(path, out, law="amontons", filled=machine)
    with out.open(encoding="utf-8", newline="") as file:
        heading, cells = csv.reader(file, delimiter=";")
    assert heading[:3] == ["V (µm/s)", "epsilon (%)", "frequency (Hz)"]
    assert cells[:3] == ["1.5", "24.0", "120.0"]
    # The force of the null model follows the load.
    assert float(cells[heading.index("mu1")]) == pytest.approx(0.5 * 0.24)
