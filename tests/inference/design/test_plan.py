"""Plans are read with their units, and every mistake is one sentence."""

import copy

import numpy as np
import pytest

from asperity.errors import InputError
from asperity.inference import design, plan_of, read_plan
from asperity.inference.design.candidates import candidates_of
from asperity.inference.design.plan import expected_values

PLAN = {
    "law": "elasto-plastic",
    "material": "bureau2000",
    "free": ["lambda", "eps_ratio"],
    "measure": "lambda",
    "points": 6,
    "ranges": {
        "V": ["1 um/s", "10 um/s"],
        "epsilon": {"from": 0.1, "to": 0.4, "levels": 4},
        "frequency": {"from": "1 Hz", "to": "100 Hz", "levels": 3},
    },
    "values": {"eps_ratio": 0.5},
    "noise": {"delta_mu": 1e-3, "mu1": {"absolute": 2e-5, "relative": "1 %"}, "phase1": "2 deg"},
}


def changed(**changes):
    """The plan with other entries; None takes one out, `table__key` names one in a table."""
    plan = copy.deepcopy(PLAN)
    for key, value in changes.items():
        table, _, inner = key.partition("__")
        owner, name = (plan[table], inner) if inner else (plan, table)
        if value is None:
            del owner[name]
        else:
            owner[name] = value
    return plan


def test_a_plan_is_read_in_SI():
    plan = plan_of(PLAN, require_unit=True)
    np.testing.assert_allclose(plan.axes["V"], [1e-6, 1e-5])
    np.testing.assert_allclose(plan.axes["epsilon"], [0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(plan.axes["frequency"], [1, 10, 100])
    assert expected_values(plan.truth) == {"lambda": 0.7e-6, "eps_ratio": 0.5}
    assert plan.truth.fixed["W0"] == 7
    assert len(plan.candidates()["V"]) == 24
    assert plan.noise["phase1"].absolute == pytest.approx(2 * np.pi / 180)
    assert plan.noise["mu1"].at(np.array(1e-3)) == pytest.approx(np.hypot(2e-5, 1e-5))


def test_the_uncertainty_of_a_material_is_one_of_the_parameter_s_kind(tmp_path):
    """An uncertainty of 0.3, dimensionless, was one of 0.3 m."""
    file = tmp_path / "mine.toml"
    file.write_text(
        "title = 'x'\n[numbers.lambda]\nvalue = 0.6\nuncertainty = 0.3\nunit = ''\n"
        "dimension = 'dimensionless'\nkind = 'assumed'\nplace = 'nowhere'\n"
    )
    values = {"lambda": "0.7 um", "eps_ratio": 0.5}
    fixed = {"mu0": 0.4, "A": 0.013, "B": 0.02, "D0": "0.4 um", "V0": "1 um/s"}
    fixed |= {"K": "0.2 N/um", "W0": "7 N"}
    with pytest.raises(InputError, match="uncertainty must have a free parameter to draw"):
        plan_of(changed(material=str(file), values=values, fixed=fixed, draws=4))


def test_a_prior_of_the_stiffness_may_be_over_the_load():
    """7 N on a spring of 0.2 N/um."""
    free = {"free": ["lambda", "K"], "fixed": {"eps_ratio": 0.5}, "values": {"K": "0.2 N/um"}}
    plan = plan_of(changed(**free, prior=["K=0.03+-0.001 1/um"]), require_unit=True)
    (prior,) = (u.prior for u in plan.truth.unknowns if u.name == "K")
    assert prior.sd == pytest.approx(7e3)


def test_a_prior_is_about_the_value_that_the_readings_follow():
    """Its mean counted as misfit of the rival alone: (0.6 - 0.5)^2 / 0.01^2 = 100."""
    priors = {
        "eps_ratio": {"mean": 0.6, "std": 0.01},
        "A": {"mean": 0.02, "std": 0.001},
        "c": {"mean": 2.0, "std": 0.1},
    }
    free = {"rival": "nagata", "rival_free": ["eps_ratio", "A", "c"], "values__c": 3.0}
    plan = plan_of(changed(measure=None, **free, prior=priors))
    of_law, of_rival = (
        {u.name: u.prior.mean for u in h.unknowns if u.prior} for h in (plan.truth, plan.rival)
    )
    assert of_law == {"eps_ratio": 0.5}
    # A is a fixed number of the law; the law has no c.
    assert of_rival == {"eps_ratio": 0.5, "A": 0.013, "c": 2.0}
    assert plan.priors == {"eps_ratio": True, "A": True, "c": False}


def test_a_prior_of_a_file_carries_its_unit():
    """0.7 m is no length of this plan."""
    plan = changed(prior={"lambda": {"mean": 0.7, "std": 0.1}})
    with pytest.raises(InputError, match=r"prior.*lambda.* must carry a unit, got 0.7"):
        plan_of(plan, require_unit=True)


def test_a_number_that_only_the_rival_has_may_be_given():
    fixed = {"c": 2.0}
    rivals = {"measure": None, "rival": "nagata"}
    plan = plan_of(changed(**rivals, rival_free=["A", "B"], fixed=fixed))
    assert plan.rival.fixed["c"] == 2
    assert "c" not in plan.truth.fixed
    plan = plan_of(changed(**rivals, rival_free=["A", "B"], values__c=2.0))
    assert plan.rival.fixed["c"] == 2
    plan = plan_of(changed(**rivals, rival_free=["A", "c"], values__c=3.0))
    assert expected_values(plan.rival)["c"] == 3
    with pytest.raises(InputError, match="none for c; use free or fixed"):
        plan_of(changed(**rivals, rival_free=["A", "B"]))


def test_a_rival_of_the_same_law_has_the_expected_values_of_what_it_does_not_free():
    values = {"values": {"eps_ratio": 0.5, "lambda": "0.4 um"}}
    plan = plan_of(changed(measure=None, rival="elasto-plastic", rival_free="eps_ratio", **values))
    assert plan.rival.names == ("eps_ratio",)
    assert plan.rival.fixed["lambda"] == pytest.approx(0.4e-6)


def test_time_is_spent_on_settling_and_reading():
    plan = plan_of(changed(points=None, time="1 h", settling_slip="20 um", integration="10 s"))
    np.testing.assert_allclose(plan.cost(np.array([1e-6, 1e-5])), [30, 12])
    assert plan.budget == 3600


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"laws": "x"}, "laws must be a known field, got 'x'; did you mean 'law'"),
        ({"law": "amontons"}, "depend on the velocity"),
        ({"measure": None}, "one aim, measure or rival, got none"),
        ({"rival": "rice-ruina"}, "one aim, measure or rival, got both"),
        ({"measure": "A"}, "name free parameters, got 'A'"),
        ({"measure": None, "rival": "rice-ruina", "draws": 4}, "draws must be 0 with a rival"),
        ({"measure": None, "rival": "elasto-plastic"}, "rival must differ from the law"),
        ({"points": 1, "noise": {"mu1": 2e-5}}, "at least as many data as free parameters, got 1"),
        ({"rival_free": ["A"]}, "rival_free must go with a rival"),
        ({"free": []}, "free must have at least 1 part, got 0"),
        ({"free": ["V"]}, "free must not have what ranges has, got 'V'"),
        ({"free": ["Z"]}, "free must be parameters of elasto-plastic, got 'Z'; choose one of A"),
        ({"points": None}, "must have points or time, got none"),
        ({"points": 2.5}, "whole number"),
        ({"points": 0}, "points must be at least 1, got 0"),
        ({"time": "1 h"}, "must have points or time, got both"),
        ({"points": None, "time": "1 h"}, "must say what a reading takes"),
        ({"points": None, "time": 3600, "integration": "1 s"}, "must carry a unit"),
        ({"integration": "1 s"}, "integration must go with time"),
        ({"ranges__V": None}, "got none for V"),
        ({"ranges__V": [1e-6]}, "must carry a unit"),
        ({"ranges__V": "1 um"}, "velocity"),
        ({"ranges__V": ["1 um/s", "1 um/s"]}, "each value once"),
        ({"ranges__A": [0.01]}, "drive or the machine, got 'A'"),
        ({"ranges__epsilon": {"from": 0.4, "to": 0.1}}, "to must be above from"),
        ({"ranges__epsilon": {"from": 0.1}}, "must have from and to"),
        ({"ranges__epsilon": {"values": [0.1], "levels": 3}}, "must have values, or from and to"),
        ({"ranges__epsilon": {"values": [0.1], "from": 0.1, "to": 0.2}}, "got values and from, to"),
        ({"ranges__epsilon": {"from": 0, "to": 0.1, "spacing": "log"}}, "must be positive"),
        (
            {"ranges__epsilon": {"from": 0.1, "to": 0.4, "levels": 1}},
            "levels must be at least 2, got 1",
        ),
        ({"ranges__epsilon": 1.2}, "below 1"),
        ({"values__eps_ratio": 2.6}, "below 1, got 1.04"),
        (
            {"ranges__epsilon": {"from": 0.1, "to": 0.4, "number": 3}},
            "number must be a known field",
        ),
        ({"noise": None}, "noise must be given"),
        ({"noise__mu3": 1e-5}, "of observables, got 'mu3'"),
        ({"noise__mu1": None}, "must have mu1 where it has phase1"),
        ({"noise__mu1": 0}, "must be positive, got 0"),
        ({"noise__mu1": -1e-5}, "must be positive, got -1e-05"),
        ({"noise__phase1": 2}, "an angle in rad or deg"),
        ({"noise__phase1": "2 Hz"}, "an angle in rad or deg"),
        ({"values__eps_ration": 0.5}, "did you mean 'eps_ratio'"),
        ({"fixed": {"V": "1 um/s"}}, "must not have what ranges has"),
        ({"draws": 4}, "uncertainty"),
        ({"draws": -1}, "draws must be at least 0"),
        (
            {"draws": 4, "uncertainty": {"lambda": "-1 um"}},
            "uncertainty.lambda must not be negative",
        ),
        ({"draws": 4, "uncertainty": {"Q": 1}}, "uncertainty must be of free parameters, got 'Q'"),
        ({"draws": 4, "uncertainty": {"A": 0.001}}, "of free parameters, got 'A'"),
        ({"prior": 3}, "prior must be materials or priors by name"),
        ({"prior": ["A=0.01+-0.001"]}, "prior must be of free parameters (lambda, eps_ratio)"),
        ({"material": None}, "got none for lambda"),
        ({"inertia": "yes"}, "true or false"),
        (
            {"free": ["lambda", "M"]},
            "'M', which has no influence without inertia",
        ),
        ({"uncertainty": {"lambda": "1 nm"}}, "uncertainty must go with draws"),
        ({"usable_share": 0.5}, "usable_share must go with draws"),
        ({"fixed": {"M": "2 kg"}}, "fixed must be parameters that count, got 'M'"),
        ({"usable_share": 2}, "usable_share must be at most 1"),
    ],
)
def test_a_mistake_is_one_sentence(changes, message):
    with pytest.raises(InputError) as raised:
        plan_of(changed(**changes), require_unit=True)
    assert message in str(raised.value)
    assert "plan." not in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_number_of_synthetic_sets_below_zero_is_refused():
    with pytest.raises(InputError, match="simulate must be at least 0"):
        design(PLAN, simulate=-1)


def test_a_file_is_named_by_its_keys(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(
        "law = 'rice-ruina'\nfree = ['A', 'B']\nmeasure = 'A'\npoints = 9\n"
        "values = {A=0.1, B=0.2}\n"
        "ranges = {V='1 um/s', epsilon=0.1, frequency='9 Hz'}\nnoise = {mu1=1e-5}\n"
    )
    with pytest.raises(InputError, match=r"use free or fixed\.mu0, add columns"):
        read_plan(path)


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (None, "plan must be a file"),
        ("law = ", "plan must be valid TOML"),
        (b"\xff\xfe\x00", "plan must be a readable TOML file"),
    ],
)
def test_an_unreadable_file_is_one_sentence(tmp_path, content, rule):
    path = tmp_path / "plan.toml"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=rule):
        read_plan(path)


def test_a_point_at_which_slip_would_reverse_is_no_candidate():
    """At 200 Hz the second harmonic of the load meets the resonance on the asperities."""
    ranges = {"V": "1 um/s", "epsilon": [0.1, 0.6], "frequency": "200 Hz"}
    fixed = {"K": "0.3 N/um", "M": "1.6 kg"}
    plan = plan_of(changed(ranges=ranges, fixed=fixed, inertia=True, draws=0))
    found = candidates_of(plan, lambda *_: None)
    assert found.points["epsilon"].tolist() == [0.1]
    (reason,) = found.left_out
    assert reason.startswith("slip would reverse")
