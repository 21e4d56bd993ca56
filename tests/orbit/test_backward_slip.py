"""Where slip would reverse: SciPy with slip that is odd in the interface force.

The laws of the package are not. Under a small negative force both agree: both slip rates are
negligible.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp

A, B, D0, V0, MU0, W0, K, M = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7.0, 2e5, 1.6


def odd_slip(friction, phi):
    return 2 * V0 * np.sinh(friction / A) * np.exp(-(MU0 + B * phi) / A)


def ageing(phi, speed):
    return V0 / D0 * np.exp(-phi) - speed / D0


def closed_period(rates, start, frequency):
    """States over a period from the start, which they must reach again."""
    period = 1 / frequency
    times = np.linspace(0, period, 4001)
    run = solve_ivp(rates, (0, period), start, "LSODA", times, rtol=1e-11, atol=1e-13)
    assert run.success
    np.testing.assert_allclose(run.y[:, -1], start, rtol=1e-7, atol=1e-8)
    return times, run.y


def mean(values):
    return values[:-1].mean()


@pytest.mark.parametrize(("amplitude", "reverses"), [(0.3, False), (0.5, True)])
def test_a_shear_force_that_exceeds_the_spring_force(amplitude: float, reverses: bool) -> None:
    V, frequency = 1e-6, 120.0
    theta = 2 * np.pi * np.arange(64) / 64
    load = asp.loads.sampled(shear=amplitude * np.cos(theta))

    def response(law):
        slider = asp.Slider(law(mu0=MU0, A=A, B=B, D0=D0, V0=V0), spring=K, load=W0)
        return asp.periodic_response(slider, velocity=V, frequency=frequency, modulation=load)

    def shear(t):
        return amplitude * np.cos(2 * np.pi * frequency * t)

    def rates(t, y):
        slip = odd_slip(y[0] + shear(t), y[1])
        return [K * (V - slip) / W0, ageing(y[1], abs(slip))]

    odd, forwards = response(asp.laws.Regularised), response(asp.laws.RiceRuina)
    t, (force, phi) = closed_period(rates, odd.start, frequency)
    assert odd.mean_friction == pytest.approx(mean(force), abs=1e-9)
    assert (force + shear(t)).min() < -0.05
    backwards = -odd_slip(force + shear(t), phi).min() / V
    assert (backwards > 1e-10) == reverses
    assert forwards.converged
    assert (forwards.reverses, odd.reverses) == (reverses, False)
    assert ("slip would reverse" in forwards.result[()]) == reverses
    if not reverses:
        assert forwards.mean_friction == pytest.approx(mean(force), abs=1e-9)


#: Velocity, epsilon, frequency, lambda, and whether slip would reverse: the slider swings on its
#: asperities.
POINTS = ((1.4e-6, 0.76, 426.0, 3.8e-9, False), (3.3e-6, 0.947, 158.9, 4.38e-7, True))


@pytest.mark.parametrize(("V", "epsilon", "frequency", "length", "reverses"), POINTS)
def test_inertia_that_throws_the_slider_back(
    V: float, epsilon: float, frequency: float, length: float, reverses: bool
) -> None:
    law = asp.laws.ElastoPlastic(mu0=MU0, A=A, B=B, D0=D0, V0=V0, lambda_=length)
    slider = asp.Slider(law, spring=K, mass=M, load=W0)
    point = {"velocity": V, "frequency": frequency, "inertia": True}
    r = asp.periodic_response(slider, epsilon=epsilon, **point)
    omega = 2 * np.pi * frequency

    def rates(t, y):
        force, v, friction, phi = y
        slip = odd_slip(friction, phi) / V
        net = force - (1 + epsilon * np.cos(omega * t)) * friction
        return [
            K * V / W0 * (1 - v),
            W0 * net / (M * V),
            V / length * (v - slip),
            ageing(phi, v * V),  # by the velocity of the slider, as printed
        ]

    assert r.converged
    assert r.reverses == reverses
    if not reverses:
        _, states = closed_period(rates, r.start, frequency)
        assert states[2].min() < -0.01
        assert r.mean_friction == pytest.approx(mean(states[0]), rel=1e-8)


@pytest.mark.parametrize("inertia", [False, True])
def test_all_methods_say_so(inertia: bool) -> None:
    """Shear forces of 0.3 and 0.4 of the load, below and above the limit."""
    law = asp.laws.ElastoPlastic(mu0=MU0, A=A, B=B, D0=D0, V0=V0, lambda_=7e-7)
    slider = asp.Slider(law, spring=K, mass=M, load=W0)
    theta = 2 * np.pi * np.arange(8) / 8
    for amplitude in (0.3, 0.4):
        load = asp.loads.sampled(shear=amplitude * np.cos(theta))
        r = asp.periodic_response(
            slider,
            velocity=1e-6,
            frequency=120.0,
            modulation=load,
            inertia=inertia,
            methods=("collocation",),
        )
        assert r.converged
        assert r.reverses == (amplitude > 0.35)


def test_a_fit_asks_at_its_estimates() -> None:
    """Near the resonance on the asperities, which the second harmonic of the load meets."""
    law = asp.laws.ElastoPlastic(mu0=MU0, A=A, B=B, D0=D0, V0=V0, lambda_=7e-7)
    slider = asp.Slider(law, spring=K, mass=M, load=W0)
    epsilon, at = np.array([0.05, 0.2]), {"velocity": 1e-6, "frequency": 200.0, "inertia": True}
    r = asp.periodic_response(slider, epsilon=epsilon, **at)
    assert r.reverses.tolist() == [False, True]
    numbers = {"mu0": MU0, "A": A, "B": B, "D0": D0, "V0": V0, "lambda": 7e-7, "K": K, "W0": W0}
    numbers |= {"M": M, "V": 1e-6, "frequency": 200.0, "epsilon": epsilon}
    function = asp.response_function("elasto-plastic", inertia=True, search="coarse")
    assert function.reverses(numbers).tolist() == [False, True]
