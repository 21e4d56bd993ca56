"""The computed curves have the properties that the paper states of its figures."""

import numpy as np
import pytest

from asperity.figures.style import style
from asperity.ledger import FigureNumbers
from asperity_papers.bureau2000.curves import WORDS, late_over_early_slope, variations
from asperity_papers.bureau2000.machine import Machine

pytestmark = pytest.mark.slow

SLOW, FAST = "1 um/s", "10 um/s"


def draw(numbers):
    return WORDS.figures[numbers.name].draw(numbers)


def test_every_point_is_solved(figures):
    assert {name: figure.failed for name, figure in figures.items() if figure.failed} == {}


def test_every_figure_with_curves_is_computed_and_described(figures):
    numbers = (2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14, 15, 16)
    assert sorted(figures) == [f"figure-{n:02}" for n in numbers]
    for figure in figures.values():
        words = WORDS.figure(figure, {})
        assert words.caption
        assert words.alt
        with style():
            drawn = words.draw()
            drawn.set_layout_engine("none")
            drawn.draw_without_rendering()
    for figure in over_amplitude(figures):
        assert not figure.data[["V", "epsilon_eff", "mean_friction", "mu1"]].isna().any().any()


def over_amplitude(figures):
    """Figures whose curves begin at an amplitude of zero."""
    return [f for name, f in figures.items() if name not in ("figure-13", "figure-15")]


def test_curves_start_from_steady_sliding(figures):
    for figure in over_amplitude(figures):
        name = figure.name
        unmodulated = figure.data[figure.data["epsilon_eff"] == 0]
        assert len(unmodulated) >= 1, name
        assert (unmodulated[["delta_mu", "mu1", "mu2"]] == 0).all().all()


def test_curves_are_continuous_at_an_amplitude_of_zero(figures):
    """The closed form at eps = 0 agrees with an extrapolation of solved points, even in eps."""
    for figure in over_amplitude(figures):
        for curve in figure.data["curve"].unique():
            rows = figure.curve(curve)
            if rows["epsilon_eff"].nunique() < 3:
                continue
            e, m = rows["epsilon_eff"].to_numpy()[:3], np.log(rows["floquet_max"].to_numpy()[:3])
            even = (m[1] * e[2] ** 2 - m[2] * e[1] ** 2) / (e[2] ** 2 - e[1] ** 2)
            assert even == pytest.approx(m[0], abs=0.02 * abs(m[0])), curve


def test_all_figures_at_120_hz_have_the_fitted_eps_eff(figures):
    for name in ("figure-02", "figure-03", "figure-04"):
        rows = figures[name].data
        rows = rows[rows["curve"] != "air layer"]
        np.testing.assert_allclose(rows["epsilon_eff"], 0.48 * rows["epsilon_applied"], atol=1e-15)


def test_the_drop_is_as_stated_and_hardly_depends_on_velocity(figures):
    scalars = figures["figure-02"].scalars
    assert scalars["relative_drop_slow"] == pytest.approx(0.2, abs=0.01)
    assert scalars["relative_drop_fast"] == pytest.approx(scalars["relative_drop_slow"], rel=0.02)
    assert scalars["drop_fast"] == pytest.approx(scalars["drop_slow"], rel=0.1)


def test_the_drop_is_nearly_linear_with_a_positive_intercept(figures):
    scalars = figures["figure-02"].scalars
    assert scalars["departure_from_line"] < 0.06 * abs(scalars["drop_slow"])
    assert scalars["intercept"] > 2 * scalars["departure_from_line"]


def test_the_mean_decreases_with_velocity_at_every_amplitude(figures):
    figure = figures["figure-03"]
    assert figure.scalars["slope_0"] == pytest.approx(-0.013, rel=1e-12)
    for curve in figure.data["curve"].unique():
        assert (np.diff(figure.curve(curve)["mean_friction"]) < 0).all()
    assert -0.013 < figure.scalars["slope_0.5"] < -0.009


def test_harmonics_of_figure_4_are_in_the_stated_ranges(figures):
    scalars = figures["figure-04"].scalars
    assert 10**-3.5 < scalars["mu1_slow"] < 10**-2.5
    assert scalars["mu1_fast"] == pytest.approx(scalars["mu1_slow"], rel=0.02)
    assert 0.1 < scalars["ratio_slow"] < scalars["ratio_fast"] < 0.2


def test_drops_in_air_and_vacuum_of_figure_5_collapse(figures):
    figure = figures["figure-05"]
    # By the appendix 1/|1 - (200/530)^2| = 1.17 in vacuum, and 0.23 with air under the full disc.
    vacuum = 1 / (1 - (2 * np.pi * 200) ** 2 * 1.6 * 0.4e-6 / 7)
    assert figure.scalars["transmission_vacuum"] == pytest.approx(vacuum, rel=1e-12)
    assert figure.scalars["transmission_air"] == pytest.approx(0.23, abs=0.005)
    last = figure.data.groupby("curve")["epsilon_eff"].last()
    assert last["1 mbar"] == pytest.approx(0.5 * vacuum, rel=1e-12)
    assert last["1 atm"] == pytest.approx(0.4 * 0.5 * vacuum, rel=1e-12)
    assert (figure.data["frequency"] == 200).all()
    assert figure.last("1 mbar", "delta_mu") < figure.last("1 atm", "delta_mu") < 0
    # 2 f is at the resonance of the slider on its asperities.
    assert figure.last("1 atm, inertia", "delta_mu") < 2 * figure.last("1 atm", "delta_mu")
    air, vacuum = figure.curve("1 atm"), figure.curve("1 mbar")
    collapsed = np.interp(
        air["epsilon_applied"] / 2.5, vacuum["epsilon_applied"], vacuum["delta_mu"]
    )
    # The difference is the error of interpolation between 101 points.
    np.testing.assert_allclose(collapsed, air["delta_mu"], atol=5e-5)


def test_rice_ruina_overestimates_the_drop_until_rescaled(figures):
    assert figures["figure-06"].scalars["relative_drop_slow"] > 0.4
    scalars = figures["figure-07"].scalars
    assert scalars["drop_at_scaled"] == pytest.approx(-0.1, rel=0.03)
    assert scalars["share_needed"] == pytest.approx(0.48, abs=0.01)


def test_rice_ruina_harmonics_are_proportional_to_velocity_and_saturate(figures):
    figure, p = figures["figure-08"], Machine().numbers
    # The force of the spring rises by V K/omega per radian. With slip in one short pulse a period
    # it is a sawtooth, whose n-th harmonic is 2 V K/(n omega W0).
    limit = {V: 2 * V * p.K / (2 * np.pi * p.frequency * p.W0) for V in (1e-6, 1e-5)}
    assert figure.scalars["growth_mu1"] == pytest.approx(10, rel=0.005)
    assert figure.scalars["growth_mu2"] == pytest.approx(10, rel=0.02)
    for curve, V in ((SLOW, 1e-6), (FAST, 1e-5)):
        assert late_over_early_slope(figure, curve, "mu1") < 0.1
        assert late_over_early_slope(figure, curve, "mu2") < 0.3
        assert 0.95 * limit[V] < figure.last(curve, "mu1") < limit[V]
        assert figure.last(curve, "mu2") < limit[V] / 2


def test_curves_on_common_axes_are_those_of_the_figures_of_each_law(figures):
    figure = figures["figure-16"]
    read = figure.scalars
    for curve, name, column in (
        ("RR", "figure-08", "mu1"),
        ("LD", "figure-09", "mu2"),
        ("EXT", "figure-11", "delta_mu"),
    ):
        for speed in (SLOW, FAST):
            label = f"alpha = 0.2, {speed}" if curve == "LD" else speed
            np.testing.assert_allclose(
                figure.curve(f"{curve}, {speed}")[column],
                figures[name].curve(label)[column],
                rtol=1e-8,
            )
    # Harmonics are proportional to V with rigid asperities, and not with elastic ones.
    assert read["growth_mu1 RR"] == pytest.approx(10, rel=0.01)
    assert read["growth_mu1 LD"] == pytest.approx(10, rel=0.02)
    assert read["growth_mu1 EXT"] == pytest.approx(1, abs=0.05)
    assert read["relative_drop LD"] < 0.6 * read["relative_drop EXT"]


def test_linker_dieterich_harmonics_and_drop_are_too_small(figures):
    scalars = figures["figure-09"].scalars
    assert scalars["share_of_drop"] < 0.5
    assert abs(scalars["low_alpha_delta_mu"]) < 0.05
    assert abs(scalars["low_alpha_mu1"]) < 0.005
    assert abs(scalars["low_alpha_mu2"]) < 0.01
    # The caption of Fig. 9 does not hold for panel (a).
    assert scalars["low_over_high"] > 1.9


def test_elasto_plastic_hardly_depends_on_velocity_and_does_not_saturate(figures):
    figure = figures["figure-11"]
    assert figure.scalars["growth_mu1"] == pytest.approx(1, abs=0.02)
    assert figure.scalars["growth_mu2"] < 2
    for curve in (SLOW, FAST):
        assert late_over_early_slope(figure, curve, "mu1") > 0.6
        assert late_over_early_slope(figure, curve, "mu2") > 0.8
    assert figure.curve(f"{SLOW}, lambda low")["lambda"].iloc[0] == pytest.approx(0.47e-6)
    assert figure.curve(f"{SLOW}, lambda high")["lambda"].iloc[0] == pytest.approx(0.77e-6)


def test_the_drop_at_the_ends_of_A_agrees_with_shooting(figures):
    """A = 0.008 to 0.018 at fixed B - A: 21.2 to 19.0 %, by an independent shooting method."""
    scalars = figures["figure-02"].scalars
    assert -200 * scalars["drop A low"] == pytest.approx(21.2, abs=0.05)
    assert -200 * scalars["drop A high"] == pytest.approx(19.0, abs=0.05)


def test_bands_consist_of_the_curves_at_the_ends_of_the_uncertainties():
    ends = variations(Machine())
    for name, groups in {
        "figure-02": [("A", "B", "lambda")],
        "figure-04": [("A", "B", "lambda")],
        "figure-11": [("lambda",), ("A", "B")],
    }.items():
        bands = [set(item.curves) for item in WORDS.figures[name].plot.draw if item.kind == "band"]
        for band, group in zip(bands, groups, strict=True):
            assert band == {SLOW, *(f"{SLOW}, {end}" for end in ends if end.split()[0] in group)}


def test_a_band_is_drawn_from_the_lowest_to_the_highest_curve(figures):
    with style():
        figure = draw(figures["figure-11"])
    lengths, _ = figure.axes[1].collections
    highest = figures["figure-11"].curve(f"{SLOW}, lambda high")
    low, high = lengths.get_datalim(figure.axes[1].transData).intervaly
    assert (low, high) == (0, pytest.approx(1e3 * highest["mu1"].max(), rel=1e-12))


# At 10 um/s and eps_eff = 0.24, in percent, by shooting with SciPy on the equations with the mass.
@pytest.mark.parametrize(
    ("length", "drop", "mu2"), [(0.47, 1, -11), (0.62, 13, 51), (0.7, 16, 54), (0.77, 7, 17)]
)
def test_the_effect_of_inertia_at_each_lambda_agrees_with_shooting(figures, length, drop, mu2):
    scalars = figures["figure-15"].scalars
    assert 100 * scalars[f"change of delta_mu at lambda {length:g} um"] == pytest.approx(
        drop, abs=0.6
    )
    assert 100 * scalars[f"change of mu2 at lambda {length:g} um"] == pytest.approx(mu2, abs=0.8)


def test_the_effect_of_inertia_at_200_hz_agrees_with_shooting(figures):
    """By the same integration the drop rises from 19.8 to 43.8 % and mu2 13-fold."""
    scalars = figures["figure-15"].scalars
    assert scalars["relative_drop_200Hz"] == pytest.approx(0.198, abs=5e-4)
    assert scalars["relative_drop_200Hz_inertia"] == pytest.approx(0.438, abs=5e-4)
    assert scalars["mu2_ratio_200Hz"] == pytest.approx(13, abs=0.5)


def test_damping_lowers_the_peak_of_the_resonance(figures):
    figure = figures["figure-15"]
    sharp, damped = (figure.curve(f"frequency, {name}") for name in ("inertia", "inertia, damped"))
    assert damped["mu1"].max() < 0.8 * sharp["mu1"].max()
    M, W0, length = 1.6, 7.0, 0.7e-6
    assert damped["damping"].iloc[0] == pytest.approx(np.sqrt(M * W0 / length) / 10, rel=1e-12)
    assert figure.scalars["contact_resonance"] == pytest.approx(
        np.sqrt(W0 / length / M) / (2 * np.pi), rel=1e-12
    )


def test_velocities_over_one_period_have_their_range_and_mean(figures):
    figure = figures["figure-13"]
    assert figure.scalars["velocity_min"] == pytest.approx(-55, abs=1)
    assert figure.scalars["velocity_max"] == pytest.approx(56, abs=1)
    assert figure.scalars["plastic_age_smaller_by"] == pytest.approx(0.035, abs=5e-4)
    for name in figure.data["curve"].unique():
        rows = figure.curve(name)
        # Over a period the slider and its contacts move as far as the drive.
        assert rows["velocity"].mean() == pytest.approx(1, rel=1e-9)
        assert rows["plastic_velocity"].mean() == pytest.approx(1, rel=1e-6)


def test_the_age_over_a_period_obeys_its_law(figures):
    """dPhi/dt = 1 - v Phi/D0 with the velocity of each variant, by Fourier differentiation."""
    figure = figures["figure-13"]
    for name, column in (
        ("age on the slider's velocity", "velocity"),
        ("age on the plastic velocity", "plastic_velocity"),
        ("with inertia", "velocity"),
    ):
        rows = figure.curve(name)
        age, v = rows["age"].to_numpy(), rows[column].to_numpy()
        orders = 2j * np.pi * np.fft.rfftfreq(len(age), 1 / len(age))
        rate = np.fft.irfft(orders * np.fft.rfft(age), len(age))
        expected = 1e-6 / (4e-7 * 120) * (1 - v * age)
        # Waveforms are sampled from some 50 collocation points.
        np.testing.assert_allclose(rate, expected, atol=1e-3 * np.abs(expected).max())


def test_phases_of_a_small_modulation_are_as_stated(figures):
    """Rice-Ruina slip lags the load by a quarter of a period; elastic asperities follow it."""
    scalars = figures["figure-14"].scalars
    assert scalars["phase1 RR, 1 um/s"] == pytest.approx(-90, abs=1)
    assert abs(scalars["phase1 EXT, 1 um/s"]) < 5


def test_elasto_plastic_mean_is_that_of_rice_ruina(figures):
    elastic, rigid = figures["figure-02"].scalars["drop_slow"], figures["figure-07"].scalars
    assert elastic == pytest.approx(rigid["drop_at_scaled"], rel=0.02)


def test_the_stated_ranges_are_those_of_the_text():
    stated = Machine().stated()
    assert Machine().strongest == pytest.approx(0.24)
    # 20 % of 0.5 at V0 = 1 um/s, and of 0.5 - 0.013 ln 10 at 10 um/s.
    assert stated["drop"] == pytest.approx((-0.1, -0.2 * (0.5 - 0.013 * np.log(10))))
    assert stated["mu1"][0] < 1e-3 < stated["mu1"][1]
    assert stated["ratio"] == (0.1, 0.2)
    assert stated["mu2"] == pytest.approx((10**-4.5, 2 * 10**-3.5))


def test_a_point_that_fails_is_counted(figures):
    data = figures["figure-07"].data.copy()
    data.loc[3, "converged"] = False
    assert FigureNumbers("x", data).failed == 1
