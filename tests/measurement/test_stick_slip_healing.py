"""Healing from stick-slip, of cycles whose friction grows with the logarithm of the stick time."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.optimize import brentq

from asperity.measurement.stick_slip.events import SlipEvents
from asperity.measurement.stick_slip.healing import healing, of_campaign
from asperity.theory import healing_drop
from references.populations import draws

SLOPE, STATIC, DYNAMIC = 0.1, 0.4, 0.35


def cycles(seed, B, n=400, varying=0.01, wave=0.02):
    """Events of a slider that overshoots: the force leaves at mu(t) + m and comes to rest at the
    mirror image about the dynamic friction."""
    rng = np.random.default_rng(seed)
    level = wave * np.sin(2 * np.pi * np.arange(n) / 97)
    low, peaks, rests, drops = 2 * DYNAMIC - STATIC, [], [], []
    for k in range(n):
        strength = STATIC + varying * rng.standard_normal() + level[k]

        def lacks(log_time, low=low, strength=strength):
            return low + SLOPE * np.exp(log_time) - strength - B * log_time

        # The spring catches up with the growth from B/slope on.
        first = np.log(max(B, 1e-9) / SLOPE)
        rest = np.exp(brentq(lacks, first, 8)) if lacks(first) < 0 else np.exp(first)
        peaks.append(low + SLOPE * rest)
        rests.append(rest)
        dynamic = DYNAMIC + level[k] + 0.003 * rng.standard_normal()
        low = 2 * dynamic - peaks[-1]
        drops.append(peaks[-1] - low)
    events = {f.name: np.full(n, np.nan) for f in fields(SlipEvents)}
    events |= {"force_before": np.array(peaks), "drop": np.array(drops), "onset": np.arange(n)}
    events["stick_duration"] = np.array([np.nan, *rests[1:]])
    return SlipEvents(**events)


@draws(12, 200)
@pytest.mark.parametrize("B", [0.0, 0.01, 0.02])
def test_healing_is_that_of_the_slider_where_a_straight_line_is_not(B, draws) -> None:
    read = [(healing(e), e) for e in (cycles(seed, B) for seed in range(draws))]
    score = np.array([(h.per_efold - B) / h.uncertainty for h, _ in read])
    assert abs(score.mean()) < 4 * score.std() / np.sqrt(draws) + 0.3
    covered = np.mean([h.interval_95[0] <= B <= h.interval_95[1] for h, _ in read])
    assert covered > 0.95 - 4 * np.sqrt(0.05 / draws)
    # Longer sticks have higher peaks whether there is healing or not.
    straight = [np.polyfit(np.log(e.stick_duration[1:]), e.force_before[1:], 1)[0] for _, e in read]
    assert np.median(straight) > B + 0.01


def test_no_healing_is_told_where_there_is_none() -> None:
    told = [not healing(cycles(seed, 0.0)).reason for seed in range(12)]
    assert sum(told) <= 3
    assert "too few" in healing(cycles(0, 0.01, n=20)).reason


def test_recordings_at_several_velocities_tell_the_growth_of_the_drop() -> None:
    K, W0, B = 168.0, 0.301, 0.004
    V = np.geomspace(1e-6, 1e-3, 7)
    drop = healing_drop(0.05, B, 1.0, K=K, W0=W0, V=V)
    rest = drop * W0 / (K * V)
    noisy = drop + 1e-3 * np.random.default_rng(0).standard_normal(V.size)
    result = of_campaign(rest, noisy, np.full(V.size, 1e-4))
    assert not result.reason
    assert result.interval_95[0] < 2 * B < result.interval_95[1]
    # The scatter of the recordings counts, which is ten times what they state.
    assert result.drop_uncertainty > 4e-4 / (np.std(np.log(rest)) * np.sqrt(V.size))
    assert "e-folds" in of_campaign(rest[:3] ** 0.01, drop[:3], np.full(3, 1e-4)).reason
    assert "too few" in of_campaign(rest[:2], drop[:2], np.full(2, 1e-4)).reason
