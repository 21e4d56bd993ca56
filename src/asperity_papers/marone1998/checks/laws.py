"""Claims on the equations themselves: steady states, states at rest, decay, stability."""

from __future__ import annotations

import numpy as np

from asperity.experiment import step_response
from asperity.ledger import check
from asperity.theory import holds_and_steps, linear_stability
from asperity_papers.marone1998.laboratory import (
    AGEING,
    DECADE,
    LAWS,
    PRZ,
    SLIP,
    Laboratory,
    Numbers,
    by_law,
)


def _rate(law: object, v: float, log_age: float) -> float:
    """D ln(theta)/dt (1/s) of a law of the library."""
    (rate,) = law.state_rate(v, v, (np.array(log_age),), 1.0)  # type: ignore[attr-defined]
    return float(rate)


@check("steady-state-slope")
def steady_state_slope(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    V = p.V0 * np.array([0.1, 10.0])

    def off(name: str) -> float:
        mu = np.asarray(laboratory.illustration(name).mu_ss(V))
        return float(np.diff(mu)[0] / np.log(100) / (p.A_2 - p.B_2) - 1)

    return by_law(off)


@check("dynamic-slope-per-decade")
def dynamic_slope(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    mu = np.asarray(laboratory.illustration(AGEING).mu_ss(p.V0 * np.array([1.0, 10.0])))
    slope = float(mu[1] - mu[0])
    return {
        "printed": (p.B_2 - p.A_2) * DECADE,
        "derived": -(p.B_2 - p.A_2) * DECADE,
        "independent": slope,
    }


@check("linear-decay")
def linear_decay(laboratory: Laboratory) -> Numbers:
    p = laboratory.numbers
    rate = linear_stability.decay_rates(laboratory.illustration(PRZ), p.V0)[0].real
    return {"off": float(rate * p.D0_2 - 1)}


@check("contact-lifetime")
def contact_lifetime(laboratory: Laboratory) -> Numbers:
    p, law = laboratory.numbers, laboratory.illustration(AGEING)
    V = 3 * p.V0
    # theta = Dc/V as ln(V0 theta/Dc).
    return {"off": _rate(law, V, -np.log(3.0)) * p.D0_2 / V}


@check("growth-at-rest")
def growth_at_rest(laboratory: Laboratory) -> Numbers:
    p, law = laboratory.numbers, laboratory.illustration(AGEING)
    # d theta/dt = theta d ln(theta)/dt at theta = 2 Dc/V0.
    return {"off": 2 * p.D0_2 / p.V0 * _rate(law, 0.0, np.log(2.0)) - 1}


@check("no-friction-at-rest")
def no_friction_at_rest(laboratory: Laboratory) -> Numbers:
    law, V0 = laboratory.illustration(AGEING), laboratory.numbers.V0
    mu = [
        float(law.friction(v, tuple(law.steady_state(V0)), 1.0)) for v in (1e-100, 1e-200, 1e-300)
    ]
    return {"fall per 100 decades": mu[0] - mu[1], "the same again": mu[1] - mu[2]}


@check("slip-law-at-rest")
def slip_law_at_rest(laboratory: Laboratory) -> Numbers:
    return {"change": 1e5 * _rate(laboratory.illustration(SLIP), 0.0, np.log(2.0))}


@check("ageing-at-rest")
def ageing_at_rest(laboratory: Laboratory) -> Numbers:
    p, off = laboratory.numbers, {}
    for name, length in ((AGEING, p.D0_2), (PRZ, 2 * p.D0_2)):
        # A rate of theta that is 1 whatever theta is makes it theta_0 + t.
        rates = [age * length / p.V0 * _rate(laboratory.illustration(name), 0.0, np.log(age))
                 for age in (0.1, 1.0, 1e4)]  # fmt: skip
        off[LAWS[name]] = max(abs(rate - 1) for rate in rates)
    return off


@check("slip-scales-with-velocity")
def slip_scales_with_velocity(laboratory: Laboratory) -> Numbers:
    """Slip at imposed velocity until ln(theta/theta_ss) is 5 % of ln r, by the closed form."""
    p = laboratory.numbers
    u = np.linspace(0, 20, 200_001) * p.D0_2
    slips = {}
    for r in (2.0, 10.0, 100.0):
        state = np.asarray(holds_and_steps.state_after_step(laboratory.illustration(AGEING), r, u))
        slips[r] = float(u[np.argmax(state <= 0.05 * np.log(r))] / p.D0_2)
    return {
        "2 to 10": slips[10.0] / slips[2.0],
        "10 to 100": slips[100.0] / slips[10.0],
        **{f"at {r:g}": slip for r, slip in slips.items()},
    }


@check("prz-symmetric", PRZ)
def symmetric(laboratory: Laboratory, name: str) -> Numbers:
    u = laboratory.numbers.D0_2 * np.array([0.1, 1.0, 3.0])
    law = laboratory.illustration(name)
    up, down = (np.asarray(holds_and_steps.state_after_step(law, r, u)) for r in (10.0, 0.1))
    return {"off": float(np.max(np.abs(up + down)))}


@check("slip-law-symmetric")
def slip_law_symmetric(laboratory: Laboratory) -> Numbers:
    p, law = laboratory.numbers, laboratory.illustration(SLIP)
    step = step_response(
        law, velocity_before=[p.V0, 10 * p.V0], velocity=[10 * p.V0, p.V0], stiffness=p.k_2
    )
    sizes = np.abs(step.direct)
    springs = {"up on the spring": float(sizes[0]), "down on the spring": float(sizes[1])}
    return symmetric(laboratory, SLIP) | springs


@check("healing-law-as-rate")
def healing_law_as_rate(laboratory: Laboratory) -> Numbers:
    """Healing per decade at the end of a hold: b ln(t) as it is printed, and b ln 10."""
    p, time = laboratory.numbers, 1e16
    held = laboratory.holds(AGEING, 1e3 * p.k_stiff, p.V_stiff, time)
    return {
        "printed": p.B * float(np.log(time)),
        "derived": p.B * DECADE,
        "independent": float(held.healing_rate),
    }


@check("normalising-by-length")
def normalising_by_length(laboratory: Laboratory) -> Numbers:
    k, V = laboratory.stiff
    # Fixed k Dc: times over Dc/V are all that is left.
    one = laboratory.healing(AGEING, k, V, np.array([1e2, 1e4]))
    D0 = 5 * laboratory.numbers.D0
    other = laboratory.healing(AGEING, k / 5, V, 5 * np.array([1e2, 1e4]), D0=D0)
    return {"off": float(np.max(np.abs(other / one - 1)))}


@check("stability")
def stability(laboratory: Laboratory) -> Numbers:
    p, below, above = laboratory.numbers, {}, {}
    for name, letter in LAWS.items():
        weak = linear_stability.critical_stiffness(laboratory.granite(name), p.V0)
        strong = linear_stability.critical_stiffness(laboratory.granite(name, A=0.01), p.V0)
        below[f"{letter}, weakening"] = weak * p.D0 / (p.B - p.A)
        # Stable at any stiffness: none is critical.
        above[f"{letter}, strengthening"] = 1.0 if strong == 0 else -1.0
    return {**below, **above}
