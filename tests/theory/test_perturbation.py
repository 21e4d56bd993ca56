"""Second-order response by automatic differentiation against closed forms and an integration."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from asperity import periodic_response
from asperity.errors import InputError
from asperity.laws import (
    Amontons,
    ElastoPlastic,
    ElastoPlasticAge,
    LinkerDieterich,
    RiceRuina,
    StrengthArea,
)
from asperity.laws.uneven_track import on_uneven_track
from asperity.slider import QuasiStatic, Slider
from asperity.theory.ageing_response import ageing_response
from asperity.theory.closed_forms import (
    SmallModulation,
    critical_pulsation,
    critical_stiffness,
    critical_stiffness_elastic,
)
from asperity.theory.perturbation import perturb, perturbation_response
from references.populations import population

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
K, W0 = 2e5, 7.0
LAWS = {
    "rice-ruina": (RiceRuina(**BASE), {}),
    "linker-dieterich": (LinkerDieterich(**BASE, alpha=0.2), {"alpha": 0.2}),
    "elasto-plastic": (ElastoPlastic(**BASE, lambda_=7e-7), {"lambda_": 7e-7}),
    "elasto-plastic-age": (
        ElastoPlasticAge(**BASE, lambda_=7e-7),
        {"lambda_": 7e-7, "ageing": "plastic"},
    ),
    "strength-area": (StrengthArea(**BASE), {"product": True}),
}
AGEING = ["elasto-plastic", "linker-dieterich", "elasto-plastic-age", "rice-ruina"]

#: Points of every call on a law, so that it has one program.
POINTS = 70

#: Two amplitudes of 1e-3 and 5e-4 leave (eps mu/A)^4 = 2e-6 of the coefficient.
INTEGRATED = 2e-5


def coefficients(response) -> np.ndarray:
    return np.stack([response.mean_curvature, response.transfer, response.second_harmonic])


def coefficients_at(name: str, V: float, frequency: float) -> np.ndarray:
    """Coefficients at one point."""
    slider = Slider(LAWS[name][0], spring=K, load=W0)
    response = perturbation_response(
        slider, velocity=np.full(POINTS, V), frequency=np.full(POINTS, frequency)
    )
    return coefficients(response)[:, 0]


def closed_form(name: str, V, frequency):
    law, variant = LAWS[name]
    extra = {k: v for k, v in variant.items() if k != "ageing"}
    p = SmallModulation(
        law.mu_ss(V), law.A, law.B, law.D0, K, W0, V, 2 * np.pi * np.asarray(frequency), **extra
    )
    return ageing_response(p, variant.get("ageing", "slider"))


@pytest.mark.parametrize("name", population(AGEING, short=2))
def test_equals_the_closed_form_at_any_velocity_and_frequency(name):
    V = np.geomspace(1e-9, 1e-3, 7)[:, None]
    frequency = np.geomspace(1e-5, 1e4, POINTS // 7)
    slider = Slider(LAWS[name][0], spring=K, load=W0)
    response = perturbation_response(slider, velocity=V, frequency=frequency)
    expected = coefficients(closed_form(name, V, frequency))
    # Far below the natural frequency the response is that of a constant load: what the modulation
    # changes is a small difference of terms of order one, hence the absolute tolerance.
    np.testing.assert_allclose(coefficients(response), expected, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize(("V", "frequency"), [(1e-6, 120.0), (1e-5, 120.0), (1e-5, 5.0)])
@pytest.mark.parametrize("name", population(["strength-area", *AGEING]))
def test_equals_an_integration_of_the_published_equations(reference, name, V, frequency):
    printed = reference.Printed(V=V, frequency=frequency, V0=BASE["V0"], **LAWS[name][1])
    expected = reference.expansion(printed)
    np.testing.assert_allclose(coefficients_at(name, V, frequency), expected, rtol=INTEGRATED)


@pytest.mark.parametrize(
    ("name", "mistake"),
    population(
        [
            ("elasto-plastic", {"load_rate": False}),  # dW/dt forgotten
            ("strength-area", {"product": False}),  # eta m term dropped
            ("linker-dieterich", {"load_rate": False}),
            ("linker-dieterich", {"alpha": 0.2 * BASE["B"]}),  # alpha in place of alpha/B
            ("elasto-plastic-age", {"ageing": "slider"}),
        ],
        short=2,
        several=True,
    ),
)
def test_the_integration_detects_planted_mistakes(reference, name, mistake):
    V, frequency = 1e-5, 20.0
    printed = reference.Printed(V=V, frequency=frequency, **{**LAWS[name][1], **mistake})
    difference = coefficients_at(name, V, frequency) / reference.expansion(printed) - 1
    assert np.abs(difference).max() > 100 * INTEGRATED


@pytest.mark.parametrize("name", ["rice-ruina", "elasto-plastic", "elasto-plastic-age"])
def test_sliding_loses_stability_at_the_critical_stiffness(name):
    law, variant = LAWS[name]
    p = SmallModulation(0.5, law.A, law.B, law.D0, K, W0, 1e-6, 1.0, lambda_=law.elastic_length)
    critical = critical_stiffness_elastic(p, variant.get("ageing", "slider"))
    stiffness = np.resize(critical * np.array([1 - 1e-6, 1.0, 1 + 1e-6]), POINTS)
    response = perturb(QuasiStatic(Slider(law, spring=stiffness, load=W0), 1e-6, 1.0))
    assert response.stable.tolist()[:3:2] == [False, True]
    scale = critical_pulsation(p)
    assert abs(response.eigenvalues[1, 0].real) < 1e-12 * scale
    # Multipliers are those of one period of 2 pi s.
    np.testing.assert_allclose(np.abs(response.multipliers[1, 0]), 1.0, rtol=1e-10)
    if name == "rice-ruina":
        np.testing.assert_allclose(critical, critical_stiffness(p), rtol=1e-14)
        np.testing.assert_allclose(abs(response.eigenvalues[1, 0].imag), scale, rtol=1e-7)


class TwoAges(RiceRuina):
    """Rice-Ruina friction with its age counted twice, each copy with half of B."""

    state_names = ("first", "second")

    def log_age(self, state, w):
        return (state[0] + state[1]) / 2

    def state_rate(self, v, v_plastic, state, w):
        return tuple(self.V0 / self.D0 * jnp.exp(-s) - v / self.D0 for s in state)

    def steady_state(self, v):
        return 2 * super().steady_state(v)


def test_a_law_with_three_states_is_expanded_too():
    point = {"velocity": np.resize([1e-6, 1e-5], POINTS), "frequency": 7.0}
    two = perturbation_response(Slider(TwoAges(**BASE), spring=K, load=W0), **point)
    one = perturbation_response(Slider(RiceRuina(**BASE), spring=K, load=W0), **point)
    np.testing.assert_allclose(coefficients(two), coefficients(one), rtol=1e-10)
    # The difference of the copies relaxes at the rate V/D0 on its own.
    relaxation = -point["velocity"] / BASE["D0"]
    assert two.eigenvalues.shape == (POINTS, 3)
    np.testing.assert_allclose(two.eigenvalues[:, 2], relaxation, rtol=1e-10)
    np.testing.assert_allclose(two.eigenvalues[:, :2], one.eigenvalues, rtol=1e-10)


def test_amontons_follows_the_load():
    response = perturbation_response(
        Slider(Amontons(mu0=0.5), spring=K, load=W0), velocity=[1e-6, 1e-5], frequency="120 Hz"
    )
    at = response.at(0.1)
    np.testing.assert_array_equal(at.mu1, [0.05, 0.05])
    for silent in (at.delta_mu, at.mu2, at.phase1):
        np.testing.assert_array_equal(silent, [0.0, 0.0])
    assert response.eigenvalues.shape == (2, 0)
    assert response.stable.tolist() == [True, True]


def test_amplitudes_and_phases_at_an_epsilon():
    slider = Slider(LAWS["linker-dieterich"][0], spring="0.2 N/um", load="7 N")
    response = perturbation_response(slider, velocity="1 um/s", frequency="120 Hz")
    at = response.at([1e-3, 2e-3])
    np.testing.assert_allclose(
        at.mu1 * np.exp(1j * at.phase1), np.array([1e-3, 2e-3]) * response.transfer
    )
    np.testing.assert_allclose(
        at.mu2 * np.exp(1j * at.phase2), np.array([1e-6, 4e-6]) * response.second_harmonic
    )
    np.testing.assert_allclose(at.delta_mu, np.array([1e-6, 4e-6]) * response.mean_curvature)


def test_arrays_broadcast_to_single_points():
    velocity = np.geomspace(1e-6, 1e-5, 7)[:, None]
    spring = np.geomspace(1e5, 4e5, POINTS // 7)
    law = LAWS["linker-dieterich"][0]
    grid = perturbation_response(
        Slider(law, spring=spring, load=W0), velocity=velocity, frequency=9
    )
    assert grid.transfer.shape == grid.omega.shape == (7, POINTS // 7)
    assert grid.eigenvalues.shape == grid.multipliers.shape == (7, POINTS // 7, 2)
    point = perturbation_response(
        Slider(law, spring=spring[2], load=W0), velocity=velocity[1, 0], frequency=9
    )
    assert point.transfer.shape == ()
    np.testing.assert_allclose(grid.second_harmonic[1, 2], point.second_harmonic, rtol=1e-12)
    np.testing.assert_allclose(grid.eigenvalues[1, 2], point.eigenvalues, rtol=1e-12)


def test_derivative_with_respect_to_a_parameter():
    def curvature(A):
        law = RiceRuina(**{**BASE, "A": A})
        slider = Slider(law, spring=K, load=W0)
        return perturb(QuasiStatic(slider, 1e-6, 240 * jnp.pi)).mean_curvature

    def expected(A):
        p = SmallModulation(0.5, A, BASE["B"], BASE["D0"], K, W0, 1e-6, 240 * jnp.pi)
        return ageing_response(p).mean_curvature

    derivative, exact = (jax.jit(jax.grad(f))(0.013) for f in (curvature, expected))
    np.testing.assert_allclose(derivative, exact, rtol=1e-10)


@pytest.mark.parametrize(
    ("name", "equations"),
    population(
        [
            ("elasto-plastic", {"inertia": True}),
            ("rice-ruina", {"radiation_damping": 2e3}),
            ("elasto-plastic", {"radiation_damping": 2e3}),
            ("rice-ruina", {"inertia": True}),
        ],
        short=2,
        several=True,
    ),
)
def test_equals_the_periodic_response_at_small_amplitudes(name, equations):
    slider = Slider(LAWS[name][0], spring=K, load=W0, mass=1.6)
    point = {"velocity": 1e-5, "frequency": 120.0, **equations}
    epsilon = np.array([1e-3, 2e-3])
    # Series would be tried in between, and leave such small harmonics.
    methods = ("fourier", "collocation")
    solved = periodic_response(slider, epsilon=epsilon, methods=methods, **point)
    assert solved.converged.all()
    small = perturbation_response(slider, **point)
    steady = float(slider.law.mu_ss(1e-5))
    steady += equations.get("radiation_damping", 0.0) * 1e-5 / W0

    def limit(values, order):
        """To fourth order in epsilon, from two amplitudes."""
        near, far = values / epsilon**order
        return (4 * near - far) / 3

    np.testing.assert_allclose(limit(solved.harmonics[:, 0], 1), small.transfer, rtol=1e-6)
    np.testing.assert_allclose(limit(solved.harmonics[:, 1], 2), small.second_harmonic, rtol=1e-5)
    mean = limit(solved.mean_friction - steady, 2)
    np.testing.assert_allclose(mean, small.mean_curvature, rtol=1e-5)
    multipliers = (4 * solved.multipliers[0] - solved.multipliers[1]) / 3
    seen = np.abs(small.multipliers) > 1e-6
    np.testing.assert_allclose(multipliers[seen], small.multipliers[seen], rtol=1e-5)
    for values in (small.transfer, small.eigenvalues, small.multipliers, small.stable):
        assert not isinstance(values, jax.Array)
    assert small.eigenvalues.shape == (len(solved.motion.mechanical) + 1,)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"velocity": 0.0}, "velocity must be positive, got 0 m/s"),
        ({"velocity": [1e-6, -1e-6]}, "velocity must be positive, got -1e-06 m/s"),
        ({"frequency": "-3 Hz"}, "frequency must be positive, got -3 Hz"),
        ({"frequency": "3 rad/s"}, "frequency"),
        ({"velocity": "3 N"}, "velocity"),
        ({"velocity": [1e-6] * 2, "frequency": [1.0] * 3}, r"got \(2,\), \(3,\)"),
    ],
)
def test_bad_input_is_named(bad, message):
    slider = Slider(LAWS["rice-ruina"][0], spring=K, load=W0)
    with pytest.raises(InputError, match=message):
        perturbation_response(slider, **({"velocity": 1e-6, "frequency": 120.0} | bad))


def test_an_uneven_track_has_no_steady_sliding_to_expand_about():
    law = on_uneven_track(RiceRuina(**BASE), amplitude=0.02, length="20 um", exponent=3.0)
    slider = Slider(law, spring=K, load=W0)
    with pytest.raises(InputError, match="must be the same everywhere"):
        perturbation_response(slider, velocity=1e-6, frequency=120.0)
