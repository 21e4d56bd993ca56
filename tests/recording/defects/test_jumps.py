"""Jumps under correlated noise, autoregression, saturation, rounding, spikes and rows to avoid."""

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
from asperity.recording.defects.check import rows_to_avoid, usable_rows
from asperity.recording.defects.jumps import _impulses, find_jumps
from asperity.recording.defects.levels import coarsely_rounded, recorder_step, saturated
from asperity.recording.defects.sampling import rate_stretches
from asperity.recording.defects.spikes import away_from_changes, spikes, without


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


def test_saturation_is_found_on_its_side():
    random = np.random.default_rng(0)
    values = np.sin(np.arange(3000) / 100) + 0.01 * random.normal(size=3000)
    assert saturated(values) == []
    (top,) = saturated(np.minimum(values, 0.9))
    assert (top.side, top.value, top.usual) == ("largest", 0.9, 1)
    np.testing.assert_array_equal(top.rows, np.flatnonzero(values >= 0.9))
    sides = [level.side for level in saturated(np.clip(values, -0.8, 0.9))]
    assert sides == ["largest", "smallest"]
    # Three equal samples in a row are no chance where no others are equal.
    values[[500, 501, 502]] = 2.0
    assert [level.rows.tolist() for level in saturated(values)] == [[500, 501, 502]]
    values[501] = 1.9
    assert saturated(values) == []


@pytest.mark.parametrize("step", [0.01, 0.1])
def test_the_top_of_a_quantised_sine_is_not_saturated(step):
    values = np.round(np.sin(np.arange(5000) / 150) / step) * step
    assert saturated(values) == []
    assert len(saturated(np.minimum(values, 0.5))) == 1


def test_rounding_is_coarse_where_the_noise_is_finer():
    random = np.random.default_rng(1)
    values = np.cumsum(0.002 * random.normal(size=2000))
    share, step = coarsely_rounded(np.round(values, 2))
    assert share > 0.5
    assert step == pytest.approx(0.01)
    assert coarsely_rounded(np.round(values, 4)) is None
    assert coarsely_rounded(np.repeat(values, 3)) is None


def test_spikes_are_replaced_by_the_line_between_their_neighbours():
    random = np.random.default_rng(2)
    values = np.linspace(0, 1, 4000) + 0.01 * random.normal(size=4000)
    spoiled = values.copy()
    spoiled[[100, 2000, 2001, 3990]] += [1.0, 0.5, 0.5, -0.7]
    rows = spikes(spoiled)
    assert rows.tolist() == [100, 2000, 2001, 3990]
    repaired = without(spoiled, rows)
    np.testing.assert_array_equal(np.delete(repaired, rows), np.delete(values, rows))
    assert repaired[100] == pytest.approx((values[99] + values[101]) / 2)
    assert repaired[2000] == pytest.approx(values[1999] + (values[2002] - values[1999]) / 3)


def test_a_peak_at_a_change_is_a_spike_if_it_is_beyond_all_others():
    random = np.random.default_rng(3)
    values = 0.01 * random.normal(size=2000)
    changes = [500, 1200]
    values[[501, 1201]] += [1.0, 0.8]
    rows = spikes(values)
    assert rows.tolist() == [501, 1201]
    assert away_from_changes(values, rows, []).tolist() == [501, 1201]
    assert away_from_changes(values, rows, changes).tolist() == []
    values[501] += 2.0
    assert away_from_changes(values, rows, changes).tolist() == [501]


def test_unusable_rows_are_left_out_and_rows_next_to_defects_avoided():
    time = np.arange(1000) / 100.0
    values = np.sin(time) + 1e-3 * np.random.default_rng(4).normal(size=1000)
    time[400:] += 0.5
    time[700] = time[699]
    values[[100, 101]] = np.nan
    use = usable_rows(time, [values])
    assert np.flatnonzero(~use).tolist() == [100, 101, 700]
    values[300] += 1.0
    avoided = rows_to_avoid(time[use], [values[use]], use)
    # Rows are counted without those left out: after a loss, the spike, the gap, after a loss.
    assert avoided.tolist() == [100, 298, 398, 698]


def test_stretches_of_one_rate_are_told_apart():
    steps = np.concatenate([np.full(500, 0.1), np.full(300, 0.01), np.full(200, 0.1)])
    steps[250] = 3.0
    time = np.concatenate([[0.0], np.cumsum(steps)])
    assert rate_stretches(time) == ((0, 500), (500, 800), (800, 1001))


@pytest.mark.parametrize("slow", [0.02, 0.3])
def test_the_step_of_a_recorder_is_read_from_slow_samples(slow) -> None:
    """Most samples may be many steps apart; a fine recorder has no step."""
    rng = np.random.default_rng(0)
    moved = np.cumsum(np.repeat([slow, 20.0], [9000, 1000]) * rng.uniform(0.9, 1.1, 10_000))
    assert recorder_step(0.37 * np.round(moved)) == pytest.approx(0.37, rel=1e-9)
    assert recorder_step(moved + rng.standard_normal(moved.size)) == 0.0
    assert recorder_step(np.ones(40)) == 0.0
