"""A force that settles: its final level is measured, or the verdict says that it is unknown."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

import asperity as asp
from asperity.measurement.curves import mean_cycle
from references.populations import draws

measure = partial(asp.measure, modulated=True)

LEVEL, DROP = 0.43, -0.005
MU1 = 0.02 * np.exp(-0.5j)


def recording(rng, length, decay, amplitude, *, rho=0.0, drift=0.0, recovery=None, sigma=1e-3):
    """Time, load and force: a pause, a modulation during which the force settles, a pause."""
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


def modulation_start(time, load):
    return float(time[np.argmax(np.abs(load - 7) > 0.5)])


def errors(measurement, drift=0.0):
    """Errors of mean_friction and delta_mu in standard uncertainties."""
    reading = measurement.reading
    mean = LEVEL + DROP + drift * (reading.start + reading.end) / 2
    return (
        (reading.mean_friction - mean) / reading.uncertainty("mean_friction"),
        (measurement.delta_mu - DROP) / measurement.delta_mu_uncertainty,
    )


def verdict(measurement):
    return next(c.verdict for c in measurement.checks if c.name == "transient")


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("constants", [(5, 10), (10, 60)])
@draws(3, 12)
def test_the_settled_level_is_measured(trace, rho, constants, draws) -> None:
    scores, accepted = [], 0
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        length = rng.uniform(0.8, 4)
        amplitude = np.exp(rng.uniform(*np.log([0.005, 0.05]))) * rng.choice([-1, 1])
        drift = rng.choice([0.0, 5e-4])
        decay = length / rng.uniform(*constants)
        signals = recording(rng, length, decay, amplitude, rho=rho, drift=drift)
        measurement = measure(trace(*signals))
        accepted += verdict(measurement) == "ok"
        scores.append(errors(measurement, drift))
    assert accepted >= draws - 2
    # The scores follow Student's t of some ten degrees of freedom.
    assert np.abs(scores).max() < 5, scores
    assert np.sqrt(np.mean(np.square(scores))) < 1.6


@draws(3, 12)
def test_a_force_that_has_not_settled_is_doubted(trace, draws) -> None:
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        length = rng.uniform(0.6, 2)
        amplitude = rng.uniform(0.005, 0.05) * rng.choice([-1, 1])
        decay = length * rng.uniform(0.5, 1.5)
        measurement = measure(trace(*recording(rng, length, decay, amplitude)))
        assert verdict(measurement) != "ok", seed


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize("drift", [0.0, 5e-4])
@draws(2, 10)
def test_a_steady_force_raises_no_alarm(trace, rho, drift, draws) -> None:
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        steady = recording(rng, rng.uniform(0.6, 4), 1.0, 0.0, rho=rho, drift=drift)
        measurement = measure(trace(*steady))
        assert verdict(measurement) == "ok"
        assert measurement.reading.settling is None
        # Only the blocks at the edges are left out.
        part = measurement.stretches[1]
        assert measurement.window[0] - part.first < 0.2 * (part.stop - part.first)


@draws(5, 16)
def test_the_level_after_the_modulation_is_what_the_pause_settles_to(trace, draws) -> None:
    """A pause too short to tell has no level."""
    scores, used = [], 0
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        recovery = np.exp(rng.uniform(*np.log([0.05, 1.5])))
        signals = recording(rng, 2.0, 1.0, 0.0, recovery=recovery, sigma=5e-4)
        measurement = measure(trace(*signals))
        used += measurement.after is not None
        scores.append(errors(measurement)[1])
        if recovery > 0.8:
            assert measurement.after is None
    assert used >= 3 / 8 * draws
    assert np.abs(scores).max() < 5, scores
    assert np.sqrt(np.mean(np.square(scores))) < 1.6


def test_a_window_of_the_user_is_judged_as_it_is(trace) -> None:
    rng = np.random.default_rng(1)
    time, load, force = recording(rng, 4.0, 0.2, 0.03)
    begin = modulation_start(time, load) + 0.05
    measurement = measure(trace(time, load, force), window=(begin, begin + 3.5))
    assert verdict(measurement) == "bad"
    assert abs(errors(measurement)[0]) < 4


def test_coarse_steps_of_the_recorder_are_named_in_a_force_that_settles(trace) -> None:
    """The settling that is fitted and subtracted is smooth, and must not hide the steps."""
    time, load, force = recording(np.random.default_rng(1), 4.0, 0.2, 0.03, sigma=1e-5)
    begin = modulation_start(time, load) + 0.05
    step = 0.5 * abs(MU1) * 7
    rounded = step * np.round(force / step)
    measurement = measure(trace(time, load, rounded), window=(begin, begin + 3.5))
    assert measurement.reading.settling is not None
    check = next(c for c in measurement.checks if c.name == "resolution")
    assert check.verdict == "suspicious"
    assert check.number == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize(("amplitude", "bend"), [(0.03, 0.0), (0.0, 0.02)])
def test_the_mean_cycle_is_without_what_is_slow(trace, amplitude, bend) -> None:
    time, load, force = recording(np.random.default_rng(1), 4.0, 0.2, amplitude)
    begin = modulation_start(time, load) + 0.05
    # Few periods, over which a parabola and a settling do not cancel.
    force = force + 7 * bend * ((time - begin) / 0.05) ** 2
    reduced = measure(trace(time, load, force), window=(begin, begin + 0.05), detrend="quadratic")
    if amplitude:
        reduced = measure(trace(time, load, force), window=(begin, begin + 3.5))
        assert reduced.reading.settling is not None
    cycle = mean_cycle(reduced)
    fitted = np.interp(cycle.phase, cycle.fine_phase, cycle.fitted)
    assert np.abs(np.mean(cycle.measured - fitted)) < 2e-4
    assert np.std(cycle.measured - fitted) < 2e-3


@draws(3, 8)
def test_a_settling_of_two_time_constants_is_measured_or_doubted(trace, draws) -> None:
    scores = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time, load, force = recording(rng, 3.0, 0.35, 0.02)
        since = time - modulation_start(time, load)
        force = force + 7 * np.where((since >= 0) & (since < 3), 0.02 * np.exp(-since / 0.05), 0)
        measurement = measure(trace(time, load, force))
        if measurement.verdict == "ok":
            scores.append(errors(measurement)[0])
    assert len(scores) >= draws / 2
    assert np.abs(scores).max() < 5, scores
