"""The parabola of chi-squared at a minimum, and intervals near a bound."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of
from scipy.stats import norm

from asperity.inference import Prior, RunOptions, fit
from asperity.inference.fitting.assembly import Given, listed_data, objective_of
from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.intervals import bounded_interval
from asperity.inference.fitting.parabola import nowhere_negative, parabola_of
from asperity.inference.unknowns import unknowns_of
from asperity.laws import get_law
from references.populations import population


def objective_for(run, law, free, start):
    given = Given(fixed={}, material=None, prior=None, start=start)
    return objective_of(get_law(law), listed_data(run, RunOptions()), free, given)


def test_a_covariance_added_by_noise_is_made_nowhere_negative():
    """Parameters of standard deviations 1e5 and 1, of which the first two are nearly equal."""
    covariance = np.array([[1e10, 0.9999e10, 0.0], [0.9999e10, 1e10, 0.0], [0.0, 0.0, 1.0]])
    added = np.array([[-2e7, 1e7, 10.0], [1e7, 3e8, 0.0], [10.0, 0.0, 0.02]])
    rounded = nowhere_negative(added, covariance)
    scaled = rounded / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.linalg.eigvalsh(scaled).min() > -1e-12
    assert (np.diag(covariance + rounded) >= np.diag(covariance)).all()
    np.testing.assert_allclose(rounded[1:, 1:], added[1:, 1:], rtol=0.02, atol=0.1)


def test_a_positive_covariance_added_by_noise_is_unchanged():
    root = np.random.default_rng(0).normal(size=(4, 4)) * [1e-3, 1.0, 1e4, 1.0]
    added = root.T @ root
    np.testing.assert_allclose(nowhere_negative(added, 20 * added), added, rtol=1e-10)


@pytest.mark.parametrize(
    ("law", "name", "start"),
    [
        ("elasto-plastic", "lambda", 1e-9),
        ("elasto-plastic", "lambda", None),
        ("linker-dieterich", "alpha", 0.01),
    ],
)
def test_whether_data_determine_a_parameter_does_not_depend_on_its_start(law, name, start):
    """With a start far below it, an estimate good to 7 % was said to be not determined."""
    given = {} if start is None else {name: start}
    (one,) = unknowns_of(get_law(law), [name], start=given, priors={})
    usual = np.sqrt(one.start[0] * one.start[1]) if start is None else 1000 * start
    u = float(one.to_coordinate(usual))
    assert one.to_coordinate(usual / 15) < one.widest(u) < one.to_coordinate(1.5 * usual)
    # The range of a posterior includes ten standard deviations.
    sd = float(one.to_coordinate(usual / 15))
    assert one.range_about(u, sd)[1] >= u + 10 * sd


@pytest.mark.parametrize("name", ["lambda", "A"])
def test_the_range_of_a_posterior_holds_an_estimate_that_contradicts_its_prior(name):
    """Twenty standard deviations of the prior away."""
    prior = {name: Prior(1e-6, 5e-8, "")}
    (one,) = unknowns_of(get_law("elasto-plastic"), [name], start={}, priors=prior)
    u = float(one.to_coordinate(2e-6))
    low, high = one.range_about(u, 0.01)
    assert low < u - 0.09
    assert high > u + 0.09
    assert low <= one.to_coordinate(6e-7)


def test_a_bound_of_a_delay_shifts_no_other_estimate():
    """A delay beyond its bound is estimated at the bound, and the others with it."""
    (run,) = runs_of(CASES["steps"], 1)
    objective = fit(run, "rice-ruina", ["A", "B", "D0"], start=TRUE, starts=1).objective
    at = objective.names.index("step_time_1")
    u, _ = objective.minimise(objective.coordinates({**TRUE, "step_time_1": 0, "step_time_2": 0}))
    free = parabola_of(objective, u, objective.chi2(u))
    unknowns = list(objective.unknowns)
    # The bound is three standard deviations from the estimate.
    bound = float(unknowns[at].to_value(u[at] + 3 * free.sd[at]))
    unknowns[at] = replace(unknowns[at], lower=bound, upper=1.05 * bound)
    narrow = replace(objective, unknowns=tuple(unknowns))
    u, chi2 = narrow.minimise(u)
    bounded = parabola_of(narrow, u, chi2)
    assert chi2 > free.chi2 + 8
    others = np.arange(u.size) != at
    shifts = (bounded.unbounded - u)[others] / bounded.sd[others]
    assert np.abs(shifts).max() < 0.05


def test_each_estimate_lies_in_its_interval_in_a_flat_valley():
    """A minimisation may stop in the valley, far from the minimum of the parabola there."""
    (run,) = runs_of(CASES["steps"], 1)
    start = {**TRUE, "c": 3.0}
    objective = objective_for(run, "nagata", ["A", "B", "D0", "c"], start)
    u, _ = objective.minimise(
        np.array([float(k.to_coordinate(k.middle)) for k in objective.unknowns])
    )
    random = np.random.default_rng(7)
    for _ in range(2):
        # Along the least determined direction, towards larger c, A and B.
        values, vectors = np.linalg.eigh(np.linalg.pinv(_information(objective, u)))
        along = vectors[:, -1] * np.sign(vectors[list(objective.names).index("c"), -1])
        moved = u + random.uniform(0.5, 3.0) * np.sqrt(values[-1]) * along
        moved[list(objective.names).index("c")] = abs(moved[list(objective.names).index("c")])
        result = described_fit(objective, [(moved, objective.chi2(moved))], profile=False)
        for unknown in objective.unknowns:
            p = result.parameters[unknown.name]
            for low, high in (p.interval_68, p.interval_95):
                assert low <= p.value <= high
                if not unknown.nuisance:
                    # An end outside the range of the search is open.
                    sd = p.se / abs(unknown.slope(p.value))
                    first, last = unknown.range_about(float(unknown.to_coordinate(p.value)), sd)
                    assert low in (0.0, -np.inf) or low >= unknown.to_value(first) * 0.999
                    assert high == np.inf or high <= unknown.to_value(last) * 1.001


def _information(objective, u):
    _, jacobian = objective.residuals(u)
    return jacobian.T @ jacobian


@pytest.mark.parametrize("seed", population(3))
def test_minima_that_differ_in_the_order_of_two_states_are_one(seed):
    random = np.random.default_rng(seed)
    (run,) = runs_of(CASES["steps"], 1, seed=seed)
    free = ["A", "B", "D0", "B2", "D2"]
    start = {**TRUE, "B2": 0.1 * TRUE["B"], "D2": random.uniform(5, 15) * TRUE["D0"]}
    objective = objective_for(run, "two-state", free, start)
    u = objective.ordered(objective.coordinates({k.name: k.middle for k in objective.unknowns}))
    for name, value in start.items():
        u[list(objective.names).index(name)] = float(
            objective.unknowns[list(objective.names).index(name)].to_coordinate(value)
        )
    values = objective.named(u)
    mirrored = values | {"B": values["B2"], "D0": values["D2"]}
    mirrored |= {"B2": values["B"], "D2": values["D0"]}
    v = objective.coordinates(mirrored)
    # Exchanged states are the same law and have the same residuals.
    np.testing.assert_allclose(objective.residuals(v)[0], objective.residuals(u)[0], atol=1e-3)
    np.testing.assert_allclose(objective.ordered(v), u, rtol=1e-12)
    result = described_fit(
        objective, [(v, objective.chi2(v)), (u, objective.chi2(u))], profile=False
    )
    assert result.values["D0"] == pytest.approx(values["D0"])
    assert result.values["B2"] == pytest.approx(values["B2"])
    assert result.optima == ()
    # A second state of negative B2 cannot become the first one.
    negative = objective.coordinates(mirrored | {"B2": -0.001, "D2": 1e-7})
    np.testing.assert_array_equal(objective.ordered(negative), negative)


#: Feldman and Cousins (1998), Table X: estimate in standard deviations from the bound, and the
#: intervals of 68.27, 90 and 95 %.
PUBLISHED = {
    -3.0: [(0.0, 0.04), (0.0, 0.26), (0.0, 0.42)],
    -1.0: [(0.0, 0.27), (0.0, 0.81), (0.0, 1.10)],
    0.0: [(0.0, 1.00), (0.0, 1.64), (0.0, 1.96)],
    1.0: [(0.24, 2.00), (0.0, 2.64), (0.0, 2.96)],
    2.0: [(1.00, 3.00), (0.58, 3.64), (0.35, 3.96)],
}


@pytest.mark.parametrize("estimate", PUBLISHED)
def test_bounded_intervals_are_the_published_ones(estimate):
    intervals = [bounded_interval(estimate, 1.0, c, 0.0, math.inf) for c in (0.6827, 0.9, 0.95)]
    np.testing.assert_allclose(intervals, PUBLISHED[estimate], atol=0.0051)


def test_far_from_bounds_the_interval_is_the_normal_one():
    low, high = bounded_interval(5.0, 0.1, 0.95, 0.0, math.inf)
    np.testing.assert_allclose([low, high], [5 - 0.1959964, 5 + 0.1959964], rtol=1e-6)


def test_the_interval_near_an_upper_bound_is_the_mirror_image():
    low, high = bounded_interval(-1.0, 1.0, 0.9, 0.0, math.inf)
    mirrored = bounded_interval(1.0, 1.0, 0.9, -math.inf, 0.0)
    np.testing.assert_allclose(mirrored, (-high, -low), atol=1e-9)


@pytest.mark.parametrize("estimate", [-3.0, 0.1, 0.5, 4.0])
def test_between_narrow_bounds_the_interval_is_the_whole_range(estimate):
    assert bounded_interval(estimate, 1.0, 0.95, 0.0, 0.5) == (0.0, 0.5)


@pytest.mark.parametrize("truth", population([0.3, 0.0, 1.5]))
def test_bounded_intervals_contain_the_truth_as_often_as_stated(truth):
    # Estimates at the midpoints of equal probabilities: the share is exact to two estimates.
    count = 200
    estimates = truth + norm.ppf((np.arange(count) + 0.5) / count)
    inside = [
        low <= truth <= high
        for low, high in (bounded_interval(x, 1.0, 0.9, 0.0, math.inf) for x in estimates)
    ]
    # For a truth at the bound, estimates beyond the bound always cover it: more often, not less.
    assert np.mean(inside) >= 0.9 - 2 / count
