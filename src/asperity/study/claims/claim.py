"""One statement of the paper, what is computed for it, and the verdict that a rule gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias, get_args

from asperity.study.claims.rules import Rule

Verdict: TypeAlias = Literal["reproduced", "misprint", "differs"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


@dataclass(frozen=True)
class Claim:
    """An entry of the ledger. Build it with `judged` or `judged_formula`, which find the verdict.

    Attributes
    ----------
    id : str
        Short name, unique in the ledger.
    place : str
        Section, equation, figure or appendix of the paper.
    statement : str
        What the paper says.
    stated : str
        The number, or the word that takes its place.
    computed : str
        What is found here, with units.
    how : str
        Law or formula, parameters and method.
    rule : str
        What would make it "reproduced", fixed beforehand.
    verdict : {"reproduced", "misprint", "differs"}
        "misprint": the printed formula fails where the one derived from the paper's own equations
        agrees with an integration of them.
    why : str
        What to make of the verdict.
    numbers : mapping of str to float
        The numbers that the rule was applied to.
    """

    id: str
    place: str
    statement: str
    stated: str
    computed: str
    how: str
    rule: str
    verdict: Verdict
    why: str
    numbers: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """Fields by name, for JSON."""
        return asdict(self)


def judged(
    rule: Rule,
    numbers: Mapping[str, float],
    *,
    id: str,
    place: str,
    statement: str,
    stated: str,
    computed: str,
    how: str,
    why: str,
) -> Claim:
    """Return a claim that is reproduced if the rule holds for every one of `numbers`.

    Parameters
    ----------
    rule : Rule
    numbers : mapping of str to float
        At least one.
    id, place, statement, stated, computed, how, why : str
        See `Claim`.
    """
    values = {name: float(value) for name, value in numbers.items()}
    kept = bool(values) and all(rule.holds(value) for value in values.values())
    return Claim(
        id=id,
        place=place,
        statement=statement,
        stated=stated,
        computed=computed,
        how=how,
        rule=f"every one of: {rule.text}" if len(values) > 1 else rule.text,
        verdict="reproduced" if kept else "differs",
        why=why,
        numbers=values,
    )


def judged_formula(
    *,
    printed: float,
    derived: float,
    independent: float,
    tolerance: float,
    id: str,
    place: str,
    statement: str,
    stated: str,
    computed: str,
    how: str,
    why: str,
) -> Claim:
    """Return a claim about a printed formula, decided by an independent number.

    "reproduced" if what is printed agrees with `independent`; "misprint" if only what is derived
    does; "differs" if neither does.

    Parameters
    ----------
    printed, derived, independent : float
        The same quantity from the formula as printed, as derived here, and from a method that uses
        neither formula.
    tolerance : float
        Relative, of `independent`.
    id, place, statement, stated, computed, how, why : str
        See `Claim`.
    """
    numbers = {"printed": printed, "derived": derived, "independent": independent}
    numbers = {name: float(value) for name, value in numbers.items()}
    return Claim(
        id=id,
        place=place,
        statement=statement,
        stated=stated,
        computed=computed,
        how=how,
        rule=(
            f"reproduced if the printed formula is within {tolerance:.2g} (relative) of an "
            "independent determination; a misprint if only the derived one is"
        ),
        verdict=formula_verdict(printed, derived, independent, tolerance),
        why=why,
        numbers=numbers,
    )


def formula_verdict(
    printed: float, derived: float, independent: float, tolerance: float
) -> Verdict:
    """The verdict of `judged_formula`; a number that is not finite agrees with nothing."""

    def confirmed(value: float) -> bool:
        return abs(value - independent) <= tolerance * abs(independent)

    if confirmed(printed):
        return "reproduced"
    return "misprint" if confirmed(derived) else "differs"
