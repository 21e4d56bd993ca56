"""A force that settles: its time constant is fitted, and its mean is the one that it settles to."""

import numpy as np
import pytest

from asperity.lock_in.demodulation import lock_in
from references.populations import draws


def settling_force(truth, time, decay, amplitudes):
    """The force of a truth whose mean and harmonics approach their values."""
    phi = 2 * np.pi * truth.frequency * time + truth.phase
    fades = np.exp(-(time - time[0]) / decay)
    waves = [(c * np.exp(1j * k * phi)).real for k, c in enumerate(amplitudes)]
    return truth.force(time) + truth.W0 * fades * np.sum(waves, axis=0)


@pytest.mark.parametrize("detrend", ["linear", "quadratic"])
@pytest.mark.parametrize("even", [True, False])
@draws(1, 4)
def test_without_noise_the_truth_is_fitted(truth, detrend, even, draws) -> None:
    rng = np.random.default_rng(3)
    for _ in range(draws):
        truth = truth.but(frequency=rng.uniform(50, 70), drift=rng.normal() * 1e-3)
        time = np.arange(12_000) / 4000
        if not even:
            time = np.sort(time + rng.uniform(-5e-5, 5e-5, time.size))
        decay = rng.uniform(0.1, 0.6)
        sizes = (0.03 * rng.choice([-1, 1]), 1e-3 * np.exp(1j), 2e-4)
        force = settling_force(truth, time, decay, sizes)
        found = lock_in(time, truth.load(time), force, detrend=detrend, settles=True)
        # Straight lines in a thousandth of the window: second order of 3 ms over the decay.
        error = (0.003 / decay) ** 2
        assert found.settling.decay == pytest.approx(decay, rel=error)
        assert found.settling.amplitude.real / truth.W0 == pytest.approx(sizes[0], rel=error)
        middle = (time[0] + time[-1]) / 2
        level = truth.mean_friction + truth.drift * (found.start + found.end - 2 * middle) / 2
        assert found.mean_friction == pytest.approx(level, abs=0.03 * error)
        for n, c in enumerate(truth.harmonics, 1):
            assert abs(found.harmonics[n - 1] - c) < 1e-3 * error
        assert found.settling.determined


@draws(6, 30)
def test_harmonics_settle_too(truth, draws) -> None:
    """mu1 and mu2 are those that the response settles to, within their uncertainties."""
    off, without = [], []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time = np.arange(int(rng.uniform(1, 3) * 2000)) / 2000
        decay = (time[-1] - time[0]) / rng.uniform(5, 12)
        sizes = (rng.normal() * 0.01, rng.normal() * 2e-3, rng.normal() * 1e-3)
        force = settling_force(truth, time, decay, sizes) + 5e-3 * rng.standard_normal(time.size)
        for settles, errors in ((True, off), (False, without)):
            found = lock_in(time, truth.load(time), force, settles=settles)
            for n, c in enumerate(truth.harmonics, 1):
                doubt = found.phasor(n).covariance.trace() ** 0.5
                errors.append(abs(found.harmonics[n - 1] - c) / doubt)
    # Mean square 1 of two components together; a settling too small to be seen leaves some bias.
    assert np.sqrt(np.mean(np.square(off))) < 1.3
    assert np.sqrt(np.mean(np.square(without))) > 3


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
