"""Fourier collocation under loads, even in theta or not, against Gauss-Legendre collocation."""

import numpy as np

import asperity as asp
from asperity.laws import ElastoPlastic
from asperity.loads import modulated

SLIDER = asp.Slider(
    ElastoPlastic(mu0=0.5, A=0.013, B=0.026, D0=4e-7, V0=1e-6, lambda_=7e-7), spring=2e5, load=7.0
)
#: One batch, and so one program a method: all three and even; a load that is not; a pull alone.
LOADS = modulated(
    epsilon=0.1,
    load={2: ([0.03, 0.03, 0.0], [0.0, 0.5, 0.0])},
    tilt=np.radians([5.0, 0.0, 0.0]),
    pull=[0.2, 0.0, 0.2],
    pull_phase=[0.0, 0.0, 1.0],
)


def test_load_shear_and_pull_even_or_not():
    fast, robust = (
        asp.periodic_response(
            SLIDER,
            velocity=[[1e-6], [1e-5]],
            modulation=LOADS,
            frequency=120.0,
            methods=(method,),
            waveform=16,
        )
        for method in ("fourier", "collocation")
    )
    assert fast.converged.shape == (2, 3)
    assert fast.converged.all()
    assert robust.converged.all()
    np.testing.assert_allclose(fast.mean_friction, robust.mean_friction, rtol=1e-9)
    np.testing.assert_allclose(fast.harmonics[..., :2], robust.harmonics[..., :2], rtol=1e-8)
    np.testing.assert_allclose(fast.multipliers, robust.multipliers, rtol=1e-8)
    np.testing.assert_allclose(fast.waveform, robust.waveform, atol=1e-5)
