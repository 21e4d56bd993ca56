"""A second paper is one folder and an entry point: nothing of the package changes for it."""

import importlib
import json
import shutil
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from asperity.app.api import paper as paper_tab
from asperity.cli.main import main
from asperity.errors import InputError
from asperity.ledger import available, find_paper
from references.commands import refused

TOY = Path(__file__).parent / "toy2020"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The toy paper as an installed distribution that registers it."""
    site = tmp_path / "site"
    shutil.copytree(TOY, site / "toy_papers_2020")
    metadata = site / "toy_papers-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-papers\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text("[asperity.papers]\ntoy2020 = toy_papers_2020\n")
    monkeypatch.syspath_prepend(str(site))
    importlib.invalidate_caches()
    for name in [name for name in sys.modules if name.startswith("toy_papers_2020")]:
        monkeypatch.delitem(sys.modules, name)
    return site / "toy_papers_2020"


def changed(file, old, new):
    """Replace a part of a file of the paper."""
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_papers_are_found_in_their_folders_and_by_entry_points(installed):
    assert {"bureau2000", "toy2020"} <= set(available())
    assert find_paper("toy2020").contents.paper.short == "Toy (2020)"
    with pytest.raises(InputError, match=r"got 'toy2002'; did you mean 'toy2020'\?"):
        find_paper("toy2002")


def test_the_name_of_a_paper_is_a_text():
    with pytest.raises(TypeError, match="name must be a text or None, got 3"):
        find_paper(3)


def test_verdicts_and_conclusions_of_the_second_paper(installed):
    paper = find_paper("toy2020")
    frequency, weight = claims = paper.ledger(sensitivity=True)
    assert frequency.numbers == {"frequency": pytest.approx(1.5915494)}
    assert (frequency.verdict, weight.verdict) == ("reproduced", "differs")
    (varied,) = frequency.sensitivity
    assert varied.numbers["frequency"] == pytest.approx((1.50987, 1.66924), abs=1e-4)
    assert varied.verdicts == ("differs", "reproduced")
    (headline,) = paper.headlines(claims)
    assert headline.standing == "holds at the central values"
    assert headline.result == "1.592 Hz."


def test_the_second_paper_is_reproduced_by_its_name(installed, tmp_path):
    out = tmp_path / "report"
    shown = CliRunner().invoke(main, ["reproduce", "toy2020", "--out", str(out)])
    assert shown.exit_code == 0, shown.output
    assert "Toy (2020), reproduced by asperity" in shown.output
    assert "solved" not in shown.output  # its figure shows instants, and no operating point
    files = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    pictures = {"figures/swing.png", "figures/swing.pdf", "data/swing.csv"}
    assert files == {"index.html", "claims.json", "claims.csv", *pictures}
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "A block on a spring" in page
    assert "Bureau" not in page
    record = json.loads((out / "claims.json").read_text(encoding="utf-8"))
    assert record["counts"]["test"]["reproduced"] == 1


def test_the_page_of_the_browser_has_the_second_paper_by_its_name(installed):
    overview = paper_tab.overview(paper_tab.ChosenPaper(paper="toy2020"))
    assert {"name": "toy2020", "short": "Toy (2020)"} in overview["papers"]
    assert overview["paper"]["title"] == "A block on a spring"
    assert overview["figures"] == []  # none that can be moved
    sent = []
    answer = paper_tab.ledger({"paper": "toy2020"}, lambda **message: sent.append(message))
    assert [claim["computed"] for claim in answer["claims"]] == ["1.592 Hz", "9.8 N"]
    assert sent[-1] == {"finished": 2, "total": 2}
    assert find_paper().name == "bureau2000"  # the first in alphabetical order


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('id = "weight"', 'id = "frequency"', "claim.id must be unique, got 'frequency' twice"),
        ('claims = ["frequency"]', 'claims = ["mass"]', "must name claims of the file, got 'mass'"),
        ('result = "{frequency}."', 'result = "{mass}."', "result must name claims .*got 'mass'"),
        ('depends_on = ["K"]', 'depends_on = ["M"]', "must name an uncertainty of the file"),
        ('kind = "test"', 'kind = "guess"', "kind must be one of test, fit, arithmetic, identity"),
        ("[[claim]]", "[[claim]", "must be valid TOML"),
    ],
)
def test_a_mistake_in_the_words_is_refused(installed, old, new, message):
    changed(installed / "claims.toml", old, new)
    with pytest.raises(InputError, match=message):
        _ = find_paper("toy2020").contents


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("9.80665 * numbers.M", "1 / 0", "'weight' must be code that runs"),
        ("9.80665", "float('nan')", "must compute finite numbers, got nan"),
        ('{"weight": 9.80665 * numbers.M}', "9.8", "that returns numbers by name"),
        ("import math", "import nothing_here", "toy_papers_2020.checks must be code"),
    ],
)
def test_a_mistake_in_the_checks_is_one_sentence(installed, old, new, message):
    changed(installed / "checks.py", old, new)
    with pytest.raises(InputError, match=message):
        find_paper("toy2020").ledger()


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("claims.toml", "{weight:.1f}", "{wight:.1f}", "got '{wight}'; did you mean 'weight'?"),
        (
            "figures.py",
            "return figure_words",
            "return 1 or figure_words",
            "swing must be a PaperFigure",
        ),
        ("figures.py", '"block", "t"', '"ball", "t"', "curves must be computed, got 'block'"),
        ("figures.toml", 'color = "grey"', 'colour = "grey"', "draw must be code that"),
        ("figures.toml", 'y = "x"', 'z = "x"', "swing.plot.panel.0.y must be given"),
        ("figures.toml", "{frequency:.1f}", "{period:.1f}", "got '{period}'"),
        ("figures.py", "FIGURES = (swing,)", "FIGURES = swing", "must have FIGURES, a tuple of"),
    ],
)
def test_a_mistake_of_a_figure_or_sentence_is_one_line(
    installed, tmp_path, file, old, new, message
):
    changed(installed / file, old, new)
    out = tmp_path / "report"
    refused(CliRunner().invoke(main, ["reproduce", "toy2020", "--out", str(out)]), message)
    assert not out.exists()


def test_a_paper_with_the_name_of_another_is_refused(installed):
    points = installed.parent / "toy_papers-1.dist-info" / "entry_points.txt"
    points.write_text("[asperity.papers]\nbureau2000 = toy_papers_2020\n")
    importlib.invalidate_caches()
    with pytest.raises(InputError, match="a name that no other has, got 'bureau2000'"):
        available()
