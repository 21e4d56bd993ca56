"""Chi-squared about a minimum, and intervals beside a bound."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.coverage import CASES, TRUE, runs_of
from scipy.stats import norm

from asperity.inference import fit
from asperity.inference.fitting.description import described_fit
from asperity.inference.fitting.intervals import bounded_interval, nowhere_negative, parabola_of
from references.populations import population


def test_what_noise_adds_is_not_negative_by_rounding():
    """Of parameters of 1e5 and 1 standard deviations, the first two all but the same."""
    covariance = np.array([[1e10, 0.9999e10, 0.0], [0.9999e10, 1e10, 0.0], [0.0, 0.0, 1.0]])
    added = np.array([[-2e7, 1e7, 10.0], [1e7, 3e8, 0.0], [10.0, 0.0, 0.02]])
    found = nowhere_negative(added, covariance)
    scaled = found / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.linalg.eigvalsh(scaled).min() > -1e-12
    assert (np.diag(covariance + found) >= np.diag(covariance)).all()
    np.testing.assert_allclose(found[1:, 1:], added[1:, 1:], rtol=0.02, atol=0.1)


def test_what_noise_adds_stays_where_it_is_no_rounding():
    root = np.random.default_rng(0).normal(size=(4, 4)) * [1e-3, 1.0, 1e4, 1.0]
    added = root.T @ root
    np.testing.assert_allclose(nowhere_negative(added, 20 * added), added, rtol=1e-10)


def test_others_do_not_follow_a_delay_beyond_its_bound():
    """Where the pieces of the drive leave a delay no room, estimates are those at its bound."""
    (run,) = runs_of(CASES["steps"], 1)
    objective = fit(run, "rice-ruina", ["A", "B", "D0"], start=TRUE, starts=1).objective
    at = objective.names.index("step_time_1")
    u, _ = objective.minimise(objective.coordinates({**TRUE, "step_time_1": 0, "step_time_2": 0}))
    free = parabola_of(objective, u, objective.chi2(u))
    unknowns = list(objective.unknowns)
    # Three standard deviations off.
    bound = float(unknowns[at].to_value(u[at] + 3 * free.sd[at]))
    unknowns[at] = replace(unknowns[at], lower=bound, upper=1.05 * bound)
    narrow = replace(objective, unknowns=tuple(unknowns))
    u, chi2 = narrow.minimise(u)
    held = parabola_of(narrow, u, chi2)
    assert chi2 > free.chi2 + 8
    others = np.arange(u.size) != at
    off = (held.unbounded - u)[others] / held.sd[others]
    assert np.abs(off).max() < 0.05


def test_a_valley_that_is_all_but_flat_leaves_each_estimate_in_its_interval():
    """Where a minimisation has stopped on the way along it, the parabola's minimum is far off."""
    (run,) = runs_of(CASES["steps"], 1)
    term = fit(run, "nagata", ["A", "B", "D0", "c"], start={**TRUE, "c": 3.0}, starts=1)
    objective, u = term.objective, term.objective.coordinates(term.values)
    random = np.random.default_rng(7)
    for _ in range(5):
        # Along the direction that the data know least, where c and with it A and B are larger.
        values, vectors = np.linalg.eigh(np.linalg.pinv(_information(objective, u)))
        along = vectors[:, -1] * np.sign(vectors[list(objective.names).index("c"), -1])
        moved = u + random.uniform(0.5, 3.0) * np.sqrt(values[-1]) * along
        moved[list(objective.names).index("c")] = abs(moved[list(objective.names).index("c")])
        found = described_fit(objective, [(moved, objective.chi2(moved))], profile=False)
        for unknown in objective.unknowns:
            p = found.parameters[unknown.name]
            for low, high in (p.interval_68, p.interval_95):
                assert low <= p.value <= high
                if not unknown.nuisance:
                    # Ends beyond the range in which it is looked for are open.
                    sd = p.se / abs(unknown.slope(p.value))
                    first, last = unknown.range_about(float(unknown.to_coordinate(p.value)), sd)
                    assert low in (0.0, -np.inf) or low >= unknown.to_value(first) * 0.999
                    assert high == np.inf or high <= unknown.to_value(last) * 1.001


def _information(objective, u):
    _, jacobian = objective.residuals(u)
    return jacobian.T @ jacobian


@pytest.mark.parametrize("seed", population(3))
def test_exchangeable_states_are_one_minimum_in_order(seed):
    random = np.random.default_rng(seed)
    (run,) = runs_of(CASES["steps"], 1, seed=seed)
    free = ["A", "B", "D0", "B2", "D2"]
    begin = {**TRUE, "B2": 0.1 * TRUE["B"], "D2": random.uniform(5, 15) * TRUE["D0"]}
    objective = fit(run, "two-state", free, start=begin, starts=1).objective
    u = objective.ordered(objective.coordinates({k.name: k.middle for k in objective.unknowns}))
    for name, value in begin.items():
        u[list(objective.names).index(name)] = float(
            objective.unknowns[list(objective.names).index(name)].to_coordinate(value)
        )
    values = objective.named(u)
    mirrored = values | {"B": values["B2"], "D0": values["D2"]}
    mirrored |= {"B2": values["B"], "D2": values["D0"]}
    v = objective.coordinates(mirrored)
    # The law is the same: so are the residuals.
    np.testing.assert_allclose(objective.residuals(v)[0], objective.residuals(u)[0], atol=1e-3)
    np.testing.assert_allclose(objective.ordered(v), u, rtol=1e-12)
    found = described_fit(
        objective, [(v, objective.chi2(v)), (u, objective.chi2(u))], profile=False
    )
    assert found.values["D0"] == pytest.approx(values["D0"])
    assert found.values["B2"] == pytest.approx(values["B2"])
    assert found.optima == ()
    # A second state that weakens cannot be the first one.
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
def test_published_intervals(estimate):
    found = [bounded_interval(estimate, 1.0, c, 0.0, math.inf) for c in (0.6827, 0.9, 0.95)]
    np.testing.assert_allclose(found, PUBLISHED[estimate], atol=0.0051)


def test_far_from_bounds_it_is_the_normal_interval():
    low, high = bounded_interval(5.0, 0.1, 0.95, 0.0, math.inf)
    np.testing.assert_allclose([low, high], [5 - 0.1959964, 5 + 0.1959964], rtol=1e-6)


def test_an_upper_bound_is_the_mirror_image():
    low, high = bounded_interval(-1.0, 1.0, 0.9, 0.0, math.inf)
    found = bounded_interval(1.0, 1.0, 0.9, -math.inf, 0.0)
    np.testing.assert_allclose(found, (-high, -low), atol=1e-9)


@pytest.mark.parametrize("estimate", [-3.0, 0.1, 0.5, 4.0])
def test_where_bounds_leave_no_room_the_interval_is_the_whole_range(estimate):
    assert bounded_interval(estimate, 1.0, 0.95, 0.0, 0.5) == (0.0, 0.5)


@pytest.mark.parametrize("truth", population([0.3, 0.0, 1.5]))
def test_coverage(truth):
    # Estimates at the middles of equal probabilities: the share is exact to two of them.
    count = 200
    estimates = truth + norm.ppf((np.arange(count) + 0.5) / count)
    inside = [
        low <= truth <= high
        for low, high in (bounded_interval(x, 1.0, 0.9, 0.0, math.inf) for x in estimates)
    ]
    # At the bound itself estimates beyond it are certain to be covered: never less than asked.
    assert np.mean(inside) >= 0.9 - 2 / count
