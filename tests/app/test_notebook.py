"""The page in a notebook's cell, and what results show of themselves there."""

import http.client
import logging
from urllib.parse import parse_qs, urlsplit

import pytest

import asperity as asp
from asperity.errors import InputError


@pytest.fixture
def address(monkeypatch, server):
    """The page of the tests' own server, in place of one more."""
    from asperity.app import notebook

    monkeypatch.setattr(notebook, "_server", lambda: f"http://127.0.0.1:{server.port}/")


def test_the_cell_shows_the_slider(address):
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("elasto-plastic", A=0.012), spring="0.3 N/um", load="5 N")
    page = asp.explore(slider, velocity="2 um/s", epsilon=0.1, height=700)
    cell = page._repr_html_()
    assert cell.startswith("<iframe ")
    assert 'height="700"' in cell
    view = {n: v[0] for n, v in parse_qs(urlsplit(page.address).fragment.split("?")[1]).items()}
    assert view["law"] == "elasto-plastic"
    assert {n: float(view[n]) for n in ("A", "K", "W0", "V", "epsilon")} == {
        "A": 0.012, "K": 3e5, "W0": 5.0, "V": 2e-6, "epsilon": 0.1,
    }  # fmt: skip


def test_the_page_starts_at_the_slider(address, visit):
    material = asp.materials.load("bureau2000")
    slider = asp.Slider(material.law("rice-ruina"), spring="0.3 N/um", load="5 N")
    page = visit("#" + urlsplit(asp.explore(slider, velocity="2 um/s").address).fragment)
    assert page.get_by_label("mean normal load, with its unit").input_value() == "5 N"
    assert page.get_by_label("pulling velocity, with its unit").input_value() == "2 µm/s"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"slider": "elasto-plastic"}, "slider must be a Slider"),
        ({"velocity": "-1 um/s"}, "velocity must be positive"),
        ({"velocity": [1e-6, 2e-6]}, "velocity must be one number"),
        ({"height": 1}, "height must be"),
    ],
)
def test_what_cannot_be_shown_gets_a_sentence(address, arguments, message):
    with pytest.raises(InputError, match=message):
        asp.explore(**arguments)


def test_a_server_in_the_background_may_be_framed_by_this_machine_only():
    from asperity.app.application import build

    headers = build(1, in_notebook=True).headers
    ancestors = headers["content-security-policy"].split("frame-ancestors ")[1].split()
    assert ancestors == ["'self'", "http://127.0.0.1:*", "http://localhost:*"]
    assert "x-frame-options" not in headers


def test_a_background_server_answers():
    from asperity.app.server import serve_in_background

    split = urlsplit(serve_in_background())
    connection = http.client.HTTPConnection(split.hostname, split.port, timeout=30)
    connection.request("GET", "/")
    answer = connection.getresponse()
    assert answer.status == 200
    assert b"asperity" in answer.read()
    connection.close()


def test_the_logging_of_the_process_stays_as_it_is():
    from asperity.app.server import serve_in_background

    class Handler(logging.Handler):
        closed = False

        def close(self):
            self.closed = True

    handler = Handler()
    serve_in_background()
    assert not handler.closed
    assert any(kept() is handler for kept in logging._handlerList)
