"""Explore and Map: the numbers that they answer with, and the page in a browser."""

import statistics

import numpy as np
import pytest

import asperity as asp
from asperity.app.api import map as map_tab
from asperity.experiment import stick_slip_response
from asperity.study import map as maps
from asperity.study.map import Axis

POINT = {"V": 1e-6, "epsilon": 0.12, "frequency": 120.0}


def test_numbers_are_those_of_the_package(explored):
    answer = explored({"law": "rice-ruina", "numbers": POINT})
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("rice-ruina"), spring=material.K, load=material.W0)
    response = asp.periodic_response(slider, velocity=1e-6, epsilon=0.12, frequency=120.0)
    for name in ("mean_friction", "mu1", "mu2", "phase1", "phase2", "growth_rate"):
        assert answer["point"][name] == pytest.approx(float(getattr(response, name)), rel=1e-7)
    assert answer["point"]["stable"] == bool(response.stable)
    curve = answer["curves"]["rice-ruina"]
    mean = np.interp(0.12, answer["amplitudes"], np.array(curve["mean_friction"], dtype=float))
    assert mean == pytest.approx(float(response.mean_friction), rel=1e-3)


@pytest.mark.parametrize("inertia", [0, 1])
def test_the_copied_command_has_a_mass_only_where_it_counts(ask, inertia):
    numbers = {**POINT, "M": 2.0, "inertia": inertia}
    answer = ask("explore/text", {"law": "rice-ruina", "numbers": numbers})
    assert ('--set "M=2 kg"' in answer.json["command"]) == bool(inertia)


def test_modulations_that_no_copied_line_would_have_are_refused(ask):
    answer = ask("explore/text", {"law": "rice-ruina", "numbers": {**POINT, "epsilon2": 0.1}})
    assert (answer.status, answer.json["error"][:30]) == (400, "epsilon2 must be left out on t")


def test_the_motion_below_the_threshold_is_stick_slip(ask):
    """On average the slider moves at V, and what the spring lets go of is the slip."""
    numbers = {"V": 1e-5, "epsilon": 0.0, "frequency": 120.0, "K": 5e4, "W0": 7.0}
    question = {"law": "rice-ruina", "numbers": numbers, "growth_rate": 10.0}
    motion = ask("explore/motion", question).lines[-1]["result"]
    cycles = motion["stick_slip"]
    assert motion["inertia"]
    assert cycles["cycles"] > 3
    assert cycles["slip"] / cycles["period"] == pytest.approx(1e-5, rel=0.15)
    assert cycles["drop"] * 7.0 / 5e4 == pytest.approx(cycles["slip"], rel=0.15)
    assert len(motion["frames"]["place"]) == len(motion["frames"]["force"])


def test_stick_slip_that_grows_is_told_by_its_last_cycle(ask):
    """Just below the threshold the first cycles are small; Newton's method has the limit cycle."""
    numbers = {"V": 1e-6, "epsilon": 0.0, "frequency": 120.0, "K": 2e5, "W0": 7.0}
    question = {"law": "rice-ruina", "numbers": numbers, "growth_rate": 0.149}
    motion = ask("explore/motion", question).lines[-1]["result"]
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("rice-ruina"), spring=2e5, mass=pmma.M, load=7.0)
    limit = stick_slip_response(slider, velocity=1e-6)
    cycles = motion["stick_slip"]
    assert cycles["period"] == pytest.approx(float(limit.period), rel=0.05)
    assert cycles["drop"] == pytest.approx(float(limit.drop), rel=0.05)


def test_the_motion_above_the_threshold_settles_to_the_orbit(ask, explored):
    numbers = {"V": 1e-5, "epsilon": 0.1, "frequency": 120.0, "K": 1e6}
    point = explored({"law": "rice-ruina", "numbers": numbers})["point"]
    question = {"law": "rice-ruina", "numbers": numbers, "growth_rate": point["growth_rate"]}
    motion = ask("explore/motion", question).lines[-1]["result"]
    assert "stick_slip" not in motion
    force = motion["curves"]["force"]
    last = np.array(force["x"]) > motion["reached"] - 3 / 120
    low, high = min(point["force"]), max(point["force"])
    reached = np.array(force["y"])[last]
    assert reached.min() == pytest.approx(low, abs=0.1 * (high - low))
    assert reached.max() == pytest.approx(high, abs=0.1 * (high - low))


def test_the_link_shows_the_view_and_a_slider_changes_it(visit, record_property):
    page = visit("#explore?law=rice-ruina&laws=&epsilon=0.1&V=2e-6")
    sentence = page.locator(".sentence")
    sentence.filter(has_text="able:").wait_for()
    assert page.locator("label:has-text('pulling velocity') + input").input_value() == "2 µm/s"
    before = page.locator(".readings").inner_text()
    slider = page.locator(".quantity", has_text="relative amplitude").locator("input[type=range]")
    slider.focus()
    times = []
    for _ in range(5):
        count = len(measured(page))
        slider.press("ArrowRight")
        while len(measured(page)) == count:
            page.wait_for_timeout(5)
        times = measured(page)
    assert page.locator(".readings").inner_text() != before
    page.wait_for_url(lambda url: "epsilon=0.1" in url)
    # For the record: a machine that does other things says nothing about the page.
    record_property("slider_to_picture_ms_median", statistics.median(times[1:]))


def measured(page):
    """Times (ms) from a slider's movement to the picture."""
    return page.evaluate("performance.getEntriesByName('slider to picture').map((e) => e.duration)")


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
    result = namespace["result"]
    # The page's numbers have five digits.
    assert np.array(grid["values"]) == pytest.approx(result["growth_rate"].values, rel=1e-4)
    assert np.array_equal(np.array(grid["stable"], dtype=bool), result["stable"].values)
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
        ({"show": "__class__"}, "show must be"),
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
