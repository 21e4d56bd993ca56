"""Sample recordings hold what their protocols say."""

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError


def test_a_velocity_step_changes_steady_friction_by_a_minus_b() -> None:
    truth = asp.samples.truth("velocity_steps")
    expected = (truth["A"].value - truth["B"].value) * np.log(10.0)
    steps = asp.measure(asp.samples.velocity_steps(seed=4)).steps
    assert len(steps) == 4
    for step, sign in zip(steps, (1, -1, 1, -1), strict=True):
        # Twice the half-width of 95 %: four standard errors and more.
        assert abs(step.change - sign * expected) < 2 * step.interval_95


def test_the_load_of_the_modulated_sample_is_that_of_its_protocol() -> None:
    reading = asp.measure(asp.samples.modulated(seed=2)).reading
    assert reading.frequency == pytest.approx(120.0, rel=1e-6)
    # The load cell has a bandwidth of 5 kHz, its recorder one of 800 Hz.
    assert reading.epsilon == pytest.approx(0.24, rel=1e-3)
    assert pytest.approx(asp.samples.truth("modulated")["W0"].value, rel=1e-4) == reading.W0


def test_the_same_seed_makes_the_same_recording_and_another_seed_another() -> None:
    one, same, other = (asp.samples.modulated(seed) for seed in (1, 1, 2))
    force = [trace.channels["shear force"].values for trace in (one, same, other)]
    np.testing.assert_array_equal(force[0], force[1])
    assert np.any(force[0] != force[2])


@pytest.mark.parametrize("name", asp.samples.names())
def test_every_sample_is_a_protocol_with_an_instrument(name: str) -> None:
    protocol = asp.samples.protocol(name)
    assert protocol.title
    assert protocol.setup is not None


def test_a_name_or_seed_that_is_none_is_named() -> None:
    with pytest.raises(InputError, match=r"samples\.name must be a sample, got 'velocity_step'"):
        asp.samples.record("velocity_step")
    with pytest.raises(InputError, match=r"samples\.seed must be a whole number of at least 0"):
        asp.samples.record("modulated", -1)
