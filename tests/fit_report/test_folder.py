"""The folder of a fit: a page with nothing to fetch, a material that loads, all or nothing."""

import json
import re

import numpy as np
import pytest

from asperity import Slider, materials, periodic_response
from asperity.fit_report import write_report
from asperity.inference import fit, table_of


@pytest.fixture(scope="module")
def found():
    pmma = materials.load("bureau2000")
    epsilon = np.linspace(0.1, 0.5, 6)
    slider = Slider(pmma.law("elasto-plastic"), spring=pmma.K, load=pmma.W0)
    exact = periodic_response(slider, velocity=1e-6, epsilon=0.5 * epsilon, frequency=120.0)
    noise = np.random.default_rng(0).normal(size=(2, 6))
    columns = {"V": 1e-6, "epsilon": epsilon, "frequency": 120.0}
    columns |= {"delta_mu": exact.delta_mu + 1e-3 * noise[0], "delta_mu_err": 1e-3}
    columns |= {"mu1": exact.mu1 + 2e-5 * noise[1], "mu1_err": 2e-5}
    table = table_of(columns, name="<readings>")
    return fit(table, "elasto-plastic", ("lambda", "eps_ratio"), material=pmma)


def test_the_folder_holds_the_fit(found, tmp_path):
    folder = tmp_path / "report"
    write_report(folder, found)
    assert sorted(p.name for p in folder.iterdir()) == ["fit.json", "material.toml", "report.html"]
    estimate = found.parameters["lambda"]
    material = materials.load(folder / "material.toml")
    assert material.lambda_ == estimate.value
    assert material["lambda"].si_uncertainty == pytest.approx(estimate.se)
    assert material["A"].kind == "assumed"
    assert material.law("elasto-plastic").lambda_ == estimate.value
    record = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert record["parameters"]["lambda"]["value"] == estimate.value
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2
    assert "&lt;readings&gt;" in page
    assert f"{estimate.value:.6g}" in page
    # Nothing is fetched: no address outside the page in any attribute that loads.
    assert re.findall(r'(?:src|href)="(?!#)[^"]*"', page) == []
    assert "@import" not in page


def test_a_folder_that_cannot_be_written_stays_as_it_was(found, tmp_path):
    (tmp_path / "report").write_text("a file", encoding="utf-8")
    with pytest.raises(ValueError, match="folder"):
        write_report(tmp_path / "report", found)
    assert (tmp_path / "report").read_text(encoding="utf-8") == "a file"
