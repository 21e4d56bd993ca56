"""Fourier collocation under loads that are even in theta, against Gauss-Legendre collocation."""

import numpy as np
import pytest

import asperity as asp
from asperity.laws import ElastoPlastic
from asperity.loads import modulated

SLIDER = asp.Slider(
    ElastoPlastic(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6, lambda_=7e-7), spring=2e5, load=7.0
)
POINT = {"velocity": np.array([1e-6, 1e-5]), "frequency": 120.0, "harmonics": 4}


def respond(method, **load):
    return asp.periodic_response(
        SLIDER, modulation=modulated(**load), methods=(method,), waveform=16, **POINT
    )


@pytest.mark.parametrize(
    "drive",
    [
        {"load": {2: (0.03, 0.0)}, "tilt": "5 deg", "pull": 0.2},
        {"load": {2: (0.03, 0.5)}},
        {"pull": 0.2, "pull_phase": 1},
    ],
)
def test_load_shear_and_pull_even_or_not(drive):
    fast, robust = (respond(m, epsilon=0.1, **drive) for m in ("fourier", "collocation"))
    assert fast.converged.all()
    assert robust.converged.all()
    np.testing.assert_allclose(fast.mean_friction, robust.mean_friction, rtol=1e-9)
    np.testing.assert_allclose(fast.harmonics[:, :2], robust.harmonics[:, :2], rtol=1e-8)
    np.testing.assert_allclose(fast.multipliers, robust.multipliers, rtol=1e-8)
    np.testing.assert_allclose(fast.waveform, robust.waveform, atol=1e-5)
