"""Narrow curved valleys: minima that are known in closed form."""

import numpy as np
import pytest

from asperity.inference.levenberg_marquardt import minimised


@pytest.mark.parametrize("steepness", [1e2, 1e4])
def test_a_curved_valley_is_followed_in_few_steps(steepness):
    """Residuals (y - exp x) steepness, x - 3 from x = -1: the minimum is (3, e^3)."""
    calls = 0

    def residuals(u):
        nonlocal calls
        calls += 1
        x, y = u
        r = np.array([steepness * (y - np.exp(x)), x - 3.0])
        return r, np.array([[-steepness * np.exp(x), steepness], [1.0, 0.0]])

    low, high = np.full(2, -100.0), np.full(2, 100.0)
    end = minimised(residuals, np.array([-1.0, np.exp(-1.0)]), low, high, 200)
    # A decrease of 1e-4 is none: a hundredth of a standard error.
    assert end == pytest.approx([3.0, np.exp(3.0)], abs=0.011 * np.exp(3.0))
    assert calls < 120  # straight steps alone: 992, and more than 2000


def test_bounds_and_places_without_residuals_are_kept_off():
    def residuals(u):
        r = np.array([u[0] + 2.0, u[1] - 1.0])
        return (r if u[1] < 1.5 else np.array([np.nan])), np.eye(2)

    end = minimised(
        residuals, np.array([5.0, 0.0]), np.array([1.0, -9.0]), np.array([9.0, 9.0]), 50
    )
    np.testing.assert_allclose(end, [1.0, 1.0], atol=0.01)
