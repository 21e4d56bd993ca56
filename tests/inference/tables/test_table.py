"""Tables with covariances, tables that ``asperity measure`` writes, and outlying rows."""

import json
import math
from functools import partial

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import asperity as asp
from asperity import Slider, periodic_response
from asperity.cli.measure import FileRows
from asperity.errors import InputError
from asperity.inference import HealingTable, LockInTable, fit, read_table, table_of
from asperity.inference.answers import read_data
from asperity.inference.objective import Residuals
from asperity.inference.tables.residuals import outlying_rows, standardised
from asperity.measurement.campaign import run_campaign
from asperity.measurement.record import modulated_record
from asperity.questions.fit import Data, Fit
from asperity.questions.recording import Measurement as Question, Source
from asperity.recording.readers.from_file import read

measure = partial(asp.measure, modulated=True)

V, EPSILON = [1e-6, 1e-6, 1e-5], [0.1, 0.3, 0.3]


def correlated(covariance):
    """Columns of three rows with the given covariance of mean_friction, mu1 and phase1."""
    names = ("mean_friction", "mu1", "phase1")
    columns = {"V": V, "epsilon": EPSILON, "frequency": 120.0}
    columns |= {"mean_friction": [0.48, 0.44, 0.41], "mu1": [2e-4, 4e-4, 6e-4]}
    columns |= {"phase1": [1.2, 1.1, 1.0]}
    for i, first in enumerate(names):
        columns[f"{first}_err"] = np.sqrt(covariance[i, i])
        for j, second in enumerate(names[:i]):
            columns[f"{second}_{first}_cov"] = covariance[i, j]
    return columns


def random_covariance(rng):
    scale = np.array([1e-3, 2e-5, 0.05])
    root = rng.normal(size=(3, 3))
    whole = root @ root.T + 0.3 * np.eye(3)
    spread = np.sqrt(np.diag(whole))
    return whole / np.outer(spread, spread) * np.outer(scale, scale)


def test_the_likelihood_is_the_normal_density_with_the_covariance(pmma):
    covariance = random_covariance(np.random.default_rng(0))
    columns = correlated(covariance)
    result = fit(table_of(columns), "elasto-plastic", ("lambda",), material=pmma)
    law = pmma.law("elasto-plastic", lambda_=result.values["lambda"])
    exact = periodic_response(
        Slider(law, spring=pmma.K, load=pmma.W0), velocity=V, epsilon=EPSILON, frequency=120.0
    )
    rotated = exact.mu1 * np.exp(1j * (exact.phase1 - np.array(columns["phase1"])))
    expected = 0.0
    for row in range(3):
        mu1 = columns["mu1"][row]
        # Components of the harmonic parallel and perpendicular to the measured phasor.
        to_parts = np.diag([1.0, 1.0, mu1])
        expected += multivariate_normal.logpdf(
            [exact.mean_friction[row], rotated[row].real, rotated[row].imag],
            [columns["mean_friction"][row], mu1, 0.0],
            to_parts @ covariance @ to_parts,
        )
    assert result.log_likelihood == pytest.approx(expected, rel=1e-7)


def test_impossible_covariances_are_refused():
    columns = correlated(random_covariance(np.random.default_rng(0)))
    columns["mu1_phase1_cov"] = 1.01 * columns["mu1_err"] * columns["phase1_err"]
    with pytest.raises(InputError) as caught:
        table_of(columns)
    text = str(caught.value)
    assert "positive definite" in text
    assert "row 1" in text
    assert "1.01 between mu1 and phase1" in text
    del columns["phase1"], columns["phase1_err"], columns["mean_friction_phase1_cov"]
    with pytest.raises(InputError, match="no column phase1"):
        table_of(columns)


@pytest.mark.parametrize(
    ("name", "other", "quantity"),
    [
        ("frequency", "f", "frequency"),
        ("epsilon_err", "epsilon_uncertainty", "epsilon_err"),
        ("mu1_phase1_cov", "phase1_mu1_cov", "the covariance of mu1 and phase1"),
        ("mu1_err", "mu1_uncertainty", "mu1_err"),
    ],
)
def test_two_columns_of_one_quantity_are_refused(name, other, quantity):
    columns = {"V": 1e-6, "epsilon": 0.1, "frequency": 120.0, "mu1": 1e-3, "mu1_err": 1e-5}
    columns |= {"phase1": 0.1, "phase1_err": 0.01, name: columns.get(name, 1e-9), other: 2e-9}
    with pytest.raises(InputError, match=f"one column for {quantity}, got '{other}' as a second"):
        table_of(columns)


def mean_and_drop(rng, *, copied):
    velocity = np.repeat([1e-6, 3e-6, 1e-5], 4)
    epsilon = np.tile([0.1, 0.2, 0.3, 0.4], 3)
    drop = -0.3 * epsilon + 1e-3 * rng.normal(size=12)
    steady = 0.5 - 0.013 * np.log(velocity / 1e-6)
    mean = drop + steady if copied else steady - 0.3 * epsilon + 1e-3 * rng.normal(size=12)
    columns = {"V": velocity, "epsilon": epsilon, "frequency": 120.0}
    columns |= {"mean_friction": mean, "mean_friction_err": 1e-3}
    return columns | {"delta_mu": drop, "delta_mu_err": 1e-3}


def test_one_measurement_in_two_columns_counts_once():
    table = table_of(mean_and_drop(np.random.default_rng(1), copied=True))
    assert table.observables == ("mean_friction",)
    assert "they are one measurement; delta_mu is left out" in table.remarks[0]
    table = table_of(mean_and_drop(np.random.default_rng(1), copied=False))
    assert table.observables == ("mean_friction", "delta_mu")
    assert table.remarks == ()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording of two amplitudes in noise, and its samples."""
    rng = np.random.default_rng(0)
    time = np.arange(24_000) * 1e-3
    load, friction = np.full(time.size, 7.0), np.full(time.size, 0.5)
    for epsilon, start in ((0.1, 4.0), (0.2, 14.0)):
        on = (time >= start) & (time < start + 6)
        phi = 2 * np.pi * 40.01 * time
        load = np.where(on, 7 * (1 + epsilon * np.cos(phi)), load)
        friction = friction + on * (0.01 * epsilon * np.cos(phi - 1.2) - 0.2 * epsilon)
    force = 7 * friction + 1e-3 * rng.standard_normal(time.size)
    path = tmp_path_factory.mktemp("lab") / "run.csv"
    header = "time (s),normal force (N),shear force (N)"
    np.savetxt(path, np.stack([time, load, force], axis=1), "%.6f", ",", header=header, comments="")
    return path


def test_the_table_of_a_campaign_is_fitted_as_written(recorded, tmp_path, pmma):
    chosen = {"modulated": True, "frequency": None, "exact_frequency": False, "harmonics": 2}
    chosen |= {"window": None, "whole_periods": False, "detrend": "linear"}
    rows = FileRows(Source(), Question(**chosen))
    broken = tmp_path / "broken.csv"
    broken.write_text("no recording\n", encoding="utf-8")
    run_campaign([broken, recorded], rows, tmp_path / "all.csv", inputs={})
    with pytest.raises(InputError, match="none for V"):
        read_table(tmp_path / "all.csv")
    table = read_table(tmp_path / "all.csv", {"V": "1 um/s"})
    assert table.rows == 2
    assert list(table.row_names) == ["row 2", "row 3"]
    assert list(table.run) == 2 * [str(recorded)]
    assert "row 1" in table.remarks[0]
    np.testing.assert_allclose(table.values["mu1"], [1e-3, 2e-3], atol=1e-4)
    assert ("mean_friction", "delta_mu") in table.covariances
    # The drop is the mean less the steady friction: their noise is correlated.
    assert 0.3 < table.correlations()[0, 0, 1] < 1
    result = fit(table, "elasto-plastic", ("lambda",), material=pmma)
    assert result.converged


def test_a_row_is_named_by_its_place_in_the_file(tmp_path):
    path, head = tmp_path / "table.csv", "kind,V,epsilon,frequency,mu1,mu1_err\n"
    for wrong in ("0.01,-1", "0.01,x", "-2,0.1"):
        rows = f"stick-slip,,,,,\namplitude,1e-6,0.1,120,{wrong}\n"
        path.write_text(head + rows, encoding="utf-8")
        with pytest.raises(InputError, match=" in row 2; "):
            read_table(path)


def test_the_share_of_a_design_is_not_left_out_in_silence(tmp_path):
    path = tmp_path / "table.csv"
    row = "1e-6,0.1,120,0.01,0.001,0.48"
    path.write_text(f"V,epsilon,frequency,mu1,mu1_err,eps_ratio\n{row}\n", encoding="utf-8")
    assert "the column eps_ratio of table.csv is not read" in read_table(path).remarks[0]


def test_units_are_read_from_headings(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(
        "V (um/s);epsilon [%];frequency;mu1;mu1_err;phase1 (deg);phase1_err (mrad);T (C);T (K)\n"
        "2;24;120;0.01;0.001;90;10;20;293\n",
        encoding="utf-8",
    )
    table = read_table(path)
    assert table.points["V"] == pytest.approx([2e-6], rel=1e-12)
    assert table.points["epsilon"] == pytest.approx([0.24], rel=1e-12)
    assert table.values["phase1"] == pytest.approx([np.pi / 2], rel=1e-12)
    assert table.errors["phase1"] == pytest.approx([0.01], rel=1e-12)


def test_a_reading_as_json_is_a_table_of_one_row(recorded, tmp_path):
    record = modulated_record(measure(read(recorded)))
    path = tmp_path / "reading.json"
    path.write_text(json.dumps(record), encoding="utf-8")
    table = read_table(path, {"V": 1e-6})
    assert table.rows == 1
    assert table.values["mu1"] == pytest.approx(record["mu1"])
    assert table.errors["phase1"] == pytest.approx(record["uncertainties"]["phase1"])
    joint = record["observable_covariance"]
    i, j = joint["names"].index("mu1"), joint["names"].index("phase1")
    assert table.covariances["mu1", "phase1"] == pytest.approx(joint["matrix"][i][j])
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="measure --json"):
        read_table(path)


def residuals_of(values, jacobian):
    n = values.size
    return Residuals(values, jacobian, np.full(n, "mu1"), np.arange(n), 0.0)


def test_standardised_residuals_of_a_part_are_those_of_the_fit_of_all():
    random = np.random.default_rng(3)
    # The readings depend on two of four coordinates, on one of these in a single row.
    readings = np.zeros((12, 4))
    readings[:, 0] = random.normal(size=12)
    readings[4, 1] = 5.0
    others = random.normal(size=(30, 4)) * [1.0, 3.0, 1e-3, 1e3]
    values = random.normal(size=42)
    values[4] = 9.0
    together = np.vstack([readings, others])
    left = values - together @ np.linalg.lstsq(together, values, rcond=None)[0]
    hat = together @ np.linalg.pinv(together)
    expected = (left / np.sqrt(1 - np.diag(hat)))[:12]
    residuals = residuals_of(left[:12], readings)
    np.testing.assert_allclose(standardised(residuals, together.T @ together), expected, rtol=1e-6)


def test_coordinates_of_other_data_alone_change_no_outlying_rows():
    random = np.random.default_rng(4)
    # Steep slopes, so that the outlier hardly changes the coordinate.
    slopes = np.full((8, 1), 100.0)
    values = random.normal(size=8)
    values[2] = 30.0
    values -= values.mean()
    alone = outlying_rows(residuals_of(values, slopes))
    assert alone == [2]
    widened = np.hstack([slopes, np.zeros((8, 20))])
    assert outlying_rows(residuals_of(values, widened)) == alone


def test_rows_that_only_just_determine_the_fit_are_not_fitted_without_each_other():
    random = np.random.default_rng(5)
    # Without one of two rows, two readings for two coordinates are left.
    slopes, values = random.normal(size=(4, 2)), 100 * random.normal(size=4)
    residuals = residuals_of(values, slopes)._replace(row=np.array([0, 0, 1, 1]))
    fits = []
    assert outlying_rows(residuals, fits.append) == []
    assert not fits


def test_errors_of_epsilon_count_as_effective_variance(pmma):
    epsilon, spread, error = np.linspace(0.1, 0.4, 6), 2e-3, 2e-4

    def drop(epsilon, A=pmma.A):
        slider = Slider(pmma.law("elasto-plastic", A=A), spring=5e5, load=7.0)
        return periodic_response(slider, velocity=1e-5, epsilon=epsilon, frequency=120.0).delta_mu

    columns = {"V": 1e-5, "epsilon": epsilon, "frequency": 120.0}
    columns |= {"delta_mu": drop(epsilon), "delta_mu_err": error}
    options = {"fixed": {"K": 5e5}, "material": pmma}
    tables = table_of(columns), table_of({**columns, "epsilon_err": spread})
    results = [fit(table, "elasto-plastic", ["A"], **options) for table in tables]
    # Slopes by finite differences.
    of_epsilon = (drop(epsilon + 1e-5) - drop(epsilon - 1e-5)) / 2e-5
    of_A = (drop(epsilon, pmma.A + 1e-6) - drop(epsilon, pmma.A - 1e-6)) / 2e-6
    of_epsilon = (spread * of_epsilon / error) ** 2
    for result, added in zip(results, (0.0, of_epsilon), strict=True):
        expected = error * np.sum(of_A**2 / (1 + added)) ** -0.5
        assert result.parameters["A"].se == pytest.approx(expected, rel=1e-3)
        # They count with other fixed numbers too.
        (term,) = result.objective.terms
        softer = term.with_fixed({**result.objective.fixed, "K": 4e5})
        np.testing.assert_array_equal(softer.weights.matrix, term.weights.matrix)
        assert set(softer.fixed["K"]) == {4e5}
    deviance = np.sum(np.log1p(of_epsilon))
    densities = [f.objective.log_likelihood(f.objective.coordinates(f.values)) for f in results]
    assert 2 * (densities[0] - densities[1]) == pytest.approx(deviance, rel=1e-3)


def test_a_table_without_headings_is_refused(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("1e-6,0.1\n2e-6,0.2\n")
    with pytest.raises(InputError, match="must have the columns V, epsilon, frequency"):
        read_table(path)


@pytest.mark.parametrize(
    ("heading", "row", "kind"),
    [
        ('"","V","epsilon","frequency","mu1","mu1_err"', '"1",1e-6,0.1,120,1e-3,1e-5', LockInTable),
        ('"hold_time";"healing";"V";"K"', "10;0.01;1e-6;1e3", HealingTable),
    ],
)
def test_headings_in_quotation_marks_are_those_of_a_table(tmp_path, heading, row, kind):
    """As `write.csv` of R writes them, with a column of row numbers."""
    path = tmp_path / "table.csv"
    path.write_text(f"{heading}\n{row}\n")
    (table,) = read_data(Fit(data=(Data(file=path),)))
    assert isinstance(table, kind)
    assert table.rows == 1


def test_unstable_responses_are_no_readings(pmma):
    """Below the stiffness (B - A) W0 / D0 steady sliding, and here its response, is unstable."""
    laws = {name: pmma.law("rice-ruina", B=0.026, D0=D0) for name, D0 in (("+", 4e-7), ("-", 8e-8))}
    critical = {name: (law.B - law.A) * 7.0 / law.D0 for name, law in laws.items()}
    K = math.sqrt(critical["+"] * critical["-"])
    velocity = np.repeat([1e-6, 3e-6, 1e-5], 3)
    point = {"velocity": velocity, "epsilon": np.tile([0.1, 0.2, 0.3], 3), "frequency": 120.0}
    for name, law in laws.items():
        response = periodic_response(Slider(law, spring=K, load=7.0), **point)
        assert response.stable.all() if name == "+" else not response.stable.any()
        columns = {"V": velocity, "epsilon": point["epsilon"], "frequency": 120.0}
        columns |= {"mean_friction": response.mean_friction, "mean_friction_err": 1e-3}
        fixed = {"B": law.B, "D0": law.D0, "V0": law.V0, "K": K, "W0": 7.0}
        result = fit(table_of(columns), "rice-ruina", ("mu0", "A"), fixed=fixed)
        assert result.values["A"] == pytest.approx(float(law.A), rel=1e-3)
        said = [w for w in result.warnings if "9 of 9 rows is unstable" in w]
        assert len(said) == (name == "-")


@pytest.mark.parametrize(("name", "option"), [("inertia", "inertia"), ("eta", "radiation_damping")])
def test_a_column_of_the_motion_is_not_left_out_of_a_fit(name, option):
    columns = {
        "V": [1e-6, 1e-6], "epsilon": [0.1, 0.2], "frequency": [120.0, 120.0], name: [1.0, 1.0],
        "mu1": [1e-4, 2e-4], "mu1_err": [1e-5, 1e-5],
    }  # fmt: skip
    material = asp.materials.load("bureau2000")
    with pytest.raises(InputError, match=f"{option}.* must agree with the column '{name}'"):
        asp.fit(asp.inference.table_of(columns), "rice-ruina", ["A"], material=material)
