"""Intervals beside a bound: the published table, and the share that holds the truth."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from asperity.inference.fitting.intervals import bounded_interval
from references.populations import population

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
