"""Pictures of maps: what is drawn, and only where the numbers have it."""

import numpy as np
import pytest
import xarray

from asperity.figures.map import KIND_LINES, axis_unit, draw_map, keys
from asperity.figures.style import style
from asperity.study.map import SHOWN


def planted(**changes) -> xarray.Dataset:
    """A map of 3 x 4 points with a boundary of two kinds, in the form that `response_map` gives."""
    eps, K = np.array([0.1, 0.2, 0.3, 0.4]), np.array([1e5, 2e5, 3e5])
    values = (K[:, None] / 1e5 - 2.2) * (1 + eps)
    dims, units = ("K", "epsilon"), {"units": "1", "long_name": "x"}
    data = dict.fromkeys(SHOWN, (dims, values, units))
    data |= {"stable": (dims, values < 0, units), "converged": (dims, values < 9, units)}
    kinds = np.array(["Neimark-Sacker", "Neimark-Sacker", "period doubling", "period doubling"])
    data |= {
        "boundary_line": ("boundary_point", [0, 0, 0, 0], units),
        "boundary_kind": ("boundary_point", kinds, units),
        "boundary_epsilon": ("boundary_point", eps, units),
        "boundary_K": ("boundary_point", np.full(4, 2.2e5), units),
        "critical_stiffness": ("epsilon", np.full(4, 2.5e5), units),
    }
    data |= changes
    attrs = {"x": "epsilon", "y": "K", "x_scale": "linear", "y_scale": "log"}
    coords = {
        "epsilon": ("epsilon", eps, units),
        "K": ("K", K, {"units": "N/m", "long_name": "stiffness of the pulling spring"}),
    }
    return xarray.Dataset({k: v for k, v in data.items() if v is not None}, coords, attrs)


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
        with_it, without = draw_map(planted()), draw_map(planted(critical_stiffness=None))
    assert any(np.allclose(y, 250.0) for _, y in lines_of(with_it))
    assert not any(np.allclose(y, 250.0) for _, y in lines_of(without))


def test_points_without_response_are_hatched_and_named() -> None:
    converged = np.ones((3, 4), bool)
    converged[0, 0] = False
    units = {"units": "1", "long_name": "x"}
    found = planted(converged=(("K", "epsilon"), converged, units))
    assert "no response" in [entry.get_label() for entry in keys(found)]
    assert "no response" not in [entry.get_label() for entry in keys(planted())]


@pytest.mark.parametrize("show", ["phase1", "growth_rate", "delta_mu", "mu1"])
def test_a_quantity_of_each_kind_of_colours_can_be_drawn(show, tmp_path) -> None:
    with style():
        draw_map(planted(), show).savefig(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_axes_are_labelled_in_readable_units() -> None:
    assert axis_unit(planted()["K"]) == (1e3, "N/mm")
    with style():
        figure = draw_map(planted())
    assert figure.axes[0].get_ylabel() == "stiffness of the pulling spring $K$ (N/mm)"
    assert figure.axes[0].get_ylim() == (100.0, 300.0)
