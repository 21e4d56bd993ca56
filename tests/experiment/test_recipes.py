"""Series of holds and velocity steps: what is laid out, and what a recording of them shows."""

from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.experiment import SlideHoldSlide, VelocitySteps, slide_hold_slide, velocity_steps
from asperity.laws import RiceRuina
from asperity.loads import Programme
from asperity.protocol.steps import parse_step
from asperity.tribometer.sensors import DisplacementGauge, LoadCell
from asperity.tribometer.tribometer import Recorder, Tribometer


@pytest.fixture
def slider():
    law = RiceRuina(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6)
    return asp.Slider(law, spring="0.5 N/um", load=7.0)


@pytest.fixture
def rig():
    cell, gauge = LoadCell(bandwidth="400 Hz"), DisplacementGauge(bandwidth="400 Hz")
    sensors = {"shear force": cell, "normal force": cell, "drive position": gauge}
    return Tribometer(sensors=sensors, recorder=Recorder(rate="200 Hz"))


def test_lines_of_a_protocol_are_the_steps() -> None:
    holds = parse_step("slide-hold-slide for 1 s, 10 s sliding 2 s", "step 1", Path())
    assert Programme(holds, load=7.0, velocity=1e-6).duration == pytest.approx(17.0)
    speeds = parse_step("velocity steps 1 um/s, 10 um/s, 1 um/s over 20 um", "step 1", Path())
    programme = Programme(speeds, load=7.0, velocity=1e-6)
    assert programme.duration == pytest.approx(20 + 2 + 20)
    assert programme.position(np.array([42.0]))[0] == pytest.approx(60e-6)


def test_velocity_steps_change_the_friction_by_a_minus_b(slider, rig) -> None:
    trace = velocity_steps(slider, rig, ["10 um/s", "100 um/s"], slip="40 um")
    time, force = trace.time, trace.channels["shear force"].values
    before, after = force[(time > 2) & (time < 3.9)].mean(), force[time > 4.3].mean()
    expected = 7 * (0.013 - 0.026) * np.log(10)
    assert after - before == pytest.approx(expected, rel=1e-4)
    drive = trace.channels["drive position"].values
    assert np.ptp(drive) == pytest.approx(80e-6, rel=2e-2)


def test_longer_holds_heal_more(slider, rig) -> None:
    trace = slide_hold_slide(slider, rig, ["1 s", "4 s"], velocity="10 um/s", sliding="3 s")
    time, force = trace.time, trace.channels["shear force"].values
    steady = force[time < 2.9].mean()
    first, second = force[(time > 4) & (time < 6.9)].max(), force[time > 11].max()
    assert steady < first < second


def test_what_is_no_series_is_one_sentence() -> None:
    with pytest.raises(InputError, match="must have positive velocities"):
        Programme(VelocitySteps(["1 um/s", 0.0], "1 um"), load=7.0, velocity=1e-6)
    with pytest.raises(InputError, match="must hold a time"):
        Programme(SlideHoldSlide([], "1 s"), load=7.0, velocity=1e-6)
