"""The air layer against limits, other evaluations, an independent solution and the paper's numbers.

The tolerance of a number of the paper is half a unit of the last digit stated, unless a comment
says otherwise.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.polynomial import chebyshev
from scipy.special import jve

from asperity.air import (
    AirLayer,
    NormalContact,
    air_vacuum_ratio,
    bessel_ratio,
    effective_modulation,
    patch_radius,
    shear_viscosity_ratio,
)
from asperity.errors import InputError

LAYER = AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=3.9e-2)


def omega_of(s, layer=LAYER):
    """Angular frequency (rad/s) at which |gamma R| = s."""
    return s**2 * layer.P0 * layer.h0**2 / (12 * layer.eta * layer.R**2)


def _power_series(s):
    """J2/J0 from the power series of both, in y = i s^2/4 = -(gamma R/2)^2."""
    y, j0, j2 = 0.25j * s**2, 0, 0
    term = 1 + 0j
    for k in range(60):
        j0 += term
        j2 += term / ((k + 1) * (k + 2))
        term *= y / (k + 1) ** 2
    return -y * j2 / j0


@pytest.mark.parametrize("s", [1e-8, 1e-4, 1e-2, 0.3, 1.0, 2.0])
def test_bessel_ratio_against_power_series_part_by_part(s):
    value, expected = bessel_ratio(s), _power_series(s)
    # Each part on its own: the elastic part of a viscous layer is s^2/6 of its damping.
    assert value.real == pytest.approx(expected.real, rel=1e-13)
    assert value.imag == pytest.approx(expected.imag, rel=1e-13)


def test_bessel_ratio_against_scaled_bessel_functions():
    s = np.logspace(-3, 8, 2001)
    z = (1 - 1j) / np.sqrt(2) * s
    np.testing.assert_allclose(bessel_ratio(s), jve(2, z) / jve(0, z), rtol=2e-14)


def test_bessel_ratio_is_continuous_where_the_method_changes():
    below, above = bessel_ratio(30 * np.array([1 - 1e-15, 1 + 1e-15]))
    assert below.real == pytest.approx(above.real, rel=1e-14)
    assert below.imag == pytest.approx(above.imag, rel=1e-14)


@given(st.floats(-8, 8))
def test_bessel_ratio_is_finite_and_passive_at_any_squeeze(exponent):
    s = 10.0**exponent
    value, stiffer = bessel_ratio([s, 1.01 * s])
    assert np.isfinite(value)
    assert -1 < value.real < 0  # a spring, never stiffer than the trapped gas
    assert value.imag < 0  # a damper, never a source
    assert stiffer.real < value.real


def test_bessel_ratio_limits():
    assert bessel_ratio(0.0) == 0
    assert bessel_ratio(1e300) == pytest.approx(-1)
    s = 1e-8
    assert bessel_ratio(s).imag == pytest.approx(-(s**2) / 8, rel=1e-14)
    assert bessel_ratio(s).real == pytest.approx(-(s**4) / 48, rel=1e-14)
    s = 1e8
    assert bessel_ratio(s) + 1 == pytest.approx(np.sqrt(2) * (1 - 1j) / s, rel=1e-7)


def test_elastic_cushion_and_viscous_leak():
    fast = LAYER.dynamic_stiffness(omega_of(1e6))
    assert fast.real == pytest.approx(LAYER.stiffness, rel=2e-6)
    slow = LAYER.dynamic_stiffness(omega_of(1e-3))
    damping = 3 * np.pi * LAYER.eta * LAYER.R**4 / (2 * LAYER.h0**3)
    assert slow.imag == pytest.approx(omega_of(1e-3) * damping, rel=1e-6)
    assert slow.real < 1e-6 * slow.imag


def _independent_layer(s, x):
    """Mean over the disc and profile at `x` of p = delta P h0/(P0 delta h), x = r/R.

    Chebyshev collocation of the linearised Reynolds equation p'' + p'/x - i s^2 p = i s^2,
    p'(0) = p(1) = 0, straight from mass conservation. In y = x^2 it reads
    4 (y p_yy + p_y) - i s^2 p = i s^2, whose regular solution meets the condition at the centre;
    the mean over the disc is the integral over y. No Bessel function enters.
    """
    n = 80
    shifted = [chebyshev.Chebyshev.basis(k, domain=[0, 1]) for k in range(n + 1)]
    y = (1 - np.cos(np.pi * (np.arange(n) + 0.5) / n)) / 2
    rows = [4 * (y * f.deriv(2)(y) + f.deriv(1)(y)) - 1j * s**2 * f(y) for f in shifted]
    matrix = np.vstack([np.array(rows).T, [f(1.0) for f in shifted]])
    c = np.linalg.solve(matrix, np.append(np.full(n, 1j * s**2), 0))
    mean = sum(a * (f.integ()(1.0) - f.integ()(0.0)) for a, f in zip(c, shifted, strict=True))
    return mean, sum(a * f(np.asarray(x) ** 2) for a, f in zip(c, shifted, strict=True))


@pytest.mark.parametrize("s", [0.01, 0.1, 1.0, 5.7, 20.0, 60.0])
def test_force_and_pressure_against_the_boundary_value_problem(s):
    x = np.linspace(0, 1, 11)
    mean, profile = _independent_layer(s, x)
    omega = omega_of(s)
    # 80 Chebyshev terms resolve the rim's layer 1/s; round-off of their second derivatives is 1e-11
    assert abs(mean + LAYER.dynamic_stiffness(omega) / LAYER.stiffness) < 1e-10 * abs(mean)
    computed = LAYER.pressure(x * LAYER.R, omega) * LAYER.h0 / LAYER.P0
    np.testing.assert_allclose(computed, profile, atol=1e-10 * np.abs(profile).max())


@pytest.mark.parametrize("s", [1e-8, 1e-3, 0.999, 1.001, 10.0, 1e4, 1e8])
def test_pressure_integrates_to_the_force(s):
    # Gauss-Legendre in the boundary layer of width 1/s and in the rest.
    x, weight = np.polynomial.legendre.leggauss(60)
    edge = max(0.0, 1 - 40 / s)
    total = 0
    for low, high in ((0.0, edge), (edge, 1.0)):
        r = LAYER.R * (low + (high - low) * (x + 1) / 2)
        ring = 2 * np.pi * r * LAYER.pressure(r, omega_of(s))
        total += LAYER.R * (high - low) / 2 * np.sum(weight * ring)
    assert total == pytest.approx(-LAYER.dynamic_stiffness(omega_of(s)), rel=1e-10)


def test_pressure_at_the_rim_and_the_centre():
    rim = LAYER.pressure(LAYER.R, omega_of(np.array([1e-6, 1.0, 1e6])))
    assert np.abs(rim).max() < 1e-15 * LAYER.P0 / LAYER.h0
    # Closing the gap of a trapped layer raises the pressure: dP/dh < 0.
    assert LAYER.pressure(0.0, omega_of(1e4)) == pytest.approx(-LAYER.P0 / LAYER.h0)


def test_gamma_is_as_printed():
    omega = 2 * np.pi * 120
    printed = (1 - 1j) / np.sqrt(2) * np.sqrt(12 * 1e-5 * omega / (1e5 * 6.5e-6**2))
    assert LAYER.gamma(omega) == pytest.approx(printed, rel=1e-14)
    assert abs(LAYER.gamma(omega) * LAYER.R) == pytest.approx(LAYER.squeeze(omega), rel=1e-14)


def test_gas_flow_models_have_their_viscosities():
    flows = {flow: replace(LAYER, gas_flow=flow) for flow in ("slip", "free-molecular")}
    assert flows["slip"].effective_viscosity == pytest.approx(1e-5 / (1 + 6 * LAYER.knudsen))
    assert flows["free-molecular"].effective_viscosity == 1e-5
    thin = replace(flows["free-molecular"], P0=np.array([1e5, 100.0]))
    np.testing.assert_array_equal(thin.effective_viscosity, [1e-5, 0.0])
    assert thin.dynamic_stiffness(754.0)[1] == 0


def test_mean_free_path_of_air():
    # 68 nm is the accepted value at 300 K and 1 bar, viscosity 1.85e-5 Pa s.
    assert replace(LAYER, eta=1.85e-5).mean_free_path == pytest.approx(68e-9, rel=0.01)


def test_shear_viscosity_ratio_from_its_definition():
    V, W0, A, omega, dx = 1e-4, 7.0, 0.013, 754.0, 1e-9
    viscous = LAYER.eta * omega * dx * LAYER.area / LAYER.h0
    # the rate term A W0 ln(v/V) linearised about V
    friction = A * W0 * np.log1p(omega * dx / V * 1e-6) * 1e6
    assert shear_viscosity_ratio(V, W0=W0, A=A, layer=LAYER) == pytest.approx(
        viscous / friction, rel=1e-5
    )
    printed = shear_viscosity_ratio(V, W0=W0, A=A, layer=LAYER, as_printed=True)
    assert printed == pytest.approx(A * viscous / friction, rel=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"P0": 0.0}, "AirLayer.P0 must be positive, got 0 Pa;"),
        ({"h0": -6.5e-6}, "AirLayer.h0 must be positive, got -6.5e-06 m;"),
        ({"eta": np.inf}, "AirLayer.eta must be finite, got inf Pa s;"),
        ({"R": [1e-2, np.nan]}, "AirLayer.R must be finite, got nan m;"),
        ({"temperature": 0.0}, "AirLayer.temperature .* got 0 K;"),
        ({"gas_flow": "continum"}, "AirLayer.gas_flow .* 'continum'; did you mean 'continuum'?"),
        ({"P0": np.ones(2), "R": np.ones(3)}, "AirLayer.fields must have shapes that broadcast"),
    ],
)
def test_bad_layer_is_answered_by_one_sentence(change, message):
    with pytest.raises(InputError, match=message):
        replace(LAYER, **change)


def test_bad_arguments_are_answered_by_one_sentence():
    with pytest.raises(InputError, match=r"layer.omega must not be negative, got -1"):
        LAYER.dynamic_stiffness(-1.0)
    with pytest.raises(InputError, match=r"layer.r must lie on the disc, got 0.05 m;"):
        LAYER.pressure([0.0, 0.05], 754.0)
    with pytest.raises(InputError, match=r"layer.squeeze must be finite"):
        bessel_ratio(np.nan)
    with pytest.raises(InputError, match=r"shear.V must be positive, got 0 m/s;"):
        shear_viscosity_ratio(0.0, W0=7.0, A=0.013, layer=LAYER)


def test_a_radius_without_a_finite_area_is_refused():
    with pytest.raises(InputError, match=r"AirLayer.R must have a square .*got 1e\+308 m"):
        AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=1e308)


SLIDER = {"W0": 7.0, "M": 1.6, "lambda_z": 0.4e-6}
CONTACT = NormalContact(W0=7.0, lambda_z=0.4e-6)
#: R = 3.9 cm as stated, and the radius of the stated area of 49 cm^2 (3.949 cm).
R_STATED, R_AREA = 3.9e-2, np.sqrt(49e-4 / np.pi)


def layer(R=R_STATED, **change):
    return AirLayer(**{"P0": 1e5, "h0": 6.5e-6, "eta": 1e-5, "R": R, **change})


def test_the_stiffness_of_the_layer_is_that_of_the_paper():
    assert layer(R_AREA).stiffness == pytest.approx(7.5e7, abs=0.05e7)
    # "one order of magnitude larger than kappa_z" is a factor of 4.3
    assert layer(R_AREA).stiffness / CONTACT.stiffness == pytest.approx(4.31, abs=0.005)


def test_resonance_and_effect_of_inertia_are_those_of_the_paper():
    frequency = CONTACT.omega0(1.6) / (2 * np.pi)
    assert frequency == pytest.approx(530, abs=5)
    assert (120 / frequency) ** 2 == pytest.approx(5.2e-2, abs=0.05e-2)


def test_the_squeeze_number_is_that_of_the_paper():
    omega = 2 * np.pi * 120
    assert layer().gamma(omega) * R_STATED == pytest.approx(4 * (1 - 1j), abs=0.06)


def test_the_fraction_in_air_is_that_of_the_paper():
    assert effective_modulation(120, **SLIDER, layer=layer()) == pytest.approx(0.24, abs=0.005)
    for R in (R_STATED, R_AREA):
        assert effective_modulation(200, **SLIDER, layer=layer(R)) == pytest.approx(0.23, abs=0.005)


def test_the_fraction_in_vacuum_and_the_ratio_are_those_of_the_paper():
    # 1.169, stated as 1.2
    assert effective_modulation(200, **SLIDER) == pytest.approx(1.2, abs=0.05)
    assert air_vacuum_ratio(200, **SLIDER, layer=layer()) == pytest.approx(0.20, abs=0.005)
    # the "nominal" area of 49 cm^2 gives 0.194: 0.19, one unit of the last digit away
    assert air_vacuum_ratio(200, **SLIDER, layer=layer(R_AREA)) == pytest.approx(0.194, abs=5e-4)


def test_a_patch_of_25_mm_gives_both_measured_fractions():
    assert effective_modulation(120, **SLIDER, layer=layer(2.5e-2)) == pytest.approx(0.48, abs=5e-3)
    assert np.pi * 2.5e-2**2 / 49e-4 == pytest.approx(0.4, abs=0.05)
    (radius,) = patch_radius(0.48, 120, **SLIDER, layer=layer()).solutions
    assert radius == pytest.approx(2.5e-2, abs=0.05e-2)
    # That radius, fixed by the fit at 120 Hz, also gives the 0.4 measured at 200 Hz against vacuum.
    assert air_vacuum_ratio(200, **SLIDER, layer=layer(radius)) == pytest.approx(0.4, abs=0.01)


def test_a_layer_at_1_mbar_acts_as_vacuum():
    thin = layer(R_AREA, P0=100.0)
    # "two orders of magnitude below the multicontact one"
    assert thin.stiffness / CONTACT.stiffness == pytest.approx(4.3e-3, abs=0.05e-3)
    # "several 10 um ... larger than the gap width"
    assert 2e-5 < thin.mean_free_path < 9e-5
    assert thin.knudsen > 1
    vacuum = effective_modulation(200, **SLIDER)
    for flow in ("continuum", "slip", "free-molecular"):
        modulation = effective_modulation(
            200, **SLIDER, layer=layer(R_AREA, P0=100.0, gas_flow=flow)
        )
        assert modulation == pytest.approx(vacuum, rel=6e-3)


def test_the_printed_shear_viscosity_lacks_a_factor_A():
    arguments = {"W0": 7.0, "A": 0.013, "layer": layer(R_AREA)}
    printed = shear_viscosity_ratio(1e-4, **arguments, as_printed=True)
    assert printed == pytest.approx(1e-7, abs=0.5e-7)
    # with A, which the printed formula leaves out, 77 times larger and still negligible
    assert shear_viscosity_ratio(1e-4, **arguments) == pytest.approx(8.3e-6, abs=0.05e-6)
