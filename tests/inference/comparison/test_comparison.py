"""Verdicts on synthetic readings of a known law, with errors, outliers and runs of every kind."""

import json
import math
import re
from dataclasses import replace
from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of
from benchmarks.random_truths import (
    FREE as ALL_FREE,
    drawn_table,
    fast_point,
    missed_by,
    slow_point,
)
from click.testing import CliRunner

from asperity import Slider, periodic_response, samples
from asperity.cli.main import main
from asperity.errors import InputError
from asperity.inference import Prior, answers, compare, fit, table_of
from asperity.inference.comparison.compare import _better_at_extension, judge, laws_table
from asperity.inference.comparison.evidence import evidence_of, leave_one_run_out, support
from asperity.inference.fitting import minima
from asperity.inference.objective import Residuals
from asperity.inference.runs.run import RecordedRun
from asperity.inference.tables.residuals import outlying_rows
from asperity.inference.tables.term import LockInTerm
from asperity.inference.unknowns import UnfittableLawError
from asperity.laws import get_law
from asperity.orbit import response_function
from asperity.recording.defects.autoregression import Autoregression
from asperity.recording.writers import write
from references.populations import draws, population

V = np.repeat([1e-6, 1e-5], 8)
EPSILON = np.tile(np.linspace(0.05, 0.5, 8), 2)
MEAN, HARMONIC = 1e-3, 2e-5
LAWS = ("rice-ruina", "linker-dieterich", "elasto-plastic")
FREE = ("lambda", "alpha", "eps_ratio", "A")
#: Of these, those of one law alone.
SPECIAL = {"linker-dieterich": ("alpha",), "elasto-plastic": ("lambda",)}


@pytest.fixture(scope="module")
def made(pmma):
    """A table of a law, with noise of which the table tells `claimed` times the size."""

    def make(law, seed, *, claimed=1.0, **numbers):
        own = {"linker-dieterich": {"alpha": 0.2}}.get(law, {})
        slider = Slider(pmma.law(law, **own, **numbers), spring=pmma.K, load=pmma.W0)
        exact = periodic_response(slider, velocity=V, epsilon=0.48 * EPSILON, frequency=120.0)
        noise = np.random.default_rng(seed)
        drop = exact.delta_mu + MEAN * noise.normal(size=V.size)
        columns = {"V": V, "epsilon": EPSILON, "frequency": 120.0}
        for n in (1, 2):
            c = getattr(exact, f"mu{n}") * np.exp(1j * getattr(exact, f"phase{n}"))
            c = c + HARMONIC * (noise.normal(size=V.size) + 1j * noise.normal(size=V.size))
            error = claimed * HARMONIC
            columns |= {f"mu{n}": np.abs(c), f"mu{n}_err": error}
            columns |= {f"phase{n}": np.angle(c), f"phase{n}_err": error / np.abs(c)}
        return table_of(columns | {"delta_mu": drop, "delta_mu_err": claimed * MEAN})

    return make


@pytest.fixture(scope="module")
def judged(made, pmma):
    def judge_it(*args, laws=LAWS, **options):
        special = [name for law in laws for name in SPECIAL.get(law, ())]
        free = [*special, "eps_ratio", "A"]
        table = made(*args, **options)
        return compare(table, laws, free, material=pmma, evidence=False, starts=1)

    return judge_it


def test_laws_are_compared_without_naming_what_is_free(made, pmma):
    fixed = {"K": pmma.K, "W0": pmma.W0, "B": pmma.B, "D0": pmma.D0}
    laws = ("rice-ruina", "elasto-plastic", "cut-off")
    comparison = compare(
        made("elasto-plastic", 1), laws, fixed=fixed, material=pmma, evidence=False, starts=1
    )
    own = {name: list(j.fit.parameters) for name, j in comparison.laws.items()}
    assert own == {"elasto-plastic": ["A", "lambda", "eps_ratio"], "rice-ruina": ["A", "eps_ratio"]}
    assert comparison.best == "elasto-plastic"
    # Nothing says where to look for its cut-off velocities.
    assert list(comparison.not_compared) == ["cut-off"]
    assert "Not compared: cut-off, because a number is neither free nor given" in comparison.verdict


@pytest.mark.long
def test_a_law_with_more_parameters_than_samples_allow_leaves_the_others(tmp_path):
    whole = write(samples.velocity_steps(), tmp_path / "whole.csv").read_text().splitlines()
    # The rule is eight samples for each free parameter, step and two more. Of the steps the one at
    # 200 s is in these 62 samples: 64 are the fewest for two-state, 48 for the others.
    few = tmp_path / "few.csv"
    few.write_text("\n".join([whole[0], *whole[4001:10801:110]]) + "\n")
    comparison = answers.compare(few, ["rice-ruina", "ruina-slip", "two-state"], evidence=False)
    assert set(comparison.laws) == {"rice-ruina", "ruina-slip"}
    assert "at least 64 samples" in comparison.not_compared["two-state"]


@pytest.mark.parametrize(
    ("law", "laws"),
    population([("elasto-plastic", LAWS[::2]), *((law, LAWS) for law in LAWS[1:])], several=True),
)
def test_the_law_of_the_data_is_found(judged, law, laws):
    comparison = judged(law, 1, laws=laws)
    assert comparison.decided
    assert comparison.best == law
    assert all(j.excluded == (name != law) for name, j in comparison.laws.items())


@pytest.mark.long
def test_a_special_case_is_never_excluded_by_its_generalisation(judged):
    # Rice-Ruina is Linker-Dieterich with alpha = 0, and elasto-plastic with lambda = 0.
    comparison = judged("rice-ruina", 2)
    assert not comparison.decided
    assert not any(j.excluded for j in comparison.laws.values())
    assert "cannot tell" in comparison.verdict


def test_a_minimum_that_a_law_misses_is_found_by_way_of_its_generalisation(judged, monkeypatch):
    """Without random starts, if the general law counts as far off."""
    called = []

    def missing_once(data, law, *args, **options):
        result = fit(data, law, *args, **options)
        called.append(law)
        # While the general law is to come, the other one needs no further starts.
        assert options["further"] == (len(called) > 1)
        if len(called) == 3:
            assert options["starts"] == 0
        if called.count("rice-ruina") > 1 or law != "rice-ruina":
            return result
        A = result.parameters["A"]
        wrong = result.parameters | {"A": replace(A, value=0.5 * A.value)}
        missed = replace(result, parameters=wrong)
        chi2 = result.objective.chi2(result.objective.coordinates(missed.values))
        assert chi2 > result.chi2 + 1000
        return replace(missed, chi2=chi2)

    exact = judged("rice-ruina", 2, laws=("rice-ruina", "elasto-plastic"))
    monkeypatch.setattr("asperity.inference.comparison.compare.fit", missing_once)
    monkeypatch.setattr("asperity.inference.comparison.compare.FAR_OFF", 1.0)
    comparison = judged("rice-ruina", 2, laws=("rice-ruina", "elasto-plastic"))
    assert called == ["rice-ruina", "elasto-plastic", "rice-ruina"]
    fits = [judgement.laws["rice-ruina"].fit for judgement in (comparison, exact)]
    assert fits[0].chi2 == pytest.approx(fits[1].chi2, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("seed", [4, 6])
def test_a_missed_minimum_is_near_that_of_a_generalisation_with_correlated_parameters(seed):
    """alpha differs from 0 by noise, yet at the other estimates rice-ruina describes nothing."""
    response = response_function("rice-ruina", search=False)
    truth, fixed, table = drawn_table(seed, "rice-ruina", response)
    options = {"fixed": fixed, "bare": True, "check_stiffness": False, "starts": 0}
    exact = fit(table, "rice-ruina", list(truth), start=truth, **options)
    general = fit(table, LAWS[1], [*truth, "alpha"], start={**truth, "alpha": 0.02}, **options)
    assert exact.objective.chi2(exact.objective.coordinates(general.values)) > exact.chi2 + 400
    A = replace(exact.parameters["A"], value=1.03 * exact.values["A"])
    missing = replace(exact, parameters=exact.parameters | {"A": A})
    chi2 = exact.objective.chi2(exact.objective.coordinates(missing.values))
    assert chi2 > exact.chi2 + 20
    fits = {"rice-ruina": replace(missing, chi2=chi2), LAWS[1]: general}
    begin = exact.objective.coordinates(_better_at_extension(fits)["rice-ruina"].values)
    assert exact.objective.chi2(begin) < exact.chi2 + 5
    assert exact.objective.minimise(begin).chi2 == pytest.approx(exact.chi2, abs=0.01)


@pytest.mark.parametrize(
    "numbers", [{"fixed": {"alpha": 0.2}}, {"prior": {"alpha": Prior(0.2, 0.01, "")}}]
)
def test_a_law_that_another_contains_for_no_value_is_searched_for_by_itself(
    made, pmma, monkeypatch, numbers
):
    """Rice-Ruina has alpha = 0, which is not fixed at 0.2."""
    further = {}

    def recorded(data, law, *args, **options):
        further[law] = options["further"]
        raise UnfittableLawError(law, "be searched for only", "it")

    monkeypatch.setattr("asperity.inference.comparison.compare.fit", recorded)
    free = ["eps_ratio", "A", *(["alpha"] if "prior" in numbers else [])]
    options = {"material": pmma, "evidence": False, "starts": 1}
    with pytest.raises(InputError, match="two or more that can be fitted"):
        compare(made("linker-dieterich", 1), LAWS[:2], free, **numbers, **options)
    assert further == {"rice-ruina": True, "linker-dieterich": True}


def test_errors_too_small_exclude_no_law_by_their_size(judged, monkeypatch):
    monkeypatch.setattr(minima, "_FURTHER", 0)
    comparison = judged("rice-ruina", 13, claimed=1 / 3, laws=LAWS[::2])
    assert not comparison.decided
    factor = re.search(r"too small by a factor of about ([\d.]+)", comparison.verdict)[1]
    # Of 77 degrees of freedom: three standard errors are a quarter.
    assert float(factor) == pytest.approx(3, rel=0.25)
    # With the claimed errors rice-ruina, which is true, would be excluded.
    fits = [comparison.laws[name].fit for name in LAWS[::2]]
    assert fits[0].aicc > fits[1].aicc + 10
    # No other stiffness would describe these data.
    assert "with k free" not in comparison.verdict.lower()
    assert comparison.laws["rice-ruina"].fit.p_value < 1e-3
    assert not any(j.excluded for j in comparison.laws.values())


def test_a_stiffness_that_is_wrong_for_every_law_is_named(made, pmma, monkeypatch):
    monkeypatch.setattr(minima, "_FURTHER", 0)
    table, wrong = made("rice-ruina", 2), 1.3 * pmma.K
    given = {"material": pmma, "fixed": {"K": wrong}, "starts": 1}
    comparison = compare(table, LAWS[:2], FREE[1:], evidence=False, **given)
    assert not comparison.decided
    assert "With K free, rice-ruina describes these data" in comparison.verdict
    alone = fit(table, "rice-ruina", ["eps_ratio", "A"], **given)
    (said,) = [w for w in alone.warnings if "with K free" in w]
    low, high = map(float, re.search(r"\((\S+) to (\S+), 95 %\)", said).groups())
    # Four standard errors, printed to four digits.
    assert low - (high - low) / 2 < pmma.K < high + (high - low) / 2
    assert high < wrong


def test_errors_too_large_leave_what_the_data_show(judged):
    comparison = judged("elasto-plastic", 4, claimed=3.0, laws=LAWS[::2])
    assert comparison.best == "elasto-plastic"
    assert any(
        "uncertainties are too large" in w for w in comparison.laws[comparison.best].fit.warnings
    )


def test_a_law_that_is_wrong_everywhere_has_no_outliers(made, pmma):
    free = {"free": ("eps_ratio", "A"), "material": pmma, "check_stiffness": False}
    result = fit(made("elasto-plastic", 6), "rice-ruina", **free)
    assert result.p_value < 1e-6
    assert outlying_rows(result.residuals[0]) == []
    assert not any("check that reading" in w for w in result.warnings)


def integral_of(density, middle, reach):
    """Integral of a density like a normal one, whose width is an eighth of `reach`.

    The trapezium rule in steps of half the width is off by exp(-8 pi^2) for a normal density.
    """
    x = np.linspace(middle - reach, middle + reach, 33)
    return np.trapezoid([density(each) for each in x], x)


def test_evidence_is_the_integral_of_likelihood_times_prior(made, pmma):
    result = fit(
        made("elasto-plastic", 7), "elasto-plastic", ("eps_ratio",), material=pmma, starts=1
    )
    evidence = evidence_of(result, samples=400)
    prior = evidence.prior["eps_ratio"]
    assert prior["kind"] == "uniform in the logarithm"
    width = math.log(prior["high"] / prior["low"])
    value, se = result.values["eps_ratio"], result.parameters["eps_ratio"].se

    def density(x):
        return math.exp(0.5 * (result.chi2 - result.objective.chi2(np.array([x])))) / width

    middle = math.log(value)
    reach = 8 * se / value
    integral = integral_of(density, middle, reach)
    expected = result.log_likelihood + math.log(integral)
    assert evidence.log == pytest.approx(expected, abs=5 * evidence.standard_error + 1e-3)
    assert evidence.effective_samples > 120


def test_left_out_runs_are_predicted_by_a_normal_density(pmma, made):
    table = made("elasto-plastic", 8)
    runs = np.where(V < 5e-6, "slow", "fast")
    table = replace(table, run=runs)
    given = {"material": pmma, "starts": 1}
    result = fit(table, "elasto-plastic", ("eps_ratio",), **given)
    validation = leave_one_run_out(result)
    parts = [
        fit(table.without(runs != n), "elasto-plastic", ("eps_ratio",), **given)
        for n in ("slow", "fast")
    ]
    # By quadrature: the mean density of the run over the posterior of the others.
    for name in ("slow", "fast"):
        of_run, others = parts if name == "slow" else parts[::-1]
        middle = math.log(others.values["eps_ratio"])
        reach = 8 * others.parameters["eps_ratio"].se / others.values["eps_ratio"]

        @cache
        def posterior(x, others=others):
            return math.exp(0.5 * (others.chi2 - others.objective.chi2(np.array([x]))))

        def product(x, of_run=of_run, posterior=posterior):
            apart = of_run.objective.log_likelihood(np.array([x])) - of_run.log_likelihood
            return posterior(x) * math.exp(apart)

        whole, part = (integral_of(f, middle, reach) for f in (posterior, product))
        expected = of_run.log_likelihood + math.log(part / whole)
        assert validation.runs[name] == pytest.approx(expected, abs=0.05)
    assert validation.log_density == pytest.approx(sum(validation.runs.values()))
    # Two tables with the same name are two runs.
    tables = [table.without(runs == n) for n in ("fast", "slow")]
    tables = [replace(t, run=np.full(t.rows, "1")) for t in tables]
    apart = leave_one_run_out(fit(tables, "elasto-plastic", ("eps_ratio",), **given))
    assert list(apart.runs.values()) == pytest.approx(list(validation.runs.values()))
    # Of one run nothing is left.
    validation = leave_one_run_out(parts[0])
    assert math.isnan(validation.log_density)
    assert "one run" in validation.message


def test_a_number_with_a_tight_prior_counts_as_fixed(made, pmma):
    """AICc with 4 parameters and 10 data is 20 above that with one parameter."""
    table = made("elasto-plastic", 8).without(~np.isin(np.arange(V.size), [6, 13]))
    numbers = {name: pmma[name].si for name in ("A", "B", "lambda")}
    given = {"material": pmma, "starts": 1, "check_stiffness": False}

    def with_priors(sd):
        priors = {name: Prior(value, sd * value, "") for name, value in numbers.items()}
        return fit(table, "elasto-plastic", (*numbers, "eps_ratio"), prior=priors, **given)

    fixed = fit(table, "elasto-plastic", ("eps_ratio",), fixed=numbers, **given)
    tight = with_priors(1e-6)
    assert tight.aicc == pytest.approx(fixed.aicc, abs=1e-3)
    assert tight.bic == pytest.approx(fixed.bic, abs=1e-3)
    assert tight.dof == fixed.dof
    weights = [j.weight for j in judge({"fixed": fixed, "tight": tight}).laws.values()]
    assert weights == pytest.approx([0.5, 0.5], abs=1e-3)
    # A prior that says nothing leaves AICc as it is.
    loose = with_priors(1e6)
    deviance = -2 * loose.log_likelihood
    assert loose.aicc - deviance == pytest.approx(8 + 2 * 4 * 5 / 5, abs=1e-3)


def test_second_opinions_stand_beside_the_verdict(made, pmma, monkeypatch):
    monkeypatch.setattr(LockInTerm, "affordable", 200)
    table = made("rice-ruina", 9)
    done = []
    count = {"progress": lambda *steps: done.append(steps)}
    comparison = compare(
        table, LAWS[::2], ("lambda", "eps_ratio"), material=pmma, starts=1, **count
    )
    assert done == sorted(done)
    assert done[-1] == (400, 400)
    assert "The evidence " in comparison.verdict
    assert all(j.evidence.effective_samples > 50 for j in comparison.laws.values())
    assert judge({n: j.fit for n, j in comparison.laws.items()}).decided == comparison.decided


def test_a_law_without_a_free_parameter_is_compared_as_it_stands(made, pmma):
    table = made("rice-ruina", 2)
    with pytest.raises(InputError, match="got 'lambda', which none of rice-ruina, linker-d"):
        compare(table, ("rice-ruina", "linker-dieterich"), ("lambda",), material=pmma)
    given = {"material": pmma, "fixed": {"eps_ratio": 0.48}, "starts": 1, "evidence": False}
    comparison = compare(table, ("rice-ruina", "elasto-plastic"), ("lambda",), **given)
    assert set(comparison.laws) == {"rice-ruina", "elasto-plastic"}
    bare = comparison.laws["rice-ruina"]
    assert not bare.fit.parameters
    assert not bare.excluded
    # The law itself at the rows, by the solver.
    slider = Slider(pmma.law("rice-ruina"), spring=pmma.K, load=pmma.W0)
    exact = periodic_response(slider, velocity=V, epsilon=0.48 * EPSILON, frequency=120.0)
    away = (exact.delta_mu - table.values["delta_mu"]) / MEAN
    assert bare.fit.observables["delta_mu"] == (pytest.approx(away @ away, rel=1e-6), V.size)
    assert bare.fit.dof == 5 * V.size
    assert evidence_of(bare.fit).log == bare.fit.log_likelihood
    # A material with a prior of the other law alone, as a fit of that law writes it.
    of_lambda = pmma["lambda"].model_copy(update={"uncertainty": 0.1})
    given["prior"] = pmma.model_copy(update={"numbers": {"lambda": of_lambda}})
    again = compare(table, ("rice-ruina", "elasto-plastic"), ("lambda",), **given)
    assert again.laws["rice-ruina"].fit.chi2 == bare.fit.chi2
    assert again.laws["elasto-plastic"].fit.parameters["lambda"].prior.source == pmma.name


@pytest.mark.long
def test_a_law_with_too_few_data_for_its_aicc_is_not_compared(made, pmma):
    # Four data and three parameters: AICc has no value, whatever chi-squared says.
    table = made("elasto-plastic", 1).without(~np.isin(np.arange(V.size), [1, 6]))
    few = {n: table.values[n] for n in ("delta_mu", "mu1")}
    table = replace(table, values=few, errors={n: table.errors[n] for n in few})
    given = {"material": pmma, "fixed": {"eps_ratio": 0.48}, "starts": 8}
    with pytest.raises(InputError, match="got 1; elasto-plastic must have more data for its AICc"):
        compare(table, ("rice-ruina", "elasto-plastic"), ("A", "B", "lambda"), **given)
    comparison = compare(
        table, ("rice-ruina", "ruina-slip", "elasto-plastic"), ("A", "B", "lambda"), **given
    )
    assert list(comparison.not_compared) == ["elasto-plastic"]
    assert not comparison.decided
    assert "because there are too few data" in comparison.verdict


def test_a_law_without_an_aicc_is_not_compared(judged, monkeypatch):
    """Nor does the law that it extends do without further starts."""
    called = []

    def without_aicc(data, law, free, **options):
        called.append((law, options["further"]))
        options["start"] = {}
        result = fit(data, "rice-ruina", ("eps_ratio", "A"), **options)
        return replace(result, law=law, aicc=math.inf if law == "elasto-plastic" else result.aicc)

    monkeypatch.setattr("asperity.inference.comparison.compare.fit", without_aicc)
    comparison = judged("rice-ruina", 2, laws=("rice-ruina", "ruina-slip", "elasto-plastic"))
    assert [further for law, further in called if law == "rice-ruina"] == [False, True]
    assert list(comparison.not_compared) == ["elasto-plastic"]
    assert not comparison.decided
    assert "because there are too few data" in comparison.verdict


def spoiled_table(made, seed, *, outliers):
    """A table of 8 to 16 rows of a random law, with errors of 8 to 60 standard errors in rows."""
    random = np.random.default_rng([17, seed])
    law = LAWS[seed % len(LAWS)]
    table = made(law, seed)
    kept = random.permutation(V.size)[: (8, 12, 16)[seed % 3]]
    table = table.without(~np.isin(np.arange(V.size), kept))
    rows = np.sort(random.choice(table.rows, outliers, replace=False))
    for row in rows:
        size = math.exp(random.uniform(math.log(8), math.log(60)))
        name = ("delta_mu", "mu1")[random.integers(2)]
        table.values[name][row] += size * table.errors[name][row]
    return law, table, rows.tolist()


@pytest.mark.parametrize("outliers", population([2, 1]))
@draws(1, 6)
def test_outliers_that_hide_each_other_are_named_and_left_out(made, pmma, outliers, draws):
    right = 0
    for seed in range(2, 2 + draws):
        law, table, rows = spoiled_table(made, seed, outliers=outliers)
        free = [p for p in FREE if p in ("eps_ratio", "A") or p in SPECIAL.get(law, ())]
        result = fit(table, law, free, material=pmma, check_stiffness=False)
        right += sorted(result.outliers) == rows
        # The names of the table are told.
        (said,) = [w for w in result.warnings if "chi-squared would be as it should be" in w] or [
            ""
        ]
        assert all((str(table.row_names[row]) in said) for row in result.outliers)
    # Of 40 with two outliers 39 were named, of 70 with one 68; a row may be one that the fit can
    # follow.
    assert right >= draws - 1


@pytest.mark.long
def test_clean_tables_have_no_outliers_even_under_a_wrong_law(made, pmma):
    for seed in range(6):
        _, table, _ = spoiled_table(made, seed, outliers=0)
        for other in LAWS:
            free = [p for p in FREE if p in ("eps_ratio", "A") or p in SPECIAL.get(other, ())]
            result = fit(table, other, free, material=pmma, check_stiffness=False)
            assert result.outliers == ()


@pytest.mark.long
def test_a_row_at_the_edge_of_periodic_sliding_is_no_outlier():
    """Such a row is steep in the parameters, so that chi-squared has several minima."""
    law = "linker-dieterich"
    response = response_function(get_law(law), search="direct")
    truth, fixed, table = drawn_table(105, law, response, slow_point)
    comparison = compare(table, LAWS, ALL_FREE, fixed=fixed, evidence=False)
    assert comparison.best == law
    assert not comparison.left_out
    assert missed_by(comparison.laws[law].fit, truth) < 0.01


@pytest.mark.parametrize(
    "drawn",
    population(
        [
            ("elasto-plastic", 111, fast_point),
            ("linker-dieterich", 27, fast_point),
            ("linker-dieterich", 51, fast_point),
            ("linker-dieterich", 23, fast_point),
            ("linker-dieterich", 13, slow_point),
        ]
    ),
)
def test_the_minimum_next_to_the_truth_is_found(drawn):
    """Tables for which the best starts lead elsewhere: to other minima, or where no row is read."""
    law, seed, point = drawn
    response = response_function(get_law(law), search="direct" if point is slow_point else False)
    truth, fixed, table = drawn_table(seed, law, response, point)
    result = fit(table, law, list(truth), fixed=fixed)
    assert missed_by(result, truth) < 0.01
    assert result.p_value > 0.01


@pytest.mark.long
def test_ends_of_profiles_with_searched_orbits_have_the_rise_of_their_level():
    """Chi-squared of exact orbits, minimised at each end, is 1 and 3.84 above the minimum."""
    law = "rice-ruina"
    response = response_function(get_law(law), search="direct")
    truth, fixed, table = drawn_table(103, law, response, slow_point)
    result = fit(table, law, list(truth), fixed=fixed, profile=True)
    objective = result.objective
    assert objective.searches
    u = objective.coordinates(result.values)
    for i, unknown in enumerate(objective.unknowns):
        estimate = result.parameters[unknown.name]
        for ends, rise in ((estimate.interval_68, 1.0), (estimate.interval_95, 3.8415)):
            for end in ends:
                there = objective.minimise(u, {i: float(unknown.to_coordinate(end))})
                assert there.chi2 - result.chi2 == pytest.approx(rise, rel=0.02)


@pytest.mark.parametrize(
    "start", population([("--start", "eps_ratio=0.5", "--start", "lambda=0.6 um"), ()])
)
def test_the_command_leaves_outliers_out(made, tmp_path, monkeypatch, start):
    """Options of the command line go to the second round of fits, as to the first."""
    if start:
        monkeypatch.setattr(minima, "_FURTHER", 0)
        few = partial(compare, starts=1, evidence=False)
        monkeypatch.setattr("asperity.inference.answers.compare_loaded", few)
    law, table, rows = spoiled_table(made, 2, outliers=1 if start else 2)
    columns = {"V": table.points["V"], "epsilon": table.points["epsilon"]}
    columns["frequency"] = table.points["frequency"]
    for name in table.values:
        columns |= {name: table.values[name], f"{name}_err": table.errors[name]}
    path = tmp_path / "readings.csv"
    text = np.column_stack(list(columns.values()))
    np.savetxt(path, text, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    free = ("--free", "lambda,eps_ratio,A", "--material", "bureau2000", "--json")
    laws = ("--laws", "rice-ruina,elasto-plastic")
    done = CliRunner().invoke(main, ["compare", str(path), *laws, *free, *start])
    assert done.exit_code == 0, done.output
    record = json.loads(done.stdout)
    assert record["left_out"] == [f"row {row + 1}" for row in rows]
    assert all(name in record["verdict"] for name in record["left_out"])
    assert record["decided"]
    assert record["best"] == law == "elasto-plastic"
    assert not record["laws"][law]["excluded"]


def test_laws_of_a_recording_are_judged_by_the_likelihood_that_decides():
    """Its noise is estimated from what a law leaves: chi-squared is that of noise for every law."""
    run = next(runs_of(CASES["holds"], 1))
    laws = ["rice-ruina", "ruina-slip"]
    near = {name: TRUE[name] for name in ("A", "B", "D0")}
    comparison = compare(run, laws, ["A", "B", "D0"], evidence=False, starts=1, start=near)
    assert comparison.best == "rice-ruina"
    (out,) = [j for j in comparison.laws.values() if j.excluded]
    lower = comparison.laws["rice-ruina"].fit.log_likelihood - out.fit.log_likelihood
    assert out.why.endswith(f"above that of rice-ruina, its log-likelihood {lower:.4g} lower")
    assert "chi-squared" not in comparison.verdict
    head, rows = laws_table(comparison)
    assert head[:3] == ("law", "log-likelihood", "AICc - lowest")
    assert [row[-1].partition(":")[0] for row in rows] == ["lowest AICc", "excluded"]
    undetermined = replace(out.fit, undetermined=("B", "c"))
    (row,) = laws_table(judge({"ruina-slip": undetermined}))[1]
    assert row[-1] == "lowest AICc; B, c not determined"


class _Run(SimpleNamespace):
    """A recording that begins at `origin`."""

    origin = 0.0
    recorded_times = RecordedRun.recorded_times


class _Motion(SimpleNamespace):
    """A recording's part of an objective, with a motion that is what a fit says."""

    def fitted_friction(self, values):
        return values["friction"]


def _fit_with(law, run, friction, aicc=0.0, **about):
    white = Autoregression(np.zeros(0), 1e-6)
    term = _Motion(run=run, name=run.name, models=[white], doubts=(), basis=None)
    vars(term).update(about)
    data = residuals_at((run.friction - friction) / 1e-3)
    parts = [(term, data)]
    return SimpleNamespace(
        law=law, values={"friction": friction}, aicc=aicc, residuals=(data,), parts=lambda _: parts
    )


def residuals_at(values):
    return Residuals(values, np.empty((values.size, 0)), np.array([]), np.array([]), 0.0)


@pytest.mark.parametrize(("jumps", "doubted"), [((), False), ((41.0,), True), ((70.0,), False)])
def test_a_verdict_names_the_stretch_that_it_rests_on_and_its_doubts_first(jumps, doubted):
    time = np.linspace(0, 100, 2001)
    noise = 1e-3 * np.random.default_rng(3).standard_normal(time.size)
    run = _Run(name="run", time=time, friction=0.6 + noise, jumps=jumps, stretches=[(0, time.size)])
    # Times of the verdict are those of the recording, as of a window.
    run.origin = 300.0
    wrong = np.where((time > 40) & (time < 42), 0.61, 0.6)
    best = _fit_with("good", run, np.full(time.size, 0.6))
    # Outside the stretch the two are one law: it alone excludes the other, if that is excluded.
    for aicc, rests in ((200.0, True), (9.0, False)):
        doubt, stretch = support(best, _fit_with("poor", run, wrong, aicc))
        said = doubt if rests else stretch
        begin, end = map(float, re.search(r"(?:in|on) (\S+) to (\S+) s of run", said).groups())
        assert 339 < begin < 341
        assert 341 < end < 343
        assert ("it rests on" in doubt) is rests
        assert ("the recording jumps at 341 s" in doubt) is doubted
    # An error everywhere rests on no stretch.
    everywhere = _fit_with("poor", run, np.full(time.size, 0.61), 1e3)
    doubt, stretch = support(best, everywhere)
    assert "it rests on" not in doubt + stretch
    doubt, _ = support(_fit_with("good", run, wrong, doubts=("it misses",)), everywhere)
    assert "even under good it misses" in doubt


def test_a_verdict_rests_on_no_sample_that_is_left_out():
    time = np.linspace(0, 100, 2001)
    friction = 0.6 + 1e-3 * np.random.default_rng(3).standard_normal(time.size)
    friction[500] += 100.0
    run = _Run(name="run", time=time, friction=friction, jumps=(), stretches=[(0, time.size)])
    poor = _fit_with("poor", run, np.where((time > 40) & (time < 42), 0.61, 0.6) - 1e-4, 200.0)
    said = [
        " ".join(support(_fit_with("good", run, np.full(time.size, 0.6), basis=basis), poor))
        for basis in (np.eye(1, time.size, 500).T, None)
    ]
    assert re.search(r"rests on 40 to 41.95 s of run", said[0])
    assert not re.search(r"rests on 40 to", said[1])


def test_a_verdict_that_changes_with_the_window_says_so_first():
    time = np.linspace(0, 100, 2001)
    friction = np.where(time < 50, 0.6, 0.601)
    run = _Run(name="run", time=time, friction=friction, jumps=(), stretches=[(0, time.size)])
    best = _fit_with("good", run, np.where(time < 50, 0.6, 0.6012))
    # Squares of the halves: 0 and 40 of the better law, 250 and 0 of the other; 210 in all.
    other = _fit_with("poor", run, np.where(time < 50, 0.6005, 0.601), 210.0)
    doubt, _ = support(best, other)
    assert "changes with the window: the second half of run alone is for poor, by 40" in doubt
    assert "first half" not in doubt


def test_a_stretch_of_one_recording_has_no_part_in_what_another_decides():
    """A second recording alone tells the laws apart; the first is for the other law."""
    time = np.linspace(0, 100, 2001)
    run = _Run(name="run", time=time, friction=np.full(2001, 0.6), jumps=(), stretches=[(0, 2001)])
    for late, of_second, doubts in ((0.6002, 500.8, ""), (0.61, 3000.0, "run alone is for poor")):
        best = _fit_with("good", run, np.where(time > 99, late, 0.6))
        poor = _fit_with("poor", run, run.friction, 500.0 if not doubts else 1000.0)
        best.residuals += (residuals_at(np.zeros(1)),)
        poor.residuals += (residuals_at(np.array([of_second**0.5])),)
        doubt, stretch = support(best, poor)
        assert "run" not in stretch
        assert "rests on" not in doubt
        assert (doubts in doubt) if doubts else not doubt
