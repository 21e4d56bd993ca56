"""A modulation is where it is, however slow it is, and however short the pauses about it."""

import numpy as np
import pytest

from asperity.measurement.measure import measure
from references.populations import population


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
    """Pauses of 1.5 to 20 periods: scales are those of the modulation, and not seconds."""
    rng = np.random.default_rng(seed)
    pauses = np.exp(rng.uniform(*np.log([1.5, 20]), 2)) / frequency
    made = slow_recording(rng, frequency, rng.integers(16, 25), pauses, rate * frequency)
    found = measure(trace(*made))
    reading = found.reading
    assert abs(reading.epsilon - 0.1) < 5 * reading.uncertainty("epsilon")
    assert abs(abs(reading.harmonics[0]) - 0.02) < 5 * reading.uncertainty("mu1")
    assert reading.periods > 11
    assert abs(found.delta_mu + 5e-3) < 5 * found.delta_mu_uncertainty
    assert found.verdict == "ok", [str(c) for c in found.checks if c.verdict != "ok"]
