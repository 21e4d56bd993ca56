"""Recordings with known, planted numbers."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.signal import lfilter

from asperity.lock_in.demodulation import lock_in
from asperity.recording import Channel, Trace, check


@dataclass(frozen=True)
class Truth:
    """Numbers of a recording."""

    W0: float = 7.0
    epsilon: float = 0.24
    frequency: float = 60.013
    phase: float = 0.7
    mean_friction: float = 0.4
    #: Phasors of F/W0, with phases relative to the load.
    harmonics: tuple[complex, ...] = (2e-3 * np.exp(-1.5j), 3e-4 * np.exp(1j))
    #: Phasors of W/W0 at 2f, 3f, ..., with phases relative to the fundamental of the load.
    load_harmonics: tuple[complex, ...] = ()
    #: Change of the friction per second; zero in the middle of the recording.
    drift: float = 0.0

    def load(self, time):
        phi = 2 * np.pi * self.frequency * time + self.phase
        w = 1 + self.epsilon * np.cos(phi)
        for k, c in enumerate(self.load_harmonics, 2):
            w = w + (c * np.exp(1j * k * phi)).real
        return self.W0 * w

    def force(self, time):
        phi = 2 * np.pi * self.frequency * time + self.phase
        f = self.mean_friction + self.drift * (time - (time[0] + time[-1]) / 2)
        for k, c in enumerate(self.harmonics, 1):
            f = f + (c * np.exp(1j * k * phi)).real
        return self.W0 * f

    def but(self, **changes):
        return replace(self, **changes)

    def value(self, name):
        if name[-1] not in "12":
            return getattr(self, name)
        c = self.harmonics[int(name[-1]) - 1]
        return abs(c) if name.startswith("mu") else np.angle(c)


def covered(truth, noises, rate, names):
    """Share of 95 % intervals that contain the truth, over pairs of noise of load and force."""
    hits = dict.fromkeys(names, 0)
    for of_load, of_force in noises:
        time = np.arange(of_load.size) / rate
        load, force = truth.load(time) + of_load, truth.force(time) + of_force
        reading = lock_in(time, load, force, harmonics=2)
        for name, value in reading.observables().items():
            if name in hits:
                hits[name] += abs(value - truth.value(name)) < reading.half_width(name)
    return {name: count / len(noises) for name, count in hits.items()}


@pytest.fixture
def truth():
    return Truth()


@pytest.fixture
def trace():
    """A function that makes a checked trace of arrays."""

    def make(time, load, force, **more):
        channels = {
            "W": Channel(load, "force", "N", "W", "N"),
            "F": Channel(force, "force", "N", "F", "N"),
            **more,
        }
        made = Trace(time, channels)
        return replace(made, findings=check(made))

    return make


@pytest.fixture
def protocol():
    """A function that makes time, load and force of sliding, modulation, and sliding again."""

    def make(truth, *, noise=2e-3, rate=1000.0, seed=0, on=(6.0, 26.0), end=36.0, decay=0.3):
        rng = np.random.default_rng(seed)
        time = np.arange(int(end * rate)) / rate
        modulated = (time >= on[0]) & (time < on[1])
        load = np.where(modulated, truth.load(time), truth.W0)
        drop = -np.expm1(-np.clip(time - on[0], 0, None) / decay)
        recovery = np.exp(-np.clip(time - on[1], 0, None) / decay)
        change = -0.08 * np.where(time < on[1], drop, recovery)
        response = truth.force(time) - truth.W0 * truth.mean_friction
        force = truth.W0 * (truth.mean_friction + change) + np.where(modulated, response, 0.0)
        load = load + noise * rng.standard_normal(time.size)
        return time, load, force + noise / 3 * rng.standard_normal(time.size)

    return make


@pytest.fixture
def red_noise():
    """AR(1) noise of unit variance, (channels, n)."""

    def make(rng, rho, channels, n):
        white = rng.standard_normal((channels, n + 400))
        return lfilter([np.sqrt(1 - rho**2)], [1, -rho], white)[:, 400:]

    return make
