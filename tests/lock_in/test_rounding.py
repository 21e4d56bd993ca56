"""Errors by the steps of a recorder: closed form against rounding, and coverage."""

import numpy as np
import pytest

import asperity as asp
from asperity.lock_in import rounding
from asperity.lock_in.rounding import rounding_variance, step_of


@pytest.mark.parametrize("amplitude", [0.0, 0.3, 1.7, 6.2])
def test_the_variance_is_that_of_rounded_waves(amplitude) -> None:
    """Over levels within a step, from the sums of rounded cosines."""
    step, phi = 0.5, 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    levels = step * (np.arange(512) + 0.5) / 512
    exact = levels[:, None] + amplitude * np.cos(phi)
    off = step * np.round(exact / step) - exact
    found = rounding_variance(step, 0.0, amplitude, 3)
    for k in range(4):
        harmonic = (2 if k else 1) * np.mean(off * np.cos(k * phi), axis=1)
        # Fifty terms of the sum lack 1.2 % of the variance of a constant.
        assert found[k] == pytest.approx(np.mean(harmonic**2), rel=0.02, abs=1e-8)


def test_noise_smooths_the_steps() -> None:
    """Of the recorded noise, step^2/12 is the rounding."""
    rng, step = np.random.default_rng(1), 1.0
    for noise in (0.1, 0.2, 0.3):
        off = []
        for level in (np.arange(64) + 0.5) / 64:
            recorded = np.round(level + noise * rng.standard_normal(20_000))
            off.append(recorded.mean() - level)
        found = rounding_variance(step, np.hypot(noise, step / np.sqrt(12)))[0]
        assert found == pytest.approx(np.mean(np.square(off)), rel=0.1)
    assert rounding_variance(step, 1.0)[0] < 1e-7


def test_a_constant_has_no_step() -> None:
    assert step_of(np.full(100, 0.3)) == 0
    assert step_of(0.25 * np.arange(9) % 1) == 0.25


def coarse(truth, protocol, seed):
    """Arrays of a recorder whose steps are a twentieth of the first harmonics, or smaller."""
    rng = np.random.default_rng(seed)
    source = truth.but(mean_friction=rng.uniform(0.4, 0.5), W0=rng.uniform(6.9, 7.1))
    time, load, force = protocol(source, noise=1e-4, seed=seed, decay=1e-3)
    step = source.W0 * 1e-3 * rng.uniform(0.1, 1)
    found = time, 40 * step * np.round(load / step / 40), step * np.round(force / step)
    return source, found


def off_by(found, source):
    reading = found.reading
    first = reading.phasor(1)
    return [
        (reading.mean_friction - source.mean_friction + 0.08)
        / reading.uncertainty("mean_friction"),
        (reading.epsilon - source.epsilon) / reading.uncertainty("epsilon"),
        (first.amplitude - abs(source.harmonics[0])) / first.amplitude_uncertainty,
        (found.delta_mu + 0.08) / found.delta_mu_uncertainty,
    ]


def test_uncertainties_hold_the_rounding(truth, protocol, trace, monkeypatch) -> None:
    def errors():
        made = [coarse(truth, protocol, seed) for seed in range(10)]
        return np.array(
            [off_by(asp.measure(trace(*found), modulated=True), source) for source, found in made]
        )

    assert np.sqrt(np.mean(errors() ** 2)) < 1.6
    monkeypatch.setattr(rounding, "step_of", lambda values: 0.0)
    monkeypatch.setattr("asperity.measurement.measure.step_of", lambda values: 0.0)
    assert np.sqrt(np.mean(errors() ** 2)) > 5
