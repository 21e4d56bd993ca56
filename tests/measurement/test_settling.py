"""What is measured is what the force settles to, or the verdict says that it cannot be told."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

import asperity as asp
from references.populations import draws

measure = partial(asp.measure, modulated=True)

LEVEL, DROP = 0.43, -0.005
MU1 = 0.02 * np.exp(-0.5j)


def recording(rng, length, decay, amplitude, *, rho=0.0, drift=0.0, recovery=None, sigma=1e-3):
    """Time, load and force: a pause, a modulated stretch in which the force settles, a pause."""
    rate, frequency, before = 2000.0, rng.uniform(100, 140), rng.uniform(0.8, 1.6)
    time = np.arange(int((before + length + rng.uniform(1.0, 1.6)) * rate)) / rate
    on = (time >= before) & (time < before + length)
    phi = 2 * np.pi * frequency * time
    fades = amplitude * np.exp(-(time - before) / decay)
    mean = LEVEL + drift * time + np.where(on, DROP + fades, 0.0)
    if recovery is not None:
        since = time - before - length
        mean += np.where(since >= 0, DROP * np.exp(-since / recovery), 0.0)
    white = rng.standard_normal(time.size + 500)
    noise = lfilter([np.sqrt(1 - rho**2)], [1, -rho], white)[500:]
    friction = mean + on * (MU1 * np.exp(1j * phi)).real + sigma * noise
    load = 7 * (1 + 0.24 * on * np.cos(phi)) + 3e-3 * rng.standard_normal(time.size)
    return time, load, 7 * friction


def errors(found, drift=0.0):
    """Errors of mean_friction and delta_mu in standard uncertainties."""
    reading = found.reading
    mean = LEVEL + DROP + drift * (reading.start + reading.end) / 2
    return (
        (reading.mean_friction - mean) / reading.uncertainty("mean_friction"),
        (found.delta_mu - DROP) / found.delta_mu_uncertainty,
    )


def verdict(found):
    return next(c.verdict for c in found.checks if c.name == "transient")


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("constants", [(5, 10), (10, 60)])
@draws(3, 12)
def test_the_settled_mean_is_measured(trace, rho, constants, draws) -> None:
    off, told = [], 0
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        length = rng.uniform(0.8, 4)
        amplitude = np.exp(rng.uniform(*np.log([0.005, 0.05]))) * rng.choice([-1, 1])
        drift = rng.choice([0.0, 5e-4])
        decay = length / rng.uniform(*constants)
        found = measure(trace(*recording(rng, length, decay, amplitude, rho=rho, drift=drift)))
        told += verdict(found) == "ok"
        off.append(errors(found, drift))
    assert told >= draws - 2
    # Student's t of some ten degrees of freedom.
    assert np.abs(off).max() < 5, off
    assert np.sqrt(np.mean(np.square(off))) < 1.6


@draws(3, 12)
def test_a_settling_without_an_end_has_no_mean(trace, draws) -> None:
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        length = rng.uniform(0.6, 2)
        amplitude = rng.uniform(0.005, 0.05) * rng.choice([-1, 1])
        decay = length * rng.uniform(0.5, 1.5)
        found = measure(trace(*recording(rng, length, decay, amplitude)))
        assert verdict(found) != "ok", seed


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("drift", [0.0, 5e-4])
@draws(2, 10)
def test_a_steady_force_raises_no_alarm(trace, rho, drift, draws) -> None:
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        steady = recording(rng, rng.uniform(0.6, 4), 1.0, 0.0, rho=rho, drift=drift)
        found = measure(trace(*steady))
        assert verdict(found) == "ok"
        assert found.reading.settling is None
        # Nothing but the blocks at the edges is left out.
        part = found.stretches[1]
        assert found.window[0] - part.first < 0.2 * (part.stop - part.first)


@draws(5, 16)
def test_what_recovers_after_the_modulation_is_no_level(trace, draws) -> None:
    """F(0) after it is what the pause settles to, and none where that cannot be told."""
    off, used = [], 0
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        recovery = np.exp(rng.uniform(*np.log([0.05, 1.5])))
        made = recording(rng, 2.0, 1.0, 0.0, recovery=recovery, sigma=5e-4)
        found = measure(trace(*made))
        used += found.after is not None
        off.append(errors(found)[1])
        if recovery > 0.8:
            assert found.after is None
    assert used >= 3 / 8 * draws
    assert np.abs(off).max() < 5, off
    assert np.sqrt(np.mean(np.square(off))) < 1.6


def test_a_window_of_the_user_is_judged_as_it_is(trace) -> None:
    rng = np.random.default_rng(1)
    made = recording(rng, 4.0, 0.2, 0.03)
    begin = float(made[0][np.argmax(np.abs(made[1] - 7) > 0.5)]) + 0.05
    found = measure(trace(*made), window=(begin, begin + 3.5))
    assert verdict(found) == "bad"
    assert abs(errors(found)[0]) < 4


def test_steps_of_the_recorder_are_seen_under_a_settling(trace) -> None:
    """What is subtracted for the settling has no steps, and hides none."""
    time, load, force = recording(np.random.default_rng(1), 4.0, 0.2, 0.03, sigma=1e-5)
    begin = float(time[np.argmax(np.abs(load - 7) > 0.5)]) + 0.05
    step = 0.5 * abs(MU1) * 7
    found = measure(trace(time, load, step * np.round(force / step)), window=(begin, begin + 3.5))
    assert found.reading.settling is not None
    check = next(c for c in found.checks if c.name == "resolution")
    assert check.verdict == "suspicious"
    assert check.number == pytest.approx(0.5, rel=0.2)


@draws(3, 8)
def test_two_time_constants_are_not_taken_for_one(trace, draws) -> None:
    off = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time, load, force = recording(rng, 3.0, 0.35, 0.02)
        begin = time[np.argmax(np.abs(load - 7) > 0.5)]
        since = time - begin
        force = force + 7 * np.where((since >= 0) & (since < 3), 0.02 * np.exp(-since / 0.05), 0)
        found = measure(trace(time, load, force))
        if found.verdict == "ok":
            off.append(errors(found)[0])
    assert len(off) >= draws / 2
    assert np.abs(off).max() < 5, off
