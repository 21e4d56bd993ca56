"""`.plot()` draws the numbers of the object, and marks failed and unstable points."""

import dataclasses
from io import BytesIO

import matplotlib.image
import numpy as np
import pandas as pd
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.figures.plot import Plot
from asperity.figures.recording import draw_amplitudes
from asperity.figures.slice import _in_si
from asperity.figures.style import reason_of_gaps
from asperity.loads import Hold, Programme, Slide
from asperity.units import KINDS

PMMA = asp.materials.load("bureau2000")
SLIDER = asp.Slider(PMMA.law("rice-ruina"), spring="0.2 N/um", load=PMMA.W0)


def test_curves_are_the_numbers_of_the_response_and_unstable_points_are_open() -> None:
    response = asp.periodic_response(
        SLIDER, velocity=np.array([[1e-6], [1e-5]]), epsilon=[0.01, 0.1, 0.24], frequency=120.0
    )
    assert not response.stable.all()
    mean, mu1, mu2 = response.plot().axes
    for panel, name in ((mean, "mean_friction"), (mu1, "mu1"), (mu2, "mu2")):
        lines = panel.get_lines()
        for i in range(2):
            np.testing.assert_allclose(lines[2 * i].get_ydata(), getattr(response, name)[i])
            np.testing.assert_allclose(
                lines[2 * i + 1].get_xdata(), response.epsilon[~response.stable[i]]
            )


def test_a_reason_with_another_number_is_not_another_reason() -> None:
    folds = ["folds back at epsilon = 0.2", "folds back at epsilon = 2.1e-1"]
    assert reason_of_gaps([True, True], folds).endswith("have no value: " + folds[0])
    assert reason_of_gaps([True] * 3, [*folds, "rests"]).endswith("(and 1 other reason)")
    assert not reason_of_gaps([False], ["rests"])


def test_points_in_any_order_are_drawn_from_left_to_right_and_one_that_failed_is_a_gap() -> None:
    response = asp.periodic_response(
        SLIDER, velocity="1 um/s", epsilon=[0.24, 0.1, 0.9999, 0.01], frequency=120.0
    )
    assert list(response.converged) == [True, True, False, True]
    figure = response.plot()
    curve, unstable = figure.axes[1].get_lines()
    assert curve.get_xdata().tolist() == [0.01, 0.1, 0.24, 0.9999]
    np.testing.assert_array_equal(curve.get_ydata(), response.mu1[[3, 1, 0, 2]])
    assert unstable.get_xdata().tolist() == [0.01, 0.1]
    assert "1 of 4 points have no value: not searched: epsilon" in figure.get_suptitle()
    assert [axis.get_xlabel() for axis in figure.axes] == ["", "", ""]
    assert figure.get_supxlabel().startswith("relative amplitude of the load")


def test_a_single_point_is_a_cycle_of_the_harmonic_sum() -> None:
    response = asp.periodic_response(SLIDER, velocity="1 um/s", epsilon=0.24, frequency=120.0)
    line = response.plot().axes[0].get_lines()[0]
    turns, force = line.get_xdata(), line.get_ydata()
    expected = response.mean_friction + sum(
        abs(c) * np.cos(2 * np.pi * n * turns + np.angle(c))
        for n, c in enumerate(response.harmonics, 1)
    )
    np.testing.assert_allclose(force, expected, rtol=1e-12)
    # Steady sliding has no harmonics, and no logarithms of them.
    steady = dataclasses.replace(response, harmonics=0 * response.harmonics)
    assert steady.plot().axes[1].get_yscale() == "linear"


def test_a_notebook_shows_the_picture_without_pyplot() -> None:
    figure = asp.periodic_response(
        SLIDER, velocity="1 um/s", epsilon=[0.1, 0.2], frequency=120.0
    ).plot()
    picture, size = figure._repr_png_()
    pixels = matplotlib.image.imread(BytesIO(picture), format="png").shape
    assert pixels[:2] == (2 * size["height"], 2 * size["width"])
    assert size["width"] == figure.get_size_inches()[0] * figure.dpi


def test_titles_and_labels_of_figures_have_one_micro_sign() -> None:
    one = asp.periodic_response(SLIDER, velocity="1 um/s", epsilon=0.1, frequency=120.0)
    rows = asp.periodic_response(
        SLIDER, velocity=np.array([1e-6, 1e-5])[:, None], epsilon=[0.1, 0.2], frequency=120.0
    )
    assert "V 1 µm/s" in one.plot().get_suptitle()
    assert "V 1 µm/s" in one.plot("geophysics").get_suptitle()
    legend = rows.plot().axes[0].get_legend().get_texts()
    assert [text.get_text() for text in legend] == ["V 1 µm/s", "V 10 µm/s"]


def test_the_title_of_a_modulation_without_first_harmonic_of_the_load_leaves_epsilon_out() -> None:
    response = asp.periodic_response(SLIDER, velocity="1 um/s", epsilon=0.1, frequency=120.0)
    assert "ε 0.1" in response.plot().get_suptitle()
    pulled = dataclasses.replace(response, load=asp.loads.modulated(pull=0.5))
    assert "ε" not in pulled.plot().get_suptitle()
    assert "epsilon=" in repr(response)
    assert "epsilon=" not in repr(pulled)


def test_a_file_in_place_of_the_set_of_names_is_refused() -> None:
    response = asp.periodic_response(SLIDER, velocity="1 um/s", epsilon=0.1, frequency=120.0)
    with pytest.raises(InputError, match="names must be one of friction, geophysics"):
        response.plot("picture.png")


def test_more_curves_than_can_be_told_apart_are_refused() -> None:
    response = asp.periodic_response(
        SLIDER, velocity=np.geomspace(1e-6, 1e-5, 9)[:, None], epsilon=[0.1, 0.2], frequency=120.0
    )
    with pytest.raises(InputError, match="up to 8 rows, got 9x2 points; draw grids with asperity"):
        response.plot()


def test_a_trajectory_keeps_its_extremes_however_many_rows_it_has() -> None:
    programme = Programme(Slide("1 s"), Hold("1 s"), Slide("1 s"), load="7 N", velocity="10 um/s")
    run = asp.transient(
        asp.Slider(SLIDER.law, spring="0.5 N/um", load=PMMA.W0), programme, sampling="10 kHz"
    )
    assert run.time.size > 10_000
    force = run.plot().axes[1]
    low, high = (line.get_ydata() for line in force.get_lines()[:2])
    assert (low.min(), high.max()) == (run.force.min(), run.force.max())


def test_stick_slip_over_the_velocity_is_drawn_as_its_numbers_and_one_point_as_its_cycle() -> None:
    law = asp.laws.get_law("rice-ruina")(mu0=0.6, A=0.009, B=0.0125, D0="8 um", V0="1 um/s")
    soft = asp.Slider(law, spring="2 N/um", load="10 kN", mass="10 kg")
    cycles = asp.experiment.stick_slip_response(soft, velocity=[1e-5, 1e-4])
    drop, period, fastest = cycles.plot("geophysics").axes
    np.testing.assert_array_equal(drop.lines[0].get_ydata(), cycles.drop)
    np.testing.assert_array_equal(period.lines[0].get_ydata(), cycles.period)
    np.testing.assert_allclose(fastest.lines[0].get_ydata(), 1e3 * cycles.peak_velocity)
    assert r"\tau" in drop.get_ylabel()
    force, _, moved, _ = (
        panel.lines[0]
        for panel in asp.experiment.stick_slip_response(soft, velocity="10 um/s").plot().axes
    )
    assert np.ptp(force.get_ydata()) == pytest.approx(cycles.drop[0], rel=1e-3)
    # Over a period the slider goes as far as the drive.
    advance = 1e-6 * np.ptp(moved.get_ydata())
    assert advance == pytest.approx(1e-5 * cycles.period[0], rel=1e-6)
    stiff = asp.Slider(law, spring="1 kN/um", load="10 kN", mass="10 kg")
    with pytest.raises(InputError, match="must show a cycle, got no stick-slip"):
        asp.experiment.stick_slip_response(stiff, velocity="10 um/s").plot()


def test_amplitudes_are_drawn_over_the_load_with_bars_of_95_percent():
    columns = {"epsilon": 0.1, "mean_friction": 0.5, "mu1": 2e-3, "mu2": 1e-4}
    row = {**columns, **{f"{n}_uncertainty": 0.01 * v for n, v in columns.items()}, "reason": ""}
    rows = [
        {**row, "static_friction": 0.52},
        {**row, "epsilon": 0.2, "mean_friction": 0.4},
        {"reason": "too short"},
    ]
    mean, harmonics = draw_amplitudes(rows).axes
    (friction,) = mean.containers
    assert friction.lines[0].get_xydata().tolist() == [[0.1, 0.5], [0.2, 0.4]]
    ends = friction.lines[2][0].get_segments()[0]
    assert np.ptp(ends[:, 1]) == pytest.approx(2 * 1.96 * 0.005)
    assert mean.lines[-1].get_xydata().tolist() == [[0.0, 0.52]]
    assert [c.get_label() for c in harmonics.containers] == [r"$\mu_1$", r"$\mu_2$"]


def test_a_described_figure_has_arrows_and_texts_at_named_angles() -> None:
    words = {"kind": "text", "x": 1.0, "y": 0.5, "text": "falls by {drop:.1f}"}
    plot = Plot(
        panel=({"x": "t", "y": "f"},),
        draw=(
            {"kind": "arrow", "x": (0.0, "end"), "y": (1.0, 2.0)},
            {"kind": "marker", "x": (0.0, 1.0), "y": (0.0, 1.0), "look": {"linestyle": "solid"}},
            words | {"look": {"rotation": "angle"}},
            words | {"look": {"rotation": "vertical"}},
        ),
    )
    numbers = {"end": 3.0, "angle": -30.0, "drop": 0.25}
    (axis,) = plot.figure(pd.DataFrame(), numbers).axes
    arrow, *texts = axis.texts
    assert (arrow.xyann, arrow.xy) == ((0.0, 1.0), (3.0, 2.0))
    assert [text.get_rotation() for text in texts] == [330.0, 90.0]
    assert texts[0].get_text() == "falls by 0.2"
    assert axis.get_lines()[0].get_linestyle() == "-"


@pytest.mark.parametrize("kind", KINDS)
def test_a_position_on_an_axis_of_any_kind_is_read(kind) -> None:
    assert _in_si(KINDS[kind].example, KINDS[kind].si or "1", "axis") > 0
