"""The check "flat top": it names signals cut off before noise was added, and no smooth cycle."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.recording import Channel, Trace, check
from references.populations import population

measure = partial(asp.measure, modulated=True)

W0, EPSILON, MU1 = 7.0, 0.24, 2e-3


def measured(rng, cycle, noise, *, frequency=37.013, rate=2000.0, level=None, side=1, cut="force"):
    """Measurement of a friction that follows `cycle(phase)` (in mu1), and its check "flat top".

    The signal `cut` is limited to `level` amplitudes above or below its mean; noise (amplitudes) is
    added afterwards.
    """
    time = np.arange(24_000) / rate
    phase = 2 * np.pi * frequency * time + rng.uniform(0, 2 * np.pi)
    load = np.cos(phase) + 0.01 * np.cos(2 * phase)
    friction = cycle(phase - rng.uniform(0, 2 * np.pi))
    if level is not None and cut == "force":
        friction = side * np.minimum(side * friction, level)
    if level is not None and cut == "load":
        load = side * np.minimum(side * load, level)
    load = load + 1e-3 * rng.standard_normal(time.size)
    friction = friction + noise * rng.standard_normal(time.size)
    force = W0 * (0.4 + MU1 * friction + 0.1 * MU1 * (time / time[-1] - 0.5))
    trace = Trace(
        time,
        {
            "W": Channel(W0 * (1 + EPSILON * load), "force", "N", "W", "N"),
            "F": Channel(force, "force", "N", "F", "N"),
        },
    )
    measurement = measure(replace(trace, findings=check(trace)))
    return measurement, next(c for c in measurement.checks if c.name == "flat top")


def harmonics(rng):
    """A fundamental of amplitude 1 with some of the next two, of any phase."""
    second, third = rng.uniform(0, 0.2), rng.uniform(0, 0.03)
    a, b = rng.uniform(0, 2 * np.pi, 2)
    return lambda x: np.cos(x) + second * np.cos(2 * x + a) + third * np.cos(3 * x + b)


@pytest.mark.parametrize("cut", ["force", "load"])
@pytest.mark.parametrize("seed", population(6))
def test_a_signal_cut_off_before_its_noise_is_named(seed, cut) -> None:
    rng = np.random.default_rng([seed, len(cut)])
    level, noise = rng.uniform(0.1, 0.9), 10 ** rng.uniform(-3, -1)
    side = rng.choice([-1, 1])
    measurement, flat_top = measured(rng, np.cos, noise, level=level, side=side, cut=cut)
    assert flat_top.verdict != "ok"
    end = "top" if side > 0 else "bottom"
    assert f"of the {cut} is cut off flat at its {end} " in flat_top.sentence
    # The cut lasts arccos(level)/pi of the period; each end is known to a bin of 128.
    assert flat_top.number == pytest.approx(np.arccos(level) / np.pi, abs=2.5 / 128)
    assert measurement.verdict != "ok"


@pytest.mark.parametrize("seed", population(6, short=2))
def test_a_cut_is_named_among_harmonics_strong_noise_and_few_phases(seed) -> None:
    rng = np.random.default_rng(seed)
    # Sampled at 2 kHz, 120 Hz has 50 different phases and 100 Hz has 20.
    frequency = (37.013, 120.0, 100.0)[seed % 3]
    cycle = harmonics(rng)
    level = 0.5 * np.max(cycle(np.linspace(0, 2 * np.pi, 400)))
    _, flat_top = measured(rng, cycle, 0.3, level=level, frequency=frequency)
    assert flat_top.verdict != "ok"
    clean, flat_top = measured(rng, cycle, 0.3, frequency=frequency)
    assert flat_top.verdict == "ok"
    assert clean.reading.phasor(1).amplitude == pytest.approx(MU1, rel=0.05)


def test_cuts_of_both_sides_are_named() -> None:
    rng = np.random.default_rng(0)
    _, flat_top = measured(rng, lambda x: np.clip(np.cos(x), -0.6, 0.7), 0.02)
    assert "at its top and bottom" in flat_top.sentence
    share = (np.arccos(0.6) + np.arccos(0.7)) / np.pi
    assert flat_top.number == pytest.approx(share, abs=4.5 / 128)


def pulses(width):
    """Flat between narrow pulses downward."""
    return lambda x: -4 * np.exp((np.cos(x) - 1) / width**2)


def ramps(width):
    """A slow rise between quick falls."""

    def cycle(x):
        turn = np.mod(x, 2 * np.pi) - np.pi
        return 2 * (turn / np.pi - np.tanh(turn / width))

    return cycle


def slider(pull, per_period, epsilon):
    """Settled cycle of a quasi-static Rice-Ruina slider under a modulated load, by SciPy.

    Variables are force over load f, phase x and state phi = ln(V Phi/D0), with `pull` = V K/(omega
    W0) and `per_period` = V/(omega D0). Slip comes in pulses at the least load.
    """
    a, b, mu, periods, samples = 0.013, 0.026, 0.4, 40, 512

    def rates(x, y):
        f, phi = y
        v = np.exp((f / (1 + epsilon * np.cos(x)) - mu - b * phi) / a)
        return [pull * (1 - v), per_period * (np.exp(-phi) - v)]

    at = 2 * np.pi * (periods - 1 + np.arange(samples + 1) / samples)
    orbit = solve_ivp(
        rates, (0, 2 * np.pi * periods), [mu, 0.0], method="LSODA", rtol=1e-7, atol=1e-9, t_eval=at
    )
    phase, force = at - at[0], orbit.y[0] - orbit.y[0, :-1].mean()
    assert abs(force[-1] - force[0]) < 1e-6
    first = 2 * abs(np.mean(force[:-1] * np.exp(-1j * phase[:-1])))
    return lambda x: np.interp(np.mod(x, 2 * np.pi), phase, force / first)


SMOOTH = {
    "harmonics": harmonics(np.random.default_rng(1)),
    "narrow pulses": pulses(0.2),
    "pulses": pulses(0.6),
    "broad pulses": pulses(1.0),
    "ramps": ramps(0.1),
    "round ramps": ramps(0.5),
    "slider": slider(0.3, 2.0, 0.5),
    "slider in pulses": slider(0.02, 0.5, 0.24),
    "slider in narrow pulses": slider(0.05, 1.0, 0.5),
}


@pytest.mark.parametrize("noise", population([3e-2, 1e-3, 0.3]))
@pytest.mark.parametrize("name", SMOOTH)
def test_a_smooth_cycle_is_not_suspected(name, noise) -> None:
    _, flat_top = measured(np.random.default_rng(0), SMOOTH[name], noise)
    assert flat_top.verdict == "ok", flat_top


@pytest.mark.parametrize("seed", population(3))
def test_coloured_noise_is_not_taken_for_a_cut(red_noise, seed) -> None:
    rng = np.random.default_rng(seed)
    noise = red_noise(rng, 0.99, 1, 24_000)[0]
    _, flat_top = measured(rng, lambda x: np.cos(x) + noise, 0.01)
    assert flat_top.verdict == "ok"
