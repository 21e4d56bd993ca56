"""Without modulation: steady sliding, whose multipliers are exp(J/f) with a Jacobian by hand."""

import numpy as np
import pytest

import asperity as asp
from asperity.loads import modulated

A, B, D0, V0, MU0, W0, K, M, LAMBDA = 0.013, 0.026, 4e-7, 1e-6, 0.5, 7.0, 2e5, 1.6, 7e-7
NUMBERS = {"mu0": MU0, "A": A, "B": B, "D0": D0, "V0": V0}
#: From fast modulation to periods in which disturbances grow or decay by e^1000 and more.
V = np.array([1e-7, 1e-6, 1e-5, 1e-4])[:, None]
FREQUENCY = np.array([1e-2, 1.0, 120.0])


def rigid_jacobian(v):
    """States F/W0 and ln(V0 Phi/D0), 1/s; slip v exp[(F/W0 - ...)/A]."""
    return [[-K * v / (W0 * A), K * v * B / (W0 * A)], [-v / (D0 * A), v / D0 * (B / A - 1)]]


def inertial_jacobian(v):
    """States F/W0, velocity, F_i/W and ln(V0 Phi/D0), 1/s, of the printed equations."""
    return [
        [0, -K / W0, 0, 0],
        [W0 / M, 0, -W0 / M, 0],
        [0, 1 / LAMBDA, -v / (A * LAMBDA), v * B / (A * LAMBDA)],
        [0, -1 / D0, 0, -v / D0],
    ]


@pytest.mark.parametrize("inertia", [False, True])
def test_all_points_converge_with_the_multipliers_of_linear_stability(inertia: bool) -> None:
    law = (
        asp.laws.ElastoPlastic(**NUMBERS, lambda_=LAMBDA)
        if inertia
        else asp.laws.RiceRuina(**NUMBERS)
    )
    slider = asp.Slider(law, spring=K, mass=M, load=W0)
    r = asp.periodic_response(
        slider, velocity=V, epsilon=0.0, frequency=FREQUENCY, inertia=inertia, waveform=4
    )
    assert r.converged.all()
    assert not r.reverses.any()
    steady = MU0 + (A - B) * np.log(V / V0) + 0 * FREQUENCY
    np.testing.assert_allclose(r.mean_friction, steady, rtol=1e-14)
    assert not r.harmonics.any()
    np.testing.assert_allclose(r.waveform[0], steady[..., None] + np.zeros(4), rtol=1e-14)
    np.testing.assert_allclose(r.waveform[1], 0, atol=1e-11)
    jacobian = inertial_jacobian if inertia else rigid_jacobian
    for i, v in enumerate(V[:, 0]):
        rates = np.linalg.eigvals(np.array(jacobian(v)))
        for j, f in enumerate(FREQUENCY):
            growth = np.sort(rates.real)[::-1] / f
            # The stiffest rate is 1e6 times the slowest, which the eigenvalues keep to round-off.
            np.testing.assert_allclose(
                r.log_multipliers[i, j].real, growth, rtol=1e-8, atol=1e-12 * np.abs(growth).max()
            )


def test_other_loads_without_amplitude_are_no_modulation_and_others_are_one() -> None:
    slider = asp.Slider(asp.laws.RiceRuina(**NUMBERS), spring=3e5, load=W0)
    drive = {"velocity": 1e-5, "frequency": 0.1}
    still = asp.periodic_response(slider, modulation=modulated([0.0, 0.0]), **drive)
    assert still.converged.all()
    np.testing.assert_allclose(still.delta_mu, 0, atol=1e-15)
    # The velocity alone is modulated.
    pulled = asp.periodic_response(slider, modulation=modulated(0.0, pull=0.1), **drive)
    assert pulled.converged
    assert pulled.mu1 > 1e-4
