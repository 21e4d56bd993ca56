"""The numbers behind the figures have the properties that the paper states of them."""

import numpy as np
import pytest

from asperity.study import paper as study
from asperity.study.paper.harmonics import late_over_early_slope, pulse_limit

SLOW, FAST = "1 um/s", "10 um/s"


@pytest.fixture(scope="module")
def figures():
    return {figure.name: figure for figure in (compute() for compute in study.FIGURES)}


def end(figure, curve, column):
    return figure.curve(curve)[column].iloc[-1]


def test_every_point_is_solved(figures):
    assert {name: figure.failed for name, figure in figures.items() if figure.failed} == {}


def test_every_figure_with_curves_is_there(figures):
    assert sorted(figures) == [f"figure-{n:02}" for n in (2, 3, 4, 5, 6, 7, 8, 9, 11, 12)]
    for figure in figures.values():
        assert list(figure.data.columns) == list(study.COLUMNS)
        assert len(figure.caption) > 100
        assert len(figure.alt) > 80
        assert not figure.data[["V", "epsilon_eff", "mean_friction", "mu1"]].isna().any().any()


def test_curves_start_from_steady_sliding(figures):
    for name, figure in figures.items():
        still = figure.data[figure.data["epsilon_eff"] == 0]
        assert len(still) >= 1, name
        assert (still[["delta_mu", "mu1", "mu2"]] == 0).all().all()


def test_steady_sliding_joins_the_smallest_modulation(figures):
    """The closed form at eps = 0 and the solver next to it agree to second order in eps."""
    for figure in figures.values():
        for curve in figure.data["curve"].unique():
            rows = figure.curve(curve)
            if rows["epsilon_eff"].nunique() < 3:
                continue
            e, m = rows["epsilon_eff"].to_numpy()[:3], np.log(rows["floquet_max"].to_numpy()[:3])
            # An even function of eps: the value at 0 from the next two points.
            even = (m[1] * e[2] ** 2 - m[2] * e[1] ** 2) / (e[2] ** 2 - e[1] ** 2)
            assert even == pytest.approx(m[0], abs=0.02 * abs(m[0])), curve


def test_transmission_of_the_measured_figures_is_the_fitted_one(figures):
    for name in ("figure-02", "figure-04"):
        rows = figures[name].curve(SLOW)
        np.testing.assert_allclose(rows["epsilon_applied"], 2.1 * rows["epsilon_eff"], atol=1e-15)


def test_the_drop_is_the_stated_one_and_hardly_depends_on_velocity(figures):
    told = figures["figure-02"].scalars
    assert told["relative_drop_slow"] == pytest.approx(0.2, abs=0.01)
    assert told["relative_drop_fast"] == pytest.approx(told["relative_drop_slow"], rel=0.02)
    assert told["drop_fast"] == pytest.approx(told["drop_slow"], rel=0.1)


def test_the_drop_is_quasi_linear_and_misses_the_origin(figures):
    told = figures["figure-02"].scalars
    assert told["departure_from_line"] < 0.06 * abs(told["drop_slow"])
    assert told["intercept"] > 2 * told["departure_from_line"]


def test_mean_falls_with_velocity_at_every_amplitude(figures):
    figure = figures["figure-03"]
    assert figure.scalars["slope_0"] == pytest.approx(-0.013, rel=1e-12)
    for curve in figure.data["curve"].unique():
        assert (np.diff(figure.curve(curve)["mean_friction"]) < 0).all()
    assert -0.013 < figure.scalars["slope_0.5"] < -0.009


def test_harmonics_of_the_measured_figure(figures):
    told = figures["figure-04"].scalars
    assert 10**-3.5 < told["mu1_slow"] < 10**-2.5
    assert told["mu1_fast"] == pytest.approx(told["mu1_slow"], rel=0.02)
    assert 0.1 < told["ratio_slow"] < told["ratio_fast"] < 0.2


def test_air_in_figure_5(figures):
    figure = figures["figure-05"]
    assert figure.scalars["transmission_vacuum"] == pytest.approx(1.2, abs=0.05)
    assert figure.scalars["transmission_air"] == pytest.approx(0.23, abs=0.005)
    assert (figure.data["frequency"] == 200).all()
    assert end(figure, "1 mbar", "delta_mu") < end(figure, "1 atm", "delta_mu") < 0
    air, vacuum = figure.curve("1 atm"), figure.curve("1 mbar")
    collapsed = np.interp(
        air["epsilon_applied"] / 2.5, vacuum["epsilon_applied"], vacuum["delta_mu"]
    )
    # What is left is the error of interpolating between 101 points.
    np.testing.assert_allclose(collapsed, air["delta_mu"], atol=5e-5)


def test_rice_ruina_overestimates_the_drop_until_rescaled(figures):
    assert figures["figure-06"].scalars["relative_drop_slow"] > 0.4
    told = figures["figure-07"].scalars
    assert told["drop_at_scaled"] == pytest.approx(-0.1, rel=0.03)
    assert told["divisor"] == pytest.approx(2.1, abs=0.05)


def test_rice_ruina_harmonics_are_proportional_to_velocity_and_saturate(figures):
    figure = figures["figure-08"]
    assert figure.scalars["growth_mu1"] == pytest.approx(10, rel=0.005)
    assert figure.scalars["growth_mu2"] == pytest.approx(10, rel=0.02)
    for curve, V in ((SLOW, 1e-6), (FAST, 1e-5)):
        assert late_over_early_slope(figure, curve, "mu1") < 0.1
        assert late_over_early_slope(figure, curve, "mu2") < 0.3
        assert 0.95 * pulse_limit(V) < end(figure, curve, "mu1") < pulse_limit(V)
        assert end(figure, curve, "mu2") < pulse_limit(V) / 2


def test_linker_dieterich(figures):
    told = figures["figure-09"].scalars
    assert told["share_of_drop"] < 0.5
    assert abs(told["low_alpha_delta_mu"]) < 0.05
    assert abs(told["low_alpha_mu1"]) < 0.005
    assert abs(told["low_alpha_mu2"]) < 0.01
    # The caption of Fig. 9 does not hold for panel (a).
    assert told["low_over_high"] > 1.9


def test_elasto_plastic_hardly_depends_on_velocity_and_does_not_saturate(figures):
    figure = figures["figure-11"]
    assert figure.scalars["growth_mu1"] == pytest.approx(1, abs=0.02)
    assert figure.scalars["growth_mu2"] < 2
    for curve in (SLOW, FAST):
        assert late_over_early_slope(figure, curve, "mu1") > 0.6
        assert late_over_early_slope(figure, curve, "mu2") > 0.8
    assert figure.curve("lambda low")["lambda"].iloc[0] == pytest.approx(0.47e-6)
    assert figure.curve("lambda high")["lambda"].iloc[0] == pytest.approx(0.77e-6)


def test_elasto_plastic_mean_is_that_of_rice_ruina(figures):
    elastic, rigid = figures["figure-02"].scalars["drop_slow"], figures["figure-07"].scalars
    assert elastic == pytest.approx(rigid["drop_at_scaled"], rel=0.02)


def test_what_the_text_states():
    seen = study.stated()
    assert seen.epsilon_eff == pytest.approx(0.5 / 2.1)
    assert seen.drop[0] == pytest.approx(-0.1)
    assert seen.mu1[0] < 1e-3 < seen.mu1[1]
    assert seen.ratio == (0.1, 0.2)
    assert (seen.onset, seen.divisor, seen.divisor_vacuum) == (0.05, 2.1, 2.5)


def test_a_point_that_fails_is_counted(figures):
    data = figures["figure-07"].data.copy()
    data.loc[3, "converged"] = False
    assert study.FigureNumbers("x", "Figure 0", "", data).failed == 1
