"""Velocity steps and holds of a spring-slider integrated by SciPy, with noise of a laboratory."""

import numpy as np
import pytest
from scipy.signal import lfilter

from asperity.recording import Channel, Trace
from references.spring_slider import pulled_in_parts, spring_slider

LAW = {"A": 0.010, "B": 0.014, "D0": 8e-6, "k": 3e3}


def rig_noise(rng, size, rate, white=4e-4, red=3e-4, samples=100):
    """White noise, red noise with an integrated autocorrelation of `samples`, and two lines."""
    keep = np.exp(-2 / samples)
    steps = rng.standard_normal(size + 20 * samples)
    slow = lfilter([np.sqrt(1 - keep**2)], [1, -keep], steps)[20 * samples :]
    time = np.arange(size) / rate
    lines = sum(
        amplitude * np.sin(2 * np.pi * f * time + rng.uniform(0, 2 * np.pi))
        for f, amplitude in ((0.597, 3e-4), (5.1, 2e-4))
    )
    return white * rng.standard_normal(size) + red * slow + lines


@pytest.fixture(scope="session")
def pulled():
    """Function that integrates a slider pulled at one velocity after another."""

    def make(velocities, lengths, rates, *, resolution=5e-8, seed=0, noise=None, slope=0.0, **law):
        """Time, displacement, friction without and with noise, and bounds of `pulled_in_parts`."""
        rng = np.random.default_rng(seed)
        bounds, time, slip, _ = pulled_in_parts(velocities, lengths, rates)
        clean = spring_slider(velocities, bounds, time, **LAW | law) + slope * slip
        added = rig_noise(rng, time.size, max(rates)) if noise is None else 0.0
        if noise:
            added = noise * rng.standard_normal(time.size)
        displacement = slip + resolution * rng.standard_normal(time.size)
        return time, displacement, clean, clean + added, bounds

    return make


@pytest.fixture(scope="session")
def sliding_trace():
    """Function that makes a trace of friction with displacement or velocity."""

    def make(time, friction, displacement=None, velocity=None):
        channels = {"friction": Channel(friction, "dimensionless", "", "friction", "")}
        if displacement is not None:
            channels["slip"] = Channel(displacement, "length", "m", "slip", "m")
        if velocity is not None:
            channels["velocity"] = Channel(velocity, "velocity", "m/s", "velocity", "m/s")
        return Trace(time, channels)

    return make
