"""Checks of a modulated measurement: each names its defect with a number, and nothing else."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import j0, j1

import asperity as asp
from asperity.lock_in.demodulation import lock_in
from asperity.measurement.record import modulated_record
from asperity.recording import check
from references.planted_recordings import covered
from references.populations import draws

measure = partial(asp.measure, modulated=True)

RATE, END = 2000.0, 10.0


@pytest.fixture
def steady(truth):
    """Function that makes arrays time, load, force of ten steady seconds."""

    def make(seed=0, **changes):
        source = truth.but(**changes)
        rng = np.random.default_rng(seed)
        time = np.arange(int(RATE * END)) / RATE
        load = source.load(time) + 5e-3 * rng.standard_normal(time.size)
        return time, load, source.force(time) + 2e-3 * rng.standard_normal(time.size)

    return make


def swapped(time, load, force):
    return time, force, load


def flipped(time, load, force):
    return time, load, -force


def in_kilonewton(time, load, force):
    return time, 1e3 * load, force


def off_zero(time, load, force):
    return time, load - 6.0, force


def load_drifts(time, load, force):
    return time, load + 0.03 * time, force


def load_wanders(time, load, force):
    return time, load + 0.3 * np.sin(np.pi * time), force


def second_shaker(time, load, force):
    return time, load + 0.5 * np.cos(2 * np.pi * 143.7 * time), force


def phase_wanders(time, load, force):
    phi = 2 * np.pi * 60.013 * time + 0.7
    wandering = np.cos(phi + 0.5 * np.sin(2 * np.pi * 5.3 * time)) - np.cos(phi)
    return time, load + 7 * 0.24 * wandering, force


def response_changes(time, load, force):
    phi = 2 * np.pi * 60.013 * time + 0.7
    return time, load, force + 7e-3 * np.sin(2 * np.pi * 0.15 * time) * np.cos(phi - 1.5)


def hum_next_to_the_line(time, load, force):
    return time, load, force + 0.02 * np.cos(2 * np.pi * 60.27 * time)


def dropped_bits(time, load, force):
    load = load.copy()
    load[np.random.default_rng(1).integers(0, load.size, 20)] = 0.0
    return time, load, force


def sparks(time, load, force):
    force = force.copy()
    for at in np.random.default_rng(2).integers(0, force.size - 2, 20):
        force[at : at + 2] += 1.0
    return time, load, force


def coarse_load(time, load, force):
    return time, np.round(2 * load) / 2, force


#: Defect: the function that plants it, the checks that may name it, and the overall verdict.
DEFECTS = {
    "columns exchanged": (swapped, {"friction", "load harmonics", "mains"}, "bad"),
    "sign of the force": (flipped, {"friction"}, "suspicious"),
    "units a thousand apart": (in_kilonewton, {"friction"}, "suspicious"),
    "zero of the load": (off_zero, {"contact", "friction"}, "bad"),
    "drift of the load": (load_drifts, {"steady load"}, "suspicious"),
    "slow wave of the load": (load_wanders, {"steady load", "other modulation"}, "suspicious"),
    "a second modulation": (second_shaker, {"other modulation", "steady load"}, "suspicious"),
    "a phase that wanders": (phase_wanders, {"other modulation", "steady load"}, "bad"),
    "a response that changes": (
        response_changes,
        {"steady response", "shifting response"},
        "bad",
    ),
    "a line next to the modulation": (hum_next_to_the_line, {"steady response"}, "bad"),
    "dropped bits": (dropped_bits, {"spike"}, "suspicious"),
    "sparks of two samples": (sparks, {"spike"}, "bad"),
    "steps of the load": (coarse_load, {"resolution", "leakage"}, "suspicious"),
}


#: Defect: the check that measures it, the number planted, and the relative tolerance.
NUMBERS = {
    "sign of the force": ("friction", -0.4, 1e-3),
    "zero of the load": ("contact", 7 * 0.24, 1e-3),
    "drift of the load": ("steady load", 0.03 * END / 7.15, 1e-2),
    "a second modulation": ("other modulation", (0.5 / 1.68) ** 2, 1e-2),
    # A phase that wanders by half a radian has sidebands of J1(0.5)/J0(0.5) of the line.
    "a phase that wanders": ("other modulation", (j1(0.5) / j0(0.5)) ** 2, 5e-2),
    # The linear drift that is fitted takes next to nothing of five periods.
    "slow wave of the load": ("steady load", 0.3 / 7, 0.05),
    "steps of the load": ("resolution", 0.5 / 1.68, 0.05),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_defect_is_named_and_nothing_else(steady, trace, defect) -> None:
    plant, names, verdict = DEFECTS[defect]
    measurement = measure(trace(*plant(*steady())), window=(0.0, END))
    named = {c.name for c in measurement.checks if c.verdict != "ok"}
    assert named & names, named
    assert named <= names | {"stick-slip", "signal", "transient"}
    assert measurement.verdict == verdict
    if defect in NUMBERS:
        name, number, rel = NUMBERS[defect]
        (measured,) = (c.number for c in measurement.checks if c.name == name)
        assert measured == pytest.approx(number, rel=rel)


def test_harmonics_of_the_load_count_where_contact_is_lost(steady, trace) -> None:
    """A square wave of the load that reaches zero has a first harmonic of 1.27 W0, a ramp 0.64."""
    time, load, force = (a[:6000] for a in steady())
    ramp = 2 * ((60.013 * time + 0.7 / (2 * np.pi)) % 1.0)
    noise = load - load.mean() - 1.68 * np.cos(2 * np.pi * 60.013 * time + 0.7)
    measurement = measure(trace(time, 7 * ramp + noise, force), harmonics=16)
    (contact,) = (c for c in measurement.checks if c.name == "contact")
    assert measurement.reading.epsilon == pytest.approx(2 / np.pi, rel=0.01)
    # The ramp jumps between two samples, where its harmonics overshoot.
    assert contact.verdict == "bad"
    assert contact.number == pytest.approx(1.0, abs=0.25)


@draws(4, 8)
def test_noise_over_few_periods_is_not_taken_for_sidebands(steady, trace, draws) -> None:
    """In the spectrum of thirty periods every sideband is next to the line."""
    for seed in range(draws):
        time, load, force = (a[:1000] for a in steady(seed=seed, epsilon=0.02))
        load += 0.02 * np.random.default_rng(seed).standard_normal(time.size)
        checks = {c.name: c for c in measure(trace(time, load, force)).checks}
        assert checks["leakage"].number > 0.01
        assert checks["leakage"].verdict == "ok"
        assert checks["steady response"].verdict == "ok"
    time, load, force = (a[:1000] for a in steady())
    swelling = 0.2 * np.sin(2 * np.pi * 8 * time)
    load_swells = load + swelling * (load - load.mean())
    checks = {c.name: c for c in measure(trace(time, load_swells, force)).checks}
    assert checks["leakage"].verdict == "bad"
    force_swells = force + swelling * (force - force.mean())
    checks = {c.name: c for c in measure(trace(time, load, force_swells)).checks}
    assert checks["steady response"].verdict == "suspicious"
    assert checks["leakage"].verdict == "ok"


def test_spikes_do_not_change_the_numbers(steady, trace) -> None:
    """Nor do they hide the modulation, though they are many times as large."""
    time, load, force = steady(epsilon=0.01)
    rng = np.random.default_rng(3)
    for values, size in ((load, 10.0), (force, 1.0)):
        values[rng.choice(time.size, 12, replace=False)] += size * rng.choice([-1, 1], 12)
    measurement = measure(trace(time, load, force))
    reading, first = measurement.reading, measurement.reading.phasor(1)
    assert measurement.samples.dropped == 24
    assert abs(reading.epsilon - 0.01) < 4 * reading.uncertainty("epsilon") < 1e-4
    assert abs(first.amplitude - 2e-3) < 4 * first.amplitude_uncertainty < 4e-5
    assert "spike" in {c.name for c in measurement.checks if c.verdict != "ok"}


def test_a_pause_with_a_saturated_gauge_is_named(truth, protocol, trace) -> None:
    """Saturation lowers the level of the pause, and with it the change of friction."""
    time, load, force = protocol(truth, noise=3e-2)
    measurement = measure(trace(time, load, np.minimum(force, 7 * 0.4)))
    assert {c.name: c.verdict for c in measurement.checks}["saturation"] == "bad"
    assert measurement.reading.start > 6


def test_a_force_of_zero_is_bad(steady, trace) -> None:
    time, load, force = steady()
    measurement = measure(trace(time, load, 0 * force))
    assert measurement.verdict == "bad"
    assert measurement.reading.mean_friction == 0


def test_constant_or_identical_channels_give_finite_numbers(steady, trace) -> None:
    time, load, force = steady()
    half = time.size // 2
    stuck = force.copy()
    stuck[half:] = stuck[half]
    for values in (stuck, np.full(time.size, 2.8), load, 0.4 * load):
        measurement = measure(trace(time, load, values), frequency=60.0, window=(0.0, END))
        record = modulated_record(measurement)
        assert np.isfinite([record[name] for name in ("W0", "epsilon", "mu1", "mu2")]).all()
        assert np.isfinite(list(record["intervals_95"].values())).all()


@pytest.mark.parametrize(
    "shape", ["white", "sine", "walk", "sawtooth", "steps", "coarse", "begins"]
)
def test_signals_without_spikes_have_none(trace, shape) -> None:
    rng = np.random.default_rng(4)
    n = 200_000
    values = {
        "white": rng.standard_normal(n),
        "sine": np.cos(0.9 * np.arange(n)),
        "walk": np.cumsum(rng.standard_normal(n)),
        "sawtooth": np.arange(n) / 500 % 1 + 1e-4 * rng.standard_normal(n),
        "steps": np.repeat(rng.integers(0, 9, n // 50), 50) + 1e-3 * rng.standard_normal(n),
        "begins": 7
        + 1e-3 * rng.standard_normal(n)
        + (np.arange(n) % 16_000 > 9_000) * np.cos(0.19 * np.arange(n) + 0.3),
        "coarse": np.round(0.15 * rng.standard_normal(n)),
    }[shape]
    findings = trace(np.arange(n) * 1e-4, values, values).findings
    assert "spike" not in {finding.name for finding in findings}


def test_a_jittering_clock_has_no_gaps(steady, trace) -> None:
    time, load, force = steady()
    for seed in range(10):
        jitter = np.random.default_rng(seed).uniform(-0.3, 0.3, time.size) / RATE
        findings = trace(time + jitter, load, force).findings
        assert "gap" not in {finding.name for finding in findings}
    keep = (time < 4) | (time > 4.01)
    findings = check(replace(trace((time + jitter)[keep], load[keep], force[keep]), findings=()))
    (gap,) = [finding for finding in findings if finding.name == "gap"]
    assert gap.number == pytest.approx(0.01, rel=0.1)


@pytest.mark.long
def test_intervals_contain_the_truth_under_1_f_noise(truth) -> None:
    rng = np.random.default_rng(5)
    n = 2000

    def flicker():
        # A quarter of a longer noise, which has frequencies below the lowest of the window.
        line = np.fft.rfftfreq(4 * n)
        shape = np.concatenate([[0.0], line[1:] ** -0.5])
        return 1e-3 * np.fft.irfft(shape * np.fft.rfft(rng.standard_normal(4 * n)))[:n]

    noises = [(flicker(), flicker()) for _ in range(60)]
    shares = covered(truth, noises, RATE, ("mean_friction", "mu1", "phase1"))
    # The binomial scatter of 60 seeds is 3 %; a steep spectrum is extrapolated less well.
    assert min(shares.values()) > 0.82, shares


@draws(8, 60)
def test_uncertainties_include_hum_far_from_the_harmonics(truth, draws) -> None:
    rng = np.random.default_rng(6)
    time = np.arange(3000) / RATE
    noises = []
    for _ in range(draws):
        # The window holds whole periods of the hum: one line of its spectrum contains it.
        wave = [np.cos(2 * np.pi * 50 * time + rng.uniform(0, 7)) for _ in range(2)]
        noises.append([0.01 * w + 1e-4 * rng.standard_normal(time.size) for w in wave])
    shares = covered(truth, noises, RATE, ("mean_friction", "mu1", "phase1", "mu2"))
    assert min(shares.values()) > (0.9 if draws == 60 else 0.7), shares


def test_the_phase_of_an_absent_harmonic_is_unknown(truth) -> None:
    quiet = truth.but(harmonics=(2e-3 + 0j, 0j))
    rng = np.random.default_rng(7)
    time = np.arange(3000) / RATE
    noise = 2e-2 * lfilter([1], [1, -0.5], rng.standard_normal((2, time.size)))
    reading = lock_in(time, quiet.load(time) + noise[0], quiet.force(time) + noise[1])
    assert not reading.phasor(2).excludes(0)
    assert reading.half_width("phase2") == pytest.approx(np.pi)
    assert reading.uncertainty("phase2") <= np.pi / np.sqrt(3)
    assert reading.half_width("phase1") < np.pi


def test_a_parabola_of_load_and_force_is_a_drift_though_it_ends_where_it_began(steady, trace):
    time, load, force = steady()
    bent = 0.06 * (2 * time / END - 1) ** 2
    recording = trace(time, load + bent * load.mean(), force + bent * force.mean())
    measurement = measure(recording, detrend="quadratic")
    numbers = {c.name: c.number for c in measurement.checks if c.verdict == "bad"}
    assert numbers == pytest.approx({"steady load": 0.06 / 1.02, "drift": 0.06 / 1.02}, rel=0.01)
