"""The normal law of the interface, its harmonics and its relation to the shear length."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from asperity.air import NormalContact, mindlin_length_ratio, normal_length
from asperity.errors import InputError

CONTACT = NormalContact(W0=7.0, lambda_z=0.4e-6)


@given(st.floats(1e-6, 1e6))
def test_load_and_closure_are_inverse(load):
    assert CONTACT.load(CONTACT.closure(load)) == pytest.approx(load, rel=1e-12)


def test_stiffness_is_the_slope_of_the_law():
    step = 1e-12
    slope = (CONTACT.load(step) - CONTACT.load(-step)) / (2 * step)
    assert slope == pytest.approx(CONTACT.stiffness, rel=1e-8)
    assert CONTACT.omega0(1.6) == pytest.approx(np.sqrt(CONTACT.stiffness / 1.6), rel=1e-15)


def _cosine_series(values, count):
    spectrum = np.fft.rfft(values) / values.size
    return spectrum.real[0], 2 * spectrum.real[1 : count + 1]


@pytest.mark.parametrize("beta", [1e-3, 0.24, 1.0, 3.0, 40.0])
def test_harmonics_of_the_load_against_a_fourier_transform(beta):
    theta = 2 * np.pi * np.arange(1024) / 1024
    a = beta * CONTACT.lambda_z
    # The mean gap rises by the dilation: only then is the mean load still W0.
    load = CONTACT.load(a * np.cos(theta) - CONTACT.dilation(a)) / CONTACT.W0
    mean, harmonics = _cosine_series(load, 4)
    assert mean == pytest.approx(1, rel=1e-13)
    np.testing.assert_allclose(CONTACT.load_harmonics(a), harmonics, rtol=1e-12, atol=1e-15)


def test_dilation_of_a_small_motion_is_quadratic_and_continuous():
    assert CONTACT.dilation(1e-14) == pytest.approx(1e-28 / (4 * 0.4e-6), rel=1e-12)
    below, above = CONTACT.dilation(0.4e-6 * np.array([1 - 1e-12, 1 + 1e-12]))
    assert below == pytest.approx(above, rel=1e-11)


@pytest.mark.parametrize("eps", [1e-3, 0.24, 0.58, 0.9])
def test_harmonics_of_the_closure_against_a_fourier_transform(eps):
    theta = 2 * np.pi * np.arange(1024) / 1024
    closure = CONTACT.closure(CONTACT.W0 * (1 + eps * np.cos(theta)))
    mean, harmonics = _cosine_series(closure, 4)
    length = CONTACT.lambda_z
    rho = eps / (1 + np.sqrt(1 - eps**2))
    assert mean == pytest.approx(-length * np.log1p(rho**2), rel=1e-9)
    np.testing.assert_allclose(
        CONTACT.closure_harmonics(eps), harmonics, rtol=1e-10, atol=1e-14 * length
    )


def test_harmonics_broadcast_on_the_leading_axes():
    contact = NormalContact(W0=np.array([3.0, 7.0, 16.0]), lambda_z=0.4e-6)
    assert contact.load_harmonics(np.full((2, 1), 1e-7), 5).shape == (2, 1, 5)
    assert contact.closure_harmonics([0.1, 0.2]).shape == (2, 4)
    assert contact.load(np.zeros((2, 1))).shape == (2, 3)


def test_mindlin_ratio_never_reaches_the_printed_one():
    # 4 G a/(2 - nu) against 2 G a/(1 - nu), at the Poisson's ratio the paper quotes.
    assert mindlin_length_ratio(0.44) == pytest.approx(1.3929, abs=1e-4)
    assert mindlin_length_ratio(np.linspace(0, 0.5, 11)).max() == pytest.approx(1.5)
    assert normal_length(0.7e-6, 1.7) == pytest.approx(0.41e-6, abs=0.005e-6)
    assert normal_length(0.7e-6, mindlin_length_ratio(0.44)) == pytest.approx(0.503e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: NormalContact(0.0, 4e-7),
            "NormalContact.W0 must be positive, got 0 N;",
        ),
        (lambda: NormalContact(7.0, np.nan), "NormalContact.lambda_z .* got nan m;"),
        (lambda: NormalContact("7 m", 4e-7), "NormalContact.W0 must be a force"),
        (lambda: NormalContact(7j, 4e-7), "NormalContact.W0 must be a force"),
        (lambda: NormalContact([7.0, [7.0]], 4e-7), "NormalContact.W0 must be a rectangular"),
        (lambda: NormalContact(np.ones(2), np.ones(3)), "broadcast, got .2,., .3,.;"),
        (lambda: CONTACT.closure([7.0, -1.0]), "NormalContact.load .* got -1 N;"),
        (
            lambda: CONTACT.closure_harmonics(1.0),
            "NormalContact.epsilon must be at least 0 and below 1",
        ),
        (lambda: CONTACT.load_harmonics(-1e-9), "NormalContact.amplitude must not be"),
        (lambda: CONTACT.omega0(0.0), "NormalContact.M must be positive, got 0 kg;"),
        (lambda: mindlin_length_ratio(0.6), "material.nu must be at most 0.5, got 0.6;"),
        (lambda: normal_length(7e-7, 0.0), "material.length_ratio must be positive"),
    ],
)
def test_bad_input_is_answered_by_one_sentence(call, message):
    with pytest.raises(InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_record_does_not_follow_the_array_it_was_made_from():
    loads = np.array([3.0, 7.0])
    contact = NormalContact(loads, 0.4e-6)
    loads[0] = -1.0
    np.testing.assert_array_equal(contact.W0, [3.0, 7.0])
