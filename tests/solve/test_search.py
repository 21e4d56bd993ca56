"""What is said of points that are left without an orbit."""

import numpy as np
import pytest

import asperity as asp
from asperity.laws import RiceRuina
from asperity.loads import Harmonic
from asperity.slider import equation_of_motion
from asperity.solve import search
from asperity.solve.continuation.pursuit import RUNAWAY, _Walked
from asperity.solve.found import Found, Options
from asperity.solve.kernels import Problem
from asperity.solve.outcome import Outcome
from asperity.solve.periodic import flatten
from asperity.solve.starts import Start

A, B, D0, W0, V = 0.013, 0.026, 4e-7, 7.0, 1e-4
KC = (B - A) * W0 / D0


def points(stiffness, frequency, epsilon):
    """One point for each stiffness."""
    slider = asp.Slider(RiceRuina(mu0=0.5, A=A, B=B, D0=D0, V0=1e-6), spring=stiffness, load=W0)
    ones = np.ones(len(stiffness))
    motion = equation_of_motion(slider, V * ones, 2 * np.pi * frequency * ones)
    return flatten(Problem(motion, Harmonic(epsilon * ones)))[0]


@pytest.mark.parametrize(
    ("lost", "share", "said"),
    [
        (Outcome.NO_ORBIT, 0.5, 0.2),
        (Outcome.NO_ORBIT, 1.001, 0.4),
        (Outcome.NOT_RESOLVED, 3e-8, 0.4),
    ],
)
def test_what_nothing_could_hold_is_called_too_unstable(lost, share, said):
    # D0/V = 4 ms and a period of 10 s: far below Kc disturbances grow by far more than e^15.
    problem = points(np.array([0.1, 2.0]) * KC, 0.1, 0.4)
    found = Found.empty(2, 3, 1, 0)
    block = np.array([2, 0])
    found.outcome[block], found.detail[block] = lost, share
    found.outcome[1] = Outcome.CONVERGED
    search._tell_sensitive(problem, found, block)
    assert found.outcome.tolist() == [lost, Outcome.CONVERGED, Outcome.SENSITIVE]
    assert found.detail[2] == pytest.approx(said, rel=1e-12)
    assert found.detail[0] == share


def test_a_branch_may_run_ahead_a_little_where_it_is_about_to_arrive():
    walked = _Walked.from_steady(4)
    walked.fastest[:] = RUNAWAY + np.array([0.2, 0.2, 0.9, -0.1])
    walking = walked.walking(np.array([0.995, 0.9, 0.995, 0.9]))
    assert walking.tolist() == [True, False, False, True]


def test_an_unconfirmed_orbit_of_another_branch_leaves_what_was_said(monkeypatch):
    problem = points(np.array([2.0]) * KC, 40.0, 0.6)
    nothing = Start.none(problem, 1, 48)
    folded = nothing._replace(outcome=np.array([Outcome.FOLDED]), detail=np.array([0.3]))

    def unresolved(problem, found, block, orbit, index, options, meshes):
        found.outcome[block[index]], found.detail[block[index]] = Outcome.NOT_RESOLVED, np.inf

    monkeypatch.setattr(search, "near_orbits", lambda *_: nothing)
    monkeypatch.setattr(search, "orbits_along_branches", lambda *_: (folded, np.array([True])))
    another = nothing._replace(found=np.array([True]))
    monkeypatch.setattr(search, "orbits_from_high_frequency", lambda *_: another)
    monkeypatch.setattr(search, "refine", unresolved)
    found = Found.empty(2, 1, 1, 0)
    search._collocate(problem, found, np.array([0]), Options(1, 0, lambda _: None))
    assert (found.outcome[0], found.detail[0]) == (Outcome.FOLDED, 0.3)
