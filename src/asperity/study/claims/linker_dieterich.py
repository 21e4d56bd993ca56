"""Claims of section III.B: Linker and Dieterich's ageing law."""

from __future__ import annotations

import numpy as np

from asperity.solve import closed_forms as cf
from asperity.study.claims import rules
from asperity.study.claims.claim import Claim, judged
from asperity.study.claims.curves import (
    LD,
    RR,
    STRONGEST,
    amplitude_slopes,
    at,
    curve,
    experiment,
    paper,
    relative,
    response,
    small_modulation,
    velocities,
    velocity_exponent,
)
from asperity.study.claims.features import Outputs, outputs
from asperity.study.claims.integration import periodic_orbit
from asperity.study.claims.perturbative import SMALL, TOLERANCE

_LD = "Linker-Dieterich law, periodic orbits at 1 and 10 um/s, eps = 0.5"


def claims() -> list[Claim]:
    """All claims of section III.B."""
    return [
        _first_harmonic(),
        _sizeable_fraction(),
        _significant_effect(),
        _estimated_alpha(),
        _depends_on_alpha(),
        _quasi_independent(),
        _significantly_smaller(),
        _harmonics_disagree(),
        _satisfactory_fit(),
        _close_to_rice_ruina(),
        _caption_mean(),
        _caption_harmonics(),
        _upper_limit(),
    ]


def low_alpha() -> Outputs:
    """Response at eps = 0.5 with alpha = 0.02."""
    return outputs(LD, alpha=paper().alpha_low)


def _first_harmonic() -> Claim:
    V, alpha = velocities()[1], paper().alpha
    formula = float(cf.first_harmonic(small_modulation(V, alpha=alpha), SMALL))
    found = abs(periodic_orbit(experiment(V, alpha=alpha), SMALL).c1)
    return judged(
        rules.agrees(found, TOLERANCE, "Eq. (25)"),
        {"mu1": formula},
        id="linker-dieterich-first-harmonic",
        place="Section III.B, Eq. (25)",
        statement="mu1 = (eps |mu - alpha|/A) (V/w) (K/W0).",
        stated="(eps |mu - alpha|/A) (V/w) (K/W0)",
        computed=f"{formula / SMALL:.6f} eps by the formula, {found / SMALL:.6f} eps integrated",
        how="alpha = 0.2, 10 um/s, Eq. (6) with its dW/dt integrated at eps = 0.001.",
        why="The limit of high frequency: alpha corrects the friction coefficient, as the text "
        "says.",
    )


def _sizeable_fraction() -> Claim:
    p = paper()
    low, high = p["alpha_granite"].si_range or (np.nan, np.nan)
    return judged(
        rules.between(0.2, 1, "alpha/mu"),
        {"alpha = 0.2": low / p.mu0_granite, "alpha = 0.3": high / p.mu0_granite},
        id="alpha-sizeable",
        place="Section III.B",
        statement="For granite alpha = 0.2 to 0.3 is a sizeable fraction of mu, about 0.6.",
        stated="sizeable",
        computed=f"{low / p.mu0_granite:.2f} to {high / p.mu0_granite:.2f}",
        how="alpha over mu.",
        why="A third to a half.",
    )


def _significant_effect() -> Claim:
    p = paper()
    mu = float(small_modulation(velocities()[1]).mu)
    change = abs(mu - p.alpha) / mu - 1
    drop = outputs(LD).delta_mu[1] / outputs(RR).delta_mu[1] - 1
    return judged(
        rules.below(-rules.QUASI, "relative change"),
        {"mu1, small eps": change, "drop at eps = 0.5": drop},
        id="alpha-significant",
        place="Section III.B",
        statement="alpha = 0.2 is expected to change the shear response significantly.",
        stated="significant",
        computed=f"mu1 {change:+.0%} at small eps, drop {drop:+.0%} at eps = 0.5, 10 um/s",
        how="Eqs. (20), (25); Rice-Ruina and Linker-Dieterich laws.",
        why="The ageing law takes back part of the change of strength.",
    )


def _estimated_alpha() -> Claim:
    p = paper()
    ratio = p.alpha_low / p.alpha
    return judged(
        rules.of_order(p.alpha_estimate_ratio, "alpha used over alpha of Linker and Dieterich"),
        {"ratio": ratio},
        id="alpha-estimate",
        place="Section III.B",
        statement="For a Greenwood interface alpha is estimated an order of magnitude smaller.",
        stated=str(p["alpha_estimate_ratio"]),
        computed=f"alpha = 0.02, which the paper goes on to use, is {ratio:g} of 0.2",
        how="Consistency only: the paper refers to unpublished work and gives no derivation.",
        why="The estimate itself cannot be computed from the text.",
    )


def _depends_on_alpha() -> Claim:
    ratio = low_alpha().delta_mu[0] / outputs(LD).delta_mu[0]
    return judged(
        rules.above(1.5, "drop at alpha = 0.02 over drop at alpha = 0.2"),
        {"1 um/s": ratio, "10 um/s": low_alpha().delta_mu[1] / outputs(LD).delta_mu[1]},
        id="drop-depends-on-alpha",
        place="Section III.B, Fig. 9a",
        statement="The drop of the mean depends strongly on alpha.",
        stated="strongly",
        computed=f"a factor of {ratio:.2f} between alpha = 0.02 and 0.2 at 1 um/s",
        how=f"{_LD}.",
        why="In the averaged balance alpha is subtracted from mu.",
    )


def _quasi_independent() -> Claim:
    changes = {
        "alpha = 0.02": relative(low_alpha().delta_mu),
        "alpha = 0.2": relative(outputs(LD).delta_mu),
    }
    return judged(
        rules.change_below(rules.QUASI, "from 1 to 10 um/s, the drop"),
        changes,
        id="linker-dieterich-drop-velocity",
        place="Section III.B, Fig. 9a",
        statement="Whatever alpha, the drop remains quasi-independent of V.",
        stated="quasi-independent",
        computed="; ".join(f"{k}: {v:+.1%}" for k, v in changes.items()),
        how=f"{_LD}.",
        why="At alpha = 0.2 twice as dependent as at 0.02: mu - alpha falls faster than mu.",
    )


def _significantly_smaller() -> Claim:
    drop, measured = outputs(LD).relative_drop, paper().relative_drop
    return judged(
        rules.below(1 - rules.QUASI, "drop over the measured drop"),
        {"1 um/s": drop[0] / measured, "10 um/s": drop[1] / measured},
        id="linker-dieterich-drop-too-small",
        place="Section III.B, Fig. 9a; Section I (ii)",
        statement="For alpha = 0.2 the drop is significantly smaller than measured.",
        stated="significantly smaller",
        computed=f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s, measured 20 %",
        how=f"{_LD}, eps_eff = 0.48 eps.",
        why="Less than half.",
    )


def _harmonics_disagree() -> Claim:
    r = curve(LD)
    exponents = [velocity_exponent(r.mu1), velocity_exponent(r.mu2)]
    slopes = amplitude_slopes(r.mu1)[:, -1]
    return judged(
        rules.above(rules.HALF_A_DECADE, "departure from the measurement"),
        {
            "exponent of mu1 in V": exponents[0],
            "orders of magnitude of mu1 at 1 um/s": float(
                np.log10(paper().mu1_order / at(r.mu1)[0])
            ),
        },
        id="linker-dieterich-harmonics-disagree",
        place="Section III.B, Figs. 9b, 9c",
        statement="As for Rice-Ruina, mu1 and mu2 clearly disagree with the data in eps and V.",
        stated="clearly disagree",
        computed=f"exponents in V {exponents[0]:.2f} and {exponents[1]:.2f}, logarithmic slope of "
        "mu1 "
        f"in eps {slopes[0]:.2f}",
        how=f"{_LD}, alpha = 0.2; measured: no V-dependence, no saturation.",
        why="The age law does not touch what makes the harmonics proportional to V.",
    )


def _satisfactory_fit() -> Claim:
    drop = low_alpha().relative_drop
    return judged(
        rules.change_below(rules.WEAK, "against the measured 20 %, the relative drop"),
        {f"{V} um/s": d / paper().relative_drop - 1 for V, d in zip((1, 10), drop, strict=True)},
        id="small-alpha-fits",
        place="Section III.B, Fig. 9a",
        statement="alpha = 0.02 fits the drop satisfactorily.",
        stated="satisfactory",
        computed=f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s",
        how=f"{_LD}, alpha = 0.02.",
        why="Slightly below the Rice-Ruina drop.",
    )


def _close_to_rice_ruina() -> Claim:
    a, b = low_alpha(), outputs(RR)
    changes = {
        "mu1, 1 um/s": a.mu1[0] / b.mu1[0] - 1,
        "mu1, 10 um/s": a.mu1[1] / b.mu1[1] - 1,
        "mu2, 1 um/s": a.mu2[0] / b.mu2[0] - 1,
        "mu2, 10 um/s": a.mu2[1] / b.mu2[1] - 1,
    }
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "against Rice-Ruina, each harmonic"),
        changes,
        id="small-alpha-close-to-rice-ruina",
        place="Section III.B, Figs. 9b, 9c; Section I (ii)",
        statement="With alpha = 0.02 mu1 and mu2 are very close to those of Rice-Ruina.",
        stated="very close",
        computed="; ".join(f"{k}: {v:+.2%}" for k, v in changes.items()),
        how=f"{_LD}.",
        why="The age effects of so small an alpha are negligible at 120 Hz.",
    )


def _caption_mean() -> Claim:
    missing, dotted = low_alpha().delta_mu[0], outputs(LD).delta_mu[0]
    full = low_alpha().delta_mu[1]
    return judged(
        rules.change_below(rules.NEGLIGIBLE, "against the dotted line, the drop"),
        {"drop": missing / dotted - 1},
        id="caption-mean",
        place="Fig. 9a, caption",
        statement="The curve of 1 um/s, alpha = 0.02 would be undistinguishable from the dotted "
        "one.",
        stated="undistinguishable from 1 um/s, alpha = 0.2",
        computed=f"drop {-missing:.4f}; dotted line {-dotted:.4f}, full line (10 um/s, alpha = "
        "0.02) "
        f"{-full:.4f}",
        how=f"{_LD}.",
        why="In panel (a) the curve left out is twice the dotted one and lies by the full one, 8 % "
        "from it. A slip of the caption, right for panels (b) and (c).",
    )


def _caption_harmonics() -> Claim:
    a, b = curve(LD, alpha=paper().alpha_low), curve(LD)
    scale = paper().mu1_order
    gaps = {
        "mu1": float(np.abs(a.mu1 - b.mu1)[0].max()) / scale,
        "mu2": float(np.abs(a.mu2 - b.mu2)[0].max()) / scale,
    }
    return judged(
        rules.below(rules.NEGLIGIBLE, "largest gap between the two curves over 0.001"),
        gaps,
        id="caption-harmonics",
        place="Figs. 9b, 9c, caption",
        statement="The curves of 1 um/s, alpha = 0.02 would be undistinguishable from the dotted "
        "ones.",
        stated="undistinguishable from 1 um/s, alpha = 0.2",
        computed=f"at most {1e6 * gaps['mu1'] * scale:.1f}e-6 (mu1) and "
        f"{1e6 * gaps['mu2'] * scale:.1f}e-6 (mu2) apart",
        how="Linker-Dieterich law at 1 um/s over all amplitudes; the scale of the panels is that "
        "of "
        "the data, of order 0.001.",
        why="At 1 um/s both are an order of magnitude below the data.",
    )


def _upper_limit() -> Claim:
    p = paper()
    applied = np.linspace(STRONGEST, 1.0, 11)
    drops = -response(LD, velocities()[0], applied).delta_mu
    wanted = p.relative_drop * at(curve(LD).mu_ss)[0]
    needed = float(np.interp(wanted, drops, applied)) * p.transmission / STRONGEST
    loss = 1 - low_alpha().delta_mu[0] / outputs(RR).delta_mu[0]
    return judged(
        rules.above(1.5, "eps_eff/eps that alpha = 0.2 needs, over the measured 0.4"),
        {"1 um/s": needed / p.transmission_air_over_vacuum},
        id="alpha-upper-limit",
        place="Section III.B (i), (ii); Section III.D",
        statement="The drop excludes alpha = 0.2 and sets an upper limit on alpha.",
        stated="upper limit; alpha = 0.2 does not agree",
        computed=f"alpha = 0.2 would need eps_eff/eps = {needed:.2f} for a drop of 20 %; alpha = "
        "0.02 "
        f"lowers the drop by {loss:.1%}",
        how="Linker-Dieterich law at 1 um/s, eps = 0.5.",
        why="alpha and the fitted eps_eff/eps trade off against each other in the drop: it is the "
        "measurement in vacuo, 0.4, that excludes alpha = 0.2.",
    )
