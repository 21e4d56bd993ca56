"""Inertia on rigid asperities: the branch ends where the interface force vanishes, by SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.orbit import Outcome

A, B, D0, V0, MU0, W0, ALPHA = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7.0, 0.2
V, FREQUENCY, K, M = 2.4e-5, 1.084, 6.5e5, 347.0

LAW = asp.laws.LinkerDieterich(mu0=MU0, A=A, B=B, D0=D0, V0=V0, alpha=ALPHA)
SLIDER = asp.Slider(LAW, spring=K, load=W0, mass=M)


def response(epsilon):
    return asp.periodic_response(
        SLIDER, velocity=V, epsilon=epsilon, frequency=FREQUENCY, inertia=True
    )


def force_at_stop(start, epsilon):
    """F/W0 where the slider stops: F_i/W0 while it sticks, and smallest there, since F then rises.

    By Radau's method in ln v, on the printed equations.
    """
    omega = 2 * np.pi * FREQUENCY

    def rates(t, y):
        load, slope = 1 + epsilon * np.cos(omega * t), -epsilon * omega * np.sin(omega * t)
        friction = MU0 + A * (y[1] + np.log(V / V0)) + B * y[2]
        v = V * np.exp(y[1])
        ageing = V0 / D0 * np.exp(-y[2]) - v / D0
        return [
            K * (V - v) / W0,
            W0 * (y[0] - load * friction) / (M * v),
            ageing - ALPHA / B * slope / load,
        ]

    def stops(t, y):
        return y[1] + 14

    stops.terminal = True
    # The third state of an orbit contains the load.
    y = start - np.array([0, 0, ALPHA / B * np.log(1 + epsilon)])
    run = solve_ivp(
        rates, (0, 1 / FREQUENCY), y, "Radau", events=stops, rtol=1e-9, atol=[1e-12, 1e-9, 1e-9]
    )
    assert run.status == 1
    return run.y[0, -1]


@pytest.mark.long
def test_the_branch_ends_at_the_amplitude_at_which_the_interface_force_vanishes():
    """A transient reverses at all these amplitudes, and meshes end at 9/10 of the limit."""
    beyond = response(0.83)
    assert beyond.outcome == Outcome.REVERSES
    limit = float(beyond.detail)
    assert f"vanishes once a period from epsilon = {limit:.3g} on" in beyond.result[()]
    below = response(0.998 * limit)
    assert below.stable
    assert 0 < force_at_stop(below.start, 0.998 * limit) < 0.01
    assert force_at_stop(below.start, 1.002 * limit) < 0
