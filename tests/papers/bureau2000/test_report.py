"""The folder that ``asperity reproduce`` writes: complete and self-contained, or not written."""

import csv
import json
import os
import re
from contextlib import contextmanager
from html.parser import HTMLParser
from importlib.resources import files

import pandas as pd
import pytest

from asperity.errors import InputError
from asperity.figures.style import save_picture, style
from asperity.ledger import Claim, Headline, Paper, Sensitivity, find_paper, reproduce, rich
from asperity.ledger.contents import SummaryWords
from asperity_papers.bureau2000 import figures as report_sections, schematics
from asperity_papers.bureau2000.curves import WORDS as FIGURE_WORDS
from asperity_papers.bureau2000.figures import SCHEMATICS
from asperity_papers.bureau2000.recordings import all_series

pytestmark = pytest.mark.slow

#: Figures of curves of this report: with measured points, of one period, and in the summary.
DRAWN = ["figure-02", "figure-03", "figure-13", "figure-16"]
FIGURES = ["figure-01", *DRAWN, "figure-10"]
#: Columns of a table of curves.
COLUMNS = [
    *("curve", "law", "alpha", "lambda", "inertia", "damping", "V", "frequency"),
    *("epsilon_applied", "epsilon_eff", "mean_friction", "delta_mu", "mu1", "mu2", "phase1"),
    *("phase2", "floquet_max", "stable", "converged", "result"),
]
VIRTUAL = [f"virtual-{n:02}" for n in (2, 3, 4, 5)]


def claim(key, verdict, **fields):
    words = {
        "place": "Section III.A",
        "statement": "The mean falls by <20 %> & more at eps_eff = 0.24.",
        "stated": "1e-3",
        "computed": "mu1 = 1.95e-3 at 1 um/s",
        "how": "K/Kc, V^2",
        "rule": "below 5 %",
        "why": 'so "it" is',
        "kind": "test",
        "numbers": {"value": 0.2},
    }
    return Claim(id=key, verdict=verdict, **(words | fields))


VARIED = Sensitivity(
    "A", ("A = 0.008", "A = 0.018"), {"value": (0.1, 0.3)}, ("differs", "reproduced")
)
#: Figure of the three laws, above the answer on the page.
LAWS = ("figure-16",)
WORDS = (
    SummaryWords(
        title="The answer in five sentences", sentences=tuple(5 * ["It is {a-1}."]), figures=LAWS
    ),
    SummaryWords(title="What is wrong in print", sentences=("These:",), verdict="misprint"),
    SummaryWords(title="What inertia does", sentences=("{c-3}.",)),
    SummaryWords(title="What stays open", sentences=("All.", "And {b-2}.")),
)
CLAIMS = [
    claim("a-1", "reproduced", depends_on=("A",), sensitivity=(VARIED,)),
    claim("b-2", "misprint"),
    claim("c-3", "differs", why=""),
    claim("d-4", "reproduced", kind="arithmetic"),
]
HEADLINES = [
    Headline(f"It is so, {standing}.", "1 %", standing, ("a-1",))
    for standing in ("holds", "holds at the central values", "undecided", "does not hold")
]


def points_file(folder):
    """Artificial points: steady friction and a drop of 20 % with errors of a quarter of it."""
    path = folder / "artificial.csv"
    path.write_text(
        "figure,observable,series,x,y,y_err,source\n"
        "figure-02,delta_mu,1 um/s,0.5,-0.1,0.005,artificial\n"
        "figure-03,mean_friction,eps = 0,10 um/s,0.47007,0.001,artificial\n"
    )
    return path


@pytest.fixture(scope="module")
def report(tmp_path_factory, figures, experiment):
    """A report with a short ledger and computed numbers, each of which has other tests."""
    out = tmp_path_factory.mktemp("reproduced") / "report"
    steps = []

    @contextmanager
    def no_background():
        yield lambda: experiment

    with pytest.MonkeyPatch.context() as patch:
        computed = {name: lambda _, numbers=figures[name]: numbers for name in DRAWN}
        patch.setattr(report_sections, "NUMBERS", computed)
        patch.setattr(report_sections, "experiment_in_background", no_background)
        patch.setattr(Paper, "ledger", lambda *_, **__: CLAIMS)
        patch.setattr(Paper, "headlines", lambda *_: HEADLINES)
        paper = find_paper("bureau2000")
        contents = paper.contents.model_copy(update={"summary": WORDS})
        patch.setitem(vars(paper), "contents", contents)
        summary = reproduce(
            paper, out, progress=lambda *step: steps.append(step), data=points_file(out.parent)
        )
    return out, summary, steps


class Page(HTMLParser):
    """Elements of a page; closing tags must match."""

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


def test_the_folder_has_all_files_and_no_others(report):
    out, _, _ = report
    written = sorted(str(p.relative_to(out)) for p in out.rglob("*") if p.is_file())
    pictures = [f"figures/{n}.{kind}" for n in FIGURES + VIRTUAL for kind in ("pdf", "png")]
    tables = [f"data/{name}.csv" for name in DRAWN]
    tables += [f"data/{name}{part}.csv" for name in VIRTUAL for part in ("", "-model")]
    others = ["agreement.json", "claims.csv", "claims.json", "data/points.csv", "index.html"]
    assert written == sorted([*others, *pictures, *tables])
    assert sorted(p.name for p in out.parent.iterdir()) == ["artificial.csv", "report"]


def test_files_have_the_permissions_of_the_umask(report):
    umask = os.umask(0)
    os.umask(umask)
    for file in (p for p in report[0].rglob("*") if p.is_file()):
        assert file.stat().st_mode & 0o777 == 0o666 & ~umask, file


def test_pictures_are_png_and_undated_pdf(report):
    for name in FIGURES + VIRTUAL:
        assert (report[0] / "figures" / f"{name}.png").read_bytes()[1:4] == b"PNG"
        pdf = (report[0] / "figures" / f"{name}.pdf").read_bytes()
        assert pdf.startswith(b"%PDF")
        assert b"CreationDate" not in pdf


@pytest.mark.parametrize("name", DRAWN)
def test_the_head_of_a_table_has_parameters_and_columns(report, name):
    path = report[0] / "data" / f"{name}.csv"
    head = [x for x in path.read_text(encoding="utf-8").splitlines() if x.startswith("#")]
    assert any("asperity" in line for line in head)
    assert any("D0 = 0.4 +- 0.04 um (published)" in line for line in head)
    data = pd.read_csv(path, comment="#")
    period = ["curve", "law", "inertia", "phase", "load", "force", "velocity"]
    period += ["plastic_velocity", "age"]
    assert list(data.columns) == (period if name == "figure-13" else COLUMNS)
    assert all(any(line.startswith(f"#   {c}: ") for line in head) for c in data.columns)
    assert name == "figure-13" or data["converged"].all()


@pytest.mark.parametrize("name", VIRTUAL)
def test_the_head_of_a_virtual_table_says_that_it_is_simulated(report, name):
    for part, columns in (("", FIGURE_WORDS.point_column), ("-model", COLUMNS)):
        path = report[0] / "data" / f"{name}{part}.csv"
        text = path.read_text(encoding="utf-8")
        assert text.startswith("# SIMULATED")
        assert "no measured points" in text.splitlines()[0]
        head = [line for line in text.splitlines() if line.startswith("#")]
        for series in all_series():
            if series.name in set(pd.read_csv(path, comment="#").get("series", [])):
                seeds = ", ".join(map(str, series.seeds))
                assert any(f"{series.name}, " in x and f"seeds {seeds};" in x for x in head)
        assert any("B = 0.02 (stated 0.026 +- 0.01)" in line for line in head)
        assert list(pd.read_csv(path, comment="#").columns) == list(columns)
        assert all(any(line.startswith(f"#   {c}: ") for line in head) for c in columns)


def test_the_page_says_that_the_virtual_experiment_is_simulated(page, report):
    text = "".join(page.text)
    section = text[text.index("A virtual experiment", text.index("Figures")) :]
    assert "Simulated." in section
    assert "nothing here stands for them" in section
    assert "Factor on ε that makes air and vacuum collapse" in section
    alts = [image["alt"] for image in page.all("img")]
    assert sum(alt.startswith("Simulated: ") for alt in alts) == len(VIRTUAL)
    for name in VIRTUAL:
        assert name in [a.get("id") for _, a in page.elements]


def test_claims_are_written_as_json_and_csv(report):
    record = json.loads((report[0] / "claims.json").read_text(encoding="utf-8"))
    assert record["counts"]["test"] == {"reproduced": 1, "misprint": 1, "differs": 1}
    assert record["counts"]["arithmetic"] == {"reproduced": 1, "misprint": 0, "differs": 0}
    assert record["claims"][0]["statement"] == CLAIMS[0].statement
    assert record["claims"][0]["numbers"] == {"value": 0.2}
    (varied,) = record["claims"][0]["sensitivity"]
    assert varied["numbers"] == {"value": [0.1, 0.3]}
    assert varied["verdicts"] == ["differs", "reproduced"]
    assert set(record["uncertainties"]) == {"A", "B", "D0", "lambda", "h0"}
    with (report[0] / "claims.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["id"] for row in rows] == ["a-1", "b-2", "c-3", "d-4"]
    assert rows[0]["why"] == 'so "it" is'


def test_the_summary_counts_figures_points_and_claims(report, figures):
    out, summary, _ = report
    assert (summary.folder, summary.page) == (out, out / "index.html")
    assert (summary.figures, summary.failed) == (len(FIGURES + VIRTUAL), 0)
    solved = sum(len(figures[name].data) for name in DRAWN if name != "figure-13")
    lines = [pd.read_csv(out / "data" / f"{name}-model.csv", comment="#") for name in VIRTUAL]
    assert summary.points == solved + sum(map(len, lines)) > 2000
    text = "\n".join(summary.lines())
    assert "4, of which 3 tests: 1 reproduced, 1 misprint, 1 differs" in text
    assert text.count("The mean falls") == 2


def test_progress_counts_up_to_its_total(report):
    _, _, steps = report
    done = [step for step, _, _ in steps]
    total = steps[0][1]
    assert done == sorted(set(done))
    assert (done[0], done[-1]) == (0, total)
    assert {t for _, t, _ in steps} == {total}


def test_the_page_is_valid_html(page):
    assert page.open == []
    names = [a["id"] for _, a in page.elements if "id" in a]
    assert len(names) == len(set(names))
    assert page.all("html")[0]["lang"] == "en"
    assert all(h["scope"] == "col" for h in page.all("th"))
    assert [name for name in FIGURES + VIRTUAL if name not in names] == []


def test_the_page_is_self_contained(page, report):
    assert page.all("script") == page.all("link") == page.all("iframe") == []
    assert all(image["src"].startswith("data:image/png;base64,") for image in page.all("img"))
    assert len(page.all("img")) == len(FIGURES + VIRTUAL + list(LAWS))
    style_text = files("asperity.outputs").joinpath("page.css").read_text(encoding="utf-8")
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


def test_every_picture_has_an_alternative_text(page):
    assert all(image["alt"].strip() for image in page.all("img"))


def test_the_page_has_every_claim_once_and_misprints_in_the_summary(page):
    text = "".join(page.text)
    statement = "The mean falls by <20 %> & more at εeff = 0.24."
    statement = statement.replace(" %", "\u00a0%").replace("eff = ", "eff\u00a0=\u00a0")
    assert text.count(statement) == 5
    entries = [a for a in page.all("details") if "claim" in a["class"]]
    assert [a["id"] for a in entries] == ["a-1", "b-2", "c-3", "d-4"]
    assert [a["class"] for a in entries] == [
        "claim reproduced test",
        "claim misprint test",
        "claim differs test",
        "claim reproduced apart",
    ]
    assert "Counted apart: 1 calculation with printed numbers" in text
    assert "differs at A" in text


def test_the_summary_comes_first_and_links_to_its_claims(page):
    text = "".join(page.text)
    titles = ["The answer in five sentences", "What is wrong in print", "What inertia does",
              "What stays open", "The paper’s conclusions"]  # fmt: skip
    places = [text.index(title) for title in titles]
    assert places == sorted(places)
    assert places[-1] < text.index("The set-up")
    linked = [a["href"] for a in page.all("a")]
    figures = [linked.index(f"#{name}") for name in LAWS]
    assert figures == [*range(figures[0], figures[0] + len(LAWS))]
    assert places[0] < text.index("The three laws on common axes") < places[1]
    assert linked.count("#b-2") >= 2
    assert {"#show-reproduced", "#show-misprint", "#show-differs"} <= set(linked)


def test_the_page_has_every_conclusion(page):
    text = "".join(page.text)
    for headline in HEADLINES:
        assert headline.claim in text
        assert headline.standing in text


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
def test_plain_text_is_typeset(plain, shown):
    assert rich(plain).replace("<sup>−", "<sup>-") == shown


def test_pictures_drawn_twice_have_the_same_bytes(tmp_path):
    contents = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        with style():
            written = [save_picture(schematics.draw(n), folder / n) for n in SCHEMATICS]
        contents.append([path.read_bytes() for pair in written for path in pair])
    assert contents[0] == contents[1]


def test_a_file_in_place_of_the_folder_is_refused_and_kept(tmp_path):
    (tmp_path / "taken").write_text("mine")
    for out in (tmp_path / "taken", tmp_path / "taken" / "report"):
        with pytest.raises(InputError, match="out must be a folder that can be written") as refused:
            reproduce(find_paper("bureau2000"), out)
        assert "\n" not in str(refused.value)
    assert (tmp_path / "taken").read_text() == "mine"
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]


def _luminance(colour):
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", [0, 1], ids=["light", "dark"])
def test_colours_of_text_have_enough_contrast(theme):
    css = files("asperity.outputs").joinpath("page.css").read_text(encoding="utf-8")
    block = re.findall(r":root \{(.*?)\}", css, re.S)[theme]
    colour = dict(re.findall(r"--([\w-]+): (#\w{6})", block))
    pairs = [(c, back) for c in ("ink", "soft", "link") for back in ("page", "card")]
    pairs += [(c, f"{c}-back") for c in ("good", "print", "bad")]
    for text, back in pairs:
        low, high = sorted(_luminance(colour[c]) for c in (text, back))
        assert (high + 0.05) / (low + 0.05) >= 4.5, (text, back)
