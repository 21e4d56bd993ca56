"""Bifurcations of the package against shooting on the equations as printed."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import fsolve

import asperity as asp
from asperity.branches import follower
from asperity.branches.continuation import ParameterBranch
from asperity.branches.parameters import one_problem
from asperity.errors import InputError
from asperity.loads import Harmonic
from asperity.orbit.methods.amplitude_continuation import MESHES, follow_from_steady_sliding
from asperity.slider import equation_of_motion
from asperity.slider.problem import Problem, flatten
from references.populations import population

#: Location of bifurcations, relative: what is promised.
LOCATION = 1e-8
#: Mean and harmonics against the other solver of the package, relative.
SOLUTION = 1e-8


@pytest.fixture(scope="module")
def resonance(shooting):
    """Nonlinear resonance: K just above Kc, driven just below the frequency of stick-slip."""
    return shooting(K=1.05 * shooting(K=1).Kc, frequency=0.37)


@pytest.fixture(scope="module")
def hysteresis(resonance):
    return asp.continuation(
        resonance.slider,
        parameter="epsilon",
        span=(0, 0.03),
        velocity=resonance.V,
        frequency=resonance.frequency,
    )


@pytest.fixture(scope="module")
def rapid(shooting):
    """Modulation far faster than stick-slip, K below Kc: it stabilises."""
    return shooting(K=2e5)


@pytest.fixture(scope="module")
def stabilised(rapid):
    return asp.continuation(
        rapid.slider, parameter="epsilon", span=(0, 0.2), velocity="1 um/s", frequency="120 Hz"
    )


def kinds(branch):
    return [b.kind for b in branch.bifurcations]


def test_a_branch_is_followed_through_its_folds(hysteresis):
    assert kinds(hysteresis) == ["fold", "fold", "period doubling"]
    assert hysteresis.completed
    assert hysteresis.parameter[-1] == pytest.approx(0.03, rel=1e-12)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(hysteresis.parameter))))
    assert len(turns) == 2
    for turn, fold in zip(turns, hysteresis.bifurcations, strict=False):
        assert abs(turn - fold.index) <= 1


def test_folds_agree_with_shooting(hysteresis, resonance):
    for fold in hysteresis.bifurcations[:2]:

        def defect(unknowns):
            state, epsilon = unknowns[:2], unknowns[2]
            end, monodromy = resonance.flow(state, epsilon)
            critical = 1 - np.trace(monodromy) + np.linalg.det(monodromy)
            return [*(end - state), critical]

        # Starts off the answer, so that it is not simply left where it is.
        force, age = fold.critical.point.orbit.centre[:, 0]
        start = [force * (1 + 1e-5), age + 1e-3, fold.value * 1.002]
        at_fold, _, flag, _ = fsolve(defect, start, full_output=True, xtol=1e-13)
        assert flag in (1, 4, 5)  # 4, 5: no progress beyond round-off
        assert np.abs(defect(at_fold)).max() < 1e-9
        assert fold.value == pytest.approx(at_fold[2], rel=LOCATION)


def test_the_search_folds_where_the_continuation_does(hysteresis, resonance):
    # The branch folds at an epsilon far below the one asked for.
    omega = 2 * np.pi * np.array([resonance.frequency])
    motion = equation_of_motion(resonance.slider, np.array([resonance.V]), omega)
    problem, _ = flatten(Problem(motion, Harmonic(np.array([0.01]))))
    followed = follow_from_steady_sliding(problem, MESHES[0])
    assert followed.arrived[0]
    # Estimated between two neighbouring points.
    assert followed.fold[0] * 0.01 == pytest.approx(hysteresis.bifurcations[0].value, rel=5e-3)


def test_period_doubling_agrees_with_shooting(hysteresis, resonance):
    doubling = hysteresis.bifurcations[2]
    state = doubling.critical.point.orbit.centre[:, 0]
    here = resonance.crossing(
        lambda m: 1 + np.trace(m) + np.linalg.det(m), 0.026, 0.027, state * (1 + 1e-4)
    )
    assert doubling.value == pytest.approx(here, rel=LOCATION)
    assert doubling.multipliers[0] == pytest.approx(-1, abs=1e-9)
    assert doubling.frequency == pytest.approx(resonance.frequency / 2, rel=1e-12)
    assert doubling.stability_change == -1


def test_the_doubled_branch_obeys_the_equations(hysteresis, resonance):
    doubling = hysteresis.bifurcations[2]
    branch = asp.doubled_branch(hysteresis, doubling)
    assert branch.completed
    assert branch.stable.all()  # a supercritical doubling of a stable orbit
    # In its file the n-th harmonic is that of n f/2, and mu1 that of f.
    assert "Re(c_n e^{i n w t / periods})" in branch.provenance["convention"]
    np.testing.assert_array_equal(branch.to_dataset().mu1, abs(branch.harmonics[:, 1]))
    # The subharmonic grows as a pitchfork: with the root of the distance.
    distance = branch.parameter - doubling.value
    near = np.argmin(np.abs(distance - 1e-4))
    twice = np.argmin(np.abs(distance - 2e-4))
    growth = np.abs(branch.harmonics[[near, twice], 0]) / np.sqrt(distance[[near, twice]])
    assert growth[0] == pytest.approx(growth[1], rel=0.05)
    epsilon, start = branch.parameter[-1], branch.last.orbit.centre[:, 0]
    state, monodromy = resonance.orbit(start * (1 + 1e-6), epsilon, periods=2)
    half, _ = resonance.flow(state, epsilon)
    assert np.abs(half - state).max() > 1e-2  # not a simple orbit run through twice
    expected = np.linalg.eigvals(monodromy)
    expected = expected[np.argsort(-np.abs(expected))]
    np.testing.assert_allclose(branch.multipliers[-1], expected, rtol=1e-7)


def test_a_doubled_branch_needs_a_period_doubling(hysteresis):
    with pytest.raises(InputError, match="must be a period doubling, got a fold"):
        asp.doubled_branch(hysteresis, hysteresis.bifurcations[0])


def test_neimark_sacker_agrees_with_shooting(stabilised, rapid):
    (bifurcation,) = stabilised.bifurcations
    state, _ = rapid.followed(0.13, 6)
    here = rapid.crossing(lambda m: np.linalg.det(m) - 1, 0.13, 0.136, state)
    assert bifurcation.kind == "Neimark-Sacker"
    assert bifurcation.value == pytest.approx(here, rel=LOCATION)
    assert bifurcation.stability_change == 1
    np.testing.assert_allclose(stabilised.thresholds, [here], rtol=LOCATION)
    _, monodromy = rapid.orbit(state, here)
    angle = np.abs(np.angle(np.linalg.eigvals(monodromy)[0]))
    slow = angle / (2 * np.pi) * rapid.frequency
    assert bifurcation.frequency == pytest.approx(slow, rel=1e-6)
    assert bifurcation.error < LOCATION


def test_a_planted_shift_of_a_bifurcation_is_detected(stabilised, rapid):
    state, _ = rapid.followed(0.13, 6)
    here = rapid.crossing(lambda m: np.linalg.det(m) * (1 + 1e-7) - 1, 0.13, 0.136, state)
    (bifurcation,) = stabilised.bifurcations
    assert abs(bifurcation.value / here - 1) > 10 * LOCATION


def test_points_of_a_branch_are_those_of_the_other_solver(stabilised):
    chosen = slice(1, None, 12)
    response = asp.periodic_response(
        stabilised.motion.slider,
        velocity="1 um/s",
        epsilon=stabilised.parameter[chosen],
        frequency="120 Hz",
    )
    np.testing.assert_allclose(
        stabilised.mean_friction[chosen], response.mean_friction, rtol=SOLUTION
    )
    for n in range(2):
        np.testing.assert_allclose(
            stabilised.harmonics[chosen, n], response.harmonics[:, n], rtol=SOLUTION
        )
    np.testing.assert_allclose(stabilised.multipliers[chosen], response.multipliers, rtol=SOLUTION)
    assert (stabilised.stable[chosen] == response.stable).all()


@pytest.mark.parametrize(
    ("parameter", "start", "end"),
    population(
        [("velocity", 1e-6, 1e-5), ("W0", 5.0, 9.0), ("K", 1.5e5, 4e5), ("A", 0.011, 0.02)],
        several=True,
    ),
)
def test_any_parameter_can_be_continued(rapid, parameter, start, end):
    fixed = {"velocity": rapid.V, "epsilon": 0.05, "frequency": rapid.frequency}
    branch = asp.continuation(rapid.slider, parameter=parameter, span=(start, end), **fixed)
    assert branch.completed
    assert branch.parameter[[0, -1]] == pytest.approx([start, end], rel=1e-12)
    there = {name: getattr(rapid, name) for name in ("K", "A", "W0")} | {parameter: end}
    import dataclasses

    last = dataclasses.replace(
        rapid,
        **{n: there[n] for n in ("K", "A", "W0")},
        V=end if parameter == "velocity" else rapid.V,
    )
    _, monodromy = last.followed(0.05, 3)
    expected = np.linalg.eigvals(monodromy)
    assert np.abs(branch.multipliers[-1]).max() == pytest.approx(np.abs(expected).max(), rel=1e-8)


def test_an_orbit_without_multipliers_is_not_stable(stabilised, rapid, monkeypatch):
    unknown = np.full_like(stabilised.log_multipliers, np.nan)
    assert not dataclasses.replace(stabilised, log_multipliers=unknown).stable.any()
    # Nor is it a point of a branch: bifurcations next to it would be missed.
    known, calls = follower.log_multipliers, []

    def lost_after_three(*arrays):
        calls.append(arrays)
        return known(*arrays) * (1.0 if len(calls) <= 3 else np.nan)

    monkeypatch.setattr(follower, "log_multipliers", lost_after_three)
    branch = asp.continuation(
        rapid.slider, parameter="epsilon", span=(0, 0.2), velocity="1 um/s", frequency="120 Hz"
    )
    assert len(branch.parameter) == 3
    assert "could not be followed" in branch.result


@pytest.mark.parametrize("change", [{"unstable": 1}, {"direction": -1.0}])
def test_a_bifurcation_that_is_not_located_is_missed_in_words(change):
    """Where Newton's method fails between two orbits, a change of stability was left out."""
    fails = SimpleNamespace(crossing=lambda *arguments: None)
    here = SimpleNamespace(t=0.1, unstable=0, direction=1.0)
    there = SimpleNamespace(**{**vars(here), "t": 0.2, **change})
    branch = ParameterBranch(fails, here, 10)
    branch.accept(np.arange(1), np.arange(1), SimpleNamespace(next=there, length=np.array([0.1])))
    assert (branch.bifurcations, branch.missed) == ([], [0.1])


def test_a_dataset_has_units_and_provenance(hysteresis, tmp_path):
    data = hysteresis.to_dataset()
    assert all({"units", "long_name"} <= set(v.attrs) for v in data.variables.values())
    assert data.attrs["continued_parameter"] == "epsilon"
    assert data.attrs["modulation"] == "w(t) = 1 + eps cos(w t)"
    assert "V = 1e-06 m/s" in data.attrs["parameters"]
    assert list(data.bifurcation_kind.values) == kinds(hysteresis)
    data.to_netcdf(tmp_path / "branch.nc")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameter": "epsilom"}, "did you mean 'epsilon'"),
        ({"span": (0.1, 0.1)}, "two different ends"),
        ({"span": (0.1, 1.0)}, "at least 0 and below 1"),
        ({"span": 0.1}, "span must be a tuple"),
        ({"velocity": None}, "velocity must be given"),
        ({"velocity": [1e-6, 2e-6]}, "parameters must be numbers"),
        ({"parameter": "alpha", "span": (0, 1), "epsilon": 0.1}, "a known name"),
        ({"parameter": "M", "span": (1, 2), "epsilon": 0.1}, "one that the equations have"),
        ({"parameter": "pull", "epsilon": 0.1}, "one that continuation can change, got 'pull'"),
        ({"harmonics": 1}, "at least 2"),
    ],
)
def test_bad_input_is_one_sentence(rapid, change, message):
    good = {"parameter": "epsilon", "span": (0, 0.2), "velocity": 1e-6, "frequency": 120.0}
    with pytest.raises(InputError, match=message) as caught:
        asp.continuation(rapid.slider, **(good | change))
    assert "\n" not in str(caught.value)


def test_the_equations_are_those_of_the_asperities_on_the_branch(rapid):
    """A slider on rigid asperities kept its equations, in which lambda has no effect."""
    rigid = asp.laws.ElastoPlastic(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6, lambda_=0.0)
    slider = asp.Slider(rigid, spring=4e5, load=7.0, mass=1.6)
    point = {"velocity": 1e-6, "epsilon": 0.05, "frequency": 120.0, "inertia": True}
    ask = {"slider": slider, "modulation": None, "radiation_damping": None, **point}
    motion = one_problem(ask, {"lambda": (1e-7, 1e-6)}).system
    assert motion.mechanical == ("force", "velocity", "friction")
    with pytest.raises(InputError, match="span must be positive for lambda, got 0 m"):
        asp.continuation(slider, parameter="lambda", span=(0, 1e-6), **point)


def test_a_branch_says_from_where_on_slip_would_reverse():
    """The slider swings on its asperities, and the law slips forwards only."""
    numbers = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
    law = asp.laws.ElastoPlastic(**numbers, lambda_=7e-7)
    slider = asp.Slider(law, spring=2e5, mass=1.6, load=7.0)
    at = {"velocity": 1e-6, "frequency": 200.0, "inertia": True}
    branch = asp.continuation(slider, parameter="epsilon", span=(0.1, 0.2), **at)
    first = branch.parameter[branch.reverses][0]
    assert f"from {first:.6g} on slip would reverse" in branch.result
    last = branch.parameter[~branch.reverses][-1]
    # The slip is read at the nodes of a mesh, and another mesh has other nodes.
    both = asp.periodic_response(slider, epsilon=[0.998 * last, 1.002 * first], **at)
    assert both.converged.all()
    assert both.reverses.tolist() == [False, True]
    assert "slip would reverse" in both.result[1]
