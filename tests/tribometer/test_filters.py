"""Filters against their transfer functions in closed form, and against SciPy's design."""

import numpy as np
import pytest
from scipy.signal import butter, freqs

from asperity.tribometer.sensors import between, filtered, low_pass

RATE, F = 10_000.0, 120.0
TIME = np.arange(0, 1.0, 1 / RATE)


def phasor(values, time, frequency):
    """Complex amplitude c of Re(c e^{iwt}) by least squares, over the second half."""
    half = slice(time.size // 2, None)
    angle = 2 * np.pi * frequency * time[half]
    columns = np.c_[np.cos(angle), -np.sin(angle), np.ones_like(angle)]
    a, b, _ = np.linalg.lstsq(columns, values[half], rcond=None)[0]
    return a + 1j * b


@pytest.mark.parametrize("corner", [20.0, 120.0, 800.0, 5000.0])
def test_a_first_order_filter_has_its_gain_and_phase(corner) -> None:
    out = filtered(np.cos(2 * np.pi * F * TIME), RATE, *low_pass(1, corner))
    gain = phasor(out, TIME, F)
    # The cubic between samples: (w/RATE)^4 of some hundredths.
    assert abs(gain) == pytest.approx(1 / np.hypot(1, F / corner), rel=1e-6)
    assert np.angle(gain) == pytest.approx(-np.arctan(F / corner), abs=1e-6)


@pytest.mark.parametrize("order", [2, 3, 4, 7])
@pytest.mark.parametrize("corner", [100.0, 900.0])
def test_a_butterworth_filter_is_that_of_the_textbook(order, corner) -> None:
    _, expected = freqs(*butter(order, 2 * np.pi * corner, analog=True), worN=[2 * np.pi * F])
    out = filtered(np.cos(2 * np.pi * F * TIME), RATE, *low_pass(order, corner))
    assert abs(phasor(out, TIME, F) - expected[0]) < 1e-6
    assert abs(expected[0]) == pytest.approx(1 / np.sqrt(1 + (F / corner) ** (2 * order)))


def test_it_begins_in_the_steady_state_and_keeps_a_constant() -> None:
    out = filtered(np.full(500, 3.7), RATE, *low_pass(4, 300.0))
    np.testing.assert_allclose(out, 3.7, rtol=1e-12)


def test_a_step_decays_exponentially() -> None:
    corner = 50.0
    step = np.where(TIME < 0.1, 0.0, 1.0)
    out = filtered(step, RATE, *low_pass(1, corner))
    later = (TIME > 0.102) & (TIME < 0.15)
    # The edge lies somewhere between two samples: its place is the only freedom.
    edge = TIME[later] + np.log(1 - out[later]) / (2 * np.pi * corner)
    assert np.ptp(edge) < 1e-9
    assert 0.1 - 1 / RATE <= edge.mean() <= 0.1


def test_values_between_samples_are_those_of_a_cubic() -> None:
    cubic = np.polynomial.Polynomial([1.0, -2.0, 3.0, 0.5])
    grid = np.arange(50) / 10
    times = np.linspace(0.1, 4.7, 333)
    np.testing.assert_allclose(between(cubic(grid), 10.0, times), cubic(times), rtol=1e-12)
    np.testing.assert_allclose(between(cubic(grid), 10.0, grid), cubic(grid), rtol=1e-14)
    outside = between(cubic(grid), 10.0, np.array([-1.0, 99.0]))
    np.testing.assert_allclose(outside, cubic(grid[[0, -1]]))


@pytest.mark.parametrize("frequency", [200.0, 900.0])
def test_a_gauge_that_rings_is_a_damped_oscillator(frequency) -> None:
    from asperity.tribometer.sensors import resonant

    out = filtered(np.cos(2 * np.pi * F * TIME), RATE, *resonant(frequency, 0.1))
    ratio = F / frequency
    expected = 1 / (1 - ratio**2 + 2j * 0.1 * ratio)
    # The cubic between samples, as above, and the ringing of the start, which has died out.
    assert abs(phasor(out, TIME, F) - expected) < 1e-6
