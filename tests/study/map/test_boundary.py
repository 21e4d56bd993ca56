"""Tracing on planes whose boundary is a formula, and pictures of maps."""

import re

import numpy as np
import pytest
import xarray
from matplotlib.contour import ContourSet

from asperity.figures.map import KIND_LINES, axis_unit, draw_map, keys, label
from asperity.figures.style import style
from asperity.operating_point import known_parameters
from asperity.parameters import OUTPUTS
from asperity.study.map import SHOWN
from asperity.study.map.boundary import trace_boundary
from asperity.study.map.dataset import critical_line


def traced(plane):
    boundary = trace_boundary(plane, plane.solve(plane.nodes()))
    lines = [boundary.where[boundary.line == k] for k in range(boundary.line.max(initial=-1) + 1)]
    return boundary, lines


def circle(x, y):
    return np.hypot(x - 0.5, y - 0.5) - 0.3


@pytest.mark.parametrize("count", [8, 31])
def test_a_closed_boundary_is_met_everywhere_to_1e_4(known, count) -> None:
    boundary, (line,) = traced(known(circle, count))
    assert boundary.unresolved == 0
    assert (boundary.line == 0).all()
    assert line[0].tolist() == line[-1].tolist()
    # Its points, and every point of the chords between them.
    t = np.linspace(0.0, 1.0, 9)[:, None, None]
    chords = (1 - t) * line[:-1] + t * line[1:]
    assert np.abs(circle(*np.moveaxis(line, -1, 0))).max() < 2e-6
    assert np.abs(circle(*np.moveaxis(chords, -1, 0))).max() < 1e-4
    # Shoelace formula: the order along the line is right.
    area = 0.5 * abs(np.sum(line[:-1, 0] * line[1:, 1] - line[1:, 0] * line[:-1, 1]))
    assert area == pytest.approx(np.pi * 0.3**2, rel=1e-3)


def test_an_open_boundary_runs_from_side_to_side(known) -> None:
    _, (line,) = traced(known(lambda x, y: y - 0.2 - 0.5 * x**2, 12))
    assert sorted(line[[0, -1], 0].tolist()) == [0.0, 1.0]
    step = np.diff(line[:, 0])
    assert (step > 0).all() or (step < 0).all()


def test_a_kink_where_another_mode_takes_the_lead(known) -> None:
    def g(x, y):
        return np.maximum(x - 0.613, y - 0.417)

    _, (line,) = traced(known(g, 10))
    x, y = line.T
    on_either = np.minimum(np.abs(x - 0.613), np.abs(y - 0.417))
    assert on_either.max() < 2e-6
    assert (x < 0.6130021).all()
    assert (y < 0.4170021).all()


def test_a_saddle_is_decided_by_its_middle(known) -> None:
    # Near the centre of the only cell: the corners (0, 0) and (1, 1) are connected, or not.
    def ridge(sign):
        return lambda x, y: sign * ((x - 0.5) * (y - 0.5) + 0.02)

    for sign in (1, -1):
        _, lines = traced(known(ridge(sign), 2))
        assert len(lines) == 2
        sides = [
            {tuple(np.sign(end - 0.5).astype(int)) for end in np.round(line[[0, -1]], 9)}
            for line in lines
        ]
        # (x - 1/2)(y - 1/2) = -0.02 has its branches in the quadrants x < 1/2 < y and y < 1/2 < x.
        assert sorted(sorted(s) for s in sides) == [[(-1, 1)], [(1, -1)]]


def test_a_boundary_too_sharp_for_the_grid_is_told(known) -> None:
    # A spike of half width 0.008 to 0.016 and of the height 0.2, in cells of 0.1.
    boundary, _ = traced(
        known(lambda x, y: y - 0.33 - 0.4 * np.exp(-(((x - 0.5) / 0.01) ** 2)), 11)
    )
    assert boundary.unresolved > 0


def test_points_without_response_end_the_boundary(known) -> None:
    plane = known(circle, 21, failed=lambda x, y: x > 0.6)
    boundary, lines = traced(plane)
    points = boundary.where[boundary.line >= 0]
    assert points[:, 0].max() <= 0.6 + 1e-9
    assert len(lines) == 1
    assert lines[0][0].tolist() != lines[0][-1].tolist()


def test_a_failure_within_an_edge_keeps_its_reason(known) -> None:
    # Nodes at multiples of 0.1 are solved, what lies around y = 0.55 between them is not.
    plane = known(lambda x, y: y - 0.55, 11, failed=lambda x, y: np.abs(y - 0.55) < 0.04)
    boundary, lines = traced(plane)
    assert lines == []
    assert (boundary.line == -1).all()
    assert len(boundary.line) == 11
    assert all("are invalid" in reason for reason in boundary.reason)


def test_a_jump_is_no_crossing(known) -> None:
    plane = known(lambda x, y: np.where(x > 0.437, 1.0, -0.5), 9)
    boundary, lines = traced(plane)
    assert lines == []
    assert all("jumps" in reason for reason in boundary.reason)
    np.testing.assert_allclose(boundary.where[:, 0], 0.437, atol=2e-6)


def test_nothing_to_trace(known) -> None:
    boundary, lines = traced(known(lambda x, y: x + 1.0, 5))
    assert lines == []
    assert boundary.where.shape == (0, 2)


def planted(law="rice-ruina", **changes) -> xarray.Dataset:
    """A map of 3 x 4 points with a boundary of two kinds, in the form that `response_map` gives."""
    eps, K = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1e5, 2e5, 3e5])
    values = (K[:, None] / 1e5 - 2.2) * (1 + eps)
    dims, units = ("K", "epsilon"), {"units": "1", "long_name": "x"}
    data = dict.fromkeys(SHOWN, (dims, values, units))
    data |= {"stable": (dims, values < 0, units), "converged": (dims, values < 9, units)}
    data["reverses"] = (dims, values > 9, units)
    kinds = np.array(["Neimark-Sacker", "Neimark-Sacker", "period doubling", "period doubling"])
    data |= {
        "boundary_line": ("boundary_point", [0, 0, 0, 0], units),
        "boundary_kind": ("boundary_point", kinds, units),
        "boundary_epsilon": ("boundary_point", eps, units),
        "boundary_K": ("boundary_point", np.full(4, 2.2e5), units),
    }
    data |= changes
    attrs = {"law": law, "x": "epsilon", "y": "K", "x_scale": "linear", "y_scale": "log"}
    coords = {
        "epsilon": ("epsilon", eps, units),
        "K": ("K", K, {"units": "N/m", "long_name": "stiffness of the pulling spring"}),
    }
    # K_c = (B - A) W0/D0 = 2.5e5 N/m.
    point = {"mu0": 0.5, "A": 0.01, "B": 0.02, "D0": 4e-7, "W0": 10.0, "V": 1e-6, "M": 0.0}
    point |= {"frequency": 120.0, "inertia": 0.0, "eta": 0.0}
    return xarray.Dataset(data, coords | point, attrs)


def lines_of(figure) -> list[tuple[str, list[float]]]:
    axis = figure.axes[0]
    return [(line.get_linestyle(), line.get_ydata().tolist()) for line in axis.get_lines()]


def test_the_boundary_is_drawn_by_kind_without_a_gap() -> None:
    with style():
        figure = draw_map(planted())
    styles = [k for k, y in lines_of(figure) if np.allclose(y, 220.0)]
    assert styles == ["-", "--"]
    first, second = (line for line in figure.axes[0].get_lines()[:2])
    assert first.get_xdata()[-1] == second.get_xdata()[0]
    assert {line.get_label() for line in keys(planted())} == {
        "Neimark–Sacker",
        "period doubling",
        "$K=K_c$ (unmodulated)",
    }
    assert set(KIND_LINES) == {"Neimark-Sacker", "period doubling", "fold"}


def test_the_unmodulated_limit_is_drawn_only_where_it_is_known() -> None:
    with style():
        with_it, without = draw_map(planted()), draw_map(planted("nagata"))
    assert any(np.allclose(y, 250.0) for _, y in lines_of(with_it))
    assert not any(np.allclose(y, 250.0) for _, y in lines_of(without))


def test_the_unmodulated_limit_is_not_drawn_by_chords_between_the_points_of_the_grid() -> None:
    """K_c = (B - A) W0/D0 over D0, of which the grid has three values."""
    ends, units = np.array([1e-7, 5e-7, 1e-6]), {"units": "m", "long_name": "memory length"}
    dataset = planted().drop_vars("D0").isel(epsilon=slice(3)).rename(epsilon="D0")
    dataset = dataset.assign_coords(D0=("D0", ends, units)).assign_attrs(x="D0")
    length, Kc = critical_line(dataset)
    np.testing.assert_allclose(Kc, 0.1 / length, rtol=1e-12)
    middle = (length[1:] + length[:-1]) / 2
    np.testing.assert_allclose((Kc[1:] + Kc[:-1]) / 2, 0.1 / middle, rtol=1e-4)


def test_points_at_which_slip_would_reverse_are_hatched_and_named() -> None:
    reverses = np.zeros((3, 4), bool)
    reverses[1:, 2:] = True
    units = {"units": "1", "long_name": "x"}
    dataset = planted(reverses=(("K", "epsilon"), reverses, units))
    with style():
        plain, marked = (draw_map(d) for d in (planted(), dataset))
    hatched = [
        [c.hatches for c in figure.axes[0].collections if isinstance(c, ContourSet)]
        for figure in (plain, marked)
    ]
    assert hatched == [[], [["..."]]]
    assert [entry.get_label() for entry in keys(dataset)][-1] == "slip would reverse"


def test_points_without_response_are_hatched_and_named() -> None:
    converged = np.ones((3, 4), bool)
    converged[0, 0] = False
    units = {"units": "1", "long_name": "x"}
    dataset = planted(converged=(("K", "epsilon"), converged, units))
    assert "no response" in [entry.get_label() for entry in keys(dataset)]
    assert "no response" not in [entry.get_label() for entry in keys(planted())]
    result = np.where(converged, "converged", "the branch folds back")
    with style():
        whole, gap = (
            draw_map(d)
            for d in (planted(), dataset.assign(result=(dataset.converged.dims, result)))
        )
    assert whole.get_suptitle() == ""
    assert gap.get_suptitle() == "1 of 12 points have no value: the branch folds back"


@pytest.mark.parametrize("show", ["phase1", "growth_rate", "delta_mu", "mu1"])
def test_a_quantity_of_each_kind_of_colours_can_be_drawn(show, tmp_path) -> None:
    with style():
        draw_map(planted(), show).savefig(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_a_point_without_modulation_is_drawn_on_a_logarithmic_scale(tmp_path) -> None:
    values = np.geomspace(1e-6, 1e-2, 12).reshape(3, 4)
    values[0, 0] = 0.0
    dataset = planted(mu2=(("K", "epsilon"), values, {"units": "1", "long_name": "x"}))
    with style():
        figure = draw_map(dataset, "mu2")
        figure.savefig(tmp_path / "map.png")
    colours = figure.axes[0].collections[0].norm
    assert colours.vmin == values[0, 1]
    assert not np.ma.is_masked(colours(values))


def test_axes_are_labelled_in_readable_units() -> None:
    assert axis_unit(planted()["K"]) == (1e3, "N/mm")
    with style():
        figure = draw_map(planted())
    assert figure.axes[0].get_ylabel() == "stiffness of the pulling spring $K$ (N/mm)"
    assert figure.axes[0].get_ylim() == (100.0, 300.0)


def test_every_number_of_a_map_is_labelled_with_its_symbol_and_unit() -> None:
    shown = {name: OUTPUTS[name] for name in SHOWN}
    for name, quantity in (known_parameters() | shown).items():
        if quantity.symbol:
            text = label(
                xarray.DataArray([1.0], name=name, attrs=quantity.attributes), (1.0, "unit")
            )
            assert re.sub(r"\\[lr]vert ?", "|", quantity.symbol) in text.split("$")[-2]
    rate = xarray.DataArray([1.0], name="growth_rate", attrs=OUTPUTS["growth_rate"].attributes)
    expected = r"growth rate of the leading mode $f\,\max\ln|m|$ (1/s)"
    assert label(rate, (1.0, "1/s")) == expected
    angle = xarray.DataArray([1.0], name="tilt", attrs=known_parameters()["tilt"].attributes)
    assert label(angle, axis_unit(angle)).endswith(r"$\chi$ (rad)")
