"""Laws from outside the package: by entry points, and by their place in a module or file."""

import importlib
import sys
from pathlib import Path

import pytest

from asperity.errors import InputError
from asperity.laws import get_law, known_law, registered, registry

LAW = """
import jax.numpy as jnp
from asperity.laws import RiceRuina

class {name}(RiceRuina):
    name = "{registered}"

number = 3
"""


@pytest.fixture(autouse=True)
def a_registry_of_its_own(monkeypatch):
    """What a test makes known is forgotten after it."""
    monkeypatch.setattr(registry, "_LAWS", dict(registry._LAWS))
    registry.installed.cache_clear()
    yield
    registry.installed.cache_clear()


@pytest.fixture
def law_file(tmp_path) -> Path:
    path = tmp_path / "my_law.py"
    path.write_text(LAW.format(name="Mine", registered="mine"), encoding="utf-8")
    return path


def test_a_law_in_a_file_is_known_by_its_name(law_file) -> None:
    assert known_law(f"{law_file}:Mine") == "mine"
    assert known_law(f"{law_file}:Mine") == "mine"  # one file, one class
    assert get_law("mine").__name__ == "Mine"
    assert known_law("rice-ruina") == "rice-ruina"


def test_a_law_in_a_module(law_file, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(law_file.parent))
    assert known_law("my_law:Mine") == "mine"
    sys.modules.pop("my_law")


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("{file}:Nine", "did you mean 'Mine'?"),
        ("{file}:number", "must be a subclass of asperity.laws.Law"),
        ("{file}:", "must be a place like"),
        (":Mine", "must be a place like"),
        ("nowhere.py:Mine", "file that exists"),
        ("no.such.module:Mine", "file that exists"),
        ("json:loads", "must be a subclass"),
        ("asperity.laws:Law", "must be a subclass"),
        ("{broken}:Mine", "code that runs"),
        ("{folder}:Mine", "file that exists"),
    ],
)
def test_a_wrong_place_is_one_sentence(law_file, place: str, message: str) -> None:
    broken = law_file.with_name("broken.py")
    broken.write_text("1 / 0", encoding="utf-8")
    text = place.format(file=law_file, broken=broken, folder=law_file.parent)
    with pytest.raises(InputError) as error:
        known_law(text)
    assert message in str(error.value)


def test_a_law_without_all_of_its_equations(tmp_path) -> None:
    path = tmp_path / "half.py"
    path.write_text(
        "from asperity.laws import Law\nclass Half(Law):\n    name = 'half'\n"
        "    source = ''\n    state_names = ()\n    def friction(self, v, state, w):\n"
        "        return v\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="none for state_rate, steady_state"):
        known_law(f"{path}:Half")


def install(folder: Path, name: str, value: str) -> None:
    """What an installer leaves of a package that declares an entry point."""
    info = folder / "mylab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mylab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[asperity.laws]\n{name} = {value}\n")


def test_a_law_of_an_installed_package(law_file, monkeypatch) -> None:
    install(law_file.parent, "mine", "my_law:Mine")
    monkeypatch.syspath_prepend(str(law_file.parent))
    importlib.invalidate_caches()
    assert get_law("mine").__name__ == "Mine"
    assert "mine" in registered()
    sys.modules.pop("my_law")


def test_a_broken_installed_law_spoils_nothing_else(law_file, monkeypatch) -> None:
    install(law_file.parent, "other", "my_law:Mine")
    monkeypatch.syspath_prepend(str(law_file.parent))
    importlib.invalidate_caches()
    with pytest.warns(UserWarning, match="name of its entry point"):
        assert "rice-ruina" in registered()
    with pytest.raises(InputError, match="name of its entry point"):
        get_law("other")
    assert get_law("rice-ruina").name == "rice-ruina"
    sys.modules.pop("my_law")
