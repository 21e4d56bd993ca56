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
        _significant_lowering(),
        _as_soon_as_applied(),
        _harmonics_essential(),
        _velocity_controls(),
        _plastic_rate(),
        _smaller_alpha(),
        _not_a_good_tool(),
    ]


def _significant_lowering() -> Claim:
    drop = outputs(EXT).relative_drop
    return judged(
        rules.above(rules.WEAK, "relative drop at eps = 0.5"),
        {"1 um/s": drop[0], "10 um/s": drop[1]},
        id="significant-lowering",
        place="Section III.D",
        statement="Modulating the load lowers the dynamic friction coefficient significantly.",
        stated="significantly",
        computed=f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s",
        how="Elasto-plastic law, periodic orbits at eps = 0.5.",
        why="As in the abstract.",
    )


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
        computed=f"{smallest[0]:.1e} at eps = 0.005, {at(r.delta_mu, p.epsilon_onset)[0]:.1e} at 0.05",
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
    measured = paper().relative_drop
    misfit = {
        "alpha = 0.2": abs(outputs(LD).relative_drop[0] / measured - 1),
        "alpha = 0.02": abs(outputs(LD, alpha=paper().alpha_low).relative_drop[0] / measured - 1),
    }
    return judged(
        rules.above(rules.MUCH / 2, "misfit of the drop at alpha = 0.2 over that at 0.02"),
        {"1 um/s": misfit["alpha = 0.2"] / misfit["alpha = 0.02"]},
        id="smaller-alpha",
        place="Section III.D",
        statement="The effect of the load on the age is much smaller than Linker and Dieterich's.",
        stated="much smaller",
        computed="; ".join(f"{k}: {v:.0%} off" for k, v in misfit.items()),
        how="Linker-Dieterich law at 1 um/s, eps = 0.5, eps_eff = 0.48 eps, measured drop 20 %.",
        why="Given the measured eps_eff/eps, see the claim on the upper limit of alpha.",
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
        how="Exact linear response of elastic asperities (lambda = 0.7 um) with alpha = 0.02 and 0, "
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
