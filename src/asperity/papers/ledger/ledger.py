"""All claims of a paper, computed and judged."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

from asperity.errors import InputError
from asperity.materials import Material
from asperity.papers.ledger.checks import CheckResult
from asperity.papers.ledger.claim import Claim, Entry, Sensitivity, judge, verdict
from asperity.papers.ledger.contents import Contents, Uncertainty
from asperity.parameters.arguments import counted

Check = Callable[[Any], CheckResult]


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
        What computes each claim, by its id.
    numbers : Material
        The paper's numbers at their central values.
    model : function
        From the paper's numbers to what the checks are given.
    sensitivity : bool
        Whether to compute each claim at the ends of the uncertainties that it depends on too.
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
        outcome = checks[entry.id](central)
        _require_numbers(entry.id, outcome)
        claims.append(judge(entry, outcome, stated))
        report(1)
    if not sensitivity:
        return claims
    found: dict[str, list[Sensitivity]] = {entry.id: [] for entry in contents.claim}
    for uncertainty in contents.uncertainty:
        resting = [e for e in contents.claim if uncertainty.quantity in e.depends_on]
        ends = [model(altered(numbers, end)) for end in (uncertainty.low, uncertainty.high)]
        for entry in resting:
            outcomes = [checks[entry.id](end).numbers for end in ends]
            found[entry.id].append(_sensitivity(entry, uncertainty, outcomes, stated))
    return [replace(claim, sensitivity=tuple(found[claim.id])) for claim in claims]


def _require_numbers(name: str, outcome: CheckResult) -> None:
    numbers: Mapping[str, Any] = outcome.numbers
    for key, value in numbers.items():
        if not isinstance(value, Real) or not math.isfinite(value):
            raise InputError(
                f"checks must compute finite numbers, got {value!r} for '{key}' of '{name}'; "
                "correct the check"
            )


def _sensitivity(
    entry: Entry,
    uncertainty: Uncertainty,
    outcomes: Sequence[Mapping[str, float]],
    stated: Mapping[str, float],
) -> Sensitivity:
    low, high = outcomes
    return Sensitivity(
        quantity=uncertainty.quantity,
        ends=(_text(uncertainty.low), _text(uncertainty.high)),
        numbers={name: (float(low[name]), float(high[name])) for name in low if name in high},
        verdicts=(verdict(entry, low, stated), verdict(entry, high, stated)),
    )


def _text(end: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in end.items())


def printed_numbers(numbers: Material) -> dict[str, float]:
    """The paper's single values in SI, and the ends of its ranges as NAME.low and NAME.high."""
    found = {
        name: number.si for name, number in numbers.numbers.items() if number.value is not None
    }
    for name, number in numbers.numbers.items():
        if number.si_range is not None:
            found[f"{name}.low"], found[f"{name}.high"] = number.si_range
    return found


def altered(numbers: Material, changes: Mapping[str, float]) -> Material:
    """The paper's numbers with some values replaced, in the units that they are printed in."""
    new = {
        name: numbers[name].model_copy(update={"value": value}) for name, value in changes.items()
    }
    return numbers.model_copy(update={"numbers": {**numbers.numbers, **new}})


def _check_pairs(entries: Sequence[Entry], checks: Mapping[str, Check]) -> None:
    ids = {entry.id for entry in entries}
    for name in sorted(ids - set(checks)):
        raise InputError(
            f"checks must compute every claim of claims.toml, got none for '{name}'; "
            f'mark a function with @check("{name}")'
        )
    for name in sorted(set(checks) - ids):
        raise InputError(
            f"claims.toml must hold every claim that is computed, got none for '{name}'; "
            "add [[claim]] with that id"
        )
