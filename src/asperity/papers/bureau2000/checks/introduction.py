"""Claims of section I: the laws and what they imply."""

from __future__ import annotations

from typing import cast

import numpy as np

from asperity.laws import LinkerDieterich
from asperity.papers.bureau2000.checks.model import LD, RR, STRONGEST, Model, at, both, percent
from asperity.papers.ledger import rules
from asperity.papers.ledger.checks import CheckResult, check


def _fastness(model: Model, V: float) -> float:
    p = model.numbers
    return 2 * np.pi * p.frequency * p.D0 / V


@check("fast-at-the-data")
def _fast_at_the_data(model: Model) -> CheckResult:
    slow, fast = (_fastness(model, V) for V in model.velocities)
    return CheckResult(
        {"1 um/s": slow, "10 um/s": fast}, f"ratio {slow:.0f} and {fast:.0f} at 1 and 10 um/s"
    )


@check("fast-everywhere")
def _fast_everywhere(model: Model) -> CheckResult:
    _, top = model.numbers["V_range"].si_range or (np.nan, np.nan)
    ratio = _fastness(model, top)
    limit = top * ratio / rules.WORDS["much larger"]
    return CheckResult(
        {"100 um/s": ratio},
        f"ratio {ratio:.1f} at 100 um/s; 10 is reached at {1e6 * limit:.0f} um/s",
    )


@check("rate-and-state-order")
def _rate_and_state_order(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult({"A": p.A, "B": p.B}, f"A = {p.A:g}, B = {p.B:g}, B - A = {p.B - p.A:g}")


@check("steady-age")
def _steady_age(model: Model) -> CheckResult:
    law = model.slider(RR).law
    rates = [
        float(law.state_rate(V, V, law.steady_state(V), 1.0)[0]) * model.numbers.D0 / V
        for V in model.velocities
    ]
    return CheckResult(
        {"1 um/s": rates[0], "10 um/s": rates[1]}, f"d ln(Phi)/dt = {rates[0]:.1g} V/D0 there"
    )


def _log_slope(model: Model, steady: bool) -> float:
    law, V = model.slider(RR).law, model.velocities[1]
    factor = 1.01
    state = law.steady_state(V)
    moved = law.steady_state(V * factor) if steady else state
    change = law.friction(V * factor, moved, 1.0) - law.friction(V, state, 1.0)
    return float(change) / float(np.log(factor))


@check("direct-strengthening")
def _direct_strengthening(model: Model) -> CheckResult:
    slope = _log_slope(model, steady=False)
    return CheckResult({"slope": slope}, f"d mu/d ln v = {slope:+.4f} = A")


@check("steady-weakening")
def _steady_weakening(model: Model) -> CheckResult:
    slope = _log_slope(model, steady=True)
    return CheckResult({"slope": slope}, f"d mu/d ln V = {slope:+.4f} = A - B")


@check("product-form-steady")
def _product_form(model: Model) -> CheckResult:
    low, high = model.numbers["rate_state_velocity"].si_range or (np.nan, np.nan)
    V = np.geomspace(low, high, 41)
    product, total = (np.asarray(model.slider(n).law.mu_ss(V)) for n in ("strength-area", RR))
    worst = float(np.abs(product / total - 1).max())
    p = model.numbers
    return CheckResult(
        {"relative change": worst},
        f"eta = {p.A / p.mu0:.3f}, m = {p.B / p.mu0:.3f}; at most {percent(worst)} of mu "
        "from 0.01 to 100 um/s",
    )


@check("product-form-response")
def _product_response(model: Model) -> CheckResult:
    fast = model.velocities[1]
    a, b = (model.response(n, fast, [STRONGEST]) for n in (RR, "strength-area"))
    changes = {
        "drop": float((b.delta_mu / a.delta_mu - 1)[0]),
        "mu1": float((b.mu1 / a.mu1 - 1)[0]),
        "mu2": float((b.mu2 / a.mu2 - 1)[0]),
    }
    return CheckResult(
        changes,
        "; ".join(f"{k} {v:+.1%}" for k, v in changes.items()) + " from keeping it, at 10 um/s",
    )


@check("amontons-mean")
def _amontons_mean(model: Model) -> CheckResult:
    shift = max(abs(float(x)) for x in model.curve("amontons").delta_mu.ravel())
    return CheckResult({"largest change": shift}, f"changed by at most {shift:.1g}")


@check("amontons-harmonic")
def _amontons_harmonic(model: Model) -> CheckResult:
    r, p = model.curve("amontons"), model.numbers
    mu1 = at(r.mu1)[0] / (p.mu0 * p.transmission * STRONGEST)
    mu2 = at(r.mu2)[0] / at(r.mu1)[0]
    return CheckResult(
        {"mu1/(mu eps) - 1": abs(mu1 - 1), "mu2/mu1": mu2},
        f"mu1/(mu eps) = {mu1:.12g}, mu2/mu1 = {mu2:.1g}",
    )


@check("anharmonic-response")
def _anharmonic(model: Model) -> CheckResult:
    ratio = model.outputs(RR).mu2_over_mu1
    return CheckResult({"1 um/s": ratio[0], "10 um/s": ratio[1]}, f"mu2/mu1 = {both(ratio)}")


@check("age-jump")
def _age_jump(model: Model) -> CheckResult:
    law = cast(LinkerDieterich, model.slider(LD).law)
    step, state = 1.1, law.steady_state(model.numbers.V0)
    jump = float(np.exp(law.log_age(state, step) - law.log_age(state, 1.0)))
    integrated = step ** (-model.numbers.alpha / model.numbers.B)
    return CheckResult(
        {"printed": jump, "independent": integrated},
        f"a step of +10 % multiplies the age by {jump:.3f} = 1.1^(-alpha/B)",
    )


@check("no-loss-of-contact")
def _no_loss_of_contact(model: Model) -> CheckResult:
    _, largest = model.numbers["epsilon_range"].si_range or (np.nan, np.nan)
    return CheckResult({"smallest W/W0": 1 - largest}, f"smallest W/W0 = {1 - largest:g}")


@check("area-proportional-to-load")
def _area_proportional_to_load(model: Model) -> CheckResult:
    separations = np.array([3.0, 4.0, 5.0])
    exponents = {f"gap of {d:g} roughnesses": greenwood_williamson_exponent(d) for d in separations}
    return CheckResult(
        exponents,
        "the area varies as W^"
        + ", W^".join(f"{value:.3f}" for value in exponents.values())
        + " for gaps of 3, 4 and 5 roughnesses",
    )


def greenwood_williamson_exponent(separation: float) -> float:
    """D ln(area)/d ln(load) of Gaussian heights, at a gap in units of their standard deviation.

    Spherical tips that are higher than the gap by s bear a load in proportion to s^(3/2) on an area
    in proportion to s (Greenwood and Williamson).
    """
    from scipy.integrate import quad

    def moment(power: float) -> float:
        top = separation + 12.0
        return float(
            quad(lambda z: (z - separation) ** power * np.exp(-(z**2) / 2), separation, top)[0]
        )

    # The derivative of s^p with the gap is -p s^(p - 1).
    return (moment(0.0) / moment(1.0)) / (1.5 * moment(0.5) / moment(1.5))
