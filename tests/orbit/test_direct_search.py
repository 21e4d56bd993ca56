"""Direct search: from orbits of an earlier call, and from motions that settle."""

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from asperity import Slider
from asperity.errors import InputError
from asperity.laws import RiceRuina
from asperity.orbit import KnownOrbits, Outcome, response_function
from asperity.orbit.derivatives import mesh_search as direct
from asperity.orbit.methods.from_transient import settled_orbits
from asperity.slider.problem import checked_problem, flatten

#: Rock-like numbers; the modulation is slow beside sliding over the memory length, so that the fast
#: method finds none of these orbits.
NUMBERS = {
    "mu0": 0.525,
    "A": 0.0108,
    "B": 0.0101,
    "D0": 3.2e-6,
    "V0": 1e-6,
    "K": 9.1e6,
    "W0": 1290.0,
    "V": 4e-5,
    "frequency": 0.15,
}
EPSILON = np.array([0.1, 0.25, 0.4, 0.51, 0.55])

DIRECT = response_function("rice-ruina", search="direct")
WHOLE = response_function("rice-ruina")


def at(**changes):
    return {**NUMBERS, "epsilon": EPSILON, **changes}


def integrated(epsilon):
    """Mean and two harmonics by SciPy, from the equations of Rice and Ruina under this load."""
    p = NUMBERS
    omega = 2 * np.pi * p["frequency"]
    steady = p["mu0"] - (p["B"] - p["A"]) * np.log(p["V"] / p["V0"])

    # Beside the states, the integrals of the force times 1, cos, -sin, ... over the period.
    def rates(theta, state):
        force, phi = state[:2]
        w = 1 + epsilon * math.cos(theta)
        slip = p["V"] * math.exp((force / w - steady - p["B"] * phi) / p["A"])
        age = (p["V"] * math.exp(-phi) - slip) / p["D0"]
        stretch = p["K"] / p["W0"] * (p["V"] - slip) / omega
        waves = (cmath.exp(-1j * n * theta) * force for n in range(3))
        return [stretch, age / omega, *(part for c in waves for part in (c.real, c.imag))]

    def period(start):
        first = [*start, *np.zeros(6)]
        run = solve_ivp(rates, (0, 2 * np.pi), first, "LSODA", rtol=1e-11, atol=1e-13)
        return run.y[:, -1]

    # Sliding is stable, so that a few periods lead to the orbit.
    start = np.array([steady * (1 + epsilon), 0.0])
    for _ in range(3):
        start = period(start)[:2]
    start = fsolve(lambda y: period(y)[:2] - y, start, xtol=1e-11)
    real, imaginary = period(start)[2:].reshape(3, 2).T / (2 * np.pi)
    spectrum = real + 1j * imaginary
    return spectrum[0].real, 2 * spectrum[1:]


def test_orbits_with_slip_events_are_the_final_periods_of_transients(monkeypatch):
    strong = np.array([0.55, 0.9, 0.95])
    known = KnownOrbits(strong.size)
    values = DIRECT(at(epsilon=strong), known)
    assert (values.outcome == Outcome.CONVERGED).all()
    assert known.known.all()
    monkeypatch.setattr(direct, "settled_orbits", lambda *given, **_: (None, given[1][:0]))
    left = np.flatnonzero(DIRECT(at(epsilon=strong)).outcome != Outcome.CONVERGED)
    # Or else this tests nothing.
    assert left.size
    for k in left:
        mean, harmonics = integrated(strong[k])
        assert values.mean_friction[k] == pytest.approx(mean, rel=1e-8)
        assert values.harmonics[k] == pytest.approx(harmonics, rel=1e-7)


def test_a_motion_that_runs_away_has_no_orbit_and_ends_a_search_for_every_one():
    # A spring softer than the critical stiffness at the second point.
    mixed = at(epsilon=np.array([0.1, 0.1, 0.25]), K=np.array([9.1e6, 9.1e1, 9.1e6]), B=0.02)
    each, slopes = DIRECT.value_and_jacobian(mixed)
    assert each.outcome.tolist() == [Outcome.CONVERGED, Outcome.NO_ORBIT, Outcome.CONVERGED]
    assert np.isfinite(slopes["A"].mean_friction[[0, 2]]).all()
    every, slopes = DIRECT.value_and_jacobian(mixed, every=True)
    assert every.outcome[1] == Outcome.NO_ORBIT
    assert np.isnan(slopes["A"].mean_friction).all()
    fine = {n: np.broadcast_to(v, 3)[[0, 2]] for n, v in mixed.items()}
    values, slopes = DIRECT.value_and_jacobian(fine, every=True)
    assert values.mean_friction == pytest.approx(each.mean_friction[[0, 2]], rel=1e-9)
    assert np.isfinite(slopes["A"].mean_friction).all()


def test_a_transient_that_goes_on_for_many_periods_is_not_taken_for_periodic():
    """Near the critical stiffness a disturbance decays by a few per cent in a period."""
    A, B, D0, load, V = 0.008, 0.009, 3e-6, 50e6, 1.2e-9
    critical = (B - A) * load / D0
    law = RiceRuina(mu0=0.6, A=A, B=B, D0=D0, V0=1e-6)
    slider = Slider(law, spring=critical * np.array([1.02, 2.0]), load=load)
    drive = {"velocity": V, "epsilon": 4e-5, "frequency": 1 / (3600 * 12.42)}
    problem = flatten(checked_problem(slider, **drive))[0]
    assert settled_orbits(problem, np.arange(2))[1].tolist() == [1]


def test_orbits_of_an_earlier_call_lead_to_those_of_the_search():
    few = EPSILON[:3]
    known = KnownOrbits(few.size)
    DIRECT(at(epsilon=few), known)
    assert known.known.all()
    moved = at(epsilon=few, A=0.0115, D0=2.9e-6, V=4.2e-5)
    values, slopes = DIRECT.value_and_jacobian(moved, known)
    kept = KnownOrbits(few.size)
    expected, expected_slopes = WHOLE.value_and_jacobian(moved, kept)
    assert kept.known.all()
    assert (values.outcome == Outcome.CONVERGED).all()
    assert values.mean_friction == pytest.approx(expected.mean_friction, rel=1e-10)
    assert values.harmonics == pytest.approx(expected.harmonics, rel=1e-9)
    for name in ("A", "D0", "epsilon"):
        reference = expected_slopes[name].harmonics
        assert np.abs(slopes[name].harmonics - reference).max() < 1e-7 * np.abs(reference).max()


def test_points_that_fail_keep_the_orbits_known_before():
    few = EPSILON[:2]
    known = KnownOrbits(2)
    DIRECT(at(epsilon=few), known)
    before = known.orbit.centre.copy()
    # A spring so soft that sliding is far from stable: no orbit follows this load.
    lost = DIRECT(at(epsilon=few, K=9.1e1, A=1e-4), known)
    failed = lost.outcome != Outcome.CONVERGED
    assert failed.any()
    assert known.known.all()
    assert np.array_equal(known.orbit.centre[:, failed], before[:, failed])
    again = DIRECT(at(epsilon=few), known)
    assert again.harmonics == pytest.approx(WHOLE(at(epsilon=few)).harmonics, rel=1e-9)


def test_a_point_takes_the_orbit_of_another_call_only_where_it_has_none():
    first, second = KnownOrbits(2), KnownOrbits(2)
    DIRECT(at(epsilon=np.array([0.1, 0.9995])), first)  # the second is out of range
    DIRECT(at(epsilon=EPSILON[1:3]), second)
    assert first.known.tolist() == [True, False]
    own, other = first.orbit.nodes[..., 0].copy(), second.orbit.nodes.copy()
    first.complete(second)
    assert first.known.all()
    np.testing.assert_array_equal(first.orbit.nodes[..., 0], own)
    np.testing.assert_array_equal(first.orbit.nodes[..., 1], other[..., 1])
    empty = KnownOrbits(2)
    empty.complete(KnownOrbits(2))
    assert not empty.known.any()
    empty.complete(second)
    empty.orbit.nodes[:] = 0.0  # its own copy
    np.testing.assert_array_equal(second.orbit.nodes, other)


@pytest.mark.long
def test_an_orbit_that_no_motion_settles_on_is_kept_by_the_whole_search_for_the_direct_one():
    """A multiplier of -3.6: the motion takes two periods to repeat."""
    unstable = {
        "mu0": 0.525226,
        "A": 0.00466741,
        "B": 0.00852362,
        "D0": 2.21355e-6,
        "V0": 1e-6,
        "K": 25217.6,
        "W0": 10.2798,
        "V": 9.55845e-6,
        "frequency": 0.764565,
        "epsilon": np.array([0.0885314]),
    }
    known = KnownOrbits(1)
    assert DIRECT(unstable, known).outcome.tolist() == [Outcome.NO_ORBIT]
    whole = WHOLE(unstable, known)
    values = DIRECT(unstable, known)
    assert values.outcome.tolist() == [Outcome.CONVERGED]
    assert values.mean_friction == pytest.approx(whole.mean_friction, rel=1e-9)
    np.testing.assert_allclose(values.harmonics, whole.harmonics, rtol=1e-8)


def test_points_out_of_range_have_that_outcome():
    values = DIRECT(at(epsilon=np.array([0.2, 0.9995])), KnownOrbits(2))
    assert values.outcome.tolist() == [Outcome.CONVERGED, Outcome.OUT_OF_RANGE]
    assert np.isnan(values.mean_friction[1])


@pytest.mark.parametrize(
    ("model", "known", "message"),
    [
        (response_function("rice-ruina", search=False), KnownOrbits(5), "must go with a search"),
        (DIRECT, KnownOrbits(4), "as many points as the parameters, 5, got 4"),
    ],
)
def test_known_orbits_that_do_not_fit_are_refused(model, known, message):
    with pytest.raises(InputError, match=message):
        model(at(), known)
    with pytest.raises(InputError, match=message):
        model.value_and_jacobian(at(), known)


def test_the_coarse_search_has_the_orbits_of_smooth_sliding():
    """SciPy's orbit where the modulation sets off no slip event, to the error of 72 intervals."""
    values = response_function("rice-ruina", search="coarse")(at(epsilon=EPSILON[:1]))
    mean, harmonics = integrated(EPSILON[0])
    assert values.mean_friction[0] == pytest.approx(mean, rel=1e-6)
    np.testing.assert_allclose(values.harmonics[0], harmonics, rtol=1e-5)


def test_growth_is_that_of_a_perturbed_orbit_stable_or_not():
    """ln of the spectral radius of the monodromy matrix, from SciPy's integration of two orbits."""
    numbers = {**NUMBERS, "B": 0.0202, "V": 4e-6, "frequency": 0.7, "epsilon": 0.02}
    critical = (numbers["B"] - numbers["A"]) * numbers["W0"] / numbers["D0"]
    for K in (0.7 * critical, 1.5 * critical):
        p = {**numbers, "K": K}
        steady = p["mu0"] - (p["B"] - p["A"]) * math.log(p["V"] / p["V0"])
        omega = 2 * np.pi * p["frequency"]

        def rates(theta, state, p=p, steady=steady, omega=omega):
            force, phi = state
            w = 1 + p["epsilon"] * math.cos(theta)
            slip = p["V"] * math.exp((force / w - steady - p["B"] * phi) / p["A"])
            age = (p["V"] * math.exp(-phi) - slip) / p["D0"]
            return [p["K"] / p["W0"] * (p["V"] - slip) / omega, age / omega]

        def period(start, rates=rates):
            run = solve_ivp(rates, (0, 2 * np.pi), start, "DOP853", rtol=1e-12, atol=1e-14)
            return run.y[:, -1]

        start, h = np.array([steady, 0.0]), 1e-6 * np.eye(2)
        for _ in range(8):
            columns = [(period(start + d) - period(start - d)) / 2e-6 for d in h]
            monodromy = np.transpose(columns)
            start = start - np.linalg.solve(monodromy - np.eye(2), period(start) - start)
        expected = math.log(np.abs(np.linalg.eigvals(monodromy)).max())
        assert (expected > 0) == (critical > K)
        assert DIRECT.growth(p) == pytest.approx([expected], abs=1e-6)
