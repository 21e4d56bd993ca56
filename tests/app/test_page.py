"""The page as a whole: accessibility, widths, keyboard, links, copies, printing."""

import json
import re
import shlex
import subprocess
import sys
from urllib.parse import parse_qs

import pytest

from asperity.cli.main import main
from references.commands import refused

EXPLORE = "#explore?law=rice-ruina&laws=&epsilon=0.1"


def opened(visit, **options):
    page = visit(EXPLORE, **options)
    page.locator("section.tab.explore").wait_for()
    return page


def test_the_keyboard_reaches_every_control(visit):
    page = opened(visit)
    page.locator(".sentence", has_text="able:").wait_for()
    shown = "[...document.querySelectorAll('a, button, input, select, summary')]"
    shown += ".filter((e) => e.checkVisibility())"
    page.evaluate("addEventListener('focusin', (e) => { e.target.dataset.reached = '' })")
    for _ in range(page.evaluate(f"{shown}.length") + 10):
        page.keyboard.press("Tab")
    missed = f"{shown}.filter((e) => !('reached' in e.dataset)).map((e) => e.outerHTML)"
    assert page.evaluate(missed) == []


def test_the_keyboard_reads_the_values_of_a_chart(visit, explored):
    page = opened(visit)
    page.locator(".sentence", has_text="able:").wait_for()
    numbers = {"V": 1e-6, "epsilon": 0.1, "frequency": 120.0}
    force = explored({"law": "rice-ruina", "numbers": numbers})["point"]["force"]
    chart = page.locator(".panel.period .plot")
    spoken = page.locator(".panel.period [aria-live]")
    chart.focus()
    chart.press("ArrowRight")
    assert spoken.inner_text() == f"F/W₀: {float(f'{force[0]:.4g}'):g} at 0"
    chart.press("ArrowDown")
    assert spoken.inner_text().startswith("slip rate / V: ")
    assert page.locator(".panel.period .readout").is_visible()
    chart.press("Escape")
    assert spoken.inner_text() == ""


def test_tabs_are_links_and_come_back_as_they_were(visit):
    page = opened(visit)
    page.get_by_label("Law", exact=True).select_option("linker-dieterich")
    page.get_by_role("link", name="Data").click()
    page.locator("section.tab.data").wait_for()
    # The address of Explore, which is written with a delay, does not take the place of Data's.
    page.wait_for_timeout(400)
    assert "#data" in page.url
    page.get_by_role("link", name="Explore").click()
    explore = page.locator("section.tab.explore")
    assert explore.get_by_label("Law", exact=True).input_value() == "linker-dieterich"
    page.go_back()
    page.locator("section.tab.data").wait_for()


def test_a_wrong_number_is_told_in_a_sentence_and_undone(visit):
    page = opened(visit)
    field = page.get_by_label("pulling velocity, with its unit")
    field.fill("-3 um/s")
    field.press("Enter")
    message = page.locator(".message", has_text="V must be positive")
    message.wait_for()
    field.fill("1,000 um/s")  # a thousand, or one?
    field.press("Enter")
    page.locator(".message", has_text="without commas").wait_for()
    field.fill("2 mm/min")  # a unit that only the server knows
    field.press("Enter")
    message.wait_for(state="hidden")
    page.wait_for_url(lambda url: "V=2+mm%2Fmin" in url)


def test_a_foreign_text_in_the_link_is_a_text(visit):
    page = visit("#explore?law=<img src=x onerror=alert(1)>&V=<b>1</b>&laws=<script>&epsilon=0.1")
    page.locator(".message", has_text="V must be").wait_for()
    assert page.locator("main img, main script, main b").count() == 0


@pytest.fixture
def copied(ask, explored):
    """An operating point with an air layer: its answer, and its Python and command."""
    numbers = {"V": 2e-6, "epsilon": 0.2, "frequency": "90 Hz", "A": 0.012, "K": 3e5}
    question = {"law": "rice-ruina", "numbers": numbers, "air": {"h0": "9 um"}}
    return explored(question)["point"], ask("explore/text", question).json


def test_the_copied_python_gives_the_same_numbers(copied):
    point, texts = copied
    namespace = {}
    exec(texts["python"].replace("print(response)", ""), namespace)
    for name in ("mean_friction", "mu1", "mu2", "phase1"):
        value = float(getattr(namespace["response"], name))
        assert value == pytest.approx(point[name], rel=1e-9)


def test_the_copied_command_gives_the_same_numbers(copied):
    from click.testing import CliRunner

    point, texts = copied
    arguments = shlex.split(texts["command"])[1:]
    result = json.loads(CliRunner().invoke(main, [*arguments, "--json"]).stdout)
    for name in ("mean_friction", "mu1", "mu2", "phase1"):
        assert result[name] == pytest.approx(point[name], rel=1e-9)


def test_figures_are_saved_as_svg_png_and_csv(visit, tmp_path):
    page = opened(visit)
    page.locator(".sentence", has_text="able:").wait_for()
    for what, start in (("SVG", b"<svg"), ("PNG", b"\x89PNG"), ("CSV", b"phase,force")):
        with page.expect_download() as waited:
            page.locator(".panel.period").get_by_role("button", name=what).click()
        target = tmp_path / what
        waited.value.save_as(target)
        assert target.read_bytes().startswith(start)
    rows = (tmp_path / "CSV").read_text().splitlines()
    assert len(rows) == 257
    # A picture on its own has its colours: nothing points to the page's style sheet.
    assert b"var(" not in (tmp_path / "SVG").read_bytes()
    assert b"class=" not in (tmp_path / "SVG").read_bytes()


def test_print_shows_the_figures_and_no_controls(visit):
    page = opened(visit)
    page.emulate_media(media="print")
    assert not page.locator(".controls").is_visible()
    page.locator(".sentence", has_text="able:").wait_for()
    # What the browser sends before it prints, from a screen of any width.
    page.set_viewport_size({"width": 720, "height": 1000})
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.locator(".panel.period .plot svg").wait_for()
    places = [".panel.period", ".panel.period .plot svg"]
    wide = "(e) => document.querySelector(e).getBoundingClientRect().width"
    panel, picture = (page.evaluate(wide, place) for place in places)
    assert 0.85 * panel < picture <= panel
    assert "epsilon = 0.1" in page.locator(".on-paper").inner_text()


def test_on_a_phone_the_slider_stays_beside_the_figure(visit):
    page = opened(visit, width=360, height=740)
    page.locator(".sentence", has_text="able:").wait_for()
    assert not page.locator(".quantity").first.is_visible()
    page.locator(".panel.period").evaluate("(e) => e.scrollIntoView()")
    dock = page.locator(".dock")
    before = page.locator(".readings").inner_text()
    dock.locator("input").press("ArrowRight")
    assert dock.locator("output").inner_text() != "0.1"
    page.wait_for_function("(t) => document.querySelector('.readings').innerText !== t", arg=before)
    # Both are within the screen, and what the slider has moved is in the fields above too.
    inside = (
        "(e) => e.getBoundingClientRect().top >= 0 && e.getBoundingClientRect().top < innerHeight"
    )
    assert page.locator(".panel.period .plot").evaluate(inside)
    assert dock.locator("input").evaluate(inside)
    field = page.get_by_label("relative amplitude of the load on the contacts, with its unit")
    assert field.input_value() == dock.locator("output").inner_text()
    dock.get_by_label("Number of the slider below").select_option(index=0)
    assert dock.locator("output").inner_text() == "1 µm/s"


def test_the_theme_can_be_changed_and_is_kept(visit):
    page = opened(visit, color_scheme="light")
    ground = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.get_by_role("button", name="Light or dark").click()
    dark = page.evaluate(ground)
    assert dark != light
    page.reload()
    assert page.evaluate(ground) == dark


def test_a_signal_ends_the_server_in_order(tmp_path):
    started = subprocess.Popen(
        [sys.executable, "-m", "asperity", "serve", "--port", "0"],
        stderr=subprocess.PIPE,
        text=True,
    )
    address = started.stderr.readline()
    assert "http://127.0.0.1:" in address
    started.terminate()
    assert started.wait(timeout=60) == 0
    assert "Traceback" not in started.stderr.read()
    started.stderr.close()


def test_a_port_that_is_taken_is_told(server):
    from click.testing import CliRunner

    refused(CliRunner().invoke(main, ["serve", "--port", str(server.port)]), "--port must be free")


def test_without_the_extra_there_is_a_sentence(monkeypatch):
    from click.testing import CliRunner

    for name in [name for name in sys.modules if name.startswith(("asperity.app", "uvicorn"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    refused(
        CliRunner().invoke(main, ["serve"]),
        "make app in a clone",
        "pip install 'asperity[app]' in an environment",
    )


#: Scenes: a tab, and what its link holds.
SCENES = {
    "explore": "law=linker-dieterich&laws=rice-ruina&V=0.000003&epsilon=0.2"
    "&air=1&air.h0=0.000009&K=300000&alpha=0.3&show=phases&names=geophysics&letters=large",
    "map": "law=rice-ruina&count=16&show=mu1&x=V,1e-7,0.00001,log&y=epsilon,0.01,0.3,linear"
    "&K=300000&names=geophysics",
    "paper": "figure=figure-10&lambda=0.0000012&names=friction",
    "data": "run=hold_step_modulate&names=geophysics",
}

#: Tab, values of all controls that are filled, and pressed buttons, as a person sees them.
SEEN = """() => [
  document.title, document.documentElement.className,
  ...[...document.querySelectorAll("main :is(input, select, textarea)")].map((e) =>
    [e.ariaLabel || e.labels[0]?.innerText, e.type === "checkbox" ? e.checked : e.value]),
  ...[...document.querySelectorAll("[aria-pressed=true], details[open] > summary, #names")]
    .map((e) => e.innerText)]"""
#: Curves, points and labels of all figures.
DRAWN = """() => [...document.querySelectorAll("main .panel:not([hidden]) .plot svg")].map((e) =>
  [e.closest(".panel").className, [...e.querySelectorAll(".line, .point, .bar, text, image")].map(
    (m) => [m.getAttribute("d") || m.getAttribute("cy") || m.getAttribute("href") || m.innerHTML])])
"""


#: Words that the page shows while it computes.
BUSY = re.compile("…|so far|Integrating|Compiling|finer grid")


def settled(page, tab):
    """What the page shows once nothing is computed any more."""
    page.locator(f"section.tab.{tab} :is(.plot svg, .fine)").last.wait_for()
    seen, before = page.evaluate(DRAWN), None
    while seen != before or BUSY.search(page.locator("main").inner_text()):
        page.wait_for_timeout(700)  # longer than any tab waits before it asks
        seen, before = page.evaluate(DRAWN), seen
    return page.evaluate(SEEN), seen


@pytest.mark.parametrize("tab", SCENES)
def test_the_link_of_a_scene_restores_it_without_a_barrier_that_axe_knows_of(visit, barriers, tab):
    # Colours on their way from light to dark have other contrasts.
    still = {"color_scheme": "light", "reduced_motion": "reduce"}
    page = visit(f"#{tab}?{SCENES[tab]}", **still, bypass_csp=True)
    controls, figures = settled(page, tab)
    # The force over the mean load, not over the load.
    assert ("τ/σ̄" in str(figures)) == (tab == "explore")
    address = page.url.split("#", 1)[1]
    query = parse_qs(address.split("?", 1)[1])
    assert {n: query.get(n) for n in parse_qs(SCENES[tab])} == parse_qs(SCENES[tab])
    again = visit("#" + address, **still)
    assert barriers(page) == []
    page.emulate_media(color_scheme="dark")
    page.set_viewport_size({"width": 390, "height": 900})
    assert barriers(page) == []
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true })")
    for width in (375, 800, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        # Nor is a picture wider than its panel, which clips it.
        page.wait_for_function(
            "[...document.querySelectorAll('.plot svg')].every("
            "(e) => e.clientWidth <= e.parentElement.clientWidth)"
        )
    assert settled(again, tab) == (controls, figures)
