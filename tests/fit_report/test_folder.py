"""The folder of a fit: a self-contained page and a valid material, written as a whole or not."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of

from asperity import Slider, materials, periodic_response
from asperity.errors import InputError, named
from asperity.fit_report import bands, write_comparison, write_report
from asperity.fit_report.folder import document
from asperity.fit_report.pictures import residual_figure, run_figure
from asperity.inference import fit, table_of
from asperity.inference.comparison.compare import judge
from asperity.inference.comparison.evidence import Evidence
from asperity.inference.objective import Residuals
from asperity.orbit import response_function
from asperity.outputs.sections import Section, as_html


@pytest.fixture(scope="module")
def fitted():
    pmma = materials.load("bureau2000")
    # More rows than eight: the programs of tables with 16 rows, which tests of fits use too.
    epsilon = np.linspace(0.1, 0.5, 9)
    slider = Slider(pmma.law("elasto-plastic"), spring=pmma.K, load=pmma.W0)
    exact = periodic_response(slider, velocity=1e-6, epsilon=0.5 * epsilon, frequency=120.0)
    noise = np.random.default_rng(0).normal(size=(2, epsilon.size))
    columns = {"V": 1e-6, "epsilon": epsilon, "frequency": 120.0}
    columns |= {"delta_mu": exact.delta_mu + 1e-3 * noise[0], "delta_mu_err": 1e-3}
    columns |= {"mu1": exact.mu1 + 2e-5 * noise[1], "mu1_err": 2e-5}
    table = table_of(columns, name="<readings>")
    return fit(table, "elasto-plastic", ("lambda", "eps_ratio"), material=pmma)


def test_the_folder_has_page_json_and_material(fitted, tmp_path):
    folder = tmp_path / "report"
    write_report(folder, fitted)
    assert sorted(p.name for p in folder.iterdir()) == ["fit.json", "material.toml", "report.html"]
    estimate = fitted.parameters["lambda"]
    material = materials.load(folder / "material.toml")
    assert material.lambda_ == estimate.value
    assert material["lambda"].si_uncertainty == pytest.approx(estimate.se)
    assert material["A"].kind == "assumed"
    assert material.law("elasto-plastic").lambda_ == estimate.value
    record = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert record["parameters"]["lambda"]["value"] == estimate.value
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "&lt;readings&gt;" in page
    # The table of the data is in SI.
    assert "V (m/s)<" in page
    assert "frequency (Hz)<" in page
    (shown,) = re.findall(r"<td>lambda</td><td>([\d.]+)</td>.*<td>nm</td>", page)
    assert 1e-9 * float(shown) == pytest.approx(estimate.value, abs=estimate.se / 10)
    # Nothing is fetched: no address outside the page in any attribute that loads.
    assert re.findall(r'(?:src|href)="(?!#)[^"]*"', page) == []
    assert "@import" not in page


def test_a_folder_that_cannot_be_written_stays_as_it_was(fitted, tmp_path):
    (tmp_path / "report").write_text("a file", encoding="utf-8")
    with pytest.raises(ValueError, match="folder"):
        write_report(tmp_path / "report", fitted)
    assert (tmp_path / "report").read_text(encoding="utf-8") == "a file"


def test_each_frequency_has_a_curve_that_reaches_its_readings(monkeypatch):
    # The fast method finds the orbits of neither. A curve of as many amplitudes as there are rows,
    # those of the readings among them, has their programs.
    each = 4
    monkeypatch.setattr(bands, "_AMPLITUDES", 2 * each)
    numbers = {"mu0": 0.525, "A": 0.0108, "B": 0.0101, "D0": 3.2e-6, "V0": 1e-6}
    machine = {"K": 9.1e6, "W0": 1290.0}
    frequency = np.repeat([0.3, 3.0], each)
    epsilon = np.tile(np.linspace(0.1, 0.4, each), 2)
    columns = {"V": 4e-5, "epsilon": epsilon, "frequency": frequency}
    exact = response_function("rice-ruina", search="direct")(
        {n: np.broadcast_to(v, 2 * each) for n, v in (numbers | machine | columns).items()}
    )
    columns |= {"mean_friction": exact.mean_friction, "mean_friction_err": 1e-3}
    fixed = {n: v for n, v in (numbers | machine).items() if n != "mu0"}
    # A fit that turns to the search by itself, from the given start.
    fitted = fit(
        table_of(columns), "rice-ruina", ("mu0",), fixed=fixed, start={"mu0": 0.52}, starts=0
    )
    term = fitted.objective.terms[0]
    assert term.searches
    slow, fast = bands.bands_of(fitted, term, None)
    assert [slow.label, fast.label] == ["40 µm/s, 0.3 Hz", "40 µm/s, 3 Hz"]
    for one, rows in ((slow, slice(0, each)), (fast, slice(each, 2 * each))):
        assert np.flatnonzero(one.rows).tolist() == list(range(2 * each))[rows]
        band = one.bands["mean_friction"]
        between = np.interp(epsilon[rows], band.epsilon, band.middle)
        np.testing.assert_allclose(between, exact.mean_friction[rows], atol=2e-3)
        # Nearly without modulation mean friction follows mu0, with it less.
        width = np.ptp([band.low, band.high], axis=0) / fitted.parameters["mu0"].se
        assert width[0] == pytest.approx(3.92, rel=0.25)
        assert (np.diff(width) < 0).all()


def test_rows_that_differ_by_the_noise_of_a_measured_setting_are_one_series():
    noise = 1e-4 * np.array([1.0, -2.0, 0.5, 0.0])
    settings = {"V": np.array([1e-5, 1e-6, 1e-6, 1e-5]), "W0": 7.0 + noise}
    settings |= {"frequency": 120.0 + noise, "epsilon": np.linspace(0.1, 0.4, 4)}
    series = [(label, rows.tolist()) for label, rows in bands._series(settings)]
    slow, fast = [False, True, True, False], [True, False, False, True]
    assert series == [("1 µm/s", slow), ("10 µm/s", fast)]
    settings["W0"] = np.array([3.0, 7.0, 3.0, 3.0]) + noise
    labels = [label for label, _ in bands._series(settings)]
    assert labels == ["1 µm/s, W0 = 3 N", "1 µm/s, W0 = 7 N", "10 µm/s, W0 = 3 N"]


def test_residuals_are_data_less_the_law_at_the_rows_of_the_file():
    residuals = Residuals(
        np.array([2.0, -1.0]), np.zeros((2, 0)), np.array(["mu1", "mu1"]), np.array([0, 1]), 0.0
    )
    axis = residual_figure(residuals, np.array(["row 2", "row 5 of a.csv"])).axes[0]
    (points,) = (line for line in axis.get_lines() if line.get_label() == "mu1")
    assert points.get_ydata().tolist() == [-2.0, 1.0]
    assert [axis.xaxis.get_major_formatter()(x, None) for x in (0, 1, 2)] == ["", "2", "5"]


def nothing_is_fetched(page):
    return not re.findall(r'(?:src|href)="(?!#)[^"]*"', page) and "@import" not in page


def test_a_comparison_has_a_page_of_all_laws(fitted, tmp_path):
    worse = replace(fitted, aicc=fitted.aicc + 50, law="another law")
    compared = judge({"elasto-plastic": fitted, "another law": worse})
    # Not sampled, as of an excluded law.
    compared.laws["another law"] = replace(
        compared.laws["another law"], evidence=Evidence(-12.5, np.nan, np.nan, -12.5, 0, {})
    )
    write_comparison(tmp_path / "report", compared)
    names = sorted(p.name for p in (tmp_path / "report").iterdir())
    assert names == ["another law.toml", "comparison.json", "elasto-plastic.toml", "report.html"]
    record = json.loads((tmp_path / "report" / "comparison.json").read_text(encoding="utf-8"))
    assert record["laws"]["another law"]["excluded"]
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert compared.verdict[:40] in page
    assert "its AICc is 50" in page
    assert "-12.50<" in page
    # The title of the panels.
    assert "1 µm/s" in page
    assert nothing_is_fetched(page)
    # A panel for the drop and one for the harmonic.
    assert page.count("<svg") == 1


def test_a_law_without_free_parameters_has_a_curve_without_a_width(fitted, tmp_path):
    (term,) = fitted.objective.terms
    given = {"material": materials.load("bureau2000"), "fixed": {"eps_ratio": 0.5}}
    bare = fit(term.table, "elasto-plastic", (), bare=True, **given)
    write_comparison(tmp_path / "report", judge({"elasto-plastic": fitted, "as published": bare}))
    assert (tmp_path / "report" / "as published.toml").is_file()
    (series,) = bands.bands_of(bare, bare.objective.terms[0], None)
    band = series.bands["mu1"]
    np.testing.assert_array_equal(band.low, band.high)
    np.testing.assert_allclose(band.middle[-1], term.table.values["mu1"][-1], rtol=0.05)


def test_recordings_are_shown_with_the_motion(tmp_path):
    (run,) = runs_of(CASES["steps"], 1)
    own = fit(run, "rice-ruina", ["A", "B", "D0"], start=TRUE, starts=1)
    # The page has the chosen names, in warnings too; numbers in files have those of friction.
    warned = replace(own, sentences=(f"{named('D0')} is at its bound",))
    assert warned.warnings == ("D0 is at its bound",)
    compared = judge({"rice-ruina": warned, "the same": warned})
    write_report(tmp_path / "fit", warned, names="geophysics")
    write_comparison(tmp_path / "laws", compared, "geophysics")
    for folder in ("fit", "laws"):
        page = (tmp_path / folder / "report.html").read_text(encoding="utf-8")
        assert page.count("<svg") == 1
        assert "AR(" in page
        assert nothing_is_fetched(page)
        assert "<td>D_c</td>" in page
        assert "<td>D0</td>" not in page
        assert "D_c is at its bound" in page
    assert '"D0"' in (tmp_path / "fit" / "fit.json").read_text(encoding="utf-8")
    # A stiffness under a stress is none of a material, whose springs are in N/m.
    material = (tmp_path / "fit" / "material.toml").read_text(encoding="utf-8")
    assert "[numbers.D0]" in material
    assert "[numbers.K]" not in material
    # The time of the recording.
    late = replace(run, origin=3e4)
    figure = run_figure(late, {"rice-ruina": late.friction})
    assert figure.axes[0].lines[0].get_xdata()[0] == 3e4


def test_a_comparison_without_a_fit_is_refused(fitted, tmp_path):
    none = judge({n: replace(fitted, converged=False, message="no orbit") for n in ("a", "b")})
    with pytest.raises(InputError, match="must have a converged fit"):
        write_comparison(tmp_path / "report", none)


def test_a_column_of_notes_wraps_and_one_of_numbers_is_as_wide_as_they_are(chromium, tmp_path):
    names = tuple("abcdefgh")
    numbers = Section("", head=("", *names), rows=(("a", *("+0.10" for _ in names)),))
    notes = Section("", head=("law", "AICc", ""), rows=(("a", "1.0", "a sentence " * 20),))
    (tmp_path / "report.html").write_text(
        document("title", "kicker", "heading", {"Fit": as_html([numbers, notes])}), "utf-8"
    )
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    page.goto((tmp_path / "report.html").as_uri())
    boxes = [
        [c.bounding_box() for c in row.locator("td").all()] for row in page.locator("tr").all()
    ]
    page.close()
    assert boxes[1][-1]["width"] == pytest.approx(boxes[1][1]["width"], abs=1)
    # Two lines or more, within the page.
    assert boxes[3][-1]["height"] > 1.5 * boxes[1][-1]["height"]
    assert boxes[3][-1]["x"] + boxes[3][-1]["width"] <= 1280
