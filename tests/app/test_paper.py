"""Paper: figures with the paper's numbers moved, and the ledger."""

import time

import numpy as np
import pytest

import asperity as asp
from asperity.app.api import paper
from asperity_papers.bureau2000 import tab


@pytest.fixture
def figure(ask):
    """Ask for a figure until its programs are compiled; the JSON of the answer."""

    def send(**asked):
        while "preparing" in (answer := ask("paper/figure", asked).json):
            time.sleep(0.2)
        return answer

    return send


def test_curves_are_those_of_the_package(figure):
    answer = figure(figure="figure-08", numbers={"K": "0.3 N/um"})
    curve = answer["moved"][1]
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("rice-ruina"), spring="0.3 N/um", load=pmma.W0)
    epsilon = curve["values"]["epsilon_eff"][10]
    point = asp.periodic_response(slider, velocity="10 um/s", epsilon=epsilon, frequency="120 Hz")
    assert curve["name"] == "10 µm/s"
    assert curve["values"]["mu1"][10] == pytest.approx(float(point.mu1), rel=1e-6)
    printed = answer["printed"][1]["values"]["mu1"]
    assert np.abs(np.array(curve["values"]["mu1"][1:]) / printed[1:] - 1).min() > 0.01
    assert answer["numbers"]["K"] == pytest.approx(3e5)
    assert answer["command"].startswith("# no command")


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        ({"figure": "figure-12"}, "figure"),
        ({"figure": "../figure"}, "figure"),
        ({"figure": "figure-02", "numbers": {"h0": 1e-6}}, "numbers"),
        ({"figure": "figure-02", "numbers": {"A": -1}}, "A"),
        ({"figure": "figure-02", "numbers": {"transmission": 2}}, "transmission"),
        ({"figure": "figure-02", "numbers": {"K": "1 kg"}}, "K"),
        ({"figure": "figure-02", "numbers": {"M": 1e-300}}, "M must be within"),
        ({"figure": "figure-02", "numbers": {"A": 1e308}}, "A must be within"),
    ],
)
def test_a_wrong_figure_gets_a_sentence(ask, asked, word):
    answer = ask("paper/figure", asked)
    assert answer.status == 400
    assert answer.json["error"].startswith(word)
    assert " must be " in answer.json["error"]


def test_the_element_of_figure_10_moves_as_its_equation_says(figure):
    """x' = (lambda F/W)' + plastic rate, with the stretch and both rates from the page."""
    answer = figure(figure="figure-10", numbers={"lambda": "1.2 um"})
    assert answer["element"]["asperities"] == pytest.approx(7 / 1.2e-6)
    slow = answer["moved"][0]
    assert slow["name"] == "1 µm/s"
    stretch, velocity, plastic = (
        np.array(slow["values"][n]) for n in ("stretch", "slider_velocity", "plastic_velocity")
    )
    # The derivative of a periodic function by its Fourier series; over V, in periods of 1/120 s.
    orders = np.fft.rfftfreq(stretch.size, 1 / stretch.size)
    rate = np.fft.irfft(2j * np.pi * orders * np.fft.rfft(1e-9 * stretch)) * 120.0 / 1e-6
    assert velocity == pytest.approx(rate + plastic, abs=2e-3 * np.abs(velocity).max())


def test_curves_with_the_mass_follow_the_numbers():
    sent = []
    asked = {"figure": "figure-11", "numbers": {"M": "2 kg"}}
    paper.inertia(asked, lambda **message: sent.append(message))
    curve = next(m["curve"] for m in sent if "curve" in m)
    assert [m["progress"] for m in sent][-1] == 1
    assert curve["name"] == "1 µm/s, with its mass"
    pmma = asp.materials.load("bureau2000")
    slider = asp.Slider(pmma.law("elasto-plastic"), spring=pmma.K, load=pmma.W0, mass=2.0)
    # Another number of points than the page's: another start of the search.
    epsilon = curve["values"]["epsilon_eff"][20:]
    point = asp.periodic_response(
        slider, velocity="1 um/s", epsilon=epsilon, frequency="120 Hz", inertia=True
    )
    assert curve["values"]["mu2"][20:] == pytest.approx(point.mu2, rel=1e-6)


def test_a_gap_of_a_curve_says_why(figure, monkeypatch, visit):
    figure(figure="figure-08")  # the lines with the printed numbers are kept
    whole = tab.solve_curves

    def with_a_gap(*arguments, **options):
        rows = whole(*arguments, **options)
        rows.loc[3:4, "converged"], rows.loc[3:4, "result"] = False, "no orbit there"
        return rows

    monkeypatch.setattr(tab, "solve_curves", with_a_gap)
    page = visit("#paper?figure=figure-08&K=300000")
    reasons = page.locator(".key .lost")
    reasons.first.wait_for()
    assert reasons.all_text_contents() == [" – no orbit at 2 of 26 points: no orbit there"] * 2


def test_an_unknown_paper_is_told_in_a_sentence(visit):
    page = visit("#paper?paper=nothing2000")
    page.locator(".message", has_text="must be").wait_for()


def test_the_ledger_can_be_searched(visit):
    page = visit("#paper?show=ledger&kind=test&search=Rice")
    claims = page.locator(".claim")
    claims.first.wait_for()
    texts = claims.all_text_contents()
    assert 0 < len(texts) < 145
    assert all("rice" in text.lower() for text in texts)
    page.get_by_label("Text").fill("nothing has these words")
    page.locator(".sentence", has_text="0 of").wait_for()
    assert claims.count() == 0
    page.wait_for_url(lambda url: "search=nothing" in url)
