"""Holds and velocity steps: many at once against SciPy at 1e-12, and series that are recorded."""

from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.experiment import (
    SlideHoldSlide,
    VelocitySteps,
    hold_response,
    slide_hold_slide,
    step_response,
    velocity_steps,
)
from asperity.laws import RiceRuina, law_parameters, registered
from asperity.loads import Programme
from asperity.protocol.steps import parse_step
from asperity.tribometer.sensors import DisplacementGauge, LoadCell
from asperity.tribometer.tribometer import Recorder, Tribometer
from references.holds_and_steps import STATE_RATES, Interface
from references.populations import population

A, B, D0, V0 = 0.008, 0.009, 3e-6, 1e-6
LAWS = tuple(STATE_RATES)
#: An ageing law and a slip law.
TWO = LAWS[:2]


def law(name, **changes):
    return registered()[name](**({"mu0": 0.6, "A": A, "B": B, "D0": D0, "V0": V0} | changes))


def holds_at_random(count, seed):
    """K/W0 1e-4 to 1 per um, hold times 0.1 to 1e7 s, velocities over six decades."""
    draw = np.random.default_rng(seed)
    k = 10 ** draw.uniform(2, 6, count)
    V = 10 ** draw.uniform(-9, -3, count)
    return k, V, 10 ** draw.uniform(-1, 7, count)


@pytest.mark.parametrize("name", population(LAWS, short=2))
def test_holds_are_those_of_scipy(name):
    k, V, time = holds_at_random(8, 1)
    mine = hold_response(law(name), hold_time=time, velocity=V, stiffness=k, settling=False)
    exact = np.array(
        [
            Interface(name, A, B, D0, *p).hold(*q)
            for p, q in zip(k[:, None], zip(V, time, strict=True), strict=True)
        ]
    ).T
    level, low, high, slip, more = exact
    assert mine.has_maximum.all()
    assert mine.outcomes() == "8 points, followed to the extremum only"
    np.testing.assert_allclose(mine.level, 0.6 + level, atol=1e-12)
    np.testing.assert_allclose(mine.minimum, 0.6 + low, atol=1e-9)
    np.testing.assert_allclose(mine.healing, high - level, atol=1e-9)
    np.testing.assert_allclose(mine.hold_slip, slip, rtol=1e-7)
    np.testing.assert_allclose(mine.slip, more, rtol=2e-5)
    np.testing.assert_allclose(mine.velocity_at_maximum, V, rtol=1e-9)


@pytest.mark.parametrize("name", population(LAWS, short=2))
def test_steps_are_those_of_scipy(name):
    k, ratios = np.array([2e3, 2e4, 1e6]), np.array([10.0, 0.1, 1e3])
    mine = step_response(law(name), velocity_before=V0, velocity=V0 * ratios, stiffness=k)
    exact = [Interface(name, A, B, D0, K).step(V0, r * V0) for K, r in zip(k, ratios, strict=True)]
    for value, expected in zip(
        (mine.before, mine.extremum, mine.after), np.transpose(exact), strict=True
    ):
        np.testing.assert_allclose(value, 0.6 + expected, atol=1e-9)


def test_the_healing_rate_is_the_slope_of_healing():
    time = 100 * np.exp([-1e-3, 0.0, 1e-3])
    for name in TWO:
        holds = hold_response(law(name), hold_time=time, velocity=V0, stiffness=7.4e4)
        slope = (holds.healing[2] - holds.healing[0]) / 2e-3 * np.log(10)
        assert holds.healing_rate[1] == pytest.approx(slope, rel=1e-5)


def test_no_slip_is_left_at_settling():
    """Of a stiff spring after a small step the force follows exp(-u/D0), by any of the laws."""
    for name in TWO:
        done = step_response(law(name), velocity_before=V0, velocity=1.001 * V0, stiffness=1e7)
        assert done.settling_slip - done.slip == pytest.approx(D0 * np.log(20), rel=0.02)


def test_a_spring_below_the_critical_stiffness_runs_away():
    critical = (B - A) / D0
    for name in TWO:
        done = hold_response(
            law(name), hold_time=10, velocity=V0, stiffness=critical * np.array([0.97, 1.03])
        )
        assert list(done.stable) == [False, True]
        assert "softer than the critical stiffness" in done.result[0]
        assert np.isnan(done.settling_slip[0])


def test_a_long_hold_may_run_away_above_the_critical_stiffness():
    """The slip law, not the ageing one: a large disturbance weakens it without bound."""
    for name, expected in zip(TWO, ("comes back", "accelerates"), strict=True):
        done = hold_response(law(name), hold_time=1e6, velocity=1e-6, stiffness=2e3)
        assert done.stable
        assert str(done.result).startswith(expected)


def test_without_a_maximum_static_friction_is_the_level():
    """A soft spring on a strengthening interface: the force comes back from below."""
    done = hold_response(law("rice-ruina", A=0.02), hold_time=1.0, velocity=V0, stiffness=1e2)
    assert not done.has_maximum
    assert done.healing == pytest.approx(0, abs=1e-10)
    assert np.isnan(done.distance)


def test_grids_have_names(tmp_path):
    k = np.array([[2e3], [7.4e4]])
    data = hold_response(
        law("rice-ruina"), hold_time=[1, 10, 100], velocity=V0, stiffness=k
    ).to_dataset()
    assert dict(data.sizes) == {"K": 2, "hold_time": 3}
    assert data.healing.attrs["units"] == "1"
    assert data.velocity.item() == V0
    assert all({"units", "long_name"} <= set(c.attrs) for c in data.coords.values())
    assert data.velocity.attrs["long_name"] == "velocity of the drive"
    data.to_netcdf(tmp_path / "holds.nc")
    steps = step_response(
        law("rice-ruina"), velocity_before=V0, velocity=[1e-5, 1e-7], stiffness="1 1/um"
    )
    assert dict(steps.to_dataset().sizes) == {"velocity": 2}


@pytest.mark.long
def test_every_law_with_a_memory_heals():
    healed = {}
    for name, kind in registered().items():
        if not kind.rate_dependent:
            with pytest.raises(InputError, match="must depend on the velocity"):
                hold_response(kind(mu0=0.6), hold_time=1, velocity=1e-6, stiffness=1e5)
            continue
        given = {"mu0": 0.6, "A": A, "B": B, "D0": D0, "V0": V0}
        others = {"lambda_": 1e-6, "alpha": 0.1, "c": 0.1, "B2": 0.002, "D2": 1e-5}
        others |= {"V1": 1.0, "V2": 1.0, "L": 1e-6, "V_star": 1.0}
        fields = {
            f: (given | others)[f]
            for f in (p.path.rsplit(".", 1)[-1] for p in law_parameters(kind).values())
        }
        done = hold_response(kind(**fields), hold_time=100, velocity=1e-6, stiffness=1e5)
        healed[name] = float(done.healing)
        assert done.has_maximum, name
        assert done.velocity_at_maximum == pytest.approx(1e-6, rel=1e-8)
    assert len(healed) > 8
    assert all(0.002 < value < 0.1 for value in healed.values()), healed


def test_a_slider_is_its_law_on_its_spring():
    slider = asp.Slider(law("ruina-slip"), spring=2e5, load=10.0)
    one = hold_response(slider, hold_time="10 s", velocity="1 um/s")
    other = hold_response(law("ruina-slip"), hold_time=10, velocity=1e-6, stiffness="0.02 1/um")
    assert float(one.healing) == pytest.approx(float(other.healing), abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"hold_time": -1}, "hold_time must be positive"),
        ({"hold_time": 1e30}, "at most 1e"),
        ({"velocity": "1 um"}, "velocity"),
        ({"stiffness": None}, "stiffness must be given"),
        ({"stiffness": "1 N/m"}, "stiffness"),
        ({"hold_time": [1.0, 2.0], "velocity": [1e-6, 2e-6, 3e-6]}, "broadcast"),
        ({"settling": 1}, "True or False"),
    ],
)
def test_what_breaks_a_rule_is_said(changes, words):
    arguments = {"hold_time": 1, "velocity": 1e-6, "stiffness": 1e4} | changes
    with pytest.raises(InputError, match=words):
        hold_response(law("rice-ruina"), **arguments)


def test_a_step_needs_two_velocities():
    with pytest.raises(InputError, match="must differ"):
        step_response(law("rice-ruina"), velocity_before=1e-6, velocity=1e-6, stiffness=1e4)


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
    with pytest.raises(InputError, match="must contain a time"):
        Programme(SlideHoldSlide([], "1 s"), load=7.0, velocity=1e-6)
