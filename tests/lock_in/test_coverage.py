"""Uncertainties of the lock-in agree with the true scatter, in white and in coloured noise."""

import numpy as np
import pytest
from scipy.stats import binom

from asperity.lock_in.demodulation import lock_in
from asperity.lock_in.reading import Phasor
from references.planted_recordings import covered
from references.populations import draws, population

NAMES = ("W0", "epsilon", "frequency", "mean_friction", "mu1", "phase1", "mu2", "phase2")

#: Samples, seconds between them, frequency, correlation of neighbours (AR1), noise of the load and
#: of the force (N), noise of the load that the force shares.
CASES = {
    "white": (1500, 1e-3, 53.3, 0.0, 0.02, 0.005, 0.0),
    "red, 3 ms": (1500, 1e-3, 53.3, 0.7, 0.02, 0.005, 0.0),
    "red, 20 ms": (1500, 1e-3, 53.3, 0.95, 0.02, 0.005, 0.0),
    "shared by both": (1500, 1e-3, 53.3, 0.6, 0.05, 0.002, 0.3),
    "part periods": (700, 1e-3, 23.7, 0.3, 0.02, 0.005, 0.0),
}


@pytest.mark.slow
@draws(60, 200)
@pytest.mark.parametrize(
    "case", population(["shared by both", *(c for c in CASES if c != "shared by both")])
)
def test_intervals_contain_the_truth_as_often_as_they_state(truth, red_noise, case, draws) -> None:
    n, dt, frequency, rho, of_load, of_force, shared = CASES[case]
    truth = truth.but(frequency=frequency, drift=1e-3)
    rng = np.random.default_rng(20)
    pairs = (red_noise(rng, rho, 2, n) for _ in range(draws))
    noises = [(of_load * a, of_force * b + shared * of_load * a) for a, b in pairs]
    hits = covered(truth, noises, 1 / dt, NAMES)
    shares = np.array(list(hits.values()))
    # The mean lies in 92 to 98 %; each share agrees with this range at a significance of 1e-3.
    assert 0.92 < shares.mean() < 0.98, hits
    assert shares.min() >= binom.ppf(1e-3, draws, 0.92) / draws, hits
    assert shares.max() <= binom.ppf(1 - 1e-3, draws, 0.98) / draws, hits


def test_variances_in_white_noise_are_those_of_the_textbook(truth) -> None:
    n, dt, sigma = 3000, 1e-3, 0.02
    time = np.arange(n) * dt
    rng = np.random.default_rng(1)
    stated = []
    for _ in range(20):
        noise = sigma * rng.standard_normal((2, n))
        reading = lock_in(time, truth.load(time) + noise[0], truth.force(time) + noise[1])
        stated.append([reading.uncertainty(k) ** 2 for k in ("frequency", "re3", "mean_force")])
    frequency, third, mean = np.mean(stated, axis=0)
    # Rife and Boorstyn (1974): the Cramer-Rao bound of a line's frequency.
    amplitude = truth.epsilon * truth.W0
    bound = 24 * sigma**2 / (amplitude**2 * n * (n * dt) ** 2) / (2 * np.pi) ** 2
    # The mean of 20 estimates is known to 5 % with 40 degrees of freedom each, to 9 % with 12.
    assert frequency == pytest.approx(bound, rel=0.15)
    assert third == pytest.approx(2 * sigma**2 / n / truth.W0**2, rel=0.15)
    assert mean == pytest.approx(sigma**2 / n, rel=0.3)


@pytest.mark.long
def test_the_scatter_of_the_frequency_is_the_cramer_rao_bound(truth) -> None:
    n, dt, sigma = 2000, 1e-3, 0.1
    time = np.arange(n) * dt
    load, force = truth.load(time), truth.force(time)
    rng = np.random.default_rng(2)
    errors = [
        lock_in(time, load + sigma * rng.standard_normal(n), force, harmonics=1).frequency
        - truth.frequency
        for _ in range(200)
    ]
    amplitude = truth.epsilon * truth.W0
    bound = np.sqrt(24 * sigma**2 / (amplitude**2 * n)) / (n * dt) / (2 * np.pi)
    assert np.std(errors) == pytest.approx(bound, rel=0.2)


def test_coloured_noise_is_estimated_at_each_harmonic(truth, red_noise) -> None:
    n, dt, rho, sigma = 4000, 1e-3, 0.97, 0.05
    time = np.arange(n) * dt
    load, force = truth.load(time), truth.force(time)
    rng = np.random.default_rng(3)
    spectra = np.mean(
        [
            lock_in(time, load + sigma * red_noise(rng, rho, 1, n)[0], force).noise.spectra
            for _ in range(30)
        ],
        axis=0,
    )[:, 0, 0].real
    for k in (1, 2, 3, 4):
        angle = 2 * np.pi * k * truth.frequency * dt
        theory = sigma**2 * (1 - rho**2) / abs(1 - rho * np.exp(-1j * angle)) ** 2
        assert spectra[k] == pytest.approx(theory, rel=0.12)
    # At 4f the variance of white noise would be wrong by a factor of 30.
    assert spectra[4] < sigma**2 / 25


@draws(30, 100)
def test_the_uncertainty_of_the_phase_includes_noise_of_the_load(truth, draws) -> None:
    n = 2000
    time = np.arange(n) * 1e-3
    rng = np.random.default_rng(5)
    load, force = truth.load(time), truth.force(time)
    phases, stated = [], []
    for _ in range(draws):
        reading = lock_in(time, load + 0.3 * rng.standard_normal(n), force, harmonics=2)
        phases.append(reading.phasor(2).phase)
        stated.append(reading.uncertainty("phase2"))
    # Only the load has noise: twice its phase error is that of the phase at 2f.
    assert np.std(phases) == pytest.approx(np.mean(stated), rel=0.2)
    expected = 2 * 0.3 * np.sqrt(2 / n) / (truth.epsilon * truth.W0)
    assert np.mean(stated) == pytest.approx(expected, rel=0.1)


def test_noise_that_both_channels_share_cancels_in_their_ratio(truth) -> None:
    n = 2000
    time = np.arange(n) * 1e-3
    common = 0.05 * np.random.default_rng(6).standard_normal(n)
    load = truth.load(time)
    reading = lock_in(time, load + common, 0.4 * (load + common))
    # F = 0.4 W in each sample: the ratio has no noise.
    assert reading.uncertainty("mean_friction") < 1e-3 * reading.uncertainty("W0") / truth.W0
    assert reading.uncertainty("im1") < 1e-3 * reading.uncertainty("epsilon")


def test_the_frequency_of_a_few_periods_agrees_with_its_uncertainty() -> None:
    """1.1 to 8 periods; the search starts at the strongest line of the spectrum."""
    scores = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        time = np.arange(int(50 * rng.uniform(1.1, 8))) / 50
        wave = 0.1 * np.cos(2 * np.pi * time + rng.uniform(0, 2 * np.pi))
        load = 7 * (1 + wave + 0.01 * rng.standard_normal(time.size))
        force = 0.4 * load + 0.01 * rng.standard_normal(time.size)
        reading = lock_in(time, load, force, harmonics=2)
        scores.append((reading.frequency - 1) / reading.uncertainty("frequency"))
    assert np.abs(scores).max() < 4.5


def test_uncertainties_and_ellipse_follow_from_the_covariance() -> None:
    covariance = np.diag([1e-8, 4e-8])
    phasor = Phasor(3e-4 + 4e-4j, covariance, 60.0)
    assert phasor.amplitude == pytest.approx(5e-4)
    # Along the phasor: sqrt(0.36 * 1 + 0.64 * 4) * 1e-4, across: sqrt(0.64 * 1 + 0.36 * 4) * 1e-4.
    assert phasor.amplitude_uncertainty == pytest.approx(np.sqrt(0.36 + 0.64 * 4) * 1e-4)
    assert phasor.phase_uncertainty == pytest.approx(np.sqrt(0.64 + 0.36 * 4) * 1e-4 / 5e-4)
    # (9 + 4)/2 against the 95 % quantile 3.15 of F(2, 60).
    assert phasor.excludes(0)
    assert not Phasor(phasor.value / 2, covariance, 60.0).excludes(0)
