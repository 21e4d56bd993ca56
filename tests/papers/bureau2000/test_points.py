"""Measured points on the figures: their file, their drawing, and their verdicts."""

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
    """The figures for which there are artificial points."""
    return {name: figures[name] for name in ("figure-02", "figure-03", "figure-04")}


def compared(points, figures):
    tables = [
        with_curves(points[points["figure"] == name], figure.data, OBSERVABLES[name], "p.csv")
        for name, figure in figures.items()
    ]
    return pd.concat([table for table in tables if len(table)], ignore_index=True)


def scaled(path, folder, factor=1.0, wider=1.0):
    """The artificial points with y times `factor` and errors times `wider`."""
    table = pd.read_csv(path, comment="#", dtype=str)
    table["y"] = table["y"].astype(float) * factor
    table["y_err"] = table["y_err"].astype(float) * wider
    target = folder / "scaled.csv"
    table.to_csv(target, index=False)
    return read_points(target)


def test_points_of_the_model_with_known_noise_agree(figures):
    rows = compared(read_points(ARTIFICIAL), figures)
    results = comparisons(rows)
    assert len(rows) == 33
    assert {result.verdict for result in results} == {"agrees"}
    (overall,) = (result for result in results if not result.figure)
    assert overall.points == 33
    assert overall.chi_squared == pytest.approx((rows["residual"] ** 2).sum(), rel=1e-12)
    assert overall.p_value == pytest.approx(1 - chi2.cdf(overall.chi_squared, 33), rel=1e-9)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_points_that_are_20_percent_off_disagree(figures, tmp_path, factor):
    results = comparisons(compared(scaled(ARTIFICIAL, tmp_path, factor), figures))
    assert {result.verdict for result in results} == {"disagrees"}
    assert max(result.p_value for result in results) < 1e-3


@pytest.mark.parametrize("factor", [1.0, 1.2])
def test_points_with_very_large_errors_are_undecided(figures, tmp_path, factor):
    results = comparisons(compared(scaled(ARTIFICIAL, tmp_path, factor, wider=60), figures))
    assert {result.verdict for result in results} == {"undecided"}


def test_true_points_disagree_as_rarely_as_stated(figures):
    """Of many draws of noise on one curve 5 % lie beyond the quantile."""
    curve = figures["figure-02"].curve("1 um/s").iloc[20::8]
    rng, draws = np.random.default_rng(1), 2000
    n = len(curve)
    # Each draw is given as a figure, so that one call tests all of them.
    rows = pd.DataFrame({"figure": np.repeat(np.arange(draws), n), "observable": "delta_mu",
                         "law": "elasto-plastic", "model": np.tile(curve["delta_mu"], draws),
                         "y_err": 0.002, "residual": rng.standard_normal(n * draws)})  # fmt: skip
    results = comparisons(rows)[:draws]
    assert all(result.points == n for result in results)
    beyond = sum(result.verdict == "disagrees" for result in results)
    assert beyond / draws == pytest.approx(0.05, abs=0.02)


def test_points_are_drawn_in_the_units_of_their_axes(figures):
    rows = compared(read_points(ARTIFICIAL), figures)
    for name, numbers in figures.items():
        with style():
            figure = draw(numbers)
            points = rows[rows["figure"] == name]
            draw_points(figure, points, OBSERVABLES[name])
        drawn = sum(len(bars[0].get_xdata()) for axis in figure.axes for bars in axis.containers)
        assert drawn == len(points)
    # The axis of velocities is in um/s.
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
def test_bad_cells_are_refused(tmp_path, changes, sentence):
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
def test_unknown_figures_and_observables_are_refused(tmp_path, changes, sentence):
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
def test_points_off_the_curves_are_refused(figures, tmp_path, changes, sentence):
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
def test_files_without_points_are_refused(tmp_path, text, sentence):
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_points(path)


def test_an_unreadable_file_is_refused(tmp_path):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\xd8")
    for path in (tmp_path, tmp_path / "missing.csv", tmp_path / "binary.csv"):
        with pytest.raises(InputError, match="data must be a CSV that can be read"):
            read_points(path)
