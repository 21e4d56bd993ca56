"""The gain of a channel against what it does to a recorded sine."""

import numpy as np
import pytest

from asperity.experiment import channel_gain
from asperity.experiment.recorded_motion import motion_rate
from asperity.tribometer.sensors import Accelerometer, SpringGauge
from asperity.tribometer.tribometer import Recorder, Tribometer

RATE = 40_000.0
MACHINE = Tribometer(
    sensors={
        "F": SpringGauge(stiffness=2e5, bandwidth=400.0, delay=2e-4),
        "W": Accelerometer(bandwidth=900.0, mean=0.0, high_pass=30.0),
    },
    recorder=Recorder(rate=5000.0, cut_off=300.0, order=3),
)


@pytest.mark.parametrize("channel", ["F", "W"])
@pytest.mark.parametrize("frequency", [50.0, 120.0, 240.0])
def test_gain_is_what_a_sine_comes_out_with(channel, frequency):
    time = np.arange(int(RATE * 1.0)) / RATE
    sine = np.cos(2 * np.pi * frequency * time)
    seen = MACHINE.record(time, {"F": sine, "W": sine})
    late = seen.time > 0.5  # filters have settled, whole periods are left
    wave = np.exp(-2j * np.pi * frequency * seen.time[late])
    n = round(5000 / frequency * np.floor(late.sum() * frequency / 5000))
    measured = 2 * np.mean((seen.channel(channel).values[late] * wave)[:n])
    assert measured == pytest.approx(complex(channel_gain(MACHINE, channel, frequency)), abs=2e-3)


def test_gain_is_one_far_below_and_of_the_shape_asked_for():
    gain = channel_gain(MACHINE, "F", [[0.001, 120.0]])
    assert gain.shape == (1, 2)
    assert gain[0, 0] == pytest.approx(1, abs=1e-4)
    assert abs(gain[0, 1]) == pytest.approx(1 / np.sqrt((1 + 0.3**2) * (1 + 0.4**6)), rel=1e-12)


def test_the_motion_is_sampled_finely_enough_for_a_gauge_that_rings():
    gauge = SpringGauge(stiffness=2e5, bandwidth="400 Hz", resonance="30 kHz", noise="5 nm")
    machine = Tribometer(sensors={"F": gauge}, recorder=Recorder(rate="5 kHz"))
    rate = motion_rate(machine)
    assert rate == 60_000.0
    assert len(machine.record(np.arange(600) / rate, {"F": np.ones(600)})) == 50
