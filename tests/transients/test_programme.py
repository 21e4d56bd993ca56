"""Programmes of load and drive: the segments and values of their steps."""

import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest
from jax.scipy.special import i0
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, PchipInterpolator

from asperity.errors import InputError
from asperity.loads import (
    CyclicLoading,
    Excitation,
    Follow,
    Harmonic,
    Hold,
    Modulate,
    Periodic,
    Programme,
    RampLoad,
    RampVelocity,
    Slide,
    StepLoad,
)
from asperity.loads.programme.segment import load_of, pull_of
from asperity.transients import transient

START = {"load": "7 N", "velocity": "1 um/s"}


def test_steps_follow_each_other() -> None:
    p = Programme(
        *(Slide("1 s"), Hold("2 s"), StepLoad("9 N"), Slide("1 s"), Slide("1 s", "3 um/s")),
        *(RampLoad("5 N", "2 s"), RampVelocity("1 um/s", "4 s")),
        **START,
    )
    np.testing.assert_allclose(p.starts, [0, 1, 3, 4, 5, 7, 11])
    t = [0.5, 2.0, 3.0, 3.5, 4.5, 6.0, 9.0]
    np.testing.assert_allclose(p.load(t), [7, 7, 9, 9, 9, 7, 5], rtol=1e-15)
    np.testing.assert_allclose(p.velocity(t), [1e-6, 0, 1e-6, 1e-6, 3e-6, 3e-6, 2e-6], rtol=1e-15)
    # 1 + 0 + 1 + 3 + 6 + 8 micrometres.
    assert p.position(11.0) == pytest.approx(19e-6, rel=1e-14)
    assert p.last == (5.0, 1e-6)


def test_a_programme_laid_out_before_anything_else_is_in_double_precision() -> None:
    lines = (
        "from asperity.loads import Modulate, Programme",
        "p = Programme(Modulate('1 s', 0.24, '120 Hz'), load=7.1, velocity=1.1e-6)",
        "print(float(p.velocity(0.5)), float(p.segments[0].epsilon1))",
    )
    # In a process of its own: here other modules have switched double precision on.
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], check=True, capture_output=True, text=True
    )
    assert done.stdout.split() == ["1.1e-06", "0.24"]


def test_at_a_break_point_the_value_after_it_counts_however_times_are_rounded() -> None:
    p = Programme(Slide("0.1 s"), Slide("0.2 s"), StepLoad("9 N"), Slide("0.1 s"), **START)
    assert 3 * 0.1 > 0.3
    np.testing.assert_array_equal(p.load([0.3, 3 * 0.1]), [9.0, 9.0])


@pytest.mark.parametrize("t", [-0.1, 5.1, [1.0, 6.0]])
def test_there_is_no_load_beyond_the_programme(t) -> None:
    p = Programme(RampLoad("10 N", "5 s"), **START)
    with pytest.raises(InputError, match="t must lie within the programme, 0 to 5 s, got"):
        p.load(t)


def test_modulation_rises_and_falls_with_its_phase() -> None:
    m = Modulate("1 s", 0.24, "12.5 Hz", rise="0.25 s", fall="0.5 s", phase=0.3)
    p = Programme(m, **START)
    t = np.linspace(0, 1, 2001)
    envelope = p.load(t) / 7 - 1
    inside = (t >= 0.25) & (t <= 0.5)
    wave = np.cos(2 * np.pi * 12.5 * t + 0.3)
    np.testing.assert_allclose(envelope[inside], 0.24 * wave[inside], atol=1e-14)
    half = 0.24 * 0.5  # the smooth step is odd about its middle
    assert envelope[250] == pytest.approx(half * wave[250], rel=1e-12)
    assert envelope[1500] == pytest.approx(half * wave[1500], rel=1e-12)
    assert envelope[0] == envelope[-1] == 0
    assert np.all(np.abs(envelope) <= 0.24 * np.abs(wave) + 1e-14)


PERIODIC = Periodic(load=((0.2, 0.0), (0.0, 0.1)), shear=((0.05, 0.0),), pull=((0.1, 0.3),))


class DrivenByAClass(Harmonic):
    """A modulation of a user's class, whose pulling velocity is no attribute."""

    def at(self, theta: object) -> Excitation:
        pull = jnp.exp(0.5 * jnp.cos(theta)) / i0(0.5)
        return super().at(theta)._replace(pull=pull)


@pytest.mark.parametrize(
    "step",
    [
        RampLoad("9 N", "0.4 s"),
        RampVelocity("5 um/s", "0.4 s"),
        Modulate("0.4 s", 0.2, "7 Hz", rise="0.4 s", phase=0.4, epsilon_v=0.3, shear_ratio=0.2),
        CyclicLoading("0.4 s", PERIODIC, "7 Hz"),
        CyclicLoading("0.4 s", DrivenByAClass(0.2), "7 Hz"),
        Follow(
            np.linspace(0, 0.4, 9), 7 + np.sin(np.arange(9)), 1e-6 + 1e-7 * np.cos(np.arange(9))
        ),
    ],
    ids=["load ramp", "velocity ramp", "harmonic", "periodic", "class", "recorded"],
)
def test_slopes_and_positions_are_derivatives_and_integrals_of_the_values(step) -> None:
    (segment,) = Programme(step, **START).segments
    h = 1e-6
    for t in (0.0137, 0.1771, 0.3313):
        before, here, after = (segment.at(x, 1.0, 1.0) for x in (t - h, t, t + h))
        for name in ("w", "shear"):
            slope = (float(getattr(after, name)) - float(getattr(before, name))) / (2 * h)
            assert float(getattr(here, f"{name}_slope")) == pytest.approx(slope, rel=1e-7, abs=1e-7)
        way = quad(lambda x: float(pull_of(segment, x)), 0, t, points=np.linspace(0, 0.4, 9)[1:-1])[
            0
        ]
        assert float(segment.position(t)) == pytest.approx(way, rel=1e-9)
    t = np.linspace(0, 0.4, 400)
    assert segment.lowest_load <= np.min(load_of(segment, t)) + 1e-3
    assert segment.fastest_pull >= np.max(np.abs(pull_of(segment, t))) * (1 - 1e-3)


@pytest.mark.parametrize(("name", "peer"), [("pchip", PchipInterpolator), ("spline", CubicSpline)])
def test_a_recording_is_one_interpolant(name, peer) -> None:
    rng = np.random.default_rng(1)
    t = 3.0 + np.cumsum(rng.uniform(0.5e-3, 2e-3, 300))  # unevenly sampled
    W, V = 7 + rng.normal(size=300), 1e-6 * rng.uniform(0.5, 2, 300)
    p = Programme(Slide("0.5 s"), Follow(t, W, V, interpolant=name), Slide("0.1 s"), **START)
    x = np.linspace(t[0], t[-1], 1000)[:-1]
    (segment,) = [s for s in p.segments if type(s).__name__ == "RecordedSegment"]
    value, rate = segment.at(x - t[0], 1.0, 1.0)[:2]
    np.testing.assert_allclose(value, peer(t, W)(x), rtol=1e-11)
    np.testing.assert_allclose(rate, peer(t, W)(x, 1), rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(p.velocity(x - t[0] + 0.5), peer(t, V)(x), rtol=1e-11)
    assert p.last == (W[-1], V[-1])
    end = 0.5 + t[-1] - t[0]
    whole = 0.5e-6 + peer(t, V).integrate(t[0], t[-1])
    assert p.position(end) == pytest.approx(whole, rel=1e-12)


def test_the_lowest_load_of_a_spline_is_that_between_its_samples() -> None:
    # Contact is lost near t = 2.44 s; at all samples, and halfway between, the load is positive.
    time, load = np.arange(6.0), np.array([7.44, 5.44, 0.54, 0.49, 2.44, 7.44])
    (segment,) = Programme(Follow(time, load, interpolant="spline"), **START).segments
    values = load_of(segment, np.linspace(0, 5, 100_001))
    assert segment.lowest_load == pytest.approx(float(np.min(values)), abs=1e-6)
    assert segment.lowest_load < 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: Programme(Slide("1 s"), load=0.0, velocity=1e-6),
            "programme.load must be positive",
        ),
        (lambda: Programme(StepLoad(8.0), **START), "must take time"),
        (lambda: Programme("slide", **START), r"steps\[0\] must be a ProgrammeStep, got 'slide'"),
        (lambda: Programme(Slide("1 s"), Hold(0.0), **START), r"steps\[1\].duration must be posit"),
        (lambda: Programme(Slide("1 N"), **START), r"steps\[0\].duration"),
        (lambda: Programme(Modulate("1 s", 0.2, "10 rad/s"), **START), r"frequency"),
        (lambda: Programme(Modulate("1 s", -0.2, "10 Hz"), **START), "must not be negative"),
        (
            lambda: Programme(Modulate("1 s", 0.2, "10 Hz", rise="2 s"), **START),
            "must be at least rise and fall together, 2 s, got 1 s",
        ),
        (lambda: Programme(Follow([0, 1, 1], [7, 7, 7]), **START), "time must rise"),
        (lambda: Programme(Follow([0, 1, 2], [7, 7]), **START), "must be as long as time"),
        (lambda: Programme(Follow([0], [7]), **START), "two samples or more"),
        (lambda: Programme(Follow([0, 1], [7, np.nan]), **START), "must be finite"),
        (
            lambda: Programme(Follow([0, 1], [7, 8], None, "cubic"), **START),
            "must be one of pchip, spline",
        ),
    ],
)
def test_bad_steps_are_named(make, words) -> None:
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize("load", [0.0, -7.0, -0.0])
def test_a_step_to_no_load_is_refused(load) -> None:
    with pytest.raises(InputError, match="to must be positive"):
        Programme(Slide("1 s"), StepLoad(load), Slide("1 s"), **START)


@pytest.mark.parametrize(
    "first", [StepLoad("1e-7 N"), Modulate("1 s", 3.0, "10 Hz", phase=np.pi)], ids=["step", "phase"]
)
def test_a_beginning_without_contact_is_refused(physical, first) -> None:
    programme = Programme(first, Slide("1 s"), load="7 N", velocity="1 um/s")
    with pytest.raises(InputError, match="must press the slider on"):
        transient(physical.Experiment().slider, programme)
