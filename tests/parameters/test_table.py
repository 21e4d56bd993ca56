"""The table of parameters: one name each, rules, and laws from outside the package."""

from typing import ClassVar

import equinox as eqx
import numpy as np
import pytest

import asperity as asp
from asperity.errors import InputError
from asperity.laws import Law, parameter, registered
from asperity.loads import Harmonic
from asperity.orbit import PeriodicResponse
from asperity.parameters import (
    DRIVE,
    EXPERIMENT,
    INTERFACE,
    MACHINE,
    OUTPUTS,
    RESULT_COLUMNS,
    all_parameters,
    canonical_name,
    display_name,
    known_name,
    law_parameters,
    point_parameters,
    symbol_of,
)
from asperity.parameters.table import parameter_named
from asperity.slider import equation_of_motion
from asperity.slider.parameters import equation_parameters, value_of, with_value
from asperity.slider.problem import Problem
from asperity.units import KINDS

LAWS = sorted(registered())


class Outside(Law):
    """A law that no file of the package knows, with a name that another law uses otherwise."""

    name: ClassVar[str] = "outside"
    source: ClassVar[str] = "none"
    state_names: ClassVar[tuple[str, ...]] = ()

    h: float = parameter("law.h", "length", symbol="h", meaning="thickness of the gouge")
    c: float = parameter("law.c", "length")
    plain: float = eqx.field(default=1.0)


@pytest.mark.parametrize("name", LAWS)
def test_every_parameter_of_a_law_says_what_it_is(name: str) -> None:
    for p in law_parameters(registered()[name]).values():
        assert p.meaning
        assert p.symbol
        assert p.label == f"law.{p.name}"


@pytest.mark.parametrize("name", LAWS)
def test_no_law_is_wider_than_the_table_that_files_of_numbers_are_checked_by(name: str) -> None:
    probes = np.array([-1.0, 0.0, 0.5])
    for p in law_parameters(registered()[name]).values():
        shared = INTERFACE.get(p.name)
        if shared is not None:
            assert p.kind == shared.kind
            for probe in probes:
                if accepts(p, probe):
                    assert accepts(shared, probe)


def accepts(p, value: float) -> bool:
    try:
        p.check(value)
    except InputError:
        return False
    return True


def test_no_name_or_alias_stands_for_two_parameters() -> None:
    known = all_parameters(registered().values())
    said = [(word, p.name) for p in known.values() for word in (p.name, *p.aliases)]
    words = [word for word, _ in said]
    assert sorted(words) == sorted(set(words))


@pytest.mark.parametrize(
    ("written", "name"),
    [
        *[(alias, p.name) for p in EXPERIMENT.values() for alias in p.aliases],
        ("lambda_", "lambda"),
        ("law.D0", "D0"),
        ("K", "K"),
    ],
)
def test_aliases_lead_to_the_one_name(written: str, name: str) -> None:
    assert canonical_name(written, point_parameters(registered()["elasto-plastic"])) == name


@pytest.mark.parametrize(
    ("written", "meant"), [("dc", "D0"), ("omega", "frequency"), ("epsilom", "epsilon")]
)
def test_other_names_are_refused_with_the_one_that_was_meant(written: str, meant: str) -> None:
    with pytest.raises(InputError, match=f"got '{written}'; did you mean '{meant}'"):
        known_name(written, point_parameters(registered()["rice-ruina"]))


def test_a_law_from_outside_appears_by_its_declarations() -> None:
    own = law_parameters(Outside)
    assert (own["h"].unit, own["h"].rule) == ("m", "positive")
    assert own["h"].meaning == "thickness of the gouge"
    assert own["plain"].unit == ""
    assert own["c"].kind == "length"
    assert law_parameters(registered()["nagata"])["c"].kind == "dimensionless"
    # The law that is asked for comes first.
    assert all_parameters([Outside, *registered().values()])["c"].kind == "length"
    assert own["h"].check("2 mm") == 2e-3


def test_a_law_must_not_take_the_name_of_the_machine() -> None:
    class Greedy(Law):
        name: ClassVar[str] = "greedy"
        K: float = parameter("law.K", "stiffness")

    with pytest.raises(InputError, match=r"law\.K must have a name that is free"):
        law_parameters(Greedy)


def test_a_law_with_a_static_field_is_refused():
    """Tables and fits construct laws from numbers, and would take its default."""

    class Settable(asp.laws.RiceRuina):
        variant: str = eqx.field(static=True, default="a")

    with pytest.raises(InputError, match=r"law\.variant must be a number.*class attribute"):
        law_parameters(Settable)


def test_every_output_is_an_attribute_of_the_response() -> None:
    # ln|m| of the leading multiplier is the maps' own: the response has all of them.
    for name in set(OUTPUTS) - {"log_multiplier"}:
        fields = {*vars(PeriodicResponse), *PeriodicResponse.__dataclass_fields__}
        assert name in fields
    assert set(RESULT_COLUMNS) <= set(OUTPUTS)


@pytest.mark.parametrize("inertia", [False, True])
@pytest.mark.parametrize("eta", [None, 300.0])
def test_values_are_read_and_set_where_the_equations_have_them(inertia: bool, eta) -> None:
    law = asp.materials.load("bureau2000").law("elasto-plastic")
    slider = asp.Slider(law, spring=2e5, load=7.0, mass=1.6)
    motion = equation_of_motion(slider, 1e-6, 2 * np.pi * 120.0, inertia=inertia, eta=eta)
    problem = Problem(motion, Harmonic(0.24))
    known = equation_parameters(*problem)
    assert ("M" in known) == inertia
    assert ("eta" in known) == (inertia or eta is not None)
    values = {name: float(value_of(problem, p)) for name, p in known.items()}
    assert values["frequency"] == pytest.approx(120.0, rel=1e-15)
    assert (values["V"], values["K"], values["epsilon"], values["lambda"]) == (
        1e-6,
        2e5,
        0.24,
        7e-7,
    )
    for name, p in known.items():
        changed = with_value(problem, p, 3.0)
        assert float(value_of(changed, p)) == pytest.approx(3.0, rel=1e-15)
        others = {n: float(value_of(changed, q)) for n, q in known.items() if n != name}
        assert others == {n: value for n, value in values.items() if n != name}


def test_every_kind_and_rule_is_known() -> None:
    for p in all_parameters(registered().values()).values():
        assert p.kind in KINDS
        assert p.example


def test_names_of_geophysics_are_those_of_the_table() -> None:
    two_state = registered()["two-state"]
    texts = ("A - B", "D0", "K/W0", "B2", "D2", "step_time_1", "mu1", "alpha")
    shown = [display_name(text, "geophysics", two_state) for text in texts]
    assert shown == ["a - b", "D_c", "k/sigma_n", "b_2", "L_2", "step_time_1", "mu1", "alpha"]
    assert symbol_of(MACHINE["W0"], "geophysics") == r"\bar\sigma_n"
    assert symbol_of(DRIVE["frequency"], "geophysics") == "f"
    assert [display_name(text) for text in texts] == list(texts)


def test_a_parameter_of_ones_own_law_keeps_its_name_in_geophysics() -> None:
    class Mine(registered()["rice-ruina"]):
        k: float = parameter("k", "dimensionless")

    assert [parameter_named(name, Mine) for name in ("k", "a", "Dc")] == ["k", "A", "D0"]
    assert parameter_named("k", registered()["rice-ruina"]) == "K"


def test_the_run_of_a_parameter_keeps_its_name() -> None:
    assert display_name("K[B]/W0", "geophysics") == "k[B]/sigma_n"
