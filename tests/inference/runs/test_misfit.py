"""Jumps and misfits in innovations, against generalised least squares and chance."""

import numpy as np
import pytest
from scipy.linalg import toeplitz

from asperity.inference.runs.misfit import departures_of_jumps, misfit_after_changes
from asperity.inference.runs.noise import Autoregression


def test_a_jump_is_measured_as_by_generalised_least_squares():
    noise = Autoregression(np.array([0.8, -0.5, 0.1]), 2.5)
    n = 60
    random = np.random.default_rng(1)
    curves = np.stack([np.ones(n), np.linspace(-1, 1, n), np.sin(np.arange(n) / 9)], axis=1)
    covariance = toeplitz(np.fft.ifft(noise.spectrum(np.arange(4096) / 4096)).real[:n])
    inverse = np.linalg.inv(covariance)
    x = random.normal(size=n)
    basis = np.linalg.qr(noise.whiten(curves))[0]
    white = noise.whiten(x[:, None])[:, 0]
    found = departures_of_jumps(noise, white - basis @ (basis.T @ white), basis)
    # The first samples are predicted by lower orders, which the formula leaves out.
    for k in (5, 20, 41, 57):
        design = np.column_stack([curves, np.arange(n) >= k])
        spread = np.linalg.inv(design.T @ inverse @ design)
        jump = (spread @ design.T @ inverse @ x)[-1]
        assert found[k] == pytest.approx(jump / np.sqrt(spread[-1, -1]), rel=1e-8)
    # One that is among the curves already is not found again.
    curves[:, 2] = np.arange(n) >= 30
    basis = np.linalg.qr(noise.whiten(curves))[0]
    again = departures_of_jumps(noise, white - basis @ (basis.T @ white), basis)
    assert again[30] == 0.0


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
