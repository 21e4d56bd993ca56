"""Slow modulation: branches through folds and canards, and the reasons why branches end."""

import numpy as np
import pytest

import asperity as asp
from asperity.orbit import Outcome
from asperity.orbit.methods.amplitude_continuation import AmplitudeContinuation, BranchMesh
from asperity.orbit.solution import SearchOptions
from asperity.slider.problem import checked_problem, flatten
from references.populations import population

pytestmark = pytest.mark.slow

#: V/(2 pi f D0), K/Kc, epsilon, and the outcome.
CORNER = {
    "an orbit at the end of a canard": (4.45, 0.43, 0.23, Outcome.CONVERGED),
    "a fold": (4.62, 0.88, 0.30, Outcome.FOLDED),
    "a runaway": (17.0, 0.28, 0.42, Outcome.RUNAWAY),
    "an orbit too unstable to follow": (69.0, 0.72, 0.64, Outcome.SENSITIVE),
}


@pytest.fixture
def solve(shooting):
    """The base slider, K, frequency and response of a point of the slow corner."""

    def solve(name):
        base, V = shooting(K=1.0), 1e-4
        q, stiffness, epsilon, _ = CORNER[name]
        K, frequency = stiffness * base.Kc, V / (2 * np.pi * q * base.D0)
        response = asp.periodic_response(
            asp.Slider(base.slider.law, spring=[K], load=base.W0),
            velocity=V,
            epsilon=epsilon,
            frequency=frequency,
            waveform=4096,
            methods=("collocation",),
        )
        return K, frequency, epsilon, response

    return solve


@pytest.mark.long
def test_an_orbit_at_the_end_of_a_canard_obeys_the_equations(solve, reference):
    K, frequency, epsilon, response = solve("an orbit at the end of a canard")
    assert response.converged[0]
    # Jumps of the slip rate by many orders of magnitude.
    assert np.ptp(response.waveform[1, 0]) > 10
    shot = reference.multiple_shooting(
        reference.Printed(K=K, V=1e-4, frequency=frequency),
        np.array([[epsilon]]),
        *response.waveform[..., ::8],
    )
    np.testing.assert_allclose(response.mean_friction, shot.mean, rtol=1e-7)
    error = np.abs(response.harmonics[:, :2] - shot.harmonics)
    assert (error <= 1e-6 * np.abs(shot.harmonics)).all()


# `orbit/test_periodic.py` has another runaway, `test_bifurcations.py` a fold, and
# `orbit/test_search.py` what the last one, which takes a minute, is called.
@pytest.mark.parametrize("name", population(list(CORNER)[1:], short=0))
def test_a_branch_that_does_not_arrive_has_a_reason(solve, name):
    _, _, epsilon, response = solve(name)
    assert response.outcome[0] == CORNER[name][-1]
    assert np.isnan(response.mean_friction[0])
    assert 0 < response.detail[0] < epsilon
    assert f"{response.detail[0]:.3g}" in response.result[0]


def test_slip_does_not_run_away_beyond_what_radiation_damping_permits(shooting):
    """eta v is at most the spring force: ln(v/V) is at most 17.4 in one case and 8.2 in the other.

    The coarse mesh loses both branches while their pulses grow.
    """
    base, V = shooting(K=1.0), 1e-4
    q, stiffness, epsilon, outcome = CORNER["a runaway"]
    given = checked_problem(
        asp.Slider(base.slider.law, spring=stiffness * base.Kc, load=base.W0),
        velocity=V,
        epsilon=epsilon,
        frequency=V / (2 * np.pi * q * base.D0),
        modulation=None,
        inertia=False,
        radiation_damping=np.array([1e-6, 1e-2]) * base.slider.law.A * base.W0 / V,
    )
    problem, _ = flatten(given)
    method = AmplitudeContinuation((BranchMesh(72, 100),))
    solution = method.solve(problem, SearchOptions(2, 0))
    assert solution.outcome.tolist() == [outcome, Outcome.NO_ORBIT]
