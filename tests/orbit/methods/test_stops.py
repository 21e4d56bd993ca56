"""Inertia on rigid asperities: a slider that stops within 1e-8 of the period."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.loads import Modulate, Programme
from asperity.orbit.methods.from_transient import settled_orbits
from asperity.slider.problem import checked_problem, flatten

A, B, D0, V0, MU0, W0 = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7.0
V, EPSILON, FREQUENCY, K, M = 1.5e-6, 0.83, 1.775, 9.9e5, 147.0
PERIODS, SAMPLES = 14, 64

LAW = asp.laws.RiceRuina(mu0=MU0, A=A, B=B, D0=D0, V0=V0)
SLIDER = asp.Slider(LAW, spring=K, load=W0, mass=M)


def test_a_slider_that_stops_once_a_period_has_the_orbit_to_which_a_transient_settles():
    response = asp.periodic_response(
        SLIDER, velocity=V, epsilon=EPSILON, frequency=FREQUENCY, inertia=True, waveform=SAMPLES
    )
    assert response.result[()] == "converged"
    force, log_v = response.waveform
    assert np.ptp(log_v) > 30
    period = 1 / FREQUENCY
    modulation = Modulate((PERIODS + 3) * period, EPSILON, FREQUENCY, rise=2 * period)
    times = (2 + np.arange(PERIODS * SAMPLES + 1) / SAMPLES) * period
    programme = Programme(modulation, load=W0, velocity=V)
    motion = asp.transient(SLIDER, programme, inertia=True, sampling=times)
    marched = (motion.force / W0)[:-1].reshape(PERIODS, SAMPLES)
    # The distance to the orbit, at theta = 0 and in each period, changes by the multiplier.
    change = np.diff(marched[-7:, 0])
    multiplier = (change[1:] @ change[:-1]) / (change[:-1] @ change[:-1])
    assert abs(multiplier / response.multipliers[0].real - 1) < 1e-3
    left = multiplier * (marched[-1] - marched[-2]) / (1 - multiplier)
    np.testing.assert_allclose(force, marched[-1] + left, rtol=0, atol=1e-7)


def marched_by_scipy(epsilon, periods):
    """Mean and two harmonics of F/W0 in the last of some periods, by Radau's method in ln v."""
    omega, period = 2 * np.pi * FREQUENCY, 1 / FREQUENCY

    def balance(t, y, size):
        force, log_v, log_age = y
        load = 1 + size * np.cos(omega * t)
        friction = MU0 + A * (log_v - np.log(V0)) + B * (log_age + np.log(V0 / D0))
        return load, force - friction * load, np.exp(log_v), W0 / (M * np.exp(log_v))

    def rates(t, y, size):
        _, excess, v, scale = balance(t, y, size)
        return [K * (V - v) / W0, scale * excess, np.exp(-y[2]) - v / D0]

    def jacobian(t, y, size):
        load, excess, v, scale = balance(t, y, size)
        middle = [scale, -scale * (A * load + excess), -scale * B * load]
        return [[0, -K * v / W0, 0], middle, [0, -v / D0, -np.exp(-y[2])]]

    y = np.array([MU0 + (A - B) * np.log(V / V0), np.log(V), np.log(D0 / V)])
    for share in (0.25, 0.5, 0.75, *[1.0] * periods):
        run = solve_ivp(
            rates,
            (0, period),
            y,
            method="Radau",
            jac=jacobian,
            args=(share * epsilon,),
            rtol=1e-9,
            atol=[1e-12, 1e-9, 1e-9],
            max_step=period / 50,
            dense_output=True,
        )
        y = run.y[:, -1]
    x, weights = np.polynomial.legendre.leggauss(6)
    steps = np.diff(run.t)[:, None]
    t, shares = run.t[:-1, None] + steps * (x + 1) / 2, steps * weights / (2 * period)
    force = run.sol(t.ravel())[0].reshape(t.shape)
    return [(1 + (n > 0)) * (shares * force * np.exp(-1j * n * omega * t)).sum() for n in range(3)]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:overflow")  # in rejected steps of SciPy's
@pytest.mark.parametrize("epsilon", [0.5, 0.7])
def test_a_slider_that_stops_has_the_response_of_scipy(epsilon):
    drive = {"velocity": V, "epsilon": epsilon, "frequency": FREQUENCY}
    r = asp.periodic_response(SLIDER, **drive, inertia=True)
    harmonics = [mu * np.exp(1j * p) for mu, p in [(r.mu1, r.phase1), (r.mu2, r.phase2)]]
    expected = marched_by_scipy(epsilon, 16)
    np.testing.assert_allclose([r.mean_friction, *harmonics], expected, rtol=0, atol=1e-9)


def test_the_states_of_a_stiff_initial_guess_are_those_of_the_transient():
    """The rates at interpolated states are wrong by far: ln v at a stage was 1e7."""
    drive = {"velocity": V, "epsilon": 0.6, "frequency": FREQUENCY}
    problem, _ = flatten(checked_problem(SLIDER, **drive, inertia=True))
    orbit, settled = settled_orbits(problem, np.arange(1))
    assert settled.tolist() == [0]
    at_nodes, at_stages = orbit.centre[1] + orbit.nodes[1], orbit.stage_states[1]
    assert at_nodes.min() - 1 < at_stages.min() < at_stages.max() < at_nodes.max() + 1
