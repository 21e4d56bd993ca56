"""The documentation has every name that a user can type; its links resolve, its examples run."""

import base64
import dataclasses
import doctest
import importlib
import inspect
import json
import re
import sys
import tomllib
from pathlib import Path

import matplotlib as mpl
import pytest

import asperity
import asperity as asp
from asperity import materials
from asperity.cli.main import main
from asperity.laws import law_parameters, registered
from asperity.orbit import PeriodicResponse

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = {p.relative_to(DOCS).as_posix(): p.read_text(encoding="utf-8") for p in DOCS.rglob("*.md")}
PAGES = {name: text for name, text in PAGES.items() if not name.startswith("_build")}
README = (ROOT / "README.md").read_text(encoding="utf-8")
API = "\n".join(text for name, text in PAGES.items() if name.startswith("api/"))
#: Laws of the package, without those that other tests have registered.
LAWS = sorted(n for n, law in registered().items() if law.__module__.startswith("asperity."))


def code(text: str) -> set[str]:
    """Words inside backticks."""
    return {
        word for part in re.findall(r"`([^`\n]+)`", text) for word in re.findall(r"[\w-]+", part)
    }


def options(name: str) -> list[str]:
    module = importlib.import_module(main.modules[name])
    # Hidden options only exist to be refused with a sentence.
    visible = [p for p in getattr(module, name).params if not getattr(p, "hidden", False)]
    return [option for p in visible for option in p.opts if option[0] == "-"]


@pytest.mark.parametrize("law", LAWS)
def test_every_law_is_documented(law) -> None:
    for text in (README, *(PAGES[p] for p in ("getting_started.md", "command_line.md"))):
        assert law in code(text)
    assert f"`{law}`" in PAGES["theory/equations.md"]
    assert f"asperity.laws.{registered()[law].__name__}" in API


def generated_names(which: str) -> set[str]:
    """Names in a table of the page of nomenclature, which an extension writes."""
    assert f"{{parameters}} {which}" in PAGES["nomenclature.md"]
    folder = str(DOCS / "_ext")
    sys.path.insert(0, folder)
    try:
        rows = importlib.import_module("parameter_rows").table(which)
    finally:
        sys.path.remove(folder)
    assert {len(row) for row in rows} == {len(rows[0])}
    return code(" ".join(cell for row in rows for cell in row))


@pytest.mark.parametrize("law", LAWS)
def test_the_nomenclature_has_every_parameter_of_a_law(law) -> None:
    assert set(law_parameters(registered()[law])) <= generated_names("interface")


def test_the_nomenclature_has_the_response_and_the_machine() -> None:
    results = {"mean_friction", "delta_mu", "mu1", "mu2", "phase1", "phase2", "multipliers"}
    assert results <= generated_names("outputs")
    assert {"K", "M", "W0", "V", "epsilon", "frequency"} <= generated_names("experiment")
    assert "omega" in code(PAGES["nomenclature.md"])


def test_every_test_named_by_the_page_of_proofs_exists() -> None:
    page = PAGES["what_is_proven.md"]
    rows = [row.split(" | ")[2] for row in page.splitlines() if row.count(" | ") == 3]
    named = {name for row in rows for name in re.findall(r"`([\w/]+(?:\.py)?)`", row)}
    assert len(named) > 30
    assert {name for name in named if not (ROOT / "tests" / name).exists()} == set()
    rooms = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir()}
    assert {name.split("/")[0] for name in named} <= rooms | {"test_architecture.py"}
    for name in re.findall(r"`benchmarks\.(\w+)`", page):
        assert (ROOT / "benchmarks" / f"{name}.py").is_file()


@pytest.mark.parametrize("command", sorted(main.modules))
def test_every_command_and_option_is_documented(command) -> None:
    page = PAGES["command_line.md"]
    assert f"## asperity {command}" in page
    sections = [p for p in re.split(r"^## ", page, flags=re.M) if f"asperity {command}" in p]
    named = set(re.findall(r"(?<![\w-])--?[\w-]+", "\n".join(sections)))
    assert set(options(command)) <= named
    assert f"asperity {command}" in README


@pytest.mark.parametrize(
    "name", sorted(n for n in asperity.__all__ if callable(getattr(asperity, n)))
)
def test_every_public_name_is_in_the_reference(name) -> None:
    assert re.search(rf":: asperity\.{name}\b", API)


@pytest.mark.parametrize("room", ["air", "laws", "materials", "orbit", "parameters", "units"])
def test_every_public_name_of_a_room_is_in_the_reference(room) -> None:
    module = importlib.import_module(f"asperity.{room}")
    named = set(re.findall(rf":: asperity\.(?:{room}\.)?(\w+)", API))
    # A type alias has no page.
    assert set(module.__all__) - {"State"} <= named | {"KINDS"}


@pytest.mark.parametrize(
    "field",
    sorted(
        {f.name for f in dataclasses.fields(PeriodicResponse)} - {"detail"}
        | {n for n, v in vars(PeriodicResponse).items() if isinstance(v, property)}
    ),
)
def test_every_attribute_of_a_response_is_described(field) -> None:
    assert field in code(PAGES["results.md"])


def test_every_material_is_documented() -> None:
    for name in materials.available():
        assert name in PAGES["command_line.md"]


def test_every_page_is_in_the_contents() -> None:
    listed = re.findall(r"^([\w/]+)$", PAGES["index.md"], re.M)
    assert sorted(f"{name}.md" for name in listed) == sorted(set(PAGES) - {"index.md"})


def test_links_of_the_readme_lead_to_files() -> None:
    targets = re.findall(r"\]\(([^)#]+)\)", README) + re.findall(r'src="([^"]+)"', README)
    local = [t for t in targets if "://" not in t]
    assert len(local) > 8
    assert [t for t in local if not (ROOT / t).exists()] == []


def test_pictures_are_used_and_small() -> None:
    for picture in (DOCS / "images").glob("*.png"):
        assert any(picture.name in page for page in (README, *PAGES.values()))
        assert picture.stat().st_size < 150_000


def test_the_version_is_the_same_everywhere() -> None:
    version = asperity.__version__
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_vision_has_ten_numbered_lines() -> None:
    text = (ROOT / "VISION.md").read_text(encoding="utf-8")
    assert re.findall(r"^(\d+)\.", text, re.M) == [str(n) for n in range(1, 11)]


@pytest.fixture
def extension(monkeypatch):
    """A function that imports a module of docs/_ext; skips the test where Sphinx is missing."""

    def load(name: str):
        pytest.importorskip("sphinx")
        monkeypatch.syspath_prepend(str(DOCS / "_ext"))
        monkeypatch.delitem(sys.modules, name, raising=False)
        return importlib.import_module(name)

    return load


def test_a_planted_asset_of_another_site_is_detected(extension) -> None:
    foreign = extension("offline").foreign_assets
    assert foreign('<script src="https://example.org/x.js"></script>')
    assert foreign('<link rel="stylesheet" href="//example.org/x.css">')
    assert foreign("@font-face{src:url(https://example.org/x.woff2)}")
    assert not foreign('<a href="https://example.org">a link</a><script src="_static/x.js">')
    assert not foreign('<link rel="canonical" href="https://example.org/"><img src="x.png">')


def test_special_characters_of_docstrings_are_escaped(extension) -> None:
    escaped = extension("docstrings").escaped
    assert escaped(["mu = |c_1|, lambda_ of `lambda_`"]) == [r"mu = \|c_1\|, lambda\_ of `lambda_`"]
    assert escaped(["lambda_ : |x|"]) == [r"lambda_ : \|x\|"]
    literal = ["Eq.::", "", "    F = |x|", "", "after |x|"]
    assert escaped(literal) == [*literal[:-1], r"after \|x\|"]


def test_formulas_become_mathml_and_unknown_commands_are_reported(extension, caplog) -> None:
    pytest.importorskip("latex2mathml")
    module = extension("mathml")
    assert module.to_mathml(r"\arg c_n", display=False).startswith("<math")
    warnings = []
    module._log = type("Log", (), {"warning": lambda self, *a, **k: warnings.append(a)})()
    module.to_mathml(r"\nosuchcommand x", display=True)
    assert warnings


def test_a_tutorial_becomes_a_notebook_with_its_text_and_python(extension) -> None:
    page = PAGES["tutorials/vibration.md"]
    made = json.loads(extension("notebooks").notebook(page, DOCS / "tutorials"))
    assert (made["nbformat"], {c["cell_type"] for c in made["cells"]}) == (4, {"code", "markdown"})
    code_cells = ["".join(c["source"]) for c in made["cells"] if c["cell_type"] == "code"]
    assert code_cells == [
        body.rstrip("\n") for body in re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)
    ]
    text = "\n".join("".join(c["source"]) for c in made["cells"] if c["cell_type"] == "markdown")
    assert "# Lowering friction by vibration" in text
    assert "asperity measure recording.csv" in text
    # The printed text after a block is the output of its cell.
    assert "35.2 %" not in text
    (first, *_) = [c for c in made["cells"] if c["cell_type"] == "code"]
    assert "35.2 %" in "".join(first["outputs"][0]["text"])
    attached = [c["attachments"] for c in made["cells"] if "attachments" in c]
    picture = base64.b64decode(attached[0]["vibration.png"]["image/png"])
    assert picture == (DOCS / "images" / "vibration.png").read_bytes()


def test_the_gallery_links_every_tutorial() -> None:
    gallery = PAGES["tutorials/gallery.md"]
    for name, text in PAGES.items():
        if name.startswith("tutorials/") and name != "tutorials/gallery.md":
            page = name.removeprefix("tutorials/").removesuffix(".md")
            assert f"{{doc}}`{page}`" in gallery
            assert (f'href="{page}.ipynb"' in gallery) == ("```python" in text)


def test_outside_the_repository_the_readme_has_no_links_into_it() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    hook = settings["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]
    text = README
    for change in hook["substitutions"]:
        text = re.sub(change["pattern"], change["replacement"], text)
    assert "<img" not in text
    targets = re.findall(r"\]\(([^)]+)\)", text)
    assert [t for t in targets if not t.startswith("https://")] == []
    assert "getting started" in text.lower()


#: An exception, and a function that starts a server, which `tests/app/test_notebook.py` calls.
OTHERS = {"InputError", "explore"}
FUNCTIONS = [n for n in asp.__all__ if callable(getattr(asp, n)) and n not in OTHERS]


@pytest.mark.long
@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_example_of_a_function_runs(name, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    examples = doctest.DocTestParser().get_examples(inspect.getdoc(getattr(asp, name)) or "")
    assert examples
    namespace: dict[str, object] = {}
    for example in examples:
        exec(compile(example.source, f"help({name})", "single"), namespace)
