"""The slip law against the ageing law, and the plan that asks how the load acts on the age."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.inference import read_plan
from asperity.inference.design.plan import expected_values
from asperity.laws import ElastoPlastic, LinkerDieterich, RuinaSlip, registry

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


PLAN = Path(__file__).parents[2] / "examples" / "load_on_age.toml"


@pytest.fixture
def plan(monkeypatch):
    """The plan, whose law is registered only for the length of a test."""
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))
    return read_plan(PLAN)


def test_the_plan_covers_the_frequencies_of_stick_slip(plan):
    levels = plan.axes
    known = {**plan.truth.fixed, **expected_values(plan.truth)}
    critical = np.sqrt((known["B"] - known["A"]) / known["A"]) * levels["V"] / known["D0"]
    # At 10 um/s within the range; at 1 um/s a little below it.
    assert levels["frequency"].min() < critical.max() / (2 * np.pi) < levels["frequency"].max()
    assert plan.question.measure == ("alpha",)
    assert expected_values(plan.truth)["alpha"] == 0.02


def test_the_law_is_its_two_parents_together(plan):
    numbers = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}
    law = plan.truth.law(**numbers, alpha=0.02, lambda_=7e-7)
    ageing = LinkerDieterich(**numbers, alpha=0.02)
    elastic = ElastoPlastic(**numbers, lambda_=7e-7)
    assert law.elastic_length == elastic.elastic_length
    v, w, state = 2e-6, 1.3, (np.array(0.4),)
    assert law.log_age(state, w) == ageing.log_age(state, w) != state[0]
    assert law.state_rate(v, 3e-6, state, w)[0] == ageing.state_rate(v, 3e-6, state, w)[0]
