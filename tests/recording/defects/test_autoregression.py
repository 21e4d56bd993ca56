"""Autoregressive noise against closed forms."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import multivariate_normal

from asperity.recording.defects.autoregression import (
    Autoregression,
    _reflections,
    _reflections_of_smooth,
    fitted,
)


def process(order_two=(1.2, -0.5), n=4000, seed=0):
    """An AR(2) of innovations of unit variance, started long before."""
    steps = np.random.default_rng(seed).normal(size=n + 500)
    return lfilter([1.0], [1.0, -order_two[0], -order_two[1]], steps)[500:]


def test_coefficients_and_variance_of_a_known_process():
    found = fitted([process()], order=2)
    # Standard errors of the coefficients: sqrt((1 - a2^2)/n) = 0.014.
    np.testing.assert_allclose(found.coefficients[-1], [1.2, -0.5], atol=0.05)
    assert found.innovation == pytest.approx(1.0, abs=0.04)


def test_sums_of_products_and_prediction_errors_give_the_same_process():
    random = np.random.default_rng(5)
    stretches = [lfilter([1.0], [1.0, -0.99], random.normal(size=(4, n))) for n in (700, 90)]
    quick, direct = (f(stretches, 40) for f in (_reflections, _reflections_of_smooth))
    np.testing.assert_allclose(quick, direct, atol=1e-12)
    # Of a trend hardly anything is left to predict, less than the rounding of the sums.
    smooth = [np.linspace(0, 1, 400)[None] ** 3]
    assert _reflections(smooth, 40) == _reflections_of_smooth(smooth, 40)


def test_the_likelihood_is_that_of_the_whole_covariance():
    noise = Autoregression(np.array([0.8, -0.5, 0.1]), 2.5)
    x = np.random.default_rng(1).normal(size=9)
    # Autocovariance of the process from its spectrum.
    frequency = np.arange(4096) / 4096
    spectrum = noise.spectrum(frequency)
    covariance = np.fft.ifft(spectrum).real[:9]
    assert covariance[0] == pytest.approx(2.5, rel=1e-9)
    expected = multivariate_normal(np.zeros(9), toeplitz(covariance)).logpdf(x)
    white = noise.whiten(x[:, None])[:, 0]
    found = -0.5 * (white @ white + 9 * np.log(2 * np.pi)) - noise.log_scale(9)
    assert found == pytest.approx(expected, rel=1e-9)


def test_effective_samples_are_those_of_the_mean():
    # A mean of n samples of an AR(1) has the variance s^2/n (1 + a)/(1 - a) for large n.
    noise = Autoregression(np.array([0.9]), 1.0)
    assert noise.effective_samples(1000) == pytest.approx(1000 * 0.1 / 1.9)
    assert Autoregression(np.zeros(0), 1.0).effective_samples(50) == 50


def test_a_single_sample_that_is_off_is_measured_as_by_generalised_least_squares():
    noise = Autoregression(np.array([0.8, -0.5, 0.1]), 2.5)
    x = np.random.default_rng(4).normal(size=40)
    covariance = toeplitz(np.fft.ifft(noise.spectrum(np.arange(4096) / 4096)).real[:40])
    inverse = np.linalg.inv(covariance)
    found = noise.departures_of_single_samples(noise.whiten(x[:, None])[:, 0])
    # The first samples are predicted by lower orders, which the formula leaves out.
    for k in (5, 20, 38, 39):
        spike = inverse[k]
        assert found[k] == pytest.approx(spike @ x / np.sqrt(inverse[k, k]), rel=1e-9)
