"""Claims of section III.A.1: the scales of the problem and what may be neglected."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.model import APPLIED, RR, Model, at
from asperity.papers.ledger.checks import CheckResult, check
from asperity.slider import Slider
from asperity.theory import closed_forms as cf
from asperity.theory.ageing_response import ageing_response
from asperity.theory.perturbation import perturbation_response


@check("critical-stiffness")
def _critical_stiffness(model: Model) -> CheckResult:
    V = model.velocities[1]
    Kc = float(cf.critical_stiffness(model.small_modulation(V)))
    growth = _growth_rate(model, Kc) * model.numbers.D0 / V
    return CheckResult(
        {"growth rate": float(growth.real)},
        f"Kc = {1e-6 * Kc:.4f} N/um; growth rate there {growth.real:.1e} V/D0",
    )


def _growth_rate(model: Model, K: float) -> complex:
    """Leading eigenvalue (1/s) of unmodulated Rice-Ruina sliding at 10 um/s."""
    s = Slider(model.slider(RR).law, spring=K, load=model.numbers.W0)
    r = perturbation_response(s, velocity=model.velocities[1], frequency=model.numbers.frequency)
    return complex(r.eigenvalues[0])


@check("critical-pulsation")
def _critical_pulsation(model: Model) -> CheckResult:
    point = model.small_modulation(model.velocities[1])
    printed = float(cf.critical_pulsation(point))
    found = abs(_growth_rate(model, float(cf.critical_stiffness(point))).imag)
    return CheckResult(
        {"printed": printed, "independent": found},
        f"{printed:.3f} 1/s by the formula, {found:.3f} 1/s from the eigenvalues",
    )


@check("inertial-pulsation")
def _inertial_pulsation(model: Model) -> CheckResult:
    value = float(
        cf.inertial_pulsation(model.small_modulation(model.velocities[1], M=model.numbers.M))
    )
    return CheckResult({"sqrt(K/M)": value}, f"{value:.1f} 1/s")


@check("contrast")
def _contrast(model: Model) -> CheckResult:
    p = model.numbers
    value = (p.B - p.A) / p.A
    return CheckResult({"(B - A)/A": value}, f"{value:.3g}")


@check("critical-pulsation-number")
def _pulsation_number(model: Model) -> CheckResult:
    value = float(cf.critical_pulsation(model.small_modulation(model.velocities[1])))
    return CheckResult({"10 um/s": value}, f"{value:.1f} 1/s")


@check("slow-bifurcation")
def _slow_bifurcation(model: Model) -> CheckResult:
    point = model.small_modulation(model.velocities[1], M=model.numbers.M)
    wc = float(cf.critical_pulsation(point))
    return CheckResult(
        {
            "wc/w": wc / float(point.omega),
            "wc/w0": wc / float(cf.inertial_pulsation(point)),
        },
        f"wc/w = {wc / float(point.omega):.3f}, "
        f"wc/w0 = {wc / float(cf.inertial_pulsation(point)):.3f} at 10 um/s",
    )


@check("stiffness-ratio")
def _stiffness_ratio(model: Model) -> CheckResult:
    p = model.numbers
    point = model.small_modulation(model.velocities[0], lambda_=p.lambda_)
    rigid, elastic = (
        p.K / float(f(point)) for f in (cf.critical_stiffness, cf.critical_stiffness_elastic)
    )
    return CheckResult(
        {"K/Kc": rigid}, f"{rigid:.3f}; {elastic:.3f} with Kc = (B - A) W0/(D0 + A lambda)"
    )


@check("determinant-limit")
def _determinant_limit(model: Model) -> CheckResult:
    p, point = model.numbers, model.small_modulation(model.velocities[1], M=model.numbers.M)
    limit = float(point.omega) ** 2 * p.A * p.W0 / model.velocities[1]
    value = float(abs(cf.determinant(point))) / limit
    return CheckResult({"10 um/s": value}, f"|Delta| is {value:.4f} of that")


@check("inertia-negligible-linear")
def _inertia_negligible(model: Model) -> CheckResult:
    changes = {}
    for name, V in {"1 um/s": model.velocities[0], "10 um/s": model.velocities[1]}.items():
        heavy, light = (
            ageing_response(model.small_modulation(V, M=M)).transfer for M in (model.numbers.M, 0.0)
        )
        changes[name] = float(abs(heavy) / abs(light)) - 1
    _, top = model.numbers["V_range"].si_range or (np.nan, np.nan)
    heavy, light = (
        ageing_response(model.small_modulation(top, M=M)).transfer for M in (model.numbers.M, 0.0)
    )
    return CheckResult(
        changes,
        f"mu1 changes by {changes['10 um/s']:+.1%} at 10 um/s, and by "
        f"{float(abs(heavy) / abs(light)) - 1:+.0%} at 100 um/s",
    )


@check("velocity-gain")
def _velocity_gain(model: Model) -> CheckResult:
    p = model.numbers
    gain = p.mu0 / p.A
    low, high = (p.mu0 / (p.A + s * (p["A"].si_uncertainty or 0.0)) for s in (1, -1))
    return CheckResult(
        {"mu/A": gain}, f"{gain:.1f} eps; {low:.0f} to {high:.0f} within the uncertainty of A"
    )


@check("perturbation-out-of-reach")
def _out_of_reach(model: Model) -> CheckResult:
    p = model.numbers
    parameter = p.perturbative_epsilon * p.mu0 / p.A
    r = model.curve(RR)
    smallest, onset = at(-r.delta_mu, APPLIED[0])[0], at(-r.delta_mu, p.epsilon_onset)[0]
    return CheckResult(
        {"eps mu/A": parameter},
        f"eps mu/A = {parameter:.2f} at eps = 0.01; at the smallest applied eps, 0.005, the "
        f"drop is {smallest:.1e}, {onset / smallest:.0f} times below the noise",
    )


@check("age-negligible")
def _age_negligible(model: Model) -> CheckResult:
    changes = model.ageless_changes(RR)
    return CheckResult(
        changes, "; ".join(f"{k} {v:+.1e}" for k, v in changes.items()) + " without it, at 10 um/s"
    )
