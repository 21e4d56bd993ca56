"""Errors by the steps of a recorder: the closed form, and their part in the uncertainties."""

import numpy as np
import pytest
from scipy.special import ndtri

import asperity as asp
from asperity.lock_in import quantisation
from asperity.lock_in.quantisation import common_phases, rounding_variance, step_of
from references.populations import draws


@pytest.mark.parametrize("amplitude", [0.0, 0.3, 1.7, 6.2])
def test_the_variance_is_that_of_rounded_cosines(amplitude) -> None:
    """Against means of rounded cosines over all levels within a step."""
    step, phi = 0.5, 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    levels = step * (np.arange(512) + 0.5) / 512
    exact = levels[:, None] + amplitude * np.cos(phi)
    errors = step * np.round(exact / step) - exact
    variance = rounding_variance(step, 0.0, amplitude, 3)
    for k in range(4):
        harmonic = (2 if k else 1) * np.mean(errors * np.cos(k * phi), axis=1)
        # Fifty terms of the closed form lack 1.2 % of the variance of a constant.
        assert variance[k] == pytest.approx(np.mean(harmonic**2), rel=0.02, abs=1e-8)


def test_noise_smooths_the_steps() -> None:
    """The variance of the recorded noise includes step^2/12 of the rounding."""
    rng, step = np.random.default_rng(1), 1.0
    for noise in (0.1, 0.2, 0.3):
        errors = []
        for level in (np.arange(64) + 0.5) / 64:
            recorded = np.round(level + noise * rng.standard_normal(20_000))
            errors.append(recorded.mean() - level)
        variance = rounding_variance(step, np.hypot(noise, step / np.sqrt(12)))[0]
        assert variance == pytest.approx(np.mean(np.square(errors)), rel=0.1)
    assert rounding_variance(step, 1.0)[0] < 1e-7


@pytest.mark.parametrize("noise", [0.0, 0.2])
@pytest.mark.parametrize(("phases", "amplitude"), [(7, 20.2), (32, 61.7), (60, 300.3)])
def test_samples_at_the_same_phases_have_few_errors(phases, amplitude, noise) -> None:
    """Against means over all noise of cosines of a random level and phase, rounded to 1."""
    rng, quantiles = np.random.default_rng(phases), (np.arange(200) + 0.5) / 200
    moved = noise * ndtri(quantiles)
    errors = []
    for _ in range(400):
        cycles = (np.arange(phases) + rng.random()) / phases
        exact = rng.random() + amplitude * np.cos(2 * np.pi * cycles)
        off = (np.round(exact[:, None] + moved) - exact[:, None]).mean(1)
        turns = 2 * np.pi * np.arange(4)[:, None] * cycles
        errors.append((np.array([1, 2, 2, 2])[:, None] * off * np.cos(turns)).mean(1))
    everywhere = np.tile(cycles, 50) + np.repeat(np.arange(50), phases)
    assert common_phases(everywhere, amplitude) == phases
    assert common_phases(np.pi * np.arange(5000) / phases, amplitude) == np.inf
    recorded = np.hypot(noise, np.sqrt(1 / 12))
    variance = rounding_variance(1.0, recorded, amplitude, 3, phases)
    ratio = np.mean(np.square(errors), axis=0) / variance
    # Phases that are symmetric about the top have the same error, which doubles a variance.
    assert ratio.max() < 2.2
    assert np.median(ratio) > 0.6


def test_noise_of_many_steps_leaves_no_error() -> None:
    """A wrong value of 1e-300 in a damaged file makes such steps."""
    assert not rounding_variance(1e-300, 1.0, 0.2, 2).any()


def test_a_constant_has_no_step() -> None:
    assert step_of(np.full(100, 0.3)) == 0
    assert step_of(0.25 * np.arange(9) % 1) == 0.25


def coarse(truth, protocol, seed):
    """Truth and arrays of a recorder with steps of up to half of mu1 and a sixth of epsilon."""
    rng = np.random.default_rng(seed)
    source = truth.but(mean_friction=rng.uniform(0.4, 0.5), W0=rng.uniform(6.9, 7.1))
    time, load, force = protocol(source, noise=1e-4, seed=seed, decay=1e-3)
    step = source.W0 * 1e-3 * rng.uniform(0.1, 1)
    return source, (time, 40 * step * np.round(load / step / 40), step * np.round(force / step))


def scores(measurement, source):
    """Errors in standard uncertainties."""
    reading = measurement.reading
    first = reading.phasor(1)
    return [
        (reading.mean_friction - source.mean_friction + 0.08)
        / reading.uncertainty("mean_friction"),
        (reading.epsilon - source.epsilon) / reading.uncertainty("epsilon"),
        (first.amplitude - abs(source.harmonics[0])) / first.amplitude_uncertainty,
        (measurement.delta_mu + 0.08) / measurement.delta_mu_uncertainty,
    ]


@draws(5, 10)
def test_uncertainties_include_the_rounding(truth, protocol, trace, monkeypatch, draws) -> None:
    recordings = [coarse(truth, protocol, seed) for seed in range(draws)]

    def rms_score():
        squares = [
            np.square(scores(asp.measure(trace(*signals), modulated=True), source))
            for source, signals in recordings
        ]
        return np.sqrt(np.mean(squares))

    assert rms_score() < 1.6
    monkeypatch.setattr(quantisation, "step_of", lambda values: 0.0)
    monkeypatch.setattr("asperity.measurement.measure.step_of", lambda values: 0.0)
    assert rms_score() > 5
