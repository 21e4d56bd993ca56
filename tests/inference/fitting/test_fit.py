"""Fits of tables: true values, intervals, likelihood, undetermined parameters, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import asperity as asp
from asperity.errors import InputError
from asperity.fit_report.bands import bands_of
from asperity.inference import Prior, compare, fit, shift_of_estimates, table_of
from asperity.inference.answers import answer_fit
from asperity.inference.comparison.compare import what_would_tell
from asperity.inference.fitting.inputs import fixed_values, free_by_default, priors_of
from asperity.inference.fitting.result import Estimate, Optimum, fit_record
from asperity.inference.objective import Objective
from asperity.inference.report import quality
from asperity.inference.tables.table import LockInTable, joined
from asperity.laws import get_law
from asperity.questions.fit import Fit
from asperity.recording.writers import write

TRUTH = {"A": 0.013, "B": 0.026, "D0": 4e-7, "lambda": 7e-7, "eps_ratio": 0.48}
FREE = ("lambda", "eps_ratio", "A")


def drops_of(table):
    """The same table with its drop of the mean friction alone."""
    values, errors = ({"delta_mu": c["delta_mu"]} for c in (table.values, table.errors))
    return LockInTable("drop", table.points, values, errors)


def test_readings_without_noise_give_the_true_values(readings, pmma):
    done, total = [], []
    count = {"progress": lambda *steps: (done.append(steps[0]), total.append(steps[1]))}
    result = fit(readings(None), "elasto-plastic", FREE, material=pmma, **count)
    assert result.converged
    assert done == list(range(total[0] + 1))
    assert set(total) == {total[0]}
    for name in FREE:
        # The readings are accurate to 1e-9, the fitted parameters then to some 1e-8.
        assert result.values[name] == pytest.approx(TRUTH[name], rel=1e-6)
    assert result.chi2 < 1e-6


def test_parameters_that_the_readings_depend_on_are_free_by_default(readings, pmma):
    table = readings(None)
    machine = {"K": 2e5, "W0": 7.0}
    result = fit(table, "elasto-plastic", fixed={**machine, "B": 0.026, "D0": 4e-7}, material=pmma)
    # The table has no mean friction, so that mu0 is fixed at the value of the material.
    assert list(result.parameters) == ["A", "lambda", "eps_ratio"]
    for name in FREE:
        assert result.values[name] == pytest.approx(TRUTH[name], rel=1e-6)
    record = fit_record(result)
    assert record["fixed"]["mu0"] == {"value": pmma.mu0, "unit": ""}
    assert record["fixed"]["V"] == {"value": None, "unit": "m/s"}
    law = get_law("linker-dieterich")
    assert free_by_default(law, [table], machine, None) == [
        *("mu0", "A", "B", "D0", "alpha", "eps_ratio")
    ]


def test_a_stiffness_is_fitted_without_a_start(readings):
    fixed = {**TRUTH, "mu0": 0.5, "V0": 1e-6, "W0": 7.0}
    del fixed["A"]
    result = fit(readings(None), "elasto-plastic", ["A", "K"], fixed=fixed)
    assert result.values["K"] == pytest.approx(2e5, rel=1e-6)


def test_a_free_mu0_is_reported_at_1_um_per_second(readings):
    fixed = {"K": 2e5, "W0": 7.0, "A": 0.013, "B": 0.026, "D0": 4e-7, "eps_ratio": 0.48}
    result = fit(readings(None), "elasto-plastic", ["mu0", "lambda"], fixed=fixed)
    assert result.objective.fixed["V0"] == 1e-6


def test_a_fit_needs_neither_a_material_nor_a_start(readings):
    fixed = {"mu0": 0.5, "V0": 1e-6, "K": 2e5, "W0": 7.0, "D0": 4e-7, "B": 0.026}
    result = fit(readings(None), "elasto-plastic", FREE, fixed=fixed)
    assert result.values["lambda"] == pytest.approx(7e-7, rel=1e-5)


def test_a_friction_that_no_contact_has_is_named(readings, pmma):
    """A mean friction ten times too large."""
    table = readings(0)
    mean = 0.5 - 0.013 * np.log(table.points["V"] / 1e-6) + table.values["delta_mu"]
    error = table.errors["delta_mu"]
    fixed = {**TRUTH, "V0": 1e-6, "K": 2e5, "W0": 7.0}
    for factor, named in ((1.0, 0), (10.0, 1)):
        columns = {**table.points, "mean_friction": factor * mean}
        readings_of_mean = table_of({**columns, "mean_friction_err": factor * error})
        free = ["mu0", "A", "B"]
        others = {n: v for n, v in fixed.items() if n not in free}
        options = {"fixed": others, "check_stiffness": False, "starts": 8}
        result = fit(readings_of_mean, "elasto-plastic", free, **options)
        assert sum("mu0 of" in w and "check the units" in w for w in result.warnings) == named


def test_an_uncertainty_that_decides_a_fit_is_named(readings, pmma):
    """A thousandth of the others, by a misprint: the interval of A is as narrow as this error."""
    table = drops_of(readings(2))
    named = {}
    for factor in (1.0, 1e-3):
        errors = table.errors["delta_mu"].copy()
        errors[5] *= factor
        misprinted = LockInTable("drop", table.points, table.values, {"delta_mu": errors})
        result = fit(misprinted, "elasto-plastic", ["eps_ratio"], material=pmma)
        named[factor] = [w for w in result.warnings if "goes through" in w]
        assert result.p_value > 0.001
    assert named[1.0] == []
    (warning,) = named[1e-3]
    assert warning.startswith("delta_mu_err of row 6 is 0.001 times that of the other rows")


@pytest.mark.long
def test_intervals_contain_the_truth_as_often_as_stated(readings, pmma):
    sets = 60
    inside = {"right": np.zeros(2), "narrow": np.zeros(2)}
    for seed in range(sets):
        # One start besides the truth: this test is about the intervals, not the search.
        options = {"material": pmma, "start": {name: TRUTH[name] for name in FREE}, "starts": 1}
        result = fit(readings(seed), "elasto-plastic", FREE, **options)
        for name in FREE:
            p = result.parameters[name]
            off = TRUTH[name] - p.value
            for i, (low, high) in enumerate((p.interval_68, p.interval_95)):
                inside["right"][i] += low - p.value <= off <= high - p.value
                # The intervals of a mistake: chi-squared counted twice makes them so narrow.
                inside["narrow"][i] += low - p.value <= np.sqrt(2) * off <= high - p.value
    right, narrow = (count / (sets * len(FREE)) for count in inside.values())
    # Standard deviation of a share over 60 sets: parameters of one set may be correlated.
    spread = np.sqrt(np.array([0.68 * 0.32, 0.95 * 0.05]) / sets)
    assert (np.abs(right - [0.6827, 0.95]) < 3 * spread).all()
    assert (narrow < [0.6827, 0.95] - 2 * spread).all()


def test_chi_squared_counts_the_data_once(readings, pmma):
    result = fit(readings(3), "elasto-plastic", FREE, material=pmma)
    n = sum(n for _, n in result.observables.values())
    assert n == 16 * 5
    assert result.dof == n - len(FREE)
    assert result.p_value == pytest.approx(chi2.sf(result.chi2, result.dof))
    assert sum(c for c, _ in result.observables.values()) == pytest.approx(result.chi2)
    # By definition the log of a product of normal densities.
    table = result.objective.terms[0].table
    errors = np.concatenate(
        [
            table.errors["delta_mu"],
            *(table.errors[f"mu{n}"] for n in (1, 2)),
            *(table.values[f"mu{n}"] * table.errors[f"phase{n}"] for n in (1, 2)),
        ]
    )
    expected = -0.5 * result.chi2 - np.log(errors * np.sqrt(2 * np.pi)).sum()
    assert result.log_likelihood == pytest.approx(expected, rel=1e-10)
    k = len(FREE)
    assert result.bic == pytest.approx(-2 * expected + k * np.log(n))
    assert result.aicc == pytest.approx(-2 * expected + 2 * k + 2 * k * (k + 1) / (n - k - 1))


def test_profile_and_normal_intervals_agree_where_the_likelihood_is_normal(readings, pmma):
    table = readings(4)
    normal = fit(table, "elasto-plastic", ("lambda", "eps_ratio"), material=pmma)
    profile = fit(table, "elasto-plastic", ("lambda", "eps_ratio"), material=pmma, profile=True)
    for name, p in normal.parameters.items():
        np.testing.assert_allclose(
            profile.parameters[name].interval_95, p.interval_95, atol=0.1 * p.se
        )


def test_parameters_that_the_data_cannot_determine_are_named(readings, pmma):
    # Fast modulation changes the age so little that delta_mu hardly depends on D0.
    result = fit(drops_of(readings(5)), "elasto-plastic", ("eps_ratio", "D0"), material=pmma)
    assert "D0" in result.undetermined
    assert "eps_ratio" not in result.undetermined
    assert any("D0 is not determined" in w for w in result.warnings)


def test_a_prior_counts_as_one_more_measurement(readings, pmma):
    table = readings(6)
    options = {"material": pmma, "start": {"eps_ratio": TRUTH["eps_ratio"]}}
    alone = fit(table, "elasto-plastic", ("eps_ratio",), **options)
    estimate = alone.parameters["eps_ratio"]
    prior = Prior(estimate.value + 2 * estimate.se, estimate.se, "a second experiment")
    with_prior = fit(table, "elasto-plastic", ("eps_ratio",), prior={"eps_ratio": prior}, **options)
    # Two normal estimates of equal weight: their mean, and a standard error sqrt(2) smaller.
    assert with_prior.values["eps_ratio"] == pytest.approx(
        estimate.value + estimate.se, abs=0.05 * estimate.se
    )
    assert with_prior.parameters["eps_ratio"].se == pytest.approx(
        estimate.se / np.sqrt(2), rel=0.03
    )


def test_a_wrong_law_is_excluded_by_a_named_observable(readings, pmma):
    comparison = compare(
        readings(8),
        ["rice-ruina", "elasto-plastic"],
        ["lambda", "eps_ratio", "A"],
        material=pmma,
        evidence=False,
        starts=4,
    )
    assert comparison.decided
    assert comparison.best == "elasto-plastic"
    assert comparison.laws["rice-ruina"].excluded
    assert "mu1" in comparison.laws["rice-ruina"].why


def test_laws_that_describe_the_data_equally_well_stay_undecided(readings, pmma):
    laws = ["rice-ruina", "elasto-plastic"]
    free = {"free": ["eps_ratio"], "material": pmma}
    comparison = compare(drops_of(readings(9)), laws, **free, evidence=False)
    assert not comparison.decided
    assert "cannot tell" in comparison.verdict
    assert "what would tell them apart" in comparison.verdict


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"mu1_err": 0.0}, "mu1_err must be a finite positive number, got 0 in row 1"),
        ({"mu1_err": [1e-5, np.inf]}, "mu1_err must be a finite positive number, got inf in row 2"),
        ({"mu1_err": [1e-5, np.nan]}, "mu1_err must be a finite positive number, got nan in row 2"),
        ({"mu1_err": None}, "got no column mu1_err"),
        ({"mu1": [1e-3, np.inf]}, "mu1 must be finite, got inf in row 2"),
        ({"mu1": [-1e-3, 2e-3]}, "mu1 must be an amplitude, at least 0, got -0.001 in row 1"),
        ({"phase1": -90.0, "phase1_err": 1.0}, "phase1 must be in rad"),
        ({"delta_mu": [-1.0, -20.0]}, "delta_mu must be a force over W0, below 10, got -20"),
        ({"mean_friction": -0.5, "mean_friction_err": 1e-3}, "mean_friction must be positive"),
        ({"mu1_delta_nu_cov": 1e-9}, "must name two observables as <name>_<name>_cov"),
        ({"epsilon": 1.0}, "epsilon must"),
        ({"V": -1e-6}, "V must be positive"),
        ({"pull": [0.0, 0.1]}, "pull must be 0, since fits are to a harmonic load, got 0.1"),
        ({"phase1": 0.0, "phase1_err": 0.1, "mu1": None, "mu1_err": None}, "must have mu1"),
        ({"delta_mu": None, "mu1": None}, "must report at least one of"),
    ],
)
def test_bad_tables_are_refused(changed, message):
    columns = {
        "V": [1e-6, 2e-6],
        "epsilon": [0.1, 0.2],
        "frequency": 120.0,
        "delta_mu": [-0.01, -0.02],
        "delta_mu_err": 1e-3,
        "mu1": [1e-3, 2e-3],
        "mu1_err": 1e-5,
    }
    columns |= changed
    with pytest.raises(InputError) as caught:
        table_of({k: v for k, v in columns.items() if v is not None})
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_repeated_row_is_refused():
    columns = {"V": [1e-6, 1e-6], "epsilon": 0.1, "frequency": 120.0}
    columns |= {"mu1": 1e-3, "mu1_err": 1e-5}
    with pytest.raises(InputError, match="row 2 equal to row 1"):
        table_of(columns)


def row_of(epsilon, **columns):
    return {"V": 1e-6, "epsilon": epsilon, "frequency": 120.0, "mu1_err": 1e-5} | columns


def test_a_reading_in_two_tables_is_refused(pmma):
    first = table_of(row_of([0.1, 0.2], mu1=[1e-3, 2e-3]), name="first")
    second = table_of(row_of([0.3, 0.2], mu1=[3e-3, 2e-3]), name="second")
    message = r"row 2 of second \(table 2\) equal to row 2 of first \(table 1\)"
    with pytest.raises(InputError, match=message):
        fit([first, second], "elasto-plastic", ("lambda",), material=pmma)
    # Columns that only one of the tables has do not make the readings different.
    more = {"W0": 7.0, "mu2": [1e-4, 2e-4], "mu2_err": 1e-5}
    second = table_of(row_of([0.3, 0.2], mu1=[3e-3, 2e-3], **more), name="second")
    with pytest.raises(InputError, match=message):
        fit([first, second], "elasto-plastic", ("lambda",), material=pmma)


@pytest.mark.parametrize(
    "columns",
    [
        {"mu1": [3e-3, 2.001e-3]},  # measured again at the same point
        {"mu1": [1e-3, 2e-3], "frequency": 121.0},
        {"mu1": [3e-3, np.nan], "mu2": [1e-4, 2e-4], "mu2_err": 1e-5},  # another observable
    ],
)
def test_readings_that_differ_are_joined(columns):
    first = table_of(row_of([0.1, 0.2], mu1=[1e-3, 2e-3]), name="first")
    second = table_of(row_of([0.3, 0.2], **columns), name="second")
    assert joined([first, second])[0].rows == 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"free": ("V0",)}, "free mu0 instead"),
        ({"free": ("alpha",), "start": {"alpha": 0.1}}, "must be parameters of elasto-plastic"),
        ({"free": ("A", "A")}, "'A' twice"),
        ({"free": ()}, "free must name a parameter of elasto-plastic, got none"),
        ({"free": ("A", "M")}, "'M', which has no influence without inertia; add inertia=True"),
        ({"free": ("eta",), "inertia": True}, "no influence without radiation damping; add rad"),
        ({"free": ("A",), "prior": {"B": Prior(0.02, 0.01, "")}}, "prior must be of free"),
        (
            {"free": ("A",), "prior": {"A": Prior(-1.0, 0.1, "")}},
            "must have a positive mean, got -1",
        ),
        ({"free": ("D0",), "prior": {"D0": Prior(0.5, 0.1, "", "um")}}, "must be in m, as all"),
        ({"free": ("A",), "fixed": {"A": 0.01}}, "free or fixed"),
        ({"free": ("A",), "fixed": {"alpha": 0.1}}, "fixed must be parameters"),
        # Names of geophysics.
        ({"free": ("A",), "fixed": {"Dc": 1e-6}}, "got 'Dc'; did you mean 'D0'?"),
        ({"free": ("A", "D0"), "start": {"d_c": 1e-6}}, "got 'd_c'; did you mean 'D0'?"),
        ({"free": ("a",)}, "got 'a'; did you mean 'A'?"),
        (
            {"free": ("A",), "prior": {"sigma_n": Prior(1.0, 0.1, "")}},
            "got 'sigma_n'; free it, correct the name, or leave the prior out",
        ),
        ({"free": ("A",), "fixed": {"sigma_n": 1.0}}, "got 'sigma_n'; did you mean 'W0'?"),
        ({"free": ("A",), "fixed": {"tilt": 0.1}}, "fixed must be parameters of a harmonic load"),
        ({"free": ("tilt",)}, "must be parameters of elasto-plastic, got 'tilt'"),
        # A gauge of recordings alone has a gain.
        ({"free": ("A", "gain")}, "must be parameters of elasto-plastic, got 'gain'"),
        ({"free": ("A",), "start": {"B": 0.1}}, "start must be of free parameters"),
        ({"free": ("A",), "fixed": {"eps_ratio": 3.0}}, "must be below 1"),
    ],
)
def test_bad_options_are_refused(readings, pmma, options, message):
    with pytest.raises(InputError) as caught:
        fit(readings(None), "elasto-plastic", material=pmma, **options)
    assert message in str(caught.value)


def test_a_fit_without_data_is_refused():
    with pytest.raises(InputError, match="data must hold readings or a recording, got none"):
        fit([], "rice-ruina", ["A"])


def test_a_stiffness_over_the_load_is_converted_to_N_per_m(readings, pmma):
    """K/W0 of 2e5 N/m and 7 N, as a fixed number, a start and a prior."""
    table, over_load = readings(3), 2e5 / 7.0
    options = {"material": pmma, "starts": 1}
    free = ("A", "eps_ratio")
    text = f"{over_load * 1e-6!r}/um"
    by_load = fit(table, "elasto-plastic", free, fixed={"K": text, "W0": "7 N"}, **options)
    by_force = fit(table, "elasto-plastic", free, fixed={"K": "0.2 N/um", "W0": "7 N"}, **options)
    # The stiffnesses differ in the last digit, and so do the ends of the minimisations.
    assert by_load.values == pytest.approx(by_force.values, rel=1e-7)
    priors = [Prior(over_load, 0.01 * over_load, "", "1/m"), Prior(2e5, 2e3, "", "N/m")]
    with_prior = [
        fit(table, "elasto-plastic", (*free, "K"), prior={"K": p}, start={"K": s}, **options)
        for p, s in zip(priors, (text, "0.2 N/um"), strict=True)
    ]
    assert with_prior[0].values == pytest.approx(with_prior[1].values, rel=1e-6)
    shown = with_prior[0].over_load["K/W0"]
    assert shown.value == pytest.approx(with_prior[0].values["K"] / pmma.W0 * 1e-6)
    with pytest.raises(InputError, match=r"prior\['K'\] must be in N/m or 1/m for a table"):
        fit(table, "elasto-plastic", ("A", "K"), prior={"K": Prior(1, 1, "", "Pa/m")}, **options)


def test_a_column_of_one_of_two_tables_counts_in_its_rows(readings, pmma):
    """Rows of a table without a load have that of the material."""
    first = readings(3)
    with_load = replace(first, points={**first.points, "W0": np.full(first.rows, 5.0)})
    without_load = replace(readings(4), name="other")
    assert "W0" not in without_load.points
    table, _ = joined([with_load, without_load])
    fixed = fixed_values(get_law("elasto-plastic"), table, ["A"], {"eps_ratio": 0.5}, pmma)
    np.testing.assert_array_equal(
        fixed["W0"], np.repeat([5.0, pmma.W0], [first.rows, without_load.rows])
    )


def test_predictions_of_two_tables_take_the_load_of_their_rows(readings, pmma):
    """One table has a column of the load, the other has that of the material."""
    half = np.arange(16) < 8
    first, other = (readings(seed).without(half) for seed in (3, 4))
    first = replace(first, points={**first.points, "W0": np.full(8, 5.0)})
    data = [first, replace(other, name="other")]
    options = {"material": pmma, "bare": True, "starts": 0, "check_stiffness": False}
    laws = [
        fit(data, "elasto-plastic", (), fixed={"eps_ratio": ratio}, **options)
        for ratio in (0.48, 0.5)
    ]
    assert "tell them apart best" in what_would_tell(*laws)
    series = bands_of(laws[0], laws[0].objective.terms[0], None)
    assert [one.label for one in series] == ["10 µm/s, W0 = 5 N", "10 µm/s, W0 = 7 N"]


def test_a_prior_holds_an_estimate_against_other_fixed_numbers(readings, pmma):
    """As precise as the data it halves the shift, to the first order."""
    table, options = readings(3), {"material": pmma, "starts": 1, "check_stiffness": False}
    free = fit(table, "elasto-plastic", ("eps_ratio",), **options)
    estimate = free.parameters["eps_ratio"]
    prior = {"eps_ratio": Prior(estimate.value, estimate.se, "")}
    held = fit(table, "elasto-plastic", ("eps_ratio",), prior=prior, **options)
    ends = {"lambda": 7.1e-7}, {"lambda": 6.9e-7}
    shifts = [shift_of_estimates(result, *ends)["eps_ratio"] for result in (free, held)]
    assert shifts[1] == pytest.approx(shifts[0] / 2, rel=0.01)


def test_a_second_state_counts_in_the_slope_of_steady_friction():
    law, zero = get_law("two-state"), (0.0, 0.0)
    numbers = {"A": 0.012, "B": 0.01, "B2": 0.008}
    errors = {"A": 3e-4, "B": 0.0, "B2": 4e-4}
    estimates = {
        n: Estimate(n, "", value, errors[n], zero, zero, False, None)
        for n, value in numbers.items()
    }
    result = asp.inference.Fit(
        law.name, True, "converged", estimates, Objective((), law, (), {}), np.eye(3)
    )
    slope = result.rate_dependence
    assert (slope.name, slope.meaning) == ("A - B - B2", "velocity weakening")
    assert (slope.value, slope.error) == pytest.approx((-0.006, 5e-4))
    assert any(line.name == "A - B - B2" for line in result.summary()[1])


@pytest.mark.parametrize(
    "texts", [("A=0.01+-0.001", "bureau2000"), ("bureau2000", "A=0.01+-0.001")]
)
def test_a_prior_by_name_takes_precedence_over_a_material(texts):
    """In any order."""
    priors = priors_of(Fit(data=[{"file": "a.csv"}], prior=texts).prior, ["A", "D0"])
    assert (priors["A"].mean, priors["D0"].mean) == (0.01, 4e-7)


@pytest.mark.parametrize("text", ["A=0.013+-10%", "K=0.2+-5 % N/um"])
def test_a_deviation_in_per_cent_is_refused(text):
    """Its unit is that of the value: 0.013 % is another value."""
    with pytest.raises(
        InputError, match=r"must be without per cent, got '.*'; write the deviation"
    ):
        Fit(data=[{"file": "a.csv"}], prior=text)


def test_as_many_parameters_as_data_are_refused_except_one_of_one(pmma):
    columns = {"V": 1e-6, "epsilon": 0.1, "frequency": 120.0, "mean_friction": 0.45, "mu1": 1e-2}
    columns |= {"mean_friction_err": 1e-3, "mu1_err": 1e-5}
    with pytest.raises(InputError, match="more data than free parameters, got 2 for 2"):
        fit(table_of(columns), "elasto-plastic", ("A", "B"), material=pmma)
    # One parameter of one datum is an inversion.
    del columns["mean_friction"], columns["mean_friction_err"]
    columns |= {"mu1": 1e-5, "mu1_err": 1e-8}
    result = fit(table_of(columns), "rice-ruina", ("eps_ratio",), material=pmma, starts=1)
    assert result.converged
    assert result.chi2 == pytest.approx(0, abs=1e-6)
    assert "nothing is left to judge the law by" in quality(result).sentences[0]


def test_a_file_with_a_recording_is_fitted_as_one(tmp_path) -> None:
    trace = asp.samples.velocity_steps(seed=5).slice(120, 330)
    file = write(trace, tmp_path / "steps.csv")
    result = asp.fit(file, starts=1)
    assert result.law == "rice-ruina"
    for name, true in (("A", 0.009), ("B", 0.0125), ("D0", 8e-6)):
        low, high = result.parameters[name].interval_95
        middle, half = (low + high) / 2, (high - low) / 2
        # Twice the half-width of 95 %: four standard errors.
        assert abs(true - middle) < 2 * half
    figure = result.plot()
    residual = figure.axes[1].get_lines()[0].get_ydata()
    assert np.std(residual) < 1e-3


def test_a_missing_file_and_an_unknown_law_are_named(tmp_path) -> None:
    with pytest.raises(InputError, match=r"no\.csv"):
        asp.fit(tmp_path / "no.csv")
    with pytest.raises(InputError, match="law"):
        asp.compare(tmp_path / "no.csv", laws=["no-such-law"])


READINGS = """V (um/s),epsilon,frequency (Hz),mu1,mu1_uncertainty
1,0.1,120,0.01,1e-4
1,0.3,120,0.03,1e-4
"""


def test_materials_and_priors_are_given_by_name_or_in_words(tmp_path, pmma) -> None:
    file = tmp_path / "readings.csv"
    file.write_text(READINGS)
    options = {"free": ["D0"], "starts": 0}
    named = asp.fit(file, material="bureau2000", prior="bureau2000", **options)
    loaded = asp.fit(file, material=pmma, prior=pmma, **options)
    assert named.values == loaded.values
    in_words = asp.fit(file, material=pmma, prior=["D0=0.5+-1e-6 um"], **options)
    assert abs(in_words.values["D0"] - 0.5e-6) < 1e-9


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("trend", "none"),
        ("drift", True),
        ("initial", "free"),
        ("gauge", "40 Hz"),
        ("fit_rate", "10 Hz"),
    ],
)
def test_options_of_recordings_are_refused_with_a_table(tmp_path, name, value) -> None:
    file = tmp_path / "readings.csv"
    file.write_text(READINGS)
    question = Fit(data=({"file": file},), material="bureau2000", **{name: value})
    with pytest.raises(InputError, match=f"{name} must go with a recording, got .* with a table"):
        answer_fit(question)


def test_a_window_of_a_table_is_refused(tmp_path) -> None:
    file = tmp_path / "readings.csv"
    file.write_text(READINGS)
    question = Fit(data=({"file": file, "window": (0, 1)},), material="bureau2000")
    with pytest.raises(InputError, match="window must go with a recording, got a table"):
        answer_fit(question)


def test_with_a_fixed_B_the_rate_dependence_is_as_uncertain_as_A(readings, pmma):
    """Another minimum may change the sign of A - B."""
    result = fit(readings(3), "elasto-plastic", ("A", "eps_ratio"), material=pmma, starts=1)
    difference, A = result.rate_dependence, result.parameters["A"]
    assert difference.value == pytest.approx(A.value - pmma.B)
    assert difference.error == pytest.approx(A.se)
    assert difference.meaning == "velocity weakening"
    other = Optimum(result.chi2 + 1, {"A": 2 * pmma.B, "eps_ratio": 0.5})
    assert replace(result, optima=(other,)).rate_dependence.meaning == "its sign is not determined"
    rows = replace(result.objective, fixed={**result.objective.fixed, "B": np.array([0.02, 0.03])})
    assert replace(result, objective=rows).rate_dependence is None
