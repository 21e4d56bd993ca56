"""What ``asperity reproduce`` writes: complete, self-contained, readable, or nothing at all."""

import csv
import json
import math
import os
import re
import shutil
import subprocess
from html import escape
from html.parser import HTMLParser
from importlib.resources import files

import pandas as pd
import pytest

from asperity.errors import InputError
from asperity.figures.files import save_picture
from asperity.figures.paper import SCHEMATICS
from asperity.figures.style import style
from asperity.report import reproduce
from asperity.report.folder import written_whole
from asperity.report.headlines import headlines
from asperity.report.markup import rich
from asperity.study import paper as study
from asperity.study.claims import Claim
from asperity.study.paper import virtual

FIGURES = [f"figure-{n:02}" for n in range(1, 13)]
DRAWN = [name for name in FIGURES if name not in ("figure-01", "figure-10")]
VIRTUAL = [f"virtual-{n:02}" for n in (2, 3, 4, 5)]


def claim(key, verdict, **fields):
    told = {
        "place": "Section III.A",
        "statement": "The mean falls by <20 %> & more at eps_eff = 0.24.",
        "stated": "1e-3",
        "computed": "mu1 = 1.95e-3 at 1 um/s",
        "how": "K/Kc, V^2",
        "rule": "below 5 %",
        "why": 'so "it" is',
        "numbers": {"value": 0.2, "missing": math.nan},
    }
    return Claim(id=key, verdict=verdict, **(told | fields))


CLAIMS = [claim("a-1", "reproduced"), claim("b-2", "misprint"), claim("c-3", "differs", why="")]


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A report with a short ledger; the ledger itself has its own tests."""
    out = tmp_path_factory.mktemp("reproduced") / "report"
    told = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("asperity.study.claims.ledger", lambda: CLAIMS)
        summary = reproduce(out, progress=lambda *step: told.append(step))
    return out, summary, told


class Page(HTMLParser):
    """Elements of a page, and whether every one is closed in order."""

    VOID = frozenset({"meta", "img", "input", "br"})

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.text = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def page(report):
    return Page((report[0] / "index.html").read_text(encoding="utf-8"))


def test_all_files_are_there_and_no_others(report):
    out, _, _ = report
    written = sorted(str(p.relative_to(out)) for p in out.rglob("*") if p.is_file())
    pictures = [f"figures/{n}.{kind}" for n in FIGURES + VIRTUAL for kind in ("pdf", "png")]
    tables = [f"data/{name}.csv" for name in DRAWN]
    tables += [f"data/{name}{part}.csv" for name in VIRTUAL for part in ("", "-model")]
    assert written == sorted(["claims.csv", "claims.json", "index.html", *pictures, *tables])
    assert [p.name for p in out.parent.iterdir()] == ["report"]


def test_files_can_be_read_by_others(report):
    umask = os.umask(0)
    os.umask(umask)
    for file in (p for p in report[0].rglob("*") if p.is_file()):
        assert file.stat().st_mode & 0o777 == 0o666 & ~umask, file


def test_pictures_are_pictures(report):
    for name in FIGURES + VIRTUAL:
        assert (report[0] / "figures" / f"{name}.png").read_bytes()[1:4] == b"PNG"
        pdf = (report[0] / "figures" / f"{name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF")
        assert b"CreationDate" not in pdf


@pytest.mark.parametrize("name", DRAWN)
def test_a_table_says_where_its_numbers_come_from(report, name):
    path = report[0] / "data" / f"{name}.csv"
    head = [x for x in path.read_text(encoding="utf-8").splitlines() if x.startswith("#")]
    assert any("asperity" in line for line in head)
    assert any("D0 = 0.4 +- 0.04 um (published)" in line for line in head)
    data = pd.read_csv(path, comment="#")
    assert list(data.columns) == list(study.COLUMNS)
    assert all(any(line.startswith(f"#   {c}: ") for line in head) for c in study.COLUMNS)
    assert data["converged"].all()


@pytest.mark.parametrize("name", VIRTUAL)
def test_tables_of_the_virtual_experiment_say_that_it_is_simulated(report, name):
    for part, columns in (("", virtual.POINT_COLUMNS), ("-model", study.COLUMNS)):
        path = report[0] / "data" / f"{name}{part}.csv"
        text = path.read_text(encoding="utf-8")
        assert text.startswith("# SIMULATED")
        assert "no measured points" in text.splitlines()[0]
        head = [line for line in text.splitlines() if line.startswith("#")]
        for series in virtual.all_series():
            if series.name in set(pd.read_csv(path, comment="#").get("series", [])):
                seeds = ", ".join(map(str, series.seeds))
                assert any(f"{series.name}, " in x and f"seeds {seeds};" in x for x in head)
        assert any("B = 0.02 (stated 0.026 +- 0.01)" in line for line in head)
        assert list(pd.read_csv(path, comment="#").columns) == list(columns)
        assert all(any(line.startswith(f"#   {c}: ") for line in head) for c in columns)


def test_the_virtual_experiment_on_the_page(page, report):
    text = "".join(page.text)
    section = text[text.index("A virtual experiment", text.index("Figures")) :]
    assert "Simulated." in section
    assert "nothing here stands for them" in section
    assert "Factor on ε that makes air and vacuum collapse" in section
    alts = [image["alt"] for image in page.all("img")]
    assert sum(alt.startswith("Simulated: ") for alt in alts) == len(VIRTUAL)
    for name in VIRTUAL:
        assert name in [a.get("id") for _, a in page.elements]


def test_claims_as_json_and_csv(report):
    record = json.loads((report[0] / "claims.json").read_text(encoding="utf-8"))
    assert record["counts"] == {"reproduced": 1, "misprint": 1, "differs": 1}
    assert record["claims"][0]["statement"] == CLAIMS[0].statement
    assert record["claims"][0]["numbers"] == {"value": 0.2, "missing": None}
    with (report[0] / "claims.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["id"] for row in rows] == ["a-1", "b-2", "c-3"]
    assert rows[0]["why"] == 'so "it" is'


def test_summary(report):
    out, summary, _ = report
    assert (summary.folder, summary.page) == (out, out / "index.html")
    assert (summary.figures, summary.failed) == (16, 0)
    assert summary.points > 2000
    text = "\n".join(summary.lines())
    assert "3: 1 reproduced, 1 misprint, 1 differs" in text
    assert text.count("The mean falls") == 2


def test_progress_counts_up_to_the_end(report):
    _, _, told = report
    done = [step for _, step, _ in told]
    total = told[0][2]
    assert done == sorted(set(done))
    assert (done[0], done[-1]) == (0, total)
    assert {t for _, _, t in told} == {total}


def test_the_page_is_sound(page):
    assert page.open == []
    names = [a["id"] for _, a in page.elements if "id" in a]
    assert len(names) == len(set(names))
    assert page.all("html")[0]["lang"] == "en"
    assert all(h["scope"] == "col" for h in page.all("th"))
    assert [name for name in FIGURES + VIRTUAL if name not in names] == []


def test_the_page_needs_nothing_else(page, report):
    assert page.all("script") == page.all("link") == page.all("iframe") == []
    assert all(image["src"].startswith("data:image/png;base64,") for image in page.all("img"))
    assert len(page.all("img")) == 16
    style_text = files("asperity.report").joinpath("page.css").read_text(encoding="utf-8")
    assert "url(" not in style_text
    assert "@import" not in style_text
    for link in page.all("a"):
        target = link["href"]
        if target.startswith("#"):
            assert target[1:] in {a.get("id") for _, a in page.elements}
        elif ":" in target:
            assert target.startswith("https://doi.org/10.")
        else:
            assert (report[0] / target).is_file()


def test_every_picture_is_told_to_those_who_cannot_see_it(page):
    assert all(len(image["alt"]) > 80 for image in page.all("img"))


def test_claims_on_the_page(page):
    text = "".join(page.text)
    assert (
        text.count(
            "The mean falls by <20 %> & more at εeff = 0.24.".replace(" %", "\u00a0%").replace(
                "eff = ", "eff\u00a0=\u00a0"
            )
        )
        == 3
    )
    rows = [a for a in page.all("tr") if a.get("id") in ("a-1", "b-2", "c-3")]
    assert [row["class"] for row in rows] == ["reproduced", "misprint", "differs"]
    assert [i["id"] for i in page.all("input")] == [
        "show-all",
        "show-reproduced",
        "show-misprint",
        "show-differs",
    ]


def test_conclusions_are_judged_by_the_numbers(report):
    figures = {figure.name: figure for figure in (compute() for compute in study.FIGURES)}
    judged = headlines(figures)
    assert [h.holds for h in judged] == [True, True, True, True, True, False]
    assert "0.88" in judged[-1].found


@pytest.mark.parametrize(
    ("plain", "shown"),
    [
        ("eps_eff < 0.3", "ε<sub>eff</sub> &lt; 0.3"),
        ("mu1 at V0", "μ<sub>1</sub> at V<sub>0</sub>"),
        ("1e-3 to 2.5e+7", "10<sup>-3</sup> to 2.5\u00a0×\u00a010<sup>7</sup>"),
        ("(8 A^2) and V^(1/2)", "(8 A<sup>2</sup>) and V<sup>1/2</sup>"),
        ("f >> V/D0, >= 2", "f ≫ V/D<sub>0</sub>, ≥ 2"),
        ("at -5 % +- 1", "at −5\u00a0% ± 1"),
        ("a number; maximum", "a number; maximum"),
        ("<script>", "&lt;script&gt;"),
    ],
)
def test_plain_text_as_a_printer_sets_it(plain, shown):
    assert rich(plain).replace("<sup>−", "<sup>-") == shown


def test_a_second_report_has_the_same_bytes(tmp_path):
    contents = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        with style():
            written = [save_picture(s.draw(), folder / s.name) for s in SCHEMATICS]
        contents.append([path.read_bytes() for pair in written for path in pair])
    assert contents[0] == contents[1]


def test_a_file_where_the_folder_should_be(tmp_path):
    (tmp_path / "taken").write_text("mine")
    for out in (tmp_path / "taken", tmp_path / "taken" / "report"):
        with pytest.raises(InputError, match="out must be a folder that can be written") as refused:
            reproduce(out)
        assert "\n" not in str(refused.value)
    assert (tmp_path / "taken").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def write_and_be_interrupted(folder):
    with written_whole(folder) as staging:
        (staging / "index.html").write_text("after")
        raise KeyboardInterrupt


def test_nothing_is_half_written(tmp_path):
    old = tmp_path / "old"
    old.mkdir()
    (old / "index.html").write_text("before")
    for folder in (old, tmp_path / "new" / "deep"):
        with pytest.raises(KeyboardInterrupt):
            write_and_be_interrupted(folder)
    assert [p.name for p in tmp_path.iterdir()] == ["old"]
    assert [p.name for p in old.iterdir()] == ["index.html"]
    assert (old / "index.html").read_text() == "before"


def test_other_files_in_the_folder_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "index.html").write_text("before")
    with written_whole(tmp_path) as staging:
        (staging / "data").mkdir()
        (staging / "data" / "x.csv").write_text("1")
        (staging / "index.html").write_text("after")
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert (tmp_path / "index.html").read_text() == "after"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["data", "index.html", "notes.txt"]


def _luminance(colour):
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_colours_of_text_can_be_read(theme):
    css = files("asperity.report").joinpath("page.css").read_text(encoding="utf-8")
    block = re.findall(r":root \{(.*?)\}", css, re.S)[theme]
    colour = dict(re.findall(r"--([\w-]+): (#\w{6})", block))
    pairs = [(c, back) for c in ("ink", "soft", "link") for back in ("page", "card")]
    pairs += [(c, f"{c}-back") for c in ("good", "print", "bad")]
    for text, back in pairs:
        low, high = sorted(_luminance(colour[c]) for c in (text, back))
        assert (high + 0.05) / (low + 0.05) >= 4.5, (text, back)


_NAMES = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, _NAMES)), None)
in_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium here")


def browse(folder, *options):
    profile = f"--user-data-dir={folder / 'profile'}"
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", profile, *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    return done.stdout


@in_browser
@pytest.mark.parametrize("width", [360, 390, 768, 1200])
def test_no_sideways_scrolling(report, tmp_path, width):
    page = (report[0] / "index.html").read_text(encoding="utf-8")
    frame = tmp_path / "frame.html"
    frame.write_text(
        f'<meta charset="utf-8"><p id="told"></p><iframe id="f" width="{width}" height="900" '
        f'style="border:0" srcdoc="{escape(page)}"></iframe><script>onload = () => {{'
        "const root = document.getElementById('f').contentDocument.documentElement;"
        "document.getElementById('told').textContent = 'needs ' + root.scrollWidth; }</script>",
        encoding="utf-8",
    )
    dom = browse(tmp_path, "--dump-dom", frame.as_uri())
    # A scroll bar takes some of the width.
    (needed,) = re.findall(r"needs (\d+)<", dom)
    assert width - 20 <= int(needed) <= width


@in_browser
def test_it_prints(report, tmp_path):
    target = tmp_path / "page.pdf"
    page = (report[0] / "index.html").as_uri()
    browse(tmp_path, f"--print-to-pdf={target}", "--no-pdf-header-footer", page)
    assert len(re.findall(rb"/Type\s*/Page\b", target.read_bytes())) > 5
