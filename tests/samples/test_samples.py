"""Sample recordings hold what their protocols say."""

from functools import cache

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from references.populations import population


@cache
def recorded(name: str, seed: int = 0):
    return asp.samples.record(name, seed)


@cache
def measured(name: str, seed: int = 0):
    return asp.measure(recorded(name, seed))


def test_a_velocity_step_changes_steady_friction_by_a_minus_b() -> None:
    truth = asp.samples.truth("velocity_steps")
    expected = (truth["A"].value - truth["B"].value) * np.log(10.0)
    steps = measured("velocity_steps").steps
    assert len(steps) == 4
    for step, sign in zip(steps, (1, -1, 1, -1), strict=True):
        # Twice the half-width of 95 %: four standard errors and more.
        assert abs(step.change - sign * expected) < 2 * step.interval_95


def test_the_load_of_the_modulated_sample_is_that_of_its_protocol() -> None:
    reading = measured("modulated").reading
    assert reading.frequency == pytest.approx(120.0, rel=1e-6)
    # The load cell has a bandwidth of 5 kHz, its recorder one of 800 Hz.
    assert reading.epsilon == pytest.approx(0.24, rel=1e-3)
    assert pytest.approx(asp.samples.truth("modulated")["W0"].value, rel=1e-4) == reading.W0


def test_the_same_seed_makes_the_same_recording_and_another_seed_another() -> None:
    one, same, other = recorded("modulated"), asp.samples.modulated(), asp.samples.modulated(1)
    force = [trace.channels["shear force"].values for trace in (one, same, other)]
    np.testing.assert_array_equal(force[0], force[1])
    assert np.any(force[0] != force[2])


@pytest.mark.parametrize("name", asp.samples.names())
def test_every_sample_is_a_protocol_with_an_instrument(name: str) -> None:
    protocol = asp.samples.protocol(name)
    assert protocol.title
    assert protocol.setup is not None


def test_a_name_or_seed_that_is_none_is_named() -> None:
    with pytest.raises(InputError, match=r"name must be a sample, got 'velocity_step'"):
        asp.samples.record("velocity_step")
    with pytest.raises(InputError, match="seed must be at least 0"):
        asp.samples.record("modulated", -1)


def test_the_stick_slip_sample_loads_as_its_spring_says_and_slips_for_half_a_period() -> None:
    truth = {name: number.value for name, number in asp.samples.truth("stick_slip").items()}
    trace = recorded("stick_slip")
    result = asp.measure(trace, stiffness=truth["K"], velocity="100 um/s", mass=truth["M"])
    assert result.kind in ("regular stick-slip", "irregular stick-slip")
    # The joint is a second spring in series with the first: K/(1 + lambda K/W0).
    joint = 1 + truth["lambda"] * truth["K"] / truth["W0"]
    stiffness, _ = result.stiffness_from_slope
    assert stiffness == pytest.approx(truth["K"] / joint, rel=0.02)
    half = np.pi * np.sqrt(truth["M"] / truth["K"])
    assert np.median(result.events.slip_duration) == pytest.approx(half, rel=0.15)
    # From one onset to the next the slider moves as far as the spring's end: by slips, and by some
    # percent of creep in the sticks.
    moved = np.mean(result.slip[1:-1]) / (100e-6 * np.mean(result.events.recurrence[2:]))
    assert 0.94 < moved < 1.0


@pytest.mark.parametrize("seed", population(3))
@pytest.mark.parametrize("name", ["velocity_steps", "slide_hold_slide", "modulated", "stick_slip"])
def test_no_check_doubts_what_the_virtual_tribometer_has_recorded(name: str, seed: int) -> None:
    """Once, a hold was cut off in the middle of a block: seven of twelve slide-hold-slides."""
    checks = measured(name, seed).checks
    assert [check for check in checks if check.verdict != "ok"] == []


def test_steps_of_the_load_are_said_to_be_none_of_the_velocity() -> None:
    checks = asp.measure(asp.samples.load_steps()).checks
    (load,) = (check for check in checks if check.verdict != "ok")
    assert load.name == "load"
    assert "or fit a law, whose motion follows it" in load.sentence
