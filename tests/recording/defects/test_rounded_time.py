"""Rounded time stamps are replaced by their even grid; those of an irregular clock are kept."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.inference.runs.run import recorded_run
from asperity.measurement.sliding.signals import sliding_signals
from asperity.recording import Channel, Trace, check, read
from asperity.recording.defects.sampling import even_times, rounded_grid

measure = partial(asp.measure, modulated=True)

SEEDS = range(6)


def single(rng, time, step):
    """Stamps in single precision, so late that the rounding matters."""
    quantum = step * rng.uniform(0.05, 6)
    late = time + np.exp2(np.floor(np.log2(quantum)) + 23) * rng.uniform(1, 1.9)
    return late, late.astype(np.float32).astype(float), 2 * quantum


def decimals(rng, time, step):
    """Stamps of few decimals, rounded or cut off."""
    quantum = 10.0 ** np.round(np.log10(step) + rng.uniform(-1.2, 1.2))
    multiples = np.round(time / quantum) if rng.random() < 0.5 else np.floor(time / quantum)
    return time, multiples * quantum, quantum


def grid(rng, gaps):
    """Times of even samples, between gaps of ten steps to a thousand."""
    size, step = int(rng.uniform(2000, 20_000)), 10 ** rng.uniform(-4, 0)
    time = rng.uniform(0, 100) * step + step * np.arange(size)
    for at in rng.choice(np.arange(200, size - 200), gaps):
        time[at:] += step * 10 ** rng.uniform(1, 3)
    return time, step


@pytest.mark.parametrize("gaps", [0, 2])
@pytest.mark.parametrize("rounded", [single, decimals])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_even_grid_of_rounded_stamps_is_recovered(seed, rounded, gaps) -> None:
    rng = np.random.default_rng([seed, gaps])
    changed = 0
    while changed < 30:
        # Where the step is nearly a multiple of the quantum, hardly a stamp is rounded.
        exact, step = grid(rng, gaps)
        time, stamps, quantum = rounded(rng, exact, step)
        steps = np.diff(stamps)
        changed = np.count_nonzero(np.abs(steps - np.median(steps)) > 1e-6 * step)
    even = even_times(stamps)
    steps = np.diff(even)
    usual = steps < 2 * step
    assert np.ptp(steps[usual]) < 1e-5 * step
    assert np.median(steps) == pytest.approx(step, rel=2 * quantum / step / time.size + 1e-9)
    # Stamps that are cut off have a mean error of half a quantum.
    assert np.abs(even - time).max() < quantum
    if not gaps:
        assert np.ptp(even - time) < 0.3 * quantum
    names = {f.name for f in check(Trace(stamps, {}))}
    assert "uneven sampling" not in names
    assert "repeated time" not in names


def jitter(rng, step, size):
    return step * np.arange(size) + rng.uniform(0.05, 0.3) * step * rng.standard_normal(size)


def walk(rng, step, size):
    return np.cumsum(step * (1 + rng.uniform(0.05, 0.3) * rng.standard_normal(size)))


def two_rates(rng, step, size):
    return np.cumsum(np.where(np.arange(size) < size * rng.uniform(0.2, 0.8), step, 1.4 * step))


def events(rng, step, size):
    return np.cumsum(rng.choice([0.8, 1.0, 1.3], size) * step)


@pytest.mark.parametrize("digits", [None, 0.01, 0.1])
@pytest.mark.parametrize("clock", [jitter, walk, two_rates, events])
@pytest.mark.parametrize("seed", SEEDS)
def test_stamps_of_an_irregular_clock_are_kept(seed, clock, digits) -> None:
    rng = np.random.default_rng(seed)
    step = 10 ** rng.uniform(-4, 0)
    time = np.sort(clock(rng, step, int(rng.uniform(500, 5000))))
    if digits:
        time = np.round(time / (digits * step)) * digits * step
    assert even_times(time) is time
    assert "rounded time" not in {f.name for f in check(Trace(time, {}))}


@pytest.mark.parametrize("seed", range(3))
def test_stamps_of_an_exact_clock_are_kept(seed) -> None:
    """Neither the binary error of a decimal nor a gap is taken for rounding."""
    rng = np.random.default_rng(seed)
    time = 3600 + np.arange(5000) / 1000
    assert even_times(time) is time
    time[rng.integers(500, 4500) :] += rng.integers(3, 900) / 1000
    assert even_times(time) is time
    assert [f.name for f in check(Trace(time, {}))] == ["gap"]


@pytest.mark.parametrize(("samples", "rate", "digits"), [(40, 400, 3), (5000, 1000.02, 5)])
def test_a_few_steps_of_two_quanta_or_more_are_enough(samples, rate, digits) -> None:
    """Lost samples make steps of whole samples, and a delay is no multiple of the other steps."""
    stamps = np.round(np.arange(samples) / rate, digits)
    assert [f.name for f in check(Trace(stamps, {}))] == ["rounded time"]
    assert np.ptp(np.diff(even_times(stamps))) < 1e-9
    stamps[samples // 2 :] += 0.4 / rate
    assert [f.name for f in check(Trace(stamps, {}))] == ["uneven sampling"]


@pytest.mark.parametrize("lost", [1, 5, 30, 100])
@pytest.mark.parametrize("seed", range(3))
def test_samples_lost_at_random_are_gaps(seed, lost) -> None:
    rng = np.random.default_rng(seed)
    time = np.delete(np.arange(9000) / 1000, rng.choice(np.arange(1, 8999), lost, replace=False))
    assert even_times(time) is time
    assert [f.name for f in check(Trace(time, {}))] == ["gap"]


CLOCKS = {
    "single precision after an hour": (1000, lambda t: (t + 3600).astype(np.float32)),
    "single precision after a day": (1000, lambda t: (t + 86_400).astype(np.float32)),
    "four digits at 3 kHz": (3000, lambda t: np.round(t, 4)),
    "two digits at 1 kHz": (1000, lambda t: np.round(t + 0.0031, 2)),
    "milliseconds, cut, at 1.3 kHz": (1300, lambda t: np.floor(1e3 * t) / 1e3),
}


@pytest.mark.parametrize("name", CLOCKS)
def test_amplitudes_are_right_in_spite_of_rounded_stamps(truth, trace, name) -> None:
    rate, stamped = CLOCKS[name]
    rng = np.random.default_rng(len(name))
    time = np.arange(20_000) / rate
    source = truth.but(frequency=120.0)
    load = source.load(time) + 2e-3 * rng.standard_normal(time.size)
    force = source.force(time) + 2e-3 * rng.standard_normal(time.size)
    measurement = measure(trace(stamped(time).astype(float), load, force))
    reading = measurement.reading
    assert abs(reading.epsilon - 0.24) < 4 * reading.uncertainty("epsilon")
    assert reading.uncertainty("epsilon") < 1e-5
    assert reading.phasor(1).amplitude == pytest.approx(2e-3, abs=5e-5)
    assert measurement.verdict == "ok"
    assert "rounded time" in {f.name for f in measurement.samples.findings} or rate == 3000


def test_measurement_and_inference_both_use_the_even_grid(tmp_path) -> None:
    time = np.arange(4000) / 400
    table = np.stack([np.round(time, 2), 1e6 * 1e-5 * time, 0.6 + 1e-3 * time], axis=1)
    path = tmp_path / "rounded.csv"
    head = "time (s),displacement (um),mu"
    np.savetxt(path, table, "%.4f", delimiter=",", header=head, comments="")
    trace = read(path)
    assert trace.sample_rate == pytest.approx(400, rel=1e-5)
    assert [f.name for f in trace.findings if "time" in f.name] == ["rounded time"]
    for read_times in (
        sliding_signals(trace, "W", "F", None).time,
        recorded_run(trace, steps=[5.0]).time,
    ):
        assert np.ptp(np.diff(read_times)) < 1e-9
        assert read_times.size == time.size


def test_a_trace_keeps_its_rounded_stamps_and_a_slice_reports_them() -> None:
    time = (3600 + np.arange(5000) / 1000).astype(np.float32).astype(float)
    trace = Trace(time, {"W": Channel(np.ones(time.size), "force", "N", "W", "N")})
    trace = replace(trace, findings=check(trace))
    assert np.array_equal(trace.time, time)
    names = [f.name for f in trace.slice(3601, 3603).findings]
    assert names == ["rounded time", "constant"]
    assert rounded_grid(trace.time[::7]).step == pytest.approx(7e-3, rel=1e-5)
