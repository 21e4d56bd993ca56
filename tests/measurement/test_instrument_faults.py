"""Checks for faults of instruments that leave plausible numbers; a clean recording passes them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.recording import Channel, Trace, check
from references.populations import population

measure = partial(asp.measure, modulated=True)

RATE, F = 2000.0, 37.013


def named(measurement):
    return {c.name for c in measurement.checks if c.verdict != "ok"}


def by_name(measurement, name):
    return next(c for c in measurement.checks if c.name == name)


@pytest.fixture
def clean(truth, protocol):
    """Function that makes the protocol with pauses, far from the mains and without transients."""

    def make(seed=0, frequency=F, **options):
        source = truth.but(frequency=frequency, load_harmonics=(2e-3, 1e-3))
        options = {"rate": RATE, "end": 24.0, "on": (6.0, 18.0), "decay": 1e-3, **options}
        return protocol(source, seed=seed, **options)

    return make


def held(values, times):
    return np.repeat(values[::times], times)[: values.size]


def force_is_held(time, load, force):
    return time, load, held(force, 8)


def load_is_held_at_an_odd_rate(time, load, force):
    at = np.floor(np.floor(np.arange(time.size) / 3.7) * 3.7).astype(int)
    return time, load[at], force


def load_is_clipped_before_noise(time, load, force):
    rng = np.random.default_rng(5)
    clipped = np.minimum(load, 7 * (1 + 0.24 * 0.75))
    return time, clipped + 2e-3 * rng.standard_normal(time.size), force


def hum_in_the_force(frequency):
    def plant(time, load, force):
        return time, load, force + 5e-3 * np.cos(2 * np.pi * frequency * time + 1)

    return plant


def cross_talk(time, load, force):
    """The drive of the shaker in the force's signal, at 2 f, on all the time."""
    return time, load, force + 4e-3 * np.cos(4 * np.pi * F * time)


def response_shifts(time, load, force):
    on = (time >= 6) & (time < 18)
    response = 7 * 2e-3 * np.cos(2 * np.pi * F * time + 0.7 - 1.5)
    return time, load, force + np.where(on, 0.2 * (time - 12) / 12 * response, 0.0)


FAULTS = {
    "a force that is converted slowly": (force_is_held, {"held samples"}),
    "a load held at an odd rate": (load_is_held_at_an_odd_rate, {"held samples"}),
    "soft clipping": (load_is_clipped_before_noise, {"flat top"}),
    "cross-talk at 2f": (cross_talk, {"lines in the pauses"}),
    "hum at the modulation": (hum_in_the_force(F), {"lines in the pauses"}),
    "a response that shifts by a fifth": (response_shifts, {"shifting response"}),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("seed", population(2))
def test_a_fault_of_the_instrument_is_named(clean, trace, fault, seed) -> None:
    plant, names = FAULTS[fault]
    measurement = measure(trace(*plant(*clean(seed))))
    assert names <= named(measurement)
    assert measurement.verdict != "ok"


CHECKS = {"held samples", "flat top", "mains", "lines in the pauses", "hum", "shifting response"}


@pytest.mark.parametrize("seed", population(3))
@pytest.mark.parametrize("frequency", [F, 120.0, 50.0])
def test_a_clean_recording_is_not_suspected(clean, trace, seed, frequency) -> None:
    measurement = measure(trace(*clean(seed, frequency=frequency)))
    assert not named(measurement) & CHECKS
    # Each check is in the list, and gives a sentence.
    assert {c.name for c in measurement.checks} >= CHECKS
    assert all(c.sentence for c in measurement.checks)


@pytest.mark.parametrize("step", [0.05, 0.2])
def test_coarse_steps_are_not_taken_for_held_samples(clean, trace, step) -> None:
    time, load, force = clean()
    measurement = measure(trace(time, np.round(load / step) * step, force))
    assert by_name(measurement, "held samples").verdict == "ok"


def test_the_numbers_of_the_checks_are_those_planted(clean, trace) -> None:
    time, load, force = clean()
    lag = np.pi * F * 7 / RATE
    measurement = measure(trace(*force_is_held(time, load, force)))
    assert by_name(measurement, "held samples").number == pytest.approx(lag, rel=0.01)
    # The reading is wrong by this phase, apart from the delay of half a sample.
    reference = measure(trace(time, load, force))
    shift = np.angle(measurement.reading.harmonics[0] / reference.reading.harmonics[0])
    assert -shift == pytest.approx(lag, rel=0.05)
    # Clipping at 0.75 lasts arccos(0.75)/pi of the period, its edges up to 1 % of the height.
    flat = by_name(measure(trace(*load_is_clipped_before_noise(time, load, force))), "flat top")
    assert flat.number == pytest.approx(np.arccos(0.75) / np.pi, abs=0.03)
    shifted = by_name(measure(trace(*response_shifts(time, load, force))), "shifting response")
    assert shifted.number == pytest.approx(0.2 * 7 / 8, abs=0.06)


@pytest.mark.parametrize("base", [50.0, 60.0])
@pytest.mark.parametrize("seed", population(2))
def test_mains_alone_are_not_taken_for_a_modulation(trace, base, seed) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(20_000) / RATE
    hum = np.cos(2 * np.pi * (base + 0.02) * time)
    load = 7 + 0.02 * hum + 2e-3 * rng.standard_normal(time.size)
    force = 2.8 + 5e-3 * hum + 1e-3 * rng.standard_normal(time.size)
    measurement = measure(trace(time, load, force))
    mains = by_name(measurement, "mains")
    assert mains.verdict == "bad"
    assert mains.number == pytest.approx(0.02 / 7, rel=0.02)


def test_hum_at_the_modulation_is_suspected_from_another_line_of_the_mains(truth, trace) -> None:
    """Without pauses only a line at another harmonic of the mains shows hum at the modulation."""
    rng = np.random.default_rng(0)
    source = truth.but(frequency=120.0)
    time = np.arange(20_000) / RATE
    force = source.force(time) + 1e-3 * rng.standard_normal(time.size)
    load = source.load(time) + 2e-3 * rng.standard_normal(time.size)
    assert "hum" not in named(measure(trace(time, load, force)))
    hum = 4e-3 * np.cos(2 * np.pi * 60.0 * time) + 3e-3 * np.cos(2 * np.pi * 120.0 * time)
    measurement = measure(trace(time, load, force + hum))
    assert by_name(measurement, "hum").verdict != "ok"
    assert by_name(measurement, "hum").number == pytest.approx(4e-3 / (7 * 2e-3), rel=0.3)


@pytest.mark.parametrize("seed", population(3))
def test_a_force_made_from_friction_is_named_and_a_mean_load_suspected(clean, seed) -> None:
    time, load, force = clean(seed)

    def measured(friction):
        channels = {
            "W": Channel(load, "force", "N", "W", "N"),
            "mu": Channel(friction, "dimensionless", "", "mu"),
        }
        trace = Trace(time, channels)
        return measure(replace(trace, findings=check(trace)))

    right, wrong = measured(force / load), measured(force / 7.0)
    for measurement in (right, wrong):
        sentence = by_name(measurement, "computed force").sentence
        assert "the force was made from friction x load ('mu x load')" in sentence
    assert by_name(right, "computed force").verdict == "ok"
    assert by_name(wrong, "computed force").verdict == "suspicious"
    # The truth is 2e-3; division by the mean load gives epsilon times the mean friction.
    assert right.reading.phasor(1).amplitude == pytest.approx(2e-3, rel=0.05)
    assert wrong.reading.phasor(1).amplitude > 0.05


@pytest.mark.parametrize("seed", population(3))
def test_the_level_before_the_modulation_leaves_out_the_loading_ramp(clean, trace, seed) -> None:
    time, load, force = clean(seed)
    ramp = np.clip(time / 4, 0.02, 1)
    measurement = measure(trace(time, load * ramp, force * ramp))
    assert measurement.before.start >= 3.8
    assert measurement.before.value == pytest.approx(2.8, rel=2e-3)
    assert measurement.static_friction == pytest.approx(0.4, rel=2e-3)
    assert by_name(measurement, "drift").verdict == "ok"
    assert by_name(measurement, "drift").number < 2e-3
    assert measurement.delta_mu_uncertainty < 1e-3
