"""The one error class and its suggestions."""

import pytest

from asperity.errors import InputError, closest

LAWS = ("amontons", "elasto-plastic", "linker-dieterich", "rice-ruina")


def test_input_error_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="must be > 0"):
        raise InputError("slider.K must be > 0, got -1 N/m; give a stiffness")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("rice-ruine", "rice-ruina"),
        ("Amontons", "amontons"),
        ("elastoplastic", "elasto-plastic"),
        ("LINKER", "linker-dieterich"),
    ],
)
def test_a_near_name_is_suggested(written: str, meant: str) -> None:
    assert closest(written, LAWS) == f"did you mean '{meant}'?"


def test_names_are_listed_when_none_is_near() -> None:
    assert closest("qqq", LAWS) == "choose one of " + ", ".join(LAWS)


def test_the_suggestion_keeps_the_case_of_the_known_name() -> None:
    assert closest("d0", ["D0", "W0"]) == "did you mean 'D0'?"


def test_any_iterable_will_do() -> None:
    assert closest("amonton", (name for name in LAWS)) == "did you mean 'amontons'?"
