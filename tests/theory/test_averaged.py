"""The averaged limit against scalar equations solved by SciPy, and the paper's fast modulation."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from asperity import Slider, averaged_response, periodic_response
from asperity.laws import ElastoPlastic, LinkerDieterich, RiceRuina

MU0, A, B, D0, V0, K, W0 = 0.5, 0.013, 0.026, 4e-7, 1e-6, 2e5, 7.0
BASE = {"mu0": MU0, "A": A, "B": B, "D0": D0, "V0": V0}
ALPHA, LAMBDA = 0.2, 7e-7
L = LAMBDA * K / W0
EPSILON = np.array([0.05, 0.24, 0.5, 0.8])

#: The frequency that stands in for infinity leaves a response of 1e-8 of the states.
LIMIT = 3e-8

LAWS = {
    "rice-ruina": RiceRuina(**BASE),
    "linker-dieterich": LinkerDieterich(**BASE, alpha=ALPHA),
    "elasto-plastic": ElastoPlastic(**BASE, lambda_=LAMBDA),
}


def mean(function, epsilon):
    """Mean over the load cycle of an even function of theta."""
    value, error = quad(
        lambda theta: function(1 + epsilon * np.cos(theta)),
        0,
        np.pi,
        epsabs=0,
        epsrel=1e-12,
        limit=500,
        points=[0.9 * np.pi],
    )
    assert error < 1e-10 * abs(value)
    return value / np.pi


def limit(name, V, epsilon):
    """z = f (1 + L/w), constant, and the mean of f = F/W0, where the mean slip rate is V."""
    soft = L if name == "elasto-plastic" else 0.0
    power = ALPHA / B if name == "linker-dieterich" else 0.0
    steady = MU0 - (B - A) * np.log(V / V0)

    def log_slip(z):
        def swing(w):
            # Of ln(V Phi/D0): the load's (LD), and the slip by which the asperities' elastic
            # motion renews contacts, x = -F/K.
            return z * w / (w + soft) * (soft > 0) * W0 / (K * D0) - power * np.log(w)

        # < exp(-ln(V Phi/D0)) > = 1, for the age has no mean drift
        centre = np.log(mean(lambda w: np.exp(-swing(w)), epsilon))
        return lambda w: (z / (w + soft) - steady - B * (centre + swing(w))) / A

    def mean_slip(z):
        exponent = log_slip(z)
        top = max(exponent(1 - epsilon), exponent(1.0), exponent(1 + epsilon))
        return top + np.log(mean(lambda w: np.exp(exponent(w) - top), epsilon))

    z = brentq(mean_slip, 1e-3, 2.0, xtol=1e-15, rtol=1e-14)
    return z, mean(lambda w: z * w / (w + soft), epsilon)


@pytest.mark.parametrize("V", [1e-6, 1e-5])
@pytest.mark.parametrize("name", LAWS)
def test_mean_of_the_scalar_equation(name, V):
    response = averaged_response(Slider(LAWS[name], spring=K, load=W0), velocity=V, epsilon=EPSILON)
    assert response.converged.all()
    expected = [limit(name, V, e)[1] for e in EPSILON]
    np.testing.assert_allclose(response.mean_friction, expected, rtol=LIMIT)


@pytest.mark.parametrize("name", ["rice-ruina", "linker-dieterich"])
def test_rigid_asperities_hold_the_force_constant(name):
    response = averaged_response(
        Slider(LAWS[name], spring=K, load=W0), velocity=1e-6, epsilon=EPSILON
    )
    assert response.mu1.max() < LIMIT


def test_elastic_asperities_modulate_the_force_at_any_frequency():
    response = averaged_response(
        Slider(LAWS["elasto-plastic"], spring=K, load=W0), velocity=1e-6, epsilon=EPSILON
    )
    z = np.array([limit("elasto-plastic", 1e-6, e)[0] for e in EPSILON])
    # z w/(w + L) = z - z L/(w + L), of which the first harmonic in closed form
    root = np.sqrt((1 + L) ** 2 - EPSILON**2)
    first = 2 * z * L * (1 + L - root) / (EPSILON * root)
    np.testing.assert_allclose(response.harmonics[:, 0].real, first, rtol=1e-5)
    np.testing.assert_allclose(response.phase1, 0.0, atol=1e-4)


def test_plateau_of_the_first_harmonic():
    V = np.array([1e-7, 1e-6, 1e-5])
    law = ElastoPlastic(**BASE | {"B": A}, lambda_=LAMBDA)  # mu_ss the same at any velocity
    response = averaged_response(Slider(law, spring=K, load=W0), velocity=V, epsilon=0.005)
    # eps mu K lambda / W0, up to (1 + L)^2 and the drop of the mean, (eps mu/A)^2 A/4.
    np.testing.assert_allclose(response.mu1, 0.005 * MU0 * L, rtol=2 * L + 2e-3)
    assert np.ptp(response.mu1) < 1e-6 * response.mu1[0]


# How well the limit stands in for 120 Hz, from eps = 0.24 up; three times worse at eps = 0.05.
@pytest.mark.parametrize(("V", "known"), [(1e-6, 2e-6), (1e-5, 2e-4)])
def test_drop_at_120_hz(V, known):
    slider = Slider(LAWS["rice-ruina"], spring=K, load=W0)
    full = periodic_response(slider, velocity=V, epsilon=EPSILON[1:3], frequency=120.0)
    fast = averaged_response(slider, velocity=V, epsilon=EPSILON[1:3])
    error = np.abs(fast.delta_mu / full.delta_mu - 1)
    assert error.max() < known
    # The rest is of second order in V/(w D0): it is there, and not round-off.
    assert error.max() > known / 100


def test_no_modulation_is_steady_sliding():
    response = averaged_response(
        Slider(LAWS["rice-ruina"], spring=K, load=W0), velocity=1e-6, epsilon=0.0
    )
    assert response.mean_friction == pytest.approx(MU0, rel=1e-14)
