"""Integration on the grid of the fast method, against closed forms."""

import numpy as np
import pytest

from asperity.algebra.fourier_grid import antiderivative, grid


@pytest.mark.parametrize("nodes", [8, 24, 32])
def test_the_antiderivative_of_each_wave_is_exact(nodes):
    tau, integral = grid(nodes)
    k = np.arange(1, nodes // 2)
    angle = np.outer(tau, k)
    shift = 0.1 * k  # neither even nor odd
    expected = np.sin(angle - shift) / k
    np.testing.assert_allclose(
        antiderivative(integral, np.cos(angle - shift)), expected, atol=1e-14
    )


def test_half_of_the_products_are_the_whole_product_for_any_rates_and_even_weights():
    tau, integral = grid(24)
    rates = np.random.default_rng(0).normal(size=(24, 5))
    weighted = integral * (1 + 0.3 * np.cos(tau))
    np.testing.assert_allclose(antiderivative(weighted, rates), weighted @ rates, atol=1e-14)
