"""Inertia, rigid asperities and a friction at rest: orbits end where the slider comes to rest."""

import numpy as np
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.orbit import Outcome
from asperity.slider.parameters import slider_from

NUMBERS = {
    "mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6, "V1": 1e-8, "V2": 1e-4,
    "K": 2e6, "W0": 7.0, "M": 1.6,
}  # fmt: skip
V, FREQUENCY = 1e-6, 120.0


def response(epsilon):
    slider = slider_from(asp.laws.CutOff, NUMBERS)
    return asp.periodic_response(
        slider, velocity=V, epsilon=epsilon, frequency=FREQUENCY, inertia=True
    )


def rest_within(periods, start, epsilon):
    """Whether the velocity vanishes, by SciPy on the printed equations."""
    mu0, A, B, D0, V0, V1, V2, K, W0, M = NUMBERS.values()
    f0 = mu0 - A * np.log(1 + V0 / V1) - B * np.log(1 + V2 / V0)

    def rates(t, y):
        F, v, age = y
        W = W0 * (1 + epsilon * np.cos(2 * np.pi * FREQUENCY * t))
        friction = f0 + A * np.log(1 + v / V1) + B * np.log(1 + V2 * age / D0)
        return [K * (V - v), (F - W * friction) / M, 1 - v * age / D0]

    def vanishes(t, y):
        return y[1]

    vanishes.terminal = True
    force, log_v, log_age = start
    first = [W0 * force, V * np.exp(log_v), D0 / V0 * np.exp(log_age)]
    span, atol = (0, periods / FREQUENCY), [1e-12, 1e-18, 1e-10]
    run = solve_ivp(rates, span, first, "Radau", events=vanishes, rtol=1e-8, atol=atol)
    assert run.success
    return run.status == 1


def test_the_amplitude_at_which_the_slider_comes_to_rest_is_that_of_the_printed_equations():
    stopped = response(0.3)
    assert stopped.outcome == Outcome.RESTS
    limit = float(stopped.detail)
    assert f"comes to rest once a period from epsilon = {limit:.3g} on" in stopped.result[()]
    below = response(0.999 * limit)
    assert below.stable
    assert not rest_within(4, below.start, 0.999 * limit)
    assert rest_within(4, below.start, 1.001 * limit)
