"""The generic inverse, on a law whose inverse is Lambert's function and on saturating laws."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from scipy.special import lambertw

from asperity.laws import CutOff, Law, Regularised, RiceRuina, parameter

BASE = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
SPEEDS = 10.0 ** np.arange(-15, 4)
#: Of ln v, about 35 at most: round-off of a friction near 1, over A.
ROUND_OFF = 1e-12


class Viscous(RiceRuina):
    """Rice-Ruina friction and a viscous term, which has no inverse in elementary functions."""

    name: ClassVar[str] = "viscous"

    drag: float = parameter("law.drag", "dimensionless")  # friction gained per V0

    log_velocity = Law.log_velocity

    def friction(self, v, state, w):
        return super().friction(v, state, w) + self.drag * v / self.V0


def by_lambert(law, friction, log_age):
    """V with A ln(v/V0) + drag v/V0 = friction - mu0 - B phi, as ln v; SciPy's function."""
    A, drag = float(law.A), float(law.drag)
    exponent = (friction - float(law.mu0) - float(law.B) * log_age) / A
    return np.log(float(law.V0) * A / drag * lambertw(drag / A * np.exp(exponent)).real)


@pytest.mark.parametrize("drag", [1e-9, 1e-3, 1.0])
def test_it_is_lamberts_function(drag):
    law = Viscous(**BASE, drag=drag)
    log_age = np.random.default_rng(1).uniform(-8, 8, SPEEDS.shape)
    friction = law.friction(SPEEDS, (log_age,), 1.0)
    found = law.log_velocity(friction, (log_age,), 1.0)
    # Of a force that is mostly drag, A ln v is known to round-off of the force over A only.
    error = ROUND_OFF * np.maximum(1, np.abs(np.asarray(friction)))
    assert (np.abs(found - np.log(SPEEDS)) <= error).all()
    finite = np.abs(friction - 0.5 - 0.026 * log_age) / 0.013 < 700  # of SciPy's argument
    expected = by_lambert(law, friction[finite], log_age[finite])
    assert finite.sum() >= 10
    assert (np.abs(found[finite] - expected) <= error[finite]).all()


@pytest.mark.parametrize("law", [RiceRuina(**BASE), Regularised(**BASE)], ids=["log", "asinh"])
@pytest.mark.parametrize("log_age", [-30.0, 0.0, 30.0])
def test_any_velocity_is_found(law, log_age):
    state = (jnp.full(SPEEDS.shape, log_age),)
    found = Law.log_velocity(law, law.friction(SPEEDS, state, 1.0), state, 1.0)
    # Where friction saturates, at a vanishing force, ln v is as good as ln of the force.
    np.testing.assert_allclose(found, np.log(SPEEDS), rtol=0, atol=2e-11)


def test_a_saturated_force_is_found_from_either_side():
    law = CutOff(**BASE, V1=1e-3, V2=1e9)
    speeds = np.array([1e-9, 1e-6, 1e-3, 1.0, 1e3])
    state = (jnp.zeros(5),)
    found = Law.log_velocity(law, law.friction(speeds, state, 1.0), state, 1.0)
    # Far below V1 the force holds v/V1 to round-off of the force over A.
    np.testing.assert_allclose(np.exp(found), speeds, rtol=1e-11, atol=1e-14 * 1e-3 / 0.013)


def test_a_force_too_small_or_too_large_is_carried_at_no_velocity():
    law = CutOff(**BASE, V1=1e-8, V2=1e9)
    threshold = law.friction(0.0, (0.0,), 1.0)
    friction = threshold + jnp.array([-0.1, -1e-6, 1e-6])
    found = Law.log_velocity(law, friction, (jnp.zeros(3),), 1.0)
    np.testing.assert_array_equal(found[:2], -np.inf)
    np.testing.assert_allclose(found[2], law.log_velocity(friction[2], (0.0,), 1.0), atol=1e-9)

    class Bounded(RiceRuina):
        name = "bounded"

        def friction(self, v, state, w):
            return self.mu0 + self.A * v / (v + self.V0)

    found = Law.log_velocity(Bounded(**BASE), jnp.array([0.49, 0.506, 0.52]), (), 1.0)
    np.testing.assert_allclose(found, [-np.inf, np.log(1e-6 * 6 / 7), np.inf])


@jax.jit
def scaled_inverse(logs, friction, log_age):
    """Of a viscous law whose parameters are multiplied by e^logs."""
    numbers = {**BASE, "drag": 1e-3}
    law = Viscous(**numbers | {k: numbers[k] * jnp.exp(log) for k, log in logs.items()})
    return law.log_velocity(friction, (log_age,), 1.0)


SLOPES = [scaled_inverse]
for _ in range(3):
    SLOPES.append(jax.jit(jax.grad(SLOPES[-1], argnums=1)))


LOGS = {"mu0": 0.0, "A": 0.0, "B": 0.0, "V0": 0.0, "drag": 0.0}


def test_derivatives_to_parameters_by_differences():
    friction = float(Viscous(**BASE, drag=1e-3).friction(1e-1, (0.3,), 1.0))
    inverse = lambda logs, f, phi: scaled_inverse(logs, friction + 0.01 * f, phi)  # noqa: E731
    options = {"order": 2, "modes": ["fwd"], "rtol": 1e-5, "atol": 1e-6, "eps": 1e-5}
    check_grads(inverse, (LOGS, 0.0, 0.3), **options)


@pytest.mark.parametrize("v", [1e-12, 1e-1])
def test_derivatives_to_the_third_order(v):
    log_age = 0.3
    friction = float(Viscous(**BASE, drag=1e-3).friction(v, (log_age,), 1.0))
    # d ln v / dF = 1/(A + c), c = drag v/V0: derivatives of that with respect to F, by hand.
    A, c = 0.013, 1e-3 * v / 1e-6
    expected = [1 / (A + c), -c / (A + c) ** 3, -c * (A - 2 * c) / (A + c) ** 5]
    found = [slope(LOGS, friction, log_age) for slope in SLOPES[1:]]
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_it_compiles_and_maps():
    law = Viscous(**BASE, drag=1e-3)
    state = (jnp.linspace(-3, 3, 4),)
    friction = jnp.linspace(0.4, 0.6, 4)
    expected = law.log_velocity(friction, state, 1.0)
    one = jax.jit(jax.vmap(lambda f, phi: law.log_velocity(f, (phi,), 1.0)))
    np.testing.assert_allclose(one(friction, *state), expected, rtol=1e-13)
    slopes = jax.jit(jax.vmap(jax.grad(lambda f, phi: law.log_velocity(f, (phi,), 1.0))))
    v = np.exp(expected)
    np.testing.assert_allclose(slopes(friction, *state), 1 / (0.013 + 1e-3 * v / 1e-6), rtol=1e-10)
