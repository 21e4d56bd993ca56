"""Noise of a recording: misfits against chance, and what estimating it adds to uncertainties."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from scipy.stats import norm, t

from asperity.inference.runs.noise import added_by_noise, misfit_after_changes, whiteness
from asperity.recording.defects.autoregression import Autoregression, fitted


def autocovariances(a, n):
    """Of an AR(2) of innovations of unit variance, by its spectrum."""
    angle = 2 * np.pi * np.arange(8192) / 8192
    transfer = 1 - a[0] * np.exp(-1j * angle) - a[1] * np.exp(-2j * angle)
    return np.fft.ifft(1 / np.abs(transfer) ** 2).real[:n]


def model_of(a):
    """The same process by its partial correlations."""
    return Autoregression(np.array([a[0] / (1 - a[1]), a[1]]), autocovariances(a, 1)[0])


def test_the_first_samples_are_whitened_by_a_root_of_their_inverse_covariance():
    a = (1.2, -0.5)
    root = model_of(a).whitening.first
    inverse = np.linalg.inv(toeplitz(autocovariances(a, 2)))
    np.testing.assert_allclose(root.T @ root, inverse, rtol=1e-10)


@pytest.mark.parametrize("noise", [np.resize([1.0, -1.0], 400), np.arange(400.0)])
def test_noise_that_can_be_predicted_adds_finite_covariance(noise):
    model, curves = fitted([noise]), np.sin(np.arange(400) / 30)[:, None]
    added, variance = added_by_noise(model, curves, np.zeros((400, 0)), np.eye(1))
    assert np.isfinite(added).all()
    assert np.isfinite(variance).all()


def test_a_stretch_without_noise_has_innovations_of_zero():
    zeros = np.zeros(400)
    np.testing.assert_array_equal(fitted([zeros]).whiten(zeros), zeros)


def test_the_added_covariance_is_that_of_estimates_that_follow_the_coefficients():
    a, n = np.array([1.2, -0.5]), 400
    s = np.arange(n) / n
    # A decay after a change, a slow wave; and an offset that is eliminated.
    X = np.stack([np.where(s > 0.4, np.exp(-8 * (s - 0.4)), 0), np.sin(7 * s), np.ones(n)], axis=1)

    def estimator(a):
        inverse = np.linalg.inv(toeplitz(autocovariances(a, n)))
        return np.linalg.solve(X.T @ inverse @ X, X.T @ inverse)

    step = 1e-5
    slopes = [(estimator(a + step * e) - estimator(a - step * e)) / (2 * step) for e in np.eye(2)]
    noise = toeplitz(autocovariances(a, n))
    of_coefficients = np.linalg.inv(toeplitz(autocovariances(a, 2))) / n
    expected = sum(
        of_coefficients[k, m] * slopes[k] @ noise @ slopes[m].T for k in range(2) for m in range(2)
    )
    model = model_of(a)
    white = model.whiten(X)
    covariance = np.linalg.inv(white.T @ white)[:2, :2]
    basis, triangle = np.linalg.qr(white[:, 2:])
    curves = X[:, :2] - X[:, 2:] @ np.linalg.solve(triangle, basis.T @ white[:, :2])
    added, _ = added_by_noise(model, curves, basis, covariance)
    # The ends of the stretch, some 2 of 400 samples.
    np.testing.assert_allclose(added, expected[:2, :2], rtol=0.03, atol=0.01 * expected[0, 0])


def test_degrees_of_freedom_of_a_mean_in_closed_form():
    # s^2/(n (1 - a)^2), with the variances (1 - a^2)/n of a and 2/n of ln s^2.
    a, n = 0.9, 200_000
    model = Autoregression(np.array([a]), 1 / (1 - a * a))
    covariance = np.array([[1 / (n * (1 - a) ** 2)]])
    _, variance = added_by_noise(model, np.ones((n, 1)), np.zeros((n, 0)), covariance)
    expected = (4 * (1 + a) / (1 - a) + 2) / n
    assert variance[0] / covariance[0, 0] ** 2 == pytest.approx(expected, rel=2e-3)


@pytest.mark.long
def test_intervals_cover_where_those_under_known_noise_do_not():
    n, order, sets = 120, 12, 600
    s = np.arange(n) / n
    X = np.stack([np.where(s > 0.5, np.exp(-6 * (s - 0.5)), 0), np.ones(n)], axis=1)
    inside = np.zeros((2, 2))
    for seed in range(sets):
        steps = np.random.default_rng(seed).normal(size=n + 200)
        y = lfilter([1.0], [1.0, -1.2, 0.4], steps)[200:]
        b, root = np.linalg.lstsq(X, y, rcond=None)[0], np.zeros((0, n))
        for _ in range(4):
            model = fitted([y - X @ b], order=order, parameters=2, uncertain=[root])
            white = model.whiten(X)
            information = white.T @ white
            b = np.linalg.solve(information, white.T @ model.whiten(y[:, None])[:, 0])
            root = np.linalg.solve(np.linalg.cholesky(information), X.T)
        covariance = np.linalg.inv(information)
        added, variance = added_by_noise(model, X, np.zeros((n, 0)), covariance)
        freedom = 2 * covariance[0, 0] ** 2 / variance[0]
        sd = np.sqrt([covariance[0, 0], covariance[0, 0] + added[0, 0]])
        for i, level in enumerate((0.6827, 0.95)):
            reach = [norm.ppf((1 + level) / 2), t.ppf((1 + level) / 2, freedom)]
            inside[:, i] += abs(b[0]) <= sd * reach
    known, estimated = inside / sets
    spread = np.sqrt(np.array([0.68 * 0.32, 0.95 * 0.05]) / sets)
    assert (np.abs(estimated - [0.6827, 0.95]) < 3 * spread).all(), estimated
    assert (known < [0.6827, 0.95] - 3 * spread).all(), known


def test_a_misfit_after_changes_is_told_from_chance():
    random = np.random.default_rng(2)
    changes = (200, 500)
    chances = [misfit_after_changes(random.normal(size=1000), changes)[0] for _ in range(300)]
    # Three spans, by Bonferroni: at most as often as it says.
    assert np.mean(np.array(chances) < 0.1) < 0.1 + 3 * np.sqrt(0.09 / 300)
    spoiled = random.normal(size=1000)
    spoiled[500:520] *= 3
    chance, size = misfit_after_changes(spoiled, changes)
    assert chance < 1e-4
    assert size > 1.5


def test_whiteness_tells_noise_from_a_line():
    steps = np.random.default_rng(0).normal(size=2500)
    correlated = lfilter([1.0], [1.0, -1.2, 0.5], steps)[500:]
    x = np.random.default_rng(2).normal(size=2000)
    assert whiteness([x], 0) > 0.01
    line = 0.5 * np.cos(0.7 * np.arange(2000))
    assert whiteness([x + line], 0) < 1e-6
    assert whiteness([correlated], 0) < 1e-6


def test_whiteness_rejects_as_often_as_it_says():
    rejected = [
        whiteness([np.random.default_rng(seed).normal(size=300)], 0) < 0.1 for seed in range(300)
    ]
    assert 0.03 < np.mean(rejected) < 0.1 + 3 * np.sqrt(0.09 / 300)
