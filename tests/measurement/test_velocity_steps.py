"""A - B of velocity steps of an integrated slider in the noise of a rig, and of a real file."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.recording.readers import read
from references.populations import draws

measure_sliding = partial(asp.measure, modulated=False)

REAL = Path(__file__).resolve().parents[3] / "shared" / "data"
TRUE = -0.004  # A - B of the slider


def only_step(measurement):
    (step,) = measurement.steps
    return step


#: Velocities, slips and sampling rate; friction drifts with slip by 4.4 per metre.
CASES = {
    "tenfold, down": ((10e-6, 1e-6), (300e-6, 200e-6), 20),
    "threefold, long after": ((3e-6, 10e-6), (200e-6, 500e-6), 50),
}


@draws(6, 30)
@pytest.mark.parametrize("case", CASES)
def test_intervals_cover_in_correlated_noise_with_lines_and_drift(
    pulled, sliding_trace, case, draws
) -> None:
    velocities, slips, rate = CASES[case]
    hits, errors, uncertainties = [], [], []
    for seed in range(draws):
        time, slip, _, friction, _ = pulled(velocities, slips, (rate, rate), seed=seed, slope=4.4)
        step = only_step(measure_sliding(sliding_trace(time, friction, slip)))
        errors.append(step.rate_dependence - TRUE)
        uncertainties.append(step.rate_uncertainty)
        hits.append(abs(errors[-1]) < step.rate_interval_95)
    # With a coverage of 95 %, 27 of 30 is the quantile of 5 %, and 5 of 6 that of 3 %.
    assert sum(hits) >= {6: 5, 30: 27}[draws]
    # The intervals are not much too wide, and the mean has no bias.
    assert np.mean(uncertainties) < 3 * np.std(errors)
    assert abs(np.mean(errors)) < np.mean(uncertainties)


def test_longer_and_shorter_windows_agree(pulled, sliding_trace) -> None:
    time, slip, _, friction, bounds = pulled(
        (3e-6, 10e-6), (300e-6, 600e-6), (50, 50), seed=3, slope=4.4
    )
    steps = []
    for before, after in ((1, 1), (0.5, 0.5), (1, 0.4), (0.4, 1)):
        start = bounds[1] - before * (bounds[1] - bounds[0])
        end = bounds[1] + after * (bounds[2] - bounds[1])
        trace = sliding_trace(time, friction, slip)
        steps.append(only_step(measure_sliding(trace, window=(start, end))))
    whole, *parts = steps
    for part in parts:
        apart = abs(part.rate_dependence - whole.rate_dependence)
        assert apart < 2 * np.hypot(part.rate_uncertainty, whole.rate_uncertainty)


def test_signs_of_friction_and_displacement_do_not_matter(pulled, sliding_trace) -> None:
    time, slip, _, friction, _ = pulled((1e-6, 10e-6), (200e-6, 200e-6), (10, 50))
    reference, *turned = (
        only_step(measure_sliding(sliding_trace(time, mu * friction, x * slip)))
        for mu, x in ((1, 1), (-1, 1), (1, -1), (-1, -1))
    )
    for step in turned:
        assert step.rate_dependence == pytest.approx(reference.rate_dependence, rel=1e-9)
        assert step.peak == pytest.approx(reference.peak, rel=1e-9)


def test_a_trend_is_removed_unless_detrend_is_none(pulled, sliding_trace) -> None:
    time, slip, _, friction, _ = pulled(
        (3e-6, 10e-6), (300e-6, 300e-6), (50, 50), noise=2e-4, slope=40.0
    )
    trace = sliding_trace(time, friction, slip)
    straight = only_step(measure_sliding(trace))
    assert straight.trend == "one slope"
    assert straight.slope_before == pytest.approx(40, rel=0.05)
    assert abs(straight.rate_dependence - TRUE) < straight.rate_interval_95
    level = only_step(measure_sliding(trace, detrend="none"))
    assert level.trend == "none"
    # The middles of the windows are 0.3 mm apart: a slope of 40 /m adds 0.012 and turns the sign.
    assert level.rate_dependence > 0.003
    assert only_step(measure_sliding(trace, detrend="quadratic")).rate_uncertainty > 0
    with pytest.raises(InputError, match="detrend must be one of none, linear, quadratic"):
        measure_sliding(trace, detrend="cubic")


def test_different_slopes_before_and_after_are_fitted(pulled, sliding_trace) -> None:
    time, slip, _, friction, bounds = pulled(
        (3e-6, 10e-6), (300e-6, 300e-6), (50, 50), noise=2e-4, slope=0.0
    )
    bent = friction + np.where(time > bounds[1], -30.0, 10.0) * (slip - 300e-6)
    step = only_step(measure_sliding(sliding_trace(time, bent, slip)))
    assert step.trend == "two slopes"
    assert (step.slope_before, step.slope_after) == pytest.approx((10, -30), rel=0.1)
    assert abs(step.rate_dependence - TRUE) < step.rate_interval_95


def test_a_step_too_short_to_be_read_is_named(sliding_trace) -> None:
    time = np.arange(2000) * 0.01
    slip = 1e-6 * np.minimum(time, 19.9) + 1e-4 * np.clip(time - 19.9, 0, None)
    friction = 0.6 + 1e-4 * np.random.default_rng(0).standard_normal(time.size)
    measurement = measure_sliding(sliding_trace(time, friction, slip), steps=[19.9])
    assert measurement.steps == ()
    check = next(c for c in measurement.checks if c.name == "segments")
    assert check.verdict == "suspicious"
    assert "too few samples" in check.sentence


#: Recorded displacements: the slip of the contact, and a gear whose velocity ripples by 20 %.
MOTIONS = {
    "contact": lambda slip, mu: slip - mu / 3e3,
    "gear": lambda slip, mu: slip + 0.2 * 2e-6 * np.sin(slip / 2e-6),
}


@pytest.mark.parametrize("motion", MOTIONS)
def test_unsteady_displacements_make_no_steps(pulled, sliding_trace, motion) -> None:
    velocities = (10e-6, 30e-6, 10e-6, 100e-6, 10e-6)
    time, slip, clean, friction, bounds = pulled(velocities, (200e-6,) * 5, (100,) * 5, noise=3e-4)
    displacement = MOTIONS[motion](slip, clean)
    measurement = measure_sliding(sliding_trace(time, friction, displacement))
    assert [s.time for s in measurement.steps] == pytest.approx(bounds[1:-1].tolist(), abs=0.3)
    for step in measurement.steps:
        assert abs(step.rate_dependence - TRUE) < step.rate_interval_95


@draws(4, 8)
def test_the_interval_contains_the_unevenness_of_the_velocities(sliding_trace, draws) -> None:
    """The velocity ripples by 10 % over 63 um: the segments hold no whole number of periods."""
    errors, halves = [], []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time = np.arange(0, 140, 0.02)
        slip = np.interp(time, [0, 100, 140], [0, 300e-6, 700e-6])
        friction = 0.6 + TRUE * np.log(np.where(time < 100, 1, 10 / 3))
        friction += 1e-5 * rng.standard_normal(time.size)
        ripple = 1e-6 * np.sin(slip / 10e-6 + rng.uniform(0, 2 * np.pi))
        step = only_step(measure_sliding(sliding_trace(time, friction, slip + ripple)))
        errors.append(abs(step.rate_dependence - TRUE))
        halves.append(step.rate_interval_95)
    assert np.all(np.array(errors) < halves)
    # The lengths of 300 and 400 um are uncertain by less than the 2 um from crest to trough.
    assert max(halves) < (2 / 300 + 2 / 400) * abs(TRUE) / np.log(10 / 3)


def test_the_loading_before_a_step_is_left_out(pulled, sliding_trace) -> None:
    time, slip, clean, friction, _ = pulled(
        (10e-6, 30e-6), (200e-6, 200e-6), (100, 100), noise=3e-4
    )
    loading = np.arange(0, 20, 0.01)
    elastic = np.minimum(3e3 * 10e-6 * loading, clean[0])
    trace = sliding_trace(
        np.concatenate([loading, time + 20]),
        np.concatenate([elastic, friction]),
        np.concatenate([10e-6 * loading, slip + 200e-6]),
    )
    step = only_step(measure_sliding(trace))
    assert abs(step.rate_dependence - TRUE) < step.rate_interval_95 < 0.001


@pytest.mark.skipif(not REAL.is_dir(), reason="the real recordings are not here")
def test_basalt_weakens_with_velocity_as_published() -> None:
    """Means of the drifting segments give +0.00039, linear trends -0.00040 to -0.00053."""
    trace = read(REAL / "velstep4_BRAVA_expb819_basalt.txt")
    step = only_step(measure_sliding(trace))
    assert step.time == pytest.approx(11676.36, abs=0.1)
    assert -0.0008 < step.rate_dependence < -0.0002
    for published in (-0.00040, -0.00053):
        assert abs(step.rate_dependence - published) < step.rate_interval_95
    # White noise of these 5849 samples would give an uncertainty of about 2e-5.
    assert step.rate_uncertainty > 1e-4
    for window in ((11640.0, 11726.0), (11607.0, 11700.0), (11640.0, 11700.0)):
        part = only_step(measure_sliding(trace, window=window))
        apart = abs(part.rate_dependence - step.rate_dependence)
        assert apart < 2 * np.hypot(part.rate_uncertainty, step.rate_uncertainty)
