"""Tables of holds as data: A, B and D0 that an independent integration was made with come back."""

from dataclasses import replace

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.inference import (
    Prior,
    compare,
    fit,
    healing_table,
    read_healing,
    sample_posterior,
)
from asperity.inference.answers import read_data
from asperity.inference.holds import HoldTerm, joined_holds
from asperity.laws import RiceRuina
from asperity.questions.fit import Fit
from references.holds_and_steps import Interface

A, B, D0 = 0.011, 0.014, 4e-6
TIMES = np.array([3.0, 30.0, 300.0, 3e3, 3e4])
SPRINGS = ((2e3, 1e-6), (6e4, 3e-7))
ERROR = 2e-4


@pytest.fixture(scope="module")
def exact():
    """Healing at both springs by SciPy, with hold times, velocities and stiffnesses."""
    rows = []
    for k, V in SPRINGS:
        interface = Interface("rice-ruina", A, B, D0, k)
        for time in TIMES:
            level, _, high, *_ = interface.hold(V, time)
            rows.append((time, high - level, V, k))
    return np.array(rows).T


@pytest.fixture(scope="module")
def noise():
    return ERROR * np.random.default_rng(7).standard_normal(2 * TIMES.size)


def table(exact, healing, **more):
    time, _, V, K = exact
    return healing_table({"hold_time": time, "healing": healing, "V": V, "K": K, **more})


@pytest.fixture(scope="module")
def fitted(exact, noise):
    return fit(table(exact, exact[1] + noise, healing_err=ERROR), "rice-ruina", starts=2)


def test_the_numbers_come_back(fitted):
    done = fitted
    assert done.converged
    assert done.p_value > 0.001
    for name, true in (("A", A), ("B", B), ("D0", D0)):
        p = done.parameters[name]
        assert abs(p.value - true) < 4 * p.se, name
        assert p.se < 0.15 * true


def test_an_error_that_is_not_given_is_that_of_the_residuals(exact, noise, fitted):
    """The same estimate; the error as rms of what is left, and intervals of Student's t."""
    given = fitted
    begun = given.values
    done = fit(table(exact, exact[1] + noise), "rice-ruina", start=begun, starts=1)
    (term,) = done.objective.terms_of(HoldTerm)
    expected = ERROR * np.sqrt(given.chi2 / given.dof)
    assert term.error == pytest.approx(expected, rel=1e-4)
    assert not done.judged_by_chi2
    assert "estimated from the residuals" in " ".join(done.warnings)
    for name in ("A", "B", "D0"):
        mine, known = done.parameters[name], given.parameters[name]
        assert mine.value == pytest.approx(known.value, rel=1e-3)
        assert mine.se == pytest.approx(known.se * expected / ERROR, rel=0.02)
    # AICc compares maxima of the likelihood: their error is that of all rows.
    n, k = 2 * TIMES.size, 4
    maximum = n * (1 + np.log(2 * np.pi * term.error**2 * (n - k + 1) / n))
    assert done.aicc == pytest.approx(maximum + 2 * k + 2 * k * (k + 1) / (n - k - 1), rel=1e-9)


def test_priors_leave_the_estimated_error_as_it_is(exact, noise, fitted):
    """A tight prior leaves the residuals the degrees of freedom that a fixed number does.

    The error was estimated where a guess of it, far too large, had let the prior decide.
    """
    data, begun = table(exact, exact[1] + noise), fitted.values

    def with_prior(mean, sd):
        done = fit(data, "rice-ruina", prior={"A": Prior(mean, sd, "")}, start=begun, starts=0)
        return done.objective.terms[0].error, done

    (wide, _), (without, _) = with_prior(A + 1.5e-3, 1e-3), with_prior(A, 1.0)
    assert wide == pytest.approx(without, rel=0.02)
    _, tight = with_prior(A, 1e-7)
    assert np.sum(tight.residuals[0].values ** 2) == pytest.approx(2 * TIMES.size - 2, rel=1e-4)
    low, high = tight.parameters["A"].interval_95
    assert high - low == pytest.approx(2 * 1.96e-7, rel=1e-3)


def test_an_error_between_priors_and_data_is_that_of_the_residuals(exact, noise):
    """Priors five deviations off: 30 rounds of estimates and errors in turn had not agreed."""
    priors = {"A": Prior(A + 1.5e-3, 3e-4, ""), "B": Prior(B - 1.5e-3, 3e-4, "")}
    near = {"start": {"A": A, "B": B, "D0": D0}, "starts": 0}
    done = fit(table(exact, exact[1] + noise), "rice-ruina", prior=priors, **near)
    objective, (data,) = done.objective, done.residuals
    _, J = objective.residuals(objective.coordinates(done.values))
    fitted = np.trace(data.jacobian @ np.linalg.inv(J.T @ J) @ data.jacobian.T)
    assert fitted < 2.9
    assert data.values @ data.values == pytest.approx(data.values.size - fitted, rel=1e-5)


def test_an_error_is_an_uncertainty_too_as_in_lock_in_tables(tmp_path):
    path = tmp_path / "holds.csv"
    path.write_text("hold_time,healing,healing_uncertainty,V,K\n10,0.01,2e-4,1e-6,1e4\n")
    assert read_healing(path).errors.tolist() == [2e-4]
    path.write_text("hold_time,healing,healing_uncertainty,healing_err,V,K\n10,1,2e-4,1,1,1\n")
    with pytest.raises(InputError, match="must have one column of errors"):
        read_healing(path)


def test_a_wrong_row_is_named(exact, noise):
    healing = exact[1] + noise
    healing[3] += 30 * ERROR
    wrong = table(exact, healing, healing_err=ERROR)
    near = {"start": {"A": A, "B": B, "D0": D0}, "starts": 1}
    done = fit(wrong, "rice-ruina", **near)
    assert done.outliers == (3,)
    assert any("without row 4 of holds chi-squared" in w for w in done.warnings)


@pytest.mark.long
def test_a_wrong_row_does_not_decide_between_laws(exact, noise):
    healing = exact[1] + noise
    healing[3] += 30 * ERROR
    wrong = table(exact, healing, healing_err=ERROR)
    near = {"start": {"A": A, "B": B, "D0": D0}, "starts": 1}
    result = compare(wrong, ["rice-ruina", "ruina-slip"], evidence=False, **near)
    assert result.left_out == ("row 4 of holds",)
    assert result.best == "rice-ruina"


def test_a_copy_of_a_row_is_named(exact, noise, fitted):
    twice = [*range(10), 3]
    copied = table(exact[:, twice], (exact[1] + noise)[twice], healing_err=ERROR)
    done = fit(copied, "rice-ruina", start=fitted.values, starts=1)
    assert [w for w in done.warnings if "is equal to" in w] == [
        "row 11 of holds is equal to row 4 of holds: remove it if it is a copy, which counts twice"
    ]
    assert not any("is equal to" in w for w in fitted.warnings)


def test_derivatives_are_those_of_differences(exact):
    term = HoldTerm(table(exact, exact[1], healing_err=1.0), RiceRuina, {"mu0": 0.6, "V0": 1e-6})
    at = {"A": A, "B": B, "D0": D0}
    residuals = term.residuals(at)
    np.testing.assert_allclose(residuals.values, 0, atol=1e-8)
    for column, name in enumerate(at):
        high, low = (term.residuals(at | {name: at[name] * f}).values for f in (1 + 1e-4, 1 - 1e-4))
        slope = (high - low) / (2e-4 * at[name])
        np.testing.assert_allclose(
            residuals.jacobian[:, column], slope, rtol=1e-4, atol=1e-5 * abs(slope).max()
        )


@pytest.mark.long
def test_other_laws_are_excluded(exact, noise):
    data = table(exact, exact[1] + noise, healing_err=ERROR)
    result = compare(data, ["rice-ruina", "ruina-slip"], evidence=False, starts=16)
    assert result.best == "rice-ruina"
    assert result.laws["ruina-slip"].excluded


def test_units_stand_in_the_heading(tmp_path):
    path = tmp_path / "holds.csv"
    path.write_text(
        "# granite\nhold_time (s),healing,V [um/s],K (1/um),rock\n"
        "10,0.01,1,0.002,x\n100,.02,10,2e-3,y\n",
        encoding="utf-8",
    )
    read = read_healing(path)
    np.testing.assert_allclose(read.V, [1e-6, 1e-5])
    np.testing.assert_allclose(read.K, 2e3)
    assert read.errors is None
    over = healing_table(
        {"hold_time": 10, "healing": 0.01, "V": "1 um/s", "K": "0.02 N/um", "W0": "10 N"}
    )
    np.testing.assert_allclose(over.K, 2e3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hold_time,healing\n1,0.1\n", "got none for V, K"),
        ("hold_time,healing,V,K\n1,x,1e-6,1e3\n", "a number in column healing"),
        ("hold_time,healing,V,K\n-1,0.1,1e-6,1e3\n", "hold_time must be positive"),
        ("hold_time,healing,healing_err,V,K\n1,0.1,0,1e-6,1e3\n", "healing_err must be positive"),
        ("hold_time,healing,V (N),K\n1,0.1,1e-6,1e3\n", "V"),
        ("hold_time,healing,healing,V,K\n", "no rows"),
        ("", "no rows"),
    ],
)
def test_what_breaks_a_rule_is_said(tmp_path, text, words):
    path = tmp_path / "holds.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_healing(path)


def test_what_holds_cannot_say_is_refused(exact):
    data = table(exact, exact[1], healing_err=ERROR)
    with pytest.raises(InputError, match="table has stiffness"):
        fit(data, "rice-ruina", ["A", "K"])
    few = healing_table({"hold_time": [1, 10], "healing": [0.1, 0.2], "V": 1e-6, "K": 1e3})
    with pytest.raises(InputError, match="more data than free parameters"):
        fit(few, "rice-ruina", ["A", "B", "D0"])


def test_without_residuals_no_error_is_estimated():
    """One hold for one parameter, and two holds for two parameters with priors."""
    one = healing_table({"hold_time": 100.0, "healing": 0.05, "V": 1e-6, "K": 2e4})
    fixed = {"A": 0.01, "D0": 1e-6}
    with pytest.raises(InputError, match="healing_err, or more holds than free parameters"):
        fit(one, "rice-ruina", ["B"], fixed=fixed)
    two = healing_table({"hold_time": [10, 100], "healing": [0.03, 0.05], "V": 1e-6, "K": 2e4})
    priors = {"A": Prior(0.01, 0.002, ""), "B": Prior(0.015, 0.003, "")}
    with pytest.raises(InputError, match="got 2 for 2; no residuals are left"):
        fit(two, "rice-ruina", ["A", "B"], fixed={"D0": 1e-6}, prior=priors)


def test_a_table_has_the_name_of_the_question(tmp_path):
    """As tables of readings and recordings."""
    file = tmp_path / "a.csv"
    file.write_text("hold_time,healing,V,K\n10,0.01,1e-6,2e4\n100,0.02,1e-6,2e4\n")
    (data,) = read_data(Fit(data=[{"file": file, "name": "dry granite"}]))
    assert data.row_names[1] == "row 2 of dry granite"


def test_rows_keep_their_names(exact):
    """Those of a second table, and those after one that is left out."""
    first = table(exact, exact[1])
    joined = joined_holds([first, replace(first, name="others", row_names=np.array([]))])
    kept = joined.without(np.arange(joined.rows) == 3)
    assert [kept.row_names[i] for i in (2, 3, 9)] == [
        "row 3 of holds", "row 5 of holds", "row 1 of others"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"inertia": True}, "inertia must have an influence, got it with a table of holds"),
        ({"radiation_damping": True}, "radiation_damping must have an influence"),
        ({"fixed": {"eps_ratio": 0.5}}, "eps_ratio'] must have an influence"),
        ({"fixed": {"M": "1 kg"}}, "M'] must have an influence"),
        ({"fixed": {"V": "5 um/s"}}, "V'] must agree with the column of the data"),
        ({"fixed": {"K": "5e-3 1/um"}}, "K'] must agree with the column of the data"),
        ({"fixed": {"K": 5e3, "W0": 1.0}}, "K'] must agree with the column of the data"),
    ],
)
def test_what_has_no_influence_on_holds_is_refused(exact, options, words):
    data = table(exact, exact[1], healing_err=ERROR)
    with pytest.raises(InputError) as refused:
        fit(data, "rice-ruina", ["A", "B", "D0"], **options)
    assert words in str(refused.value)


def test_a_posterior_is_refused(fitted):
    with pytest.raises(InputError, match="profile likelihood"):
        sample_posterior(fitted)
