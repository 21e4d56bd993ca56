"""Fits at every point of a plan, against linear regression and planted noise."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.stats import chi2

from asperity import materials
from asperity.errors import InputError
from asperity.inference import Prior, table_of
from asperity.study import (
    SweepPlan,
    export_store,
    job,
    load_plan,
    open_store,
    run_sweep,
    store_status,
)
from asperity.study.solve.fit import FitSolve, _fixed
from references.closed_form_sweep import ThisProcess

PMMA = materials.load("bureau2000")
V = np.geomspace(1e-7, 1e-5, 7)
ERROR = 1e-3


@pytest.fixture(autouse=True)
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NPROC", "1")
    job._opened.cache_clear()


def write(path: Path, seed: int, rows: int = 7) -> np.ndarray:
    """Friction of steady sliding, with noise; the readings."""
    noise = ERROR * np.random.default_rng(seed).standard_normal(V.size)
    # Modulation by 1e-6 moves the mean by 1e-12.
    mean = PMMA.mu0 - (PMMA.B - PMMA.A) * np.log(V / PMMA.V0) + noise
    lines = ["V,mean_friction,mean_friction_err"]
    lines += [f"{v!r},{m!r},{ERROR}" for v, m in zip(V.tolist(), mean.tolist(), strict=True)]
    path.write_text("\n".join(lines[: rows + 1]) + "\n")
    return np.asarray(mean)


def plan(folder: Path, **fields: Any) -> SweepPlan:
    return SweepPlan(
        **{
            "folder": folder,
            "solve": "fit",
            "law": "rice-ruina",
            "material": "bureau2000",
            "parameters": {"K": "1 N/um", "epsilon": 1e-6, "frequency": "120 Hz"},
            "fit": {"free": ("mu0", "B"), "starts": 4},
            **fields,
        }
    )


def test_fits_over_files_and_a_fixed_number_are_linear_regressions(tmp_path: Path) -> None:
    means = [write(tmp_path / name, seed) for seed, name in enumerate(("a.csv", "b.csv"))]
    write(tmp_path / "short.csv", 2, rows=1)
    axes = {"data": {"values": ("a.csv", "b.csv", "short.csv")}, "A": {"values": (0.01, 0.013)}}
    told: list[str] = []
    out = tmp_path / "s.zarr"
    run_sweep(plan(tmp_path, axes=axes), out, workers=ThisProcess(), log=told.append)
    dataset = open_store(out)
    assert dataset["data"].values.tolist() == ["a.csv", "b.csv", "short.csv"]
    # Weighted least squares: mean = mu0 - (B - A) ln(V/V0).
    columns = np.column_stack([np.ones_like(V), -np.log(V / PMMA.V0)])
    covariance = ERROR**2 * np.linalg.inv(columns.T @ columns)
    for i, mean in enumerate(means):
        (mu0, slope), (square,), *_ = np.linalg.lstsq(columns, mean)
        at = dataset.isel(data=i)
        assert at["mu0_fit"].values == pytest.approx(mu0, rel=1e-6)
        assert at["B_fit"].values == pytest.approx(slope + dataset["A"].values, rel=1e-5)
        assert at["B_se"].values == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-4)
        assert at["chi2"].values == pytest.approx(square / ERROR**2, rel=1e-5)
        assert at["p_value"].values == pytest.approx(chi2.sf(square / ERROR**2, 5), rel=1e-4)
    # Fewer data than parameters are no estimate.
    assert store_status(out).outcomes == {"converged": 4, "refused": 2}
    assert np.isnan(dataset["B_fit"].sel(data="short.csv")).all()
    assert "must hold more data than free parameters" in told[0]
    # Names of files are texts in every format.
    for suffix in ("csv", "nc"):
        assert export_store(out, tmp_path / f"s.{suffix}") == 6
    names = pd.read_csv(tmp_path / "s.csv")["data"]
    assert names.tolist() == ["a.csv", "a.csv", "b.csv", "b.csv", "short.csv", "short.csv"]
    with xr.open_dataset(tmp_path / "s.nc") as exported:
        assert exported["data"].values.tolist() == dataset["data"].values.tolist()
    # Other readings in a file of the same name are another plan.
    write(tmp_path / "b.csv", 5)
    with pytest.raises(InputError, match=r"same plan, got settings\.files\.b\.csv = "):
        run_sweep(plan(tmp_path, axes=axes), out, workers=ThisProcess())


def test_a_seed_that_is_no_whole_number_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", 0)
    drawn = {"draw": "random", "count": 5, "over": {"noise_seed": {"from": 0, "to": 9}}}
    for axes, sentence in (
        ({"noise_seed": {"from": 0, "to": 1, "count": 5}}, "be a whole number from 0, got 0.25"),
        ({"noise_seed": {"values": (0, 1.5)}}, "be a whole number from 0, got 1.5"),
        ({"s": drawn}, "noise_seed must be listed"),
    ):
        fractional = plan(tmp_path, fit={"free": ("A",), "data": "a.csv"}, axes=axes)
        with pytest.raises(InputError, match=sentence):
            run_sweep(fractional, tmp_path / "out.zarr", workers=ThisProcess())


def test_readings_drawn_at_true_values_scatter_as_the_standard_errors_say(tmp_path: Path) -> None:
    write(tmp_path / "a.csv", 0)
    # Readings without what the rows say of them, but with their uncertainties.
    seeds, true = 16, 0.02

    def drawn(A: float, count: int) -> xr.Dataset:
        out = tmp_path / f"{A}.zarr"
        drawn_plan = plan(
            tmp_path,
            fit={"free": ("mu0", "B"), "starts": 1, "data": "a.csv"},
            parameters={"K": "1 N/um", "epsilon": 1e-6, "frequency": "120 Hz", "B": true},
            axes={"noise_seed": {"values": tuple(range(count))}, "A": {"values": (A,)}},
            outputs=("B_fit", "B_se", "chi2"),
        )
        run_sweep(drawn_plan, out, workers=ThisProcess())
        return open_store(out).isel(A=0)

    dataset = drawn(0.01, seeds)
    pull = ((dataset["B_fit"] - true) / dataset["B_se"]).values
    low, high = chi2.ppf([1e-4, 1 - 1e-4], seeds)
    assert low < (pull**2).sum() < high
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 5 * seeds)
    assert low < dataset["chi2"].sum() < high
    # One seed is one noise, whatever else varies.
    assert drawn(0.012, 4)["chi2"].values == pytest.approx(dataset["chi2"].values[:4], rel=1e-4)


def test_harmonics_are_disturbed_in_the_complex_plane_with_the_correlations_of_the_table() -> None:
    rows, amplitude, phase, wide, across = 4000, 2e-3, 0.7, 1e-4, 0.2
    table = table_of(
        {
            "V": np.geomspace(1e-6, 1e-5, rows), "epsilon": 0.1, "frequency": 120.0,
            "mu1": amplitude, "mu1_err": wide, "phase1": -2.0, "phase1_err": across,
            "mu1_phase1_cov": 0.6 * wide * across,
        }
    )  # fmt: skip
    root = np.linalg.cholesky(table.correlations())
    normal = np.random.default_rng(0).standard_normal(root.shape[:2])
    exact = {"mu1": np.full(rows, amplitude), "phase1": np.full(rows, phase)}
    drawn = table.disturbed(exact, np.einsum("rij,rj->ri", root, normal))
    turned = drawn.values["mu1"] * np.exp(1j * (drawn.values["phase1"] - phase)) - amplitude
    # 4,000 rows: 1.1 % on a standard deviation.
    assert turned.real.std() == pytest.approx(wide, rel=0.05)
    assert turned.imag.std() == pytest.approx(amplitude * across, rel=0.05)
    assert np.corrcoef(turned.real, turned.imag)[0, 1] == pytest.approx(0.6, abs=0.05)
    assert drawn.values["mu1"] * drawn.errors["phase1"] == pytest.approx(amplitude * across)
    assert drawn.correlations() == pytest.approx(table.correlations())


def test_a_prior_of_K_over_the_load_keeps_its_unit(tmp_path: Path) -> None:
    """It was taken in N/m, as of a load of 1 N."""
    write(tmp_path / "a.csv", 0)
    fit = {"free": ("K",), "prior": {"K": "0.03+-0.001 1/um"}, "data": "a.csv"}
    axes = {"A": {"values": (0.01, 0.012)}}
    prior = FitSolve().settings(plan(tmp_path, fit=fit, axes=axes))["prior"]["K"]
    assert Prior(*prior) == Prior(3e4, 1e3, "given", "1/m")


@pytest.mark.parametrize(
    ("fit", "message"),
    [
        ("", "fit must be given where solve is 'fit'"),
        ("[fit]\nfree = ['B']", r"fit\.data must name a table of readings"),
        ("[fit]\nfree = ['Bee']\ndata = 'a.csv'", r"fit\.free must be a known name, got 'Bee'"),
        ("[fit]\nfree = ['B']\ndata = 'b.csv'", "must be a CSV that can be read, got .*b.csv"),
        ("[fit]\nfree = ['B']\ndata = \"\\u0000.csv\"", r"fit\.data must be the path of a file"),
        ("[fit]\nfree = ['B']\ndata = 'a.csv'\n[axes.law]\nvalues = [\"\\u0000.py:Mine\"]",
         "law must be the path of a file"),
        ("[fit]\nfree = ['B']\ndata = 'a.csv'\nprior = { A = { mean = 1, std = 1 } }",
         r"fit\.prior must be of free parameters, got 'A'"),
        ("[fit]\nfree = ['B']\ndata = 'a.csv'\nstart = 3", "did you mean 'starts'"),
        ("[fit]\nfree = ['B']\ndata = 'a.csv'\n[axes.data]\nvalues = ['a.csv']", "got both"),
        ("[fit]\nfree = ['M']\ndata = 'a.csv'", "got 'M', which has no influence without inertia"),
        ("[fit]\nfree = ['M']\ndata = 'a.csv'\n[axes.inertia]\nvalues = [true, false]", "got 'M'"),
        ("[fit]\nfree = ['B']\ndata = 'a.csv'\n[axes.pull]\nvalues = [0.1, 0.2]",
         "pull must be a parameter of a harmonic load"),
        ("[transient]\nsteps = []\nsampling = 1\nnumbers = {}", "transient must be left out"),
    ],
)  # fmt: skip
def test_mistakes_in_plans_of_fits(tmp_path: Path, fit: str, message: str) -> None:
    write(tmp_path / "a.csv", 0)
    (tmp_path / "plan.toml").write_text(
        "solve = 'fit'\nlaw = 'rice-ruina'\nmaterial = 'bureau2000'\n"
        f"[parameters]\nepsilon = 0.1\nfrequency = '1 Hz'\nK = '1 N/um'\n{fit}\n"
        "[axes.A]\nvalues = [0.01]\n"
    )
    with pytest.raises(InputError, match=message):
        run_sweep(load_plan(tmp_path / "plan.toml"), tmp_path / "s.zarr", workers=ThisProcess())
    assert not (tmp_path / "s.zarr").exists()


def test_columns_of_the_table_come_before_a_material_and_after_the_plan() -> None:
    table = table_of(
        {"V": V, "epsilon": 0.1, "frequency": 1.0, "W0": 3.0, "K": 1e6, "delta_mu": -V,
         "delta_mu_err": 1e-3}
    )  # fmt: skip
    values = {"W0": 7.0, "K": 2e6, "A": 0.01, "B": 0.02, "noise_seed": 1.0, "epsilon2": 0.0}
    # The stiffness varies along an axis, the load is the material's; B is free.
    fixed = _fixed(values, ["W0", "K", "A", "V"], {"W0": "bureau2000", "A": "bureau2000"}, [table])
    assert fixed == {"K": 2e6, "A": 0.01}
