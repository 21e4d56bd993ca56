"""Readings without noise are exact for any window, clock and drift; a force that settles."""

import numpy as np
import pytest

from asperity.lock_in.demodulation import lock_in
from references.populations import draws

#: Rounding of a few thousand samples of size one.
EXACT = 1e-12

EVEN = np.arange(2000) * 1e-3
CLOCKS = {
    "even": EVEN,
    "long even, by tables": np.arange(40_000) * 1e-3,
    "part periods": EVEN[:1237],
    "little more than one period": np.arange(200) * 1e-4,
    "a late start": 11607.7 + EVEN,
    "random": np.sort(np.random.default_rng(1).uniform(0, 2, 1500)),
    "jitter": EVEN + 1e-4 * np.random.default_rng(2).uniform(-1, 1, EVEN.size),
    "a gap": np.delete(EVEN, slice(400, 1100)),
    "two rates": np.concatenate([np.arange(300) * 2e-3, 0.6 + np.arange(900) * 1e-3]),
}


def assert_exact(reading, truth, exact=EXACT) -> None:
    expected = np.zeros(reading.harmonics.size, dtype=complex)
    expected[: len(truth.harmonics)] = truth.harmonics
    assert abs(reading.harmonics - expected).max() < exact
    assert reading.frequency == pytest.approx(truth.frequency, rel=exact)
    assert reading.epsilon == pytest.approx(truth.epsilon, rel=exact)
    assert abs(reading.W0 - truth.W0) < exact * truth.W0


@pytest.mark.parametrize("clock", CLOCKS)
def test_harmonics_are_exact_for_every_clock(truth, clock) -> None:
    time = CLOCKS[clock]
    # Rounding of late time stamps: 1e-12 s is 1e-9 of a period.
    exact = 1e-9 if clock == "a late start" else EXACT
    assert_exact(lock_in(time, truth.load(time), truth.force(time)), truth, exact)


@pytest.mark.parametrize("clock", CLOCKS)
def test_harmonics_of_the_load_do_not_bias_the_reading(truth, clock) -> None:
    time = CLOCKS[clock]
    truth = truth.but(load_harmonics=(0.01 + 0.02j, -0.004j))
    reading = lock_in(time, truth.load(time), truth.force(time), harmonics=3)
    assert_exact(reading, truth, 1e-9 if clock == "a late start" else EXACT)
    expected = [truth.epsilon, 0.01 + 0.02j, -0.004j]
    assert abs(reading.load_harmonics - expected).max() < 1e-9


@pytest.mark.parametrize(("detrend", "power"), [("none", 0), ("linear", 1), ("quadratic", 2)])
def test_drift_is_fitted_and_its_mean_stays_in_the_mean_friction(truth, detrend, power) -> None:
    time = EVEN[:1237]
    u = np.linspace(-1, 1, time.size)
    force = truth.force(time) + 0.3 * truth.W0 * u**power
    reading = lock_in(time, truth.load(time), force, detrend=detrend)
    assert_exact(reading, truth)
    mean = truth.mean_friction + 0.3 * {0: 1, 1: 0, 2: 1 / 3}[power]
    assert reading.mean_friction == pytest.approx(mean, rel=EXACT)
    if power == 1:
        assert reading.drift[1, 0] == pytest.approx(0.6 * truth.W0, rel=EXACT)


def test_drift_of_both_channels_is_fitted(truth) -> None:
    u = np.linspace(-1, 1, EVEN.size)
    load, force = truth.load(EVEN) + 0.05 * u, truth.force(EVEN) - 0.1 * u
    reading = lock_in(EVEN, load, force)
    assert_exact(reading, truth)
    assert reading.drift[:, 0] == pytest.approx([0.1, -0.2], abs=1e-11)


@pytest.mark.parametrize("error", [1e-4, -3e-3, 0.04, -0.05])
def test_a_wrong_initial_frequency_is_corrected(truth, error) -> None:
    start = truth.frequency * (1 + error)
    reading = lock_in(EVEN, truth.load(EVEN), truth.force(EVEN), frequency=start)
    assert_exact(reading, truth)


def test_an_error_of_the_frequency_lowers_the_amplitude_unless_it_is_fitted(truth) -> None:
    # The phase error at the ends is pi times error, frequency and duration, 0.19 rad; the amplitude
    # is lower by its sinc.
    time = np.arange(10_000) * 1e-3
    load, force = truth.load(time), truth.force(time)
    wrong = truth.frequency * (1 + 1e-4)
    reading = lock_in(time, load, force, frequency=wrong, refine=False)
    angle = np.pi * 1e-4 * truth.frequency * 10
    assert reading.epsilon / truth.epsilon == pytest.approx(np.sinc(angle / np.pi), rel=1e-4)
    assert_exact(lock_in(time, load, force, frequency=wrong), truth)


def test_few_periods_of_a_slow_modulation_are_read(truth) -> None:
    truth = truth.but(frequency=0.83)
    time = np.arange(900) * 5e-3
    assert_exact(lock_in(time, truth.load(time), truth.force(time)), truth)


def test_a_force_ahead_of_the_load_has_a_positive_phase(truth) -> None:
    # F/W0 = mean + mu1 cos(phi + phase1): a force ahead of the load has a positive phase.
    truth = truth.but(harmonics=(1e-3 * np.exp(0.5j),))
    reading = lock_in(EVEN, truth.load(EVEN), truth.force(EVEN), harmonics=1)
    assert reading.phasor(1).phase == pytest.approx(0.5, rel=1e-10)
    assert reading.phasor(1).amplitude == pytest.approx(1e-3, rel=1e-10)
    # A shift of the load in time does not matter.
    later = truth.but(phase=3.0)
    moved = lock_in(EVEN, later.load(EVEN), later.force(EVEN), harmonics=1)
    assert moved.phasor(1).phase == pytest.approx(0.5, rel=1e-10)


def test_amontons_law_gives_one_harmonic(truth) -> None:
    load = truth.load(EVEN)
    reading = lock_in(EVEN, load, 0.4 * load)
    assert reading.harmonics[0] == pytest.approx(0.4 * truth.epsilon, rel=1e-11)
    assert abs(reading.harmonics[1:]).max() < EXACT


def test_the_sign_of_both_channels_does_not_matter(truth) -> None:
    load, force = truth.load(EVEN), truth.force(EVEN)
    rng = np.random.default_rng(0)
    load = load + 0.01 * rng.standard_normal(load.size)
    reading, negated = lock_in(EVEN, load, force), lock_in(EVEN, -load, -force)
    assert negated.harmonics == pytest.approx(reading.harmonics, abs=1e-14)
    assert negated.epsilon == pytest.approx(reading.epsilon, rel=1e-13)
    assert abs(negated.W0 + reading.W0) < 1e-12
    for name in ("epsilon", "mu1", "phase1", "mean_friction", "frequency"):
        assert negated.uncertainty(name) == pytest.approx(reading.uncertainty(name), rel=1e-9)


def settling_force(truth, time, decay, amplitudes):
    """The force of `truth`, whose mean and harmonics approach their values exponentially."""
    phi = 2 * np.pi * truth.frequency * time + truth.phase
    fades = np.exp(-(time - time[0]) / decay)
    waves = [(c * np.exp(1j * k * phi)).real for k, c in enumerate(amplitudes)]
    return truth.force(time) + truth.W0 * fades * np.sum(waves, axis=0)


@pytest.mark.parametrize("detrend", ["linear", "quadratic"])
@pytest.mark.parametrize("even", [True, False])
@draws(1, 4)
def test_a_settling_without_noise_is_fitted_exactly(truth, detrend, even, draws) -> None:
    rng = np.random.default_rng(3)
    for _ in range(draws):
        truth = truth.but(frequency=rng.uniform(50, 70), drift=rng.normal() * 1e-3)
        time = np.arange(12_000) / 4000
        if not even:
            time = np.sort(time + rng.uniform(-5e-5, 5e-5, time.size))
        decay = rng.uniform(0.1, 0.6)
        sizes = (0.03 * rng.choice([-1, 1]), 1e-3 * np.exp(1j), 2e-4)
        force = settling_force(truth, time, decay, sizes)
        reading = lock_in(time, truth.load(time), force, detrend=detrend, settles=True)
        # Linear interpolation over a thousandth of the window, 3 ms, has an error of second order.
        error = (0.003 / decay) ** 2
        assert reading.settling.decay == pytest.approx(decay, rel=error)
        assert reading.settling.amplitude.real / truth.W0 == pytest.approx(sizes[0], rel=error)
        middle = (time[0] + time[-1]) / 2
        level = truth.mean_friction + truth.drift * (reading.start + reading.end - 2 * middle) / 2
        assert reading.mean_friction == pytest.approx(level, abs=0.03 * error)
        for n, c in enumerate(truth.harmonics, 1):
            assert abs(reading.harmonics[n - 1] - c) < 1e-3 * error
        assert reading.settling.determined


@draws(6, 30)
def test_settling_harmonics_are_fitted(truth, draws) -> None:
    """mu1 and mu2 are those that the response settles to, within their uncertainties."""
    errors_with, errors_without = [], []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time = np.arange(int(rng.uniform(1, 3) * 2000)) / 2000
        decay = (time[-1] - time[0]) / rng.uniform(5, 12)
        sizes = (rng.normal() * 0.01, rng.normal() * 2e-3, rng.normal() * 1e-3)
        force = settling_force(truth, time, decay, sizes) + 5e-3 * rng.standard_normal(time.size)
        for settles, errors in ((True, errors_with), (False, errors_without)):
            reading = lock_in(time, truth.load(time), force, settles=settles)
            for n, c in enumerate(truth.harmonics, 1):
                uncertainty = reading.phasor(n).covariance.trace() ** 0.5
                errors.append(abs(reading.harmonics[n - 1] - c) / uncertainty)
    # The mean square should be 1; a settling too small to be seen leaves some bias.
    assert np.sqrt(np.mean(np.square(errors_with))) < 1.3
    assert np.sqrt(np.mean(np.square(errors_without))) > 3


@draws(6, 60)
def test_an_error_of_the_frequency_is_not_taken_for_a_settling(truth, draws) -> None:
    """The error turns the phase of a force with little noise by much more than that noise."""
    scores = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        truth = truth.but(epsilon=0.02, frequency=rng.uniform(50, 70))
        time = np.arange(12_000) / 4000
        load = truth.load(time) + 0.02 * rng.standard_normal(time.size)
        force = truth.force(time) + 1e-4 * rng.standard_normal(time.size)
        reading = lock_in(time, load, force, settles=True)
        assert not any(settling.present for settling in reading.settlings)
        phasor, true = reading.phasor(1), np.angle(truth.harmonics[0])
        scores.append((phasor.phase - true) / phasor.phase_uncertainty)
    assert np.abs(scores).max() < 4.5


def test_a_response_that_drifts_is_read_as_its_mean(truth) -> None:
    """A drift resembles the beginning of a settling, whose end must not be extrapolated."""
    time = np.arange(12_000) / 4000
    phi = 2 * np.pi * truth.frequency * time + truth.phase
    response = truth.W0 * (truth.harmonics[0] * np.exp(1j * phi)).real
    force = truth.force(time) + 0.04 * (time / time[-1] - 0.5) * response
    force += 3e-4 * np.random.default_rng(2).standard_normal(time.size)
    reading = lock_in(time, truth.load(time), force, settles=True)
    assert any(settling.odds > 1e3 for settling in reading.settlings if settling.order == 1)
    first = reading.phasor(1)
    assert abs(first.amplitude - abs(truth.harmonics[0])) < 4 * first.amplitude_uncertainty


@pytest.mark.parametrize("rho", [0.0, 0.95])
@draws(4, 25)
def test_a_steady_recording_keeps_its_uncertainty(truth, red_noise, rho, draws) -> None:
    rng = np.random.default_rng(5)
    time = np.arange(3000) * 1e-3
    load, force = truth.load(time), truth.force(time)
    ratios = []
    for noise in red_noise(rng, rho, draws, time.size):
        pair = [lock_in(time, load, force + 5e-3 * noise, settles=s) for s in (False, True)]
        assert pair[1].settling is None
        names = ("mean_friction", "mu1", "mu2")
        ratios.append([pair[1].uncertainty(n) / pair[0].uncertainty(n) for n in names])
    assert np.allclose(np.median(ratios, axis=0), 1.0, atol=0.01)
    assert np.quantile(ratios, 0.9, axis=0).max() < 1.1
