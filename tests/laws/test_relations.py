"""Published properties of single laws, and the inverse of laws without a closed form."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from scipy.special import lambertw

import asperity as asp
from asperity.laws import (
    CutOff,
    Law,
    Nagata,
    PerrinRiceZheng,
    PrakashClifton,
    Regularised,
    RiceRuina,
    RuinaSlip,
    TwoState,
    parameter,
)

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
K, W0, V = 2e5, 7.0, 1e-6
FREQUENCIES = np.geomspace(1e-2, 1e4, 7)
STATE = (jnp.asarray(0.7),)


def linear(law):
    slider = asp.Slider(law, spring=K, load=W0)
    return asp.perturbation_response(slider, velocity=V, frequency=FREQUENCIES)


class TestRestAndReversal:
    laws = pytest.mark.parametrize("law", [Regularised(**BASE), CutOff(**BASE, V1=1e-9, V2=1e-2)])

    @laws
    def test_force_and_velocity_are_odd(self, law):
        v = np.geomspace(1e-15, 1e3, 19)
        friction = law.friction(v, STATE, 1.0)
        np.testing.assert_array_equal(law.friction(-v, STATE, 1.0), -friction)
        np.testing.assert_allclose(law.velocity(-friction, STATE, 1.0), -v, rtol=1e-11, atol=1e-20)
        assert law.velocity(0.0, STATE, 1.0) == 0
        assert np.all(np.diff(friction) > 0)

    @laws
    def test_slip_in_either_direction_renews_the_contacts(self, law):
        np.testing.assert_array_equal(
            law.state_rate(-V, -V, STATE, 1.0), law.state_rate(V, V, STATE, 1.0)
        )
        (resting,) = law.state_rate(0.0, 0.0, STATE, 1.0)  # time passes: dPhi/dt = 1
        np.testing.assert_allclose(resting, 1e-6 / 4e-7 * np.exp(-0.7), rtol=1e-12)

    def test_regularised_creep_about_rest_is_viscous(self):
        """F/W = v/(2 V0) A exp((mu0 + B phi)/A): the slope of the hyperbolic sine at zero."""
        law = Regularised(**BASE)
        slope = 0.013 / 2e-6 * np.exp((0.5 + 0.026 * 0.7) / 0.013)
        assert law.friction(0.0, STATE, 1.0) == 0
        assert jax.grad(law.friction)(0.0, STATE, 1.0) == pytest.approx(slope, rel=1e-12)
        assert jax.grad(law.velocity)(0.0, STATE, 1.0) == pytest.approx(1 / slope, rel=1e-12)
        assert law.log_velocity(0.0, STATE, 1.0) == -np.inf

    def test_regularised_friction_does_not_overflow(self):
        law = Regularised(**BASE | {"A": 5e-4})
        friction = law.friction(np.array([-1.0, 1e-6, 1.0]), STATE, 1.0)
        expected = 0.5 + 5e-4 * np.log(1e6) + 0.026 * 0.7
        np.testing.assert_allclose(friction, [-expected, 0.5 + 0.026 * 0.7, expected], rtol=1e-13)
        log_v = law.log_velocity(np.array([0.1, 0.9]), STATE, 1.0)
        excess = (np.array([0.1, 0.9]) - 0.5 - 0.026 * 0.7) / 5e-4
        np.testing.assert_allclose(log_v, np.log(1e-6) + excess, rtol=1e-13)
        assert np.isfinite(law.velocity(np.array([-0.6, 0.0, 0.6]), STATE, 1.0)).all()

    def test_cut_off_law_sticks_below_its_static_friction(self):
        law = CutOff(**BASE, V1=1e-9, V2=1e-2)
        static = law.friction(0.0, STATE, 1.0)
        expected = 0.5 + 0.013 * np.log(1e-9 / (1e-6 + 1e-9))
        expected += 0.026 * np.log((np.exp(0.7) + 1e-4) / (1 + 1e-4))
        np.testing.assert_allclose(static, expected, rtol=1e-13)
        below = static - np.array([1e-6, 0.2])
        np.testing.assert_array_equal(law.velocity(below, STATE, 1.0), 0.0)
        np.testing.assert_array_equal(law.log_velocity(below, STATE, 1.0), -np.inf)
        slopes = jax.vmap(jax.grad(lambda f: jnp.exp(law.log_velocity(f, STATE, 1.0))))(below)
        np.testing.assert_array_equal(slopes, 0.0)

    def test_the_velocity_of_other_laws_is_the_exponential_of_its_logarithm(self):
        law = RiceRuina(**BASE)
        friction = np.array([-0.2, 0.0, 0.6])
        expected = 1e-6 * np.exp((friction - 0.5 - 0.026 * 0.7) / 0.013)
        np.testing.assert_allclose(law.velocity(friction, STATE, 1.0), expected, rtol=1e-12)


@pytest.mark.parametrize("kind", [RuinaSlip, PerrinRiceZheng])
def test_the_law_linearised_at_steady_sliding_is_the_ageing_law(kind):
    response, expected = linear(kind(**BASE)), linear(RiceRuina(**BASE))
    np.testing.assert_allclose(response.transfer, expected.transfer, rtol=1e-10)
    np.testing.assert_allclose(response.eigenvalues, expected.eigenvalues, rtol=1e-10)
    assert np.abs(response.mean_curvature / expected.mean_curvature - 1).max() > 0.1


def test_contacts_at_rest_age_in_all_laws_except_the_slip_law():
    v = 1e-30  # negligible slip: dPhi/dt = 1 or 0, with Phi = D0/V0 e^phi or twice that
    growth = 1e-6 / 4e-7 * np.exp(-0.7)
    rate = {kind: kind(**BASE).state_rate(v, v, STATE, 1.0)[0] for kind in (RiceRuina, RuinaSlip)}
    np.testing.assert_allclose(rate[RiceRuina], growth, rtol=1e-12)
    np.testing.assert_allclose(rate[RuinaSlip], 0.0, atol=1e-20)
    (prz,) = PerrinRiceZheng(**BASE).state_rate(v, v, STATE, 1.0)
    np.testing.assert_allclose(prz, growth / 2, rtol=1e-12)


def test_each_state_relaxes_over_its_memory_length():
    """At constant velocity the slip law's states decay exponentially with the slip."""
    law = TwoState(**BASE, B2=0.01, D2=5e-6)
    steady = law.steady_state(V)
    for factor in (1e-3, 1.0, 1e3):
        state = tuple(s + d for s, d in zip(steady, (0.3, -0.2), strict=True))
        state = tuple(s - np.log(factor) for s in state)
        rates = law.state_rate(V * factor, V * factor, state, 1.0)
        expected = [-V * factor * 0.3 / 4e-7, V * factor * 0.2 / 5e-6]
        np.testing.assert_allclose(rates, expected, rtol=1e-12)


def test_eigenvalues_of_the_two_state_law_agree_with_linearisation_by_hand():
    """Eigenvalues of steady sliding, linearised by hand in (F/W0, phi, phi2)."""
    A, B, B2, D0, D2 = 0.013, 0.026, 0.01, 4e-7, 5e-6
    eigenvalues = linear(TwoState(**BASE, B2=B2, D2=D2)).eigenvalues[0]
    log_v = np.array([1, -B, -B2]) / A  # derivatives of ln v by the states
    rates = [
        -K / W0 * V * log_v,
        -V / D0 * (np.eye(3)[1] + log_v),
        -V / D2 * (np.eye(3)[2] + log_v),
    ]
    expected = np.linalg.eigvals(np.array(rates))
    order = np.lexsort
    np.testing.assert_allclose(
        eigenvalues[order((eigenvalues.imag, eigenvalues.real))],
        expected[order((expected.imag, expected.real))],
        rtol=1e-9,
    )


def test_weakening_by_shear_stress_reduces_the_direct_effect():
    """At constant load a velocity jump v -> v' changes F/W by A/(1 + c) ln(v'/v)."""
    law = Nagata(**BASE | {"A": 0.051, "B": 0.0565}, c=2.0)
    steady = law.steady_state(V)
    jump = law.friction(10 * V, steady, 1.0) - law.friction(V, steady, 1.0)
    assert jump == pytest.approx(0.051 / 3 * np.log(10), rel=1e-12)


@pytest.mark.parametrize("w", [0.5, 1.0, 1.6])
def test_nagatas_age_obeys_the_printed_law(w):
    """D Phi/dt = 1 - v Phi/D0 - (c/B) Phi dF/dt/W0, as velocity and load change."""
    p = BASE | {"A": 0.051, "B": 0.0565}
    law, c = Nagata(**p, c=2.0), 2.0
    v, v_rate, w_rate = 3e-6, 2e-6, 0.4
    s = law.steady_state(1e-6)[0] + 0.2
    (s_rate,) = law.state_rate(v, v, (s,), w)

    def force(v, s, w):
        return w * law.friction(v, (s,), w)

    F, F_rate = jax.jvp(force, (v, s, w), (v_rate, s_rate, w_rate))
    log_age = (F / w - p["mu0"] - p["A"] * np.log(v / p["V0"])) / p["B"]  # printed friction
    age = p["D0"] / p["V0"] * np.exp(log_age)
    age_rate = age * (s_rate - c / p["B"] * F_rate)  # of ln Phi = s - (c/B) F/W0
    np.testing.assert_allclose(log_age, s - c / p["B"] * F, rtol=1e-12)
    printed = 1 - v * age / p["D0"] - c / p["B"] * age * F_rate
    np.testing.assert_allclose(age_rate, printed, rtol=1e-12)


class TestMemoryOfTheLoad:
    L, V_star = 3e-7, 1e-7

    def law(self):
        return PrakashClifton(**BASE, L=self.L, V_star=self.V_star)

    def test_the_effective_load_relaxes_over_a_slip_and_a_time(self):
        """D W_e/dt = -(|v| + V_star)/L (W_e - W)."""
        for v in (0.0, 2e-6, -2e-6):
            _, rate = self.law().state_rate(v, v, (0.0, jnp.log(0.8)), 1.3)
            expected = -(abs(v) + self.V_star) / self.L * (0.8 - 1.3)
            np.testing.assert_allclose(0.8 * rate, expected, rtol=1e-12)

    def test_the_effective_load_is_a_low_pass_of_small_modulations(self):
        """To first order W_e = W/(1 + i omega L/(V + V_star)), and F depends on W_e as on W."""
        through = 1 / (1 + 2j * np.pi * FREQUENCIES * self.L / (V + self.V_star))
        expected = linear(RiceRuina(**BASE)).transfer * through
        np.testing.assert_allclose(linear(self.law()).transfer, expected, rtol=1e-10, atol=1e-16)


SPEEDS = 10.0 ** np.arange(-15, 4)
#: Error of ln v, of up to 35: round-off of a friction near 1, over A.
ROUND_OFF = 1e-12


class Viscous(RiceRuina):
    """Rice-Ruina friction and a viscous term, without an inverse in elementary functions."""

    name: ClassVar[str] = "viscous"

    drag: float = parameter("law.drag", "dimensionless")  # friction gained per V0

    log_velocity = Law.log_velocity

    def friction(self, v, state, w):
        return super().friction(v, state, w) + self.drag * v / self.V0


def by_lambert(law, friction, log_age):
    """ln v with A ln(v/V0) + drag v/V0 = friction - mu0 - B phi, by SciPy's Lambert function."""
    A, drag = float(law.A), float(law.drag)
    exponent = (friction - float(law.mu0) - float(law.B) * log_age) / A
    return np.log(float(law.V0) * A / drag * lambertw(drag / A * np.exp(exponent)).real)


@pytest.mark.parametrize("drag", [1e-9, 1e-3, 1.0])
def test_the_inverse_of_a_viscous_law_is_lamberts_function(drag):
    law = Viscous(**BASE, drag=drag)
    log_age = np.random.default_rng(1).uniform(-8, 8, SPEEDS.shape)
    friction = law.friction(SPEEDS, (log_age,), 1.0)
    log_v = law.log_velocity(friction, (log_age,), 1.0)
    # In a force that is mostly drag, ln v is known to the round-off of the force over A only.
    error = ROUND_OFF * np.maximum(1, np.abs(np.asarray(friction)))
    assert (np.abs(log_v - np.log(SPEEDS)) <= error).all()
    finite = np.abs(friction - 0.5 - 0.026 * log_age) / 0.013 < 700  # for SciPy's argument
    expected = by_lambert(law, friction[finite], log_age[finite])
    assert finite.sum() >= 10
    assert (np.abs(log_v[finite] - expected) <= error[finite]).all()


@pytest.mark.parametrize("law", [RiceRuina(**BASE), Regularised(**BASE)], ids=["log", "asinh"])
@pytest.mark.parametrize("log_age", [-30.0, 0.0, 30.0])
def test_the_inverse_finds_any_velocity(law, log_age):
    state = (jnp.full(SPEEDS.shape, log_age),)
    log_v = Law.log_velocity(law, law.friction(SPEEDS, state, 1.0), state, 1.0)
    # Where the force vanishes, ln v is as accurate as the logarithm of the force.
    np.testing.assert_allclose(log_v, np.log(SPEEDS), rtol=0, atol=2e-11)


def test_the_inverse_finds_velocities_far_below_and_above_a_cut_off():
    law = CutOff(**BASE, V1=1e-3, V2=1e9)
    speeds = np.array([1e-9, 1e-6, 1e-3, 1.0, 1e3])
    state = (jnp.zeros(5),)
    log_v = Law.log_velocity(law, law.friction(speeds, state, 1.0), state, 1.0)
    # Far below V1 the force determines v/V1 to round-off of the force over A.
    np.testing.assert_allclose(np.exp(log_v), speeds, rtol=1e-11, atol=1e-14 * 1e-3 / 0.013)


def test_the_inverse_of_an_impossible_force_is_infinite():
    law = CutOff(**BASE, V1=1e-8, V2=1e9)
    threshold = law.friction(0.0, (0.0,), 1.0)
    friction = threshold + jnp.array([-0.1, -1e-6, 1e-6])
    log_v = Law.log_velocity(law, friction, (jnp.zeros(3),), 1.0)
    np.testing.assert_array_equal(log_v[:2], -np.inf)
    np.testing.assert_allclose(log_v[2], law.log_velocity(friction[2], (0.0,), 1.0), atol=1e-9)

    class Bounded(RiceRuina):
        name = "bounded"

        def friction(self, v, state, w):
            return self.mu0 + self.A * v / (v + self.V0)

    log_v = Law.log_velocity(Bounded(**BASE), jnp.array([0.49, 0.506, 0.52]), (), 1.0)
    np.testing.assert_allclose(log_v, [-np.inf, np.log(1e-6 * 6 / 7), np.inf])


@jax.jit
def scaled_inverse(logs, friction, log_age):
    """ln v of a viscous law whose parameters are multiplied by e^logs."""
    numbers = {**BASE, "drag": 1e-3}
    law = Viscous(**numbers | {k: numbers[k] * jnp.exp(log) for k, log in logs.items()})
    return law.log_velocity(friction, (log_age,), 1.0)


SLOPES = [scaled_inverse]
for _ in range(3):
    SLOPES.append(jax.jit(jax.grad(SLOPES[-1], argnums=1)))


LOGS = {"mu0": 0.0, "A": 0.0, "B": 0.0, "V0": 0.0, "drag": 0.0}


def test_derivatives_by_parameters_agree_with_differences():
    friction = float(Viscous(**BASE, drag=1e-3).friction(1e-1, (0.3,), 1.0))
    inverse = lambda logs, f, phi: scaled_inverse(logs, friction + 0.01 * f, phi)  # noqa: E731
    options = {"order": 2, "modes": ["fwd"], "rtol": 1e-5, "atol": 1e-6, "eps": 1e-5}
    check_grads(inverse, (LOGS, 0.0, 0.3), **options)


@pytest.mark.parametrize("v", [1e-12, 1e-1])
def test_derivatives_by_friction_to_third_order_agree_with_closed_forms(v):
    log_age = 0.3
    friction = float(Viscous(**BASE, drag=1e-3).friction(v, (log_age,), 1.0))
    # d ln v / dF = 1/(A + c) with c = drag v/V0, and its derivatives by F.
    A, c = 0.013, 1e-3 * v / 1e-6
    expected = [1 / (A + c), -c / (A + c) ** 3, -c * (A - 2 * c) / (A + c) ** 5]
    slopes = [slope(LOGS, friction, log_age) for slope in SLOPES[1:]]
    np.testing.assert_allclose(slopes, expected, rtol=1e-8)


def test_the_inverse_works_within_jit_and_vmap():
    law = Viscous(**BASE, drag=1e-3)
    state = (jnp.linspace(-3, 3, 4),)
    friction = jnp.linspace(0.4, 0.6, 4)
    expected = law.log_velocity(friction, state, 1.0)
    compiled = jax.jit(jax.vmap(lambda f, phi: law.log_velocity(f, (phi,), 1.0)))
    np.testing.assert_allclose(compiled(friction, *state), expected, rtol=1e-13)
    slopes = jax.jit(jax.vmap(jax.grad(lambda f, phi: law.log_velocity(f, (phi,), 1.0))))
    v = np.exp(expected)
    np.testing.assert_allclose(slopes(friction, *state), 1 / (0.013 + 1e-3 * v / 1e-6), rtol=1e-10)
