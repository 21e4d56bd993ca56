"""One statement of a paper: its words, what is computed for it, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, Field

from asperity.errors import InputError, closest
from asperity.outputs.json import plain
from asperity.papers.ledger import rules
from asperity.papers.ledger.checks import CheckResult

Verdict: TypeAlias = Literal["reproduced", "misprint", "differs"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
Kind: TypeAlias = Literal["test", "fit", "arithmetic", "identity"]
KINDS: tuple[Kind, ...] = get_args(Kind)


class RuleWords(BaseModel):
    """A rule as claims.toml writes it: its name, what it is about, and its numbers.

    A number may be a word of `asperity.papers.ledger.rules.WORDS` or the name of one of the
    paper's numbers.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    accept: str
    what: str = "the value"
    stated: float | str | None = None
    last_digit: float | None = None
    limit: float | str | None = None
    low: float | str | None = None
    high: float | str | None = None
    tolerance: float | None = None

    @property
    def is_formula(self) -> bool:
        """Whether it judges a printed formula by an independent number."""
        return self.accept == "formula"

    def build(self, numbers: Mapping[str, float], claim: str) -> rules.AcceptanceRule:
        """The rule with its numbers.

        Raises
        ------
        InputError
            If the rule is unknown or a number of it is missing or unknown.
        """
        if self.accept not in rules.RULES:
            raise InputError(
                f"{claim}.rule.accept must be a rule of the ledger, got '{self.accept}'; "
                f"{closest(self.accept, (*rules.RULES, 'formula'))}"
            )
        make, names = rules.RULES[self.accept]
        values = []
        for name in names:
            value = getattr(self, name)
            if value is None:
                raise InputError(
                    f"{claim}.rule.{name} must be given for '{self.accept}', got nothing; add it"
                )
            values.append(rules.number(value, numbers, f"{claim}.rule.{name}"))
        return make(*values, self.what)


class Entry(BaseModel):
    """The words of a claim, as claims.toml holds them; see `Claim` for the fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    place: str
    statement: str
    stated: str
    how: str
    why: str
    kind: Kind
    rule: RuleWords
    depends_on: tuple[str, ...] = Field(default=())


@dataclass(frozen=True)
class Sensitivity:
    """What a claim becomes at the ends of the published uncertainty of one quantity.

    Attributes
    ----------
    quantity : str
        What is varied.
    ends : (str, str)
        The two values, with what changes along.
    numbers : mapping of str to (float, float)
        The claim's numbers there.
    verdicts : (str, str)
    """

    quantity: str
    ends: tuple[str, str]
    numbers: Mapping[str, tuple[float, float]]
    verdicts: tuple[Verdict, Verdict]


@dataclass(frozen=True)
class Claim:
    """An entry of the ledger: words, numbers and verdict.

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
    kind : {"test", "fit", "arithmetic", "identity"}
        "test": the models could have contradicted the statement. "fit": a parameter was fitted to
        the quantity that is judged. "arithmetic": the paper's printed numbers alone decide.
        "identity": true of the model by construction.
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
    depends_on : tuple of str
        Uncertain quantities that the numbers rest on.
    sensitivity : tuple of Sensitivity
        One for each of `depends_on`; empty where it was not asked for.
    """

    id: str
    place: str
    statement: str
    stated: str
    kind: Kind
    computed: str
    how: str
    rule: str
    verdict: Verdict
    why: str
    numbers: Mapping[str, float]
    depends_on: tuple[str, ...] = ()
    sensitivity: tuple[Sensitivity, ...] = ()

    @property
    def is_test(self) -> bool:
        """Whether the statement could have been contradicted by the models."""
        return self.kind == "test"

    @property
    def decided(self) -> bool:
        """Whether the verdict is the same at the ends of all published uncertainties.

        Never, where it rests on uncertain quantities and the sensitivity was not computed.
        """
        known = {own.quantity for own in self.sensitivity} >= set(self.depends_on)
        return known and all(v == self.verdict for own in self.sensitivity for v in own.verdicts)

    def as_dict(self) -> dict[str, Any]:
        """Fields by name, for JSON; a number that is not finite is None."""
        return dict(plain(asdict(self)))


def judge(entry: Entry, outcome: CheckResult, stated: Mapping[str, float]) -> Claim:
    """The claim that an entry becomes with what was computed for it.

    Parameters
    ----------
    entry : Entry
    outcome : CheckResult
    stated : mapping of str to float
        The paper's printed numbers (SI), which a rule may name.

    Raises
    ------
    InputError
        If the entry's rule cannot be built, or is for a formula and lacks its numbers.
    """
    numbers = {name: float(value) for name, value in outcome.numbers.items()}
    words = {
        name: value
        for name, value in entry.model_dump(exclude={"rule"}).items()
        if name in Claim.__dataclass_fields__
    }
    return Claim(
        **words,
        computed=outcome.computed,
        rule=_rule_text(entry, stated, several=len(numbers) > 1),
        verdict=verdict(entry, numbers, stated),
        numbers=numbers,
    )


def verdict(entry: Entry, numbers: Mapping[str, float], stated: Mapping[str, float]) -> Verdict:
    """The verdict that an entry's rule gives on the numbers computed for it."""
    if entry.rule.is_formula:
        missing = {"printed", "independent"} - set(numbers)
        if missing or entry.rule.tolerance is None:
            lacking = ", ".join(sorted(missing)) or "a tolerance"
            raise InputError(
                f"{entry.id}.rule must have the numbers 'printed' and 'independent' and a "
                f"tolerance, got none of: {lacking}; add it"
            )
        return formula_verdict(
            numbers["printed"],
            numbers.get("derived", math.nan),
            numbers["independent"],
            entry.rule.tolerance,
        )
    rule = entry.rule.build(stated, entry.id)
    kept = bool(numbers) and all(rule.holds(value) for value in numbers.values())
    return "reproduced" if kept else "differs"


def _rule_text(entry: Entry, stated: Mapping[str, float], *, several: bool) -> str:
    if entry.rule.is_formula:
        return rules.formula_text(entry.rule.tolerance or math.nan)
    text = entry.rule.build(stated, entry.id).text
    return f"every one of: {text}" if several else text


def formula_verdict(
    printed: float, derived: float, independent: float, tolerance: float
) -> Verdict:
    """The verdict on a printed formula, decided by an independent number.

    "reproduced" if what is printed agrees with `independent`; "misprint" if only what is derived
    does; "differs" if neither does. A number that is not finite agrees with nothing.

    Parameters
    ----------
    printed, derived, independent : float
        The same quantity from the formula as printed, as derived here (NaN: nothing derived), and
        from a method that uses neither formula.
    tolerance : float
        Relative, of `independent`.
    """

    def confirmed(value: float) -> bool:
        return abs(value - independent) <= tolerance * abs(independent)

    if confirmed(printed):
        return "reproduced"
    return "misprint" if confirmed(derived) else "differs"
