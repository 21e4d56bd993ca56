"""Recordings without modulation: segments, levels, steps and holds with known truth."""

from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.recording import Channel, Trace
from references.populations import draws

measure_sliding = partial(asp.measure, modulated=False)

STRESS = 20e6


def velocity_step(*, seed=0, noise=5e-4, direct=0.01, change=-0.004, decay=1.5):
    """Time, slip and friction of a step from 3 to 10 um/s at 60 s; sampling is faster from 50 s."""
    rng = np.random.default_rng(seed)
    time = np.concatenate([np.arange(0, 50, 0.1), np.arange(50, 110, 0.02)])
    after = np.clip(time - 60, 0, None)
    slip = 3e-6 * np.minimum(time, 60) + 10e-6 * after
    stepped = change + (direct - change) * np.exp(-after / decay)
    friction = 0.6 + np.where(time >= 60, stepped, 0.0)
    return time, slip, friction + noise * rng.standard_normal(time.size)


def recorded(time, **channels):
    kinds = {
        "friction": (None, "dimensionless"),
        "slip": ("m", "length"),
        "velocity": ("m/s", "velocity"),
        "normal stress": ("Pa", "pressure"),
        "shear stress": ("Pa", "pressure"),
    }
    by_name = {}
    for name, values in channels.items():
        unit, kind = kinds[name.replace("_", " ")]
        by_name[name.replace("_", " ")] = Channel(values, kind, unit or "", name, unit or "")
    return Trace(time, by_name)


def assert_step_is_read(measurement) -> None:
    assert len(measurement.segments) == 2
    before, after = measurement.segments
    assert after.start == pytest.approx(60, abs=0.1)
    assert (before.velocity, after.velocity) == pytest.approx((3e-6, 10e-6), rel=1e-2)
    assert before.steady.value == pytest.approx(0.6, abs=1e-4)
    assert after.steady.value == pytest.approx(0.596, abs=1e-4)
    assert after.steady.start > 63
    (step,) = measurement.steps
    assert abs(step.change + 0.004) < 5 * step.uncertainty
    assert step.rate_dependence == pytest.approx(-0.004 / np.log(10 / 3), abs=2e-4)
    assert step.peak == pytest.approx(0.01, abs=2e-3)


@pytest.mark.parametrize("motion", ["slip", "velocity"])
def test_a_velocity_step_is_read_from_displacement_or_velocity(motion) -> None:
    time, slip, friction = velocity_step()
    velocity = np.where(time < 60, 3e-6, 10e-6)
    values = slip if motion == "slip" else velocity
    noise = 1 + 1e-3 * np.random.default_rng(1).standard_normal(time.size)
    trace = recorded(time, friction=friction, **{motion: values * noise**0.1})
    measurement = measure_sliding(trace)
    assert_step_is_read(measurement)
    assert measurement.velocity_from == motion
    assert measurement.rates[0][0] == pytest.approx(50)
    assert measurement.rates[1][0] == pytest.approx(10)
    assert measurement.load is None


def test_friction_is_the_ratio_of_force_and_load() -> None:
    time, slip, friction = velocity_step()
    load = STRESS * (1 + 1e-4 * np.random.default_rng(3).standard_normal(time.size))
    measurement = measure_sliding(
        recorded(time, slip=slip, normal_stress=load, shear_stress=friction * load)
    )
    assert_step_is_read(measurement)
    assert measurement.load.value == pytest.approx(STRESS, rel=1e-4)
    assert measurement.load_unit == "Pa"
    exchanged = measure_sliding(
        recorded(time, slip=slip, normal_stress=friction * load, shear_stress=load)
    )
    assert "are their columns exchanged?" in exchanged.checks[1].sentence
    small = measure_sliding(
        recorded(time, slip=slip, normal_stress=1e-3 * load, shear_stress=friction * load)
    )
    assert (small.checks[0].name, small.checks[0].verdict) == ("friction", "bad")
    assert measurement.verdict == "ok"


def test_steps_up_and_down_are_read() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(12_000) * 0.01
    velocity = 1e-6 * np.select([time < 30, time < 55, time < 90], [1.0, 10.0, 3.0], 1.0)
    slip = np.cumsum(velocity) * 0.01
    friction = 0.6 + 0.01 * np.log(velocity / 1e-6) + 1e-4 * rng.standard_normal(time.size)
    measurement = measure_sliding(recorded(time, friction=friction, slip=slip))
    assert [s.start for s in measurement.segments] == pytest.approx([0, 30, 55, 90], abs=0.1)
    for step in measurement.steps:
        assert step.rate_dependence == pytest.approx(0.01, abs=3e-4)
    # The extreme of a downward step lies below.
    assert measurement.steps[1].peak < 0


def test_a_recording_without_motion_is_one_segment() -> None:
    time, _, friction = velocity_step(direct=0.0, change=0.0)
    measurement = measure_sliding(recorded(time, friction=friction))
    assert len(measurement.segments) == 1
    assert np.isnan(measurement.segments[0].velocity)
    assert measurement.steps == ()
    assert abs(measurement.friction.value - 0.6) < 5 * measurement.friction.uncertainty


def test_an_unsteady_load_and_a_drift_are_bad() -> None:
    time, slip, friction = velocity_step()
    load = STRESS * (1 + 0.05 * np.sin(2 * np.pi * 0.3 * time))

    def verdict(name, **channels):
        measurement = measure_sliding(recorded(time, slip=slip, **channels))
        return next(check.verdict for check in measurement.checks if check.name == name)

    assert verdict("load", normal_stress=load, shear_stress=friction * STRESS) == "bad"
    assert verdict("drift", friction=friction + 5e-3 * time) == "bad"


def test_only_the_window_of_the_user_is_read() -> None:
    time, slip, friction = velocity_step()
    measurement = measure_sliding(recorded(time, friction=friction, slip=slip), window=(5.0, 55.0))
    assert len(measurement.segments) == 1
    assert measurement.friction.end == pytest.approx(55, abs=0.03)


@pytest.mark.parametrize(
    ("channels", "options", "message"),
    [
        ({"slip": 1}, {}, "name a channel"),
        ({"shear_stress": 1}, {}, "name a channel"),
        ({"friction": 1}, {"window": (9, 3)}, "must end after it begins"),
        ({"friction": 1}, {"window": (3.0, 3.5)}, "at least 32 usable samples"),
        ({"friction": 1}, {"load": "gauge"}, "name a channel"),
        ({"shear_stress": 1, "slip": 1}, {"load": "slip"}, "dimension of the load"),
    ],
)
def test_bad_input_is_refused(channels, options, message) -> None:
    time, _, friction = velocity_step()
    trace = recorded(time, **dict.fromkeys(channels, friction))
    with pytest.raises(InputError, match=message):
        measure_sliding(trace, **options)


def test_samples_with_an_infinite_load_are_left_out() -> None:
    """Samples with an infinite load are left out: their ratio F/W would be 0."""
    draw = np.random.default_rng(0)
    time = np.arange(2000) / 100
    load = np.full(time.size, STRESS)
    shear = 0.6 * load * (1 + 1e-3 * draw.standard_normal(time.size))
    lost = draw.random(time.size) < draw.uniform(0.05, 0.6)
    load[lost] = draw.choice([np.inf, -np.inf, np.nan], lost.sum())
    measurement = measure_sliding(recorded(time, normal_stress=load, shear_stress=shear))
    assert measurement.time.size == time.size - lost.sum()
    assert abs(measurement.friction.value - 0.6) < 5 * 6e-4 / np.sqrt(measurement.time.size)
    assert measurement.load.value == pytest.approx(STRESS)
    no_load = recorded(time, normal_stress=np.full(time.size, np.inf), shear_stress=shear)
    with pytest.raises(InputError, match="usable samples, got 0"):
        measure_sliding(no_load)


def test_friction_is_measured_where_every_load_is_missing() -> None:
    time, slip, friction = velocity_step()
    nothing = np.full(time.size, np.nan)
    trace = recorded(time, friction=friction, slip=slip, normal_stress=nothing)
    measurement = measure_sliding(trace)
    assert measurement.load is None
    assert_step_is_read(measurement)


V, HOLDS, STIFFNESS = 10e-6, (3.0, 30.0, 300.0), 4e3


@pytest.fixture(scope="module")
def held(pulled):
    """Time, displacement, friction without and with noise, and the bounds."""
    velocities, lengths, rates = [V], [400e-6], [100]
    for hold in HOLDS:
        velocities += [0.0, V]
        lengths += [hold, 400e-6]
        rates += [100 if hold < 100 else 5, 100]
    return pulled(velocities, lengths, rates, noise=2e-4, slope=3.0, k=STIFFNESS, resolution=2e-8)


def true_readings(held):
    """Healing and relaxation of each hold without noise."""
    time, _, clean, _, bounds = held
    readings = []
    for k in range(len(HOLDS)):
        start, end, stop = bounds[2 * k + 1 : 2 * k + 4]
        level = clean[time < start][-1]
        readings.append(
            (clean[(time > end) & (time < stop)].max() - level, level - clean[time < end][-1])
        )
    return np.array(readings)


def test_holds_are_found_and_read(held, sliding_trace) -> None:
    time, slip, _, friction, _ = held
    measurement = measure_sliding(sliding_trace(time, friction, slip))
    assert [h.hold_time for h in measurement.holds] == pytest.approx(HOLDS, abs=0.02)
    assert measurement.steps == ()
    for hold, (healing, relaxation) in zip(measurement.holds, true_readings(held), strict=True):
        assert abs(hold.healing - healing) < 4 * hold.healing_uncertainty + 2e-4
        assert abs(hold.relaxation - relaxation) < 4 * hold.relaxation_uncertainty + 2e-4
        assert 0 < hold.healing_uncertainty < 2e-3
        # The first half of the rise is elastic, apart from creep of the contact.
        assert hold.reload_slope == pytest.approx(STIFFNESS, rel=0.1)
        assert hold.velocity == pytest.approx(V, rel=1e-2)
    true_slope = np.polyfit(np.log10(HOLDS), true_readings(held)[:, 0], 1)[0]
    assert measurement.healing.holds == 3
    assert abs(measurement.healing.per_decade - true_slope) < measurement.healing.interval_95
    assert measurement.healing.per_decade == pytest.approx(true_slope, rel=0.1)
    assert [s.velocity for s in measurement.segments if s.hold] == [0.0, 0.0, 0.0]


def test_holds_of_the_user_need_no_displacement(held, sliding_trace) -> None:
    time, _, _, friction, bounds = held
    listed = [(bounds[k], bounds[k + 1]) for k in (1, 3, 5)]
    measurement = measure_sliding(sliding_trace(time, friction), holds=listed)
    assert [h.hold_time for h in measurement.holds] == pytest.approx(HOLDS)
    assert measurement.chosen_by == "user"
    for hold, (healing, _) in zip(measurement.holds, true_readings(held), strict=True):
        assert abs(hold.healing - healing) < 4 * hold.healing_uncertainty + 2e-4
        assert np.isnan(hold.reload_slope)


def faulty(friction, fault, seed):
    rng = np.random.default_rng(seed)
    if fault == "spikes":
        friction = friction.copy()
        friction[rng.integers(0, friction.size, 12)] += 0.2
    if fault == "coarse":
        friction = 2e-3 * np.round(friction / 2e-3)
    if fault == "line":
        friction = friction + 1e-3 * np.sin(0.3 * np.arange(friction.size) + rng.uniform(0, 6))
    return friction


@draws(2, 3)
@pytest.mark.parametrize("fault", ["spikes", "coarse", "line"])
def test_intervals_of_holds_cover_faults_of_the_recorder(
    pulled, sliding_trace, fault, draws
) -> None:
    scores = []
    for seed in range(draws):
        time, slip, clean, friction, bounds = pulled(
            (V, 0.0, V, 0.0, V), (400e-6, 20.0 + seed, 400e-6, 200.0, 400e-6), (50,) * 5,
            noise=1e-4, seed=seed, resolution=2e-8,
        )  # fmt: skip
        measurement = measure_sliding(sliding_trace(time, faulty(friction, fault, seed), slip))
        for hold, start, end in zip(measurement.holds, bounds[1:-1:2], bounds[2::2], strict=True):
            level, rested = clean[time < start][-1], clean[time < end][-1]
            peak = clean[(time > end) & (time < end + 30)].max()
            scores.append((hold.healing - (peak - level)) / hold.interval_95)
            scores.append((hold.relaxation - (level - rested)) / 2 / hold.relaxation_uncertainty)
            assert hold.interval_95 < 0.006
    assert np.abs(scores).max() < 1.5


def test_the_relaxation_is_read_at_the_end_of_a_hold(pulled, sliding_trace) -> None:
    """Friction still falls during the samples that are averaged."""
    time, slip, clean, friction, bounds = pulled(
        (V, 0.0, V), (400e-6, 20.0, 400e-6), (200,) * 3, noise=1e-6, resolution=1e-9
    )
    (hold,) = measure_sliding(sliding_trace(time, friction, slip)).holds
    relaxation = clean[time < bounds[1]][-1] - clean[time < bounds[2]][-1]
    # The mean of the last fiftieth of the hold is higher by 1e-5.
    assert hold.relaxation == pytest.approx(relaxation, abs=3e-6)


@pytest.mark.parametrize(
    ("hold", "off", "least", "most"), [(1.0, 0.2, 0.1, 0.5), (3e3, 0.05, 0, 0.1)]
)
def test_the_uncertainty_of_the_reload_slope_includes_slip_on_the_rise(
    pulled, sliding_trace, hold, off, least, most
) -> None:
    """After a short hold the contact slips on the whole rise: its slope is not the stiffness."""
    time, slip, _, friction, _ = pulled(
        (V, 0.0, V), (400e-6, hold, 400e-6), (500, 500 if hold < 10 else 1, 500),
        noise=1e-5, resolution=1e-9, k=STIFFNESS,
    )  # fmt: skip
    (reading,) = measure_sliding(sliding_trace(time, friction, slip)).holds
    error = reading.reload_slope / STIFFNESS - 1
    assert (error < -off) == (hold < 10)
    assert abs(error) * STIFFNESS < 2 * reading.reload_uncertainty
    assert least < reading.reload_uncertainty / STIFFNESS < most


@draws(2, 3)
@pytest.mark.parametrize("noise", [1e-3, 1e-4, 1e-5])
def test_the_top_of_a_peak_is_no_parabola(pulled, sliding_trace, noise, draws) -> None:
    """Friction rises faster than it falls: a parabola through the top is 8e-5 too low."""
    for seed in range(draws):
        time, slip, clean, friction, bounds = pulled(
            (V, 0.0, V), (400e-6, 100.0, 400e-6), (100,) * 3, noise=noise, seed=seed
        )
        (hold,) = measure_sliding(sliding_trace(time, friction, slip)).holds
        healing = clean[time > bounds[2]].max() - clean[time < bounds[1]][-1]
        assert abs(hold.healing - healing) < hold.interval_95 < 7e-5 + 0.6 * noise


def test_a_peak_hidden_in_noise_lies_within_its_interval(pulled, sliding_trace) -> None:
    time, slip, clean, friction, bounds = pulled(
        (V, 0.0, V), (8e-3, 3.0, 8e-3), (10,) * 3, noise=8e-3, resolution=2e-8
    )
    (hold,) = measure_sliding(sliding_trace(time, friction, slip)).holds
    healing = clean[time > bounds[2]].max() - clean[time < bounds[1]][-1]
    assert abs(hold.healing - healing) < hold.interval_95 < 0.03


def test_a_gap_that_may_hide_the_peak_is_named(pulled, sliding_trace) -> None:
    time, slip, _, friction, bounds = pulled(
        (V, 0.0, V), (400e-6, 20.0, 400e-6), (100,) * 3, noise=1e-4, resolution=2e-8
    )
    for first, verdict in ((0.2, "suspicious"), (15.0, "ok")):
        kept = (time < bounds[2] + first) | (time > bounds[2] + first + 3)
        measurement = measure_sliding(sliding_trace(time[kept], friction[kept], slip[kept]))
        check = next(c for c in measurement.checks if c.name == "segments")
        assert check.verdict == verdict
        assert ("may lie in a gap of 3" in check.sentence) == (verdict != "ok")


def test_the_loading_before_the_first_hold_is_left_out(pulled, sliding_trace) -> None:
    time, slip, clean, friction, bounds = pulled(
        (V, 0.0, V), (400e-6, 20.0, 400e-6), (100,) * 3, noise=1e-4, resolution=2e-8
    )
    loading = np.arange(0, 15, 0.01)
    trace = sliding_trace(
        np.concatenate([loading, time + 15]),
        np.concatenate([clean[0] * loading / 15, friction]),
        np.concatenate([V * loading, slip + 15 * V]),
    )
    (hold,) = measure_sliding(trace).holds
    healing = clean[time > bounds[2]].max() - clean[time < bounds[1]][-1]
    assert abs(hold.healing - healing) < hold.interval_95 < 2e-3


@draws(4, 20)
def test_noise_alone_makes_no_healing(sliding_trace, draws) -> None:
    """The largest of many noisy samples is not taken for the peak."""
    heals = []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        time = np.arange(0, 90, 0.01)
        slip = np.interp(time, [0, 40, 50, 90], [0, 400e-6, 400e-6, 800e-6])
        friction = 0.6 + 1e-3 * rng.standard_normal(time.size)
        (hold,) = measure_sliding(sliding_trace(time, friction, slip)).holds
        heals.append(hold.healing)
    # The largest of 2000 samples lies 3.4 standard deviations above the mean.
    assert np.mean(heals) < 1e-3


@pytest.mark.parametrize("turns", [False, True])
def test_a_hold_of_the_opposite_direction_has_the_healing_of_the_forward_one(turns) -> None:
    """Sliding forward and, for less than half of the time, backward, with holds of 10 s."""
    time = np.arange(0, 320, 0.02)
    holds = {40: 1, 220: -1, **({110: 1} if turns else {})}
    resting = np.any([(time >= start) & (time < start + 10) for start in holds], axis=0)
    direction = np.where(time < (120 if turns else 150), 1.0, -1.0)
    friction = np.full(time.size, 0.6)
    for start in holds:
        since = time - start
        relaxed = 0.005 * np.log1p(np.clip(since, 0, 10) / 0.1)
        rise = np.clip((since - 10) / 0.5, 0, 1)
        peak = 0.01 * rise * np.exp(-np.clip(since - 10.5, 0, None) / 2)
        friction += np.where(since > 0, peak - relaxed * (1 - rise), 0.0)
    rng = np.random.default_rng(4)
    slip = np.cumsum(np.where(resting, 0.0, direction) * 1e-5 * 0.02)
    noisy = direction * friction + 1e-4 * rng.standard_normal(time.size)
    measurement = measure_sliding(recorded(time, friction=noisy, slip=slip))
    forward, backward = measurement.holds
    for hold in (forward, backward):
        assert hold.level == pytest.approx(0.6, abs=1e-3)
        assert hold.relaxation == pytest.approx(0.005 * np.log(101), rel=0.03)
        assert hold.healing == pytest.approx(0.01, rel=0.1)
    (cut,) = (check for check in measurement.checks if check.name == "segments")
    assert ("the slider turns" in cut.sentence) == turns


def test_between_equal_velocities_there_is_no_rate_dependence() -> None:
    time, _, friction = velocity_step()
    (step,) = measure_sliding(
        recorded(time, friction=friction), steps=[60], velocities=["10 um/s", "10 um/s"]
    ).steps
    assert np.isfinite(step.change)
    assert np.isnan([step.rate_dependence, step.rate_uncertainty, step.peak]).all()


def test_the_mean_load_has_the_time_at_which_it_is_recorded() -> None:
    time, slip, friction = velocity_step()
    load = np.where(time < 60, np.nan, STRESS)
    level = measure_sliding(recorded(time, friction=friction, slip=slip, normal_stress=load)).load
    assert (level.value, level.start, level.end) == pytest.approx((STRESS, 60, time[-1]))


def test_a_hold_that_the_user_leaves_out_is_named() -> None:
    """Its peak is the highest friction of the sliding after the hold before it."""
    time = np.arange(0, 200, 0.02)
    friction, slip = np.full(time.size, 0.6), np.zeros(time.size)
    for start, length, peak in ((40, 10, 0.01), (90, 40, 0.02)):
        since = time - start
        slip -= 1e-5 * np.clip(since, 0, length)
        friction -= np.where((since > 0) & (since < length), 0.005 * np.log1p(abs(since) / 0.1), 0)
        after = since - length
        friction += np.where(after > 0, peak * np.exp(-np.clip(after, 0, None) / 2), 0)
    slip += 1e-5 * time
    rng = np.random.default_rng(5)
    trace = recorded(time, friction=friction + 1e-4 * rng.standard_normal(time.size), slip=slip)
    for holds, named in (([(40, 50)], True), ([(40, 50), (90, 130)], False)):
        measurement = measure_sliding(trace, holds=holds)
        (cut,) = (check for check in measurement.checks if check.name == "segments")
        assert ("the displacement stands still from 90 to 130 s" in cut.sentence) == named
        assert (cut.verdict == "suspicious") == named
    # Sliding that is given as a hold has no healing.
    for given in (
        {"holds": [(40, 50), (90, 130), (150, 180)]},
        {"steps": [40, 50, 90, 130, 150, 180], "velocities": [1e-5, 0, 1e-5, 0, 1e-5, 0, 1e-5]},
    ):
        (cut,) = (c for c in measure_sliding(trace, **given).checks if c.name == "segments")
        assert "the displacement moves at 1e-05 m/s in the hold from 150 s to 180 s" in cut.sentence
