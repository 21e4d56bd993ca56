"""Stick-slip: regimes of recordings, checks, catalogue, healing, and the threshold of sliding."""

import dataclasses
import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import xarray as xr
from benchmarks.stick_slip_recordings import SHAPES, chain, saw

import asperity as asp
from asperity import Slider, laws
from asperity.errors import InputError
from asperity.experiment import stick_slip_response
from asperity.measurement.stick_slip.campaign import StickSlipCampaign
from asperity.measurement.stick_slip.catalogue import COLUMNS, write_catalogue
from asperity.measurement.stick_slip.events import SlipEvents
from asperity.measurement.stick_slip.healing import of_campaign
from asperity.measurement.stick_slip.measure import StickSlipMeasurement
from asperity.measurement.stick_slip.threshold import linear_frequency, thresholds
from asperity.recording import Channel, Trace, check
from asperity.theory import healing_drop
from references.populations import population

measure_stick_slip = partial(asp.measure, stick_slip=True)


@pytest.fixture(scope="module")
def clean():
    """Measurement of regular stick-slip without a defect."""
    return measure_stick_slip(recorded(saw(0).force))


def recorded(friction, rate=2000.0, name="mu"):
    channels = {name: Channel(friction, "dimensionless", "", name, "1")}
    trace = Trace(np.arange(friction.size) / rate, channels)
    return replace(trace, findings=check(trace))


def growing(ratio):
    """Cycles whose drops grow by `ratio` each."""
    drops, slope = 0.03 * ratio ** np.arange(-20.0, 20.0), 1e-4
    sticks, slips = (np.append(drops[1:], 0.01) / slope).astype(int), np.full(40, 20)
    first = int(drops[0] / slope)
    friction = chain(drops, slips, sticks, slope, SHAPES["free"], first=first)[0]
    return friction + 5e-4 * np.random.default_rng(0).standard_normal(friction.size)


def steady(n=40_000, level=0.3, noise=0.005, seed=1):
    return level + noise * np.random.default_rng(seed).standard_normal(n)


def sine(frequency, n=60_000):
    time = np.arange(n) / 2000
    return 0.4 + 0.05 * np.sin(2 * np.pi * frequency * time) + steady(n, 0.0, 0.005)


REGIMES = {
    "irregular": (lambda: saw(0, spread=0.3).force, "irregular stick-slip"),
    "two sizes": (lambda: saw(0, small=0.4, noise=0.02).force, "irregular stick-slip"),
    "growing": (lambda: growing(1.05), "growing stick-slip"),
    "dying": (lambda: growing(0.95), "dying stick-slip"),
    "inertial": (lambda: saw(0, cycle=500, slip=480).force, "oscillation about sliding"),
    "sine": (lambda: sine(3.0), "oscillation about sliding"),
    "steady": (steady, "steady sliding"),
    "noisy": (lambda: steady(noise=0.1), "steady sliding"),
    "blind": (lambda: steady(noise=0.3, n=2000), "cannot tell"),
    "slips on both sides": (
        lambda: np.concatenate([saw(0, events=50).force, steady(), saw(1, events=50).force]),
        "regular stick-slip, then steady sliding, then regular stick-slip",
    ),
    "another velocity": (
        lambda: np.concatenate(
            [saw(0, events=40).force, saw(1, events=200, cycle=100, slip=10).force]
        ),
        "regular stick-slip, then regular stick-slip",
    ),
    "one event": (lambda: saw(0, events=1).force, "cannot tell"),
    "too fast": (lambda: np.tile(0.3 + 0.1 * np.arange(7) / 7, 300), "cannot tell"),
}


@pytest.mark.parametrize("case", REGIMES)
def test_the_regime_of_a_recording_is_recognised(case) -> None:
    friction, kind = REGIMES[case]
    result = measure_stick_slip(recorded(friction()))
    assert result.kind == kind
    # Drops are read by fits of the shapes of slips, which do not suit a sine.
    (regime,) = (check for check in result.checks if check.name == "regime")
    assert (regime.verdict == "ok") == (not kind.startswith(("oscillation", "cannot tell")))
    # V and means of a drive of two velocities belong to none of them.
    loading = {c.verdict for c in result.checks if c.name == "loading"} - {"ok"}
    assert loading == ({"suspicious"} if case == "another velocity" else set())


@pytest.mark.parametrize("seed", population(10))
@pytest.mark.parametrize("power", [0.0, 1.0])
def test_friction_that_varies_along_the_track_is_not_taken_for_stick_slip(seed, power) -> None:
    """White and 1/f^2 variations: symmetrical falls and rises at every length."""
    white = np.random.default_rng(seed).standard_normal(40_000)
    shape = np.maximum(np.fft.rfftfreq(white.size), 1e-4) ** -power
    varying = np.fft.irfft(np.fft.rfft(white) * shape)
    result = measure_stick_slip(recorded(0.4 + 0.03 * varying / varying.std()))
    assert not any(r.sticks for r in result.regimes)


def test_measure_recognises_stick_slip_by_itself(clean) -> None:
    assert clean.kind == "regular stick-slip"
    assert isinstance(asp.measure(recorded(saw(0).force)), StickSlipMeasurement)
    assert not isinstance(asp.measure(recorded(steady())), StickSlipMeasurement)
    assert isinstance(asp.measure(recorded(steady()), stick_slip=True), StickSlipMeasurement)


def test_sticks_of_a_recorded_slider_are_not_taken_for_holds() -> None:
    truth = saw(0, events=40, noise=0.02)
    stick = np.ones(truth.time.size, bool)
    for onset, end in zip(truth.onset, truth.end, strict=True):
        stick &= (truth.time < onset) | (truth.time > end)
    slider = np.cumsum(~stick) * 1e-6
    trace = recorded(truth.force)
    with_slip = Trace(
        trace.time,
        {**trace.channels, "displacement": Channel(slider, "length", "m", "displacement", "m")},
    )
    assert isinstance(asp.measure(with_slip), StickSlipMeasurement)


def test_slips_and_energies_follow_from_the_spring() -> None:
    """K, V and W0 of a quasi-static cycle: V = s W0/K with the loading slope s."""
    truth = saw(0, events=50, noise=0.01)
    load, stiffness = 5.0, 2e4
    velocity = truth.loading_slope[0] * load / stiffness
    trace = recorded(truth.force)
    machine = {"velocity": velocity, "normal_load": load}
    result = measure_stick_slip(trace, stiffness=stiffness, **machine)
    estimate, doubt = result.stiffness_from_slope
    assert abs(estimate - stiffness) < 4 * doubt
    # Over a cycle the spring's end and the slider move alike: slip = V recurrence.
    assert np.mean(result.slip) == pytest.approx(velocity * np.mean(np.diff(truth.onset)), rel=0.01)
    events = result.events
    high, low = load * events.force_before, load * events.force_after
    assert result.energy == pytest.approx((high**2 - low**2) / (2 * stiffness))
    assert {c.name: c.verdict for c in result.checks}["stiffness"] == "ok"
    wrong = measure_stick_slip(trace, stiffness=1.5 * stiffness, **machine)
    assert {c.name: c.verdict for c in wrong.checks}["stiffness"] == "bad"


DEFECTS = {
    "few events": (lambda: saw(0, events=2).force, "events"),
    "unresolved slips": (
        lambda: np.tile(0.3 + 0.1 * np.arange(20) / 20, 100) + steady(2000, 0.0, 5e-4),
        "sampling",
    ),
    "a drift larger than the drops": (lambda: saw(0, wave=20).force, "drift"),
    "rounded and cut off below": (
        lambda: np.round(np.maximum(saw(0, noise=0.02).force, 0.26) / 0.002) * 0.002,
        "saturation",
    ),
    "rounded to a fifth of the drop": (
        lambda: np.round(saw(0, noise=0.01).force / 0.02) * 0.02,
        "resolution",
    ),
}


@pytest.mark.parametrize("case", DEFECTS)
def test_a_defect_is_named(case) -> None:
    friction, name = DEFECTS[case]
    verdicts = {c.name: c.verdict for c in measure_stick_slip(recorded(friction())).checks}
    assert verdicts[name] in ("suspicious", "bad")


def test_a_clean_recording_passes_every_check(clean) -> None:
    assert {c.verdict for c in clean.checks if c.name != "saturation"} == {"ok"}


def test_hidden_events_are_estimated_from_the_loading_and_told_from_creep(clean) -> None:
    """Two of three sticks have a fall of 8 % of the drop at a random time; noise is 4 %."""
    rng = np.random.default_rng(0)
    slope, drop, small = 1e-4, 0.1, 0.008
    fall = drop * (1 + np.cos(np.pi * np.arange(1, 21) / 20)) / 2
    cycles = []
    for _ in range(80):
        stick = slope * np.arange(1000)
        if rng.random() < 2 / 3:
            stick = slope * np.arange(1080) - small * (np.arange(1080) > rng.integers(100, 980))
        cycles += [stick, fall]
    force = 0.3 + np.concatenate(cycles)
    force += 0.004 * rng.standard_normal(force.size)

    def hidden(result):
        return next(c for c in result.checks if c.name == "hidden events")

    result = measure_stick_slip(recorded(force))
    assert result.smallest_drop > small
    assert hidden(result).verdict == "suspicious"
    # Mean of the falls per stick, as a share of the drop.
    assert hidden(result).number == pytest.approx(2 / 3 * small / drop, abs=0.03)
    creeping = measure_stick_slip(recorded(saw(0, creep=0.1).force))
    assert hidden(clean).verdict == hidden(creeping).verdict == "ok"


def test_a_trend_or_a_single_slip_is_refused() -> None:
    noise = 0.002 * np.random.default_rng(0).standard_normal(20_000)
    trend = recorded(0.4 + np.linspace(0, 0.3, 20_000) + noise)
    assert measure_stick_slip(trend).kind == "cannot tell"
    with pytest.raises(InputError, match=r"rises by .* stick longer than the recording"):
        asp.measure(trend)
    with pytest.raises(InputError, match="1 event cannot tell"):
        asp.measure(recorded(saw(0, events=1).force))


def test_a_force_of_mean_zero_is_no_regime() -> None:
    force = np.repeat([-0.25, 0.25], 4000)
    assert measure_stick_slip(recorded(force)).kind == "cannot tell"
    assert measure_stick_slip(recorded(0 * force)).kind == "cannot tell"


def test_a_saturated_recording_is_named_and_its_noise_makes_no_events() -> None:
    friction = np.minimum(saw(0, events=50, noise=0.02).force, 0.32)
    result = measure_stick_slip(recorded(friction))
    assert len(result.events) == 50
    assert {c.name: c.verdict for c in result.checks}["saturation"] != "ok"


def test_uneven_sampling_is_resampled_and_a_gap_is_refused() -> None:
    truth = saw(0, noise=0.02, impulses=0.0)
    # Each sample is early or late by up to two fifths of the interval.
    jitter = np.random.default_rng(1).uniform(-2e-4, 2e-4, truth.time.size)
    when = np.sort(truth.time + jitter)
    force = np.interp(when, truth.time, truth.force)
    force[::250] += 0.06 * np.random.default_rng(3).standard_normal(force[::250].size)
    keep = np.random.default_rng(2).random(when.size) > 0.002
    trace = recorded(force)
    result = measure_stick_slip(
        Trace(when[keep], {"mu": replace(trace.channels["mu"], values=force[keep])})
    )
    assert len(result.events) == truth.onset.size
    assert np.mean(result.events.drop) == pytest.approx(np.mean(truth.drop), rel=5e-3)
    np.testing.assert_allclose(result.events.onset, truth.onset, atol=2e-3)
    gap = (truth.time < 10.0) | (truth.time > 10.01)
    with pytest.raises(InputError, match=r"without gaps of more than 4 samples .* at (10 s|9.9)"):
        measure_stick_slip(
            Trace(truth.time[gap], {"mu": replace(trace.channels["mu"], values=force[gap])})
        )


def test_slips_are_read_from_a_recorded_displacement() -> None:
    """A recorded displacement is preferred to the slip that follows from the stiffness."""
    truth = saw(0, events=60, noise=0.02)
    slips = 1e-5 * (1 + 0.3 * np.random.default_rng(3).standard_normal(60))
    position = np.zeros(truth.time.size)
    for onset, end, slip in zip(truth.onset, truth.end, slips, strict=True):
        u = np.clip((truth.time - onset) / (end - onset), 0, 1)
        position += slip * (1 - np.cos(np.pi * u)) / 2
    # The gauge counts backwards.
    gauge = -position + 5e-8 * np.random.default_rng(4).standard_normal(position.size)
    trace = recorded(truth.force)
    channels = {**trace.channels, "x": Channel(gauge, "length", "m", "displacement", "m")}
    result = measure_stick_slip(
        Trace(trace.time, channels, roles={"displacement": "x"}),
        stiffness=2e4,
        velocity=1e-5,
        normal_load=5.0,
    )
    np.testing.assert_allclose(result.slip, slips, atol=1.2e-7)
    # Half a cosine is steepest in its middle, pi/2 times its mean; the mean over a quarter of it is
    # 0.97 of that, and has noise of 1.3e-5 m/s in 5 samples.
    fastest = np.pi / 2 * slips / (truth.end - truth.onset)
    np.testing.assert_allclose(result.slip_velocity, fastest, rtol=0.1, atol=6e-5)


def test_a_force_over_the_weight_is_recognised_by_its_name() -> None:
    result = asp.measure(recorded(saw(0).force, name="Fnorm"), mass="30.7 g")
    assert result.machine.load == pytest.approx(0.0307 * 9.80665)
    with pytest.raises(InputError, match=r"columns=\{'friction': 'signal'\}"):
        asp.measure(recorded(saw(0).force, name="signal"))


def test_stick_slip_before_steady_sliding_is_recognised() -> None:
    force = saw(2, events=20, noise=0.02, impulses=0.0).force
    slides = steady(2 * force.size, level=force[-1], noise=0.002)
    result = asp.measure(recorded(np.r_[force, slides]))
    assert result.kind == "regular stick-slip, then steady sliding"
    assert len(result.events) == 20
    assert result.verdict == "ok"


@pytest.mark.parametrize("noise", population([0.1, 0.01]))
def test_noise_makes_no_slip_velocity(noise) -> None:
    truth = saw(3, events=100, noise=noise, impulses=0.0)
    result = asp.measure(recorded(truth.force), stick_slip=True)
    # Mean over the steepest quarter of half a cosine of 10 ms.
    steepest = 0.1 * np.pi / 2 / 0.01 * np.sin(np.pi / 8) / (np.pi / 8)
    assert np.mean(result.events.fall_rate) == pytest.approx(steepest, rel=0.04)


@pytest.mark.parametrize("amplitude", population([0.3, 0.0]))
def test_ringing_of_the_gauge_as_slow_as_the_slips_is_named(amplitude) -> None:
    truth = saw(1, events=60, slip=8, noise=0.02, ringing=amplitude)
    (check,) = (c for c in asp.measure(recorded(truth.force)).checks if c.name == "ringing")
    # Means over two samples of the ringing in the recording.
    j = np.arange(1, 25)
    ring = -amplitude * np.exp(-j / 20) * np.sin(2 * np.pi * j / 6)
    largest = np.abs(ring.reshape(-1, 2).mean(1)).max()
    assert check.number == pytest.approx(largest, abs=0.03)
    assert check.verdict == ("suspicious" if amplitude else "ok")


@pytest.mark.parametrize(
    ("sign", "zero", "sentence"),
    population(
        [
            (-1, 0.0, "with the opposite sign"),
            (1, -1.0, "zero of the gauge"),
            (-1, 1.0, "with the opposite sign"),
            (1, 0.0, None),
        ],
        short=2,
        several=True,
    ),
)
def test_sign_and_zero_of_the_gauge_change_no_drop(sign, zero, sentence) -> None:
    truth = saw(0, events=40, noise=0.01)
    result = asp.measure(recorded(sign * truth.force + zero))
    assert result.kind == "regular stick-slip"
    assert len(result.events) == 40
    assert np.mean(result.events.drop) == pytest.approx(0.1, rel=0.01)
    sentences = [check.sentence for check in result.checks if check.name == "sign"]
    assert (sentence is None) == (not sentences)
    assert all(sentence in text for text in sentences)
    assert result.verdict == ("ok" if sentence is None else "suspicious")


@pytest.mark.parametrize("ending", ["csv", "nc", "json"])
def test_the_catalogue_holds_every_event(ending, tmp_path, clean) -> None:
    path = tmp_path / f"events.{ending}"
    write_catalogue(clean, path)
    if ending == "csv":
        lines = path.read_text().splitlines()
        assert lines[0].startswith("onset (s),end (s)")
        rows = [line.split(",") for line in lines[1:]]
        drops = [float(row[list(COLUMNS).index("drop")]) for row in rows]
    elif ending == "nc":
        with xr.open_dataset(path, engine="h5netcdf") as table:
            drops = table["drop"].values.tolist()
            assert table["onset"].attrs["units"] == "s"
    else:
        record = json.loads(path.read_text())
        drops = [event["drop"] for event in record["events"]]
        # Without a stiffness there is no slip.
        assert record["events"][0]["slip"] is None
    assert drops == pytest.approx(clean.events.drop.tolist(), rel=1e-9)


def test_measured_slips_are_written_as_a_row_of_a_table(tmp_path, clean) -> None:
    path = asp.write([clean, clean], tmp_path / "rows.nc")
    with xr.open_dataset(path, engine="h5netcdf") as table:
        assert table["regime"].values.tolist() == ["regular stick-slip"] * 2
        assert table["drop"].values == pytest.approx(np.mean(clean.events.drop))


def test_a_catalogue_of_another_format_is_refused(tmp_path, clean) -> None:
    with pytest.raises(InputError, match="must be a CSV, NetCDF or JSON file"):
        write_catalogue(clean, tmp_path / "e.txt")


@pytest.mark.parametrize("drift", population([3.0, 0.0, -3.0]))
def test_the_loading_slope_holds_with_and_without_a_drifting_gauge(drift) -> None:
    """Drift cannot be told from friction along the track: half of the change is subtracted."""
    truth = saw(2, events=60, noise=0.02, spread=0.1)
    changed = truth.force + drift * 0.1 * np.linspace(0, 1, truth.force.size)
    result = measure_stick_slip(recorded(changed))
    slope, doubt = result.loading_slope, result.loading_slope_uncertainty
    assert abs(slope - truth.loading_slope[0]) < 1.96 * doubt
    assert doubt < 0.52 * abs(drift) / 60 * truth.loading_slope[0] + 0.005 * truth.loading_slope[0]


def test_healing_is_fitted_to_recordings_at_several_velocities() -> None:
    K, W0, B = 168.0, 0.301, 0.004
    V = np.geomspace(1e-6, 1e-3, 7)
    drop = healing_drop(0.05, B, 1.0, K=K, W0=W0, V=V)
    stick = drop * W0 / (K * V)
    noisy = drop + 1e-3 * np.random.default_rng(0).standard_normal(V.size)
    result = of_campaign(stick, noisy, np.full(V.size, 1e-4))
    assert not result.reason
    assert result.interval_95[0] < 2 * B < result.interval_95[1]
    # The uncertainty follows from the scatter of the drops, ten times what is stated for each.
    assert result.drop_uncertainty > 4e-4 / (np.std(np.log(stick)) * np.sqrt(V.size))
    # Limit cycles of K = Kc/2, M V^2 = A D0 W0, B = 2 A, and of K = Kc/20, B = 1.3 A.
    for factor in (1.275, 2.539):
        low, high = of_campaign(stick, 0.1 + factor * 0.01 * np.log(stick), 1e-6 + 0 * V).b_minus_a
        assert low < 0.01 < high
    assert "e-folds" in of_campaign(stick[:3] ** 0.01, drop[:3], np.full(3, 1e-4)).reason
    assert "too few" in of_campaign(stick[:2], drop[:2], np.full(2, 1e-4)).reason


def healing_row(V, K, W0, stick, drop, **others):
    row = {"regime": "regular stick-slip", "checks": "sampling: bad", "V": V, "K": K, "W0": W0}
    row |= {"stick_duration": stick, "drop": drop, "drop_uncertainty": 1e-4, "force_before": 0.5}
    return row | {"recurrence": stick, "recurrence_uncertainty": 0.0} | others


def test_healing_is_fitted_for_each_machine_of_a_campaign() -> None:
    W0, M, V = 5.0, 10.0, np.geomspace(1e-6, 3e-5, 3)
    rows = [
        healing_row(v, K, W0, stick, 0.05 + 0.024 * np.log(stick), M=M)
        for v in V
        for K in (12e3, 36e3)
        for stick in [0.5 / (K * v)]
    ]
    left_out = [
        healing_row(V[0], 12e3, W0, 1.0, 9.0, checks="drift: bad"),
        healing_row(V[0], 36e3, W0, 1.0, 9.0, regime="growing stick-slip"),
        healing_row(V[0], 156e3, W0, None, None, regime="steady sliding"),
        {"regime": None, "reason": "not measured"},
    ]
    campaign = StickSlipCampaign.of(rows + left_out)
    assert [series.K for series in campaign.series] == [12e3, 36e3, 156e3]
    for series in campaign.series[:2]:
        healing = series.healing()
        assert not healing.reason
        assert healing.recordings == V.size
        assert healing.drop_per_efold == pytest.approx(0.024)
        (low, high), condition = series.b_minus_a(healing)
        assert low < 0.012 < high
        # M V^2/W0 = 10 (3e-5)^2/5
        assert "A D0 above 1.8e-09 m" in condition
        heavy = StickSlipCampaign.of([row | {"M": 1e8} for row in series.rows]).series[0]
        (low, _), condition = heavy.b_minus_a(healing)
        assert np.isnan(low)
        assert "inertia counts" in condition
        unknown = StickSlipCampaign.of([row | {"M": None} for row in series.rows]).series[0]
        assert "M is not known" in unknown.b_minus_a(healing)[1]
    assert "0 recordings are too few" in campaign.series[2].healing().reason


@pytest.mark.long
def test_healing_of_cycles_of_a_law_is_that_of_its_parameters() -> None:
    W0, M, V = 5.0, 10.0, np.geomspace(1e-6, 3e-5, 3)
    law = laws.RiceRuina(mu0=0.4, V0=1e-6, A=0.015, B=0.027, D0=0.5e-6)
    slider = Slider(law, spring=np.array([[12e3], [36e3]]), load=W0, mass=M)
    cycles = stick_slip_response(slider, velocity=V)
    rows = [
        healing_row(V[j], K, W0, cycles.stick_duration[i, j], cycles.drop[i, j], M=M)
        for j in range(V.size)
        for i, K in enumerate((12e3, 36e3))
    ]
    campaign = StickSlipCampaign.of(rows)
    for series in campaign.series:
        healing = series.healing()
        # 2 (B - A): age and velocity at the onset scale with the drive, and slips overshoot.
        assert healing.drop_per_efold == pytest.approx(0.024, rel=0.15)
        (low, high), _ = series.b_minus_a(healing)
        assert low < 0.012 < high
    figure = replace(campaign, model=cycles, modelled=(0, 1)).plot()
    drops, times = figure.axes
    for axis, curves in ((drops, cycles.drop), (times, cycles.period)):
        lines = [
            line for line in axis.lines if line.get_linestyle() == "-" and line.get_xdata().size
        ]
        assert [line.get_ydata().tolist() for line in lines] == curves.tolist()


def events_of(drop, period) -> SlipEvents:
    """Events with these drops and recurrences, the only fields that are read."""
    fields = {f.name: np.zeros(drop.size) for f in dataclasses.fields(SlipEvents)}
    fields |= {"force_before": drop, "onset": np.cumsum(np.nan_to_num(period))}
    return SlipEvents(**fields | {"timing_uncertainty": 1e-3 * np.ones(drop.size)})


@pytest.mark.parametrize("sign", [1, -1])
def test_the_frequency_of_small_cycles_is_extrapolated_from_growing_and_dying_ones(sign) -> None:
    drop = (0.002 * 1.4 ** np.arange(7))[::sign]
    squares = (drop[1:] ** 2 + drop[:-1] ** 2) / 2
    frequency, error = linear_frequency(events_of(drop, np.r_[np.nan, 2 + 800 * squares]), 0.1)
    assert frequency == pytest.approx(0.5, rel=1e-9)
    assert 0 < error < 0.01


def test_short_cycles_of_irregular_slip_are_not_taken_for_small_oscillations() -> None:
    rng = np.random.default_rng(0)
    # Recurrence is drop over loading slope: the smaller the drop, the shorter.
    drops = 0.1 * np.exp(0.35 * rng.standard_normal((300, 60)))
    trains = [events_of(drop, np.r_[np.nan, drop[1:]]) for drop in drops]
    assert np.isfinite([linear_frequency(events, np.inf)[0] for events in trains]).sum() <= 3
    # A known loading slope shows that the slider rests in these cycles.
    assert not np.isfinite([linear_frequency(events, 1.0)[0] for events in trains]).any()
    # Cycles of one size do not show the period of smaller cycles.
    assert np.isnan(linear_frequency(events_of(np.full(20, 0.1), np.full(20, 0.3)), np.inf)[0])


def row(stiffness, regime, **more):
    regular = {"drop": 0.0, "recurrence": 0.0, "recurrence_uncertainty": 1e-3}
    return {"V": 1e-5, "K": stiffness, "W0": 1.0, "regime": regime, **regular, **more}


def test_the_frequency_at_the_threshold_is_extrapolated_to_cycles_without_drop() -> None:
    # Drops grow as at a supercritical Hopf bifurcation at 1000 1/m.
    rows = [row(1100.0, "steady sliding")]
    for stiffness in (700.0, 800.0, 900.0):
        square = 1e-4 * (1 - stiffness / 1000)
        period = (3 + 5000 * square) / np.sqrt(stiffness / 1000)
        rows.append(row(stiffness, "regular stick-slip", drop=np.sqrt(square), recurrence=period))
    (threshold,) = thresholds(rows)
    assert not threshold.reason
    limits = threshold.sticks_at, threshold.slides_at, threshold.K_over_W0
    assert limits == (900.0, 1100.0, 1000.0)
    assert abs(threshold.frequency - 1 / 3) < threshold.frequency_err < 0.1 / 3


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        ([row(1.0, "steady sliding"), row(2.0, "steady sliding")], "shows stick-slip"),
        ([row(1.0, "regular stick-slip")], "shows steady sliding"),
        ([row(1.0, "regular stick-slip"), row(3.0, "steady sliding")], "only known to lie"),
        ([row(1.0, "regular stick-slip"), row(1.2, "dying stick-slip")], "shows steady sliding"),
        ([row(1.0, "irregular stick-slip"), row(1.2, "steady sliding")], "no cycles near"),
        # Cycles with sticks, because K V/W0 is 1e-5 1/s.
        (
            [
                row(0.9, "regular stick-slip", drop=4e-5, recurrence=5.0),
                row(1.0, "regular stick-slip", drop=3e-5, recurrence=4.0),
                row(1.2, "steady sliding"),
            ],
            "no cycles near",
        ),
    ],
)
def test_a_threshold_that_is_not_bracketed_has_a_reason(rows, reason) -> None:
    (threshold,) = thresholds(rows)
    assert reason in threshold.reason


def test_a_stated_load_that_contradicts_the_recorded_one_is_refused() -> None:
    truth = saw(0, events=20, noise=0.01)
    trace = recorded(truth.force)
    load = Channel(np.full(truth.force.size, 5.0), "force", "N", "load", "N")
    trace = replace(trace, channels={**trace.channels, "load": load})
    assert measure_stick_slip(trace, normal_load=5.2).machine.load == 5.2
    with pytest.raises(InputError, match="normal_load must agree with the recorded load, 5 N"):
        measure_stick_slip(trace, normal_load=50.0)


@pytest.mark.parametrize("of_slider", [True, False])
def test_the_velocity_is_that_of_whole_cycles(of_slider) -> None:
    """A recording that ends within a stick, or before which the drive stands still."""
    truth, load, stiffness = saw(0, events=12, noise=0.003), 5.0, 2e4
    velocity = truth.loading_slope[0] * load / stiffness
    drive = velocity * truth.time
    force, moved = truth.force, drive - truth.force * load / stiffness
    if not of_slider:
        still = int(0.3 * force.size)
        noise = 1e-3 * np.ptp(force) * np.random.default_rng(1).standard_normal(still)
        force = np.concatenate([force[0] + noise, force])
        moved = np.concatenate([np.zeros(still), drive])
    moved = moved + 1e-9 * np.random.default_rng(2).standard_normal(moved.size)
    trace = recorded(force)
    channels = {**trace.channels, "x": Channel(moved, "length", "m", "displacement", "m")}
    trace = Trace(trace.time, channels, roles={"displacement": "x"})
    result = measure_stick_slip(trace, normal_load=load)
    # The displacement of a load point that moves evenly is no slip.
    assert (result.slip_share > 0.5) == of_slider == np.isfinite(result.slip).all()
    assert result.machine.velocity == pytest.approx(velocity, rel=1e-3)
