"""Slow modulation: orbits that are sequences of steady states, by Fourier series solved directly.

The equations are written out once more: f = F/W0, phi = ln(V Phi/D0), theta = omega t.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import asperity as asp
from asperity.laws import ElastoPlastic, RiceRuina
from asperity.orbit.methods.fourier_series import follows_steady_sliding
from asperity.slider.problem import checked_problem, flatten

MU0, A, B, D0, V0, W0 = 0.5, 0.013, 0.026, 4e-7, 1e-6, 7.0
Kc = (B - A) * W0 / D0
V = 1e-5
#: Samples of a waveform.
SAMPLES = 128
MU = MU0 - (B - A) * np.log(V / V0)
#: Relative accuracy of harmonics 1 and 2 that every method promises.
PROMISED = 1e-9


def respond(ageing, stiffness, epsilon, law=RiceRuina, methods=("series",)):
    """Response at V/(omega D0) = `ageing` and K/Kc = `stiffness`."""
    elastic = {"lambda_": 7e-7} if law is ElastoPlastic else {}
    slider = asp.Slider(
        law(mu0=MU0, A=A, B=B, D0=D0, V0=V0, **elastic), spring=np.multiply(stiffness, Kc), load=W0
    )
    frequency = V / (2 * np.pi * np.asarray(ageing) * D0)
    drive = {"velocity": V, "epsilon": epsilon, "frequency": frequency}
    return asp.periodic_response(slider, **drive, methods=methods, waveform=SAMPLES)


def exponent(f, phi, w):
    """ln(v/V) of Eq. (1)."""
    return (f / w - MU - B * phi) / A


def test_an_integration_in_time_settles_on_the_same_orbit():
    ageing, stiffness, epsilon = 40.0, 3.0, 0.5
    kappa = ageing * stiffness * (B - A)
    response = respond(ageing, stiffness, epsilon)
    assert response.converged

    def rates(theta, y):
        f, phi = y
        v = np.exp(exponent(f, phi, 1 + epsilon * np.cos(theta)))
        return [kappa * (1 - v), ageing * (np.exp(-phi) - v)]

    samples, periods = 512, 4
    grid = 2 * np.pi * np.arange((periods - 1) * samples, periods * samples) / samples
    end = 2 * np.pi * periods
    marched = solve_ivp(
        rates, (0, end), [1.5 * MU, 0.0], "LSODA", t_eval=grid, rtol=1e-12, atol=1e-14
    )
    spectrum = np.fft.rfft(marched.y[0]) / samples
    assert response.mean_friction == pytest.approx(spectrum[0].real, rel=1e-9)
    np.testing.assert_allclose(response.harmonics[:2], 2 * spectrum[1:3], rtol=1e-7)


def test_in_the_limit_friction_follows_the_steady_state():
    """f = w mu_ss(v), v = 1 - f'/kappa, iterated: the error is of the order of 1/ageing^2."""
    ageing, stiffness, epsilon = 1e6, 3.0, 0.5
    theta = 2 * np.pi * np.arange(64) / 64
    w, f = 1 + epsilon * np.cos(theta), MU
    order = 1j * np.fft.fftfreq(64, 1 / 64)
    for _ in range(20):
        slope = np.fft.ifft(order * np.fft.fft(f * np.ones(64))).real
        f = w * (MU - (B - A) * np.log(1 - slope / (ageing * stiffness * (B - A))))
    response = respond(ageing, stiffness, epsilon)
    np.testing.assert_allclose(response.waveform[0, :: SAMPLES // 64], f, rtol=1e-10)


# Fine meshes, and orbits at the end of a branch, are compared for one law. `test_periodic` has a
# point on the finest mesh.
@pytest.mark.parametrize(
    ("law", "seed", "softest", "largest"), [(RiceRuina, 8, 0, 0.9), (ElastoPlastic, 2, 0.5, 0.6)]
)
def test_collocation_finds_the_same_orbit(law, seed, softest, largest):
    random = np.random.default_rng(seed)
    ageing, stiffness = 10 ** random.uniform(-1, 4, 40), 10 ** random.uniform(softest, 2, 40)
    epsilon = random.uniform(0.01, largest, 40)
    smooth = respond(ageing, stiffness, epsilon, law)
    rows = np.flatnonzero(smooth.converged)[:12]
    other = respond(ageing[rows], stiffness[rows], epsilon[rows], law, ("collocation",))
    both = other.converged
    assert both.sum() >= 9
    np.testing.assert_allclose(
        smooth.mean_friction[rows][both], other.mean_friction[both], rtol=1e-9
    )
    one, two = smooth.harmonics[rows, :2][both], other.harmonics[both, :2]
    assert (np.abs(one - two) < 1e-8 * np.abs(two) + 1e-14).all()
    one, two = smooth.multipliers[rows][both], other.multipliers[both]
    seen = np.isfinite(two) & (np.abs(two) > 1e-12)
    np.testing.assert_allclose(one[seen], two[seen], rtol=1e-8)


def test_unstable_for_part_of_the_period():
    """The series obeys the equations to round-off where a disturbance grows by e^1000 and more."""
    ageing, stiffness, epsilon = 2e3, 0.98, 0.75
    response = respond(ageing, stiffness, epsilon)
    assert response.converged
    theta = 2 * np.pi * np.arange(128) / 128
    f, log_slip = response.waveform[:, :: SAMPLES // 128]
    w = 1 + epsilon * np.cos(theta)
    phi = (f / w - MU - A * log_slip) / B
    order = 1j * np.fft.fftfreq(128, 1 / 128)
    f_slope, phi_slope = (np.fft.ifft(order * np.fft.fft(y)).real for y in (f, phi))
    v = np.exp(log_slip)
    assert np.abs(f_slope / (ageing * stiffness * (B - A)) - (1 - v)).max() < 1e-10
    assert np.abs(phi_slope / ageing - (np.exp(-phi) - v)).max() < 1e-10
    # The trace of the Jacobian over the period: both multipliers vanish, though sliding is
    # unstable under more than 0.98 W0.
    by_force = -stiffness * (B - A) / A * v / w
    by_age = -np.exp(-phi) + B / A * v
    assert ageing * 2 * np.pi * (by_force + by_age).mean() < -1000
    assert (response.multipliers == 0).all()


@pytest.mark.parametrize("margin", [0.99, 1.01])
def test_a_slider_follows_where_steady_sliding_is_stable_under_the_heaviest_load(margin):
    epsilon = 0.3
    # K > (B - A) W/D0 at W = (1 + epsilon) W0: Ruina (1983).
    law = RiceRuina(mu0=MU0, A=A, B=B, D0=D0, V0=V0)
    slider = asp.Slider(law, spring=margin * (1 + epsilon) * Kc, load=W0)
    given = checked_problem(slider, velocity=[V], epsilon=epsilon, frequency=1e-3)
    problem, _ = flatten(given)
    assert len(follows_steady_sliding(problem, np.arange(1))) == (margin > 1)


def test_pulses_are_left_to_other_methods():
    """Orbits that a few dozen harmonics do not resolve do not converge."""
    left = respond(10.0, 0.5, [0.3, 0.6, 0.9])
    assert not left.converged.any()
    assert np.isnan(left.mean_friction).all()


def test_harmonics_near_round_off_are_left_to_methods_that_keep_their_digits():
    """The fast method keeps states as deviations from their mean."""
    random = np.random.default_rng(4)
    ageing, stiffness = 10 ** random.uniform(-3, -0.5, 100), 10 ** random.uniform(0.1, 1, 100)
    epsilon = 10 ** random.uniform(-4, -1, 100)
    series = respond(ageing, stiffness, epsilon)
    fast = respond(ageing, stiffness, epsilon, methods=("fourier",))
    both = series.converged & fast.converged
    assert both.sum() > 10
    assert (fast.converged & ~series.converged).sum() > 10
    np.testing.assert_allclose(
        series.harmonics[both, :2], fast.harmonics[both, :2], rtol=PROMISED, atol=0
    )


def test_a_heavy_slider_that_round_off_moves_is_left_unsolved():
    """A thousand times as heavy as at resonance, it keeps its velocity under the force mu W."""
    stiffness, ratio, frequency = 10 ** np.arange(3.0, 9.0)[:, None], 1e3, 0.045
    law = RiceRuina(mu0=MU0, A=0.07, B=1e-5, D0=6.5e-5, V0=2e-4)
    mass = ratio * stiffness / (2 * np.pi * frequency) ** 2
    epsilon = np.geomspace(1e-3, 0.3, 4)
    response = asp.periodic_response(
        asp.Slider(law, spring=stiffness, mass=mass, load=0.3),
        velocity=2e-4, epsilon=epsilon, frequency=frequency, inertia=True, methods=("series",),
    )  # fmt: skip
    expected = MU0 * epsilon / (ratio - 1) * np.ones_like(stiffness)
    solved = response.converged
    assert solved.any()
    assert not solved[-1].any()
    np.testing.assert_allclose(response.mu1[solved], expected[solved], rtol=1e-8)


def tides(turns, epsilon):
    """A fault that creeps at 1 nm/s on a spring 5 % above Kc; `turns` is V T/D0."""
    a, b, v0 = 0.017, 0.025, 1e-9
    law = RiceRuina(mu0=MU0, A=a, B=b, D0=D0, V0=V0)
    slider = asp.Slider(law, spring=1.05 * (b - a) * W0 / D0, load=W0)
    drive = {"velocity": v0, "epsilon": epsilon, "frequency": v0 / (np.asarray(turns) * D0)}
    response = asp.periodic_response(slider, **drive, waveform=SAMPLES)
    return response, a, b, MU0 - (b - a) * np.log(v0 / V0)


def test_a_weak_modulation_near_resonance_has_the_linear_gain():
    """v = 1 + dv e^(i theta) in f' = kappa (1 - v), phi' = chi (e^(-phi) - v), to first order."""
    turns = np.array([4.6, 8.0, 9.0])
    response, a, b, mu = tides(turns, 1e-4)
    assert response.converged.all()
    chi = turns / (2 * np.pi)
    kappa = chi * 1.05 * (b - a)
    gain = kappa / np.abs(a - 1j * kappa - b * chi / (1j + chi))
    assert gain[1] == pytest.approx(5.1, abs=0.05)
    # The next order is that of the swing of the exponent squared.
    swing = gain * mu * 1e-4 / kappa
    assert (np.abs(response.mu1 / (1e-4 * mu) / gain - 1) < swing**2).all()


def test_modulated_at_half_the_critical_period_the_fault_is_unstable():
    """The monodromy matrix by another integrator, by shooting for the orbit."""
    epsilon = 0.002
    response, a, b, mu = tides([4.6, 8.0], epsilon)
    for k, turns in enumerate((4.6, 8.0)):
        chi = turns / (2 * np.pi)
        kappa = chi * 1.05 * (b - a)

        def rates(theta, y, chi=chi, kappa=kappa):
            f, phi = y
            v = np.exp((f / (1 + epsilon * np.cos(theta)) - mu - b * phi) / a)
            return [kappa * (1 - v), chi * (np.exp(-phi) - v)]

        def period(y, rates=rates):
            return solve_ivp(rates, (0, 2 * np.pi), y, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]

        y = np.array([mu, 0.0])
        for _ in range(12):  # shooting
            # Central differences: steps of a part of the swing.
            steps = np.diag([1e-6, 1e-4])
            columns = [(period(y + h) - period(y - h)) / (2 * h.max()) for h in steps]
            monodromy = np.stack(columns, axis=1)
            y = y - np.linalg.solve(monodromy - np.eye(2), period(y) - y)
        assert period(y) == pytest.approx(y, abs=1e-10)
        largest = np.abs(np.linalg.eigvals(monodromy)).max()
        assert np.exp(response.log_multipliers[k, 0].real) == pytest.approx(largest, rel=1e-5)
        assert response.stable[k] == (largest < 1) == (turns == 8.0)
