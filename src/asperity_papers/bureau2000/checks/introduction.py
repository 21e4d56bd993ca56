"""Claims of the abstract, of section I and of the concluding remarks, section III.D."""

from __future__ import annotations

from typing import cast

import numpy as np
from scipy.integrate import quad

from asperity.laws import LinkerDieterich
from asperity.ledger import check
from asperity.theory import ageing_response, closed_forms as cf
from asperity_papers.bureau2000.checks.features import at_strongest, met, missed, over_the_range
from asperity_papers.bureau2000.machine import (
    EXT,
    LD,
    RR,
    SPEEDS,
    STRONGEST,
    Machine,
    by_speed,
)

Numbers = dict[str, float]
Mixed = dict[str, float | str]


# --- Abstract, and the summary of results in section I -------------------------------------------


@check("abstract-must-be-extended")
def must_be_extended(machine: Machine) -> Mixed:
    values = over_the_range(machine, RR)
    return {"missed": len(missed(values)), "met": met(values)}


@check("abstract-excellent-agreement")
def excellent_agreement(machine: Machine) -> Mixed:
    values = over_the_range(machine, EXT)
    measured = machine.outputs(EXT, lambda_=machine.numbers.lambda_quasi_static)
    return {
        "missed": len(missed(values)),
        "met": met(values),
        "met at 0.5": met(at_strongest(machine.outputs(EXT))),
        "met with measured lambda": met(at_strongest(measured)),
        "met with inertia": met(at_strongest(machine.inertial_outputs())),
    }


@check("linker-dieterich-not-better", LD, RR)
@check("plastic-rate", RR, EXT)
def missed_beyond(machine: Machine, law: str, other: str) -> Mixed:
    values, others = over_the_range(machine, law), over_the_range(machine, other)
    return {
        "difference": len(missed(values)) - len(missed(others)),
        law: met(values),
        other: met(others),
    }


@check("quasi-stationary-limit")
def quasi_stationary(machine: Machine) -> Numbers:
    V, p = machine.velocities[0], machine.numbers
    slow = 1e-2 * V / p.D0
    elastic = ageing_response(machine.small_modulation(V, omega=slow, lambda_=p.lambda_)).transfer
    rigid = ageing_response(machine.small_modulation(V, omega=slow)).transfer
    return {"relative change": float(abs(elastic)) / float(abs(rigid)) - 1}


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


@check("product-form-response")
def product_form_response(machine: Machine) -> Numbers:
    fast = machine.velocities[1]
    a, b = (machine.response(n, fast, [STRONGEST]) for n in (RR, "strength-area"))
    return {
        "drop": float((b.delta_mu / a.delta_mu - 1)[0]),
        "mu1": float((b.mu1 / a.mu1 - 1)[0]),
        "mu2": float((b.mu2 / a.mu2 - 1)[0]),
    }


@check("amontons-mean")
def amontons_mean(machine: Machine) -> Numbers:
    changes = machine.curve("amontons").delta_mu.ravel()
    return {"largest change": max(abs(float(x)) for x in changes)}


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


# --- Concluding remarks --------------------------------------------------------------------------


@check("velocity-controls", EXT)
@check("age-negligible", RR)
def changes_without_age(machine: Machine, law: str) -> Numbers:
    return machine.ageless_changes(law)


@check("high-frequency-no-tool")
def not_a_good_tool(machine: Machine) -> Numbers:
    ratios: Numbers = {}
    for name, V in zip(SPEEDS, machine.velocities, strict=True):
        critical = float(cf.critical_pulsation(machine.small_modulation(V)))
        driven = 2 * np.pi * machine.numbers.frequency
        ratios[name] = _signal(machine, V, critical) / _signal(machine, V, driven)
    return ratios


def _signal(machine: Machine, V: float, omega: float) -> float:
    """Change of c1/eps by alpha = 0.02."""
    p = machine.numbers
    point = {"omega": omega, "lambda_": p.lambda_}
    with_alpha, without = (
        ageing_response(machine.small_modulation(V, alpha=alpha, **point)).transfer
        for alpha in (p.alpha_low, 0.0)
    )
    return float(abs(with_alpha - without))
