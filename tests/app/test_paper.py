"""Paper: figures with the paper's numbers moved, and the ledger."""

import time

import numpy as np
import pytest

import asperity as asp


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
    paper = asp.materials.load("bureau2000")
    slider = asp.Slider(paper.law("rice-ruina"), spring="0.3 N/um", load=paper.W0)
    epsilon = curve["values"]["epsilon_eff"][10]
    point = asp.periodic_response(slider, velocity="10 um/s", epsilon=epsilon, frequency="120 Hz")
    assert curve["name"] == "10 µm/s"
    assert curve["values"]["mu1"][10] == pytest.approx(float(point.mu1), rel=1e-6)
    printed = answer["printed"][1]["values"]["mu1"]
    assert np.abs(np.array(curve["values"]["mu1"][1:]) / printed[1:] - 1).min() > 0.01
    assert answer["numbers"]["K"] == pytest.approx(3e5)


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        ({"figure": "figure-10"}, "figure"),
        ({"figure": "../figure"}, "figure"),
        ({"figure": "figure-02", "numbers": {"h0": 1e-6}}, "numbers"),
        ({"figure": "figure-02", "numbers": {"A": -1}}, "A"),
        ({"figure": "figure-02", "numbers": {"transmission": 2}}, "transmission"),
        ({"figure": "figure-02", "numbers": {"K": "1 kg"}}, "K"),
    ],
)
def test_a_wrong_figure_gets_a_sentence(ask, asked, word):
    answer = ask("paper/figure", asked)
    assert answer.status == 400
    assert answer.json["error"].startswith(word)
    assert " must be " in answer.json["error"]


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
