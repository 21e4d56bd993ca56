"""Map: the numbers of its grid, cancelling, and a click that takes a point to Explore."""

import numpy as np
import pytest

from asperity.app.api import map as map_tab
from asperity.study import map as maps
from asperity.study.map import Axis

ASKED = {
    "law": "rice-ruina",
    "numbers": {"V": 1e-6, "frequency": 120.0},
    "x": {"name": "epsilon", "low": 0.01, "high": 0.4},
    "y": {"name": "K", "low": "0.1 N/um", "high": "0.4 N/um"},
    "show": "growth_rate",
    "count": 2,
}


def test_the_grid_is_that_of_the_package(ask):
    *_, grid, last = ask("map", ASKED).lines
    assert last["done"]
    grid = grid["grid"]
    text = ask("map/text", ASKED).json["python"]
    namespace = {}
    exec(text.replace('print(result["growth_rate"])', ""), namespace)
    found = namespace["result"]
    # The page's numbers have five digits.
    assert np.array(grid["values"]) == pytest.approx(found["growth_rate"].values, rel=1e-4)
    assert np.array_equal(np.array(grid["stable"], dtype=bool), found["stable"].values)
    assert grid["x"] == pytest.approx(Axis("epsilon", 0.01, 0.4, 2).values)
    assert {k for line in grid["boundaries"] for k in line["kind"]} == {"Neimark-Sacker"}


def test_the_first_grid_does_not_wait_for_the_boundary(monkeypatch):
    asked_for = []

    def solved(law, fixed, *, x, y, boundary, progress):
        asked_for.append((x.count, boundary))
        return maps.response_map(law, fixed, x=x, y=y, boundary=False, progress=progress)

    coarse = [dict(ASKED, count=8), dict(ASKED, count=16)]
    monkeypatch.setattr(map_tab, "response_map", solved)
    grids = []
    for asked in coarse:
        map_tab.grow(asked, lambda **message: grids.append(message.get("grid")))
    assert asked_for == [(8, True), (8, False), (16, True)]
    assert [g["boundaries"] for g in grids if g] == [[], None, []]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": {"name": "K", "low": 1, "high": 2}}, "axes must be two numbers"),
        ({"x": {"name": "epsilon", "low": 0.5, "high": 0.1}}, "smaller to a larger"),
        ({"x": {"name": "no", "low": 0, "high": 1}}, "axis must be a number"),
        ({"count": 100_000}, "count must be"),
        ({"show": "__class__"}, "map.show must be"),
        ({"air": {}}, "map.air must be left out"),
    ],
)
def test_what_cannot_be_mapped_gets_a_sentence(ask, change, message):
    asked = {**ASKED, "numbers": {**ASKED["numbers"], "epsilon": 0.1}, **change}
    answer = ask("map/text", asked)
    assert answer.status == 400
    assert message in answer.json["error"]
    assert ask("map", asked).status == 400


def test_a_map_is_drawn_finer_and_a_point_goes_to_explore(visit):
    page = visit("#map?law=rice-ruina&x=epsilon,0.01,0.4,linear&y=K,100000,400000,linear&count=16")
    page.get_by_text("Neimark-Sacker", exact=False).first.wait_for()
    picture = page.locator(".stability-map .plot")
    picture.focus()
    picture.press("ArrowRight")
    assert "K" in page.locator(".status").inner_text()
    picture.press("Enter")
    page.locator("section.tab.explore").wait_for()
    assert page.get_by_label("Law", exact=True).input_value() == "rice-ruina"
    assert "K=" in page.url


def test_a_huge_map_holds_up_nobody_and_can_be_cancelled(ask, explored, visit):
    """Explore answers while a map that takes minutes is being solved, here with inertia."""
    page = visit("#map?law=rice-ruina&count=128&inertia=1&M=2")
    button = page.get_by_role("button", name="Cancel")
    button.wait_for()
    answer = explored({"law": "rice-ruina", "numbers": {**ASKED["numbers"], "epsilon": 0.1}})
    assert answer["point"]["converged"]
    assert page.get_by_label("With the mass of the slider (inertia)").is_checked()
    button.click()
    page.get_by_text("Cancelled.").wait_for()
    assert not button.is_visible()
