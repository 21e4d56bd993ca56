"""Every runnable part of the README and of the pages runs, and prints what the page shows."""

import csv
import json
import math
import re
import runpy
import tomllib
from pathlib import Path

import matplotlib as mpl
import pytest
from click.testing import CliRunner

from asperity.cli.main import main
from asperity.inference.design.plan import plan_of
from asperity.laws import registry
from asperity.questions.recording import ReadingRecipe
from asperity.study.plan import SweepPlan, plan_record
from references import snippets as pages

ROOT = pages.ROOT
#: Pages whose code takes more than about three seconds. Other tests prove their content in every
#: run: fits of the same recording and of tables (`tests/inference`), folds, bifurcations and
#: boundaries (`tests/branches`), inertia and other loads (`tests/orbit`), maps (`tests/study`),
#: laws and loads of one's own (`tests/laws`, `tests/examples`), experiments (`tests/protocol`,
#: `tests/cli`), stick-slip (`tests/experiment`, `tests/measurement`).
SLOW = {
    "docs/tutorials/python.md",
    "docs/tutorials/velocity_step.md",
    *("docs/theory/numerical_method.md", "docs/findings.md", "docs/theory/stabilisation.md"),
    *("docs/healing.md", "docs/fitting.md", "docs/theory/continuation.md"),
    *("docs/tutorials/faults_and_tides.md", "docs/tutorials/vibration.md", "docs/modulations.md"),
    *("docs/theory/inertia.md", "docs/stick_slip.md", "docs/write_your_own_load.md"),
    *("docs/write_your_own_law.md", "docs/running_experiments.md", "docs/results.md"),
}
#: Pages that `tests/papers/bureau2000/test_claims.py` runs, with its computed ledger.
ELSEWHERE = {"docs/claims.md"}


def named(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


RUNNABLE = [p for p in pages.PAGES if pages.snippets(p) and named(p) not in ELSEWHERE]


def invoke(*arguments: str):
    result = CliRunner().invoke(main, list(arguments), prog_name="asperity")
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """An empty folder, a separate registry of laws, and no windows for figures."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))
    mpl.use("agg")
    # No progress lines, however slow the machine is.
    monkeypatch.setattr("asperity.cli.progress._IN_LOG", math.inf)
    return tmp_path


def run_python(snippet, namespace, capsys, where) -> None:
    capsys.readouterr()
    exec(compile(snippet.text, where, "exec"), namespace)
    printed = capsys.readouterr().out
    assert pages.difference(snippet.prints or "", printed) == "", f"{where}\n{printed}"


def run_console(snippet, where, capsys, included) -> None:
    for command in pages.commands(snippet.text):
        program, *arguments = command.arguments
        if program == "asperity" and arguments[0] == "reproduce":
            # tests/papers proves the command, which takes half a minute; here options are parsed.
            import asperity.cli.papers as module

            module.reproduce.make_context("reproduce", arguments[1:])
        elif program == "asperity":
            result = invoke(*arguments)
            assert result.exit_code == command.exit_code, f"{where}: {result.output}"
            assert pages.difference(command.prints, result.output) == "", (
                f"{where}\n{result.output}"
            )
        elif program == "make":
            makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
            for target in arguments:
                assert re.search(rf"^{target}:", makefile, re.M), f"{where}: no make {target}"
        elif program == "python":
            capsys.readouterr()
            script = ROOT / arguments[0]
            if script in included:  # programs of its class are compiled
                included[script]["main"]()
            else:
                runpy.run_path(str(script), run_name="__main__")
            printed = capsys.readouterr().out
            assert pages.difference(command.prints, printed) == "", f"{where}\n{printed}"
        else:
            pytest.fail(f"{where}: no test runs '{program}'")


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(p, id=named(p), marks=pytest.mark.long if named(p) in SLOW else ())
        for p in RUNNABLE
    ],
)
def test_the_code_of_a_page_prints_what_it_shows(page, workplace, capsys) -> None:
    namespace, included = {"__name__": "page"}, {}
    for snippet in pages.snippets(page):
        where = f"{named(page)}:{snippet.line}"
        if snippet.kind == "python":
            run_python(snippet, namespace, capsys, where)
        elif snippet.kind == "console":
            run_console(snippet, where, capsys, included)
        elif snippet.kind == "file":
            (workplace / snippet.name).write_text(snippet.text, encoding="utf-8")
        elif snippet.name.endswith(".py"):
            script = (page.parent / snippet.name).resolve()
            included[script] = runpy.run_path(str(script))
            namespace |= {k: v for k, v in included[script].items() if not k.startswith("__")}


def plans(page: str):
    """Contents of the `toml` blocks of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [tomllib.loads(b) for b in re.findall(r"^```toml\n(.*?)^```$", text, re.M | re.S)]


def test_plans_of_designs_and_recipes_on_pages_are_valid() -> None:
    (plan,) = plans("docs/design.md")
    assert plan_of(plan, require_unit=True).budget == plan["points"]
    (recipe,) = plans("docs/reading_recordings.md")
    assert ReadingRecipe(**recipe).title == recipe["title"]


def test_plans_of_sweeps_on_pages_are_valid(workplace) -> None:
    table = "V,epsilon,frequency,mu1,mu1_err\n1e-6,0.1,120,1e-3,1e-5\n1e-6,0.2,120,2e-3,1e-5\n"
    for name in ("readings", "monday", "tuesday"):
        (workplace / f"{name}.csv").write_text(table)
    numbers = {"V": "1 um/s", "frequency": "120 Hz", "epsilon": 0.2}
    base = {"law": "elasto-plastic", "material": "bureau2000", "axes": {"mu0": {"values": [0.3]}}}
    fits = {}
    for part in plans("docs/sweeps.md"):
        if part.get("solve") == "fit":  # later parts belong to the same plan
            fits = part
        whole = base | fits | part
        if "data" in whole["axes"]:
            whole["fit"] = {n: v for n, v in whole["fit"].items() if n != "data"}
        taken = set(whole["axes"])
        for axis in whole["axes"].values():
            taken |= {*axis.get("zip", {}), *axis.get("over", {})}
        if part.get("solve") == "transient":  # no step of the page modulates the load
            taken |= {"epsilon", "frequency"}
        plan = whole | {"parameters": {n: v for n, v in numbers.items() if n not in taken}}
        assert set(plan_record(SweepPlan(**plan))["axes"]) == set(whole["axes"])


def documented(page: str, head: str) -> set[str]:
    """Names in the first column of the table that follows `head`."""
    text = (ROOT / page).read_text(encoding="utf-8").partition(head)[2]
    table = re.search(r"(?:^\|.*\n)+", text, re.M)[0].splitlines()[2:]
    return {name for row in table for name in re.findall(r"`([^`]+)`", row.split("|")[1])}


POINT = ("--law", "rice-ruina", "--material", "bureau2000", "-V", "1 um/s", "-e", "0.24")


def test_json_keys_of_a_response_are_those_of_the_page() -> None:
    record = json.loads(invoke("response", *POINT, "-f", "120 Hz", "--json").stdout)
    assert documented("docs/command_line.md", "Keys of the JSON") == set(record)


def test_json_keys_of_the_air_are_those_of_the_page() -> None:
    record = json.loads(invoke("air", "--material", "bureau2000", "-f", "120 Hz", "--json").stdout)
    text = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"`(\w+)`", text.partition("JSON keys\nare")[2].partition("\n\n")[0]))
    assert listed == set(record) | set(record["points"][0])


def test_result_columns_of_a_table_are_those_of_the_page(workplace) -> None:
    Path("in.csv").write_text("law,V,epsilon,frequency\nrice-ruina,1e-6,0.24,120\n")
    invoke("response", "--table", "in.csv", "--out", "out.csv", "--material", "bureau2000")
    with Path("out.csv").open(encoding="utf-8") as file:
        columns = next(csv.reader(file))
    listed = documented("docs/command_line.md", "The output has the columns of the input")
    assert listed - {"converged"} == set(columns[4:]) - {"converged"}
    assert "converged" in columns


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("a 1.000", "a 1.001"),
        ("a 1.2e-09 b", "a 1.3e-09 b"),
        ("...\nend 2", "x\ny\nend 2"),
        ("x ...\nend", "x 12 y\nend"),
        ("a   b", "a b\n\n"),
        ("-23%", "-23%"),
    ],
)
def test_equal_outputs_have_no_difference(shown, printed) -> None:
    assert pages.difference(shown, printed) == ""


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("a 1.000", "a 1.002"),
        ("a 1.2e-09", "a 1.4e-09"),
        ("a 1.2e-09", "a 1.2e-08"),
        ("a", "b"),
        ("a", "a\nb"),
        ("a\nb", "a"),
        ("", "a"),
        ("...\nend 2", "x\nend 3"),
        ("-23%", "-28%"),
        ("True", "False"),
    ],
)
def test_planted_differences_are_detected(shown, printed) -> None:
    assert pages.difference(shown, printed)


def test_a_planted_snippet_is_found(tmp_path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "x\n\n```python\nprint(1)\n```\n\n```text\n2\n```\n\n"
        "```console\n$ asperity --version  # exit 2\nno\n```\n",
        encoding="utf-8",
    )
    first, second = pages.snippets(page)
    assert (first.kind, first.prints, first.line) == ("python", "2\n", 3)
    (command,) = pages.commands(second.text)
    assert command == pages.Command(["asperity", "--version"], "no\n", 2)
