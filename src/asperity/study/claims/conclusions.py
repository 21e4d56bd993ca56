"""Claims of section III.D: concluding remarks."""

from __future__ import annotations

import numpy as np

from asperity.solve import closed_forms as cf
from asperity.solve.ageing_response import ageing_response
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    APPLIED,
    EXT,
    LD,
    RR,
    ageless_changes,
    at,
    curve,
    paper,
    small_modulation,
    velocities,
)
from asperity.study.claims.features import met, missed, outputs


def claims() -> list[Claim]:
    """All claims of section III.D."""
    return [
        _as_soon_as_applied(),
        _harmonics_essential(),
        _velocity_controls(),
        _plastic_rate(),
        _smaller_alpha(),
        _not_a_good_tool(),
    ]


def _as_soon_as_applied() -> Claim:
    r, p = curve(EXT), paper()
    smallest = at(r.delta_mu, APPLIED[0])
    return judged(
        rules.below(0, "delta mu at the smallest amplitude, eps = 0.005"),
        {"1 um/s": smallest[0], "10 um/s": smallest[1]},
        id="as-soon-as-applied",
        place="Section III.D",
        statement="The lowering occurs as soon as the modulation is applied.",
        stated="no threshold",
        computed=f"{smallest[0]:.1e} at eps = 0.005, {at(r.delta_mu, p.epsilon_onset)[0]:.1e} at "
        "0.05",
        how="Elasto-plastic law, periodic orbits.",
        why="There is no threshold; below eps of about 0.02 the drop is quadratic, too small to be "
        "seen.",
    )


def _harmonics_essential() -> Claim:
    a, b = outputs(EXT), outputs(RR)
    drop, mu1 = a.delta_mu[0] / b.delta_mu[0], a.mu1[0] / b.mu1[0]
    return judged(
        rules.above(rules.MUCH, "change of mu1 between the two laws over that of the drop"),
        {"1 um/s": (mu1 - 1) / abs(drop - 1)},
        id="harmonics-essential",
        place="Section III.D",
        statement="To tell the models apart the harmonics have to be measured, not the mean alone.",
        stated="essential",
        computed=f"Rice-Ruina to elasto-plastic: drop x {drop:.3f}, mu1 x {mu1:.0f} at 1 um/s",
        how="Periodic orbits at eps = 0.5.",
        why="The mean follows from the averaged balance, which hardly contains the elasticity.",
    )


def _velocity_controls() -> Claim:
    changes = ageless_changes(EXT)
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "without the state term, drop, mu1 and mu2"),
        changes,
        id="velocity-controls",
        place="Section III.D",
        statement="At these frequencies the response is controlled by the rate-dependent term.",
        stated="controlled by the velocity modulation",
        computed="; ".join(f"{k} {v:+.1e}" for k, v in changes.items()) + " with B = 0, at 10 um/s",
        how="Elasto-plastic law with B = 0 at the same mu(V) against the full law, eps = 0.5.",
        why="The age has no time to follow.",
    )


def _plastic_rate() -> Claim:
    return judged(
        rules.above(0, "features met with the plastic rate beyond those met with the slider's"),
        {"difference": len(missed(outputs(RR))) - len(missed(outputs(EXT)))},
        id="plastic-rate",
        place="Section III.D",
        statement="mu1 and mu2 show that the relevant rate is that of plastic deformation.",
        stated="not the slider velocity",
        computed=f"plastic velocity: {met(outputs(EXT))}; slider velocity: {met(outputs(RR))}",
        how="Seven features that the text states at eps = 0.5.",
        why="What the elasticity of the asperities adds to mu1 is what was missing.",
    )


def _smaller_alpha() -> Claim:
    measured, low = paper().relative_drop, outputs(LD, alpha=paper().alpha_low)
    misfit = [1 - d / measured for d in outputs(LD).relative_drop]
    return judged(
        rules.above(rules.QUASI, "shortfall of the drop at alpha = 0.2"),
        {"1 um/s": misfit[0], "10 um/s": misfit[1]},
        id="smaller-alpha",
        place="Section III.D",
        statement="The effect of the load on the age is much smaller than Linker and Dieterich's.",
        stated="certainly much smaller",
        computed=f"the drop falls short by {misfit[0]:.0%} at alpha = 0.2, by "
        f"{1 - low.relative_drop[0] / measured:.0%} at 0.02 (1 um/s)",
        how="Linker-Dieterich law, eps = 0.5, eps_eff = 0.48 eps, measured drop 20 %.",
        why="Given the measured eps_eff/eps; see the claim on the upper limit of alpha.",
    )


def _not_a_good_tool() -> Claim:
    ratios = {}
    for name, V in zip(("1 um/s", "10 um/s"), velocities(), strict=True):
        wc = float(cf.critical_pulsation(small_modulation(V)))
        high, low = (_signal(V, omega) for omega in (2 * np.pi * paper().frequency, wc))
        ratios[name] = low / high
    return judged(
        rules.above(rules.MUCH, "change of the first harmonic by alpha at wc, over that at 120 Hz"),
        ratios,
        id="high-frequency-no-tool",
        place="Section III.D; Section III.B",
        statement="High frequencies are not a good tool for the effect on age; low ones, near the "
        "stick-slip frequency, are.",
        stated="not a good tool",
        computed="; ".join(f"{k}: x {v:.0f}" for k, v in ratios.items()),
        how="Exact linear response of elastic asperities (lambda = 0.7 um) with alpha = 0.02 and "
        "0, "
        "at w = wc and at 120 Hz: modulus of the difference.",
        why="The spring turns velocities into forces in proportion to 1/w, and near wc sliding is "
        "close to its instability.",
    )


def _signal(V: float, omega: float) -> float:
    """What alpha = 0.02 changes in c1/eps."""
    p = paper()
    point = {"omega": omega, "lambda_": p.lambda_}
    with_alpha = ageing_response(small_modulation(V, alpha=p.alpha_low, **point)).transfer
    return float(abs(with_alpha - ageing_response(small_modulation(V, **point)).transfer))
