"""Slow modulation: branches through folds and canards, and what is said of those that end."""

import dataclasses

import numpy as np
import pytest

import asperity as asp
from asperity.loads import Harmonic
from asperity.orbit import Outcome
from asperity.orbit.methods.branch_following.from_steady_sliding import (
    MESHES,
    follow_from_steady_sliding,
)
from asperity.slider import equation_of_motion
from asperity.slider.problem import Problem, flatten


@pytest.fixture(scope="module")
def corner(shooting):
    """Points of the slow corner, by V/(2 pi f D0), K/Kc and epsilon."""
    base = shooting(K=1.0)
    rows = np.array(
        [
            # q, K/Kc, epsilon
            [4.45, 0.43, 0.23],
            [17.0, 0.28, 0.42],
            [4.62, 0.88, 0.30],
            [69.0, 0.72, 0.64],
        ]
    )
    q, stiffness, epsilon = rows.T
    numbers = {"V": 1e-4, "K": stiffness * base.Kc, "f": 1e-4 / (2 * np.pi * q * base.D0)}
    slider = asp.Slider(base.slider.law, spring=numbers["K"], load=base.W0)
    response = asp.periodic_response(
        slider,
        velocity=numbers["V"],
        epsilon=epsilon,
        frequency=numbers["f"],
        waveform=4096,
        methods=("collocation",),
    )
    return base, numbers, epsilon, response


def test_an_orbit_at_the_end_of_a_canard_is_found(corner):
    *_, response = corner
    assert response.converged[0]
    # Jumps of the slip rate by many orders of magnitude.
    assert np.ptp(response.waveform[1, 0]) > 10


def test_found_orbits_obey_the_equations(corner, reference):
    _, numbers, epsilon, response = corner
    rows = np.flatnonzero(response.converged)
    shot = reference.multiple_shooting(
        reference.Printed(
            K=numbers["K"][rows, None], V=numbers["V"], frequency=numbers["f"][rows, None]
        ),
        epsilon[rows, None],
        *response.waveform[:, rows, ::8],
    )
    np.testing.assert_allclose(response.mean_friction[rows], shot.mean, rtol=1e-7)
    error = np.abs(response.harmonics[rows, :2] - shot.harmonics)
    assert (error <= 1e-6 * np.abs(shot.harmonics)).all()


def test_what_does_not_arrive_says_why(corner):
    *_, epsilon, response = corner
    assert list(response.outcome[1:]) == [Outcome.RUNAWAY, Outcome.FOLDED, Outcome.SENSITIVE]
    for row in (1, 2, 3):
        assert np.isnan(response.mean_friction[row])
        assert 0 < response.detail[row] < epsilon[row]
        assert f"{response.detail[row]:.3g}" in response.result[row]


def test_folds_of_the_amplitude_are_those_of_the_continuation(shooting):
    # Nonlinear resonance: the branch folds at an epsilon far below the one asked for.
    p = dataclasses.replace(shooting(K=1.05 * shooting(K=1.0).Kc), frequency=0.37)
    motion = equation_of_motion(p.slider, np.array([p.V]), 2 * np.pi * np.array([p.frequency]))
    problem, _ = flatten(Problem(motion, Harmonic(np.array([0.01]))))
    followed = follow_from_steady_sliding(problem, np.arange(1), MESHES[0])
    assert followed.arrived[0]
    branch = asp.continuation(
        p.slider, parameter="epsilon", span=(0, 0.01), velocity=p.V, frequency=p.frequency
    )
    # Estimated between two neighbouring points.
    assert followed.fold[0] * 0.01 == pytest.approx(branch.bifurcations[0].value, rel=5e-3)
