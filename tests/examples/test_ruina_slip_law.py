"""The example that holds the slip law against the ageing law, and what is known of the two."""

import runpy
from pathlib import Path

import numpy as np

import asperity as asp
from asperity.laws import RuinaSlip

SCRIPT = Path(__file__).parents[2] / "examples" / "ruina_slip_law.py"
PARAMETERS = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}


SLIDER = asp.Slider(RuinaSlip(**PARAMETERS), spring=2e5, load=7.0)


def test_script_prints_a_converged_response(capsys):
    runpy.run_path(str(SCRIPT))["main"]()
    lines = capsys.readouterr().out.splitlines()
    responses = [line for line in lines if "  eps = " in line]
    assert len(responses) == 8
    assert all(line.endswith("converged") for line in responses)


def test_mean_drop_has_the_high_frequency_limit():
    """<v ln(v Phi/D0)> = 0 adds -B mu^2/(4 A^2) to Eq. (22)."""
    mu, A, B = 0.5, 0.013, 0.026
    response = asp.perturbation_response(SLIDER, velocity=1e-6, frequency=1e5)
    expected = -mu * (mu + 2 * A) / (4 * A) - B * mu**2 / (4 * A**2)
    np.testing.assert_allclose(response.mean_curvature, expected, rtol=1e-4)


def test_periodic_response_is_stable_only_when_modulated():
    """The growth rate at eps = 0 is that of a stiffness below critical; modulation stabilises."""
    response = asp.periodic_response(SLIDER, velocity=1e-6, epsilon=[0.01, 0.24], frequency=120.0)
    assert response.converged.all()
    assert response.stable.tolist() == [False, True]
