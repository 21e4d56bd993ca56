"""`asperity response` for one operating point, and `asperity map` over two numbers of it."""

import json
import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

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


def test_an_unstable_response_is_said_to_be_left(asperity) -> None:
    # Without modulation sliding is unstable below (B - A) W0/(D0 + A lambda) = 0.222 N/um.
    sliding = ("-e", "0", "--material", "bureau2000", "--set")
    point = ("response", *POINT[:4], *POINT[6:], *sliding)
    assert "the response is unstable" in asperity(*point, "K=0.22 N/um").stderr
    assert not asperity(*point, "K=0.23 N/um").stderr


def test_slip_that_would_reverse_is_said(asperity) -> None:
    """The exciter is tilted: the shear force on the slider exceeds that of the spring."""
    half = ("-e", "0.5", "--material", "bureau2000", "--set")
    point = ("response", *POINT[:4], *POINT[6:], *half)
    tilted = asperity(*point, "tilt=50 deg", "--json")
    assert tilted.exit_code == 0
    assert "slip would reverse" in tilted.stderr
    assert "slip would reverse" in json.loads(tilted.stdout)["result"]
    assert not asperity(*point, "tilt=5 deg").stderr


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


LAW = ("map", "--law", "rice-ruina", "--material", "bureau2000", "-V", "1 um/s", "-f", "120 Hz")
AXES = ("--x", "epsilon=0:0.4:5", "--y", "K=0.1:0.3:5 N/um")
KC = (0.026 - 0.013) * 7.0 / 0.4e-6


def test_a_map_as_file_picture_and_json(asperity, tmp_path: Path) -> None:
    out, plot = tmp_path / "map.nc", tmp_path / "map.png"
    result = asperity(*LAW, *AXES, "--out", out, "--plot", plot, "--show", "mu1", "--json")
    assert result.exit_code == 0, result.stderr
    record = json.loads(result.stdout)
    assert record["points"] == 25
    assert record["stable"] + record["unstable"] == 25
    assert record["failed"] == record["boundary_not_found"] == 0
    (line,) = record["boundaries"]
    unmodulated = line["K"][line["epsilon"].index(0.0)]
    assert unmodulated == pytest.approx(KC, rel=2e-6)
    assert set(line["kind"]) == {"Neimark-Sacker"}
    assert plot.read_bytes().startswith(b"\x89PNG")
    with xarray.open_dataset(out) as dataset:
        assert dataset["mu1"].dims == ("K", "epsilon")
        assert dataset["A"].attrs["origin"] == "bureau2000"
        assert dataset["V"].attrs["origin"] == "command line"
        assert int(dataset["stable"].sum()) == record["stable"]


def test_a_map_as_text_on_logarithmic_axes(asperity, tmp_path: Path) -> None:
    out = tmp_path / "map.nc"
    call = (*LAW, "--x", "epsilon=0.001:0.1:3", "--log-x", "--y", "K=0.1:0.4:3 N/um", "--log-y")
    result = asperity(*call, "--out", out)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.split()[:2] == ["points", "9"]
    assert "boundary  Neimark-Sacker" in result.stdout
    with xarray.open_dataset(out) as dataset:
        np.testing.assert_allclose(dataset["epsilon"], [1e-3, 1e-2, 1e-1], rtol=1e-12)
        np.testing.assert_allclose(dataset["K"], [1e5, 2e5, 4e5], rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("--x", "K"), ["--x must be NAME=LOW:HIGH:COUNT UNIT, got 'K'"]),
        (("--x", "K=1:2:5"), ["--x must carry a unit"]),
        (("--x", "epsilon=0:0.4:5", "--log-x"), ["must start above zero to be logarithmic"]),
        (("--x", "K=0.1:0.3:5 N/um"), ["axes must be two numbers, got 'K' on both"]),
        (("--x", "V=1:10:5 um/s"), ["V must be given once"]),
        (("--set", "K=0.2 N/um"), ["K must be given once"]),
        (("--show", "mu9"), ["--show must be one of mean_friction, delta_mu"]),
        (("--plot", "map.jpg"), ["--plot must be a PNG file"]),
        (("--plot", "no/map.png"), ["--plot must lie in a folder that exists"]),
        (("--out", "no/map.nc"), ["--out must lie in a folder that exists"]),
        (("--out", "."), ["--out must be the name of a file, got '.'"]),
        (("--out", "map.csv"), ["--out must be a NetCDF file, got 'map.csv'"]),
    ],
)
def test_a_bad_question_to_a_map(asperity, tmp_path, monkeypatch, arguments, parts) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--x": "epsilon=0:0.4:5", "--y": "K=0.1:0.3:5 N/um", "--out": "map.nc"}
    given = dict(zip(arguments[::2], arguments[1::2], strict=False))
    call = [text for pair in options.items() if pair[0] not in given for text in pair]
    refused(asperity(*LAW, *call, *arguments), *parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("missing", ["--x", "--y", "--out"])
def test_a_missing_option_of_a_map(asperity, tmp_path, monkeypatch, missing) -> None:
    monkeypatch.chdir(tmp_path)
    options = {"--x": "epsilon=0:0.4:5", "--y": "K=0.1:0.3:5 N/um", "--out": "map.nc"}
    call = [text for pair in options.items() if pair[0] != missing for text in pair]
    refused(asperity(*LAW, *call), f"{missing} must be given, got nothing")
    refused(asperity("map", *call), "must be given, got nothing")


def test_a_map_without_numbers_is_told(asperity, tmp_path) -> None:
    call = ("map", "--law", "rice-ruina", *AXES, "-V", "1 um/s", "-f", "120 Hz")
    refused(asperity(*call, "--out", tmp_path / "m.nc"), "got none for mu0, A, B, D0, V0, W0")


def test_steady_sliding_has_no_figure_of_stick_slip(asperity, tmp_path, monkeypatch) -> None:
    steady = SimpleNamespace(result="no stick-slip", slips=0, steady=True, values=list)
    monkeypatch.setattr("asperity.experiment.stick_slip_response", lambda *_, **__: steady)
    point, picture = (*POINT[:4], "--material", "bureau2000"), tmp_path / "cycle.png"
    result = asperity("response", *point, "--stick-slip", "--plot", picture)
    assert result.exit_code == 0
    assert f"there is no figure {picture}: no stick-slip" in result.stderr
