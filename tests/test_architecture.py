"""Rooms, the folders of the package, import in one direction; no file has details of a machine."""

import ast
import importlib
import re
import shutil
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "asperity"

#: Rooms that every room may import.
_BASE = {"arrays", "_jax", "_lazy", "_processes", "_version", "errors", "outputs"}
_BASE |= {"parameters", "units"}
_EQUATIONS = _BASE | {"laws", "loads", "slider"}
_SOLVERS = {"algebra", "theory", "orbit", "branches", "transients"}
_SIGNALS = {"recording", "lock_in", "measurement", "tribometer"}
_RESULTS = _EQUATIONS | _SOLVERS | _SIGNALS | {"air", "materials", "questions"}
_STUDIES = {"experiment", "protocol", "samples", "study"}

#: The rooms, and what each may import besides itself.
MAY_IMPORT: dict[str, set[str]] = {
    "_version": set(),
    "arrays": set(),
    "_jax": set(),
    "_lazy": set(),
    "_processes": {"errors"},
    "errors": set(),
    "units": {"errors", "_lazy"},
    "outputs": {"errors", "_lazy", "_version", "parameters"},  # files of any content
    "parameters": {"errors", "units", "_lazy"},  # reads fields that laws declare
    "questions": _BASE | {"loads"},  # knows nothing of how they are answered
    "algebra": {"arrays", "_jax"},
    "laws": _BASE,  # knows no springs, no loads, no numbers of any paper
    "loads": _BASE,  # knows no laws
    "air": _BASE,  # knows no friction
    "materials": _BASE | {"laws", "questions"},  # knows no solvers
    "slider": _BASE | {"laws", "loads", "algebra"},  # knows no solvers
    "theory": _EQUATIONS | {"algebra"},
    "transients": _EQUATIONS | {"algebra"},
    "orbit": _EQUATIONS | {"algebra", "theory", "transients"},  # knows no instruments, no files
    "branches": _EQUATIONS | {"algebra", "theory", "orbit"},
    "recording": _BASE | {"questions"},  # knows no laws, no solvers
    "lock_in": _BASE | {"recording"},
    "measurement": _BASE | {"questions", "recording", "lock_in"},
    "tribometer": _BASE | {"recording"},  # is handed a trajectory
    "inference": _EQUATIONS
    | _SIGNALS
    | {"algebra", "materials", "orbit", "transients", "questions"},
    "experiment": _RESULTS,
    "operating_point": _EQUATIONS | {"algebra", "materials", "orbit", "questions"},
    "protocol": _RESULTS | {"experiment", "operating_point"},
    "samples": _BASE | {"operating_point", "protocol", "recording"},
    "study": _RESULTS | {"operating_point", "protocol", "inference"},  # varies all of these
    "figures": _BASE | _SIGNALS | _STUDIES | {"questions"},  # solves nothing
    "fit_report": _RESULTS | {"inference", "figures"},  # a fit as a folder: page, draws, material
    "ledger": _BASE | {"materials", "figures", "questions"},  # knows no paper
    "app": _RESULTS
    | _STUDIES
    | {"inference", "figures", "operating_point", "ledger", "fit_report"},
    "cli": _RESULTS
    | _STUDIES
    | {"inference", "figures", "operating_point", "ledger", "app", "fit_report"},
    "__main__": {"cli"},
    # The package itself imports its rooms lazily, by name.
    "__init__": {"_lazy"},
}

#: The papers: users of the library, found by an entry point.
PAPERS = ROOT / "src" / "asperity_papers"

# Concatenated, so that this file does not match itself.
_HOSTS = ["pypi" + ".org", "files.python" + "hosted", "test.pypi" + ".org"]
_FORBIDDEN = re.compile(
    "|".join(
        [
            *map(re.escape, _HOSTS),
            # An absolute path of the machine that a file was written on.
            r"(?<![\w.$})-])/(?:root|work|home/\w+|Users/\w+)/",
            r"--(?:extra-)?index-url[ =]",
            r"--find-links[ =]",
        ]
    )
)
_TEXT = {".py", ".md", ".toml", ".txt", ".in", ".cff", ".bib", ".rst", ".yml", ".yaml", ".css"}
_TEXT_NAMES = {"Makefile", "LICENSE", "run", ".gitignore"}


def room_of(module: Path, package: Path = PACKAGE) -> str:
    """The room a module lies in: the first part of its path inside the package."""
    return module.relative_to(package).parts[0].removesuffix(".py")


def imported_rooms(module: Path) -> Iterator[tuple[str, int]]:
    """Rooms that a module imports, with the line; imports inside functions count."""
    for node in running_imports(module):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            whole = node.module == "asperity"
            names = [f"asperity.{a.name}" for a in node.names] if whole else [node.module]
        elif isinstance(node, ast.ImportFrom) and node.level > 0:
            # Relative imports hide the direction.
            names = ["asperity.relative-import"]
        else:
            continue
        for name in names:
            head, *rest = name.split(".")
            if head == "asperity":
                yield (rest[0] if rest else "__init__"), node.lineno


@cache
def running_imports(module: Path) -> list[ast.Import | ast.ImportFrom]:
    """Imports of a module that run."""
    nodes = _running(ast.parse(module.read_text(encoding="utf-8")))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that run, without those that only a type checker reads."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            yield from (n for statement in child.orelse for n in (statement, *_running(statement)))
        else:
            yield child
            yield from _running(child)


def wrong_imports(package: Path) -> list[str]:
    """Imports that `MAY_IMPORT` does not allow, as ``file:line: room -> room``."""
    wrong = []
    for module in sorted(package.rglob("*.py")):
        room = room_of(module, package)
        for target, line in imported_rooms(module):
            if target != room and target not in MAY_IMPORT.get(room, set()):
                wrong.append(f"{module.relative_to(package)}:{line}: {room} -> {target}")
    return wrong


def imports_within(room: Path, package: Path = PACKAGE) -> dict[str, set[str]]:
    """For each part of a room, the other parts that it imports."""
    inside = ".".join(("asperity", *room.relative_to(package).parts, ""))
    imports: dict[str, set[str]] = {}
    for module in sorted(room.rglob("*.py")):
        part = room_of(module, room)
        if part == "__init__":
            continue
        parts = imports.setdefault(part, set())
        for node in running_imports(module):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(inside):
                target = (node.module or "").removeprefix(inside).split(".")[0]
                parts |= {target} - {part}
    return imports


def rooms_in_a_cycle(allowed: dict[str, set[str]]) -> set[str]:
    """Rooms that import each other in a cycle, and rooms that import these."""
    remaining = dict(allowed)
    while leaves := [room for room, others in remaining.items() if not others & set(remaining)]:
        for room in leaves:
            del remaining[room]
    return set(remaining)


def private_names(source: str) -> list[str]:
    """Imports of names of the library that are not public, with the line.

    Public are the package, its rooms, and the names that a room lists in ``__all__``.
    """
    rooms = importlib.import_module("asperity").__all__
    private = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [a.name for a in node.names if a.name.startswith("asperity.")]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "asperity":
            module = node.module or ""
            is_public = module == "asperity" or module.removeprefix("asperity.") in rooms
            listed = importlib.import_module(module).__all__ if is_public else ()
            names = [f"{module}.{a.name}" for a in node.names if a.name not in listed]
        else:
            continue
        private += [f"{node.lineno}: {name}" for name in names]
    return private


def repository_files() -> list[Path]:
    """Text files of the repository, new ones included."""
    if shutil.which("git") and (ROOT / ".git").exists():
        listed = subprocess.run(
            ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split("\0")
        files = [ROOT / name for name in listed if name]
    else:
        files = [
            f
            for top in ("src", "tests", "docs", "examples", "benchmarks", "requirements")
            for f in (ROOT / top).rglob("*")
        ] + list(ROOT.glob("*"))
    return [f for f in files if f.is_file() and (f.suffix in _TEXT or f.name in _TEXT_NAMES)]


def test_rooms_import_in_one_direction() -> None:
    assert wrong_imports(PACKAGE) == []


def test_every_room_has_an_entry_in_the_table_of_imports() -> None:
    rooms = {room_of(module) for module in PACKAGE.rglob("*.py")}
    assert rooms <= set(MAY_IMPORT)
    assert {"errors", "units", "laws", "materials"} <= rooms


def test_the_table_of_imports_has_no_cycle() -> None:
    assert rooms_in_a_cycle(MAY_IMPORT) == set()


def test_parts_of_a_room_do_not_import_in_a_cycle() -> None:
    rooms = [d for d in sorted(PACKAGE.rglob("*")) if d.is_dir() and d.name != "__pycache__"]
    assert "fitting" in imports_within(PACKAGE / "inference")["comparison"]
    assert {str(r): c for r in rooms if (c := rooms_in_a_cycle(imports_within(r)))} == {}


def test_a_planted_cycle_is_detected(tmp_path: Path) -> None:
    (tmp_path / "orbit" / "methods").mkdir(parents=True)
    for place, line in (
        ("mesh.py", "from asperity.orbit.methods.newton import x"),
        ("methods/newton.py", "from asperity.orbit.mesh import y"),
        ("period.py", "from asperity.orbit.mesh import z"),
    ):
        (tmp_path / "orbit" / place).write_text(line, encoding="utf-8")
    cycle = rooms_in_a_cycle(imports_within(tmp_path / "orbit", tmp_path))
    assert cycle == {"mesh", "methods", "period"}


@pytest.mark.parametrize(
    ("room", "line", "target"),
    [
        ("laws", "from asperity.slider import Slider", "slider"),
        ("laws", "import asperity.materials.material", "materials"),
        ("laws", "from asperity import orbit", "orbit"),
        ("loads", "def f():\n    from asperity.laws import get_law", "laws"),
        ("air", "from asperity.laws.law import Law", "laws"),
        ("materials", "import numpy, asperity.orbit", "orbit"),
        (
            "figures",
            "try:\n    from asperity.orbit import x\nexcept ImportError:\n    x = 1",
            "orbit",
        ),
        ("units", "import asperity", "__init__"),
        ("errors", "from .units import to_si", "relative-import"),
        ("app", "from asperity.cli import main", "cli"),
        ("utils", "from asperity.errors import InputError", "errors"),
    ],
)
def test_a_planted_wrong_import_is_detected(
    tmp_path: Path, room: str, line: str, target: str
) -> None:
    (tmp_path / room).mkdir()
    (tmp_path / room / "planted.py").write_text(line, encoding="utf-8")
    (wrong,) = wrong_imports(tmp_path)
    assert wrong.endswith(f"{room} -> {target}")


def test_papers_use_public_names_only() -> None:
    modules = sorted(PAPERS.rglob("*.py"))
    assert len(modules) > 10
    private = {str(m.relative_to(PAPERS)): private_names(m.read_text("utf-8")) for m in modules}
    assert {name: lines for name, lines in private.items() if lines} == {}


def test_the_library_imports_no_paper() -> None:
    modules = {str(m.relative_to(PACKAGE)): m.read_text("utf-8") for m in PACKAGE.rglob("*.py")}
    assert [name for name, text in modules.items() if "asperity_papers" in text] == []


@pytest.mark.parametrize(
    "line",
    [
        "import asperity.orbit.search",
        "from asperity.orbit.search import find_orbits",
        "from asperity.orbit import search",
        "from asperity import _version",
        "from asperity.errors import closest",
        "def f():\n    from asperity.inference.tables.term import LockInTerm",
    ],
)
def test_a_planted_private_name_is_detected(line: str) -> None:
    assert len(private_names(line)) == 1


def test_public_names_are_accepted() -> None:
    public = "import asperity as asp\nfrom asperity import Slider, theory\n"
    assert private_names(f"{public}from asperity.theory import closed_forms as cf\n") == []


def test_allowed_imports_are_accepted(tmp_path: Path) -> None:
    (tmp_path / "orbit").mkdir()
    (tmp_path / "orbit" / "right.py").write_text(
        "from typing import TYPE_CHECKING\nimport numpy\nfrom asperity.slider import Slider\n"
        "from asperity.orbit.other import y\n"
        "if TYPE_CHECKING:\n    from asperity.study import z\n",
        encoding="utf-8",
    )
    assert wrong_imports(tmp_path) == []


def test_no_file_has_a_registry_or_a_path_of_a_machine() -> None:
    files = repository_files()
    assert ROOT / "pyproject.toml" in files
    assert ROOT / "requirements" / "run.txt" in files
    matches = [
        f"{f.relative_to(ROOT)}: {match[0]}"
        for f in files
        if (match := _FORBIDDEN.search(f.read_text(encoding="utf-8")))
    ]
    assert matches == []


@pytest.mark.parametrize(
    "text",
    [
        "https://" + "pypi" + ".org/simple",
        "see /" + "root/venv/bin",
        'path = "/' + 'work/main"',
        "file:///" + "home/someone/x",
        "--extra-index" + "-url x",
    ],
)
def test_planted_machine_details_are_detected(text: str) -> None:
    assert _FORBIDDEN.search(text)


def test_ordinary_paths_are_accepted() -> None:
    assert not _FORBIDDEN.search("src/work/main.py, $HOME/work/ and ./root/x")


def test_every_locked_requirement_is_hashed() -> None:
    for lock in sorted((ROOT / "requirements").glob("*.txt")):
        text = lock.read_text(encoding="utf-8").replace("\\\n", " ")
        pins = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
        assert pins, lock.name
        assert [p for p in pins if "--hash=sha256:" not in p or "==" not in p] == [], lock.name
