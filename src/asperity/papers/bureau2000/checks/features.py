"""What the text says was measured, as a list that a law either meets or not.

The experimental points are not in the text. What it states in words and numbers about the response
at 120 Hz, 1 and 10 um/s is all the evidence there is to compare a law with. Each feature is judged
by the rule of the claim that states it, and over the amplitudes that the statement covers; a test
demands that the two agree.
"""

from __future__ import annotations

from collections.abc import Mapping

from asperity.papers.bureau2000.checks.model import (
    READ,
    STRONGEST,
    Model,
    Outputs,
    at,
    relative,
)
from asperity.papers.ledger import rules
from asperity.papers.ledger.rules import WORDS, AcceptanceRule

#: The claim that states each feature.
CLAIMS: Mapping[str, str] = {
    "drop": "relative-drop",
    "drop against V": "drop-velocity-independent",
    "mu1": "mu1-order",
    "mu1 against V": "mu1-velocity-independent",
    "drop over mu1": "drop-over-mu1",
    "mu2 over mu1": "mu2-over-mu1",
    "mu2 against V": "mu2-lower-when-slow",
}


def feature_rules(model: Model) -> Mapping[str, AcceptanceRule]:
    """Each stated feature and the rule that a law's numbers have to pass."""
    p = model.numbers
    low, high = p["mu2_over_mu1"].si_range or (float("nan"), float("nan"))
    return {
        "drop": rules.about(p.relative_drop, "relative drop of the mean"),
        "drop against V": rules.change_below(WORDS["weak"], "drop from 1 to 10 um/s"),
        "mu1": rules.of_order(p.mu1_order, "mu1"),
        "mu1 against V": rules.change_below(WORDS["weak"], "mu1 from 1 to 10 um/s"),
        "drop over mu1": rules.of_order(p.drop_over_mu1, "drop over mu1"),
        "mu2 over mu1": rules.between(low, high, "mu2/mu1"),
        "mu2 against V": rules.above(WORDS["sizeable"], "rise of mu2 from 1 to 10 um/s"),
    }


def at_strongest(model: Outputs) -> Mapping[str, tuple[float, ...]]:
    """A law's numbers at eps = 0.5."""
    return {
        "drop": model.relative_drop,
        "drop against V": (relative(model.delta_mu),),
        "mu1": model.mu1,
        "mu1 against V": (relative(model.mu1),),
        "drop over mu1": model.drop_over_mu1,
        "mu2 over mu1": model.mu2_over_mu1,
        "mu2 against V": (relative(model.mu2),),
    }


def over_the_range(model: Model, law: str, **overrides: float) -> Mapping[str, tuple[float, ...]]:
    """A law's numbers over the amplitudes that each statement covers."""
    r = model.curve(law, **overrides)
    own = dict(at_strongest(model.outputs(law, **overrides)))
    own["drop against V"] = tuple(relative(at(r.delta_mu, eps)) for eps in (0.2, 0.35, STRONGEST))
    own["mu1 against V"] = tuple(relative(at(r.mu1, eps)) for eps in READ)
    own["mu2 over mu1"] = tuple(v for eps in READ for v in at(r.mu2 / r.mu1, eps))
    own["mu2 against V"] = tuple(relative(at(r.mu2, eps)) for eps in READ)
    return own


def missed(model: Model, values: Mapping[str, tuple[float, ...]]) -> list[str]:
    """The features that a law's numbers do not meet."""
    return [
        name
        for name, rule in feature_rules(model).items()
        if not all(rule.holds(value) for value in values[name])
    ]


def met(model: Model, values: Mapping[str, tuple[float, ...]]) -> str:
    """How many of the features a law meets, and which it misses, as text."""
    lacking, total = missed(model, values), len(CLAIMS)
    text = f"{total - len(lacking)} of {total}"
    return f"{text} (not: {', '.join(lacking)})" if lacking else text
