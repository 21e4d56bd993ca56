"""Recordings that are not what they seem: each is named, with a number, and nothing else is."""

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
def made(truth):
    """Arrays time, load, force of ten steady seconds."""

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


def hum_beside_the_line(time, load, force):
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


#: Defect, the checks that name it, and the verdict of the gravest.
DOUBTS = {
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
    "another line beside it": (hum_beside_the_line, {"steady response"}, "bad"),
    "dropped bits": (dropped_bits, {"spike"}, "suspicious"),
    "sparks of two samples": (sparks, {"spike"}, "bad"),
    "steps of the load": (coarse_load, {"resolution", "leakage"}, "suspicious"),
}


#: Check and number of what was planted, and how well it is known.
NUMBERS = {
    "sign of the force": ("friction", -0.4, 1e-3),
    "zero of the load": ("contact", 7 * 0.24, 1e-3),
    "drift of the load": ("steady load", 0.03 * END / 7.15, 1e-2),
    "a second modulation": ("other modulation", (0.5 / 1.68) ** 2, 1e-2),
    # Either sideband of a wandering phase has the amplitude J1 / J0 of the line, of half a radian.
    "a phase that wanders": ("other modulation", (j1(0.5) / j0(0.5)) ** 2, 5e-2),
    # Half of the line's slope is fitted as drift: ten half-turns hold next to none.
    "slow wave of the load": ("steady load", 0.3 / 7, 0.05),
    "steps of the load": ("resolution", 0.5 / 1.68, 0.05),
}


@pytest.mark.parametrize("doubt", DOUBTS)
def test_what_cannot_be_believed_is_named(made, trace, doubt) -> None:
    plant, names, verdict = DOUBTS[doubt]
    found = measure(trace(*plant(*made())), window=(0.0, END))
    named = {c.name for c in found.checks if c.verdict != "ok"}
    assert named & names, named
    assert named <= names | {"stick-slip", "signal", "transient"}
    assert found.verdict == verdict
    if doubt in NUMBERS:
        name, number, rel = NUMBERS[doubt]
        check = next(c for c in found.checks if c.name == name)
        assert check.number == pytest.approx(number, rel=rel)


def test_noise_is_no_sideband_of_few_periods(made, trace) -> None:
    """Of thirty periods all sidebands are next to the line."""
    for seed in range(8):
        time, load, force = (a[:1000] for a in made(seed=seed, epsilon=0.02))
        load += 0.02 * np.random.default_rng(seed).standard_normal(time.size)
        checks = {c.name: c for c in measure(trace(time, load, force)).checks}
        assert checks["leakage"].number > 0.01
        assert checks["leakage"].verdict == "ok"
        assert checks["steady response"].verdict == "ok"
    time, load, force = (a[:1000] for a in made())
    swelling = 0.2 * np.sin(2 * np.pi * 8 * time)
    load_swells = load + swelling * (load - load.mean())
    checks = {c.name: c for c in measure(trace(time, load_swells, force)).checks}
    assert checks["leakage"].verdict == "bad"
    force_swells = force + swelling * (force - force.mean())
    checks = {c.name: c for c in measure(trace(time, load, force_swells)).checks}
    assert checks["steady response"].verdict == "suspicious"
    assert checks["leakage"].verdict == "ok"


def test_spikes_have_no_share_in_the_numbers(made, trace) -> None:
    """Nor in the search for the modulation, of which they are many times larger."""
    time, load, force = made(epsilon=0.01)
    rng = np.random.default_rng(3)
    for values, size in ((load, 10.0), (force, 1.0)):
        values[rng.choice(time.size, 12, replace=False)] += size * rng.choice([-1, 1], 12)
    found = measure(trace(time, load, force))
    first = found.reading.phasor(1)
    assert found.samples.dropped == 24
    assert abs(found.reading.epsilon - 0.01) < 4 * found.reading.uncertainty("epsilon") < 1e-4
    assert abs(first.amplitude - 2e-3) < 4 * first.amplitude_uncertainty < 4e-5
    assert "spike" in {c.name for c in found.checks if c.verdict != "ok"}


def test_a_pause_with_a_saturated_gauge_is_named(truth, protocol, trace) -> None:
    """Its level is too low, and with it the change of friction."""
    time, load, force = protocol(truth, noise=3e-2)
    found = measure(trace(time, load, np.minimum(force, 7 * 0.4)))
    assert {c.name: c.verdict for c in found.checks}["saturation"] == "bad"
    assert found.reading.start > 6


def test_a_force_of_zero_has_a_verdict(made, trace) -> None:
    time, load, force = made()
    found = measure(trace(time, load, 0 * force))
    assert found.verdict == "bad"
    assert found.reading.mean_friction == 0


def test_recordings_that_stand_still_have_a_verdict(made, trace) -> None:
    time, load, force = made()
    half = time.size // 2
    stuck = force.copy()
    stuck[half:] = stuck[half]
    for values in (stuck, np.full(time.size, 2.8), load, 0.4 * load):
        found = measure(trace(time, load, values), frequency=60.0, window=(0.0, END))
        record = modulated_record(found)
        assert np.isfinite([record[name] for name in ("W0", "epsilon", "mu1", "mu2")]).all()
        assert np.isfinite(list(record["intervals_95"].values())).all()


@pytest.mark.parametrize(
    "shape", ["white", "sine", "walk", "sawtooth", "steps", "coarse", "begins"]
)
def test_signals_without_spikes_have_none(trace, shape) -> None:
    rng = np.random.default_rng(4)
    n = 200_000
    made = {
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
    found = trace(np.arange(n) * 1e-4, made, made).findings
    assert "spike" not in {finding.name for finding in found}


def test_a_jittering_clock_has_no_gaps(made, trace) -> None:
    time, load, force = made()
    for seed in range(10):
        off = np.random.default_rng(seed).uniform(-0.3, 0.3, time.size) / RATE
        found = trace(time + off, load, force).findings
        assert "gap" not in {finding.name for finding in found}
    keep = (time < 4) | (time > 4.01)
    found = check(replace(trace((time + off)[keep], load[keep], force[keep]), findings=()))
    (gap,) = [finding for finding in found if finding.name == "gap"]
    assert gap.number == pytest.approx(0.01, rel=0.1)


@pytest.mark.long
def test_noise_that_grows_towards_zero_is_followed_there(truth) -> None:
    rng = np.random.default_rng(5)
    n = 2000

    def flicker():
        # A piece of 1/f noise that began four windows ago.
        line = np.fft.rfftfreq(4 * n)
        shape = np.concatenate([[0.0], line[1:] ** -0.5])
        return 1e-3 * np.fft.irfft(shape * np.fft.rfft(rng.standard_normal(4 * n)))[:n]

    noises = [(flicker(), flicker()) for _ in range(60)]
    shares = covered(truth, noises, RATE, ("mean_friction", "mu1", "phase1"))
    # Binomial scatter of 60 seeds is 3 %; following a spectrum down is no better than it is steep.
    assert min(shares.values()) > 0.82, shares


@draws(8, 60)
def test_hum_far_from_the_harmonics_is_in_their_uncertainties(truth, draws) -> None:
    rng = np.random.default_rng(6)
    time = np.arange(3000) / RATE
    noises = []
    for _ in range(draws):
        # Whole periods in the window: no line of the window's spectrum sees them but one.
        wave = [np.cos(2 * np.pi * 50 * time + rng.uniform(0, 7)) for _ in range(2)]
        noises.append([0.01 * w + 1e-4 * rng.standard_normal(time.size) for w in wave])
    shares = covered(truth, noises, RATE, ("mean_friction", "mu1", "phase1", "mu2"))
    assert min(shares.values()) > (0.9 if draws == 60 else 0.7), shares


def test_a_phase_of_nothing_is_unknown(truth) -> None:
    quiet = truth.but(harmonics=(2e-3 + 0j, 0j))
    rng = np.random.default_rng(7)
    time = np.arange(3000) / RATE
    noise = 2e-2 * lfilter([1], [1, -0.5], rng.standard_normal((2, time.size)))
    reading = lock_in(time, quiet.load(time) + noise[0], quiet.force(time) + noise[1])
    assert not reading.phasor(2).excludes(0)
    assert reading.half_width("phase2") == pytest.approx(np.pi)
    assert reading.uncertainty("phase2") <= np.pi / np.sqrt(3)
    assert reading.half_width("phase1") < np.pi
