"""Claims of the abstract and of the summary of results in section I."""

from __future__ import annotations

from asperity.papers.bureau2000.checks.features import at_strongest, met, missed, over_the_range
from asperity.papers.bureau2000.checks.model import EXT, LD, RR, Model, percent
from asperity.papers.ledger.checks import CheckResult, check
from asperity.theory.ageing_response import ageing_response


@check("abstract-substantial-drop")
def _modest_modulation(model: Model) -> CheckResult:
    drop = model.outputs(EXT).relative_drop
    return CheckResult(
        {"1 um/s": drop[0], "10 um/s": drop[1]},
        f"{percent(drop[0])} and {percent(drop[1])} at 1 and 10 um/s",
    )


@check("abstract-must-be-extended")
def _must_be_extended(model: Model) -> CheckResult:
    values = over_the_range(model, RR)
    return CheckResult(
        {"missed": len(missed(model, values))}, f"Rice-Ruina meets {met(model, values)}"
    )


@check("abstract-excellent-agreement")
def _excellent_agreement(model: Model) -> CheckResult:
    values = over_the_range(model, EXT)
    measured = model.outputs(EXT, lambda_=model.numbers.lambda_quasi_static)
    return CheckResult(
        {"missed": len(missed(model, values))},
        f"over the amplitudes of the statements {met(model, values)}; at eps = 0.5 alone "
        f"{met(model, at_strongest(model.outputs(EXT)))}, with the measured lambda = 0.62 um "
        f"{met(model, at_strongest(measured))}, with inertia "
        f"{met(model, at_strongest(model.inertial_outputs()))}",
    )


@check("relative-drop")
def _relative_drop(model: Model) -> CheckResult:
    drop = model.outputs(EXT).relative_drop
    return CheckResult(
        {"1 um/s": drop[0], "10 um/s": drop[1]},
        f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s",
    )


@check("rice-ruina-mean")
def _rice_ruina_mean(model: Model) -> CheckResult:
    drop = model.outputs(RR).relative_drop
    return CheckResult(
        {"1 um/s": drop[0], "10 um/s": drop[1]},
        f"{100 * drop[0]:.1f} % and {100 * drop[1]:.1f} % at 1 and 10 um/s",
    )


@check("linker-dieterich-not-better")
def _linker_dieterich_not_better(model: Model) -> CheckResult:
    with_alpha, without = (over_the_range(model, law) for law in (LD, RR))
    return CheckResult(
        {"difference": len(missed(model, with_alpha)) - len(missed(model, without))},
        f"alpha = 0.2 meets {met(model, with_alpha)}; alpha = 0 meets {met(model, without)}",
    )


@check("small-alpha-perturbation")
def _small_alpha_not_discriminating(model: Model) -> CheckResult:
    p, V = model.numbers, model.velocities[0]
    mu = float(model.small_modulation(V).mu)
    change = abs(mu - p.alpha_low) / mu - 1
    return CheckResult({"relative change": change}, f"mu1 changes by {change:+.1%}")


@check("quasi-stationary-limit")
def _quasi_stationary(model: Model) -> CheckResult:
    V, p = model.velocities[0], model.numbers
    slow = 1e-2 * V / p.D0
    elastic = ageing_response(model.small_modulation(V, omega=slow, lambda_=p.lambda_)).transfer
    rigid = ageing_response(model.small_modulation(V, omega=slow)).transfer
    change = float(abs(elastic)) / float(abs(rigid)) - 1
    return CheckResult({"relative change": change}, f"mu1 changes by {change:+.1e}")


@check("elastic-strain-relevant")
def _elastic_strain_relevant(model: Model) -> CheckResult:
    slow, fast = (a / b for a, b in zip(model.outputs(EXT).mu1, model.outputs(RR).mu1, strict=True))
    return CheckResult(
        {"1 um/s": slow, "10 um/s": fast},
        f"mu1 is {slow:.0f} times larger at 1 um/s and {fast:.1f} times at 10 um/s",
    )


@check("transmission-used")
def _transmission_used(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult({"used": p.transmission}, f"{p.transmission:g} is used, at 120 Hz")
