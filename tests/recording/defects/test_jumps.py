"""Jumps of the level under correlated noise, and the autoregressive model of the noise."""

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
from asperity.recording.defects.jumps import _impulses, find_jumps


def ar1(random, n, correlation, size=4e-4):
    """AR(1) noise of standard deviation `size`, correlated over `correlation` samples."""
    a = np.exp(-1 / correlation)
    steps = size * np.sqrt(1 - a * a) * random.normal(size=n)
    return lfilter([1.0], [1.0, -a], steps, zi=[a * size * random.normal()])[0]


def test_false_jumps_are_as_rare_as_designed():
    """At any correlation, from white noise to a slow drift."""
    chance, alarms, traces = 0.1, 0, 0
    for correlation in (0.1, 1, 3, 10, 30, 100, 300, 1000):
        random = np.random.default_rng([1, int(10 * correlation)])
        for _ in range(25):
            noise = ar1(random, 1400, correlation)
            alarms += bool(find_jumps(noise, [(0, 1400)], chance))
            traces += 1
    assert alarms <= traces * chance + 3 * np.sqrt(traces * chance * (1 - chance))


@pytest.mark.parametrize("correlation", [1.0, 10.0, 100.0, 1000.0])
def test_planted_jumps_are_found_where_they_are(correlation):
    """A jump of ten standard deviations of the innovations is found at any correlation."""
    random = np.random.default_rng(int(correlation))
    innovation = 4e-4 * np.sqrt(1 - np.exp(-2 / correlation))
    for _ in range(5):
        values = ar1(random, 1400, correlation)
        first, second = 100 + random.integers(0, 500), 800 + random.integers(0, 500)
        values[first:] += 12 * innovation
        values[second:] -= 10 * innovation
        jumps = sorted(find_jumps(values, [(0, 1400)]))
        assert [jump.sample for jump in jumps] == [first, second]
        # The neighbours of a jump tell its size to about one innovation.
        sizes = [jump.size / innovation for jump in jumps]
        np.testing.assert_allclose(sizes, [12, -10], atol=4)


def test_the_size_of_a_jump_is_that_of_generalised_least_squares():
    noise = Autoregression(np.array([-0.4, -0.3, 0.1]), 2.5)
    steps = np.random.default_rng(4).normal(size=60)
    covariance = toeplitz(np.fft.ifft(noise.spectrum(np.arange(4096) / 4096)).real[:60])
    inverse = np.linalg.inv(covariance)
    size, departure = _impulses(noise, steps)
    # The first samples are predicted by lower orders, and the last have fewer successors.
    for k in (5, 30, 55):
        assert size[k] == pytest.approx(inverse[k] @ steps / inverse[k, k], rel=1e-9)
        # A jump among gradual changes of its size counts as none.
        assert departure[k] in (0.0, pytest.approx(size[k] * np.sqrt(inverse[k, k]), rel=1e-9))
    assert np.count_nonzero(departure) > 3


def test_a_transient_and_a_drift_are_not_taken_for_jumps():
    random = np.random.default_rng(3)
    time = np.arange(2000) / 10
    for seconds in (1.0, 2.0, 5.0):
        motion = 0.6 + 0.01 * np.exp(-time / seconds) + 1e-4 * time
        assert find_jumps(motion + ar1(random, 2000, 5.0), [(0, 2000)]) == []
    # The worst case: a stretch begins in the tail of a transient, after a longer stretch.
    transient = np.concatenate([np.zeros(400), 0.0224 * np.exp(-np.arange(800) / 20)])
    for _ in range(16):
        values = transient + 3e-4 * random.normal(size=1200)
        assert find_jumps(values, [(0, 375), (450, 1200)]) == []


def test_jumps_are_searched_within_each_stretch():
    """The levels of two stretches may differ."""
    values = ar1(np.random.default_rng(5), 1000, 5.0)
    values[500:] += 1.0
    assert find_jumps(values, [(0, 500), (500, 1000)]) == []
    values[700:] += 0.1
    assert [jump.sample for jump in find_jumps(values, [(0, 500), (500, 1000)])] == [700]
    # This stretch is too short for a decision.
    assert find_jumps(values, [(680, 720)]) == []


def test_coefficients_and_variance_of_a_known_process_are_fitted():
    innovations = np.random.default_rng(0).normal(size=4500)
    # The first 500 samples depend on the initial value.
    noise = fitted([lfilter([1.0], [1.0, -1.2, 0.5], innovations)[500:]], order=2)
    # Standard errors of the coefficients: sqrt((1 - a2^2)/n) = 0.014.
    np.testing.assert_allclose(noise.coefficients[-1], [1.2, -0.5], atol=0.05)
    assert noise.innovation == pytest.approx(1.0, abs=0.04)


def test_sums_of_products_and_prediction_errors_give_the_same_coefficients():
    random = np.random.default_rng(5)
    stretches = [lfilter([1.0], [1.0, -0.99], random.normal(size=(4, n))) for n in (700, 90)]
    quick, direct = (f(stretches, 40) for f in (_reflections, _reflections_of_smooth))
    np.testing.assert_allclose(quick, direct, atol=1e-12)
    # A trend is predicted so well that the rounding of the sums exceeds the errors.
    smooth = [np.linspace(0, 1, 400)[None] ** 3]
    assert _reflections(smooth, 40) == _reflections_of_smooth(smooth, 40)


def test_the_likelihood_is_that_of_the_whole_covariance():
    noise = Autoregression(np.array([0.8, -0.5, 0.1]), 2.5)
    x = np.random.default_rng(1).normal(size=9)
    covariance = np.fft.ifft(noise.spectrum(np.arange(4096) / 4096)).real[:9]
    assert covariance[0] == pytest.approx(2.5, rel=1e-9)
    expected = multivariate_normal(np.zeros(9), toeplitz(covariance)).logpdf(x)
    white = noise.whiten(x[:, None])[:, 0]
    log_likelihood = -0.5 * (white @ white + 9 * np.log(2 * np.pi)) - noise.log_scale(9)
    assert log_likelihood == pytest.approx(expected, rel=1e-9)


def test_effective_samples_are_those_of_the_variance_of_a_mean():
    # A mean of n samples of an AR(1) has the variance s^2/n (1 + a)/(1 - a) for large n.
    noise = Autoregression(np.array([0.9]), 1.0)
    assert noise.effective_samples(1000) == pytest.approx(1000 * 0.1 / 1.9)
    assert Autoregression(np.zeros(0), 1.0).effective_samples(50) == 50


def test_departures_of_single_samples_are_those_of_generalised_least_squares():
    noise = Autoregression(np.array([0.8, -0.5, 0.1]), 2.5)
    x = np.random.default_rng(4).normal(size=40)
    covariance = toeplitz(np.fft.ifft(noise.spectrum(np.arange(4096) / 4096)).real[:40])
    inverse = np.linalg.inv(covariance)
    departures = noise.departures_of_single_samples(noise.whiten(x[:, None])[:, 0])
    # The first samples are predicted by lower orders.
    for k in (0, 1, 2, 5, 20, 38, 39):
        spike = inverse[k]
        assert departures[k] == pytest.approx(spike @ x / np.sqrt(inverse[k, k]), rel=1e-9)
