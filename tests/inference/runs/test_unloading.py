"""Stiffness measured by unloading and reloading, on recordings by SciPy; spans that are refused."""

import numpy as np
import pytest
from benchmarks.coverage import STIFFNESS, TRUTH, coloured

from asperity.errors import InputError
from asperity.inference import measured_stiffness
from asperity.recording import Channel, Trace
from references.spring_slider import spring_slider

#: Sliding, 60 um back at the same velocity, and forward again.
TIMES, VELOCITIES = (0.0, 20.0, 26.0, 40.0), (1e-5, -1e-5, 1e-5)
#: Where the contact sticks, and where it begins to slide.
STICKS, SLIDES = (21.5, 30.5), (26.0, 34.0)
#: Load in newtons.
LOAD = 50.0


def displacement(time):
    corners = np.concatenate([[0.0], np.cumsum(np.diff(TIMES) * VELOCITIES)])
    return np.interp(time, TIMES, corners)


@pytest.fixture(scope="module")
def exact():
    """Friction of the ageing law by SciPy, 20 samples a second."""
    time = np.arange(0.0, 40.0, 0.05)
    law = {name: TRUTH[name] for name in ("A", "B", "D0", "V0", "mu0")}
    return time, spring_slider(VELOCITIES, TIMES, time, **law, k=STIFFNESS, rtol=1e-10)


def recorded(exact, seed=None, *, load=None, blur=0.0, sign=1.0):
    time, friction = exact
    random = np.random.default_rng(seed)
    noise = 0.0 if seed is None else coloured(random, time.size, 20.0)
    x = sign * displacement(time) + blur * random.normal(size=time.size)
    channels = {"displacement": Channel(x, "length", "m", "displacement", "m")}
    if load is None:
        channels["friction"] = Channel(sign * (friction + noise), "dimensionless", "", "friction")
    else:
        W = np.full(time.size, load)
        channels["F"] = Channel(sign * (friction + noise) * W, "force", "N", "shear force", "N")
        channels["W"] = Channel(W, "force", "N", "normal force", "N")
    return Trace(time, channels)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_slope_of_friction_without_noise_is_the_stiffness(exact, sign):
    stiffness = measured_stiffness(recorded(exact, load=LOAD, sign=sign), STICKS)
    # Before the onset of sliding the contact creeps by some 0.1 % of the displacement.
    assert stiffness.over_load == pytest.approx(STIFFNESS, rel=2e-3)
    assert stiffness.value == pytest.approx(STIFFNESS * LOAD, rel=2e-3)
    assert stiffness.unit == "N/m"
    assert (stiffness.prior.mean, stiffness.prior.unit) == (stiffness.value, "N/m")


def test_the_uncertainty_is_the_scatter_with_correlated_noise(exact):
    results = [measured_stiffness(recorded(exact, seed), STICKS) for seed in range(25)]
    values, errors = (np.array([getattr(f, n) for f in results]) for n in ("over_load", "se"))
    scatter = float(np.std(values - STIFFNESS))
    # Not smaller; larger by the curvature that noise may hide.
    assert 0.9 < np.mean(errors) / scatter < 3
    assert np.mean(np.abs(values - STIFFNESS) < 1.96 * errors) > 0.9
    assert results[0].unit == "1/m"
    # White noise of the size of the residuals would give less than half of the scatter.
    time = exact[0]
    inside = (time >= STICKS[0]) & (time <= STICKS[1])
    white = 8e-4 / (displacement(time[inside]).std() * np.sqrt(inside.sum()))
    assert white < 0.5 * scatter


def test_noise_of_the_displacement_does_not_lower_the_slope(exact):
    # Noise of 1.5 um with a spread of 13 um: ordinary least squares gives 1.3 % less.
    stiffness = measured_stiffness(recorded(exact, 3, blur=1.5e-6), STICKS)
    assert abs(stiffness.value - STIFFNESS) < 2 * stiffness.se
    assert stiffness.se > 0.01 * STIFFNESS


@pytest.mark.parametrize("seed", [None, 1, 2])
def test_a_span_in_which_the_contact_slides_is_refused(exact, seed):
    with pytest.raises(InputError, match="the contact slides in a part of it"):
        measured_stiffness(recorded(exact, seed), SLIDES)


@pytest.mark.parametrize(
    ("span", "message"),
    [
        ((5.0, 19.0), "must have a force that rises"),
        ((21.5, 22.5), "must hold at least 32 samples"),
        ((30.0, 21.0), "must end after it begins"),
    ],
)
def test_spans_without_unloading_are_refused(exact, span, message):
    with pytest.raises(InputError, match=message):
        measured_stiffness(recorded(exact, 1), span)


def test_a_hold_is_refused(exact):
    time, friction = exact
    x = np.where(time < 20, 1e-5 * time, 2e-4) + 1e-8 * np.random.default_rng(0).normal(
        size=time.size
    )
    channels = {"displacement": Channel(x, "length", "m", "displacement", "m")}
    channels["friction"] = Channel(friction, "dimensionless", "", "friction")
    trace = Trace(time, channels)
    with pytest.raises(InputError, match="must have a load point that moves"):
        measured_stiffness(trace, (21.0, 39.0))
