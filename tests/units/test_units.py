"""Units at the door: what is read, exactly; what is refused, and how."""

import math
import re
from decimal import Decimal

import jax
import jax.numpy as jnp
import numpy as np
import pint
import pytest
import xarray as xr
from hypothesis import given, strategies as st

from asperity.errors import InputError
from asperity.units import KINDS, format_si, from_si, to_radians, to_si
from asperity.units.scale import base_units, kind_of_dimension

RUNGS = [(kind, unit, power) for kind, k in KINDS.items() for unit, power in k.ladder]
finite = st.floats(min_value=1e-200, max_value=1e200)

#: ``<object>.<field> must <rule>, got <value>; <what to do>``
SENTENCE = re.compile(r"slider\.x must [^;]+, got [^;]+; [^;]+")


def refusal(value: object, kind: str, **options: bool) -> str:
    """The message of a refusal, checked for its form."""
    with pytest.raises(InputError) as caught:
        to_si(value, kind, "slider.x", **options)
    message = str(caught.value)
    assert SENTENCE.fullmatch(message), message
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    ("text", "kind", "si"),
    [
        ("1 um/s", "velocity", 1e-6),
        ("1e-05 m/s", "velocity", 1e-5),
        ("0.4 um", "length", 4e-7),
        ("0.4um", "length", 4e-7),
        ("0.4 \u00b5m", "length", 4e-7),
        ("0.4 \u03bcm", "length", 4e-7),
        ("0.4 micron", "length", 4e-7),
        ("0.4 microns", "length", 4e-7),
        (" +.4e0  um ", "length", 4e-7),
        ("0.2 N/um", "stiffness", 2e5),
        ("0.2 N/\u00b5m", "stiffness", 2e5),
        ("7 N", "force", 7.0),
        ("300 mN", "force", 0.3),
        ("2 kgf", "force", 19.6133),
        ("1.6 kg", "mass", 1.6),
        ("120 Hz", "frequency", 120.0),
        ("0.12 kHz", "frequency", 120.0),
        ("22.4 uHz", "frequency", 22.4e-6),
        ("5 kPa", "pressure", 5e3),
        ("1 mbar", "pressure", 100.0),
        ("1 atm", "pressure", 101325.0),
        ("10 uPa s", "viscosity", 1e-5),
        ("10 uPa*s", "viscosity", 1e-5),
        ("49 cm^2", "area", 4.9e-3),
        ("49 cm\u00b2", "area", 4.9e-3),
        ("2 hour", "time", 7200.0),
        ("300 K", "temperature", 300.0),
        ("24 %", "dimensionless", 0.24),
        ("24%", "dimensionless", 0.24),
        ("24 percent", "dimensionless", 0.24),
        ("13000 ppm", "dimensionless", 0.013),
        ("0.24", "dimensionless", 0.24),
        ("360 rad/s", "angular_frequency", 360.0),
        ("25 1/s", "angular_frequency", 25.0),
    ],
)
def test_lab_spellings(text: str, kind: str, si: float) -> None:
    assert to_si(text, kind, "slider.x") == si


def test_rpm_is_an_angular_frequency_and_carries_its_two_pi() -> None:
    assert to_si("60 rpm", "angular_frequency", "slider.x") == pytest.approx(2 * math.pi, rel=1e-15)


@pytest.fixture(scope="module")
def exact() -> pint.UnitRegistry:
    """Units with decimal ratios."""
    return pint.UnitRegistry(non_int_type=Decimal)


@pytest.mark.parametrize(("kind", "unit", "power"), RUNGS)
def test_the_units_known_without_pint_are_pints(
    kind: str, unit: str, power: int, exact: pint.UnitRegistry
) -> None:
    ratio = exact.Quantity(Decimal(1), unit).to(KINDS[kind].si).magnitude
    assert ratio == Decimal(1).scaleb(power)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_accepts_its_own_example(kind: str) -> None:
    assert to_si(KINDS[kind].example, kind, "slider.x") > 0


@given(number=finite, rung=st.sampled_from(RUNGS))
def test_text_is_read_to_the_nearest_double(number: float, rung: tuple[str, str, int]) -> None:
    kind, unit, power = rung
    expected = float(Decimal(repr(number)).scaleb(power))
    assert to_si(f"{number!r} {unit}", kind, "slider.x") == expected


@given(value=finite, rung=st.sampled_from(RUNGS))
def test_to_a_unit_and_back(value: float, rung: tuple[str, str, int]) -> None:
    kind, unit, _ = rung
    # Two roundings to a double and two to its shortest decimal, each of half a unit of the last
    # place.
    shown = from_si(value, unit, kind)
    assert to_si(f"{shown!r} {unit}", kind, "slider.x") == pytest.approx(value, rel=4.5e-16)


@given(value=st.floats(min_value=1e-15, max_value=1e12), kind=st.sampled_from(list(KINDS)))
def test_formatted_text_reads_back(value: float, kind: str) -> None:
    text = format_si(value, kind, digits=6)
    assert to_si(text, kind, "slider.x") == pytest.approx(value, rel=5.1e-6)


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (4e-7, "length", "400 nm"),
        (1e-6, "velocity", "1 um/s"),
        (0.99999e-6, "velocity", "1 um/s"),
        (-2.5e-6, "velocity", "-2.5 um/s"),
        (2e5, "stiffness", "200 N/mm"),
        (120.0, "frequency", "120 Hz"),
        (0.0, "force", "0 N"),
        (1e-20, "length", "1e-08 pm"),
        (0.013, "dimensionless", "0.013"),
        (math.inf, "force", "inf N"),
    ],
)
def test_readable_text(value: float, kind: str, text: str) -> None:
    assert format_si(value, kind) == text


def test_from_si_is_exact_in_decimal_and_keeps_arrays() -> None:
    assert from_si(4e-7, "um", "length") == 0.4
    np.testing.assert_array_equal(from_si(np.array([1e-6, 1e-5]), "um/s", "velocity"), [1.0, 10.0])
    np.testing.assert_array_equal(from_si(np.array([2e5]), "N/um", "stiffness"), [0.2])


def test_from_si_refuses_a_unit_of_another_kind() -> None:
    with pytest.raises(InputError, match="unit must be a length"):
        from_si(1.0, "N", "length")


@pytest.mark.parametrize("text", ["120 rad/s", "120 rpm", "120 1/s", "120 s^-1", "120 turn/s"])
def test_angular_frequencies_are_refused_where_hertz_is_meant(text: str) -> None:
    assert "give omega/(2 pi) in Hz" in refusal(text, "frequency")


@pytest.mark.parametrize("text", ["12.42 h", "5 ms", "1 day"])
def test_periods_are_refused_where_hertz_is_meant(text: str) -> None:
    assert "a period; give 1 over it in Hz, like '22.4 uHz' for 12.4 h" in refusal(
        text, "frequency"
    )


def test_hertz_is_refused_where_an_angular_frequency_is_meant() -> None:
    assert "multiply by 2 pi" in refusal("120 Hz", "angular_frequency")


@pytest.mark.parametrize(
    ("text", "kind", "expected", "example"),
    [
        ("1 um", "velocity", "a velocity (m/s)", "1 um/s"),
        ("7 kg", "force", "a force (N)", "7 N"),
        ("0.2 N m", "stiffness", "a stiffness (N/m)", "0.2 N/um"),
        ("24 deg", "dimensionless", "a pure number", "0.24"),
        ("1 N", "dimensionless", "a pure number", "0.24"),
        ("2 Hz*Hz", "frequency", "a frequency (Hz)", "120 Hz"),
        ("20 degC", "temperature", "a temperature (K)", "300 K"),
        ("3 dB", "dimensionless", "a pure number", "0.24"),
    ],
)
def test_the_wrong_dimension_is_told_with_the_right_one(
    text: str, kind: str, expected: str, example: str
) -> None:
    message = refusal(text, kind)
    assert f"must be {expected}, got '{text}'" in message
    assert message.endswith(f"like '{example}'")


@pytest.mark.parametrize(
    "text",
    [
        *("nan N", "inf N", "-inf N", "1e999 N", "1e-999 N", "1.2.3 N", "1,5 N", "1 2 N"),
        *("", " ", "N", "seven N", "1 hz", "7 newtonz", "7 N+1", "7 N/(m", "7 " + "N*" * 40),
        "7 __import__('os')",
    ],
)
def test_what_is_no_force_is_refused(text: str) -> None:
    assert "'7 N'" in refusal(text, "force")


def test_bare_numbers_as_text_are_refused() -> None:
    assert "must carry a unit, got '1.5'" in refusal("1.5", "velocity")


def test_pure_numbers_need_no_unit() -> None:
    assert to_si("0.24", "dimensionless", "slider.x") == to_si(0.24, "dimensionless", "x") == 0.24


@pytest.mark.parametrize("value", [math.nan, math.inf, np.array([1.0, np.nan]), [1.0, -math.inf]])
def test_numbers_must_be_finite(value: object) -> None:
    assert "must be finite" in refusal(value, "force")


@pytest.mark.parametrize("value", [True, None, 1j, {}, np.array([True]), np.array(["2020"], "M8")])
def test_other_types_are_refused(value: object) -> None:
    assert "must be a force, got" in refusal(value, "force")


def test_numbers_are_si_and_become_floats() -> None:
    for value in (7, 7.0, np.float32(7), np.int64(7)):
        converted = to_si(value, "force", "slider.x")
        assert converted == 7.0
        assert type(converted) is float


def test_arrays_keep_shape_and_type() -> None:
    grid = np.arange(6).reshape(2, 3)
    assert to_si(grid, "force", "slider.x").dtype == float
    np.testing.assert_array_equal(to_si(grid, "force", "slider.x"), grid)
    assert isinstance(to_si(jnp.ones(2), "force", "slider.x"), jax.Array)
    labelled = xr.DataArray([1.0, 2.0], dims="V", coords={"V": [1, 2]})
    xr.testing.assert_identical(to_si(labelled, "force", "slider.x"), labelled)


def test_sequences_of_texts_are_arrays() -> None:
    expected = [[1e-6, 1e-5], [1e-3, 2.0]]
    nested = [["1 um/s", "10 um/s"], ["1 mm/s", 2]]
    np.testing.assert_array_equal(to_si(nested, "velocity", "slider.x"), expected)
    texts = np.array(nested[0])
    np.testing.assert_array_equal(to_si(texts, "velocity", "slider.x"), expected[0])
    np.testing.assert_array_equal(
        to_si(np.array(nested, dtype=object), "velocity", "slider.x"), expected
    )
    assert "rows of different lengths" in refusal([["1 m/s"], ["1 m/s", "2 m/s"]], "velocity")


def test_traced_values_pass_through() -> None:
    slope = jax.grad(lambda force: to_si(force, "force", "slider.x") ** 2)(3.0)
    assert slope == 6.0


def test_an_unknown_kind_is_told() -> None:
    with pytest.raises(InputError, match="did you mean 'velocity'"):
        to_si(1.0, "velocty", "slider.x")


# --- Numbers beyond doubles --------------------------------------------------------------------


def exponents(seed: int, count: int) -> list[int]:
    """Powers of ten far beyond doubles, some beyond decimals, of either sign."""
    draw = np.random.default_rng(seed)
    figures = draw.integers(3, 25, count)
    sizes = [int("4" + "".join(map(str, draw.integers(0, 10, n - 1)))) for n in figures]
    signs = draw.choice([-1, 1], count).tolist()
    return [size * sign for size, sign in zip(sizes, signs, strict=True)]


@pytest.mark.parametrize("kind", ["dimensionless", "velocity"])
def test_numbers_beyond_doubles_are_refused_in_a_sentence(kind: str) -> None:
    unit = KINDS[kind].si
    for exponent in exponents(sum(map(ord, kind)), 40):
        for text in (f"1e{exponent} {unit}", f"-7.5E{exponent:+d} {unit}"):
            with pytest.raises(InputError, match="must lie within the range of double precision"):
                to_si(text, kind, "thing.size")
        # Zero is zero, whatever its power.
        assert to_si(f"0e{exponent} {unit}", kind, "thing.size") == 0


@pytest.mark.parametrize(
    "value",
    ["1e" + "9" * 5000 + " m/s", "1 um^999999999999/s", "1 um^99999999 m^-99999998/s", 10**4000],
)
def test_what_no_decimal_can_hold_is_refused_in_a_short_sentence(value) -> None:
    with pytest.raises(InputError, match=r"^velocity must ") as caught:
        to_si(value, "velocity", "velocity")
    assert len(str(caught.value)) < 250


def test_a_power_that_the_figures_undo_is_a_number() -> None:
    assert to_si("0." + "0" * 400 + "1e401 m/s", "velocity", "velocity") == 1.0
    assert to_si("1" + "0" * 400 + "e-400 m/s", "velocity", "velocity") == 1.0


@pytest.mark.parametrize(
    ("angle", "radians"),
    [("180 deg", math.pi), ("-90°", -math.pi / 2), ("0.5 rad", 0.5), ("20 mrad", 0.02), ("1", 1)],
)
def test_angles(angle: str, radians: float) -> None:
    assert to_radians(angle, "tilt") == pytest.approx(radians, rel=1e-15)


def test_numbers_are_radians_as_they_are() -> None:
    phases = np.array([0.1, 2.0])
    assert to_radians(phases, "phase") is phases


@pytest.mark.parametrize("angle", ["5 turns", "deg", "nan deg", "1 um", ""])
def test_what_is_no_angle(angle: str) -> None:
    with pytest.raises(InputError, match="tilt must be an angle in rad or deg"):
        to_radians(angle, "tilt")


@pytest.mark.parametrize("text", ["1e-320 m", "2.2e-308 m", "-1e-303 um"])
def test_a_number_with_too_few_digits_is_refused(text: str) -> None:
    """Of doubles below the smallest normal one some have an infinite reciprocal."""
    with pytest.raises(InputError, match="lie within the range of double precision"):
        to_si(text, "length", "slider.x")
    assert to_si("2.3e-308 m", "length", "slider.x") == 2.3e-308


def test_each_kind_has_a_dimension_of_its_own() -> None:
    for name, kind in KINDS.items():
        assert kind_of_dimension(base_units(kind.si)[1]) == name


def test_quantities_of_other_packages_keep_their_unit() -> None:
    registry = pint.UnitRegistry()
    assert to_si(registry.Quantity(0.2, "N/um"), "stiffness", "slider.spring") == 2e5
    labelled = xr.DataArray([0.2, 0.3], attrs={"units": "N/um"})
    for values in (labelled, registry.Quantity([0.2, 0.3], "N/um")):
        np.testing.assert_allclose(to_si(values, "stiffness", "slider.spring"), [2e5, 3e5])
    shares = xr.DataArray([0.1], attrs={"units": "1"})
    np.testing.assert_array_equal(to_si(shares, "dimensionless", "epsilon"), [0.1])
    for wrong in (registry.Quantity(3, "kg"), registry.Quantity(5, "deg")):
        with pytest.raises(InputError, match="must be"):
            to_si(wrong, "dimensionless", "tilt")


def test_masked_numbers_are_no_numbers() -> None:
    with pytest.raises(InputError, match="must be finite"):
        to_si(np.ma.array([1.0, 2.0], mask=[False, True]), "length", "D0")
