"""Claims of the abstract, of section I and of the concluding remarks, section III.D."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import cast

import numpy as np
from scipy.integrate import quad

from asperity.laws import LinkerDieterich
from asperity.ledger import check, judge_claims
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    PAPER,
    RR,
    Law,
    Machine,
    Mixed,
    Numbers,
    by_speed,
)

#: Features of the response at 120 Hz, 1 and 10 um/s, and the claim that states each. The text
#: prints no experimental points; a law is compared with what these claims say was measured.
FEATURES: Mapping[str, str] = {
    "drop": "relative-drop",
    "drop against V": "drop-velocity-independent",
    "mu1": "mu1-order",
    "mu1 against V": "mu1-velocity-independent",
    "drop over mu1": "drop-over-mu1",
    "mu2 over mu1": "mu2-over-mu1",
    "mu2 against V": "mu2-lower-when-slow",
}


def missed(machine: Machine, law: Law) -> list[str]:
    """The features that a law does not meet, judged by the rules and amplitudes of their claims."""
    stated = tuple(entry for entry in PAPER.contents.claim if entry.id in FEATURES.values())
    contents = PAPER.contents.model_copy(update={"claim": stated})
    model = SimpleNamespace(terms=machine.terms | {"EXT": law})
    claims = judge_claims(contents, {}, machine.numbers, lambda _: model)
    failed = {claim.id for claim in claims if claim.verdict != "reproduced"}
    return [name for name, claim in FEATURES.items() if claim in failed]


def met(machine: Machine, law: Law) -> str:
    """How many of the features a law meets, and which it misses, as text."""
    lacking, total = missed(machine, law), len(FEATURES)
    text = f"{total - len(lacking)} of {total}"
    return f"{text} (not: {', '.join(lacking)})" if lacking else text


# --- Abstract, and the summary of results in section I -------------------------------------------


@check("abstract-must-be-extended")
def must_be_extended(machine: Machine) -> Mixed:
    return {"missed": len(missed(machine, Law(RR))), "met": met(machine, Law(RR))}


@check("abstract-excellent-agreement")
def excellent_agreement(machine: Machine) -> Mixed:
    measured = {"lambda_": machine.numbers.lambda_quasi_static}
    return {
        "missed": len(missed(machine, Law(EXT))),
        "met": met(machine, Law(EXT)),
        "met at 0.5": met(machine, Law(EXT, strongest=True)),
        "met with measured lambda": met(machine, Law(EXT, measured, strongest=True)),
        "met with inertia": met(machine, Law(EXT, inertia=True)),
    }


@check("linker-dieterich-not-better", LD, RR)
@check("plastic-rate", RR, EXT)
def missed_beyond(machine: Machine, law: str, other: str) -> Mixed:
    beyond = len(missed(machine, Law(law))) - len(missed(machine, Law(other)))
    return {"difference": beyond, law: met(machine, Law(law)), other: met(machine, Law(other))}


# --- The laws and what they imply ----------------------------------------------------------------


@check("steady-age")
def steady_age(machine: Machine) -> Numbers:
    law = machine.slider(RR).law
    return by_speed(
        float(law.state_rate(V, V, law.steady_state(V), 1.0)[0]) * machine.numbers.D0 / V
        for V in machine.velocities
    )


@check("direct-strengthening", False)
@check("steady-weakening", True)
def slope_with_velocity(machine: Machine, steady: bool) -> Numbers:
    """D mu/d ln v at a fixed age, and of steady sliding."""
    law, V, factor = machine.slider(RR).law, machine.velocities[1], 1.01
    state = law.steady_state(V)
    moved = law.steady_state(V * factor) if steady else state
    change = law.friction(V * factor, moved, 1.0) - law.friction(V, state, 1.0)
    return {"slope": float(change) / float(np.log(factor))}


@check("product-form-steady")
def product_form_steady(machine: Machine) -> Numbers:
    p, V = machine.numbers, np.geomspace(*machine.range_of("rate_state_velocity"), 41)
    product, total = (np.asarray(machine.slider(n).law.mu_ss(V)) for n in ("strength-area", RR))
    worst = float(np.abs(product / total - 1).max())
    return {"relative change": worst, "eta": p.A / p.mu0, "m": p.B / p.mu0}


@check("age-jump")
def age_jump(machine: Machine) -> Numbers:
    law = cast(LinkerDieterich, machine.slider(LD).law)
    step, state = 1.1, law.steady_state(machine.numbers.V0)
    return {
        "printed": float(np.exp(law.log_age(state, step) - law.log_age(state, 1.0))),
        "independent": step ** (-machine.numbers.alpha / machine.numbers.B),
    }


@check("area-proportional-to-load")
def area_proportional_to_load(machine: Machine) -> Numbers:
    gaps = (3.0, 4.0, 5.0)
    return {f"gap of {gap:g} roughnesses": greenwood_williamson_exponent(gap) for gap in gaps}


def greenwood_williamson_exponent(separation: float) -> float:
    """D ln(area)/d ln(load) of Gaussian heights, at a gap in units of their standard deviation.

    Spherical tips that are higher than the gap by s bear a load in proportion to s^(3/2) on an area
    in proportion to s (Greenwood and Williamson).
    """

    def moment(power: float) -> float:
        top = separation + 12.0
        return float(
            quad(lambda z: (z - separation) ** power * np.exp(-(z**2) / 2), separation, top)[0]
        )

    # The derivative of s^p with the gap is -p s^(p - 1).
    return (moment(0.0) / moment(1.0)) / (1.5 * moment(0.5) / moment(1.5))
