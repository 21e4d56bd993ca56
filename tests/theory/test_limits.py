"""The limit of slow modulation against eigenvalues worked out by hand."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import asperity as asp
from asperity.laws import LinkerDieterich, Nagata, PrakashClifton, RiceRuina
from asperity.loads import Harmonic, modulated
from asperity.slider import equation_of_motion
from asperity.slider.problem import Problem, flatten
from asperity.theory.limits import adiabatic_growth, adiabatic_states, even_phases

A, B, D0, W0, V = 0.013, 0.026, 4e-7, 7.0, 1e-4
KC = (B - A) * W0 / D0


NUMBERS = {"mu0": 0.5, "A": A, "B": B, "D0": D0, "V0": 1e-6}
LAW = RiceRuina(**NUMBERS)
#: Laws whose states in steady sliding depend on the load.
LOADED = (
    LinkerDieterich(**NUMBERS, alpha=0.2),
    Nagata(**NUMBERS, c=2.0),
    PrakashClifton(**NUMBERS, L=1e-6, V_star=1e-9),
)


def problem(stiffness, epsilon, frequency, law=LAW):
    slider = asp.Slider(law, spring=stiffness, load=W0)
    motion = equation_of_motion(slider, np.array([V]), 2 * np.pi * np.array([frequency]))
    return flatten(Problem(motion, Harmonic(np.array([epsilon]))))[0]


def growth(stiffness, epsilon, frequency):
    """Of F and ln Phi about v = V, with dF/dt = K (V - v) and dPhi/dt = 1 - v Phi/D0."""

    def rate(theta):
        load = W0 * (1 + epsilon * np.cos(theta))
        felt = stiffness * V / (A * load)
        trace = V / D0 * (B / A - 1) - felt
        determinant = felt * V / D0
        root = np.sqrt(complex(trace**2 / 4 - determinant))
        return max((trace / 2 + root).real, 0.0) / (2 * np.pi * frequency)

    return 2 * quad(rate, 0, np.pi, limit=400)[0]


@pytest.mark.parametrize("epsilon", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("stiffness", [0.05, 0.7, 1.2])
def test_growth_is_that_of_the_eigenvalues(stiffness, epsilon):
    exponent = adiabatic_growth(problem(stiffness * KC, epsilon, 0.5))
    # The rate has a kink where growth sets in.
    assert exponent[0] == pytest.approx(growth(stiffness * KC, epsilon, 0.5), rel=1e-3, abs=1e-12)


def test_an_age_that_remembers_the_load_grows_alike_under_a_constant_load():
    """Linker-Dieterich ageing is Rice-Ruina's where the load is constant; 7054 was computed."""
    exponent = adiabatic_growth(problem(0.7 * KC, 0.3, 0.5, LOADED[0]))
    assert exponent[0] == pytest.approx(growth(0.7 * KC, 0.3, 0.5), rel=1e-3)


@pytest.mark.parametrize("pull", [0.0, 0.3])
@pytest.mark.parametrize("law", [LAW, *LOADED], ids=lambda law: law.name)
def test_states_are_steady_under_the_load_and_at_the_pull_of_their_phase(law, pull):
    point = problem(0.7 * KC, 0.5, 0.5, law)
    point = point._replace(load=modulated(0.5, pull=pull))
    states = adiabatic_states(point, nodes=24)
    at = point.load.at(even_phases(24) * jnp.ones(1))
    np.testing.assert_allclose(point.system.rates(states, at), 0.0, atol=1e-9)
    slip = np.log(1 + pull * np.cos(even_phases(24)))
    np.testing.assert_allclose(point.system.log_slip(states, at), slip, atol=1e-12)
