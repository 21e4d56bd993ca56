"""Traces: their checks name every planted defect with its size, and nothing else."""

from __future__ import annotations

import json

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.recording import (
    Channel,
    Finding,
    Trace,
    check,
    derive,
    stiffness_from_friction,
    stress_to_force,
)

N = 2000


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def trace_of(time, **channels):
    return Trace(time, {k: Channel(v, "force", "N", k, "N") for k, v in channels.items()})


def clean(rng):
    time = 5 + np.arange(N) / 1000
    load = 7 + 1.5 * np.sin(2 * np.pi * 120 * time) + 0.01 * rng.normal(size=N)
    return time, load


def findings_of(trace):
    return {f.name: f for f in check(trace)}


def test_nothing_is_found_in_a_clean_recording(rng):
    time, load = clean(rng)
    trace = trace_of(time, W=load)
    assert check(trace) == ()
    assert trace.sample_rate == pytest.approx(1000, rel=1e-9)


@pytest.mark.parametrize("decimals", [3, 4, 5, 6])
def test_time_stamps_with_few_decimals_are_even(decimals):
    """1/3 ms has infinitely many decimals; rounded to three, three stamps are equal.

    Rounding to 1 us is less than a hundredth of a step, and changes nothing.
    """
    time = np.round(np.arange(N) / 3000, decimals)
    assert list(findings_of(trace_of(time))) == ([] if decimals == 6 else ["rounded time"])
    assert trace_of(time).sample_rate == pytest.approx(3000, rel=1e-3)


def test_jitter_is_uneven_sampling_and_no_gap(rng):
    time, load = clean(rng)
    jitter = time + 1e-4 * rng.uniform(-1, 1, size=N)
    findings = findings_of(trace_of(jitter, W=load))
    assert list(findings) == ["uneven sampling"]
    steps = np.diff(jitter)
    median = np.median(steps)
    assert findings["uneven sampling"].number == pytest.approx(np.abs(steps / median - 1).max())
    assert trace_of(jitter).sample_rate is None


def test_a_change_of_the_rate_is_uneven_sampling_and_no_gap():
    time = np.concatenate([np.arange(300) * 0.1, 30 + np.arange(900) * 0.01])
    findings = findings_of(trace_of(time))
    assert list(findings) == ["uneven sampling"]
    assert findings["uneven sampling"].number == pytest.approx(9, rel=1e-6)


@pytest.mark.parametrize(("at", "missing"), [([1, 1998], 40), ([700, 703, 1500], 1)])
def test_gaps_are_counted_and_measured(rng, at, missing):
    time, load = clean(rng)
    shift = np.zeros(N)
    for row in at:
        shift[row:] += missing / 1000
    findings = findings_of(trace_of(time + shift, W=load))
    assert list(findings) == ["gap"]
    assert findings["gap"].number == pytest.approx(len(at) * missing / 1000, rel=1e-6)
    assert findings["gap"].sentence.startswith(f"{len(at)} gap")


def test_a_gap_at_a_change_of_the_rate_is_found():
    time = np.concatenate([np.arange(300) * 0.1, 31 + np.arange(900) * 0.01])
    findings = findings_of(trace_of(time))
    assert list(findings) == ["gap", "uneven sampling"]
    assert "row 299" in findings["gap"].where


def test_repeated_and_backward_times_are_found(rng):
    time, load = clean(rng)
    time[500] = time[499]
    time[900:] -= 0.25
    findings = findings_of(trace_of(time, W=load))
    assert (findings["repeated time"].number, findings["backward time"].number) == (1, 1)
    assert "row 500" in findings["repeated time"].where
    assert "row 900" in findings["backward time"].where
    assert findings["backward time"].severity == "error"
    assert "0.249" in findings["backward time"].sentence
    # The trace keeps the rows in their order.
    assert trace_of(time, W=load).time[900] < trace_of(time, W=load).time[899]


def test_missing_and_infinite_values_are_counted(rng):
    time, load = clean(rng)
    load[[3, 77, 1999]] = np.nan
    load[50] = np.inf
    findings = findings_of(trace_of(time, W=load))
    assert set(findings) == {"missing values", "infinite"}
    assert findings["missing values"].number == 3
    assert findings["missing values"].where == "W, row 3, t = 5.003 s"
    assert findings["infinite"].number == 1


def test_a_time_that_is_missing_is_an_error(rng):
    time, load = clean(rng)
    time[10] = np.nan
    findings = findings_of(trace_of(time, W=load))
    assert findings["missing values"].severity == "error"
    assert trace_of(time).sample_rate is None


def test_a_channel_without_any_value_is_an_error(rng):
    time, _ = clean(rng)
    findings = findings_of(trace_of(time, W=np.full(N, np.nan)))
    assert list(findings) == ["missing values"]
    assert findings["missing values"].severity == "error"


@pytest.mark.parametrize(("side", "rate"), [(1, 1.0), (-1, 12.3), (1, 120.0)])
def test_saturation_is_found_at_any_frequency(rng, side, rate):
    time = np.arange(N) / 1000
    force = side * np.minimum(np.sin(2 * np.pi * rate * time) + 0.01 * rng.normal(size=N), 0.8)
    findings = findings_of(trace_of(time, F=force))
    assert list(findings) == ["saturation"]
    share = np.mean(force == side * 0.8)
    assert findings["saturation"].number == pytest.approx(share)
    assert ("largest" if side > 0 else "smallest") in findings["saturation"].sentence


@pytest.mark.parametrize(("step", "rate"), [(1e-4, 0.5), (1e-2, 3.0), (0.1, 50.0), (1e-3, 120.0)])
def test_quantisation_is_no_saturation(step, rate):
    time = np.arange(20_000) / 1000
    force = np.round(np.sin(2 * np.pi * rate * time) / step) * step
    assert "saturation" not in findings_of(trace_of(time, F=force))


@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_a_top_as_flat_as_a_fourth_power_is_no_saturation(step):
    """cos x - cos(2x)/4 has neither slope nor curvature at its top."""
    phase = np.linspace(-3, 3, 20_000)
    force = np.round((np.cos(phase) - np.cos(2 * phase) / 4) / step) * step
    assert "saturation" not in findings_of(trace_of(np.arange(phase.size) / 1000, F=force))


def test_noise_on_a_coarse_converter_is_no_saturation(rng):
    time = np.arange(20_000) / 1000
    force = np.round(rng.normal(size=time.size) * 5)
    assert findings_of(trace_of(time, F=force)) == {}


def test_a_dead_channel_is_constant(rng):
    time, _ = clean(rng)
    findings = findings_of(trace_of(time, W=np.full(N, 3.5)))
    assert list(findings) == ["constant"]
    assert findings["constant"].number == 3.5


def test_a_channel_is_found_by_name_by_heading_and_by_role(rng):
    time, load = clean(rng)
    channels = {
        "Normal load": Channel(load, "force", "N", "Normal load [kN]", "kN"),
        "Tangential": Channel(load / 2, "force", "N"),
        "Vertical displacement": Channel(load * 1e-6, "length", "m"),
        "LP displacement": Channel(load * 2e-6, "length", "m"),
    }
    trace = Trace(time, channels)
    for name in ("Normal load", "normal LOAD", "Normal load [kN]", "W", "load", "normal force"):
        assert trace.channel(name).recorded_unit == "kN"
    assert np.array_equal(trace.channel("F").values, load / 2)
    ambiguous = r"'Vertical displacement' or 'LP displacement'; choose when reading, like columns="
    with pytest.raises(InputError, match=ambiguous):
        trace.channel("displacement")
    chosen = Trace(time, channels, roles={"displacement": "LP displacement"})
    assert np.array_equal(chosen.channel("slip").values, load * 2e-6)
    with pytest.raises(InputError, match="no column named like a friction coefficient; "):
        trace.channel("friction")


@pytest.mark.parametrize(
    ("role", "name", "kind", "fits"),
    [
        ("W", "Fn", "force", True),
        ("W", "Normal_stress", "pressure", True),
        ("W", "NormalStress", None, True),
        ("W", "EffectiveNormalstress", "pressure", True),
        ("W", "Nor_stress", "pressure", True),
        ("W", "Normal displacement", None, False),
        ("W", "Load point displacement", "length", False),
        ("W", "Pressure", "pressure", True),
        ("F", "Shr_stress", "pressure", True),
        ("F", "Friction force", "force", True),
        ("F", "Friction", "dimensionless", False),
        ("F", "Shear displacement", "length", False),
        ("friction", "mu", None, True),
        ("friction", "Friction", "dimensionless", True),
        ("friction", "Friction force", "force", False),
        ("velocity", "Slip rate", "velocity", True),
        ("velocity", "V", "force", False),
        ("displacement", "LP_disp", "length", True),
        ("displacement", "Displ", "length", True),
        ("displacement", "Slip velocity", None, False),
    ],
)
def test_roles_are_recognised_from_names_of_laboratories(role, name, kind, fits):
    trace = Trace(np.arange(3.0), {name: Channel(np.arange(3.0), kind)})
    if fits:
        assert trace.channel(role) is trace.channels[name]
    else:
        with pytest.raises(InputError):
            trace.channel(role)


def test_a_slice_is_half_open_and_checked_anew(rng):
    time, load = clean(rng)
    load[1500] = np.nan
    whole = trace_of(time, W=load)
    truncated = Finding("truncated", "error", 1.0, "row 2000", "cut")
    whole = Trace(time, whole.channels, (truncated, *check(whole)))
    first = whole.slice(end="6 s")
    assert first.time[-1] == time[999]
    assert len(first) == 1000
    assert [f.name for f in first.findings] == ["truncated"]
    assert [f.name for f in whole.slice("6 s").findings] == ["truncated", "missing values"]
    assert np.array_equal(whole.slice(5.5, 6).channels["W"].values, load[500:1000])
    with pytest.raises(InputError, match=r"must enclose samples.* runs from 5 s to 6.999 s"):
        whole.slice(10, 11)


def test_channels_convert_to_other_units():
    channel = Channel(np.array([1.5e6]), "pressure", "Pa", "sigma", "MPa")
    assert channel.to("MPa") == 1.5
    with pytest.raises(InputError, match="must be known to be converted, got 'V'"):
        Channel(np.array([1.0]), None, "", "gauge", "V").to("N")


def test_the_dataset_carries_units_findings_and_provenance(rng):
    time, load = clean(rng)
    load[5] = np.nan
    trace = trace_of(time, W=load)
    trace = Trace(time, trace.channels, check(trace), {"file": "x.csv"})
    data = trace.to_dataset()
    assert data.W.attrs["units"] == "N"
    assert data.time.attrs["units"] == "s"
    assert np.array_equal(data.W.values, load, equal_nan=True)
    assert "missing values (W, row 5" in data.attrs["findings"]
    assert json.loads(data.attrs["provenance"]) == {"file": "x.csv"}


def test_a_trace_is_read_only_and_leaves_the_callers_array_alone(rng):
    time, load = clean(rng)
    trace = trace_of(time, W=load)
    with pytest.raises(ValueError, match="read-only"):
        trace.channels["W"].values[0] = 0
    load[0] = 1.0
    assert load[0] == 1.0


def test_channels_of_another_length_or_shape_are_refused():
    with pytest.raises(InputError, match="as long as time, got 3 values of 'W' for 4 times"):
        trace_of(np.arange(4.0), W=np.arange(3.0))
    with pytest.raises(InputError, match=r"Channel.values must have one dimension, got 2"):
        Channel(np.zeros((2, 2)))


def test_a_unit_in_place_of_a_kind_is_refused():
    message = "Channel.kind must be a kind of quantity, got 'N'; choose one of "
    with pytest.raises(InputError, match=message):
        Channel([1.0, 2.0], "N")


@pytest.fixture
def rock():
    channels = {
        "Displ": Channel(np.arange(4) * 1e-6, "length", "m", "Displ(microns)", "microns"),
        "Friction": Channel(np.array([0.6, 0.61, 0.62, 0.6]), "dimensionless", "", "Friction"),
        "Normal_stress": Channel(np.full(4, 20e6), "pressure", "Pa", "Normal_stress(MPa)", "MPa"),
    }
    return Trace(np.arange(4.0), channels, provenance={"file": "x"})


def test_stresses_become_forces_only_with_an_area(rock):
    forces = stress_to_force(rock, "25 cm^2")
    assert rock.channel("W").kind == "pressure"
    assert forces.channel("W").kind == "force"
    # 20 MPa on 25 cm^2 is 50 kN.
    assert np.allclose(forces.channel("W").to("kN"), 50, rtol=1e-15)
    assert forces.provenance["area (m^2)"] == pytest.approx(25e-4)
    assert forces.channel("Displ") is rock.channel("Displ")
    with pytest.raises(InputError, match="go with a stress, got a recording without"):
        stress_to_force(forces, 1.0)
    with pytest.raises(InputError, match="area must be positive"):
        stress_to_force(rock, 0.0)


def test_friction_times_load_is_a_force(rock):
    derived = derive(rock, {"force": "friction * load"})
    assert np.allclose(derived.channel("F").to("MPa"), [12, 12.2, 12.4, 12], rtol=1e-15)
    assert derived.provenance["derived channels"] == {"force": "friction * load"}


@pytest.mark.parametrize("text", ["1e-3 /um", "1e-3 1/um", "1e-3 friction/um", "1 /mm", 1000.0])
def test_a_stiffness_in_friction_per_length_is_converted(text):
    assert stiffness_from_friction(text, "7 N") == pytest.approx(7000, rel=1e-15)
    assert stiffness_from_friction(text, "20 MPa") == pytest.approx(20e9, rel=1e-15)


@pytest.mark.parametrize(("k", "load"), [("1 N/um", "7 N"), ("1e-3 um", 7.0), ("-1 /um", 7.0)])
def test_a_stiffness_of_another_dimension_or_sign_is_refused(k, load):
    with pytest.raises(InputError, match="stiffness_from_friction"):
        stiffness_from_friction(k, load)
