"""Floquet multipliers: from matrices, from Liouville's formula, and the threshold of stability."""

import numpy as np
import pytest
from scipy.optimize import brentq

from asperity import Slider, periodic_response
from asperity.laws import ElastoPlastic, RiceRuina, RuinaSlip
from asperity.orbit.floquet import (
    LARGEST_LOG,
    from_logs,
    kind_of_crossing,
    log_multipliers,
    multiplier_gap,
    sorted_logs,
    without_lost_arguments,
)
from references.populations import population

#: Round-off of logarithms.
EXACT = 1e-13
#: Integral of the trace from samples of a waveform that is good to 3e-5 of its swing, and whose
#: mean slip rate, on which the trace depends, is good to 1e-6 (see test_residual).
LIOUVILLE = 1e-6

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
K, W0, LAMBDA = 2e5, 7.0, 7e-7
SAMPLES = 4096


def logs(matrix, log_determinant, log_scale=0.0):
    """Of one matrix; the determinant is that of the matrix times exp(log_scale)."""
    stacked = np.asarray(matrix, dtype=float)[..., None]
    return log_multipliers(stacked, np.array([log_scale]), np.array([log_determinant]))[:, 0]


@pytest.mark.parametrize("size", [2, 3])
def test_a_monodromy_matrix_that_is_lost_has_no_multipliers(size):
    """Of three states it had multipliers of 0, those of a stable orbit."""
    lost = np.full((size, size, 1), np.nan)
    assert np.isnan(log_multipliers(lost, np.zeros(1), np.zeros(1)).real).all()


def similar(triangle):
    """A full matrix with the eigenvalues of `triangle`."""
    basis = np.array([[1.0, 0.4], [-0.7, 1.2]])
    return basis @ triangle @ np.linalg.inv(basis)


@pytest.mark.parametrize(
    ("triangle", "expected"),
    [
        ([[0.9, 1.0], [0.0, 0.2]], [0.9, 0.2]),
        ([[-0.3, 0.0], [0.0, -2.5]], [-2.5, -0.3]),
        ([[0.5, 0.8], [-0.8, 0.5]], [0.5 + 0.8j, 0.5 - 0.8j]),
        ([[-0.5, 0.8], [-0.8, -0.5]], [-0.5 + 0.8j, -0.5 - 0.8j]),
        ([[0.6, 0.0], [0.0, 0.6]], [0.6, 0.6]),
    ],
)
def test_two_multipliers_are_the_eigenvalues_of_the_matrix(triangle, expected):
    triangle = np.array(triangle)
    result = logs(similar(triangle), np.log(np.linalg.det(triangle)))
    # The root of a small difference: a double eigenvalue is known to half the digits.
    np.testing.assert_allclose(result, np.log(np.array(expected, dtype=complex)), atol=1e-7)
    np.testing.assert_allclose(from_logs(result), expected, atol=1e-7)


def test_a_pair_separated_by_more_than_round_off():
    # 1e5 and 1e-30: the matrix does not know the second any more, its determinant does.
    matrix = similar(np.diag([1e5, 1e-30]))
    result = logs(matrix, np.log(1e5) + np.log(1e-30))
    np.testing.assert_allclose(result.real, [np.log(1e5), np.log(1e-30)], rtol=EXACT)
    negative = logs(-matrix, np.log(1e5) + np.log(1e-30))
    np.testing.assert_allclose(from_logs(negative), [-1e5, -1e-30], rtol=1e-11)


def test_the_logarithmic_scale_of_the_matrix_adds_to_the_logarithms():
    matrix, scale = similar(np.diag([0.8, 0.1])), 50.0
    result = logs(matrix, np.log(0.08) + 2 * scale, log_scale=scale)
    np.testing.assert_allclose(result.real, np.log([0.8, 0.1]) + scale, rtol=EXACT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_multiplier_that_overflows_keeps_its_modulus_and_has_no_argument(sign):
    scale = 800.0
    result = logs(sign * similar(np.diag([0.8, 0.1])), np.log(0.08) + 2 * scale, log_scale=scale)
    kept = without_lost_arguments(result)
    np.testing.assert_allclose(kept.real, np.log([0.8, 0.1]) + scale, rtol=EXACT)
    assert np.isnan(kept.imag).all()
    assert np.isinf(from_logs(kept)).all()


def test_only_the_multiplier_that_overflows_loses_its_argument():
    pair = np.array([LARGEST_LOG + 1 + np.pi * 1j, -2.0 + np.pi * 1j])
    kept = without_lost_arguments(pair)
    assert np.isnan(kept[0].imag)
    assert kept[1] == pair[1]
    assert from_logs(kept)[1] == pytest.approx(-np.exp(-2.0))
    assert not np.isnan(pair.imag).any()  # not in place


def test_a_vanishing_multiplier_is_zero():
    assert from_logs(np.array([-800.0 + 0j])) == 0


def test_a_vanishing_multiplier_is_the_last():
    logs = np.array([[-np.inf + 0j], [-0.1 - 1j], [-0.1 + 1j]])
    np.testing.assert_array_equal(sorted_logs(logs), logs[[2, 1, 0]])


def test_a_determinant_that_the_matrix_cannot_have_gives_no_multipliers():
    matrix = similar(np.diag([0.8, 0.1]))
    assert np.isnan(logs(matrix, np.log(0.08) + 300.0)).all()
    # Large entries may well have a large determinant.
    np.testing.assert_allclose(logs(50 * matrix, np.log(0.08 * 2500)).real, np.log([40.0, 5.0]))


def test_the_multiplier_of_one_state_is_the_determinant():
    np.testing.assert_allclose(logs([[0.5]], -3.0), [-3.0])


def test_three_multipliers_are_the_eigenvalues_of_the_matrix():
    basis = np.array([[1.0, 0.2, 0.3], [0.0, 1.0, -0.5], [0.4, 0.1, 1.0]])
    block = np.array([[0.3, 0.4, 0.0], [-0.4, 0.3, 0.0], [0.0, 0.0, -0.9]])
    result = from_logs(logs(basis @ block @ np.linalg.inv(basis), 0.0, log_scale=2.0))
    expected = np.array([-0.9, 0.3 + 0.4j, 0.3 - 0.4j]) * np.exp(2.0)
    np.testing.assert_allclose(result[0], expected[0], rtol=1e-12)
    np.testing.assert_allclose(sorted(result[1:], key=np.imag), sorted(expected[1:], key=np.imag))


def trace_integral(response, V, epsilon, frequency, elastic):
    """Integral over a period of the trace of the Jacobian of (F/W0, ln Phi), written by hand."""
    A, B, D0 = BASE["A"], BASE["B"], BASE["D0"]
    theta = response.theta
    w, dw = 1 + epsilon * np.cos(theta), -epsilon * np.sin(theta)
    omega = 2 * np.pi * frequency
    friction, log_slip = response.waveform
    plastic = V * np.exp(log_slip)
    rate = A * (log_slip + np.log(V / BASE["V0"]))
    phi = (friction / w - BASE["mu0"] - rate) / B  # ln(V0 Phi/D0)
    # dF/dtheta (1/K + lambda/W) = (V - v_pl)/omega + lambda F W'/W^2, all over W0
    soft = W0 / K + elastic / w
    by_force = (-plastic / (A * w * omega) + elastic * dw / w**2) / soft
    by_age = plastic * B / (A * omega) / soft
    # dln(Phi)/dtheta = (1/Phi - v/D0)/omega, v = V - omega dF/dtheta / K
    ageing = -BASE["V0"] / (D0 * omega) * np.exp(-phi) + W0 / K / D0 * by_age
    return 2 * np.pi * (by_force + ageing).mean()


@pytest.mark.parametrize(
    ("V", "epsilon", "frequency"),
    [(1e-6, 0.24, 120.0), (1e-5, 0.5, 120.0), (1e-4, 0.24, 120.0), (1e-6, 0.5, 1.0)],
)
@pytest.mark.parametrize(
    ("law", "elastic"),
    [(RiceRuina(**BASE), 0.0), (ElastoPlastic(**BASE, lambda_=LAMBDA), LAMBDA)],
)
def test_the_product_of_the_multipliers_obeys_liouvilles_formula(
    law, elastic, V, epsilon, frequency
):
    response = periodic_response(
        Slider(law, spring=K, load=W0),
        velocity=V,
        epsilon=epsilon,
        frequency=frequency,
        waveform=SAMPLES,
    )
    expected = trace_integral(response, V, epsilon, frequency, elastic)
    assert response.log_multipliers.real.sum() == pytest.approx(expected, rel=LIOUVILLE)


@pytest.mark.parametrize("law", population([RiceRuina, RuinaSlip]))
def test_no_exponent_where_the_change_of_variables_is_singular(law):
    # A stiff spring, on which the force decays within a radian. Averaging reaches an exponent of
    # another system here, for some amplitudes an unstable one.
    slider = Slider(law(**BASE), spring=2e7, load=W0)
    points = {"velocity": 1e-6, "epsilon": np.linspace(0.39, 0.48, 91), "frequency": 120.0}
    response = periodic_response(slider, **points)
    on_mesh = periodic_response(slider, **points, methods=("collocation",))
    assert response.converged.all()
    assert on_mesh.converged.all()
    np.testing.assert_allclose(response.floquet_max, on_mesh.floquet_max, rtol=1e-8)


@pytest.mark.parametrize("method", ["fourier", "collocation"])
def test_multipliers_of_small_modulation_are_those_of_steady_sliding(method):
    # K = Kc/10 and V/(w D0) = 0.1: steady sliding grows fivefold a period.
    A, B, D0, V = BASE["A"], 4 * BASE["A"], BASE["D0"], 1e-5
    stiffness, nu = 0.1 * (B - A), 0.1
    response = periodic_response(
        Slider(RiceRuina(**BASE | {"B": B}), spring=stiffness * W0 / D0, load=W0),
        velocity=V,
        epsilon=[0.0, 1e-4],
        frequency=V / (2 * np.pi * nu * D0),
        waveform=1,
        methods=(method,),
    )
    assert response.converged.all()
    rates = np.array([[-stiffness / A, stiffness * B / A], [-1 / A, B / A - 1]])
    expected = np.sort(2 * np.pi * nu * np.linalg.eigvals(rates))[::-1]
    # eps = 1e-4 changes them by about (eps mu/A)^2.
    np.testing.assert_allclose(response.log_multipliers[0], expected, rtol=1e-10)
    np.testing.assert_allclose(response.log_multipliers[1], expected, rtol=1e-4)


def test_multipliers_beyond_what_a_coarse_mesh_resolves(reference):
    # Unstable sliding, K < Kc, modulated so slowly that perturbations turn and grow many times
    # within an interval of the mesh; the orbit itself is smooth.
    points = [(1.7e5, 0.1, 0.02), (1e5, 0.2, 0.01), (2e4, 0.5, 0.01), (1e5, 0.02, 0.03)]
    stiffness, epsilon, frequency = np.transpose([*points, (2e4, 0.2, 0.03)])
    response = periodic_response(
        Slider(RiceRuina(**BASE), spring=stiffness, load=W0),
        velocity=1e-5,
        epsilon=epsilon,
        frequency=frequency,
        waveform=SAMPLES,
    )
    assert response.converged[-1]
    done = response.converged
    shot = reference.multiple_shooting(
        reference.Printed(K=stiffness[done, None], V=1e-5, frequency=frequency[done, None]),
        epsilon[done, None],
        *response.waveform[:, done, :: SAMPLES // 256],
    )
    result = response.log_multipliers[done]
    # 1e3 radians and e-foldings a period: of their logarithms round-off leaves 1e-9 or so.
    expected = shot.log_multipliers
    resolved = np.isfinite(result.real).all(axis=-1)
    assert resolved.sum() >= 4
    np.testing.assert_allclose(result[resolved].real, expected[resolved].real, rtol=1e-7)
    argument = np.abs(np.exp(1j * (result.imag - expected.imag)) - 1)
    known = result.real < LARGEST_LOG
    assert argument[known & resolved[:, None]].max() < 1e-7
    # Where no mesh resolves them, the first is a lower bound that overflows all the same.
    bound = result[~resolved, 0].real
    assert np.all((bound > LARGEST_LOG) & (bound <= expected[~resolved, 0].real))


def test_the_threshold_amplitude_agrees_with_shooting(reference):
    # PHYSICS: modulation stabilises sliding at K/Kc = 0.88; the crossing is near eps = 0.1329.
    slider = Slider(RiceRuina(**BASE), spring=K, load=W0)

    def respond(epsilon):
        return periodic_response(
            slider, velocity=1e-6, epsilon=epsilon, frequency=120.0, waveform=16
        )

    threshold = brentq(lambda e: float(respond(e).floquet_max) - 1, 0.1, 0.15, xtol=1e-10)
    assert threshold == pytest.approx(0.1329, abs=5e-5)
    sides = respond(threshold + np.array([-1e-4, 0.0, 1e-4]))
    assert list(sides.stable[[0, 2]]) == [False, True]
    shot = reference.multiple_shooting(
        reference.Printed(),
        sides.epsilon[:, None],
        *sides.waveform,
    )
    assert np.abs(shot.multipliers[1, 0]) == pytest.approx(1, abs=1e-10)
    assert np.abs(shot.multipliers[0, 0]) > 1 > np.abs(shot.multipliers[2, 0])


@pytest.mark.parametrize(
    ("multiplier", "kind"),
    [
        (1.2, "fold"),
        (0.3, "fold"),
        (-1.2, "period doubling"),
        (1.1 * np.exp(0.3j), "Neimark-Sacker"),
        (1.1 * np.exp(-3.1j), "Neimark-Sacker"),
        (complex(np.nan, 0.0), ""),
    ],
)
def test_the_mode_is_the_bifurcation_of_the_leading_multiplier(multiplier, kind):
    logs = np.log(np.array([multiplier], dtype=complex))
    assert kind_of_crossing(logs)[0] == kind


def test_the_slow_mode_of_unmodulated_sliding():
    """Its frequency and growth are the closed form's, at any amplitude small enough."""
    response = periodic_response(
        Slider(RiceRuina(**BASE), spring=K, load=W0),
        velocity=1e-6,
        epsilon=1e-6,
        frequency=120.0,
    )
    A, B = BASE["A"], BASE["B"]
    rate, loading = 1e-6 / BASE["D0"], K * 1e-6 / W0
    # Characteristic equation of steady sliding, s^2 + b s + c = 0.
    b, c = rate * (1 - B / A) + loading / A, loading * rate / A
    root = -b / 2 + np.sqrt(complex(b**2 / 4 - c))
    assert response.mode == "Neimark-Sacker"
    assert response.growth_rate == pytest.approx(root.real, rel=1e-5)
    assert response.mode_frequency == pytest.approx(root.imag / (2 * np.pi), rel=1e-5)


@pytest.mark.parametrize("methods", [("fourier",), ("collocation",)])
@pytest.mark.parametrize("rate", [1.5e-9, 9e-9])
def test_stability_of_fast_and_small_modulation(methods, rate):
    # Closed form of steady sliding, s^2 + s (V/D0) (K - Kc) D0 / (A W0) + (V/D0)^2 (K/Kc)(B/A - 1)
    # = 0, while the multipliers are within 1e-7 of 1. The modulation itself counts by
    # (eps mu / A)^2 = 1e-11.
    law, V = RiceRuina(**BASE), 1e-6
    critical = (BASE["B"] - BASE["A"]) * W0 / BASE["D0"]
    spring = critical * np.array([0.9, 0.999, 1.001, 1.1])
    frequency = V / BASE["D0"] / rate / (2 * np.pi)
    r = periodic_response(
        Slider(law, spring=spring, load=W0),
        velocity=V,
        epsilon=1e-7,
        frequency=frequency,
        methods=methods,
    )
    slope = (spring - critical) * BASE["D0"] / (BASE["A"] * W0)
    root = np.sqrt(spring / critical * (BASE["B"] / BASE["A"] - 1) - slope**2 / 4)
    expected = (-slope / 2 + 1j * root) * V / BASE["D0"] / frequency
    assert list(r.stable) == [False, False, True, True]
    np.testing.assert_allclose(r.log_multipliers[:, 0], expected, rtol=1e-6)
    np.testing.assert_allclose(r.growth_rate, expected.real * frequency, rtol=1e-5)


def test_a_multiplier_that_vanishes_is_known_and_one_without_a_logarithm_is_not():
    before = np.array([[-1.0, -1.0, -1.0, -1.0, 800.0], [-np.inf, -np.inf, np.nan, np.inf, -1.0]])
    now = np.array([[-1.0, -2.0, -1.0, -1.0, 801.0], [-np.inf, -40.0, -40.0, np.inf, -1.0]])
    same, differs, lost, overflow, beyond = multiplier_gap(before + 0j, now + 0j)
    assert same == 0
    # exp(-1) for exp(-2); beyond doubles the logarithms are compared.
    assert differs == pytest.approx(np.e - 1, rel=1e-12)
    assert (lost, overflow) == (np.inf, np.inf)
    assert beyond == pytest.approx(1 / 801, rel=1e-12)
