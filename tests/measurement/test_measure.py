"""`measure` with a modulated load: its window, F(0) before and after, and its checks."""

from functools import partial

import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.lock_in.demodulation import lock_in
from asperity.measurement.record import modulated_record
from asperity.recording import Channel, Trace

measure = partial(asp.measure, modulated=True)

CHECKS = {
    *("modulation", "periods", "signal", "leakage", "drift", "transient"),
    *("stick-slip", "load harmonics", "resolution"),
}


def verdicts(measurement):
    return {check.name: check.verdict for check in measurement.checks}


def test_a_clean_recording_passes_every_check(truth, protocol, trace) -> None:
    measurement = measure(trace(*protocol(truth)))
    assert set(verdicts(measurement)) >= CHECKS
    assert set(verdicts(measurement).values()) == {"ok"}
    assert measurement.verdict == "ok"
    reading = measurement.reading
    # Five standard uncertainties: the seed is fixed.
    for name in ("W0", "epsilon", "frequency"):
        assert abs(getattr(reading, name) - getattr(truth, name)) < 5 * reading.uncertainty(name)
    for n, c in enumerate(truth.harmonics, 1):
        phasor = reading.phasor(n)
        assert abs(phasor.value - c) < 5 * phasor.amplitude_uncertainty
    assert abs(measurement.delta_mu + 0.08) < 5 * measurement.delta_mu_uncertainty
    assert abs(measurement.static_friction - 0.4) < 5e-6
    for level in (measurement.before, measurement.after):
        assert abs(level.value - 2.8) < 5 * level.uncertainty


def test_the_window_lies_in_the_modulation_after_the_transient(truth, protocol, trace) -> None:
    measurement = measure(trace(*protocol(truth)))
    reading = measurement.reading
    # After eight decay times of 0.3 s, 0.08 e^-8 is within the noise of a block of 0.07 s.
    assert 6.9 < reading.start < 10.0
    assert 25.7 < reading.end < 26.0
    assert measurement.chosen_by == "program"
    assert [part.modulated for part in measurement.stretches] == [False, True, False]
    assert measurement.stretches[1].amplitude == pytest.approx(truth.epsilon * truth.W0, rel=1e-2)


def test_a_window_of_the_user_is_taken_as_it_is(truth, protocol, trace) -> None:
    measurement = measure(trace(*protocol(truth)), window=(12.0, 20.0))
    reading = measurement.reading
    assert (reading.start, reading.end) == pytest.approx((12.0, 20.0), abs=1e-9)
    assert measurement.chosen_by == "user"
    assert measurement.before is not None


def test_the_window_is_cut_to_whole_periods_on_request(truth, protocol, trace) -> None:
    measurement = measure(trace(*protocol(truth)), window=(12.0, 20.0), only_whole_periods=True)
    # The last sample stands for the time up to the next: n samples span n steps.
    periods = measurement.reading.samples * 1e-3 * truth.frequency
    assert abs(periods - round(periods)) < 1e-3 * truth.frequency
    assert 20.0 - measurement.reading.end < 1 / truth.frequency + 1e-3


def test_a_recording_without_pauses_is_read_whole(truth, trace) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(8000) * 1e-3
    load = truth.load(time) + 1e-3 * rng.standard_normal(time.size)
    force = truth.force(time) + 1e-3 * rng.standard_normal(time.size)
    measurement = measure(trace(time, load, force))
    assert measurement.window == (0, time.size)
    assert measurement.before is None
    assert measurement.after is None
    assert np.isnan(measurement.delta_mu)
    assert measurement.verdict == "ok"


def test_a_weak_modulation_is_not_taken_for_a_pause(truth, trace) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(30_000) * 1e-3
    epsilon = np.select([time < 5, time < 12, time < 17], [0.0, 0.005, 0.0], 0.4)
    load = 7 * (1 + epsilon * np.cos(2 * np.pi * 60 * time))
    load = load + 1e-3 * rng.standard_normal(time.size)
    force = truth.force(time) + 1e-3 * rng.standard_normal(time.size)
    measurement = measure(trace(time, load, force))
    amplitudes = [part.amplitude / 7 for part in measurement.stretches]
    assert amplitudes == pytest.approx([0, 0.005, 0, 0.4], abs=2e-4)
    assert 12 < measurement.before.start < measurement.before.end < 17


def test_the_longest_of_several_amplitudes_is_read(truth, trace) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(20_000) * 1e-3
    weak = truth.but(epsilon=0.1)
    load = np.where(time < 8, weak.load(time), truth.load(time))
    load = load + 1e-3 * rng.standard_normal(time.size)
    force = truth.force(time) + 1e-3 * rng.standard_normal(time.size)
    measurement = measure(trace(time, load, force))
    assert measurement.reading.epsilon == pytest.approx(0.24, abs=1e-4)
    assert measurement.reading.start > 8.0
    amplitudes = [part.amplitude / truth.W0 for part in measurement.stretches]
    assert amplitudes == pytest.approx([0.1, 0.24], abs=1e-3)


def test_delta_mu_of_each_amplitude_refers_to_the_pauses_next_to_it(truth, trace) -> None:
    # Friction drifts by 2 % in all: the pauses next to another amplitude have other levels.
    rng = np.random.default_rng(8)
    time = np.arange(60_000) * 1e-3
    amplitudes, starts = (0.05, 0.1, 0.2), (8.0, 26.0, 44.0)
    load, friction = np.full(time.size, truth.W0), 0.5 * (1 - 0.02 * time / 60)
    for amplitude, start in zip(amplitudes, starts, strict=True):
        on = (time >= start) & (time < start + 8)
        load = np.where(on, truth.but(epsilon=amplitude).load(time), load)
        drop = -np.expm1(-np.clip(time - start, 0, None) / 0.3)
        back = -np.expm1(-np.clip(time - start - 8, 0, None) / 0.3)
        friction = friction - 0.2 * amplitude * (drop - back)
    load = load + 2e-3 * rng.standard_normal(time.size)
    force = truth.W0 * friction + 1e-3 * rng.standard_normal(time.size)
    recording = trace(time, load, force)
    for amplitude, start in zip(amplitudes, starts, strict=True):
        # The last sample of the window is the first of the pause.
        measurement = measure(recording, window=(start + 3, start + 8))
        assert measurement.reading.epsilon == pytest.approx(amplitude, rel=5e-3)
        # The middle of the window is 1.5 s later than the mean time of its pauses.
        assert measurement.delta_mu == pytest.approx(-0.2 * amplitude, abs=6e-4)
        assert verdicts(measurement)["steady load"] == "ok"


def slow(time, load, force):
    """Stick-slip that the modulation has not suppressed."""
    return time, load, force + 0.02 * np.sin(2 * np.pi * 2.7 * time)


def fast(time, load, force):
    """Stick-slip under a modulation that is slower."""
    phi = 2 * np.pi * 0.5 * time
    return time, 7 * (1 + 0.1 * np.cos(phi)), 2.8 + 0.01 * np.cos(phi) + 0.1 * (2.7 * time % 1)


def drifting(time, load, force):
    return time, load, force * (1 + 2e-3 * time)


def second_harmonic(time, load, force):
    on = (time >= 6) & (time < 26)
    return time, load + on * 0.1 * np.cos(4 * np.pi * 60.013 * time), force


def saturated(time, load, force):
    return time, np.minimum(load, 8.5), force


def unsteady(time, load, force):
    on = (time >= 6) & (time < 26)
    phase = 2 * np.pi * 60.013 * time + 0.7 + 0.3 * np.sin(2 * np.pi * 0.2 * time)
    return time, 7 * (1 + 0.24 * on * np.cos(phase)), force


def with_gap(time, load, force):
    keep = (time < 14) | (time > 14.8)
    return time[keep], load[keep], force[keep]


def with_nan(time, load, force):
    force = force.copy()
    force[15_000:15_200] = np.nan
    return time, load, force


def coarse(time, load, force):
    """Steps of a recorder as large as mu1, and no noise to smooth them."""
    return time, load, np.round(force / 0.02) * 0.02


def noisy(time, load, force):
    return time, load, force + 3.0 * np.random.default_rng(1).standard_normal(time.size)


def repeated_stamps(time, load, force):
    time = time.copy()
    time[15_001] = time[15_000]
    return time, load, force


#: Defect: the function that plants it, the window, the check that names it, and its verdicts.
PLANTED = {
    "stick-slip": (slow, None, "stick-slip", {"suspicious", "bad"}),
    "stick-slip, faster": (fast, None, "stick-slip", {"bad"}),
    "drift": (drifting, None, "drift", {"bad"}),
    "second harmonic of the load": (second_harmonic, None, "load harmonics", {"suspicious", "bad"}),
    "saturation": (saturated, None, "saturation", {"bad"}),
    "unsteady exciter": (unsteady, None, "leakage", {"bad"}),
    "gap": (with_gap, (10, 20), "gap", {"suspicious"}),
    "missing values": (with_nan, (10, 20), "missing values", {"suspicious"}),
    "coarse steps": (coarse, None, "resolution", {"bad"}),
    "noise": (noisy, None, "signal", {"bad", "suspicious"}),
    "transient": (lambda *a: a, (6.3, 14), "transient", {"bad"}),
    "a few periods": (lambda *a: a, (12.0, 12.06), "periods", {"suspicious"}),
    "repeated stamps": (repeated_stamps, (10, 20), "repeated time", {"suspicious"}),
}


#: Defect: the number of its check, and the relative tolerance.
NUMBERS = {
    # A line between two frequencies of the spectrum is measured up to 15 % too low.
    "stick-slip": (0.02 / (0.32 * 7), 0.15),
    # F(0) is averaged over 0-6 s and about 29-36 s; the middles are 29.5 s apart.
    "drift": (2e-3 * 29.5, 0.1),
    "second harmonic of the load": (2e-3 / 0.24 * (0.1 / 7) / 3e-4, 2e-2),
    "transient": (0.08 * np.exp(-1) / 0.32, 0.3),
}


@pytest.mark.parametrize("defect", PLANTED)
def test_a_planted_defect_is_named(truth, protocol, trace, defect) -> None:
    plant, window, name, expected = PLANTED[defect]
    measurement = measure(trace(*plant(*protocol(truth))), window=window)
    (check,) = [check for check in measurement.checks if check.name == name]
    assert check.verdict in expected, check
    assert check.sentence
    if defect in NUMBERS:
        number, rel = NUMBERS[defect]
        assert check.number == pytest.approx(number, rel=rel)
    if plant is second_harmonic:
        assert abs(measurement.reading.load_harmonics[1]) == pytest.approx(0.1 / 7, rel=1e-2)


def test_the_chosen_window_avoids_defects(truth, protocol, trace) -> None:
    time, load, force = protocol(truth)
    force = force.copy()
    force[10_500:10_600] = np.nan
    measurement = measure(trace(time, load, force))
    assert measurement.reading.start >= 10.6
    assert measurement.verdict == "ok"
    # The defects are reported all the same.
    assert "missing values" in {finding.name for finding in measurement.samples.findings}
    assert measurement.samples.dropped == 100


def test_missing_values_are_left_out_and_not_interpolated(truth, trace) -> None:
    time = np.arange(6000) * 1e-3
    load, force = truth.load(time), truth.force(time)
    force[1000:1100] = np.nan
    load[2500:2600] = np.inf
    measurement = measure(trace(time, load, force), window=(0, 6))
    assert abs(measurement.reading.harmonics[0] - truth.harmonics[0]) < 1e-12
    assert measurement.samples.dropped == 200


def test_a_recorded_friction_coefficient_stands_for_the_force(truth, trace) -> None:
    time = np.arange(6000) * 1e-3
    load, force = truth.load(time), truth.force(time)
    friction = Channel(force / load, "dimensionless", "", "mu", "")
    measurement = measure(Trace(time, {"W": Channel(load, "force", "N", "W", "N"), "mu": friction}))
    assert abs(measurement.reading.harmonics[0] - truth.harmonics[0]) < 1e-12
    assert measurement.samples.names == ("W", "mu x load")


def test_a_recording_without_modulation_is_refused(truth, trace) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(8000) * 1e-3
    load = 7 + 1e-2 * rng.standard_normal(time.size)
    force = 2.8 + 1e-2 * rng.standard_normal(time.size)
    with pytest.raises(InputError, match=r"must be modulated.*choose modulated=False"):
        measure(trace(time, load, force))
    # If the user gives a frequency, the verdict says so.
    assert verdicts(measure(trace(time, load, force), frequency=60.0))["modulation"] == "bad"


def test_a_short_modulation_of_a_long_recording_is_found(truth, protocol, trace) -> None:
    # Averages over the whole would hide the line, and the middle has none.
    signals = protocol(truth, rate=2000.0, on=(88.0, 96.0), end=100.0)
    measurement = measure(trace(*signals))
    assert measurement.reading.frequency == pytest.approx(truth.frequency, abs=1e-4)
    assert 88 < measurement.reading.start < measurement.reading.end < 96


def test_the_record_holds_values_uncertainties_and_their_covariance(truth, protocol, trace) -> None:
    measurement = measure(trace(*protocol(truth)), harmonics=2)
    record = modulated_record(measurement)
    assert record["mu1"] == measurement.reading.phasor(1).amplitude
    assert record["uncertainties"]["phase2"] == measurement.reading.uncertainty("phase2")
    matrix = np.array(record["covariance"]["matrix"])
    names = record["covariance"]["names"]
    assert matrix.shape == (len(names), len(names))
    assert matrix == pytest.approx(matrix.T, rel=1e-6, abs=1e-18)
    assert np.linalg.eigvalsh(matrix / np.sqrt(np.outer(*2 * [np.diag(matrix)]))).min() > -1e-9
    at = names.index("epsilon")
    assert record["uncertainties"]["epsilon"] == pytest.approx(np.sqrt(matrix[at, at]))


@pytest.mark.parametrize("samples", [3000, 140_000])
@pytest.mark.parametrize(("which", "refine"), [("load", True), ("force", False)])
def test_lock_in_refuses_values_that_are_not_finite(truth, samples, which, refine) -> None:
    time = np.arange(samples) * 1e-3
    signals = {"load": truth.load(time), "force": truth.force(time)}
    signals[which][samples // 3] = np.nan
    with pytest.raises(InputError, match="must be finite"):
        lock_in(time, **signals, frequency=truth.frequency, refine=refine)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"window": (5, 4)}, "window must end after it begins"),
        ({"window": (90, 99)}, "window must enclose"),
        ({"detrend": "cubic"}, "detrend must be one of none, linear, quadratic"),
        ({"frequency": 900.0}, "frequency must lie within what the recording resolves"),
        ({"harmonics": 9}, "harmonics must lie below half the sampling rate"),
        ({"harmonics": 0}, "harmonics must be at least 1"),
        ({"force": "W"}, "force must be another channel"),
        ({"load": "nothing"}, "must name a channel, got none like 'nothing'"),
        ({"window": (12.0, 12.017)}, "must hold at least|at least one period"),
    ],
)
def test_bad_input_is_one_sentence(truth, protocol, trace, options, message) -> None:
    with pytest.raises(InputError, match=message) as caught:
        measure(trace(*protocol(truth)), **options)
    assert str(caught.value).count(";") == 1


@pytest.mark.parametrize("shared", [False, True])
def test_delta_mu_uncertainty_includes_noise_of_the_load_in_the_pauses(
    truth, protocol, trace, shared
) -> None:
    variances = []
    # That of noise which the force shares is compared with a bound only.
    for seed in range(4 if shared else 8):
        time, load, force = protocol(truth, noise=1e-3, on=(4.0, 8.0), end=8.0, seed=seed)
        of_load = 0.05 * np.random.default_rng(100 + seed).standard_normal(time.size)
        force = force + truth.mean_friction * of_load if shared else force
        measurement = measure(trace(time, load + of_load, force))
        modulated = measurement.reading.uncertainty("mean_friction")
        variances.append(max(measurement.delta_mu_uncertainty**2 - modulated**2, 0.0))
    # Propagated error of the mean of F/W over the 4,000 samples before the modulation.
    expected = truth.mean_friction * 0.05 / truth.W0 / np.sqrt(4000)
    if shared:
        assert np.median(variances) < (0.05 * expected) ** 2
    else:
        # The median of chi-squared of eight degrees of freedom, which eight draws give to 22 %.
        assert np.median(variances) == pytest.approx(7.34 / 8 * expected**2, rel=0.5)
