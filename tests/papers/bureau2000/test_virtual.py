"""The virtual experiment: measurements of simulated recordings, compared with computed orbits."""

import os

import numpy as np
import pandas as pd
import pytest
from loky import cpu_count
from scipy.stats import binom

import asperity as asp
from asperity.air import AirLayer, effective_modulation
from asperity_papers.bureau2000 import recordings
from asperity_papers.bureau2000.curves import WORDS
from asperity_papers.bureau2000.recordings import QUANTITIES, all_series
from asperity_papers.bureau2000.virtual import (
    NORMAL,
    VIRTUAL,
    Read,
    RecoveredQuantity,
    collapse,
    with_model,
)

PMMA = asp.materials.load("bureau2000")
SLOW, FAST = "1 um/s", "10 um/s"
#: B of the machine: 0.6 of the stated uncertainty, 0.01, below the stated 0.026.
B = 0.020
SLIDER = asp.Slider(PMMA.law("elasto-plastic", B=B), spring=PMMA.K, load=PMMA.W0, mass=PMMA.M)


@pytest.fixture(scope="module")
def simulated(experiment):
    figures = [compute(experiment) for compute in VIRTUAL]
    return {figure.numbers.name: figure for figure in figures}


def borne(frequency, vacuum=False):
    """eps_eff/eps with the air layer of the appendix under a disc of 2.51 cm: 0.48 at 120 Hz."""
    layer = None if vacuum else AirLayer(P0=1e5, h0=6.5e-6, eta=1e-5, R=2.5140636870386906e-2)
    return float(effective_modulation(frequency, W0=7.0, M=1.6, lambda_z=0.4e-6, layer=layer))


def test_the_machine_slides_steadily_without_modulation():
    """K > (B - A (1 + lambda K/W0)) W0/D0, which is not true for the central B."""

    def critical(B):
        return (B - 0.013 * (1 + 0.7e-6 * 0.2e6 / 7)) * 7 / 0.4e-6

    assert critical(B) < PMMA.K < critical(0.026)
    np.testing.assert_allclose(recordings.slider().law.B, B, rtol=1e-12)
    assert abs(B - PMMA.B) < PMMA["B"].si_uncertainty


def test_the_series_are_those_of_the_paper(experiment):
    assert list(experiment) == [SLOW, FAST, "3.16 um/s", "31.6 um/s", "100 um/s", "1 mbar", "1 atm"]
    for series in all_series():
        rows = experiment[series.name]
        pressure = {"vacuum": series.name == "1 mbar"}
        assert series.frequency == (200.0 if series.name in ("1 mbar", "1 atm") else 120.0)
        np.testing.assert_allclose(
            rows["epsilon_eff"], borne(series.frequency, **pressure) * rows["epsilon_set"],
            rtol=1e-9,
        )  # fmt: skip
        assert 0.5 in series.epsilons
        assert len(set(series.seeds)) == 3
    seeds = [seed for series in all_series() for seed in series.seeds]
    assert len(set(seeds)) == len(seeds)


def test_the_experiment_runs_in_another_process_if_there_is_a_second_core(monkeypatch):
    monkeypatch.setattr(recordings, "experiment", os.getpid)
    with recordings.experiment_in_background() as process:
        assert (process() == os.getpid()) == (cpu_count() < 2)


def test_the_machine_has_the_eps_eff_of_all_figures():
    assert abs(all_series()[0].transfer) == pytest.approx(0.48, rel=1e-9)


def test_the_measured_amplitude_of_the_load_is_the_commanded_one(experiment):
    for rows in experiment.values():
        np.testing.assert_allclose(rows["epsilon"], rows["epsilon_set"], rtol=1e-3)


def test_error_bars_contain_the_orbits(experiment, simulated):
    """The orbits are solved without a recording; error bars are small compared with the values."""
    points = pd.concat([figure.numbers.points for figure in simulated.values()])
    points = points[points["epsilon_set"] > 0].drop_duplicates(["series", "epsilon_set"])
    assert len(points) == sum(map(len, experiment.values()))
    for name in QUANTITIES:
        error = np.abs(points[name] - points[f"{name}_model"])
        hits = error < NORMAL * points[f"{name}_uncertainty"]
        # At least 95 %, less what chance explains with a probability of 1e-3.
        assert hits.sum() >= binom.ppf(1e-3, len(hits), 0.95), name
    for rows in experiment.values():
        strongest = rows.iloc[-1]
        # In vacuum the force recovers from the strongest modulation for longer than the pause:
        # F(0) is measured before it, and the drift since then counts as uncertainty.
        for name, share in (("mean_friction", 0.01), ("delta_mu", 0.1), ("mu1", 0.02)):
            assert strongest[f"{name}_uncertainty"] < share * abs(strongest[name]), name


def test_stated_uncertainties_follow_from_the_noise_of_the_gauge(experiment):
    """The noise of the gauge alone gives an amplitude sqrt(2/N) of its filtered rms."""
    rows = experiment[FAST]
    samples = rows["window"] * 120 * 35 / 6
    # A first-order spectrum of 1 kHz is white up to the low-pass of the recorder at 300 Hz.
    spectral = 2 * 10e-9**2 / (np.pi * 1000)  # m^2/Hz one-sided, at frequencies far below 1 kHz
    expected = PMMA.K / PMMA.W0 * np.sqrt(spectral / rows["window"])
    assert (samples > 300).all()
    stated = rows["mu1_stated"] / expected
    assert (stated > 0.7).all()
    assert (stated < 1.6).all()


def test_points_and_captions_say_that_they_are_simulated(simulated):
    for figure in simulated.values():
        assert list(figure.numbers.points.columns) == list(WORDS.point_column)
        words = WORDS.figures[figure.numbers.name]
        assert "SIMULATED" in words.caption
        assert "SIMULATED" in words.plot.panel[0].title
        assert words.alt.startswith("Simulated")
        assert figure.numbers.failed == 0
        uncertainty = figure.numbers.points[["mean_friction_stated", "mean_friction_scatter"]].max(
            axis=1
        )
        np.testing.assert_array_equal(
            figure.numbers.points["mean_friction_uncertainty"], uncertainty
        )


def test_the_model_of_a_point_is_the_orbit_at_its_operating_point(simulated):
    for figure in simulated.values():
        for _, row in figure.numbers.points.iterrows():
            if row["epsilon_set"] == 0:
                assert row["mean_friction_model"] == pytest.approx(
                    0.5 - (B - 0.013) * np.log(row["V"] / 1e-6), rel=1e-12
                )
    points = simulated["virtual-05"].numbers.points
    row = points[points["series"] == "1 mbar"].iloc[-1]
    orbit = asp.periodic_response(
        SLIDER, velocity=1e-5, epsilon=0.5 * borne(200.0, vacuum=True), frequency=200.0
    )
    for name in ("delta_mu", "mu1", "mu2"):
        assert row[f"{name}_model"] == pytest.approx(float(getattr(orbit, name)), rel=1e-7)


def test_a_point_without_a_model_is_an_error(simulated):
    figure = simulated["virtual-02"]
    points = figure.numbers.points.assign(V=2e-6)
    with pytest.raises(KeyError, match="no operating point at 2e-06 m/s"):
        with_model(points, figure.numbers.data)


def test_the_quantities_of_the_machine_are_recovered(simulated):
    recovered = [quantity for figure in simulated.values() for quantity in figure.recovered]
    assert len(recovered) == 13
    # Of thirteen 95 % intervals two may miss, but none by four standard uncertainties.
    assert sum(not quantity.agrees for quantity in recovered) <= 2
    assert all(abs(f.value - f.true_value) < 4 * f.uncertainty for f in recovered)


def test_the_simulated_points_agree_with_the_statements_of_the_paper(simulated):
    recovered = {quantity.what: quantity.value for quantity in simulated["virtual-02"].recovered}
    assert recovered[f"Share of the mean that ε = 0.5 takes, {SLOW}"] == pytest.approx(
        0.2, abs=0.01
    )
    slopes = simulated["virtual-03"].numbers.scalars
    assert slopes["slope_0"] == pytest.approx(0.013 - B, rel=0.02)
    points = simulated["virtual-04"].numbers.points
    last = points.groupby("series").last()
    first, second = last.loc[[SLOW, FAST], "mu1"], last.loc[[SLOW, FAST], "mu2"]
    assert second[SLOW] < second[FAST]
    assert all(0.1 < b / a < 0.2 for a, b in zip(first, second, strict=True))


def test_the_factor_between_air_and_vacuum_is_recovered(simulated):
    (quantity,) = simulated["virtual-05"].recovered
    assert quantity.true_value == pytest.approx(borne(200.0) / borne(200.0, vacuum=True), rel=1e-9)
    assert quantity.uncertainty < 0.01 * quantity.value
    assert abs(quantity.value - quantity.true_value) < 3 * quantity.uncertainty


def drops(factor, epsilons):
    """Points of a smooth curve at eps_eff of `factor` times epsilon."""
    u = factor * np.array(epsilons)
    drop = -0.07 * (np.sqrt(1 + (14 * u) ** 2) - 1) - 0.05 * u**2
    return pd.DataFrame(
        {"epsilon": epsilons, "delta_mu": drop, "delta_mu_uncertainty": 1e-4 + 0 * u}
    )


def test_collapse_finds_a_known_factor():
    vacuum, air = drops(1.0, [0.05, 0.1, 0.2, 0.35, 0.5]), drops(0.37, [0.1, 0.2, 0.35, 0.5])
    factor, sigma = collapse(vacuum, air)
    assert factor == pytest.approx(0.37, rel=1e-6)
    assert 0 < sigma < 0.01


def test_a_wrong_factor_does_not_agree(simulated):
    """The full disc of the appendix would give 0.20 instead of 0.40."""
    (quantity,) = simulated["virtual-05"].recovered
    assert not RecoveredQuantity("", quantity.value, quantity.uncertainty, 0.20, "").agrees


def test_a_quotient_has_its_propagated_uncertainty():
    value, sigma, model = Read(-2.0, 0.02, -2.1) / Read(4.0, 0.04, 4.2)
    assert (value, model) == (-0.5, -0.5)
    assert sigma == pytest.approx(0.5 * np.hypot(0.01, 0.01), rel=1e-12)


def test_a_difference_has_its_propagated_uncertainty():
    difference = -(Read(2.0, 0.03, 2.5) - Read(1.0, 0.04, 1.0)) / 2
    assert difference == pytest.approx((-0.5, 0.025, -0.75), rel=1e-12)
