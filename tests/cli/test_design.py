"""The commands that design an experiment and repeat the paper's procedure."""

import csv
import json

import pytest

from references.commands import refused

PLAN = """
law = "elasto-plastic"
material = "bureau2000"
free = ["lambda", "eps_ratio", "A"]
measure = "lambda"
points = 8
[ranges]
V = ["1 um/s", "10 um/s"]
epsilon = { from = 0.1, to = 0.5, levels = 5 }
frequency = "120 Hz"
[fixed]
W0 = "3 N"
[values]
eps_ratio = 0.48
[noise]
delta_mu = 1e-3
mu1 = 2e-5
phase1 = "2 deg"
mu2 = 1e-5
"""


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return path


def test_points_as_text_JSON_and_a_table(asperity, plan, tmp_path):
    table = tmp_path / "points.csv"
    result = asperity("design", plan, "--csv", table, "--json")
    assert result.exit_code == 0
    record = json.loads(result.stdout)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert sum(int(row["readings"]) for row in rows) == record["readings"] == 8
    assert [float(row["epsilon"]) for row in rows] == [p["epsilon"] for p in record["points"]]
    assert {row["law"] for row in rows} == {"elasto-plastic"}
    result = asperity("design", plan)
    assert result.exit_code == 0
    assert "to measure lambda" in result.stdout
    assert "10 of 10 combinations can be used" in result.stdout


def test_a_mistake_in_a_plan_is_one_line_and_leaves_no_file(asperity, plan, tmp_path):
    table = tmp_path / "points.csv"
    plan.write_text(PLAN.replace('"120 Hz"', "120"))
    refused(asperity("design", plan, "--csv", table), "frequency must carry a unit")
    assert not table.exists()
    assert asperity("design", plan, "--csv", plan).exit_code == 2
    assert asperity("design", tmp_path / "absent.toml").exit_code == 2


def test_a_recipe_needs_its_measurements(asperity, tmp_path):
    readings, thresholds = tmp_path / "readings.csv", tmp_path / "thresholds.csv"
    readings.write_text("V,epsilon,frequency,delta_mu,delta_mu_err\n1e-6,0.3,120,-0.05,0.002\n")
    thresholds.write_text(
        "V,K_over_W0,K_over_W0_err,frequency,frequency_err\n1e-6,32500,1000,0.4,0.04\n"
    )
    refused(
        asperity("recipe", "bureau2000", readings, "--thresholds", thresholds),
        "must have rows with epsilon = 0 and mean_friction",
    )
    refused(asperity("recipe", "bureau1999", readings, "--thresholds", thresholds), "bureau2000")
