"""Segments of one velocity: their limits over decades of velocity, and short holds."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

import asperity as asp
from asperity.errors import InputError
from asperity.measurement.sliding.change_points import displacement_noise
from asperity.measurement.sliding.segments import partition
from references.populations import population
from references.spring_slider import pulled_in_parts

measure_sliding = partial(asp.measure, modulated=False)

UM = 1e-6


def stepped(velocities, lengths, rates, *, resolution=2e-8, seed=0, jump=0.01):
    """Time, displacement, friction that jumps at every step, and the times of the steps."""
    rng = np.random.default_rng(seed)
    bounds, time, slip, slips = pulled_in_parts(velocities, lengths, rates)
    friction = np.full(time.size, 0.6)
    for k, at in enumerate(bounds[1:-1]):
        if velocities[k] and velocities[k + 1]:
            since = np.clip(slip - np.sum(slips[: k + 1]), 0, None)
            size = jump * np.log(velocities[k + 1] / velocities[k])
            friction += (
                (time >= at) * size * (0.3 - np.exp(-since / 2e-6) + 0.7 * np.exp(-since / 8e-6))
            )
    friction += 3e-4 * rng.standard_normal(time.size)
    return time, slip + resolution * rng.standard_normal(time.size), friction, bounds[1:-1]


#: Velocities (m/s), slips (m) or seconds of holds, samples per second.
RECORDS = {
    "four decades at equal slip": (
        (0.1 * UM, UM, 10 * UM, 100 * UM),
        (400 * UM,) * 4,
        (1, 10, 100, 1000),
    ),
    "up and down": (
        (0.1 * UM, UM, 10 * UM, 100 * UM, 10 * UM, UM),
        (300 * UM,) * 6,
        (1, 1, 10, 100, 10, 1),
    ),
    "four decades at equal time": (
        (0.1 * UM, UM, 10 * UM, 100 * UM),
        (6 * UM, 60 * UM, 600 * UM, 6000 * UM),
        (10,) * 4,
    ),
    "one rate to a hundred": ((UM, 10 * UM), (300 * UM, 300 * UM), (1, 100)),
    "a hundred seconds to one": ((10 * UM, UM), (300 * UM, 300 * UM), (100, 1)),
    "steady": ((3 * UM,), (600 * UM,), (50,)),
    "holds, the first of a second": (
        (10 * UM, 0, 10 * UM, 0, 10 * UM),
        (300 * UM, 1.0, 300 * UM, 100.0, 300 * UM),
        (100, 100, 100, 2, 100),
    ),
}


@pytest.mark.parametrize("name", RECORDS)
def test_every_change_of_velocity_is_found_and_nothing_else(name) -> None:
    velocities, lengths, rates = RECORDS[name]
    time, slip, _, truth = stepped(velocities, lengths, rates)
    cut = partition(time, slip)
    # To a tenth of a second, although the coarsest samples are a second apart.
    assert [c.time for c in cut.cuts] == pytest.approx(truth.tolist(), abs=0.1)
    moving = [v for v, hold in zip(cut.velocities, cut.holds, strict=True) if not hold]
    assert moving == pytest.approx([v for v in velocities if v], rel=0.02)
    assert cut.holds == tuple(v == 0 for v in velocities)
    assert cut.doubts == ()


def random_motion(rng):
    """Time, displacement, noise, and the velocities, spans and ramps of a random drive.

    Changes by 1.6 and more, holds, ramps of up to a tenth of both sides, 10 Hz to 3 kHz, white
    noise, a coarse recorder, or noise correlated over 2 to 30 samples; every change is at least
    twelve standard deviations of its estimate from both sides.
    """
    while True:
        rate, count = 10 ** rng.uniform(1, 3.5), int(rng.integers(2, 7))
        base, decades = 10 ** rng.uniform(-7, -4), rng.choice([0.5, 1, 2])
        v = [base]
        while len(v) < count:
            hold = v[-1] > 0 and len(v) < count - 1 and rng.random() < 0.25
            new = 0.0 if hold else base * 10 ** (decades * rng.uniform(-0.5, 0.5))
            if hold or v[-1] == 0 or abs(np.log(new / v[-1])) > np.log(1.6):
                v.append(new)
        v = np.array(v)
        spans = 10 ** rng.uniform(0, 2) * 10 ** rng.uniform(-0.7, 0.7, count)
        slips, pairs = v * spans, np.minimum(spans[1:], spans[:-1])
        ramps = pairs * 10 ** rng.uniform(-3, -1, count - 1)
        least = np.minimum(*(np.where(s > 0, s, np.inf) for s in (slips[1:], slips[:-1])))
        ramps = np.minimum(ramps, 0.2 * least / (v[1:] + v[:-1]))
        noise = slips[slips > 0].min() * 10 ** rng.uniform(-4, -1)
        hinge = np.abs(np.diff(v)) * pairs / 4
        seen = hinge * np.sqrt(pairs * rate / 50)
        size = int(spans.sum() * rate)
        if (
            200 < size < 50_000
            and (spans * rate).min() > 40
            and min(seen.min() / 12, hinge.min()) > noise
        ):
            break
    time = np.arange(size) / rate
    cuts = np.cumsum(spans)[:-1]
    knots = np.sort(np.concatenate([[0.0], cuts - ramps / 2, cuts + ramps / 2, [spans.sum()]]))
    fine = np.linspace(0, spans.sum(), 20 * size)
    path = np.cumsum(np.interp(fine, knots, np.repeat(v, 2))) * fine[1]
    slip = np.interp(time, fine, path)
    kind = rng.integers(3)
    if kind == 0:
        slip = slip + noise * rng.standard_normal(size)
    elif kind == 1:
        slip = np.round(slip / noise / np.sqrt(12)) * noise * np.sqrt(12)
    else:
        keep = np.exp(-1 / 10 ** rng.uniform(0.3, 1.5))
        slip = slip + noise * lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(size))
    return time, slip, noise, v, spans, ramps


@pytest.mark.parametrize("seed", population(3))
def test_random_motions_are_cut_right_or_reported_as_doubtful(seed) -> None:
    for k in range(6):
        time, slip, noise, v, spans, ramps = random_motion(np.random.default_rng([seed, k]))
        cut = partition(time, slip)
        if cut.doubts:
            continue
        assert cut.holds == tuple(v == 0)
        wide = 3 * noise / np.abs(np.diff(v)) + ramps + 4 * time[1]
        wide += 0.02 * np.minimum(spans[1:], spans[:-1])
        away = np.abs([c.time for c in cut.cuts] - np.cumsum(spans)[:-1])
        assert np.all(away < wide)
        assert np.all(np.abs(cut.velocities - v) < 0.05 * v + 6 * noise / spans)


def test_seconds_of_acceleration_are_not_taken_for_a_segment(sliding_trace) -> None:
    """As a segment, 5 s at 319 nm/s between 200 nm/s and 2 um/s would raise A - B by a quarter."""
    time, slip, friction, _ = stepped(
        (0.2 * UM, 0.319 * UM, 2 * UM), (440 * UM, 1.6 * UM, 900 * UM), (7, 7, 7), resolution=2e-7
    )
    measurement = measure_sliding(sliding_trace(time, friction, slip))
    assert [s.velocity for s in measurement.segments] == pytest.approx([0.2 * UM, 2 * UM], rel=0.01)
    (step,) = measurement.steps
    assert step.velocity_after / step.velocity_before == pytest.approx(10, rel=0.02)


def test_a_disturbance_of_the_motor_is_not_taken_for_a_step() -> None:
    time, slip, _, (first, *_) = stepped(
        (3 * UM, 10 * UM, 17 * UM, 10 * UM), (200 * UM, 50 * UM, 8 * UM, 200 * UM), (100,) * 4
    )
    cut = partition(time, slip)
    assert [c.time for c in cut.cuts] == pytest.approx([first], abs=0.05)


@pytest.mark.parametrize("defect", ["spike", "jump"])
def test_a_spike_or_a_jump_of_the_gauge_is_not_taken_for_motion(defect) -> None:
    time = np.arange(2000) * 0.01
    slip = 3 * UM * time + 1e-8 * np.random.default_rng(0).standard_normal(time.size)
    slip[slice(700, 701 if defect == "spike" else None)] += 1e-3
    cut = partition(time, slip)
    assert cut.cuts == ()
    assert cut.velocities == pytest.approx([3 * UM], rel=1e-3)


def test_a_small_change_of_velocity_is_reported_as_doubtful(sliding_trace) -> None:
    time, slip, friction, _ = stepped((3 * UM, 4 * UM), (300 * UM, 300 * UM), (50, 50))
    measurement = measure_sliding(sliding_trace(time, friction, slip))
    check = next(c for c in measurement.checks if c.name == "segments")
    assert check.verdict == "suspicious"
    assert "may be no step" in check.sentence


def test_times_of_the_user_are_taken_as_they_are(sliding_trace) -> None:
    time, slip, friction, (truth,) = stepped((3 * UM, 10 * UM), (200 * UM, 300 * UM), (50, 50))
    trace = sliding_trace(time, friction, slip)
    measurement = measure_sliding(trace, steps=[truth - 0.2])
    assert measurement.steps[0].time == truth - 0.2
    assert measurement.chosen_by == "user"
    without_slip = measure_sliding(sliding_trace(time, friction), steps=[truth])
    assert np.isnan(without_slip.steps[0].rate_dependence)
    assert np.isfinite(without_slip.steps[0].change)
    # Velocities of the user replace those of the displacement, and are compared with them.
    options = {"steps": [truth], "velocities": [3 * UM, 10 * UM]}
    expected = measure_sliding(trace, steps=[truth]).steps[0]
    for recording in (sliding_trace(time, friction), trace):
        step = measure_sliding(recording, **options).steps[0]
        assert step.rate_dependence == pytest.approx(expected.rate_dependence, rel=0.02)
        assert step.slope_after == pytest.approx(expected.slope_after, rel=0.02)
    contradicted = measure_sliding(trace, steps=[truth], velocities=[3 * UM, 20 * UM])
    assert "the recorded displacement has 1" in next(
        c.sentence
        for c in contradicted.checks
        if c.name == "segments" and c.verdict == "suspicious"
    )
    for steps in ([-5.0], [1e6]):
        with pytest.raises(InputError, match="steps must lie inside the recording"):
            measure_sliding(trace, steps=steps)
    with pytest.raises(InputError, match="at least 4 samples between"):
        measure_sliding(trace, steps=[20.0, 20.01])
    with pytest.raises(InputError, match="must end after it begins"):
        measure_sliding(trace, holds=[(30.0, 20.0)])


def test_the_noise_of_a_displacement_is_estimated() -> None:
    rng = np.random.default_rng(0)
    time = np.concatenate([np.arange(0, 50, 0.1), np.arange(50, 60, 0.01)])
    clean = np.interp(time, [0, 50, 60], [0, 150 * UM, 250 * UM])
    noisy = clean + 1e-7 * rng.standard_normal(time.size)
    assert displacement_noise(time, noisy) == pytest.approx(1e-7, rel=0.1)
    # A recorder's step of 1 um has the standard deviation 1/sqrt(12) um.
    coarse = np.round(clean, 6)
    assert displacement_noise(time, coarse) == pytest.approx(1e-6 / np.sqrt(12), rel=1e-6)


def white(rng, size, rate):
    return rng.standard_normal(size)


def gauge(rng, size, rate):
    """Correlated over 5 to 200 ms, as behind a filter."""
    keep = np.exp(-1 / (rate * 10 ** rng.uniform(-2.3, -0.7)))
    filtered = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(size + 4000))
    return filtered[4000:] + 0.3 * rng.standard_normal(size)


def hum(rng, size, rate):
    wave = np.sin(2 * np.pi * rng.uniform(5, 60) * np.arange(size) / rate)
    return wave + 0.3 * rng.standard_normal(size)


def wanders(rng, size, rate):
    """A few standard deviations within a minute."""
    return 0.5 * np.cumsum(rng.standard_normal(size)) / np.sqrt(rate) + rng.standard_normal(size)


@pytest.mark.parametrize("kind", [white, gauge, hum, wanders])
@pytest.mark.parametrize("seed", population(8))
def test_each_stop_is_one_hold_in_noise_of_any_kind(sliding_trace, kind, seed) -> None:
    """Random velocities with stops of seconds between; noise of 5 nm to 0.5 um."""
    rng = np.random.default_rng(seed)
    rate, noise = 300.0, 10 ** rng.uniform(-8.3, -6.3)
    # A stop is visible if it moves by 60 standard deviations less than its surroundings.
    fast = max(60 * noise / 2, 1e-6) * 10 ** rng.uniform(0, 1.5)
    factor = 10 ** (rng.choice([-1, 1]) * rng.uniform(0.3, 0.9))
    velocities = (fast, 0.0, fast, max(fast * factor, 60 * noise / 5), 0.0, fast)
    spans = [rng.uniform(2, 8) if v == 0 else rng.uniform(5, 15) for v in velocities]
    lengths = [v * s if v else s for v, s in zip(velocities, spans, strict=True)]
    time, slip, friction, truth = stepped(velocities, lengths, (rate,) * 6, resolution=0, seed=seed)
    slip = slip + noise * kind(rng, time.size, rate)
    measurement = measure_sliding(sliding_trace(time, friction, slip))
    assert [s.hold for s in measurement.segments] == [v == 0 for v in velocities]
    assert [s.start for s in measurement.segments[1:]] == pytest.approx(truth.tolist(), abs=0.5)
    for segment, velocity, span in zip(measurement.segments, velocities, spans, strict=True):
        assert segment.velocity == pytest.approx(velocity, abs=6 * noise / span + 0.01 * velocity)
    (step,) = measurement.steps
    assert step.velocity_before * step.velocity_after > 0
    assert len(measurement.holds) == 2


@pytest.mark.parametrize(
    ("displacement", "sentence"),
    [
        (lambda time: 1e-8 * time**2, "changes by 2e+02 % within a segment"),
        (lambda time: 0 * time, "nothing slides"),
        (lambda time: 1e-5 * (time > 10), "nothing slides"),
    ],
)
def test_a_single_segment_without_even_sliding_is_doubted(displacement, sentence):
    time = np.arange(20_000) / 1000
    cut = partition(time, displacement(time))
    assert cut.cuts == ()
    (doubt,) = cut.doubts
    assert sentence in doubt
