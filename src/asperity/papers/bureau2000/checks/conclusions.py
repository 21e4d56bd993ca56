"""Claims of section III.D: concluding remarks."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.features import met, missed, over_the_range
from asperity.papers.bureau2000.checks.model import APPLIED, EXT, RR, Model, at
from asperity.papers.ledger.checks import CheckResult, check
from asperity.theory import closed_forms as cf
from asperity.theory.ageing_response import ageing_response


@check("as-soon-as-applied")
def _as_soon_as_applied(model: Model) -> CheckResult:
    r, p = model.curve(EXT), model.numbers
    smallest = at(r.delta_mu, APPLIED[0])
    return CheckResult(
        {"1 um/s": smallest[0], "10 um/s": smallest[1]},
        f"{smallest[0]:.1e} at eps = 0.005, {at(r.delta_mu, p.epsilon_onset)[0]:.1e} at 0.05",
    )


@check("harmonics-essential")
def _harmonics_essential(model: Model) -> CheckResult:
    a, b = model.outputs(EXT), model.outputs(RR)
    drop, mu1 = a.delta_mu[0] / b.delta_mu[0], a.mu1[0] / b.mu1[0]
    return CheckResult(
        {"1 um/s": (mu1 - 1) / abs(drop - 1)},
        f"Rice-Ruina to elasto-plastic: drop x {drop:.3f}, mu1 x {mu1:.0f} at 1 um/s",
    )


@check("velocity-controls")
def _velocity_controls(model: Model) -> CheckResult:
    changes = model.ageless_changes(EXT)
    return CheckResult(
        changes, "; ".join(f"{k} {v:+.1e}" for k, v in changes.items()) + " with B = 0, at 10 um/s"
    )


@check("plastic-rate")
def _plastic_rate(model: Model) -> CheckResult:
    plastic, whole = (over_the_range(model, law) for law in (EXT, RR))
    return CheckResult(
        {"difference": len(missed(model, whole)) - len(missed(model, plastic))},
        f"plastic velocity: {met(model, plastic)}; slider velocity: {met(model, whole)}",
    )


@check("high-frequency-no-tool")
def _not_a_good_tool(model: Model) -> CheckResult:
    ratios = {}
    for name, V in zip(("1 um/s", "10 um/s"), model.velocities, strict=True):
        wc = float(cf.critical_pulsation(model.small_modulation(V)))
        high, low = (
            _signal(model, V, omega) for omega in (2 * np.pi * model.numbers.frequency, wc)
        )
        ratios[name] = low / high
    return CheckResult(ratios, "; ".join(f"{k}: x {v:.0f}" for k, v in ratios.items()))


def _signal(model: Model, V: float, omega: float) -> float:
    """What alpha = 0.02 changes in c1/eps."""
    p = model.numbers
    point = {"omega": omega, "lambda_": p.lambda_}
    with_alpha = ageing_response(model.small_modulation(V, alpha=p.alpha_low, **point)).transfer
    return float(abs(with_alpha - ageing_response(model.small_modulation(V, **point)).transfer))
