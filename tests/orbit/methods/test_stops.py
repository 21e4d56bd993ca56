"""Inertia on rigid asperities: a slider that stops within 1e-8 of the period."""

import numpy as np

import asperity as asp
from asperity.orbit.methods.from_transient import settled_orbits
from asperity.slider.problem import checked_problem, flatten

A, B, D0, V0, MU0, W0 = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7.0
V, FREQUENCY, K, M = 1.5e-6, 1.775, 9.9e5, 147.0

LAW = asp.laws.RiceRuina(mu0=MU0, A=A, B=B, D0=D0, V0=V0)
SLIDER = asp.Slider(LAW, spring=K, load=W0, mass=M)


def test_the_states_of_a_stiff_initial_guess_are_those_of_the_transient():
    """The rates at interpolated states are wrong by far: ln v at a stage was 1e7."""
    drive = {"velocity": V, "epsilon": 0.6, "frequency": FREQUENCY}
    problem, _ = flatten(checked_problem(SLIDER, **drive, inertia=True))
    orbit, settled = settled_orbits(problem, np.arange(1))
    assert settled.tolist() == [0]
    at_nodes, at_stages = orbit.centre[1] + orbit.nodes[1], orbit.stage_states[1]
    assert at_nodes.min() - 1 < at_stages.min() < at_stages.max() < at_nodes.max() + 1
