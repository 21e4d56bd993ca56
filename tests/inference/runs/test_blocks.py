"""Long recordings as means over blocks, compared with fits to every sample."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.coverage import LOAD, TRUE, TRUTH, Case, friction, trace_of
from scipy.signal import lfilter, lsim

from asperity.errors import InputError
from asperity.inference import RunOptions, fit, recorded_run
from asperity.inference.runs.blocks import averaged, reduced
from asperity.inference.runs.cleaning import cleaned, with_wrong_samples
from asperity.inference.runs.term import RunTerm
from asperity.laws import get_law
from asperity.recording import Trace

#: Ten seconds at 2.4 kHz: D0/V is 65 ms after the step up, and the spring takes 23 ms.
CASE = Case((3e-5, 1e-4, 0.0), (2.5, 5.0), 10.0, 2400.0)
FREE = ["A", "B", "D0"]
NOISE = 3e-4


def traced(values):
    time = np.arange(values.size) / CASE.rate
    return trace_of(time, values, CASE.slip(time), np.full(values.size, LOAD))


def mains(time):
    """50 Hz, wandering by 0.04 Hz."""
    return 1e-3 * np.cos(2 * np.pi * 50 * time + 0.3 * np.sin(2 * np.pi * time / 8))


@pytest.fixture(scope="module")
def clean():
    return friction(CASE, np.arange(24_000) / CASE.rate)


@pytest.fixture(scope="module")
def ringing():
    """Noise of a gauge that rings at 200 Hz: an autoregression of order 2."""
    turn = 2 * 0.9 * np.cos(2 * np.pi * 200 / CASE.rate)
    x = lfilter([1.0], [1.0, -turn, 0.81], np.random.default_rng(0).normal(size=24_000))
    return NOISE * x / x.std()


def recorded(values):
    return recorded_run(traced(values), name="run", steps=CASE.changes, velocities=CASE.velocities)


@pytest.fixture(scope="module")
def by_blocks(clean, ringing):
    run = recorded(clean + ringing + mains(np.arange(24_000) / CASE.rate))
    return fit(run, "rice-ruina", FREE, start=TRUE, starts=1)


def test_only_long_recordings_are_averaged_over_blocks(clean, ringing):
    run = recorded(clean + ringing)
    short = replace(run, time=run.time[:20_000], friction=run.friction[:20_000])
    assert reduced(short) is short
    assert reduced(run, "full") is run
    assert reduced(run).blocks is not None


@pytest.mark.long
def test_intervals_by_blocks_agree_with_those_by_samples(by_blocks, clean, ringing):
    """The noise is an autoregression at the full rate, for which a fit to every sample is right."""
    (term,) = by_blocks.objective.terms
    assert term.run.blocks.recorded == 24_000
    assert term.run.time.size < 6_000
    # The line of the mains is subtracted.
    np.testing.assert_allclose(term.run.blocks.lines, [50.0], atol=0.1)
    full = fit(
        recorded(clean + ringing),
        "rice-ruina",
        FREE,
        start=TRUE,
        starts=1,
        runs=RunOptions(fit_rate="full"),
    )
    for name, truth in TRUE.items():
        blocked, sampled = by_blocks.parameters[name], full.parameters[name]
        assert abs(blocked.value - truth) < 4 * blocked.se
        # The two estimates differ by less than the noise.
        assert blocked.value == pytest.approx(sampled.value, abs=0.5 * sampled.se)
        assert blocked.se == pytest.approx(sampled.se, rel=0.15)


def test_the_averaging_is_described_in_one_sentence(clean, ringing):
    run = recorded(clean + ringing + mains(np.arange(24_000) / CASE.rate))
    sentence = RunTerm(cleaned(run), get_law("rice-ruina"), {}, RunOptions()).noise["averaged"]
    assert sentence.startswith("24000 samples are compared as ")
    assert "means over blocks of" in sentence
    assert "lines at 50" in sentence


@pytest.mark.long
def test_fits_to_long_blocks_with_steps_inside_them_are_exact(clean):
    run = recorded(clean + 1e-9 * np.sin(np.arange(24_000) ** 2))
    result = fit(run, "rice-ruina", FREE, start=TRUE, starts=1, runs=RunOptions(fit_rate="7 Hz"))
    (term,) = result.objective.terms
    # Blocks of 143 ms are longer than the transients.
    assert term.run.time.size < 72
    for name, truth in TRUE.items():
        assert result.values[name] == pytest.approx(truth, rel=1e-4)


def test_blocks_are_means_of_their_samples(clean):
    means = clean.reshape(-1, 60).mean(axis=1)
    np.testing.assert_allclose(reduced(recorded(clean), 40.0).friction, means, atol=1e-12)


def test_blocks_over_a_gap_are_left_out(clean):
    whole = traced(clean)
    kept = np.ones(24_000, bool)
    kept[6_000:6_500] = False
    channels = {n: replace(c, values=c.values[kept]) for n, c in whole.channels.items()}
    run = recorded_run(Trace(whole.time[kept], channels), steps=[2.5], velocities=[3e-5, 1e-4])
    short = averaged(run, 0.05)
    begin, end = short.blocks.edges.T
    missing = (begin < 6_499 / 2400) & (end > 6_001 / 2400)
    assert not missing.any()
    np.testing.assert_allclose(end - begin, 0.05, rtol=0.02)
    assert (begin[1:] >= end[:-1]).all()


def test_mains_are_subtracted_and_motion_is_kept(clean):
    time = np.arange(24_000) / CASE.rate
    with_mains, without = (reduced(recorded(clean + m), 500.0) for m in (mains(time), 0 * time))
    assert without.blocks.lines == ()
    difference = with_mains.friction - without.friction
    # The mains have an amplitude of 1e-3; their phase is taken as linear over 2 s.
    assert np.sqrt(np.mean(difference**2)) < 0.05 * 1e-3 / np.sqrt(2)
    assert np.abs(difference).max() < 1e-4


def test_spikes_are_left_out_of_the_means(clean, ringing):
    spoiled = clean + ringing
    spoiled[[3_000, 9_001, 20_202]] += [0.05, -0.1, 1.0]
    clean_run, run = (cleaned(recorded(x), 100.0) for x in (clean + ringing, spoiled))
    assert len(run.spikes) == 3
    np.testing.assert_allclose(run.friction, clean_run.friction, atol=3 * NOISE / 24)


def test_spikes_of_a_thousandth_of_the_samples_are_no_wrong_means(clean, ringing):
    """20 spikes of 24,000 samples, which are 2 in a hundred of the means."""
    spoiled = clean + ringing
    spoiled[600::1200] += 0.1
    run = cleaned(recorded(spoiled), 100.0)
    assert len(run.spikes) == 20
    assert with_wrong_samples(run, ()).doubts == run.doubts


def test_a_jump_of_the_gauge_is_at_the_beginning_of_a_mean(clean, ringing):
    """At 7.5 s, where a block begins: no mean has a part of it."""
    values = clean + ringing
    values[18_000:] += 2e-3
    run = cleaned(recorded(values), 100.0)
    assert run.jumps == pytest.approx((7.5,), abs=1 / CASE.rate)
    term = RunTerm(run, get_law("rice-ruina"), TRUTH | TRUE, RunOptions())
    assert term.update_noise({})
    assert term.wrong_samples({}) == ()


def test_a_wrong_mean_is_left_out_of_wider_blocks_too(clean, ringing):
    run = cleaned(recorded(clean + ringing), 100.0)
    k = int(np.searchsorted(run.time, CASE.changes[0])) + 2
    friction = run.friction.copy()
    friction[k] += 1e-3
    term = RunTerm(
        replace(run, friction=friction), get_law("rice-ruina"), TRUTH | TRUE, RunOptions()
    )
    assert term.update_noise({})
    assert term.wrong_samples({}) == (run.time[k],)
    wide = averaged(replace(run, wrong=(run.time[k],)), 0.04)
    (row,) = wide.rows_at(wide.wrong)
    assert wide.blocks.edges[row, 0] <= run.time[k] < wide.blocks.edges[row, 1]


def test_large_spikes_do_not_make_relaxing_friction_spikes(ringing):
    """Friction relaxes after each step; its samples are kept, however large the spikes are."""
    time = np.arange(24_000) / CASE.rate
    relaxing = [np.where(time > t, np.exp(-(time - t) / 0.1), 0.0) for t in CASE.changes]
    values = 0.6 + 0.02 * relaxing[0] - 0.02 * relaxing[1] + ringing
    spoiled = values.copy()
    spoiled[[3_000, 9_001, 20_202]] += [1.0, -1.0, 1.0]
    clean_run, run = (cleaned(recorded(x), 100.0) for x in (values, spoiled))
    assert clean_run.spikes == ()
    assert len(run.spikes) == 3
    np.testing.assert_allclose(run.friction, clean_run.friction, atol=3 * NOISE / 24)


@pytest.mark.parametrize("offset", [-3, 0, 2, 12])
@pytest.mark.parametrize("size", [0.02, -0.5])
def test_a_spike_next_to_a_step_is_left_out(clean, ringing, offset, size):
    values = clean + ringing
    spoiled = values.copy()
    spoiled[round(CASE.changes[0] * CASE.rate) + offset] += size
    clean_run, run = (cleaned(recorded(x), 100.0) for x in (values, spoiled))
    assert (len(clean_run.spikes), len(run.spikes)) == (0, 1)
    np.testing.assert_allclose(run.friction, clean_run.friction, atol=3 * NOISE / 24)


def test_peaks_of_one_sample_after_each_step_are_kept(clean, ringing):
    """Friction may rise and relax between two samples."""
    values = clean + ringing
    for change, size in zip(CASE.changes, (0.05, -0.04), strict=True):
        values[round(change * CASE.rate) + 1] += size
    assert cleaned(recorded(values), 100.0).spikes == ()


@pytest.mark.parametrize("rate", [0.0, "-3 Hz", "fast", "3 N"])
def test_a_bad_fit_rate_is_refused(rate):
    with pytest.raises(InputError, match="fit_rate must"):
        RunOptions(fit_rate=rate)


def test_too_low_a_fit_rate_is_refused(clean):
    with pytest.raises(InputError, match=r"fit_rate must leave 16 means or more of run, got 0.5"):
        reduced(recorded(clean), 0.5)


def test_a_gauge_filters_the_motion_before_it_is_averaged(clean):
    # A filter with a lag of 8 ms, by SciPy; the first samples are steady.
    corner = 2 * np.pi * 20.0
    time = np.arange(24_000) / CASE.rate
    filtered = clean[0] + lsim(([corner], [1.0, corner]), clean - clean[0], time)[1]
    run = reduced(recorded(filtered), 100.0)
    known = {name: TRUTH[name] for name in ("mu0", "V0")} | TRUE

    def largest(gauge):
        term = RunTerm(run, get_law("rice-ruina"), known, RunOptions(gauge=gauge))
        departures = term.departures({}, slopes=False)[0]
        return np.abs(departures - np.median(departures)).max()

    # All means agree with the filtered motion, and not with the motion itself.
    assert largest((1, 20.0)) < 0.02 * largest(None)
