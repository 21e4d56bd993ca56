"""Readings of a known law, computed by SciPy from the printed equations, with planted noise."""

import numpy as np
import pytest

from asperity import Slider, materials, periodic_response
from asperity.inference import table_of

#: True values of the readings: the numbers of the paper, and eps_eff over epsilon.
TRUTH = {"A": 0.013, "B": 0.026, "D0": 4e-7, "lambda": 7e-7, "eps_ratio": 0.48}
V = np.repeat([1e-6, 1e-5], 8)
EPSILON = np.tile(np.linspace(0.05, 0.5, 8), 2)
FREQUENCY = 120.0
#: Samples of the waveform, and segments of the integration.
SAMPLES, SEGMENTS = 4096, 32
#: Standard uncertainties of the mean and of the real and imaginary part of a harmonic.
MEAN, HARMONIC = 1e-3, 2e-5


@pytest.fixture(scope="session")
def pmma():
    return materials.load("bureau2000")


@pytest.fixture(scope="session")
def exact(reference, pmma):
    """Mean friction minus mu_ss, and complex harmonics, of the elasto-plastic law."""
    printed = reference.Printed(
        V=V[:, None], frequency=FREQUENCY, lambda_=TRUTH["lambda"], K=2e5, W0=7.0
    )
    epsilon = (TRUTH["eps_ratio"] * EPSILON)[:, None]
    # The initial guess of the shooting is 0.1 % from the orbit of the package.
    response = periodic_response(
        Slider(pmma.law("elasto-plastic"), spring=2e5, load=7.0),
        velocity=V,
        epsilon=epsilon[:, 0],
        frequency=FREQUENCY,
        waveform=SAMPLES,
    )
    force, log_slip = response.waveform[..., :: SAMPLES // SEGMENTS]
    shot = reference.multiple_shooting(printed, epsilon, force, 1.001 * log_slip)
    return shot.mean.ravel() - printed.mu.ravel(), shot.harmonics[:, :2]


@pytest.fixture(scope="session")
def readings(exact):
    """A function that makes a table with noise of a seed; without noise for None."""
    drop, harmonics = exact

    def make(seed, planted=1.0):
        noise = np.random.default_rng(seed)

        def normal():
            return planted * noise.normal(size=V.size) if seed is not None else np.zeros(V.size)

        columns = {"V": V, "epsilon": EPSILON, "frequency": FREQUENCY}
        columns |= {"delta_mu": drop + MEAN * normal(), "delta_mu_err": MEAN}
        for n in (1, 2):
            c = harmonics[:, n - 1] + HARMONIC * (normal() + 1j * normal())
            columns |= {f"mu{n}": np.abs(c), f"mu{n}_err": HARMONIC}
            columns |= {f"phase{n}": np.angle(c), f"phase{n}_err": HARMONIC / np.abs(c)}
        return table_of(columns, name="readings")

    return make
