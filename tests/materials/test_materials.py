"""Published numbers: what is in the files, and the message for a bad file."""

import math
import pickle
from pathlib import Path

import jax
import numpy as np
import pytest

from asperity import materials
from asperity.errors import InputError
from asperity.laws import ElastoPlastic, law_parameters, registered
from asperity.materials import Material, Number

#: Every number that section III and the appendix hand to the models, in SI, typed from the paper.
CENTRAL = {
    "mu0": 0.5,
    "A": 0.013,
    "B": 0.026,
    "D0": 0.4e-6,
    "V0": 1e-6,
    "lambda": 0.7e-6,
    "alpha": 0.2,
    "W0": 7.0,
    "K": 0.2e6,
    "M": 1.6,
    "frequency": 120.0,
    "lambda_z": 0.4e-6,
    "h0": 6.5e-6,
    "eta_air": 1e-5,
    "R": 0.039,
    "P0": 1e5,
    "Sigma0": 49e-4,
    "P_vacuum": 100.0,
    "relative_drop": 0.2,
}
KINDS = {"V0": "assumed", "lambda": "fitted", "transmission": "fitted", "K": "published"}

GOOD = """
title = "A test"
[numbers.K]
value = 3
uncertainty = 0.5
unit = "kN/m"
dimension = "stiffness"
kind = "assumed"
place = "nowhere"
"""


@pytest.fixture
def pmma() -> Material:
    return materials.load("bureau2000")


def test_central_values_and_kinds(pmma: Material) -> None:
    assert {name: pmma[name].si for name in CENTRAL} == pytest.approx(CENTRAL, rel=1e-15)
    assert all(getattr(pmma, name) == pmma[name].si for name in CENTRAL)
    assert {name: pmma[name].kind for name in KINDS} == KINDS


def test_only_v0_is_assumed(pmma: Material) -> None:
    assert [n for n, number in pmma.numbers.items() if number.kind == "assumed"] == ["V0"]


def test_uncertainties_and_ranges_are_si_too(pmma: Material) -> None:
    assert pmma["D0"].si_uncertainty == 4e-8
    assert pmma["A"].si_uncertainty == 0.005
    assert pmma["lambda_quasi_static"].si_uncertainty == 1.5e-7
    assert pmma["V_range"].si_range == (1e-7, 1e-4)
    assert pmma["V_data"].si_values == (1e-6, 1e-5)
    assert pmma["K"].si_uncertainty is None
    assert pmma["K"].si_range is None
    assert pmma["K"].si_values is None
    assert pmma["K"].si_unit == "N/m"


def test_the_papers_own_relations_hold(pmma: Material) -> None:
    """Each tolerance is half a unit of the last digit that the paper prints."""
    assert math.sqrt(pmma.K / pmma.M) == pytest.approx(pmma.omega0, abs=10)
    stiffness = pmma.P0 * pmma.Sigma0 / pmma.h0
    assert stiffness == pytest.approx(pmma.kappa_air, abs=0.05e7)
    resonance = math.sqrt(pmma.W0 / (pmma.lambda_z * pmma.M)) / (2 * math.pi)
    assert resonance == pytest.approx(pmma.normal_resonance, abs=5)
    assert pmma.lambda_ / pmma.lambda_over_lambda_z == pytest.approx(pmma.lambda_z, abs=0.05e-6)
    assert pmma.roughness * pmma.gap_over_roughness == pytest.approx(pmma.h0, rel=1e-12)
    assert math.pi * pmma.R**2 == pytest.approx(pmma.Sigma0, rel=0.03)
    assert pmma.Sigma0_side**2 == pytest.approx(pmma.Sigma0, rel=1e-12)


def test_every_number_has_a_place_and_every_source_an_entry(pmma: Material) -> None:
    assert all(number.place for number in pmma.numbers.values())
    assert materials.citation(pmma.source).startswith("@article{bureau2000,")
    cited = {key for law in registered().values() for key in law.source.split(", ")}
    assert cited
    assert cited <= set(materials.available_citations())


@pytest.mark.parametrize("source", ["mylab2026", "A. Author, J. Friction 1, 1 (2026)"])
def test_a_source_without_an_entry_stands_for_itself(source: str) -> None:
    assert materials.cited_works(source) == {source: source}


def test_the_works_of_several_keys() -> None:
    works = materials.cited_works("bureau2000, mylab2026")
    assert works == {"bureau2000": materials.citation("bureau2000"), "mylab2026": "mylab2026"}


def test_citations_are_whole_entries() -> None:
    for key in materials.available_citations():
        entry = materials.citation(key)
        assert entry.count("{") == entry.count("}")
        for field in ("author", "title", "journal", "year", "volume", "pages"):
            assert f"  {field}" in entry
        assert entry.count("@") == 1
    with pytest.raises(InputError, match="did you mean 'linker1992'"):
        materials.citation("linker92")


def test_names(pmma: Material) -> None:
    assert "bureau2000" in materials.available()
    assert pmma.name == "bureau2000"
    assert "K" in pmma
    assert "lambda_" in pmma
    assert "Kc" not in pmma
    assert {"K", "lambda_"} <= set(dir(pmma))
    assert pmma["lambda_"] is pmma["lambda"]
    with pytest.raises(AttributeError, match="has no number 'Kc'"):
        _ = pmma.Kc
    with pytest.raises(InputError, match="did you mean 'lambda_z'"):
        pmma["lambda_x"]
    with pytest.raises(InputError, match="V_range must be a single value here, got 0"):
        _ = pmma.V_range


def test_a_material_is_frozen_and_travels(pmma: Material) -> None:
    with pytest.raises(ValueError, match="frozen"):
        pmma.title = "other"  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(pmma)) == pmma
    assert Material.model_validate_json(pmma.model_dump_json()) == pmma


@pytest.mark.parametrize("name", ["amontons", "rice-ruina", "linker-dieterich", "elasto-plastic"])
def test_every_law_of_the_paper_is_built_from_it(pmma: Material, name: str) -> None:
    law = pmma.law(name)
    assert type(law) is registered()[name]
    for parameter in law_parameters(type(law)):
        field = "lambda_" if parameter == "lambda" else parameter
        assert float(getattr(law, field)) == pmma[parameter].si


def test_overrides(pmma: Material) -> None:
    law = pmma.law("elasto-plastic", lambda_="0.62 um", A=0.02, B="2.5 %")
    assert isinstance(law, ElastoPlastic)
    assert float(law.lambda_) == 6.2e-7
    assert float(law.A) == 0.02
    assert float(law.B) == 0.025
    assert float(law.D0) == pmma.D0
    assert float(pmma.law("elasto-plastic", **{"lambda": 0.0}).lambda_) == 0.0
    np.testing.assert_array_equal(pmma.law("rice-ruina", A=[0.01, 0.02]).A, [0.01, 0.02])


def test_numbers_that_the_paper_has_not_are_given_beside_it(pmma: Material) -> None:
    law = pmma.law("cut-off", V1="1 nm/s", V2=1e-3)
    assert (float(law.V1), float(law.V2), float(law.A)) == (1e-9, 1e-3, pmma.A)
    with pytest.raises(InputError, match="V1 must be a velocity"):
        pmma.law("cut-off", V1="1 nm", V2=1e-3)
    with pytest.raises(InputError, match=r"cut-off.V2 must be given, got nothing"):
        pmma.law("cut-off", V1="1 nm/s")


def test_overrides_can_be_differentiated(pmma: Material) -> None:
    slope = jax.grad(lambda a: pmma.law("rice-ruina", A=a).mu_ss(pmma.V0 * math.e))(0.013)
    assert slope == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "overrides", "message"),
    [
        ("rice-runa", {}, "did you mean 'rice-ruina'"),
        ("rice-ruina", {"a": 0.01}, "got 'a'; did you mean 'A'"),
        ("rice-ruina", {"lambda_": 1e-6}, "got 'lambda'; choose one of A, B, D0, V0, mu0"),
        ("rice-ruina", {"D0": "1 N"}, "rice-ruina.D0 must be a length (m), got '1 N'"),
        ("rice-ruina", {"D0": "0.4"}, "rice-ruina.D0 must carry a unit"),
        ("rice-ruina", {"D0": -1e-6}, "rice-ruina.D0 must be positive, got -1e-06 m"),
        ("rice-ruina", {"A": 0}, "rice-ruina.A must be positive, got 0;"),
        ("rice-ruina", {"A": [0.01, -0.02]}, "rice-ruina.A must be positive, got -0.02;"),
        ("rice-ruina", {"V0": "0 um/s"}, "rice-ruina.V0 must be positive, got 0 m/s"),
        ("rice-ruina", {"B": -0.1}, "rice-ruina.B must not be negative, got -0.1;"),
        ("rice-ruina", {"A": math.nan}, "rice-ruina.A must be finite"),
        (
            "elasto-plastic",
            {"lambda_": "-1 um"},
            "elasto-plastic.lambda must not be negative, got -1e-06 m",
        ),
    ],
)
def test_bad_overrides(
    pmma: Material, name: str, overrides: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        pmma.law(name, **overrides)
    assert message in str(caught.value)


def test_own_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8")
    for given in (path, str(path)):
        mine = materials.load(given)
        assert mine.name == "mine"
        assert mine.K == 3000.0
        assert str(mine["K"]) == "3 +- 0.5 kN/m"
        assert isinstance(mine["K"], Number)
        with pytest.raises(InputError, match=r"rice-ruina\.mu0 must be given"):
            mine.law("rice-ruina")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('title = "A test"', "", "title must be given, got nothing"),
        ('"A test"', '"A test', "material must be valid TOML"),
        ("value = 3", 'value = "3"', "numbers.K.value must be a number, got '3'"),
        ("value = 3", "value = nan", "numbers.K.value must be a finite number, got nan"),
        ("value = 3", "value = -3", "numbers.K must be positive, got -3000 N/m"),
        ("value = 3", "valu = 3", "did you mean 'value'?"),
        ("value = 3\nuncertainty = 0.5", "", "numbers.K must have a value, a range or values"),
        (
            "value = 3",
            "range = [1, 2]",
            "numbers.K must have a value, got only its uncertainty 0.5",
        ),
        ("value = 3", "value = 3\nrange = [2, 1]", "range from low to high, got [2.0, 1.0]"),
        ("uncertainty = 0.5", "uncertainty = -1", "numbers.K.uncertainty must be at least 0"),
        ('"kN/m"', '"kN"', "numbers.K must have a unit of the dimension stiffness, got 'kN'"),
        ('"stiffness"', '"stifness"', "got 'stifness'; did you mean 'stiffness'?"),
        ('"assumed"', '"guessed"', "numbers.K.kind must be one of published, fitted, assumed"),
        ("numbers.K", "numbers.'K c'", "Python attributes and not in use, got 'K c'"),
        ("numbers.K", "numbers.law", "names that are Python attributes and not in use, got 'law'"),
        ("numbers.K", "number.K", "mistakes"),
    ],
)
def test_bad_files_are_told_in_one_sentence(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "mine.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        materials.load(path)
    assert message in str(caught.value)
    assert "mine.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'bureau2000'"):
        materials.load("bureau200")
    with pytest.raises(InputError, match=r"material must be a file, got .*there is none"):
        materials.load(tmp_path / "none.toml")
    with pytest.raises(InputError, match="must be a readable TOML file"):
        materials.load(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"title = '\xe9'")
    with pytest.raises(InputError, match="it is not UTF-8 text"):
        materials.load(tmp_path / "latin.toml")


def test_a_law_takes_no_number_of_another_kind_of_quantity(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = GOOD.replace("numbers.K", "numbers.D0").replace("stiffness", "dimensionless")
    path.write_text(text.replace("kN/m", ""), encoding="utf-8")
    given = {"mu0": 0.6, "A": 0.01, "B": 0.02, "V0": "1 um/s"}
    with pytest.raises(InputError, match=r"rice-ruina.D0 must be a length, got '3 \+- 0.5' in 'mi"):
        materials.load(path).law("rice-ruina", **given)
    law = materials.load(path).law("rice-ruina", D0="3 um", **given)
    assert float(law.D0) == 3e-6
