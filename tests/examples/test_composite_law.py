"""A law written outside the package is solved like any other, with nothing else changed."""

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


def test_script_prints_converged_responses_between_those_of_ageing_and_slip(example, capsys):
    example["main"]()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 9
    assert all(line.endswith("converged") for line in lines)
    ageing, composite, slip = np.reshape([float(line.split()[6]) for line in lines], (3, 3))
    assert (slip < composite).all()
    assert (composite < ageing).all()
    assert asp.laws.get_law("composite") is example["Composite"]


def test_steady_sliding_is_at_rest(example):
    law = example["Composite"](**PARAMETERS, Vc=1e-6)
    v = np.geomspace(1e-12, 1e-3, 10)
    (state,) = law.steady_state(v)
    (rate,) = law.state_rate(v, v, (state,), 1.0)
    (ageing,) = law.state_rate(v, v, (state + 1,), 1.0)
    assert (np.abs(rate) <= 1e-13 * np.abs(ageing)).all()


def test_far_above_the_critical_velocity_it_is_the_slip_law(example):
    point = {"velocity": 1e-6, "frequency": np.geomspace(1e-2, 1e3, 6)}
    found, expected = (
        asp.perturbation_response(asp.Slider(law, spring=2e5, load=7.0), **point)
        for law in (example["Composite"](**PARAMETERS, Vc=1e-8), RuinaSlip(**PARAMETERS))
    )
    np.testing.assert_allclose(found.transfer, expected.transfer, rtol=1e-9)
    np.testing.assert_allclose(found.mean_curvature, expected.mean_curvature, rtol=1e-9)
