"""`asperity air`, `materials`, `design` and `reproduce`."""

import csv
import json
from pathlib import Path

import pytest

from asperity import air, materials
from references.commands import refused

MATERIAL = ("--material", "bureau2000")


def test_air_gives_the_fraction_of_the_library(asperity) -> None:
    shown = asperity("air", *MATERIAL, "-f", "120 Hz", "-f", "200 Hz", "--json")
    assert shown.exit_code == 0
    record = json.loads(shown.stdout)
    pmma = materials.load("bureau2000")
    layer = air.AirLayer(P0=pmma.P0, h0=pmma.h0, eta=pmma.eta_air, R=pmma.R)
    machine = {"W0": pmma.W0, "M": pmma.M, "lambda_z": pmma.lambda_z}
    for point, f in zip(record["points"], (120.0, 200.0), strict=True):
        assert point["frequency"] == f
        assert point["ratio"] == air.effective_modulation(f, layer=layer, **machine)
        assert point["phase"] == air.modulation_phase(f, layer=layer, **machine)
    assert record["air_stiffness"] == layer.stiffness


def test_air_text_and_vacuum(asperity) -> None:
    shown = asperity("air", *MATERIAL, "-f", "200 Hz", "--vacuum")
    assert shown.exit_code == 0
    assert "eps_eff/eps" in shown.stdout
    assert "1.16874" in shown.stdout
    assert "gamma" not in shown.stdout
    assert "gamma" in asperity("air", *MATERIAL, "-f", "200 Hz").stdout
    filled, empty = (
        json.loads(asperity("air", *MATERIAL, "-f", "200 Hz", "--json", *more).stdout)
        for more in ((), ("--vacuum",))
    )
    assert filled.keys() == empty.keys()
    assert filled["points"][0].keys() == empty["points"][0].keys()
    assert empty["points"][0]["layer_stiffness"] is empty["gas_flow"] is None


def test_air_set_replaces_the_material(asperity) -> None:
    shown = asperity("air", *MATERIAL, "-f", "120 Hz", "--set", "R=2.5 cm", "--json")
    record = json.loads(shown.stdout)
    assert record["parameters"]["R"] == 0.025
    assert record["points"][0]["ratio"] == pytest.approx(0.48, abs=0.005)


def test_air_has_the_models_of_the_leak(asperity) -> None:
    call = ("air", *MATERIAL, "-f", "200 Hz", "--set", "P0=10 mbar")
    pmma = materials.load("bureau2000")
    layer = {"P0": 1000.0, "h0": pmma.h0, "eta": pmma.eta_air, "R": pmma.R}
    machine = {"W0": pmma.W0, "M": pmma.M, "lambda_z": pmma.lambda_z}
    for flow in ("continuum", "slip", "free-molecular"):
        record = json.loads(asperity(*call, "--gas-flow", flow, "--json").stdout)
        expected = air.AirLayer(**layer, gas_flow=flow)
        ratio = air.effective_modulation(200.0, layer=expected, **machine)
        assert (record["gas_flow"], record["points"][0]["ratio"]) == (flow, ratio)
    refused(asperity(*call, "--gas-flow", "sip"), "--gas-flow must be", "'slip'")
    vacuum = (*call[:-2], "--vacuum", "--gas-flow", "slip")
    refused(asperity(*vacuum), "--gas-flow must have an air layer, got --vacuum;")


@pytest.mark.parametrize(("sought", "name"), [("radius", "R"), ("gap", "h0")])
def test_air_inverse_gives_the_fraction_back(asperity, sought: str, name: str) -> None:
    shown = asperity(
        "air", *MATERIAL, "-f", "120 Hz", "--inverse", "48 %", "--for", sought, "--json"
    )
    (length,) = json.loads(shown.stdout)["solutions"]
    back = asperity("air", *MATERIAL, "-f", "120 Hz", "--set", f"{name}={length!r} m", "--json")
    assert json.loads(back.stdout)["points"][0]["ratio"] == pytest.approx(0.48, rel=1e-9)
    text = asperity("air", *MATERIAL, "-f", "120 Hz", "--inverse", "0.48", "--for", sought)
    assert text.stdout.startswith(f"{name} = ")


def test_air_inverse_without_solution_says_what_can_be_reached(asperity) -> None:
    shown = asperity("air", *MATERIAL, "-f", "120 Hz", "--inverse", "48", "--for", "gap")
    assert (shown.exit_code, shown.stdout) == (1, "")
    assert "there it ranges from" in shown.stderr
    assert shown.stderr.count("\n") == 1


def test_materials_are_listed(asperity) -> None:
    assert asperity("materials").stdout.startswith("bureau2000  PMMA on PMMA")
    assert set(json.loads(asperity("materials", "--json").stdout)) == set(materials.available())


def test_a_material_shows_every_number_with_its_source(asperity) -> None:
    pmma = materials.load("bureau2000")
    text = asperity("materials", "bureau2000").stdout
    record = json.loads(asperity("materials", "bureau2000", "--json").stdout)
    assert set(record["numbers"]) == set(pmma.numbers)
    for name, number in pmma.numbers.items():
        assert f"\n{name} " in text
        assert str(number) in text
        assert record["numbers"][name]["place"] == number.place
    D0 = record["numbers"]["D0"]
    assert (D0["value"], D0["uncertainty"], D0["unit"]) == (0.4, 0.04, "um")
    assert (D0["kind"], D0["si"]["value"], D0["si"]["unit"]) == ("published", 4e-7, "m")


def test_sources_are_cited(asperity) -> None:
    assert asperity("materials", "bureau2000", "--cite").stdout.startswith("@article{bureau2000,")
    everything = asperity("materials", "--cite").stdout
    assert everything.count("@article{") == len(materials.available_citations())


class Summary:
    """What a reproduction hands back."""

    def __init__(self, failed: int) -> None:
        self.failed = failed

    def lines(self) -> list[str]:
        return ["claims 46", f"failed {self.failed}"]


@pytest.mark.parametrize(("failed", "code"), [(0, 0), (2, 1)])
def test_reproduce_prints_the_summary(
    asperity, tmp_path: Path, monkeypatch, failed: int, code: int
) -> None:
    def reproduce(paper, out: Path, progress, data) -> Summary:
        assert paper.name == "bureau2000"
        progress(1, 2, "figures")
        progress(2, 2, "claims")
        out.mkdir(parents=True)
        (out / "index.html").write_text("", encoding="utf-8")
        return Summary(failed)

    monkeypatch.setattr("asperity.ledger.reproduce", reproduce)
    out = tmp_path / "new" / "report"
    shown = asperity("reproduce", "--out", out)
    assert shown.exit_code == code
    assert shown.stdout == f"claims 46\nfailed {failed}\n\nReport: {out / 'index.html'}\n"
    assert (out / "index.html").is_file()
    assert [f.name for f in out.iterdir()] == ["index.html"]


def test_an_interrupted_reproduction_says_how_to_go_on(
    asperity, tmp_path: Path, monkeypatch
) -> None:
    def reproduce(paper, out: Path, progress, data) -> Summary:
        raise KeyboardInterrupt

    monkeypatch.setattr("asperity.ledger.reproduce", reproduce)
    shown = asperity("reproduce", "--out", tmp_path)
    assert shown.exit_code == 130
    assert "is as it was, repeat the command" in shown.stderr


def test_an_unknown_paper_is_refused(asperity, tmp_path: Path) -> None:
    refused(
        asperity("reproduce", "bureau2001", "--out", tmp_path / "report"),
        "did you mean 'bureau2000'?",
    )
    assert list(tmp_path.iterdir()) == []


def test_a_law_of_ones_own_by_its_place(asperity) -> None:
    place = Path(__file__).parents[2] / "examples" / "composite_law.py"
    point = ("-V", "1 um/s", "-e", "0.1", "-f", "120 Hz", "--material", "bureau2000")
    shown = asperity("response", "--law", f"{place}:Composite", *point, "--set", "Vc=1 um/s")
    assert shown.exit_code == 0
    assert shown.stdout.startswith("composite\n")
    refused(asperity("response", "--law", f"{place}:Compsite", *point), "did you mean 'Composite'?")


def test_a_law_of_ones_own_is_fitted_compared_and_served(asperity, tmp_path: Path) -> None:
    place = Path(__file__).parents[2] / "examples" / "composite_law.py"
    data = tmp_path / "readings.csv"
    data.write_text("V,epsilon,frequency,mean_friction,mean_friction_err\n1e-6,0.1,120,0.45,1e-3\n")
    common = (data, *MATERIAL, "--free", "A")
    for command, option, message in (
        ("fit", "--law", "composite must have all its numbers, got none for Vc"),
        ("compare", "--laws", "laws must be two or more, got composite;"),
    ):
        refused(asperity(command, *common, option, f"{place}:Composite"), message)
        refused(
            asperity(command, *common, option, f"{place}:Compsite"), "did you mean 'Composite'?"
        )
    refused(asperity("serve", "--law", f"{place}:Compsite"), "did you mean 'Composite'?")


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


def test_a_design_that_cannot_measure_its_aim_says_so(asperity, plan):
    """One reading at one point tells no parameter apart from the others."""
    one = PLAN.replace("{ from = 0.1, to = 0.5, levels = 5 }", "0.1")
    one = one.replace('["1 um/s", "10 um/s"]', '"1 um/s"').replace("delta_mu = 1e-3\n", "")
    plan.write_text(one.replace('phase1 = "2 deg"\nmu2 = 1e-5\n', ""))
    result = asperity("design", plan)
    assert result.exit_code == 1
    assert "lambda will not be determined by these readings" in result.stdout
    assert "an unknown number of times fewer readings" in result.stdout


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
    readings.write_text("V,epsilon,delta_mu,delta_mu_err\n1e-6,0.3,-0.05,0.002\n")
    command = ("recipe", "bureau2000", readings, "--thresholds", thresholds)
    refused(asperity(*command), "got none for frequency", "--fix frequency")
    refused(asperity(*command, "--fix", "frequency=120 Hz"), "must have rows with epsilon = 0")
    refused(asperity("recipe", "bureau1999", readings, "--thresholds", thresholds), "bureau2000")
