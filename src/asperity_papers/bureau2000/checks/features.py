"""What the text says was measured, as a list that a law either meets or not.

The experimental points are not in the text. What it states in words and numbers about the response
at 120 Hz, 1 and 10 um/s is all the evidence there is to compare a law with. Each feature is judged
by the rule of the claim that states it, and over the amplitudes that the statement covers.
"""

from __future__ import annotations

from collections.abc import Mapping

from asperity_papers.bureau2000.machine import (
    PAPER,
    READ,
    STRONGEST,
    Machine,
    Outputs,
    at,
    relative,
)

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
#: Numbers of a law, by feature.
Values = Mapping[str, tuple[float, ...]]


def at_strongest(outputs: Outputs) -> Values:
    """A law's numbers at eps = 0.5."""
    return {
        "drop": outputs.relative_drop,
        "drop against V": (relative(outputs.delta_mu),),
        "mu1": outputs.mu1,
        "mu1 against V": (relative(outputs.mu1),),
        "drop over mu1": outputs.drop_over_mu1,
        "mu2 over mu1": outputs.mu2_over_mu1,
        "mu2 against V": (relative(outputs.mu2),),
    }


def over_the_range(machine: Machine, law: str, **overrides: float) -> Values:
    """A law's numbers over the amplitudes that each statement covers."""
    r = machine.curve(law, **overrides)
    return {
        **at_strongest(machine.outputs(law, **overrides)),
        "drop against V": tuple(relative(at(r.delta_mu, e)) for e in (0.2, 0.35, STRONGEST)),
        "mu1 against V": tuple(relative(at(r.mu1, e)) for e in READ),
        "mu2 over mu1": tuple(v for e in READ for v in at(r.mu2 / r.mu1, e)),
        "mu2 against V": tuple(relative(at(r.mu2, e)) for e in READ),
    }


def missed(values: Values) -> list[str]:
    """The features that a law's numbers do not meet."""
    rules = {name: PAPER.rule(claim) for name, claim in CLAIMS.items()}
    return [n for n, rule in rules.items() if not all(rule.holds(value) for value in values[n])]


def met(values: Values) -> str:
    """How many of the features a law meets, and which it misses, as text."""
    lacking, total = missed(values), len(CLAIMS)
    text = f"{total - len(lacking)} of {total}"
    return f"{text} (not: {', '.join(lacking)})" if lacking else text
