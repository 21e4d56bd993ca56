"""Claims of section III.B: Linker and Dieterich's ageing law."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.model import (
    LD,
    RR,
    STRONGEST,
    Model,
    Outputs,
    amplitude_slopes,
    at,
    relative,
)
from asperity.papers.bureau2000.checks.perturbative import SMALL
from asperity.papers.ledger.checks import CheckResult, check
from asperity.theory import closed_forms as cf


def low_alpha(model: Model) -> Outputs:
    """Response at eps = 0.5 with alpha = 0.02."""
    return model.outputs(LD, alpha=model.numbers.alpha_low)


@check("linker-dieterich-first-harmonic")
def _first_harmonic(model: Model) -> CheckResult:
    V, alpha = model.velocities[1], model.numbers.alpha
    formula = float(cf.first_harmonic(model.small_modulation(V, alpha=alpha), SMALL))
    found = abs(model.orbit(model.operating_point(V, alpha=alpha), SMALL).c1)
    return CheckResult(
        {"printed": formula, "independent": found},
        f"{formula / SMALL:.6f} eps by the formula, {found / SMALL:.6f} eps integrated",
    )


@check("alpha-sizeable")
def _sizeable_fraction(model: Model) -> CheckResult:
    p = model.numbers
    low, high = p["alpha_granite"].si_range or (np.nan, np.nan)
    return CheckResult(
        {"alpha = 0.2": low / p.mu0_granite, "alpha = 0.3": high / p.mu0_granite},
        f"{low / p.mu0_granite:.2f} to {high / p.mu0_granite:.2f}",
    )


@check("alpha-significant")
def _significant_effect(model: Model) -> CheckResult:
    p = model.numbers
    mu = float(model.small_modulation(model.velocities[1]).mu)
    change = abs(mu - p.alpha) / mu - 1
    drop = model.outputs(LD).delta_mu[1] / model.outputs(RR).delta_mu[1] - 1
    return CheckResult(
        {"mu1, small eps": change, "drop at eps = 0.5": drop},
        f"mu1 {change:+.0%} at small eps, drop {drop:+.0%} at eps = 0.5, 10 um/s",
    )


@check("alpha-estimate")
def _estimated_alpha(model: Model) -> CheckResult:
    p = model.numbers
    ratio = p.alpha_low / p.alpha
    return CheckResult(
        {"ratio": ratio}, f"alpha = 0.02, which the paper goes on to use, is {ratio:g} of 0.2"
    )


@check("drop-depends-on-alpha")
def _depends_on_alpha(model: Model) -> CheckResult:
    ratio = low_alpha(model).delta_mu[0] / model.outputs(LD).delta_mu[0]
    return CheckResult(
        {"1 um/s": ratio, "10 um/s": low_alpha(model).delta_mu[1] / model.outputs(LD).delta_mu[1]},
        f"a factor of {ratio:.2f} between alpha = 0.02 and 0.2 at 1 um/s",
    )


@check("linker-dieterich-drop-velocity")
def _quasi_independent(model: Model) -> CheckResult:
    changes = {
        "alpha = 0.02": relative(low_alpha(model).delta_mu),
        "alpha = 0.2": relative(model.outputs(LD).delta_mu),
    }
    return CheckResult(changes, "; ".join(f"{k}: {v:+.1%}" for k, v in changes.items()))


@check("linker-dieterich-drop-too-small")
def _significantly_smaller(model: Model) -> CheckResult:
    drop, measured = model.outputs(LD).relative_drop, model.numbers.relative_drop
    return CheckResult(
        {"1 um/s": drop[0] / measured, "10 um/s": drop[1] / measured},
        f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s, measured 20 %",
    )


@check("linker-dieterich-harmonics-disagree")
def _harmonics_disagree(model: Model) -> CheckResult:
    r = model.curve(LD)
    exponents = [model.velocity_exponent(r.mu1), model.velocity_exponent(r.mu2)]
    slopes = amplitude_slopes(r.mu1)[:, -1]
    return CheckResult(
        {
            "exponent of mu1 in V": exponents[0],
            "orders of magnitude of mu1 at 1 um/s": float(
                np.log10(model.numbers.mu1_order / at(r.mu1)[0])
            ),
        },
        f"exponents in V {exponents[0]:.2f} and {exponents[1]:.2f}, logarithmic slope of mu1 "
        f"in eps {slopes[0]:.2f}",
    )


@check("small-alpha-fits")
def _satisfactory_fit(model: Model) -> CheckResult:
    drop = low_alpha(model).relative_drop
    return CheckResult(
        {
            f"{V} um/s": d / model.numbers.relative_drop - 1
            for V, d in zip((1, 10), drop, strict=True)
        },
        f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s",
    )


@check("small-alpha-close-to-rice-ruina")
def _close_to_rice_ruina(model: Model) -> CheckResult:
    a, b = low_alpha(model), model.outputs(RR)
    changes = {
        "mu1, 1 um/s": a.mu1[0] / b.mu1[0] - 1,
        "mu1, 10 um/s": a.mu1[1] / b.mu1[1] - 1,
        "mu2, 1 um/s": a.mu2[0] / b.mu2[0] - 1,
        "mu2, 10 um/s": a.mu2[1] / b.mu2[1] - 1,
    }
    return CheckResult(changes, "; ".join(f"{k}: {v:+.2%}" for k, v in changes.items()))


@check("caption-mean")
def _caption_mean(model: Model) -> CheckResult:
    missing, dotted = low_alpha(model).delta_mu[0], model.outputs(LD).delta_mu[0]
    full = low_alpha(model).delta_mu[1]
    return CheckResult(
        {"drop": missing / dotted - 1},
        f"drop {-missing:.4f}; dotted line {-dotted:.4f}, full line (10 um/s, alpha = 0.02) "
        f"{-full:.4f}",
    )


@check("caption-harmonics")
def _caption_harmonics(model: Model) -> CheckResult:
    a, b = model.curve(LD, alpha=model.numbers.alpha_low), model.curve(LD)
    scale = model.numbers.mu1_order
    gaps = {
        "mu1": float(np.abs(a.mu1 - b.mu1)[0].max()) / scale,
        "mu2": float(np.abs(a.mu2 - b.mu2)[0].max()) / scale,
    }
    return CheckResult(
        gaps,
        f"at most {1e6 * gaps['mu1'] * scale:.1f}e-6 (mu1) and "
        f"{1e6 * gaps['mu2'] * scale:.1f}e-6 (mu2) apart",
    )


@check("alpha-upper-limit")
def _upper_limit(model: Model) -> CheckResult:
    p = model.numbers
    applied = np.linspace(STRONGEST, 1.0, 11)
    drops = -model.response(LD, model.velocities[0], applied).delta_mu
    wanted = p.relative_drop * at(model.curve(LD).mu_ss)[0]
    needed = float(np.interp(wanted, drops, applied)) * p.transmission / STRONGEST
    measured = p.transmission_air_over_vacuum * model.borne(p.frequency_vacuum, None)
    loss = 1 - low_alpha(model).delta_mu[0] / model.outputs(RR).delta_mu[0]
    return CheckResult(
        {"1 um/s": needed / measured},
        f"alpha = 0.2 would need eps_eff/eps = {needed:.2f} for a drop of 20 %, where "
        f"{measured:.3f} was measured at 200 Hz; alpha = 0.02 lowers the drop by {loss:.1%}",
    )


@check("alpha-inferred")
def _inferred_alpha(model: Model) -> CheckResult:
    low, high = model.numbers["alpha_granite"].si_range or (np.nan, np.nan)
    return CheckResult({"low": low, "high": high}, f"{low:g} to {high:g} in Section III.B")
