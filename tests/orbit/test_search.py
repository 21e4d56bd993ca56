"""The search as a list of methods, and the outcome of points without an orbit."""

import numpy as np
import pytest

import asperity as asp
from asperity.laws import RiceRuina
from asperity.loads import Harmonic, Periodic
from asperity.orbit.methods import collocation
from asperity.orbit.methods.amplitude_continuation import RUNAWAY, continues
from asperity.orbit.outcome import Outcome, sentence
from asperity.orbit.search import find_orbits, mark_too_unstable
from asperity.orbit.solution import Method, SearchOptions, Solution
from asperity.slider import equation_of_motion
from asperity.slider.problem import Problem, flatten

A, B, D0, W0, V = 0.013, 0.026, 4e-7, 7.0, 1e-4
KC = (B - A) * W0 / D0
OPTIONS = SearchOptions(1, 0, lambda _: None)


def points(stiffness, frequency, epsilon):
    """One point for each stiffness."""
    slider = asp.Slider(RiceRuina(mu0=0.5, A=A, B=B, D0=D0, V0=1e-6), spring=stiffness, load=W0)
    ones = np.ones(len(stiffness))
    motion = equation_of_motion(slider, V * ones, 2 * np.pi * frequency * ones)
    return flatten(Problem(motion, Harmonic(epsilon * ones)))[0]


@pytest.mark.parametrize(
    ("outcome", "share", "epsilon"),
    [
        (Outcome.NO_ORBIT, 0.5, 0.2),
        (Outcome.NO_ORBIT, 1.001, 0.4),
        (Outcome.NOT_RESOLVED, 3e-8, 0.4),
    ],
)
def test_failed_points_with_large_growth_are_too_unstable(outcome, share, epsilon):
    # D0/V = 4 ms and a period of 10 s: far below Kc disturbances grow by far more than e^15.
    problem = points(np.array([2.0, 2.0, 0.1]) * KC, 0.1, 0.4)
    solution = Solution.empty(2, 3, OPTIONS)
    rows = np.array([2, 0])
    solution.outcome[rows], solution.detail[rows] = outcome, share
    solution.outcome[1] = Outcome.CONVERGED
    mark_too_unstable(problem, solution)
    assert solution.outcome.tolist() == [outcome, Outcome.CONVERGED, Outcome.SENSITIVE]
    assert solution.detail[2] == pytest.approx(epsilon, rel=1e-12)
    assert solution.detail[0] == share


def test_a_pull_that_is_too_unstable_to_follow_has_no_epsilon_at_which_it_is_lost():
    problem = points(np.array([0.1]) * KC, 0.1, 0.4)._replace(
        load=Periodic(pull=((np.array([0.4]), np.zeros(1)),))
    )
    solution = Solution.empty(2, 1, OPTIONS)
    solution.detail[:] = 0.5
    mark_too_unstable(problem, solution)
    assert "the branch stops at 0.5 of the requested amplitude" in sentence(*solution.outcome, 0.5)


def test_multipliers_that_stay_unresolved_keep_their_last_change(monkeypatch):
    def refine(problem, solution, *_):
        solution.outcome[:] = [Outcome.MULTIPLIERS_NOT_RESOLVED, Outcome.NOT_RESOLVED]
        solution.detail[:] = 5e-7

    monkeypatch.setattr(collocation, "refine", refine)
    problem = points(np.full(2, KC), 0.1, 0.4)
    solution = collocation.refined_where_resolved(problem, OPTIONS, None, None)
    assert solution.outcome.tolist() == [Outcome.MULTIPLIERS_NOT_RESOLVED, Outcome.NO_ORBIT]
    assert solution.detail.tolist() == [5e-7, 0.0]


def test_a_branch_close_to_arriving_may_exceed_the_runaway_limit_a_little():
    fastest = RUNAWAY + np.array([0.2, 0.2, 0.9, -0.1])
    continued = continues(np.array([0.995, 0.9, 0.995, 0.9]), fastest)
    assert continued.tolist() == [True, False, False, True]


class Stub(Method):
    """Gives every point the same outcome."""

    name, choice = "stub", "stub"

    def __init__(self, outcome, detail):
        self.outcome, self.detail, self.given = outcome, detail, []

    def suits(self, problem):
        return True

    def solve(self, problem, options):
        solution = Solution.empty(2, len(problem.system.V), options)
        self.given.append(len(problem.system.V))
        solution.outcome[:], solution.detail[:] = self.outcome, self.detail
        if self.outcome == Outcome.CONVERGED:
            solution.mean_friction[:] = self.detail
        return solution


def search(*methods):
    problem = points(np.array([2.0, 3.0]) * KC, 40.0, 0.6)
    return find_orbits(problem, OPTIONS, methods)


def test_a_failed_method_keeps_the_earlier_outcome():
    solution = search(Stub(Outcome.FOLDED, 0.3), Stub(Outcome.NO_ORBIT, 0.0))
    assert solution.outcome.tolist() == [Outcome.FOLDED] * 2
    assert solution.detail.tolist() == [0.3] * 2


def test_points_go_from_method_to_method_until_one_solves_them():
    solving, late = Stub(Outcome.CONVERGED, 0.5), Stub(Outcome.CONVERGED, 0.6)
    solution = search(Stub(Outcome.FOLDED, 0.3), solving, late)
    assert (solving.given, late.given) == ([2], [])
    assert solution.mean_friction.tolist() == [0.5, 0.5]
    assert solution.method.tolist() == ["stub", "stub"]


def test_a_point_whose_branch_was_not_followed_has_no_outcome_of_a_branch():
    """Slow modulation, for which the fast method alone does not iterate."""
    law = asp.laws.RiceRuina(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6)
    response = asp.periodic_response(
        asp.Slider(law, spring=2e5, load=7.0),
        velocity=1e-6,
        epsilon=0.24,
        frequency=0.01,
        methods=("fourier",),
    )
    assert not response.converged
    assert "no method found a periodic orbit" in str(response.result)
