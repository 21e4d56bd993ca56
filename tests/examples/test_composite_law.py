"""A law written outside the package; `docs/write_your_own_law.md` checks it and runs its script."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.laws import RuinaSlip, registry

SCRIPT = Path(__file__).parents[2] / "examples" / "composite_law.py"
PARAMETERS = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}


@pytest.fixture
def example(monkeypatch):
    """Names of the script, whose law is registered only for the length of a test."""
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))
    return runpy.run_path(str(SCRIPT))


def test_far_above_the_critical_velocity_it_is_the_slip_law(example):
    point = {"velocity": 1e-6, "frequency": np.geomspace(1e-2, 1e3, 6)}
    found, expected = (
        asp.perturbation_response(asp.Slider(law, spring=2e5, load=7.0), **point)
        for law in (example["Composite"](**PARAMETERS, Vc=1e-8), RuinaSlip(**PARAMETERS))
    )
    np.testing.assert_allclose(found.transfer, expected.transfer, rtol=1e-9)
    np.testing.assert_allclose(found.mean_curvature, expected.mean_curvature, rtol=1e-9)
