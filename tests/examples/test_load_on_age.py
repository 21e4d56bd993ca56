"""The plan that asks how the load acts on the age, and its law."""

from pathlib import Path

import numpy as np
import pytest

from asperity.inference import read_plan
from asperity.inference.design.plan import expected_values
from asperity.laws import ElastoPlastic, LinkerDieterich, registry

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
