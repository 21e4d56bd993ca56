"""Measured points on the figures: their file, their verdict, and a verdict that can be negative."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from asperity.errors import InputError
from asperity.figures.style import style
from asperity.ledger.points import (
    NUMBERS,
    TEXTS,
    check_names,
    comparisons,
    draw_points,
    read_points,
    with_curves,
)
from asperity_papers.bureau2000.curves import WORDS
from asperity_papers.bureau2000.figures import CURVES

pytestmark = pytest.mark.slow

ARTIFICIAL = Path(__file__).parents[3] / "examples" / "artificial_points.csv"
OBSERVABLES = {name: WORDS.figures[name].observables for name in CURVES}
ROW = {
    "figure": "figure-02",
    "observable": "delta_mu",
    "series": "1 um/s",
    "x": "0.5",
    "y": "-0.1",
    "y_err": "0.002",
    "source": "artificial",
}

HEADING = (*TEXTS, *NUMBERS)


@pytest.fixture(scope="module")
def figures(figures):
    """Those that the artificial points are of."""
    return {name: figures[name] for name in ("figure-02", "figure-03", "figure-04")}


def compared(points, figures):
    tables = [
        with_curves(points[points["figure"] == name], own.data, OBSERVABLES[name], "p.csv")
        for name, own in figures.items()
    ]
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


def moved(path, folder, factor=1.0, wider=1.0):
    """The artificial points with y times a factor, and their errors wider."""
    table = pd.read_csv(path, comment="#", dtype=str)
    table["y"] = table["y"].astype(float) * factor
    table["y_err"] = table["y_err"].astype(float) * wider
    target = folder / "moved.csv"
    table.to_csv(target, index=False)
    return read_points(target)


def test_points_of_the_model_with_known_noise_agree(figures):
    rows = compared(read_points(ARTIFICIAL), figures)
    found = comparisons(rows)
    assert len(rows) == 33
    assert {one.verdict for one in found} == {"agrees"}
    (together,) = (one for one in found if not one.figure)
    assert together.points == 33
    assert together.chi_squared == pytest.approx((rows["residual"] ** 2).sum(), rel=1e-12)
    assert together.p_value == pytest.approx(1 - chi2.cdf(together.chi_squared, 33), rel=1e-9)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_points_that_are_20_percent_off_disagree(figures, tmp_path, factor):
    found = comparisons(compared(moved(ARTIFICIAL, tmp_path, factor), figures))
    assert {one.verdict for one in found} == {"disagrees"}
    assert max(one.p_value for one in found) < 1e-3


@pytest.mark.parametrize("factor", [1.0, 1.2])
def test_errors_too_wide_to_decide(figures, tmp_path, factor):
    found = comparisons(compared(moved(ARTIFICIAL, tmp_path, factor, wider=60), figures))
    assert {one.verdict for one in found} == {"undecided"}


def test_the_test_fails_true_points_as_often_as_it_says(figures):
    """Many draws of noise on one curve: 5 % are beyond the quantile."""
    curve = figures["figure-02"].curve("1 um/s").iloc[20::8]
    rng, draws = np.random.default_rng(1), 2000
    n = len(curve)
    # Each draw is a figure of its own: all are judged in one call.
    rows = pd.DataFrame({"figure": np.repeat(np.arange(draws), n), "observable": "delta_mu",
                         "law": "elasto-plastic", "model": np.tile(curve["delta_mu"], draws),
                         "y_err": 0.002, "residual": rng.standard_normal(n * draws)})  # fmt: skip
    found = comparisons(rows)[:draws]
    assert all(one.points == n for one in found)
    beyond = sum(one.verdict == "disagrees" for one in found)
    assert beyond / draws == pytest.approx(0.05, abs=0.02)


def test_points_are_drawn_where_their_axes_have_them(figures):
    rows = compared(read_points(ARTIFICIAL), figures)
    for name, own in figures.items():
        with style():
            figure = draw(own)
            shown = rows[rows["figure"] == name]
            draw_points(figure, shown, OBSERVABLES[name])
        drawn = sum(len(bars[0].get_xdata()) for axis in figure.axes for bars in axis.containers)
        assert drawn == len(shown)
    # 0.3 to 30 um/s, in um/s.
    with style():
        figure = draw(figures["figure-03"])
        draw_points(figure, rows[rows["figure"] == "figure-03"], OBSERVABLES["figure-03"])
    (bars,) = figure.axes[0].containers
    np.testing.assert_allclose(bars[0].get_xdata(orig=False), [0.3, 3, 30], rtol=1e-12)


def draw(numbers):
    return WORDS.figures[numbers.name].draw(numbers)


def write(folder, **changes):
    path = folder / "points.csv"
    row = ROW | changes
    path.write_text(",".join(row) + "\n" + ",".join(row.values()) + "\n")
    return path


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"y": "much"}, "points.csv, row 1 must have a number in column y, got 'much'"),
        ({"y": "nan"}, "points.csv, y must be finite, got nan"),
        ({"y_err": "0"}, "points.csv, row 1: y_err must be positive, got 0"),
        ({"y_err": "-1"}, "points.csv, row 1: y_err must be positive, got -1"),
        ({"source": ""}, "points.csv, row 1: source must say where the point comes from"),
    ],
)
def test_cells_that_break_a_rule(tmp_path, changes, sentence):
    with pytest.raises(InputError, match=sentence) as refused:
        read_points(write(tmp_path, **changes))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"figure": "figure-2"}, "row 1: figure must be one of figure-02, "),
        ({"observable": "mu3"}, "row 1: observable must be one of delta_mu, got 'mu3'"),
    ],
)
def test_names_that_no_figure_has(tmp_path, changes, sentence):
    points = read_points(write(tmp_path, **changes))
    with pytest.raises(InputError, match=sentence):
        check_names(points, OBSERVABLES, "points.csv")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"series": "2 um/s"}, "series must be one of 1 um/s, 10 um/s, "),
        ({"x": "0.51"}, "x must lie on the curve, from 0 to 0.5 .*, got 0.51"),
        ({"x": "wide"}, "row 1: x must be"),
        ({"figure": "figure-03", "observable": "mean_friction", "series": "eps = 0", "x": "10"},
         "row 1: x must .*unit"),
    ],
)  # fmt: skip
def test_points_that_no_curve_has(figures, tmp_path, changes, sentence):
    points = read_points(write(tmp_path, **changes))
    name = points["figure"].iloc[0]
    with pytest.raises(InputError, match=sentence):
        with_curves(points, figures[name].data, OBSERVABLES[name], "points.csv")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("# only a comment\n", "points.csv must have a heading and a point a row, got no rows"),
        (",".join(HEADING) + "\n", "points.csv must have a heading and a point a row, got no rows"),
        ("figure,x,y\n1,2,3\n", "points.csv must have the columns .* none for y_err, observable"),
    ],
)
def test_files_that_are_no_points(tmp_path, text, sentence):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_points(path)


def test_a_file_that_cannot_be_read(tmp_path):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\xd8")
    for path in (tmp_path, tmp_path / "missing.csv", tmp_path / "binary.csv"):
        with pytest.raises(InputError, match="data must be a CSV that can be read"):
            read_points(path)
