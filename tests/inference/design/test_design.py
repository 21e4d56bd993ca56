"""Designs of periodic responses: what they expect is what fits to such readings find."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from asperity.cli.design import _sections
from asperity.errors import InputError
from asperity.inference import design, fit, table_of
from asperity.inference.design.rival import RivalFit
from asperity.outputs import write_table
from asperity.outputs.sections import as_text
from asperity.study.table import run_table

#: Settings that the elasto-plastic law leaves steady at 120 Hz, and two that it does not.
PLAN = {
    "law": "elasto-plastic",
    "material": "bureau2000",
    "free": ["lambda", "eps_ratio", "A"],
    "measure": "lambda",
    "points": 8,
    "ranges": {
        "V": ["1 um/s", "10 um/s"],
        "epsilon": {"from": 0.1, "to": 0.5, "levels": 5},
        "frequency": "120 Hz",
    },
    "fixed": {"W0": "3 N"},
    "values": {"eps_ratio": 0.48},
    "noise": {"delta_mu": 1e-3, "mu1": 2e-5, "phase1": "2 deg", "mu2": 1e-5},
}


@pytest.fixture(scope="module")
def result():
    return design(PLAN, simulate=30)


def test_expected_errors_are_those_of_a_fit_to_the_expected_readings(result):
    rows = [p for p in result.points for _ in range(p.readings)]
    assert len(rows) == result.readings == 8
    columns = {n: [p.setting[n] for p in rows] for n in ("V", "epsilon", "frequency")}
    for i, name in enumerate(("delta_mu", "mu1", "phase1", "mu2")):
        # Copies of a reading are refused as copied rows: let each differ by nothing that matters.
        copy = 1 + 1e-9 * np.arange(8) * (i == 0)
        columns[name] = np.array([p.predicted[name][0] for p in rows]) * copy
        columns[f"{name}_err"] = [p.predicted[name][1] for p in rows]
    truth = {"lambda": 0.7e-6, "eps_ratio": 0.48, "A": 0.013}
    from asperity import materials

    fitted = fit(
        table_of(columns),
        "elasto-plastic",
        PLAN["free"],
        material=materials.load("bureau2000"),
        fixed={"W0": 3.0},
        start=truth,
    )
    for name, value in truth.items():
        assert fitted.values[name] == pytest.approx(value, rel=1e-5)
        assert result.parameters[name].se == pytest.approx(fitted.parameters[name].se, rel=1e-4)


def test_simulated_fits_spread_as_expected(result):
    simulation = result.simulation
    assert simulation.sets == 30
    assert simulation.failed == 0
    for name, error in result.parameters.items():
        # Three standard errors of the spread of 30 fits, some 15 % each.
        assert simulation.spread[name] == pytest.approx(
            error.se, abs=3 * simulation.uncertainty[name]
        )


def test_the_design_beats_the_grid_as_its_errors_say(result):
    error = result.parameters["lambda"]
    assert result.fewer == pytest.approx((error.se_even_grid / error.se) ** 2, rel=1e-3)
    assert result.fewer > 1
    assert result.efficiency >= 0.999
    # Eight whole readings of three parameters lose little.
    assert 0.7 < result.efficiency_whole <= 1


def test_stick_slip_is_no_candidate():
    # At 7 N sliding is unstable without modulation; K/Kc = 0.88.
    plan = {**PLAN, "fixed": {"W0": "7 N"}}
    plan["ranges"] = {**PLAN["ranges"], "epsilon": [0.02, 0.4, 0.45, 0.5, 0.55]}
    result = design(plan)
    assert result.candidates == 8
    assert result.combinations == 10
    assert list(result.left_out.values()) == [2]
    assert "stick-slip" in next(iter(result.left_out))
    assert all(p.setting["epsilon"] > 0.02 for p in result.points)
    plan["ranges"] = {**PLAN["ranges"], "epsilon": [0.01, 0.02, 0.03, 0.04, 0.05]}
    with pytest.raises(InputError, match=r"got none of 10 \(10 times: .* stick-slip\)"):
        design(plan)


def test_a_nested_law_is_excluded_where_its_parameter_is_measured():
    # For a small lambda, chi-squared of the refitted law without it is (lambda / se)^2.
    plan = {**PLAN, "values": {"eps_ratio": 0.48, "lambda": "0.01 nm"}}
    plan["noise"] = {"delta_mu": 1e-3, "mu1": 5e-8, "phase1": "0.05 mrad", "mu2": 5e-8}
    measured = design(plan)
    del plan["measure"]
    excluded = design({**plan, "rival": "rice-ruina"})
    error = measured.parameters["lambda"]
    assert excluded.chi2 == pytest.approx((error.value / error.se) ** 2, rel=0.03)
    expected = {tuple(p.setting.values()): p.readings for p in measured.points}
    assert {tuple(p.setting.values()): p.readings for p in excluded.points} == expected
    assert excluded.efficiency > 0.95


def test_draws_average_over_the_uncertain_values():
    plan = {**PLAN, "draws": 2, "uncertainty": {"A": 0.001}}
    result = design(plan)
    assert result.candidates == 10
    assert result.efficiency >= 0.999


def test_a_draw_in_which_nothing_slides_steadily_is_left_out():
    plan = {
        **PLAN, "law": "rice-ruina", "free": ["A", "B"], "measure": "A", "values": {},
        "ranges": {**PLAN["ranges"], "epsilon": {"from": 0.05, "to": 0.25, "levels": 3}},
        "fixed": {"K": "0.4 N/um"}, "noise": {"mean_friction": 1e-3, "mu1": 2e-5},
        "draws": 16, "uncertainty": {"A": 0.001},
    }  # fmt: skip
    result = design(plan)
    assert result.candidates == 2
    assert result.readings == 8
    assert 0 < result.parameters["A"].se < 0.001


def test_the_record_and_the_table_hold_the_points(result):
    record = result.record()
    assert [p["readings"] for p in record["points"]] == [p.readings for p in result.points]
    assert record["even_grid"]["times_fewer"] == result.fewer
    row = result.rows()[0]
    assert row["law"] == "elasto-plastic"
    assert row["A"] == 0.013
    assert row["W0"] == 3.0
    assert "inertia" not in row


def test_the_table_of_a_design_is_solved_at_the_amplitude_on_the_contacts(result, tmp_path):
    rows = result.rows()
    write_table(tmp_path / "points.csv", rows[0], [row.values() for row in rows])
    run_table(tmp_path / "points.csv", tmp_path / "out.csv")
    solved = pd.read_csv(tmp_path / "out.csv")
    assert (solved["eps_ratio"] == 0.48).all()
    for name in PLAN["noise"]:
        np.testing.assert_allclose(solved[name], solved[f"predicted_{name}"], rtol=1e-4)


def test_the_table_of_a_design_with_inertia_counts_the_mass(result):
    question = result.plan.question.model_copy(update={"inertia": True})
    heavy = replace(result, plan=replace(result.plan, question=question))
    assert {row["inertia"] for row in heavy.rows()} == {1}


#: One operating point of which three observables leave one combination of two parameters.
ONE_POINT = {
    "material": "bureau2000",
    "points": 3,
    "ranges": {"V": "1 um/s", "epsilon": [0.3], "frequency": "120 Hz", "K": "0.5 N/um"},
    "noise": {"mean_friction": 1e-3, "mu1": {"absolute": 2e-5, "relative": "1 %"},
              "phase1": "1 deg"},
    "law": "elasto-plastic",
    "free": ["A", "B"],
    "rival": "rice-ruina",
    "rival_free": ["A", "B"],
}  # fmt: skip


def test_a_law_that_gives_the_same_readings_is_not_to_be_excluded():
    plan = {**ONE_POINT, "law": "rice-ruina", "rival": "linker-dieterich"}
    with pytest.raises(InputError, match=r"rival must give other readings than rice-ruina.*alpha"):
        design({**plan, "rival_free": ["A", "alpha"]})


def test_a_rival_at_a_bound_of_its_parameters_is_excluded_as_its_misfit_says():
    """Its chi-squared lies far beyond what noise can change."""
    result = design(ONE_POINT, simulate=2)
    assert result.chi2 > 1e4
    assert result.probability == result.simulation.decided == 1
    assert result.fewer == pytest.approx(1)


def test_where_the_rival_loses_its_response_its_misfit_is_a_bound(monkeypatch):
    monkeypatch.setattr(RivalFit, "reached", lambda fits, n, end: False)
    result = design(ONE_POINT)
    assert result.probability is result.probability_even_grid is None
    assert np.isnan(result.fewer)
    assert result.efficiency == result.efficiency_whole == 0
    assert sum("next to values with which it has no response" in w for w in result.warnings) == 2
    text = as_text(_sections(result))
    assert "an unknown number of times fewer readings" in text
    assert "probability of deciding unknown (even grid unknown)" in text
