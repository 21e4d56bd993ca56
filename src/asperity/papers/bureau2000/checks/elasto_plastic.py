"""Claims of section III.C: the elasto-plastic extension."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.model import EXT, RR, Model, amplitude_slopes, at
from asperity.papers.ledger.checks import CheckResult, check


@check("elastic-length-order")
def _elastic_length_order(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult(
        {"quasi-static": p.lambda_quasi_static, "fitted": p.lambda_},
        f"{p['lambda_quasi_static']} (quasi-static), {p['lambda']} (fitted)",
    )


@check("stationary-unchanged")
def _stationary(model: Model) -> CheckResult:
    changes = {
        f"{V * 1e6:g} um/s": float(model.slider(EXT).law.mu_ss(V) / model.slider(RR).law.mu_ss(V))
        - 1
        for V in model.velocities
    }
    return CheckResult(changes, "identical mu_ss(V)")


@check("extended-equation")
def _equation(model: Model) -> CheckResult:
    """The fast solver against Eq. (29), written out and integrated in time."""
    p, r = model.numbers, model.outputs(EXT)
    gaps: dict[str, float] = {}
    for i, V in enumerate(model.velocities):
        orbit = model.orbit(
            model.operating_point(V, lambda_=p.lambda_), model.strongest, r.delta_mu[i]
        )
        found = {"drop": orbit.delta_mu, "mu1": abs(orbit.c1), "mu2": abs(orbit.c2)}
        ours = {"drop": r.delta_mu[i], "mu1": r.mu1[i], "mu2": r.mu2[i]}
        gaps |= {f"{k}, {V * 1e6:g} um/s": ours[k] / found[k] - 1 for k in found}
    worst = max(abs(g) for g in gaps.values())
    return CheckResult(gaps, f"mean, mu1 and mu2 agree to {worst:.0e}")


@check("inertia-negligible-elastic")
def _inertia(model: Model) -> CheckResult:
    heavy, light = model.inertial_outputs(), model.outputs(EXT)
    changes = {}
    for i, name in enumerate(("1 um/s", "10 um/s")):
        changes[f"drop, {name}"] = heavy.delta_mu[i] / light.delta_mu[i] - 1
        changes[f"mu1, {name}"] = heavy.mu1[i] / light.mu1[i] - 1
        changes[f"mu2, {name}"] = heavy.mu2[i] / light.mu2[i] - 1
    return CheckResult(changes, "; ".join(f"{k}: {v:+.0%}" for k, v in changes.items()))


@check("lambda-within-uncertainty")
def _within_uncertainty(model: Model) -> CheckResult:
    p = model.numbers
    distance = p.lambda_ - p.lambda_quasi_static
    uncertainty = p["lambda_quasi_static"].si_uncertainty or np.nan
    return CheckResult(
        {"distance": distance / uncertainty},
        f"{distance / uncertainty:.2f} of the uncertainty away",
    )


@check("mu1-most-sensitive")
def _most_sensitive(model: Model) -> CheckResult:
    p, other = model.numbers, model.curve(EXT, lambda_=model.numbers.lambda_quasi_static)
    r, step = model.curve(EXT), np.log(model.numbers.lambda_ / p.lambda_quasi_static)

    def sensitivity(a: np.ndarray, b: np.ndarray) -> float:
        return abs(float(np.log(at(np.abs(a))[0] / at(np.abs(b))[0]) / step))

    drop = sensitivity(r.delta_mu, other.delta_mu)
    mu1, mu2 = sensitivity(r.mu1, other.mu1), sensitivity(r.mu2, other.mu2)
    return CheckResult(
        {"drop": mu1 - drop, "mu2": mu1 - mu2},
        f"d ln/d ln lambda: mu1 {mu1:.2f}, mu2 {mu2:.2f}, drop {drop:.3f}",
    )


@check("mean-weakly-affected")
def _mean_unaffected(model: Model) -> CheckResult:
    a, b = model.outputs(EXT).delta_mu, model.outputs(RR).delta_mu
    changes = {"1 um/s": a[0] / b[0] - 1, "10 um/s": a[1] / b[1] - 1}
    return CheckResult(changes, "; ".join(f"{k}: {v:+.1%}" for k, v in changes.items()))


@check("mu1-weaker-velocity-dependence", "mu1")
@check("mu2-weaker-velocity-dependence", "mu2")
def _weaker(model: Model, name: str) -> CheckResult:
    r, rigid = model.curve(EXT), model.curve(RR)
    values = {"mu1": r.mu1, "mu2": r.mu2}[name]
    exponent = model.velocity_exponent(values)
    unmodified = model.velocity_exponent({"mu1": rigid.mu1, "mu2": rigid.mu2}[name])
    small = model.velocity_exponent(values, 0.05)
    return CheckResult(
        {"exponent": exponent},
        f"exponent {exponent:.3f} at eps = 0.5, where Rice-Ruina has {unmodified:.2f}; "
        f"{small:.2f} at eps = 0.05",
    )


@check("mu1-no-saturation", "mu1")
@check("mu2-no-saturation", "mu2")
def _no_saturation(model: Model, name: str) -> CheckResult:
    r = model.curve(EXT)
    slopes = amplitude_slopes({"mu1": r.mu1, "mu2": r.mu2}[name]).min(1)
    return CheckResult(
        {"1 um/s": slopes[0], "10 um/s": slopes[1]},
        f"smallest logarithmic slope {slopes[0]:.2f} and {slopes[1]:.2f} at 1 and 10 um/s",
    )
