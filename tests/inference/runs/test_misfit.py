"""Innovations of a recording: misfits and whiteness, against chance."""

import numpy as np
from scipy.signal import lfilter

from asperity.inference.runs.noise import misfit_after_changes, whiteness


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
