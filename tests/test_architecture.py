"""Imports point one way, and nothing of one machine is left in a file."""

import ast
import importlib
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "asperity"

#: What every room may use.
_BASE = {"arrays", "_jax", "_lazy", "_processes", "_version", "errors", "outputs"}
_BASE |= {"parameters", "units"}
_EQUATIONS = _BASE | {"laws", "loads", "slider"}
_SOLVERS = {"algebra", "theory", "orbit", "branches", "transients"}
_SIGNALS = {"recording", "lock_in", "measurement", "tribometer"}
_RESULTS = _EQUATIONS | _SOLVERS | _SIGNALS | {"air", "materials", "questions"}
_STUDIES = {"experiment", "protocol", "samples", "study"}

#: The rooms, and what each may import besides itself: the one place where the order is written.
MAY_IMPORT: dict[str, set[str]] = {
    "_version": set(),
    "arrays": set(),
    "_jax": set(),
    "_lazy": set(),
    "_processes": {"errors"},
    "errors": set(),
    "units": {"errors", "_lazy"},
    "outputs": {"errors", "_lazy", "_version"},  # files of any content
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
    "figures": _BASE | _SIGNALS | _STUDIES,  # turns numbers into pictures, solves nothing
    "fit_report": _RESULTS | {"inference", "figures"},  # a fit as a folder: page, draws, material
    "ledger": _BASE | {"materials", "figures", "questions"},  # knows no paper
    "app": _RESULTS
    | _STUDIES
    | {"inference", "figures", "operating_point", "ledger", "fit_report"},
    "cli": _RESULTS
    | _STUDIES
    | {"inference", "figures", "operating_point", "ledger", "app", "fit_report"},
    "__main__": {"cli"},
    # The package itself names its rooms as text, and imports them when they are asked for.
    "__init__": {"_lazy"},
}

#: The papers: users of the library, found by an entry point.
PAPERS = ROOT / "src" / "asperity_papers"

# Put together here, so that this file does not hold what it looks for.
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


def imported_rooms(source: str) -> Iterator[tuple[str, int]]:
    """Rooms that a module imports, with the line; imports inside functions count."""
    for node in _running(ast.parse(source)):
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


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that run: what only a type checker reads loads nothing."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            yield from (n for other in child.orelse for n in (other, *_running(other)))
        else:
            yield child
            yield from _running(child)


def wrong_imports(package: Path) -> list[str]:
    """Every import against the order, as ``file:line: room -> room``."""
    found = []
    for module in sorted(package.rglob("*.py")):
        room = room_of(module, package)
        for target, line in imported_rooms(module.read_text(encoding="utf-8")):
            if target != room and target not in MAY_IMPORT.get(room, set()):
                found.append(f"{module.relative_to(package)}:{line}: {room} -> {target}")
    return found


def imports_within(room: Path, package: Path = PACKAGE) -> dict[str, set[str]]:
    """What each part of a room imports from its other parts."""
    inside = ".".join(("asperity", *room.relative_to(package).parts, ""))
    found: dict[str, set[str]] = {}
    for module in sorted(room.rglob("*.py")):
        part = room_of(module, room)
        if part == "__init__":
            continue
        parts = found.setdefault(part, set())
        for node in _running(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(inside):
                target = (node.module or "").removeprefix(inside).split(".")[0]
                parts |= {target} - {part}
    return found


def rooms_in_a_cycle(allowed: dict[str, set[str]]) -> set[str]:
    """Rooms that cannot be put into an order in which each comes after what it imports."""
    rest = dict(allowed)
    while leaves := [room for room, others in rest.items() if not others & set(rest)]:
        for room in leaves:
            del rest[room]
    return set(rest)


def private_names(source: str) -> list[str]:
    """What a module imports from the library that is not public, with the line.

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
    """Text files that are, or would be, part of the repository."""
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


def test_imports_point_one_way() -> None:
    assert wrong_imports(PACKAGE) == []


def test_every_room_has_its_place_in_the_order() -> None:
    rooms = {room_of(module) for module in PACKAGE.rglob("*.py")}
    assert rooms <= set(MAY_IMPORT)
    assert {"errors", "units", "laws", "materials"} <= rooms


def test_the_order_has_no_cycle() -> None:
    assert rooms_in_a_cycle(MAY_IMPORT) == set()


def test_the_parts_of_no_room_import_in_a_cycle() -> None:
    rooms = [d for d in sorted(PACKAGE.rglob("*")) if d.is_dir() and d.name != "__pycache__"]
    assert "fitting" in imports_within(PACKAGE / "inference")["comparison"]
    assert {str(r): c for r in rooms if (c := rooms_in_a_cycle(imports_within(r)))} == {}


def test_a_planted_cycle_is_caught(tmp_path: Path) -> None:
    (tmp_path / "orbit" / "methods").mkdir(parents=True)
    for place, line in (
        ("mesh.py", "from asperity.orbit.methods.newton import x"),
        ("methods/newton.py", "from asperity.orbit.mesh import y"),
        ("period.py", "from asperity.orbit.mesh import z"),
    ):
        (tmp_path / "orbit" / place).write_text(line, encoding="utf-8")
    found = rooms_in_a_cycle(imports_within(tmp_path / "orbit", tmp_path))
    assert found == {"mesh", "methods", "period"}


@pytest.mark.parametrize(
    ("room", "line", "target"),
    [
        ("laws", "from asperity.slider import Slider", "slider"),
        ("laws", "import asperity.materials.record", "materials"),
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
def test_a_planted_wrong_import_is_caught(
    tmp_path: Path, room: str, line: str, target: str
) -> None:
    (tmp_path / room).mkdir()
    (tmp_path / room / "planted.py").write_text(line, encoding="utf-8")
    (found,) = wrong_imports(tmp_path)
    assert found.endswith(f"{room} -> {target}")


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
def test_a_planted_private_name_is_caught(line: str) -> None:
    assert len(private_names(line)) == 1


def test_public_names_pass() -> None:
    public = "import asperity as asp\nfrom asperity import Slider, theory\n"
    assert private_names(f"{public}from asperity.theory import closed_forms as cf\n") == []


def test_right_imports_pass(tmp_path: Path) -> None:
    (tmp_path / "orbit").mkdir()
    (tmp_path / "orbit" / "right.py").write_text(
        "from typing import TYPE_CHECKING\nimport numpy\nfrom asperity.slider import Slider\n"
        "from asperity.orbit.other import y\n"
        "if TYPE_CHECKING:\n    from asperity.study import z\n",
        encoding="utf-8",
    )
    assert wrong_imports(tmp_path) == []


def test_no_file_names_a_registry_or_a_machine() -> None:
    files = repository_files()
    assert ROOT / "pyproject.toml" in files
    assert ROOT / "requirements" / "run.txt" in files
    found = [
        f"{f.relative_to(ROOT)}: {match[0]}"
        for f in files
        if (match := _FORBIDDEN.search(f.read_text(encoding="utf-8")))
    ]
    assert found == []


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
def test_planted_machine_details_are_caught(text: str) -> None:
    assert _FORBIDDEN.search(text)


def test_ordinary_paths_are_not_taken_for_machine_details() -> None:
    assert not _FORBIDDEN.search("src/work/main.py, $HOME/work/ and ./root/x")


def test_every_locked_requirement_is_hashed() -> None:
    for lock in sorted((ROOT / "requirements").glob("*.txt")):
        text = lock.read_text(encoding="utf-8").replace("\\\n", " ")
        pins = [line for line in text.splitlines() if line and not line.lstrip().startswith("#")]
        assert pins, lock.name
        assert [p for p in pins if "--hash=sha256:" not in p or "==" not in p] == [], lock.name
