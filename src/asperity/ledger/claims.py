"""Claims of a paper: their computed numbers, and the verdicts of their rules."""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from numbers import Real
from types import ModuleType
from typing import Any, Literal, TypeAlias, TypeVar, get_args

from asperity.errors import InputError, closest, require
from asperity.ledger import rules
from asperity.ledger.contents import Contents, Entry, HeadlineWords, Kind
from asperity.ledger.sentences import fill
from asperity.materials import Material
from asperity.outputs.json import plain
from asperity.parameters.arguments import counted, shown, typed

Verdict: TypeAlias = Literal["reproduced", "misprint", "differs", "undecided"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)

#: Result of a check: numbers by name, and texts that represent several numbers.
Computed: TypeAlias = Mapping[str, float | str]
Check: TypeAlias = Callable[[Any], Computed]

_MARK = "checked_claims"
Function = TypeVar("Function", bound=Callable[..., Any])


def check(claim: str, *arguments: Any) -> Callable[[Function], Function]:
    """Mark a function as the computation of a claim; it returns numbers by name.

    Parameters
    ----------
    claim : str
        The claim's ``id`` in claims.toml.
    *arguments
        Passed to the function after the paper's model; a function may compute several claims,
        with one mark each.
    """

    def mark(function: Function) -> Function:
        marks = (*getattr(function, _MARK, ()), (claim, arguments))
        setattr(function, _MARK, marks)
        return function

    return mark


@typed
def find_checks(module: ModuleType) -> dict[str, Check]:
    """Marked functions of a module, or of all modules of a package, by the id of their claim.

    Raises
    ------
    InputError
        If two functions compute one claim.
    """
    modules = [module]
    for info in pkgutil.walk_packages(getattr(module, "__path__", []), f"{module.__name__}."):
        modules.append(importlib.import_module(info.name))
    checks: dict[str, Check] = {}
    for part in modules:
        for value in vars(part).values():
            if getattr(value, "__module__", None) != part.__name__:
                continue  # imported, not defined, in this module
            for claim, arguments in getattr(value, _MARK, ()):
                rule, advice = "be computed by one function", "remove one of the marks"
                require(claim not in checks, f"checks.{claim}", rule, "two", advice)
                checks[claim] = lambda model, f=value, a=arguments: f(model, *a)  # type: ignore[misc]
    return checks


@dataclass(frozen=True)
class Sensitivity:
    """Results of a claim at the ends of the published uncertainty of a quantity.

    Attributes
    ----------
    quantity : str
        The varied quantity.
    ends : (str, str)
        The two values, with the other numbers that change with them.
    numbers : mapping of str to (float, float)
        Numbers of the claim at the two values.
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
        Statement of the paper.
    stated : str
        The number, or the word that takes its place.
    kind : {"test", "fit", "arithmetic", "identity"}
        "test": the models could have contradicted the statement. "fit": a parameter was fitted to
        the quantity that is judged. "arithmetic": the paper's printed numbers alone decide.
        "identity": true of the model by construction.
    computed : str
        Numbers of the check, with units.
    how : str
        Law or formula, parameters and method.
    rule : str
        Rule for "reproduced", fixed before the computation.
    verdict : {"reproduced", "misprint", "differs", "undecided"}
        "misprint": the printed formula fails where the one derived from the paper's own equations
        agrees with an integration of them. "undecided": the rule cannot be applied, as `rule` says.
    why : str
        Discussion of the verdict.
    numbers : mapping of str to float
        The numbers that the rule was applied to.
    depends_on : tuple of str
        Uncertain quantities from which the numbers follow.
    sensitivity : tuple of Sensitivity
        One entry for each of `depends_on`; empty if not requested.
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
        """Whether the models could contradict the statement."""
        return self.kind == "test"

    @property
    def decided(self) -> bool:
        """Whether the verdict is the same at the ends of all published uncertainties.

        False for uncertain quantities without a computed sensitivity.
        """
        known = {ends.quantity for ends in self.sensitivity} >= set(self.depends_on)
        return known and all(v == self.verdict for ends in self.sensitivity for v in ends.verdicts)

    def as_dict(self) -> dict[str, Any]:
        """Fields by name, for JSON; a number that is not finite is None."""
        return dict(plain(asdict(self)))


def judge(entry: Entry, computed: Computed, stated: Mapping[str, float]) -> Claim:
    """The claim of an entry, with its computed numbers and its verdict.

    Parameters
    ----------
    entry : Entry
    computed : mapping of str to float or str
    stated : mapping of str to float
        The paper's printed numbers (SI), which a rule may name.

    Raises
    ------
    InputError
        If a number that the rule judges or that the sentence quotes is not computed or is not
        finite, or if the rule cannot be built.
    """
    numbers = judged_numbers(entry, computed)
    rule, verdict = _rule_and_verdict(entry, numbers, stated)
    words = {
        name: value
        for name, value in entry.model_dump(exclude={"rule", "computed"}).items()
        if name in Claim.__dataclass_fields__
    }
    text = fill(entry.computed, computed, f"{entry.id}.computed")
    return Claim(**words, computed=text, rule=rule, verdict=verdict, numbers=numbers)


def judged_numbers(entry: Entry, computed: Computed) -> dict[str, float]:
    """The computed numbers that the rule of the entry judges, in the order of the check."""
    if not isinstance(computed, Mapping):
        rule, got = "be a function that returns numbers by name", shown(computed)
        raise InputError(f"the check of '{entry.id}'", rule, got, "return {'name': number}")
    for name, value in computed.items():
        if not isinstance(value, str) and not (isinstance(value, Real) and math.isfinite(value)):
            got = f"{value!r} for '{name}' of '{entry.id}'"
            raise InputError("checks", "compute finite numbers", got, "correct the check")
    numbers = {name: float(v) for name, v in computed.items() if not isinstance(v, str)}
    patterns = entry.judged or (_FORMULA if entry.rule.accept == "formula" else ("*",))
    for pattern in entry.judged:
        if not any(fnmatchcase(name, pattern) for name in numbers):
            rule = "name numbers of its check"
            raise InputError(f"{entry.id}.judged", rule, f"'{pattern}'", closest(pattern, numbers))
    return {n: v for n, v in numbers.items() if any(fnmatchcase(n, p) for p in patterns)}


_FORMULA = ("printed", "derived", "independent")


def _rule_and_verdict(
    entry: Entry, numbers: Mapping[str, float], stated: Mapping[str, float]
) -> tuple[str, Verdict]:
    """The rule of an entry as a sentence, and its verdict on the computed numbers."""
    words = entry.rule
    if words.accept == "undecided":
        return f"cannot be applied: {words.what}", "undecided"
    if words.accept == "formula":
        missing = {"printed", "independent"} - set(numbers)
        if missing or words.tolerance is None:
            lacking = ", ".join(sorted(missing)) or "a tolerance"
            raise InputError(
                f"{entry.id}.rule must have the numbers 'printed' and 'independent' and a "
                f"tolerance, got none of: {lacking}; add it"
            )
        printed, derived, independent = (numbers.get(name, math.nan) for name in _FORMULA)
        text = (
            f"reproduced if the printed formula is within {words.tolerance:.2g} (relative) of an "
            "independent determination; a misprint if only the derived one is"
        )
        return text, formula_verdict(printed, derived, independent, words.tolerance)
    rule = words.build(stated, entry.id)
    kept = bool(numbers) and all(rule.holds(value) for value in numbers.values())
    text = f"every one of: {rule.text}" if len(numbers) > 1 else rule.text
    return text, "reproduced" if kept else "differs"


def formula_verdict(
    printed: float, derived: float, independent: float, tolerance: float
) -> Verdict:
    """The verdict on a printed formula, decided by an independent number.

    "reproduced" if the printed formula agrees with `independent`; "misprint" if only the derived
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


@typed
def judge_claims(
    contents: Contents,
    checks: Mapping[str, Check],
    numbers: Material,
    model: Callable[[Material], Any],
    *,
    sensitivity: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[Claim]:
    """Compute all claims of a paper, in the order of its claims.toml.

    Parameters
    ----------
    contents : Contents
    checks : mapping of str to function
        The function of each claim, by its id.
    numbers : Material
        The paper's numbers at their central values.
    model : function
        Maps the paper's numbers to the argument of the checks.
    sensitivity : bool
        Whether to compute each claim also at the ends of the uncertainties that it depends on.
    progress : callable, optional
        Called with the number of claims computed so far and of all claims.

    Raises
    ------
    InputError
        If a claim has no check, or a check no claim.
    """
    _check_pairs(contents.claim, checks)
    stated = printed_numbers(numbers)
    report = counted(progress, len(contents.claim))
    central = model(numbers)
    claims = []
    for entry in contents.claim:
        claims.append(judge(entry, computed_numbers(entry, checks, central, numbers), stated))
        report(1)
    if not sensitivity:
        return claims
    varied: dict[str, list[Sensitivity]] = {entry.id: [] for entry in contents.claim}
    for uncertainty in contents.uncertainty:
        affected = [e for e in contents.claim if uncertainty.quantity in e.depends_on]
        changes = uncertainty.low, uncertainty.high
        ends = [altered(numbers, end) for end in changes]
        low_text, high_text = (
            ", ".join(f"{name} = {value:g}" for name, value in end.items()) for end in changes
        )
        models = [model(end) for end in ends]
        for entry in affected:
            low, high = (
                judge(entry, computed_numbers(entry, checks, *at), stated)
                for at in zip(models, ends, strict=True)
            )
            both = {n: (low.numbers[n], high.numbers[n]) for n in low.numbers if n in high.numbers}
            varied[entry.id].append(
                Sensitivity(
                    uncertainty.quantity, (low_text, high_text), both, (low.verdict, high.verdict)
                )
            )
    return [replace(claim, sensitivity=tuple(varied[claim.id])) for claim in claims]


def computed_numbers(
    entry: Entry, checks: Mapping[str, Check], model: Any, numbers: Material
) -> Computed:
    """The numbers of a claim, by its formulas or by its check.

    A formula may name the values before it. A model may have ``terms``, further names.
    """
    if not entry.values:
        return checks[entry.id](model)
    printed, terms = printed_numbers(numbers), getattr(model, "terms", {})
    values: dict[str, float] = {}
    for name, formula in entry.values.items():
        place = f"{entry.id}.values.{name}"
        values[name] = rules.formula_value(formula, values | printed, place, terms)
    return values


@typed
def printed_numbers(numbers: Material) -> dict[str, float]:
    """The paper's single values in SI, and as NAME.low and so on parts of its other numbers.

    ``low`` and ``high`` are the ends of a range, ``first`` and ``last`` those of a list of values,
    and ``uncertainty`` is that of a value.
    """
    stated: dict[str, float] = {}
    for name, number in numbers.numbers.items():
        if number.value is not None:
            stated[name] = number.si
        if number.si_range is not None:
            stated[f"{name}.low"], stated[f"{name}.high"] = number.si_range
        if number.si_values:
            stated[f"{name}.first"] = number.si_values[0]
            stated[f"{name}.last"] = number.si_values[-1]
        if number.si_uncertainty is not None:
            stated[f"{name}.uncertainty"] = number.si_uncertainty
    return stated


@typed
def altered(numbers: Material, changes: Mapping[str, float]) -> Material:
    """The paper's numbers with the values `changes` replaced, in the printed units."""
    new = {
        name: numbers[name].model_copy(update={"value": value}) for name, value in changes.items()
    }
    return numbers.model_copy(update={"numbers": {**numbers.numbers, **new}})


def _check_pairs(entries: Sequence[Entry], checks: Mapping[str, Check]) -> None:
    ids = {entry.id for entry in entries if not entry.values}
    for name in sorted(ids - set(checks)):
        rule, got = "compute every claim of claims.toml", f"none for '{name}'"
        raise InputError("checks", rule, got, f'mark a function with @check("{name}")')
    for name in sorted(set(checks) - ids):
        rule = "hold every claim that is computed"
        raise InputError("claims.toml", rule, f"none for '{name}'", "add [[claim]] with that id")


Standing: TypeAlias = Literal["holds", "holds at the central values", "undecided", "does not hold"]


@dataclass(frozen=True)
class Headline:
    """A conclusion of the paper.

    Attributes
    ----------
    claim : str
        Conclusion of the paper.
    result : str
        Summary of the computation.
    standing : str
        "holds": every claim is reproduced, at the ends of all published uncertainties too.
        "holds at the central values": every claim is reproduced there, not at all ends.
        "undecided": a claim is not reproduced at the central values, but is within the
        uncertainties, or cannot be decided. "does not hold": a claim is reproduced nowhere.
    claims : tuple of str
        Ids of the claims that decide.
    """

    claim: str
    result: str
    standing: Standing
    claims: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether every claim is reproduced at the central values."""
        return self.standing in ("holds", "holds at the central values")


def headlines(words: Sequence[HeadlineWords], claims: Sequence[Claim]) -> list[Headline]:
    """The paper's conclusions in the order of its claims.toml.

    Parameters
    ----------
    words : sequence of HeadlineWords
    claims : sequence of Claim
        The whole ledger of that paper.
    """
    ledger = {claim.id: claim for claim in claims}
    computed = {name: claim.computed for name, claim in ledger.items()}
    return [
        Headline(
            claim=conclusion.statement,
            result=fill(conclusion.result, computed, "headline.result"),
            standing=_standing([ledger[name] for name in conclusion.claims]),
            claims=conclusion.claims,
        )
        for conclusion in words
    ]


def _standing(claims: Sequence[Claim]) -> Standing:
    failed = [claim for claim in claims if claim.verdict != "reproduced"]
    if any(claim.decided and claim.verdict != "undecided" for claim in failed):
        return "does not hold"
    if failed:
        return "undecided"
    return "holds" if all(claim.decided for claim in claims) else "holds at the central values"
