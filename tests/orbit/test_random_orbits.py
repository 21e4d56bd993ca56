"""The robust method knows no law: laws of one to five states, and random orbits of every law.

What is compiled of a law is held against its published equations in `tests/laws`. Here orbits are
put back into the equations: SciPy integrates them over one period from the states at theta = 0.
"""

import dataclasses
import itertools
from functools import cache

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.laws import Law, parameter, registered
from asperity.loads import modulated
from asperity.operating_point import numbers_for, sourced_numbers
from asperity.orbit import Outcome
from asperity.slider.parameters import slider_from
from references.populations import population

MU0, A, B, D0, V0, K, W0, V, FREQUENCY = 0.5, 0.013, 0.026, 4e-7, 1e-6, 4e5, 7.0, 2e-6, 60.0
#: Of mean, harmonics and multipliers, relative; SciPy's tolerances leave 1e-10.
PROMISED = 1e-8
#: Of the states after a period, and of harmonics from dense output.
CLOSED = 1e-7
SAMPLES = 1024


@cache
def ageing_over_lengths(count):
    """A law with as many states as lengths, i D0: friction mu0 + A ln(v/V0) + sum B/i phi_i."""

    class Lengths(Law):
        name = f"lengths-{count}"
        source = "none"
        state_names = tuple(f"phi{i + 1}" for i in range(count))

        mu0: float = parameter("law.mu0", "dimensionless")
        A: float = parameter("law.A", "dimensionless")
        B: float = parameter("law.B", "dimensionless")
        D0: float = parameter("law.D0", "length")
        V0: float = parameter("law.V0", "velocity")

        def friction(self, v, state, w):
            ages = sum(self.B / (i + 1) * phi for i, phi in enumerate(state))
            return self.mu0 + self.A * jax.numpy.log(v / self.V0) + ages

        def state_rate(self, v, v_plastic, state, w):
            return tuple(
                (self.V0 * jax.numpy.exp(-phi) - v) / ((i + 1) * self.D0)
                for i, phi in enumerate(state)
            )

        def steady_state(self, v):
            return (-jax.numpy.log(v / self.V0),) * count

    return Lengths


@pytest.mark.parametrize("states", population([1, 2, 5, 3], short=3))
def test_laws_of_any_number_of_states_have_the_orbits_of_scipy(states):
    """Compared with a separate implementation, in the spring's elongation and the law's states."""
    lengths, epsilon = np.arange(1, states), 0.2
    slider = asp.Slider(
        ageing_over_lengths(states - 1)(mu0=MU0, A=A, B=B, D0=D0, V0=V0), spring=4 * K, load=W0
    )
    response = asp.periodic_response(
        slider, velocity=V, epsilon=epsilon, frequency=FREQUENCY, methods=("collocation",)
    )
    assert response.result[()] == "converged"

    def rates(t, y):
        w = 1 + epsilon * np.cos(2 * np.pi * FREQUENCY * t)
        v = V0 * np.exp((y[0] / w - MU0 - (B / lengths * y[1:]).sum()) / A)
        return np.array([4 * K / W0 * (V - v), *(V0 * np.exp(-y[1:]) - v) / (lengths * D0)])

    def period(start, **options):
        span = (0, 1 / FREQUENCY)
        return solve_ivp(rates, span, start, "DOP853", rtol=1e-12, atol=1e-14, **options)

    run = period(response.start, dense_output=True)
    assert run.y[:, -1] == pytest.approx(response.start, abs=1e-9)
    force = run.sol(np.arange(SAMPLES) / SAMPLES / FREQUENCY)[0]
    spectrum = np.fft.rfft(force) / SAMPLES
    assert response.mean_friction == pytest.approx(spectrum[0].real, rel=PROMISED)
    np.testing.assert_allclose(response.harmonics[:2], 2 * spectrum[1:3], rtol=CLOSED)
    ends = [period(response.start + 1e-30j * unit).y[:, -1].imag / 1e-30 for unit in np.eye(states)]
    expected = np.linalg.eigvals(np.stack(ends, axis=1))
    expected = expected[np.argsort(-np.abs(expected))]
    largest = np.abs(expected) > 1e-6
    np.testing.assert_allclose(
        np.abs(response.multipliers)[largest], np.abs(expected)[largest], rtol=PROMISED
    )


#: Numbers of laws that the material does not have.
OTHERS = {
    "cut-off": {"V1": "10 nm/s", "V2": "100 um/s"},
    "nagata": {"c": 2.0, "A": 0.051, "B": 0.0565},
    "two-state": {"B2": 0.005, "D2": "1.5 um"},
    "prakash-clifton": {"L": "0.3 um", "V_star": "0.1 um/s"},
}
LAWS = sorted(name for name, law in registered().items() if law.rate_dependent)
#: In every run: a law of two states, and one that may rest.
SUITE = ("cut-off", "prakash-clifton")
EQUATIONS = (
    {},
    {"inertia": True},
    {"radiation_damping": 500.0},
    {"inertia": True, "radiation_damping": 500.0},
)
LOADS = (
    lambda epsilon: modulated(epsilon),
    lambda epsilon: modulated(epsilon, load={2: (epsilon / 3, 0.7)}),
    lambda epsilon: modulated(epsilon, tilt=0.05, pull=0.2, pull_phase=-1.0),
)


def random_orbit(law, seed):
    """A response at a point, an equation of motion and a load drawn at random."""
    draw = np.random.default_rng([seed, LAWS.index(law)])

    def spread(low, high):
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    point = {"V": spread(2e-7, 5e-6), "epsilon": 0.1, "frequency": 60.0}
    material = asp.materials.load("bureau2000")
    sourced = sourced_numbers(point | OTHERS.get(law, {}), material, "test", law)
    values = {name: n.value for name, n in numbers_for(law, sourced).items()}
    values["K"] = spread(3.0, 30.0) * (values["B"] - values["A"]) * values["W0"] / values["D0"]
    return asp.periodic_response(
        slider_from(registered()[law], values),
        velocity=point["V"],
        frequency=spread(30.0, 300.0),
        modulation=LOADS[draw.integers(len(LOADS))](draw.uniform(0.02, 0.3)),
        methods=("collocation",),
        **EQUATIONS[draw.integers(len(EQUATIONS))],
    )


def assert_orbit(response, motion):
    """The states return after a period of these equations, and the force has these harmonics."""
    load = response.load
    rates = jax.jit(lambda theta, Y: motion.rates(Y, load.at(theta)))
    force = jax.jit(jax.vmap(lambda theta, Y: motion.force(Y, load.at(theta))))
    span = (0, 2 * np.pi)
    run = solve_ivp(rates, span, response.start, "LSODA", rtol=1e-11, atol=1e-13, dense_output=True)
    assert run.success
    # What SciPy errs by grows as disturbances do.
    accuracy = CLOSED * max(1.0, float(response.floquet_max))
    # Relative to the largest of the period: a velocity may pass zero where it begins.
    gap = np.abs(run.y[:, -1] - response.start) / np.maximum(np.abs(run.y).max(1), 1e-3)
    assert gap.max() < accuracy
    theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    spectrum = np.fft.rfft(np.asarray(force(theta, run.sol(theta).T))) / SAMPLES
    assert response.mean_friction == pytest.approx(spectrum[0].real, rel=accuracy)
    assert np.abs(response.harmonics[:2] - 2 * spectrum[1:3]).max() < 100 * accuracy * response.mu1


def comes_to_rest(response):
    """Whether the interface sticks within ten periods: orbits are of uninterrupted sliding."""
    load, motion = response.load, response.motion
    rates = jax.jit(lambda theta, Y: motion.rates(Y, load.at(theta)))
    excess = jax.jit(lambda theta, Y: motion.log_slip(Y, load.at(theta)) + 20.0)
    excess.terminal = True
    start = np.asarray(motion.steady())
    run = solve_ivp(rates, (0, 20 * np.pi), start, "LSODA", rtol=1e-8, atol=1e-10, events=excess)
    return run.status == 1


@pytest.mark.parametrize(
    ("law", "seed"),
    population(
        sorted(
            itertools.product(LAWS, range(10)), key=lambda pair: (pair[1], pair[0] not in SUITE)
        ),
        short=len(SUITE),
        several=True,
    ),
)
def test_a_random_orbit_obeys_the_equations(law, seed):
    response = random_orbit(law, seed)
    if law == "cut-off" and response.result[()] != "converged":
        assert response.outcome == Outcome.RESTS
        assert comes_to_rest(response)
        return
    assert response.result[()] == "converged"
    assert_orbit(response, response.motion)


@pytest.mark.parametrize("planted", ["V", "omega"])
def test_an_orbit_of_equations_changed_by_a_thousandth_is_detected(planted):
    response = random_orbit("rice-ruina", 0)
    other = {planted: 1.001 * getattr(response.motion, planted)}
    with pytest.raises(AssertionError):
        assert_orbit(response, dataclasses.replace(response.motion, **other))
