"""The page of the report in a browser: widths, headings, filters, links, and a print of it."""

from pathlib import Path

import pandas as pd
import pytest

from asperity.figures.style import save_picture, style
from asperity.ledger import Claim, FigureNumbers, Section, find_paper
from asperity.ledger.page import build_page
from asperity_papers.bureau2000 import schematics
from asperity_papers.bureau2000.figures import SCHEMATICS

WIDTHS = (390, 800, 1400)


def claims(paper):
    """The claims of the paper with invented verdicts and numbers: the true ones take a minute."""
    verdicts = ("reproduced", "reproduced", "differs", "misprint")
    return [
        Claim(
            id=entry.id, place=entry.place, statement=entry.statement, stated=entry.stated,
            kind=entry.kind, computed="1.234e-3 at 1 um/s; 5.678e-3 at 10 um/s", how=entry.how,
            rule="the value within 5 % of what is stated", verdict=verdicts[n % 4],
            why=entry.why, numbers={"value": 1.0},
        )
        for n, entry in enumerate(paper.contents.claim)
    ]  # fmt: skip


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    paper = find_paper("bureau2000")
    shown = [paper.words.figure(FigureNumbers(n, pd.DataFrame()), {}) for n in SCHEMATICS]
    (folder / "figures").mkdir()
    with style():
        for name in SCHEMATICS:
            save_picture(schematics.draw(name), folder / "figures" / name)
    judged = claims(paper)
    sections = [(Section("figures", "Figures", ()), shown)]
    # The summary shows schematics, which need no computation.
    first, *others = paper.contents.summary
    summary = (first.model_copy(update={"figures": SCHEMATICS}), *others)
    with pytest.MonkeyPatch.context() as patch:
        contents = paper.contents.model_copy(update={"summary": summary})
        patch.setitem(vars(paper), "contents", contents)
        text = build_page(paper, folder, sections, judged, paper.headlines(judged))
    (folder / "index.html").write_text(text, encoding="utf-8")
    return (folder / "index.html").as_uri()


@pytest.fixture
def visit(chromium, address):
    """A function that opens the page; fails if the page fetches anything from a network."""
    opened, fetched = [], []

    def open_page(width=1400, fragment="", **options):
        page = chromium.new_page(viewport={"width": width, "height": 844}, **options)
        page.on("request", lambda request: fetched.append(request.url))
        page.goto(address + fragment)
        opened.append(page)
        return page

    yield open_page
    for page in opened:
        page.close()
    assert all(url.startswith(("file:", "data:")) for url in fetched)


def test_nothing_is_wider_than_the_screen(visit):
    page = visit()
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true })")
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 844})
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_targets_of_links_exist_and_are_not_hidden_by_the_navigation(visit):
    page = visit(390)
    assert page.eval_on_selector_all("details", "all => all.some(d => d.open)") is False
    missing = page.eval_on_selector_all(
        "a[href^='#']",
        "links => links.map(a => a.hash.slice(1)).filter(n => !document.getElementById(n))",
    )
    assert missing == []
    targets = page.eval_on_selector_all("nav a", "links => links.map(a => a.hash)")
    assert len(targets) >= 5
    last = page.eval_on_selector_all(".claim", "all => '#' + all[all.length - 1].id")
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 844})
        for target in [*targets, last]:
            page.evaluate(f"location.hash = '{target}'")
            heading = f"{target} h2" if target in targets else f"{target} summary"
            bottom = page.evaluate("document.querySelector('nav').getBoundingClientRect().bottom")
            top = page.evaluate(f"document.querySelector('{heading}').getBoundingClientRect().top")
            assert top >= bottom, (width, target)


def shown(page):
    """Classes of the visible claims."""
    return page.eval_on_selector_all(
        ".claim", "all => all.filter(c => c.getClientRects().length).map(c => c.className)"
    )


@pytest.mark.parametrize("width", [390, 1400])
def test_tiles_show_the_claims_that_they_count(visit, width):
    page = visit(width)
    everything = page.eval_on_selector_all(".claim", "all => all.map(c => c.className)")
    first = shown(page)
    assert set(first) < set(everything)
    assert not any("reproduced" in name for name in first)
    for verdict in ("reproduced", "misprint", "differs"):
        page.click(f".tiles .{verdict} a")
        count = int(page.inner_text(f".tiles .{verdict} b"))
        assert shown(page) == [f"claim {verdict} test"] * count
    page.click(".filters a[href='#show-apart']")
    assert shown(page) == [name for name in everything if name.endswith("apart")]
    page.click(".filters a[href='#show-all']")
    assert shown(page) == everything


def test_on_a_phone_the_page_is_short_and_a_link_opens_a_hidden_claim(visit, address):
    """The page shows the summary, two figures, 25 claims and the parameters."""
    page = visit(390)
    assert page.evaluate("document.documentElement.scrollHeight") < 30 * 844
    name = page.eval_on_selector_all(".claim.reproduced", "all => all[0].id")
    page.goto(f"{address}#{name}")
    assert page.is_visible(f"[id='{name}'] summary")


def test_a_print_has_all_claims_and_no_navigation(visit, tmp_path):
    page = visit()
    page.emulate_media(media="print")
    assert len(shown(page)) == len(find_paper("bureau2000").contents.claim)
    assert not page.is_visible("nav")
    target = tmp_path / "page.pdf"
    page.pdf(path=target, format="A4")
    assert Path(target).read_bytes().startswith(b"%PDF")
