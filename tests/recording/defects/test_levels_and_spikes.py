"""Saturation, coarse rounding, spikes, rows to avoid, and stretches of one sampling rate."""

import numpy as np
import pytest

from asperity.recording.defects.check import rows_to_avoid, usable_rows
from asperity.recording.defects.resolution import coarsely_rounded, recorder_step
from asperity.recording.defects.sampling import rate_stretches
from asperity.recording.defects.saturation import saturated
from asperity.recording.defects.spikes import away_from_changes, spikes, without


def test_saturation_is_found_on_its_side():
    random = np.random.default_rng(0)
    values = np.sin(np.arange(3000) / 100) + 0.01 * random.normal(size=3000)
    assert saturated(values) == []
    (top,) = saturated(np.minimum(values, 0.9))
    assert (top.side, top.value, top.usual) == ("largest", 0.9, 1)
    np.testing.assert_array_equal(top.rows, np.flatnonzero(values >= 0.9))
    sides = [level.side for level in saturated(np.clip(values, -0.8, 0.9))]
    assert sides == ["largest", "smallest"]
    # Three equal samples in a row are no coincidence where no others are equal.
    values[[500, 501, 502]] = 2.0
    assert [level.rows.tolist() for level in saturated(values)] == [[500, 501, 502]]
    values[501] = 1.9
    assert saturated(values) == []


@pytest.mark.parametrize("step", [0.01, 0.1])
def test_a_quantised_sine_is_saturated_only_if_it_is_cut_off(step):
    values = np.round(np.sin(np.arange(5000) / 150) / step) * step
    assert saturated(values) == []
    assert len(saturated(np.minimum(values, 0.5))) == 1


@pytest.mark.parametrize("samples", [5, 8, 12, 31])
@pytest.mark.parametrize("noise", [1e-4, 0.01])
def test_a_narrow_peak_that_is_cut_off_is_saturated(samples, noise):
    """One sample of each period is cut off, so that no two of them are neighbours."""
    random = np.random.default_rng(samples)
    phase = 2 * np.pi * np.arange(100 * samples) / samples
    values = np.cos(phase) + noise * random.normal(size=phase.size)
    assert saturated(values) == []
    level = min((1 + np.cos(2 * np.pi / samples)) / 2, 1 - 5 * noise)
    (top,) = saturated(np.minimum(values, level))
    assert set(range(0, phase.size, samples)) <= set(top.rows)


@pytest.mark.parametrize("step", [0.0, 1e-4, 2e-3])
@pytest.mark.parametrize("samples", [16, 25, 40])
def test_equal_samples_in_a_row_are_saturated_without_noise(samples, step):
    """All periods are equal, so that every level is as frequent as the extreme."""
    phase = 2 * np.pi * (np.arange(60 * samples) % samples) / samples
    values = np.cos(phase) + 0.2 * np.cos(2 * phase)
    clipped = np.minimum(values, 0.75)
    if step:
        values, clipped = (step * np.round(x / step) for x in (values, clipped))
    assert saturated(values) == []
    (top,) = saturated(clipped)
    np.testing.assert_array_equal(top.rows, np.flatnonzero(clipped == clipped.max()))


def test_equal_maxima_of_periods_are_not_saturated_without_noise():
    """cos is 1 exactly at each maximum, and differs in its last digits elsewhere."""
    values = np.cos(2 * np.pi * np.arange(8000) / 8)
    assert np.count_nonzero(values == 1) > 100
    assert np.unique(values).size > 100
    assert saturated(values) == []


def test_spikes_of_one_value_are_not_saturated_and_hide_no_saturation():
    random = np.random.default_rng(5)
    values = np.sin(np.arange(4000) / 3) + 0.01 * random.normal(size=4000)
    clipped = np.minimum(values, 0.8)
    at = np.arange(100, 4000, 390)
    values[at] = clipped[at] = 12.0
    np.testing.assert_array_equal(spikes(values), at)
    assert saturated(values, spikes=at) == []
    (top,) = saturated(clipped, spikes=at)
    np.testing.assert_array_equal(top.rows, np.flatnonzero(clipped == 0.8))


def test_rounding_is_coarse_where_the_noise_is_finer():
    random = np.random.default_rng(1)
    values = np.cumsum(0.002 * random.normal(size=2000))
    share, step = coarsely_rounded(np.round(values, 2))
    assert share > 0.5
    assert step == pytest.approx(0.01)
    assert coarsely_rounded(np.round(values, 4)) is None
    assert coarsely_rounded(np.repeat(values, 3)) is None


def test_spikes_are_replaced_by_the_line_between_their_neighbours():
    random = np.random.default_rng(2)
    values = np.linspace(0, 1, 4000) + 0.01 * random.normal(size=4000)
    spoiled = values.copy()
    spoiled[[100, 2000, 2001, 3990]] += [1.0, 0.5, 0.5, -0.7]
    rows = spikes(spoiled)
    assert rows.tolist() == [100, 2000, 2001, 3990]
    repaired = without(spoiled, rows)
    np.testing.assert_array_equal(np.delete(repaired, rows), np.delete(values, rows))
    assert repaired[100] == pytest.approx((values[99] + values[101]) / 2)
    assert repaired[2000] == pytest.approx(values[1999] + (values[2002] - values[1999]) / 3)


def test_a_peak_at_a_change_is_a_spike_if_it_is_beyond_all_others():
    random = np.random.default_rng(3)
    values = 0.01 * random.normal(size=2000)
    changes = [500, 1200]
    values[[501, 1201]] += [1.0, 0.8]
    rows = spikes(values)
    assert rows.tolist() == [501, 1201]
    assert away_from_changes(values, rows, []).tolist() == [501, 1201]
    assert away_from_changes(values, rows, changes).tolist() == []
    values[501] += 2.0
    assert away_from_changes(values, rows, changes).tolist() == [501]


def test_unusable_rows_are_left_out_and_rows_next_to_defects_avoided():
    time = np.arange(1000) / 100.0
    values = np.sin(time) + 1e-3 * np.random.default_rng(4).normal(size=1000)
    time[400:] += 0.5
    time[700] = time[699]
    values[[100, 101]] = np.nan
    use = usable_rows(time, [values])
    assert np.flatnonzero(~use).tolist() == [100, 101, 700]
    values[300] += 1.0
    avoided = rows_to_avoid(time[use], [values[use]], use)
    # Rows are counted without those left out: after a loss, the spike, the gap, after a loss.
    assert avoided.tolist() == [100, 298, 398, 698]


def test_stretches_of_one_sampling_rate_are_separated():
    steps = np.concatenate([np.full(500, 0.1), np.full(300, 0.01), np.full(200, 0.1)])
    steps[250] = 3.0
    time = np.concatenate([[0.0], np.cumsum(steps)])
    assert rate_stretches(time) == ((0, 500), (500, 800), (800, 1001))


@pytest.mark.parametrize("slow", [0.02, 0.3])
def test_the_step_of_a_recorder_is_read_from_slow_samples(slow) -> None:
    """Most samples may be many steps apart; a fine recorder has no step."""
    rng = np.random.default_rng(0)
    moved = np.cumsum(np.repeat([slow, 20.0], [9000, 1000]) * rng.uniform(0.9, 1.1, 10_000))
    assert recorder_step(0.37 * np.round(moved)) == pytest.approx(0.37, rel=1e-9)
    assert recorder_step(moved + rng.standard_normal(moved.size)) == 0.0
    assert recorder_step(np.ones(40)) == 0.0


def test_a_signal_that_begins_at_its_extreme_for_long():
    """Levels other than the extreme occur late only."""
    phase = 2 * np.pi * (np.arange(4000) % 40) / 40
    values = np.concatenate([np.full(20_000, 0.75), np.minimum(np.cos(phase), 0.75)])
    (top,) = saturated(values)
    np.testing.assert_array_equal(top.rows, np.flatnonzero(values == 0.75))
