"""Claims of section I: the laws and what they imply."""

from __future__ import annotations

from typing import cast

import numpy as np

from asperity.laws import LinkerDieterich
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    LD,
    RR,
    STRONGEST,
    at,
    both,
    curve,
    paper,
    percent,
    response,
    slider,
    velocities,
)
from asperity.study.claims.features import outputs


def claims() -> list[Claim]:
    """All claims of section I but those of its summary of results."""
    return [
        _fast_at_the_data(),
        _fast_everywhere(),
        _rate_and_state_order(),
        _steady_age(),
        _direct_strengthening(),
        _steady_weakening(),
        _product_form(),
        _product_response(),
        _amontons_mean(),
        _amontons_harmonic(),
        _anharmonic(),
        _age_jump(),
        _no_loss_of_contact(),
    ]


def _fastness(V: float) -> float:
    p = paper()
    return 2 * np.pi * p.frequency * p.D0 / V


def _fast_at_the_data() -> Claim:
    slow, fast = (_fastness(V) for V in velocities())
    return judged(
        rules.above(rules.MUCH, "f over V/(2 pi D0)"),
        {"1 um/s": slow, "10 um/s": fast},
        id="fast-at-the-data",
        place="Abstract; Section I",
        statement="120 Hz is much larger than the natural frequency V/(2 pi D0) of ageing.",
        stated="f >> V/(2 pi D0)",
        computed=f"ratio {slow:.0f} and {fast:.0f} at 1 and 10 um/s",
        how="2 pi f D0/V with D0 = 0.4 um.",
        why="True at the velocities of the harmonic data.",
    )


def _fast_everywhere() -> Claim:
    _, top = paper()["V_range"].si_range or (np.nan, np.nan)
    ratio = _fastness(top)
    limit = top * ratio / rules.MUCH
    return judged(
        rules.above(rules.MUCH, "f over V/(2 pi D0)"),
        {"100 um/s": ratio},
        id="fast-everywhere",
        place="Section I",
        statement="f >> V/(2 pi D0) for all velocities up to 100 um/s.",
        stated="f >> V/(2 pi D0)",
        computed=f"ratio {ratio:.1f} at 100 um/s; 10 is reached at {1e6 * limit:.0f} um/s",
        how="2 pi f D0/V with D0 = 0.4 um.",
        why="At the upper end of the range the age does follow the modulation in part.",
    )


def _rate_and_state_order() -> Claim:
    p = paper()
    return judged(
        rules.of_order(p.AB_order, "A, B"),
        {"A": p.A, "B": p.B},
        id="rate-and-state-order",
        place="Section I, Eq. (1)",
        statement="A and B are of typical order 0.01, with B > A.",
        stated=str(paper()["AB_order"]),
        computed=f"A = {p.A:g}, B = {p.B:g}, B - A = {p.B - p.A:g}",
        how="Values measured in section III.",
        why="Holds for the pair of surfaces of the paper.",
    )


def _steady_age() -> Claim:
    law = slider(RR).law
    rates = [
        float(law.state_rate(V, V, law.steady_state(V), 1.0)[0]) * paper().D0 / V
        for V in velocities()
    ]
    return judged(
        rules.change_below(1e-12, "d ln(Phi)/dt in units of V/D0"),
        {"1 um/s": rates[0], "10 um/s": rates[1]},
        id="steady-age",
        place="Section I, Eq. (2)",
        statement="In stationary sliding at V the age is D0/V.",
        stated="Phi = D0/V",
        computed=f"d ln(Phi)/dt = {rates[0]:.1g} V/D0 there",
        how="Ageing law of the package evaluated at Phi = D0/V.",
        why="A zero of Eq. (2).",
    )


def _log_slope(steady: bool) -> float:
    law, V = slider(RR).law, velocities()[1]
    factor = 1.01
    state = law.steady_state(V)
    moved = law.steady_state(V * factor) if steady else state
    change = law.friction(V * factor, moved, 1.0) - law.friction(V, state, 1.0)
    return float(change) / float(np.log(factor))


def _direct_strengthening() -> Claim:
    slope = _log_slope(steady=False)
    return judged(
        rules.above(0, "d mu/d ln v at a given age"),
        {"slope": slope},
        id="direct-strengthening",
        place="Section I, Eq. (1)",
        statement="The first correction to mu0 is an instantaneous strengthening with velocity.",
        stated="strengthening",
        computed=f"d mu/d ln v = {slope:+.4f} = A",
        how="Rice-Ruina law, step of velocity at constant age.",
        why="The term A ln(v/V0).",
    )


def _steady_weakening() -> Claim:
    slope = _log_slope(steady=True)
    return judged(
        rules.below(0, "d mu_ss/d ln V"),
        {"slope": slope},
        id="steady-weakening",
        place="Section I, Eqs. (1), (2)",
        statement="In stationary sliding the age term makes friction weaken with velocity.",
        stated="weakening",
        computed=f"d mu/d ln V = {slope:+.4f} = A - B",
        how="Rice-Ruina law between two steady states.",
        why="Follows from B > A.",
    )


def _product_form() -> Claim:
    low, high = paper()["rate_state_velocity"].si_range or (np.nan, np.nan)
    V = np.geomspace(low, high, 41)
    product, total = (np.asarray(slider(n).law.mu_ss(V)) for n in ("strength-area", RR))
    worst = float(np.abs(product / total - 1).max())
    p = paper()
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "steady friction coefficient"),
        {"relative change": worst},
        id="product-form-steady",
        place="Section I, Eqs. (3)-(5)",
        statement="eta = A/mu0 and m = B/mu0 are so small that the product of logarithms may go.",
        stated="eta, m << 1",
        computed=f"eta = {p.A / p.mu0:.3f}, m = {p.B / p.mu0:.3f}; at most {percent(worst)} of mu "
        "from 0.01 to 100 um/s",
        how="Laws strength-area and rice-ruina in steady sliding, V0 = 1 um/s (not given).",
        why="The term is mu0 eta m ln(v/V0) ln(V0 Phi/D0); its size depends on the choice of V0.",
    )


def _product_response() -> Claim:
    fast = velocities()[1]
    a, b = (response(n, fast, [STRONGEST]) for n in (RR, "strength-area"))
    changes = {
        "drop": float((b.delta_mu / a.delta_mu - 1)[0]),
        "mu1": float((b.mu1 / a.mu1 - 1)[0]),
        "mu2": float((b.mu2 / a.mu2 - 1)[0]),
    }
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "drop, mu1 and mu2"),
        changes,
        id="product-form-response",
        place="Section I, Eq. (5)",
        statement="Dropping the product of logarithms is justified.",
        stated="can be neglected",
        computed="; ".join(f"{k} {v:+.1%}" for k, v in changes.items())
        + " from keeping it, at 10 um/s",
        how="Laws strength-area and rice-ruina, periodic orbits at eps = 0.5; at V = V0 they agree "
        "to five digits.",
        why="True of the response. Stability feels it more: the term changes the weakening slope, "
        "on "
        "which the threshold of stick-slip hangs.",
    )


def _amontons_mean() -> Claim:
    shift = max(abs(float(x)) for x in curve("amontons").delta_mu.ravel())
    return judged(
        rules.below(1e-12, "change of the mean friction coefficient"),
        {"largest change": shift},
        id="amontons-mean",
        place="Section I",
        statement="With Amontons-Coulomb friction the mean force is not modified.",
        stated="mu W0",
        computed=f"changed by at most {shift:.1g}",
        how="Law amontons, all amplitudes and both velocities.",
        why="F = mu W is linear in W.",
    )


def _amontons_harmonic() -> Claim:
    r, p = curve("amontons"), paper()
    mu1 = at(r.mu1)[0] / (p.mu0 * p.transmission * STRONGEST)
    mu2 = at(r.mu2)[0] / at(r.mu1)[0]
    return judged(
        rules.below(1e-12, "departure from a proportional, harmonic force"),
        {"mu1/(mu eps) - 1": abs(mu1 - 1), "mu2/mu1": mu2},
        id="amontons-harmonic",
        place="Section I",
        statement="With Amontons-Coulomb friction the force is modulated harmonically, as the "
        "load.",
        stated="mu1 = mu eps, no overtones",
        computed=f"mu1/(mu eps) = {mu1:.12g}, mu2/mu1 = {mu2:.1g}",
        how="Law amontons, eps_eff = 0.24.",
        why="The null model.",
    )


def _anharmonic() -> Claim:
    ratio = outputs(RR).mu2_over_mu1
    return judged(
        rules.above(rules.NEGLIGIBLE, "mu2/mu1"),
        {"1 um/s": ratio[0], "10 um/s": ratio[1]},
        id="anharmonic-response",
        place="Section I",
        statement="Rate-and-state friction responds anharmonically to a harmonic load.",
        stated="anharmonic",
        computed=f"mu2/mu1 = {both(ratio)}",
        how="Rice-Ruina law, periodic orbits at eps = 0.5.",
        why="The velocity depends exponentially on F/W.",
    )


def _age_jump() -> Claim:
    law = cast(LinkerDieterich, slider(LD).law)
    step, state = 1.1, law.steady_state(paper().V0)
    jump = float(np.exp(law.log_age(state, step) - law.log_age(state, 1.0)))
    expected = step ** (-paper().alpha / paper().B)
    return judged(
        rules.agrees(expected, 1e-12, "age after over age before the step"),
        {"ratio of ages": jump},
        id="age-jump",
        place="Section I, Eq. (6)",
        statement="A sudden change of normal stress changes the age suddenly.",
        stated="sudden change of Phi",
        computed=f"a step of +10 % multiplies the age by {jump:.3f} = 1.1^(-alpha/B)",
        how="Linker-Dieterich law, alpha = 0.2, whose state variable is continuous through a step.",
        why="Eq. (6) integrates to Phi W^(alpha/B) = constant across the step.",
    )


def _no_loss_of_contact() -> Claim:
    _, largest = paper()["epsilon_range"].si_range or (np.nan, np.nan)
    return judged(
        rules.above(0, "smallest W/W0"),
        {"smallest W/W0": 1 - largest},
        id="no-loss-of-contact",
        place="Section I; Section II.A",
        statement="With amplitudes from 0.005 to 0.5 contact is never lost.",
        stated="eps from 0.005 to 0.5",
        computed=f"smallest W/W0 = {1 - largest:g}",
        how="W/W0 = 1 + eps cos(wt).",
        why="In air the contacts bear less; in vacuo at 200 Hz up to 0.58, still below 1.",
    )
