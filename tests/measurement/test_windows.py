"""Windows: intervals of one amplitude, settled series, runs without defects, and mean levels."""

from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.lock_in.reference import fit_frequency, strongest_line
from asperity.measurement.levels_and_trends import mean_level, steady_from
from asperity.measurement.verdicts.verdict import Limits, worst
from asperity.measurement.window import clean_run, stretches, whole_periods
from references.populations import population

measure = partial(asp.measure, modulated=True)


def test_intervals_end_where_the_amplitude_changes() -> None:
    time = np.arange(30_000) * 1e-3
    amplitude = np.select([time < 5, time < 15, time < 22], [0.0, 1.0, 2.0], 0.0)
    load = 7 + amplitude * np.cos(2 * np.pi * 40 * time)
    parts = stretches(time, load, 40.0)
    # At each change a block of four periods and one on each side belong to no interval.
    edges = [(time[p.first], time[p.stop - 1]) for p in parts]
    assert np.ravel(edges) == pytest.approx([0, 5, 5, 15, 15, 22, 22, 30], abs=0.25)
    assert [round(p.amplitude, 6) for p in parts] == [0.0, 1.0, 2.0, 0.0]


def test_small_steps_of_the_amplitude_end_an_interval_and_slow_changes_do_not() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(32_000) * 1e-3
    phase, noise = 2 * np.pi * 23.7 * time, 1e-3 * rng.standard_normal(time.size)
    levels = np.array([0.5, 0.525, 0.55, 0.58])
    steps = levels[(time // 8).astype(int)]
    parts = stretches(time, 7 + steps * np.cos(phase) + noise, 23.7)
    assert [p.amplitude for p in parts] == pytest.approx(levels, rel=1e-3)
    for slow in (0.1 * time / 32, 0.1 * np.sin(2 * np.pi * time / 16)):
        (part,) = stretches(time, 7 + 0.5 * (1 + slow) * np.cos(phase) + noise, 23.7)
        assert part.stop - part.first == time.size


@pytest.mark.parametrize("decay", [3.0, 8.0])
def test_a_transient_is_cut_off(decay) -> None:
    rng = np.random.default_rng(0)
    at = np.arange(200)
    series = np.exp(-at / decay) + 1e-3 * rng.standard_normal(200)
    cut = steady_from(series, 0)
    # The transient falls to the noise of a point in 6.9 decay times, and of the mean in 9.
    assert 3.5 * decay < cut < 10 * decay


@pytest.mark.parametrize("degree", [0, 1])
def test_a_steady_series_is_kept(degree) -> None:
    cuts = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        series = rng.standard_normal(150) + degree * np.linspace(0, 9, 150)
        cuts.append(steady_from(series, degree))
    assert np.median(cuts) == 0
    assert max(cuts) <= 75


def test_a_run_without_defects_is_taken_if_it_is_long() -> None:
    assert clean_run(0, 1000, np.array([300])) == (301, 1000)
    assert clean_run(0, 1000, np.array([800])) == (0, 800)
    assert clean_run(0, 1000, np.array([300, 650])) == (0, 1000)
    assert clean_run(100, 200, np.array([50, 700])) == (100, 200)


@pytest.mark.parametrize(("rate", "frequency", "expected"), [(1000, 10, 1000), (1000, 9.9, 909)])
def test_whole_periods_are_counted_in_samples(rate, frequency, expected) -> None:
    # A thousand samples last a second: 10 periods, or 9 of 1/9.9 s = 909.09 samples.
    assert whole_periods(np.arange(1000) / rate, frequency) == expected


def test_a_mean_covers_its_truth_in_slow_noise(red_noise) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(3000) * 1e-3
    hits = 0
    for series in red_noise(rng, 0.95, 300, time.size):
        level = mean_level(time, series)
        # Student's t of 8 degrees of freedom at 97.5 %.
        hits += abs(level.value) < 2.306 * level.uncertainty
    assert 0.92 < hits / 300 < 0.98


def test_verdicts_follow_the_limits() -> None:
    limits = Limits(large_is_bad=(1, 2), small_is_bad=(2, 1))
    for name, verdicts in {
        "large_is_bad": ["ok", "suspicious", "bad"],
        "small_is_bad": ["bad", "suspicious", "ok"],
    }.items():
        assert [limits.check(name, n, "").verdict for n in (0.5, 1.5, 2.5)] == verdicts
        assert limits.check(name, np.nan, "").verdict == "bad"
    assert limits.check("large_is_bad", 9, "", significant=False).verdict == "ok"
    assert worst([limits.check("large_is_bad", n, "") for n in (0, 1.5)]) == "suspicious"
    assert worst([]) == "ok"


@pytest.mark.parametrize("frequency", [0.37, 4.2, 61.7, 390.0])
def test_the_strongest_line_is_found_and_fitted(frequency) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(200_000) * 1e-3
    load = (
        7 + 0.05 * np.cos(2 * np.pi * frequency * time + 1) + 0.05 * rng.standard_normal(time.size)
    )
    line = strongest_line(time, load + 0.01 * time)
    assert line.frequency == pytest.approx(frequency, abs=0.02)
    assert line.amplitude == pytest.approx(0.05, rel=0.3)
    fitted = fit_frequency(time, load, line.frequency, harmonics=1, degree=1, step=None)
    bound = np.sqrt(24 / time.size) / 200 / (2 * np.pi)
    assert abs(fitted - frequency) < 5 * bound


def slow_recording(rng, frequency, periods, pauses, rate):
    """Time, load and force of a modulation between two pauses."""
    before, after = pauses
    length = periods / frequency
    time = np.arange(int((before + length + after) * rate)) / rate
    on = (time >= before) & (time < before + length)
    phi = 2 * np.pi * frequency * (time - before) + rng.uniform(0, 2 * np.pi)
    load = 7 * (1 + 0.1 * on * np.cos(phi)) + 5e-3 * rng.standard_normal(time.size)
    friction = 0.43 - 5e-3 * on + 0.02 * on * np.cos(phi - 0.5)
    return time, load, 7 * friction + 5e-3 * rng.standard_normal(time.size)


@pytest.mark.parametrize("seed", population(4))
@pytest.mark.parametrize("frequency", [0.03, 0.1, 1.0, 30.0])
@pytest.mark.parametrize("rate", [40, 700])
def test_twenty_periods_between_pauses_are_measured(trace, frequency, rate, seed) -> None:
    """Pauses of 1.5 to 20 periods: lengths are compared with the period, not with seconds."""
    rng = np.random.default_rng(seed)
    pauses = np.exp(rng.uniform(*np.log([1.5, 20]), 2)) / frequency
    signals = slow_recording(rng, frequency, rng.integers(16, 25), pauses, rate * frequency)
    measurement = measure(trace(*signals))
    reading = measurement.reading
    assert abs(reading.epsilon - 0.1) < 5 * reading.uncertainty("epsilon")
    assert abs(abs(reading.harmonics[0]) - 0.02) < 5 * reading.uncertainty("mu1")
    assert reading.periods > 11
    assert abs(measurement.delta_mu + 5e-3) < 5 * measurement.delta_mu_uncertainty
    assert measurement.verdict == "ok", [str(c) for c in measurement.checks if c.verdict != "ok"]
