"""Claims of sections III.A.2 and III.A.3: the Rice-Ruina model integrated numerically."""

from __future__ import annotations

import numpy as np

from asperity.air import effective_modulation
from asperity.papers.bureau2000.checks.model import (
    RR,
    STRONGEST,
    Model,
    amplitude_slopes,
    at,
    relative,
)
from asperity.papers.ledger.checks import CheckResult, check


@check("rice-ruina-drop-velocity")
def _weak_velocity_dependence(model: Model) -> CheckResult:
    r = model.curve(RR)
    changes = {f"eps = {e:g}": relative(at(r.delta_mu, e)) for e in (0.2, 0.35, STRONGEST)}
    return CheckResult(
        changes, "from 1 to 10 um/s: " + "; ".join(f"{k} {v:+.1%}" for k, v in changes.items())
    )


@check("transmission-divisor")
def _divisor(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult(
        {"1/2.1": 1 / p.collapse_divisor_120Hz}, f"1/2.1 = {1 / p.collapse_divisor_120Hz:.3f}"
    )


@check("fitted-transmission")
def _fitted_transmission(model: Model) -> CheckResult:
    p, r = model.numbers, model.curve(RR)
    wanted = p.relative_drop * at(r.mu_ss)[0]
    applied = np.array([0.45, 0.5, 0.55])
    drops = -model.response(RR, model.velocities[0], applied).delta_mu
    needed = float(np.interp(wanted, drops, applied)) * p.transmission / STRONGEST
    return CheckResult(
        {"1 um/s": needed}, f"a drop of 20 % at eps = 0.5 needs eps_eff/eps = {needed:.3f}"
    )


@check("weak-frequency-dependence")
def _weak_frequency_dependence(model: Model) -> CheckResult:
    p = model.numbers
    layers = {"full area": model.air_layer(), "patch of 2.5 cm": model.air_layer(R=p.patch_radius)}
    changes = {
        name: model.borne(p.frequency_vacuum, layer) / model.borne(p.frequency, layer) - 1
        for name, layer in layers.items()
    }
    return CheckResult(
        changes, "; ".join(f"{name}: {change:+.1%}" for name, change in changes.items())
    )


@check("transmission-200-Hz")
def _transmission_at_200_Hz(model: Model) -> CheckResult:
    p = model.numbers
    vacuum = model.borne(p.frequency_vacuum, None)
    in_air = p.transmission_air_over_vacuum * vacuum
    return CheckResult(
        {"200 Hz": in_air},
        f"0.4 of the {vacuum:.3f} in vacuo: eps_eff = {in_air:.3f} eps at 200 Hz",
    )


@check("depends-on-normal-stiffness")
def _depends_on_stiffness(model: Model) -> CheckResult:
    p, layer, factor = model.numbers, model.air_layer(), 1.01
    shares = [
        float(effective_modulation(p.frequency, W0=p.W0, M=p.M, lambda_z=length, layer=layer))
        for length in (p.lambda_z, p.lambda_z / factor)
    ]
    sensitivity = float(np.log(shares[1] / shares[0]) / np.log(factor))
    return CheckResult(
        {"sensitivity": sensitivity}, f"eps_eff/eps varies as kappa_z^{sensitivity:.2f}"
    )


@check("rice-ruina-mu1-linear-in-V", "mu1")
@check("rice-ruina-mu2-linear-in-V", "mu2")
def _quasi_linear(model: Model, name: str) -> CheckResult:
    r = model.curve(RR)
    values = {"mu1": r.mu1, "mu2": r.mu2}[name]
    exponents = {
        f"eps = {e:g}": model.velocity_exponent(values, e) for e in (0.05, 0.25, STRONGEST)
    }
    return CheckResult(exponents, f"{name} varies as V^{exponents['eps = 0.5']:.3f} at eps = 0.5")


@check("rice-ruina-mu1-saturates", "mu1")
@check("rice-ruina-mu2-saturates", "mu2")
def _saturation(model: Model, name: str) -> CheckResult:
    r = model.curve(RR)
    slopes = amplitude_slopes({"mu1": r.mu1, "mu2": r.mu2}[name])[:, -1]
    return CheckResult(
        {"1 um/s": slopes[0], "10 um/s": slopes[1]},
        f"logarithmic slope {slopes[0]:.2f} and {slopes[1]:.2f} at 1 and 10 um/s",
    )


@check("rice-ruina-disagrees")
def _disagreement(model: Model) -> CheckResult:
    r = model.curve(RR)
    mismatch = {
        "exponent of mu1 in V": model.velocity_exponent(r.mu1),
        "orders of magnitude of mu1 at 1 um/s": float(
            np.log10(model.numbers.mu1_order / at(r.mu1)[0])
        ),
    }
    return CheckResult(mismatch, "; ".join(f"{k}: {v:.2f}" for k, v in mismatch.items()))
