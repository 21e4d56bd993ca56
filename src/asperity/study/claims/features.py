"""What the text says was measured, as a list that a model either meets or not.

The experimental points are not in the text. What it states in words and numbers about the response
at eps = 0.5, 120 Hz, 1 and 10 um/s is all the evidence there is to hold a model against.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from asperity.study.claims import rules
from asperity.study.claims.curves import (
    STRONGEST,
    at,
    curve,
    experiment,
    paper,
    relative,
    velocities,
)
from asperity.study.claims.integration import periodic_orbit
from asperity.study.claims.rules import Rule

Pair = tuple[float, float]


@dataclass(frozen=True)
class Outputs:
    """A model's response at eps = 0.5, each at the slow and the fast velocity."""

    mu_ss: Pair
    delta_mu: Pair
    mu1: Pair
    mu2: Pair

    @property
    def relative_drop(self) -> Pair:
        """Drop of the mean over the friction coefficient without modulation."""
        return self._divide(self.delta_mu, self.mu_ss, -1.0)

    @property
    def drop_over_mu1(self) -> Pair:
        """Drop of the mean over the first harmonic."""
        return self._divide(self.delta_mu, self.mu1, -1.0)

    @property
    def mu2_over_mu1(self) -> Pair:
        """Second over first harmonic."""
        return self._divide(self.mu2, self.mu1)

    @staticmethod
    def _divide(a: Pair, b: Pair, sign: float = 1.0) -> Pair:
        return sign * a[0] / b[0], sign * a[1] / b[1]


def outputs(law: str, **overrides: float) -> Outputs:
    """Quasi-static response of a law at eps = 0.5."""
    r = curve(law, **overrides)
    return Outputs(at(r.mu_ss), at(r.delta_mu), at(r.mu1), at(r.mu2))


def inertial_outputs() -> Outputs:
    """Response of the elasto-plastic law with the slider's inertia, integrated in time."""
    p = paper()
    epsilon = p.transmission * STRONGEST
    points = [experiment(V, M=p.M, lambda_=p.lambda_) for V in velocities()]
    # The quasi-static drop, where Newton's method starts.
    guess = -paper().relative_drop * paper().mu0
    slow, fast = (periodic_orbit(point, epsilon, guess) for point in points)
    return Outputs(
        (slow.mu, fast.mu),
        (slow.delta_mu, fast.delta_mu),
        (abs(slow.c1), abs(fast.c1)),
        (abs(slow.c2), abs(fast.c2)),
    )


def measured_rules() -> Mapping[str, Rule]:
    """Each stated feature and the rule that a model's value has to pass."""
    p = paper()
    ratio = p["mu2_over_mu1"].si_range or (float("nan"), float("nan"))
    return {
        "drop": rules.about(p.relative_drop, "relative drop of the mean"),
        "drop against V": rules.change_below(rules.WEAK, "drop from 1 to 10 um/s"),
        "mu1": rules.of_order(p.mu1_order, "mu1"),
        "mu1 against V": rules.change_below(rules.WEAK, "mu1 from 1 to 10 um/s"),
        "drop over mu1": rules.of_order(p.drop_over_mu1, "drop over mu1"),
        "mu2 over mu1": rules.between(*ratio, "mu2/mu1"),
        "mu2 against V": rules.above(rules.WEAK, "rise of mu2 from 1 to 10 um/s"),
    }


def values(model: Outputs) -> Mapping[str, tuple[float, ...]]:
    """The model's numbers that `measured_rules` judges."""
    return {
        "drop": model.relative_drop,
        "drop against V": (relative(model.delta_mu),),
        "mu1": model.mu1,
        "mu1 against V": (relative(model.mu1),),
        "drop over mu1": model.drop_over_mu1,
        "mu2 over mu1": model.mu2_over_mu1,
        "mu2 against V": (relative(model.mu2),),
    }


def missed(model: Outputs) -> list[str]:
    """The features that a model does not meet."""
    found = values(model)
    return [
        name
        for name, rule in measured_rules().items()
        if not all(rule.holds(value) for value in found[name])
    ]


def met(model: Outputs) -> str:
    """How many of the features a model meets, and which it misses, as text."""
    lacking, total = missed(model), len(measured_rules())
    text = f"{total - len(lacking)} of {total}"
    return f"{text} (not: {', '.join(lacking)})" if lacking else text
