"""Noise of a recording: misfits, wrong samples, and the uncertainty of estimated noise."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.optimize import brentq
from scipy.signal import lfilter
from scipy.stats import norm, t

from asperity.inference.runs.noise import (
    added_by_noise,
    added_without,
    innovations,
    largest_departure,
    misfit_after_changes,
    whiteness,
    wrong_samples,
)
from asperity.recording.defects.autoregression import Autoregression, fitted


def autocovariances(a, n):
    """Autocovariances of an AR(2) process of unit innovations, from its spectrum."""
    angle = 2 * np.pi * np.arange(8192) / 8192
    transfer = 1 - a[0] * np.exp(-1j * angle) - a[1] * np.exp(-2j * angle)
    return np.fft.ifft(1 / np.abs(transfer) ** 2).real[:n]


def model_of(a):
    """The same process by its partial correlations."""
    return Autoregression(np.array([a[0] / (1 - a[1]), a[1]]), autocovariances(a, 1)[0])


def test_the_whitening_of_the_first_samples_inverts_their_covariance():
    a = (1.2, -0.5)
    root = model_of(a).whitening.first
    inverse = np.linalg.inv(toeplitz(autocovariances(a, 2)))
    np.testing.assert_allclose(root.T @ root, inverse, rtol=1e-10)


@pytest.mark.parametrize("noise", [np.resize([1.0, -1.0], 400), np.arange(400.0)])
def test_predictable_noise_adds_finite_covariance(noise):
    model, curves = fitted([noise]), np.sin(np.arange(400) / 30)[:, None]
    added, variance = added_by_noise(model, curves, np.zeros((400, 0)), np.eye(1))
    assert np.isfinite(added).all()
    assert np.isfinite(variance).all()


def test_the_covariance_without_a_sample_is_that_of_the_other_samples():
    a, n = np.array([1.2, -0.5]), 300
    s, covariance = np.arange(n) / n, toeplitz(autocovariances(a, n))
    # The first parameter is known by sample 150 to a hundredth of what the others say.
    X = np.stack([np.sin(9 * s), np.sin(9 * s) + s**2, np.ones(n)], axis=1)
    X[150, 0] += 1e4

    def of(kept):
        information = X[kept].T @ np.linalg.solve(covariance[np.ix_(kept, kept)], X[kept])
        return np.linalg.inv(information)[:2, :2]

    everything = np.arange(n)
    known = of(everything)
    noise, stretches = [model_of(a).whitening], [(0, n)]
    white = innovations(X, noise, stretches)
    basis = np.linalg.qr(white[:, 2:])[0]
    white = white[:, :2] - basis @ (basis.T @ white[:, :2])
    added, alone = added_without([20, 150], white, known, noise, stretches, basis, 0.99)
    assert alone == [150]
    np.testing.assert_allclose(known + added, of(np.delete(everything, 150)), rtol=1e-4)
    # The velocity of a recording of load steps may not change: its fit ended in an error of NumPy.
    added, alone = added_without([], white, known, noise, stretches, basis, 0.99)
    assert not added.any()
    assert alone == []


def test_innovations_of_zeros_are_zero():
    zeros = np.zeros(400)
    np.testing.assert_array_equal(fitted([zeros]).whiten(zeros), zeros)


def test_the_added_covariance_is_that_of_estimated_coefficients():
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
    # The ends of the stretch, 2 of 400 samples, are neglected.
    np.testing.assert_allclose(added, expected[:2, :2], rtol=0.03, atol=0.01 * expected[0, 0])


def test_degrees_of_freedom_of_a_mean_agree_with_their_closed_form():
    # s^2/(n (1 - a)^2), with the variances (1 - a^2)/n of a and 2/n of ln s^2.
    a, n = 0.9, 200_000
    model = Autoregression(np.array([a]), 1 / (1 - a * a))
    covariance = np.array([[1 / (n * (1 - a) ** 2)]])
    _, variance = added_by_noise(model, np.ones((n, 1)), np.zeros((n, 0)), covariance)
    expected = (4 * (1 + a) / (1 - a) + 2) / n
    assert variance[0] / covariance[0, 0] ** 2 == pytest.approx(expected, rel=2e-3)


@pytest.mark.long
def test_intervals_with_estimated_noise_contain_the_truth_as_often_as_stated():
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


def test_the_probability_of_a_misfit_after_changes_is_not_too_small():
    random = np.random.default_rng(2)
    changes = (200, 500)
    chances = [misfit_after_changes(random.normal(size=1000), changes)[0] for _ in range(300)]
    # Three spans, by Bonferroni: at most as often as stated.
    assert np.mean(np.array(chances) < 0.1) < 0.1 + 3 * np.sqrt(0.09 / 300)
    spoiled = random.normal(size=1000)
    spoiled[500:520] *= 3
    chance, size = misfit_after_changes(spoiled, changes)
    assert chance < 1e-4
    assert size > 1.5


def test_whiteness_is_rejected_for_a_line_and_for_correlated_noise():
    steps = np.random.default_rng(0).normal(size=2500)
    correlated = lfilter([1.0], [1.0, -1.2, 0.5], steps)[500:]
    x = np.random.default_rng(2).normal(size=2000)
    assert whiteness([x], 0) > 0.01
    line = 0.5 * np.cos(0.7 * np.arange(2000))
    assert whiteness([x + line], 0) < 1e-6
    assert whiteness([correlated], 0) < 1e-6


def test_whiteness_is_rejected_as_often_as_stated():
    rejected = [
        whiteness([np.random.default_rng(seed).normal(size=300)], 0) < 0.1 for seed in range(300)
    ]
    assert 0.03 < np.mean(rejected) < 0.1 + 3 * np.sqrt(0.09 / 300)


def decays(n):
    """An offset, and curves that change quickly at two thirds of the samples."""
    s = np.arange(n) / n - 2 / 3
    return np.stack(
        [np.ones(n), np.where(s > 0, np.exp(-30 * s), 0), np.where(s > 0, s, 0)], axis=1
    )


def noises(a, n, sets):
    """Samples of an AR(2) process of unit innovations; a row is a set."""
    white = np.random.default_rng(5).normal(size=(sets, n + 500))
    return lfilter([1.0], [1.0, -a[0], -a[1]], white, axis=1)[:, 500:]


def wrong_in(values, model, stretches, most=20):
    whitening = [model.whitening] * len(stretches)
    white = innovations(np.column_stack([values, decays(values.size)]), whitening, stretches)
    return wrong_samples(white[:, 0], white[:, 1:], whitening, stretches, most)


def departure(values, a, k, known=()):
    """Departure of an impulse at k, with impulses at `known`, by generalised least squares."""
    n = values.size
    root = np.linalg.cholesky(np.linalg.inv(toeplitz(autocovariances(a, n)))).T
    without = np.column_stack([decays(n), *np.eye(n)[list(known)]])
    squares = [
        np.linalg.lstsq(root @ X, root @ values, rcond=None)[1][0]
        for X in (without, np.column_stack([without, np.eye(n)[k]]))
    ]
    return np.sqrt((squares[0] - squares[1]) * (n - without.shape[1] - 1) / squares[1])


# At the beginning, at the end, and next to the change of the curves.
@pytest.mark.parametrize("k", [0, 1, 100, 199, 201, 202, 299])
def test_wrong_samples_are_those_of_least_squares_with_an_impulse(k):
    a, n = (1.2, -0.5), 300
    (values,) = noises(a, n, 1)
    limit = largest_departure(n)
    assert 2 * n * norm.sf(limit) == pytest.approx(1e-3)
    impulse, near = np.eye(n)[k], range(max(k - 2, 0), min(k + 3, n))

    def excess(size):
        return max(departure(values + size * impulse, a, j) for j in near) - limit

    size = brentq(excess, 0, 200, xtol=1e-4)
    above, below = (values + share * size * impulse for share in (1.001, 0.999))
    expected = max(near, key=lambda j: departure(above, a, j))
    assert wrong_in(above, model_of(a), [(0, n)]) == [expected]
    assert wrong_in(below, model_of(a), [(0, n)]) == []


def test_a_sample_next_to_a_large_wrong_one_is_tested_without_it():
    a, n = (1.2, -0.5), 300
    (values,) = noises(a, n, 1)
    values[100] += 300.0

    def excess(size):
        return departure(values + size * np.eye(n)[101], a, 101, [100]) - largest_departure(n)

    size = brentq(excess, 0, 200, xtol=1e-4)
    for share, expected in ((1.001, [100, 101]), (0.999, [100])):
        spoiled = values + share * size * np.eye(n)[101]
        assert wrong_in(spoiled, model_of(a), [(0, n)]) == expected


def test_large_wrong_samples_hide_no_small_ones():
    a, n = (1.2, -0.5), 300
    (values,) = noises(a, n, 1)
    values += decays(n) @ [3.0, -20.0, 5.0]
    values[[80, 81, 200, 230]] += [300.0, 9.0, -12.0, 15.0]
    model = model_of(a)
    wide = Autoregression(model.reflection, 25 * model.variance)
    for m in (model, wide):
        assert wrong_in(values, m, [(0, n)]) == [80, 81, 200, 230]
        assert wrong_in(values, m, [(0, 150), (150, n)]) == [80, 81, 200, 230]
    # One sample more than the maximum reports that there are too many.
    assert len(wrong_in(values, model, [(0, n)], most=2)) == 3


def test_a_run_of_departing_samples_is_not_wrong():
    a, n = (0.5, 0.0), 300
    (values,) = noises(a, n, 1)
    values[[40, 41, 42, 100, 101, 102, 103]] += 20 * np.array([1, -1, 1, 1, -1, 1, -1])
    assert wrong_in(values, model_of(a), [(0, n)]) == [40, 41, 42]


def test_noise_is_taken_for_wrong_samples_as_rarely_as_designed():
    a, n, sets = (1.2, -0.5), 300, 400
    false_alarms = sum(bool(wrong_in(x, model_of(a), [(0, n)])) for x in noises(a, n, sets))
    # 0.4 are expected; four or more have a probability of 1e-3.
    assert false_alarms <= 3
