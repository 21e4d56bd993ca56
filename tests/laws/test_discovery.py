"""Laws from outside the package, by file, module and entry point, and the checks of such laws."""

import importlib
import sys
from pathlib import Path
from typing import ClassVar

import jax.numpy as jnp
import pytest

from asperity import Slider, response_function
from asperity.errors import InputError
from asperity.laws import Law, RiceRuina, get_law, known_law, law_parameters, registered, registry
from asperity.laws.consistency import checked_law

LAW = """
import jax.numpy as jnp
from asperity.laws import RiceRuina

class {name}(RiceRuina):
    name = "{registered}"

number = 3
"""


@pytest.fixture(autouse=True)
def separate_registry(monkeypatch):
    """Laws registered in a test are removed after it."""
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


def test_a_law_in_a_module_is_known_by_its_name(law_file, monkeypatch) -> None:
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
        ("\0.py:Mine", "law must be the path of a file"),
    ],
)
def test_a_wrong_place_is_refused(law_file, place: str, message: str) -> None:
    broken = law_file.with_name("broken.py")
    broken.write_text("1 / 0", encoding="utf-8")
    text = place.format(file=law_file, broken=broken, folder=law_file.parent)
    with pytest.raises(InputError) as error:
        known_law(text)
    assert message in str(error.value)


def test_a_law_without_all_of_its_equations_is_refused(tmp_path) -> None:
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
    """The files that an installer writes for a package with an entry point."""
    info = folder / "mylab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mylab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[asperity.laws]\n{name} = {value}\n")


def test_a_law_of_an_installed_package_is_known_by_its_name(law_file, monkeypatch) -> None:
    install(law_file.parent, "mine", "my_law:Mine")
    monkeypatch.syspath_prepend(str(law_file.parent))
    importlib.invalidate_caches()
    assert get_law("mine").__name__ == "Mine"
    assert "mine" in registered()
    sys.modules.pop("my_law")


def test_a_broken_installed_law_does_not_affect_others(law_file, monkeypatch) -> None:
    install(law_file.parent, "other", "my_law:Mine")
    monkeypatch.syspath_prepend(str(law_file.parent))
    importlib.invalidate_caches()
    with pytest.warns(UserWarning, match="name of its entry point"):
        assert "rice-ruina" in registered()
    with pytest.raises(InputError, match="name of its entry point"):
        get_law("other")
    assert get_law("rice-ruina").name == "rice-ruina"
    sys.modules.pop("my_law")


NUMBERS = {"mu0": 0.5, "A": 0.013, "B": 0.026, "D0": 4e-7, "V0": 1e-6}


class Sound(RiceRuina):
    """A correct law from outside the package."""

    name: ClassVar[str] = "sound"


class TwoRates(Sound):
    def state_rate(self, v, v_plastic, state, w):
        return 2 * super().state_rate(v, v_plastic, state, w)


class NoTuple(Sound):
    def steady_state(self, v):
        return super().steady_state(v)[0]


class Fails(Sound):
    def friction(self, v, state, w):
        raise ValueError("no such thing")


class ByValue(Sound):
    def friction(self, v, state, w):
        return super().friction(v, state, w) if v > 1e-6 else self.mu0


class OneNumber(Sound):
    def friction(self, v, state, w):
        return jnp.mean(super().friction(v, state, w))


class Mixed(Sound):
    def friction(self, v, state, w):
        return super().friction(v, state, w) + 0 * v + jnp.mean(jnp.log(v))


class NotANumber(Sound):
    def friction(self, v, state, w):
        return super().friction(-v, state, w)


class WrongSteadyState(Sound):
    def steady_state(self, v):
        return (super().steady_state(v)[0] + 0.1,)


class Falling(Sound):
    def friction(self, v, state, w):
        return self.mu0 - self.A * jnp.log(v / self.V0) + self.B * state[0]

    log_velocity = Law.log_velocity


class OneText(Sound):
    state_names: ClassVar[str] = "phi"


class Blanks(Sound):
    name: ClassVar[str] = "my law"


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (TwoRates, r"state_rate must return a tuple with an array for each of the 1 .*got 2"),
        (NoTuple, "steady_state must return a tuple .*got no tuple"),
        (Fails, r"friction must work on arrays .*ValueError \(no such thing\)"),
        (ByValue, "friction must work on arrays .*truth value"),
        (OneNumber, r"of the shape of its arguments, got \(\) for \(4,\)"),
        (Mixed, "act on each element for itself"),
        (NotANumber, "must be finite in steady sliding"),
        (WrongSteadyState, "steady_state must be the states at which every rate vanishes"),
        (Falling, "must not decrease with the velocity"),
        (OneText, "state_names must be a tuple of names, got 'phi'"),
        (Blanks, "without blanks and colons, got 'my law'"),
    ],
)
def test_a_law_that_breaks_an_assumption_is_refused(law, message) -> None:
    with pytest.raises(InputError, match=message) as raised:
        Slider(law(**NUMBERS), spring=2e5, load=7.0)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("law", [WrongSteadyState, Falling])
def test_the_response_function_refuses_such_a_law_too(law) -> None:
    point = {"K": 2e5, "W0": 7.0, "V": 1e-6, "frequency": 120.0, "epsilon": 0.1}
    with pytest.raises(InputError, match="Write your own law"):
        response_function(law)(NUMBERS | point)


def test_correct_laws_pass_for_one_and_for_many_points() -> None:
    assert Slider(Sound(**NUMBERS), spring=2e5, load=7.0).law.name == "sound"
    many = Sound(**NUMBERS | {"A": jnp.array([[0.01, 0.02]])})
    assert Slider(many, spring=2e5, load=7.0).law.A.shape == (1, 2)


@pytest.mark.parametrize("law", sorted(registered()))
def test_the_laws_of_the_package_pass_the_checks_of_user_laws(law) -> None:
    kind = type("Copy", (registered()[law],), {"__module__": "elsewhere"})
    known = {"A": 0.013, "B": 0.026, "alpha": 0.2, "c": 0.2, "V1": 1e-8, "V2": 1e-4, "mu0": 0.5}
    numbers = {n: known.get(n, 1e-6) for n in law_parameters(kind)}
    numbers = {n + "_" * (n == "lambda"): value for n, value in numbers.items()}
    checked_law(kind(**numbers))
