"""Columns, units and roles: how they are recognised, and what the user may choose."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.recording import read
from asperity.recording.readers.units import split_labels


@pytest.fixture
def recording(tmp_path):
    def write(head, *rows):
        path = tmp_path / "recording.csv"
        path.write_text("\n".join([head, *rows]) + "\n")
        return path

    return write


ROWS = ("0,1,2,3", "1,2,3,5", "2,4,4,4", "3,3,5,1")


def names(trace):
    return [f.name for f in trace.findings]


@pytest.mark.parametrize(
    ("label", "name", "unit"),
    [
        ("Force [N]", "Force", "N"),
        ("Displ(microns)", "Displ", "microns"),
        ("v/(um/s)", "v", "um/s"),
        ("v/um/s", "v", "um/s"),
        ("velocity_um_s", "velocity", "um/s"),
        ("time_s", "time", "s"),
        ("x_m", "x", "m"),
        ("V (um s^-1)", "V", "um s^-1"),
        ("mu [-]", "mu", "-"),
        ("Signal (V)", "Signal", "V"),
        ("Load, kN", "Load", "kN"),
        ("disp in mm", "disp", "mm"),
        ("dW/dt", "dW/dt", ""),
        ("F/W", "F/W", ""),
        ("mu_s", "mu_s", ""),
        ("theta_ss", "theta_ss", ""),
        ("D_c", "D_c", ""),
        ("sigma_n", "sigma_n", ""),
        ("x_1", "x_1", ""),
    ],
)
def test_headings_are_split_into_name_and_unit(label, name, unit):
    assert split_labels([label]) == [(name, unit)]


def test_an_index_n_next_to_another_index_is_no_newton():
    assert split_labels(["t_s", "F_N", "F_T"]) == [("t", "s"), ("F_N", ""), ("F_T", "")]
    assert split_labels(["t_s", "F_N", "W_N"]) == [("t", "s"), ("F", "N"), ("W", "N")]


@pytest.mark.parametrize(
    ("unit", "kind", "si"),
    [
        ("microns", "length", 1e-6),
        ("mic", "length", 1e-6),
        ("inch", "length", 0.0254),
        ("MPa", "pressure", 1e6),
        ("mPa", "pressure", 1e-3),
        ("mpa", "pressure", 1e6),
        ("psi", "pressure", 6894.757293168361),
        ("kgf", "force", 9.80665),
        ("KN", "force", 1e3),
        ("mN", "force", 1e-3),
        ("MN", "force", 1e6),
        ("um/sec", "velocity", 1e-6),
        ("mm/min", "velocity", 1e-3 / 60),
        ("N/mm", "stiffness", 1e3),
        ("%", "dimensionless", 0.01),
        (".", "dimensionless", 1.0),
        ("kHz", "frequency", 1e3),
        ("d", "time", 86400.0),
    ],
)
def test_units_are_read_as_laboratories_write_them(recording, unit, kind, si):
    trace = read(recording(f"time_s,a ({unit}),b (s),c (-)", *ROWS))
    channel = trace.channels["a"]
    assert channel.kind == kind
    assert np.allclose(channel.values, np.array([1, 2, 4, 3]) * si, rtol=1e-15)
    assert (channel.recorded_unit, channel.recorded_name) == (unit, f"a ({unit})")


@pytest.mark.parametrize("unit", ["V", "counts", "deg", "°C", "MPa/s", "t"])
def test_an_unknown_unit_leaves_the_values_and_is_named(recording, unit):
    trace = read(recording(f"time_s,a ({unit}),b (s),c (-)", *ROWS))
    assert names(trace) == ["unknown unit"]
    assert trace.channels["a"].kind is None
    assert trace.channels["a"].unit == ""
    assert np.array_equal(trace.channels["a"].values, [1, 2, 4, 3])
    known = read(recording(f"time_s,a ({unit}),b (s),c (-)", *ROWS), units={"a": "-2.5 kN"})
    assert known.findings == ()
    assert np.array_equal(known.channels["a"].values, [-2500, -5000, -10000, -7500])


def test_units_are_given_by_name_by_heading_and_by_role(recording):
    path = recording("t,Load,Shear (V),Displ", *ROWS)
    trace = read(
        path,
        columns={"F": "Shear"},
        units={"t": "ms", "W": "kN", "Shear (V)": "3 N", "displacement": "um"},
    )
    assert trace.findings == ()
    assert np.allclose(trace.time, [0, 1e-3, 2e-3, 3e-3], rtol=1e-15)
    assert np.array_equal(trace.channel("W").values, [1e3, 2e3, 4e3, 3e3])
    assert np.array_equal(trace.channel("shear force").values, [6, 9, 12, 15])
    assert np.allclose(trace.channel("slip").values, [3e-6, 5e-6, 4e-6, 1e-6], rtol=1e-15)


def test_a_unit_of_the_user_overrides_that_of_the_file_and_is_named(recording):
    trace = read(recording("time_s,W_N,F_N,x_um", *ROWS), units={"W": "kN"})
    assert names(trace) == ["unit overridden"]
    assert trace.channel("W").values[0] == 1000


def test_a_row_of_units_that_contradicts_the_headings_is_refused(recording):
    path = recording("t (s),load (kN),shear (N),x", "sec,N,N,um", *ROWS)
    with pytest.raises(InputError, match=r"units\['load'\] must be one unit, got 'kN' in the head"):
        read(path)
    assert read(path, units={"load": "kN"}).channel("W").values[0] == 1000


def test_an_index_n_above_another_unit_is_no_newton(recording):
    trace = read(recording("time_s,F_N,F/N,x_um", "s,kN,-,um", *ROWS))
    assert list(trace.channels) == ["F_N", "F/N", "x"]
    assert trace.channel("W").values[0] == 1000


def test_ambiguous_columns_are_refused_until_the_user_chooses(recording):
    path = recording("time_s,Shear left (N),Shear right (N),W_N", *ROWS)
    with pytest.raises(InputError, match=r"'Shear left' or 'Shear right'; choose when reading"):
        read(path).channel("F")
    with pytest.raises(InputError, match=r"be a column of its own, got 'Shear left', which is F"):
        read(path, columns={"F": "Shear left", "friction": 1})
    for choice in ("Shear right", "Shear right (N)", "shear RIGHT", 2):
        trace = read(path, columns={"F": choice})
        assert trace.channel("F").recorded_name == "Shear right (N)"
    two = recording("time 1 (s),time 2 (s),W_N,F_N", *ROWS)
    with pytest.raises(InputError, match=r"'time 1' and 'time 2', which both can be it"):
        read(two)
    assert np.array_equal(read(two, columns={"time": "time 2"}).time, [1, 2, 4, 3])


def test_a_rate_of_the_user_overrides_the_times_of_the_file(recording):
    trace = read(recording("time_s,W_N,F_N,x_um", *ROWS), rate="4 Hz")
    assert np.array_equal(trace.time, [0, 0.25, 0.5, 0.75])
    assert "time" in trace.channels
    assert trace.provenance["time"] == "rate of 4 Hz, as asked"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"columns": {"F": "x"}}, r"columns\['F'\] must be a .*force.*, got 'x', a length"),
        ({"columns": {"time": "W"}}, r"columns\['time'\] must be a time, got 'W', a force"),
        ({"columns": {"F": "Sheer"}}, r"columns\['F'\] must be a column, got 'Sheer'"),
        ({"columns": {"F": 4}}, r"columns\['F'\] must be a column, got 4; .* 0 to 3"),
        ({"columns": {"torque": 1}}, r"columns must name roles, got 'torque'"),
        ({"units": {"W": "apples"}}, r"units\['W'\] must be a unit, got 'apples'"),
        ({"units": {"Y": "N"}}, r"units must name a channel, got none like 'Y'"),
        ({"rate": 0.0}, r"read\.rate must be positive"),
        ({"rate": "10 rpm"}, r"read\.rate must be"),
    ],
)
def test_a_wrong_option_is_refused_in_one_sentence(recording, options, message):
    path = recording("time_s,W_N,F_N,x_um", *ROWS)
    with pytest.raises(InputError, match=message) as refused:
        read(path, **options)
    assert str(refused.value).count(". ") == 0


def test_two_columns_of_one_name_stay_apart(recording):
    trace = read(recording("time_s,Force (N),Force (N),W_N", *ROWS))
    assert list(trace.channels) == ["Force", "Force (2)", "W"]
    assert names(trace) == ["repeated name"]
    assert np.array_equal(trace.channels["Force (2)"].values, [2, 3, 4, 5])


def test_conversion_is_rounded_once(recording):
    """3 um is the double nearest to 3e-6; 3 times the double nearest to 1e-6 is another one."""
    rows = [f"{i},{i},{i},{i}" for i in range(1, 60)]
    trace = read(recording("time_s,x_um,delay_ms,p_MPa", *rows))
    for name, power in (("x", -6), ("delay", -3), ("p", 6)):
        expected = [float(f"{i}e{power}") for i in range(1, 60)]
        assert np.array_equal(trace.channels[name].values, expected)


@pytest.mark.parametrize("code", ["-9999", "-999.25", "9999.99", "99999"])
def test_codes_for_missing_values_become_missing(recording, code):
    rows = [f"{0.1 * k:.1f},{4 + 0.01 * (k % 3)},{7 + 0.02 * (k % 2)}" for k in range(40)]
    whole = read(recording("time (s),Ft (N),Fn (N)", *rows))
    for k in (10, 11, 12, 30):
        rows[k] = f"{0.1 * k:.1f},{4 + 0.01 * (k % 3)},{code}"
    trace = read(recording("time (s),Ft (N),Fn (N)", *rows))
    assert names(trace) == ["missing code", "missing values"]
    assert trace.findings[0].number == 4
    expected = whole.channels["Fn"].values.copy()
    expected[[10, 11, 12, 30]] = np.nan
    np.testing.assert_array_equal(trace.channels["Fn"].values, expected)


@pytest.mark.parametrize(
    "values",
    [
        [1000, 1001, 999, 1000, 1002],  # nines among readings of their size
        [0, 1500, 300, -999, 700],  # no further from the others than they are from zero
        [0.6, 0.61, -5000, 0.6, 0.61],  # far off, but no nines
    ],
)
def test_nines_among_values_of_their_size_are_kept(recording, values):
    rows = [f"{0.1 * k:.1f},{v}" for k, v in enumerate(8 * values)]
    trace = read(recording("time (s),Fn (N)", *rows))
    assert "missing code" not in names(trace)
    np.testing.assert_array_equal(trace.channels["Fn"].values, 8 * values)
