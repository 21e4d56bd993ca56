"""Faults of instruments that leave plausible numbers are named; a clean recording is ok."""

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


def named(found):
    return {c.name for c in found.checks if c.verdict != "ok"}


def by_name(found, name):
    return next(c for c in found.checks if c.name == name)


@pytest.fixture
def whole(truth, protocol):
    """The protocol with pauses, at a frequency far from the mains and without transients."""

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
    own = 7 * 2e-3 * np.cos(2 * np.pi * F * time + 0.7 - 1.5)
    return time, load, force + np.where(on, 0.2 * (time - 12) / 12 * own, 0.0)


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
def test_the_fault_is_named(whole, trace, fault, seed) -> None:
    plant, names = FAULTS[fault]
    found = measure(trace(*plant(*whole(seed))))
    assert names <= named(found)
    assert found.verdict != "ok"


NEW = {
    "held samples",
    "flat top",
    "mains",
    "lines in the pauses",
    "hum",
    "shifting response",
}


@pytest.mark.parametrize("seed", population(3))
@pytest.mark.parametrize("frequency", [F, 120.0, 50.0])
def test_a_clean_recording_is_not_suspected(whole, trace, seed, frequency) -> None:
    found = measure(trace(*whole(seed, frequency=frequency)))
    assert not named(found) & NEW
    # Each was asked, and answers with a number and a sentence.
    assert {c.name for c in found.checks} >= NEW
    assert all(c.sentence for c in found.checks)


@pytest.mark.parametrize("step", [0.05, 0.2])
def test_a_coarse_recorder_does_not_hold_samples(whole, trace, step) -> None:
    time, load, force = whole()
    found = measure(trace(time, np.round(load / step) * step, force))
    assert by_name(found, "held samples").verdict == "ok"


def test_numbers_are_those_planted(whole, trace) -> None:
    time, load, force = whole()
    lag = np.pi * F * 7 / RATE
    found = measure(trace(*force_is_held(time, load, force)))
    assert by_name(found, "held samples").number == pytest.approx(lag, rel=0.01)
    # It is the phase by which the reading is wrong, besides the wait of half a sample.
    clean = measure(trace(time, load, force))
    shift = np.angle(found.reading.harmonics[0] / clean.reading.harmonics[0])
    assert -shift == pytest.approx(lag, rel=0.05)
    # Clipped at 0.75: arccos(0.75)/pi of the period, and the edges up to 1 % of the height.
    flat = by_name(measure(trace(*load_is_clipped_before_noise(time, load, force))), "flat top")
    assert flat.number == pytest.approx(np.arccos(0.75) / np.pi, abs=0.03)
    shifted = by_name(measure(trace(*response_shifts(time, load, force))), "shifting response")
    assert shifted.number == pytest.approx(0.2 * 7 / 8, abs=0.06)


@pytest.mark.parametrize("base", [50.0, 60.0])
@pytest.mark.parametrize("seed", population(2))
def test_mains_alone_are_no_modulation(trace, base, seed) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(20_000) / RATE
    hum = np.cos(2 * np.pi * (base + 0.02) * time)
    load = 7 + 0.02 * hum + 2e-3 * rng.standard_normal(time.size)
    force = 2.8 + 5e-3 * hum + 1e-3 * rng.standard_normal(time.size)
    found = measure(trace(time, load, force))
    answer = by_name(found, "mains")
    assert answer.verdict == "bad"
    assert answer.number == pytest.approx(0.02 / 7, rel=0.02)


def test_hum_at_twice_the_mains_is_suspected_from_the_mains_themselves(truth, trace) -> None:
    """Without pauses only the other harmonics of the mains tell."""
    rng = np.random.default_rng(0)
    source = truth.but(frequency=120.0)
    time = np.arange(20_000) / RATE
    force = source.force(time) + 1e-3 * rng.standard_normal(time.size)
    load = source.load(time) + 2e-3 * rng.standard_normal(time.size)
    assert "hum" not in named(measure(trace(time, load, force)))
    hum = 4e-3 * np.cos(2 * np.pi * 60.0 * time) + 3e-3 * np.cos(2 * np.pi * 120.0 * time)
    found = measure(trace(time, load, force + hum))
    assert by_name(found, "hum").verdict != "ok"
    assert by_name(found, "hum").number == pytest.approx(4e-3 / (7 * 2e-3), rel=0.3)


@pytest.mark.parametrize("seed", population(3))
def test_a_force_made_from_friction_says_so_and_a_mean_load_is_recognised(whole, seed) -> None:
    time, load, force = whole(seed)

    def recorded(friction):
        channels = {
            "W": Channel(load, "force", "N", "W", "N"),
            "mu": Channel(friction, "dimensionless", "", "mu"),
        }
        made = Trace(time, channels)
        return measure(replace(made, findings=check(made)))

    right, wrong = recorded(force / load), recorded(force / 7.0)
    for found in (right, wrong):
        answer = by_name(found, "made force")
        assert "the force was made from friction x load ('mu x load')" in answer.sentence
    assert by_name(right, "made force").verdict == "ok"
    assert by_name(wrong, "made force").verdict == "suspicious"
    # The truth is 2e-3; the mean load makes it epsilon times the mean friction.
    assert right.reading.phasor(1).amplitude == pytest.approx(2e-3, rel=0.05)
    assert wrong.reading.phasor(1).amplitude > 0.05


@pytest.mark.parametrize("seed", population(3))
def test_a_loading_ramp_is_no_part_of_f0(whole, trace, seed) -> None:
    time, load, force = whole(seed)
    ramp = np.clip(time / 4, 0.02, 1)
    found = measure(trace(time, load * ramp, force * ramp))
    assert found.before.start >= 3.8
    assert found.before.value == pytest.approx(2.8, rel=2e-3)
    assert found.static_friction == pytest.approx(0.4, rel=2e-3)
    assert by_name(found, "drift").verdict == "ok"
    assert by_name(found, "drift").number < 2e-3
    assert found.delta_mu_uncertainty < 1e-3
