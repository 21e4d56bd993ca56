"""Slide-hold-slide: an integrated slider, its peaks known without noise."""

import numpy as np
import pytest

from asperity.measurement.sliding.measure import measure_sliding
from references.populations import draws

V, HOLDS, STIFFNESS = 10e-6, (3.0, 30.0, 300.0), 4e3


@pytest.fixture(scope="module")
def held(pulled):
    """Time, displacement, friction without and with noise, and the bounds."""
    velocities, lengths, rates = [V], [400e-6], [100]
    for hold in HOLDS:
        velocities += [0.0, V]
        lengths += [hold, 400e-6]
        rates += [100 if hold < 100 else 5, 100]
    return pulled(
        velocities, lengths, rates, noise=2e-4, slope=3.0, stiffness=STIFFNESS, resolution=2e-8
    )


def true_readings(held):
    """Healing and relaxation of each hold without noise."""
    time, _, clean, _, bounds = held
    found = []
    for k in range(len(HOLDS)):
        start, end, stop = bounds[2 * k + 1 : 2 * k + 4]
        level = clean[time < start][-1]
        found.append(
            (clean[(time > end) & (time < stop)].max() - level, level - clean[time < end][-1])
        )
    return np.array(found)


def test_holds_are_found_and_read(held, sliding_trace) -> None:
    time, slip, _, friction, _ = held
    found = measure_sliding(sliding_trace(time, friction, slip))
    assert [h.hold_time for h in found.holds] == pytest.approx(HOLDS, abs=0.02)
    assert found.steps == ()
    for hold, (healing, relaxation) in zip(found.holds, true_readings(held), strict=True):
        assert abs(hold.healing - healing) < 4 * hold.healing_uncertainty + 2e-4
        assert abs(hold.relaxation - relaxation) < 4 * hold.relaxation_uncertainty + 2e-4
        assert 0 < hold.healing_uncertainty < 2e-3
        # The first half of the rise is elastic but for the creep of the contact.
        assert hold.reload_slope == pytest.approx(STIFFNESS, rel=0.1)
        assert hold.velocity == pytest.approx(V, rel=1e-2)
    true_slope = np.polyfit(np.log10(HOLDS), true_readings(held)[:, 0], 1)[0]
    assert found.healing.holds == 3
    assert abs(found.healing.per_decade - true_slope) < found.healing.interval_95
    assert found.healing.per_decade == pytest.approx(true_slope, rel=0.1)
    assert [s.velocity for s in found.segments if s.hold] == [0.0, 0.0, 0.0]


def test_holds_of_the_user_need_no_displacement(held, sliding_trace) -> None:
    time, _, _, friction, bounds = held
    listed = [(bounds[k], bounds[k + 1]) for k in (1, 3, 5)]
    found = measure_sliding(sliding_trace(time, friction), holds=listed)
    assert [h.hold_time for h in found.holds] == pytest.approx(HOLDS)
    assert found.chosen_by == "user"
    for hold, (healing, _) in zip(found.holds, true_readings(held), strict=True):
        assert abs(hold.healing - healing) < 4 * hold.healing_uncertainty + 2e-4
        assert np.isnan(hold.reload_slope)


@draws(4, 20)
def test_noise_makes_no_healing(sliding_trace, draws) -> None:
    """The largest of many noisy samples is no peak."""
    heals = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time = np.arange(0, 90, 0.01)
        slip = np.interp(time, [0, 40, 50, 90], [0, 400e-6, 400e-6, 800e-6])
        friction = 0.6 + 1e-3 * rng.standard_normal(time.size)
        (hold,) = measure_sliding(sliding_trace(time, friction, slip)).holds
        heals.append(hold.healing)
    # Of 2000 samples the largest stands 3.4 standard deviations out.
    assert np.mean(heals) < 1e-3
