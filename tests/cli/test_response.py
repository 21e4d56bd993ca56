"""`asperity response` for one operating point."""

import json
import math
import sys

import numpy as np
import pytest

import asperity as asp
from asperity.outputs.json import to_json
from references.commands import refused

POINT = ("--law", "elasto-plastic", "-V", "1 um/s", "-e", "0.24", "-f", "120 Hz")
KEYS = {
    *("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"),
    *("harmonics", "multipliers", "log_multipliers", "floquet_max", "floquet"),
    *("mode", "mode_frequency", "growth_rate"),
    *("stable", "converged", "result", "provenance"),
}


def strict(text: str) -> dict:
    """JSON as its standard has it."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def test_json_holds_the_response_of_the_library(asperity) -> None:
    shown = asperity(
        "response", *POINT, "--material", "bureau2000", "--set", "A=0.013",
        "--set", "K = 0.3 N/um", "--json",
    )  # fmt: skip
    assert (shown.exit_code, shown.stderr) == (0, "")
    record = strict(shown.stdout)
    assert set(record) == KEYS
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("elasto-plastic"), spring="0.3 N/um", mass=pmma.M, load=pmma.W0)
    r = asp.periodic_response(slider, velocity="1 um/s", epsilon=0.24, frequency="120 Hz")
    for key in ("mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2"):
        assert record[key] == float(getattr(r, key)), key
    assert record["harmonics"] == [[c.real, c.imag] for c in r.harmonics]
    assert record["multipliers"] == [[m.real, m.imag] for m in r.multipliers]
    assert record["floquet"] == record["multipliers"]  # the name in earlier versions
    assert record["log_multipliers"] == [[m.real, m.imag] for m in r.log_multipliers]
    assert (record["stable"], record["converged"], record["result"]) == (True, True, "converged")


def test_provenance_says_version_numbers_with_units_and_source(asperity) -> None:
    shown = asperity(
        "response", *POINT, "--material", "bureau2000", "--set", "K=0.3 N/um", "--json"
    )
    provenance = strict(shown.stdout)["provenance"]
    assert provenance["version"] == asp.__version__
    assert provenance["law"] == "elasto-plastic"
    assert provenance["relative_tolerance"] == 1e-8
    assert provenance["parameters"]["K"] == {"value": 3e5, "unit": "N/m", "from": "command line"}
    assert provenance["parameters"]["lambda"] == {"value": 7e-7, "unit": "m", "from": "bureau2000"}
    assert provenance["citation"]["bureau2000"].startswith("@article{bureau2000,")


def test_text_shows_numbers_with_units(asperity) -> None:
    shown = asperity("response", *POINT, "--material", "bureau2000")
    assert shown.exit_code == 0
    for part in ("400 nm", "1 um/s", "120 Hz", "mean_friction", "rad", "floquet_max", "stable"):
        assert part in shown.stdout


def test_without_a_material_all_numbers_come_from_set(asperity) -> None:
    given = ("--law", "amontons", "--set", "mu0=0.4", "--set", "K=1 N/um", "--set", "W0=2 N")
    shown = asperity("response", *given, *POINT[2:], "--json")
    assert shown.exit_code == 0
    record = strict(shown.stdout)
    assert record["mean_friction"] == pytest.approx(0.4, rel=1e-15)
    assert record["mu1"] == pytest.approx(0.4 * 0.24, rel=1e-15)
    assert (record["floquet"], record["stable"]) == ([], True)


def test_without_a_material_the_missing_numbers_are_listed(asperity) -> None:
    refused(
        asperity("response", *POINT, "--set", "A=0.01", "--set", "K=1 N/um"),
        "got none for mu0, B, D0, V0, lambda, W0;",
    )


def test_a_multiplier_beyond_double_precision_is_null(asperity) -> None:
    point = ("--law", "rice-ruina", "-V", "1 um/s", "-e", "0.2", "-f", "0.00001 Hz")
    shown = asperity("response", *point, "--material", "bureau2000", "--json")
    assert shown.exit_code == 0
    record = strict(shown.stdout)
    assert record["multipliers"][0] == [None, None] or record["multipliers"][0] == [None, 0.0]
    assert record["log_multipliers"][0][0] > math.log(sys.float_info.max)
    assert (record["stable"], record["converged"]) == (False, True)


def test_a_failed_point_says_why_and_gives_no_number(asperity) -> None:
    # Far outside of any experiment: nothing can be resolved there.
    point = ("--law", "rice-ruina", "-V", "1e300 m/s", "-e", "0.2", "-f", "120 Hz")
    shown = asperity("response", *point, "--material", "bureau2000", "--json")
    assert shown.exit_code == 1
    record = strict(shown.stdout)
    assert set(record) == KEYS
    assert (record["converged"], record["stable"]) == (False, False)
    assert record["result"] != "converged"
    assert (record["mode"], record["growth_rate"]) == ("", None)
    assert record["mean_friction"] is record["mu1"] is record["phase2"] is None
    assert record["harmonics"] == [[None, None]] * 8
    assert record["multipliers"] == record["log_multipliers"] == [[None, None]] * 2
    assert shown.stderr == f"asperity: {record['result']}\n"


def test_json_is_strict() -> None:
    record = {"a": np.float64("inf"), "b": [math.nan, 1.5], "c": {"d": (-math.inf,)}, "e": "NaN"}
    assert strict(to_json(record)) == {"a": None, "b": [None, 1.5], "c": {"d": [None]}, "e": "NaN"}


def test_other_modulations_by_set(asperity) -> None:
    point = ("response", "--law", "rice-ruina", *POINT[2:], "--material", "bureau2000", "--json")
    shown = asperity(*point, "--set", "epsilon2=3 %", "--set", "pull=0.2", "--set", "tilt=50 mrad")
    assert (shown.exit_code, shown.stderr) == (0, "")
    record = strict(shown.stdout)
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("rice-ruina"), spring=pmma.K, mass=pmma.M, load=pmma.W0)
    load = asp.loads.modulated(0.24, load={2: (0.03, 0.0)}, pull=0.2, tilt=0.05)
    r = asp.periodic_response(slider, velocity="1 um/s", frequency="120 Hz", modulation=load)
    for key in ("mean_friction", "mu1", "mu2", "phase1", "phase2"):
        assert record[key] == float(getattr(r, key)), key
    parameters = record["provenance"]["parameters"]
    assert parameters["pull"] == {"value": 0.2, "unit": "", "from": "command line"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (("-e", "0.7", "--set", "epsilon2=-0.4"), "load must stay positive over the period"),
        (("-e", "0.2", "--set", "tilt=1.6"), "tilt must be less than a right angle"),
    ],
)
def test_other_modulations_that_are_refused(asperity, settings, message) -> None:
    point = ("response", "--law", "rice-ruina", "-V", "1 um/s", "-f", "120 Hz")
    refused(asperity(*point, *settings, "--material", "bureau2000"), message)
