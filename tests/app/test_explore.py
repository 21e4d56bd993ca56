"""Explore: the numbers that it answers with, and the page in a browser."""

import statistics

import numpy as np
import pytest

import asperity as asp
from asperity.experiment import stick_slip_response

POINT = {"V": 1e-6, "epsilon": 0.12, "frequency": 120.0}


def test_numbers_are_those_of_the_package(explored):
    answer = explored({"law": "rice-ruina", "numbers": POINT})
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("rice-ruina"), spring=material.K, load=material.W0)
    found = asp.periodic_response(slider, velocity=1e-6, epsilon=0.12, frequency=120.0)
    for name in ("mean_friction", "mu1", "mu2", "phase1", "phase2", "growth_rate"):
        assert answer["point"][name] == pytest.approx(float(getattr(found, name)), rel=1e-7)
    assert answer["point"]["stable"] == bool(found.stable)
    curve = answer["curves"]["rice-ruina"]
    mean = np.interp(0.12, answer["amplitudes"], np.array(curve["mean_friction"], dtype=float))
    assert mean == pytest.approx(float(found.mean_friction), rel=1e-3)


def test_the_motion_below_the_threshold_is_stick_slip(ask):
    """On average the slider moves at V, and what the spring lets go of is the slip."""
    numbers = {"V": 1e-5, "epsilon": 0.0, "frequency": 120.0, "K": 5e4, "W0": 7.0}
    question = {"law": "rice-ruina", "numbers": numbers, "growth_rate": 10.0}
    motion = ask("explore/motion", question).lines[-1]["result"]
    found = motion["stick_slip"]
    assert motion["inertia"]
    assert found["cycles"] > 3
    assert found["slip"] / found["period"] == pytest.approx(1e-5, rel=0.15)
    assert found["drop"] * 7.0 / 5e4 == pytest.approx(found["slip"], rel=0.15)
    assert len(motion["frames"]["place"]) == len(motion["frames"]["force"])


def test_stick_slip_that_grows_is_told_by_its_last_cycle(ask):
    """Just below the threshold the first cycles are small; Newton's method has the limit cycle."""
    numbers = {"V": 1e-6, "epsilon": 0.0, "frequency": 120.0, "K": 2e5, "W0": 7.0}
    question = {"law": "rice-ruina", "numbers": numbers, "growth_rate": 0.149}
    motion = ask("explore/motion", question).lines[-1]["result"]
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("rice-ruina"), spring=2e5, mass=pmma.M, load=7.0)
    limit = stick_slip_response(slider, velocity=1e-6)
    found = motion["stick_slip"]
    assert found["period"] == pytest.approx(float(limit.period), rel=0.05)
    assert found["drop"] == pytest.approx(float(limit.drop), rel=0.05)


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
    for _ in range(20):
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
