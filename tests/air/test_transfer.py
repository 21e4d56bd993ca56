"""The borne fraction of the modulation: limits, signs, invariances, an independent simulation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp
from scipy.special import jv

from asperity.air import (
    AirLayer,
    NormalContact,
    air_vacuum_ratio,
    effective_modulation,
    modulation_phase,
    transfer_function,
)
from asperity.errors import InputError

SLIDER = {"W0": 7.0, "M": 1.6, "lambda_z": 0.4e-6}
LAYER = AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=3.9e-2)
F0 = float(NormalContact(7.0, 0.4e-6).omega0(1.6)) / (2 * np.pi)


def test_the_fraction_is_the_printed_formula():
    omega = 2 * np.pi * np.array([20.0, 120.0, 200.0, 900.0])
    omega0 = np.sqrt(SLIDER["W0"] / (SLIDER["lambda_z"] * SLIDER["M"]))
    z = (1 - 1j) / np.sqrt(2) * np.sqrt(12 * 1e-5 * omega / (1e5 * 6.5e-6**2)) * 3.9e-2
    air = np.pi * 3.9e-2**2 * 1e5 / 7.0 * 0.4e-6 / 6.5e-6 * jv(2, z) / jv(0, z)
    printed = 1 / np.abs(1 - omega**2 / omega0**2 - air)
    computed = effective_modulation(omega / (2 * np.pi), **SLIDER, layer=LAYER)
    np.testing.assert_allclose(computed, printed, rtol=1e-12)


def test_without_a_layer_it_is_a_vacuum():
    f = np.array([0.0, 120.0, 200.0, 700.0])
    expected = 1 / np.abs(1 - (f / F0) ** 2)
    np.testing.assert_allclose(effective_modulation(f, **SLIDER), expected, rtol=1e-13)
    np.testing.assert_array_equal(modulation_phase(f, **SLIDER), [0, 0, 0, np.pi])
    assert effective_modulation(1 / (2 * np.pi), W0=1.0, M=1.0, lambda_z=1.0) == np.inf


def test_static_and_massless_limits():
    assert transfer_function(0.0, **SLIDER, layer=LAYER) == 1
    cushion = replace(LAYER, R=10.0)
    massless = {**SLIDER, "M": 0.0}
    expected = 1 / (1 + cushion.stiffness / (7.0 / 0.4e-6))
    assert effective_modulation(1e5, **massless, layer=cushion) == pytest.approx(expected, rel=1e-4)
    rarefied = replace(LAYER, P0=1e-6, gas_flow="free-molecular")
    assert effective_modulation(120.0, **SLIDER, layer=rarefied) == effective_modulation(
        120.0, **SLIDER
    )


@given(
    *(st.floats(*r) for r in [(-3, 4), (1, 7), (-8, -3), (-4, 0)]),
    st.sampled_from(["continuum", "slip", "free-molecular"]),
)
def test_contacts_never_lead_the_load(log_f, log_P, log_h, log_R, flow):
    layer = AirLayer(10**log_P, 10**log_h, 1.8e-5, 10**log_R, gas_flow=flow)
    T = transfer_function(10**log_f, **SLIDER, layer=layer)
    assert np.isfinite(T)
    assert T.imag <= 0


def test_monotone_in_radius_and_gap_but_not_in_pressure():
    lengths = np.logspace(-8, 0, 2001)
    by_radius = effective_modulation(120.0, **SLIDER, layer=replace(LAYER, R=lengths))
    by_gap = effective_modulation(120.0, **SLIDER, layer=replace(LAYER, h0=lengths))
    assert (np.diff(by_radius) < 1e-15).all()
    assert (np.diff(by_gap) > -1e-15).all()
    # A dense gas leaks as an incompressible fluid: the spring goes, the damper stays.
    wide = replace(LAYER, h0=13e-6, P0=np.array([1e5, 4e5, 1e8]))
    thin, least, dense = effective_modulation(120.0, **SLIDER, layer=wide)
    assert least < min(thin, dense)


def test_everything_broadcasts():
    layer = AirLayer(
        P0=np.full((2, 1, 1, 1), 1e5), h0=np.full((3, 1, 1), 6.5e-6), eta=1e-5, R=np.ones((4, 1))
    )
    f = np.array([20.0, 40.0, 60.0, 80.0, 120.0])
    assert effective_modulation(f, **SLIDER, layer=layer).shape == (2, 3, 4, 5)
    assert effective_modulation([[120]], W0=[3, 7], M=1.6, lambda_z=4e-7, layer=LAYER).shape == (
        1,
        2,
    )
    assert np.ndim(effective_modulation(120, **SLIDER, layer=LAYER)) == 0
    one = effective_modulation(f[2], **SLIDER, layer=replace(LAYER, R=1.0))
    assert effective_modulation(f, **SLIDER, layer=layer)[1, 2, 3, 2] == pytest.approx(one)


@given(*(st.floats(-3, 3) for _ in range(3)))
def test_the_transfer_function_does_not_depend_on_the_units(a, b, c):
    length, mass, second = 10**a, 10**b, 10**c
    force = mass * length / second**2
    slider = {"W0": 7.0 * force, "M": 1.6 * mass, "lambda_z": 0.4e-6 * length}
    pressure = force / length**2
    layer = AirLayer(1e5 * pressure, 6.5e-6 * length, 1e-5 * pressure * second, R=3.9e-2 * length)
    scaled = transfer_function(120.0 / second, **slider, layer=layer)
    assert scaled == pytest.approx(transfer_function(120.0, **SLIDER, layer=LAYER), rel=1e-11)


def _simulate(frequency, eps, layer=LAYER, cells=60, periods=14):
    """Mean of W/W0, harmonics 1 and 2 of W/(eps W0): unlinearised equations marched in time.

    Isothermal Reynolds equation d(P h)/dt = (1/r) d/dr [r P h^3/(12 eta) dP/dr] in finite volumes,
    M h'' = W(h) + (pressure force) - W0 (1 + eps cos wt), W(h) = W0 exp((h0 - h)/lambda_z). No
    formula of the package enters.
    """
    W0, M, lz = SLIDER["W0"], SLIDER["M"], SLIDER["lambda_z"]
    P0, h0, eta, R = layer.P0, layer.h0, layer.eta, layer.R
    omega = 2 * np.pi * frequency
    # Cells narrow towards the rim, where the pressure falls.
    edge = R * np.sin(0.5 * np.pi * np.linspace(0, 1, cells + 1))
    centre = (edge[1:] + edge[:-1]) / 2
    area = np.pi * np.diff(edge**2)
    step = np.diff(np.append(centre, R))

    def rates(t, y):
        # scaled: gap in lambda_z, velocity in lambda_z w, gas content per area in P0 h0
        h = h0 + lz * y[0]
        P = P0 * h0 * y[2:] / h
        outer = np.append(P[1:], P0)
        slope = (outer - P) / step
        flow = 2 * np.pi * edge[1:] * (P + outer) / 2 * h**3 / (12 * eta) * slope
        content = np.diff(np.append(0.0, flow)) / area / (P0 * h0)
        lift = W0 * np.exp(-y[0]) + np.sum((P - P0) * area)
        push = W0 * (1 + eps * np.cos(omega * t))
        return np.concatenate([[omega * y[1], (lift - push) / (M * lz * omega)], content])

    start = np.concatenate([[0.0, 0.0], np.ones(cells)])
    t = (periods - 2 + np.arange(128) / 64) / frequency
    run = solve_ivp(rates, (0, t[-1]), start, "BDF", t, rtol=1e-7, atol=1e-10)
    assert run.success
    load = np.exp(-run.y[0])
    harmonics = (2 * np.mean(load * np.exp(-1j * n * omega * t)) / eps for n in (1, 2))
    return load.mean(), *harmonics


@pytest.mark.parametrize("frequency", [120.0, 400.0])
def test_the_transfer_function_is_that_of_the_full_equations_integrated_in_time(frequency):
    # Second-order cells and eps = 1e-3 leave a few parts in 1e4: modulus AND sign of the phase.
    _, simulated, _ = _simulate(frequency, eps=1e-3)
    expected = transfer_function(frequency, **SLIDER, layer=LAYER)
    assert abs(simulated - expected) < 2e-3 * abs(expected)


@pytest.mark.parametrize("R", [3.9e-2, 2.5e-2])
def test_linear_at_the_largest_modulation_of_the_paper(R):
    # The appendix: eps_eff/eps does not depend on eps, although eps_eff = 0.24 is not << 1.
    patch = replace(LAYER, R=R)
    mean, first, second = _simulate(120.0, eps=0.5, layer=patch)
    expected = effective_modulation(120.0, **SLIDER, layer=patch)
    assert abs(first) == pytest.approx(expected, rel=0.02)
    assert abs(second) < 0.06 * abs(first)
    # The air lifts the slider by at most 5/4 P0 area (closure/gap)^2, of a gas that cannot leak.
    closure = 0.5 * expected * SLIDER["lambda_z"]
    cushion = 1.25 * patch.P0 * patch.area * (closure / patch.h0) ** 2 / SLIDER["W0"]
    assert 0.5 * cushion < 1 - mean < cushion < 0.01


def test_air_over_vacuum():
    air = effective_modulation(200.0, **SLIDER, layer=LAYER)
    vacuum = effective_modulation(200.0, **SLIDER)
    assert air_vacuum_ratio(200.0, **SLIDER, layer=LAYER) == pytest.approx(air / vacuum)
    with pytest.raises(InputError, match=r"^layer must be an AirLayer, got None"):
        air_vacuum_ratio(200.0, **SLIDER, layer=None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequency": -1.0}, "modulation.frequency must not be negative, got -1 Hz;"),
        ({"frequency": "120 N"}, "modulation.frequency must be a frequency"),
        ({"W0": 0.0}, "NormalContact.W0 must be positive, got 0 N;"),
        ({"M": -1.6}, "modulation.M must not be negative, got -1.6 kg;"),
        ({"lambda_z": None}, "NormalContact.lambda_z must be a length, got None"),
        ({"frequency": np.ones(2), "M": np.ones(3)}, "modulation.frequency must have shapes that"),
    ],
)
def test_bad_input_is_answered_by_one_sentence(change, message):
    arguments = {"frequency": 120.0, **SLIDER, "layer": LAYER, **change}
    with pytest.raises(InputError, match=message):
        effective_modulation(arguments.pop("frequency"), **arguments)
