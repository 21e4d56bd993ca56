"""Points out of the range in which orbits are searched for: a sentence at once, and no number."""

import jax
import numpy as np
import pytest

import asperity as asp
from asperity.laws import RiceRuina
from asperity.loads import modulated
from asperity.orbit.outcome import Outcome
from asperity.orbit.periodic import periodic_response
from asperity.orbit.search import find_orbits
from asperity.orbit.solution import SearchOptions
from asperity.slider.problem import checked_problem, flatten

A, B, D0, W0, K, V0 = 0.013, 0.026, 4e-7, 7.0, 2e5, 1e-6
#: V (m/s), epsilon, f (Hz), and what the sentence names.
OUTSIDE = [
    (1e-200, 0.24, 120.0, "at least 1e-09"),
    (1e308, 0.24, 120.0, "finite"),
    (1e-6, 0.24, 1e-18, "at most 1e+15"),
    (1e-6, 0.24, 1e10, "averaged_response"),
    (1e-6, 0.9999999, 120.0, "at most 0.999, got 0.9999999"),
]
INSIDE = [(1e-6, 0.999, 120.0), (1e-6, 0.24, 1e-13), (1e-6, 0.24, 1e8), (1e-9, 0.24, 1e4)]


def slider(length=1.0, time=1.0, force=1.0):
    """In units in which lengths, times and forces are larger by these factors."""
    law = RiceRuina(mu0=0.5, A=A, B=B, D0=D0 * length, V0=V0 * length / time)
    return asp.Slider(law, spring=K * force / length, load=W0 * force)


@pytest.mark.parametrize("units", [(1.0, 1.0, 1.0), (1e6, 1e3, 1e-2)])
def test_points_out_of_range_name_the_limit_and_are_not_searched(units):
    length, time, _ = units
    V, epsilon, frequency = np.transpose([row[:3] for row in OUTSIDE] + INSIDE)
    with np.errstate(over="ignore"):
        V = np.minimum(V * length / time, 1e308)
    counts = []
    response = periodic_response(
        slider(*units),
        velocity=V,
        epsilon=epsilon,
        frequency=frequency / time,
        progress=lambda done, _: counts.append(done),
    )
    outside = len(OUTSIDE)
    assert (response.outcome[:outside] == Outcome.OUT_OF_RANGE).all()
    assert (response.iterations[:outside] == 0).all()
    assert np.isnan(response.mean_friction[:outside]).all()
    for result, (*_, words) in zip(response.result, OUTSIDE, strict=False):
        assert result.startswith("not searched: ")
        assert words in result
    assert response.converged[outside:].all()
    assert counts[-1] == len(V)


def test_no_method_gets_a_point_out_of_range():
    V, epsilon, frequency = np.transpose([row[:3] for row in OUTSIDE])
    problem, _ = flatten(
        checked_problem(slider(), velocity=V, epsilon=epsilon, frequency=frequency)
    )
    solution = find_orbits(problem, SearchOptions(2))
    assert (solution.method == "").all()


def test_slow_modulation_up_to_the_limit_is_steady_sliding_under_each_load():
    V, epsilon, frequency = INSIDE[1]
    response = periodic_response(slider(), velocity=V, epsilon=epsilon, frequency=frequency)
    assert response.mu1 == pytest.approx(0.5 * epsilon, rel=1e-9)


def test_a_load_of_several_harmonics_must_leave_the_contacts_loaded():
    load = modulated(epsilon=0.9, load={3: (0.0995, 0.0)})
    response = periodic_response(slider(), velocity=1e-6, modulation=load, frequency=120.0)
    assert response.outcome == Outcome.OUT_OF_RANGE
    assert "0.9995" in str(response.result)


@pytest.mark.parametrize("compiled", [False, True])
def test_the_response_function_has_the_same_outcome(compiled):
    numbers = {"mu0": 0.5, "A": A, "B": B, "D0": D0, "V0": V0, "K": K, "W0": W0}
    V, epsilon, frequency = np.transpose([row[:3] for row in OUTSIDE[2:]])
    drive = {"V": V, "epsilon": epsilon, "frequency": frequency}
    respond = asp.response_function("rice-ruina")
    response = (jax.jit(respond) if compiled else respond)({**numbers, **drive})
    assert (np.asarray(response.outcome) == Outcome.OUT_OF_RANGE).all()
    assert np.isnan(np.asarray(response.mean_friction)).all()
