"""Claims of section III.A.1: the formulas of Eqs. (10) to (24) against an integration."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.model import Model
from asperity.papers.bureau2000.integration import IntegratedOrbit
from asperity.papers.ledger.checks import CheckResult, check
from asperity.theory import closed_forms as cf

#: Amplitude of the integrations that check formulas of leading order: eps mu/A = 0.04.
SMALL = 1e-3


def _fast(model: Model) -> float:
    return model.velocities[1]


def _integrated(model: Model, **overrides: float) -> IntegratedOrbit:
    """Rigid asperities at 10 um/s, small amplitude."""
    return model.orbit(model.operating_point(_fast(model), **overrides), SMALL)


def _position_amplitude(model: Model) -> complex:
    """X1 (m) from the integration with inertia: x = V t - F/K."""
    p = model.numbers
    return -_integrated(model, M=p.M).c1 / SMALL * p.W0 / p.K


@check("steady-position")
def _steady_position(model: Model) -> CheckResult:
    p, point = model.numbers, model.small_modulation(_fast(model))
    printed, derived = (
        float(-cf.steady_position(point, 0.0, form) * p.K / p.W0)
        for form in ("as_printed", "derived")
    )
    steady = model.orbit(model.operating_point(_fast(model)), 0.0)
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": steady.mu + steady.delta_mu},
        f"spring force over W0: {printed:g} as printed, {derived:.4f} with "
        f"x_st = V t - mu W0/K, {steady.mu + steady.delta_mu:.4f} integrated",
    )


@check("exchanged-amplitudes")
def _exchanged_amplitudes(model: Model) -> CheckResult:
    p, point = model.numbers, model.small_modulation(_fast(model), M=model.numbers.M)
    printed, derived = (
        float(abs(x)) for x in (cf.age_amplitude(point), cf.position_amplitude(point))
    )
    found = abs(_position_amplitude(model))
    age = abs(_integrated(model, M=p.M).log_age1) / SMALL * p.D0 / _fast(model)
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"position: |Phi1| = {printed:.2e} (a time, s), |X1| = {derived:.3e} m, "
        f"integrated {found:.3e} m; age integrated: {age:.2e} s",
    )


@check("linear-system")
def _linear_system(model: Model) -> CheckResult:
    p, V, w = model.numbers, _fast(model), 2 * np.pi * model.numbers.frequency
    orbit, X1 = _integrated(model, M=p.M), _position_amplitude(model)
    Phi1 = orbit.log_age1 / SMALL * p.D0 / V
    force = (-p.M * w**2 + p.K + 1j * p.W0 * w * p.A / V) * X1 + p.W0 * p.B * V / p.D0 * Phi1
    ageing = 1j * w / V * X1 + (1j * w + V / p.D0) * Phi1
    residuals = {
        "Eq. (13)": abs(force / (-p.W0 * orbit.mu) - 1),
        "Eq. (14)": abs(ageing) / abs(w / V * X1),
    }
    return CheckResult(residuals, "; ".join(f"{k}: residual {v:.1e}" for k, v in residuals.items()))


@check("determinant")
def _determinant(model: Model) -> CheckResult:
    p, point = model.numbers, model.small_modulation(_fast(model), M=model.numbers.M)
    printed, derived = (
        float(abs(cf.determinant(point, form))) for form in ("as_printed", "derived")
    )
    numerator = p.W0 * float(point.mu) * (1j * float(point.omega) + _fast(model) / p.D0)
    found = abs(-numerator / _position_amplitude(model))
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"|Delta| = {printed:.4g} as printed, {derived:.4g} with Kc/K, {found:.4g} "
        "integrated (kg/s^3)",
    )


@check("first-harmonic")
def _first_harmonic(model: Model) -> CheckResult:
    point = model.small_modulation(_fast(model))
    formula = float(cf.first_harmonic(point, SMALL))
    found = abs(_integrated(model).c1)
    return CheckResult(
        {"printed": formula, "independent": found},
        f"{formula / SMALL:.5f} eps by the formula, {found / SMALL:.5f} eps integrated",
    )


@check("second-harmonic")
def _second_harmonic(model: Model) -> CheckResult:
    V = model.velocities[0]
    point = model.small_modulation(V)
    scale = float(point.kappa) * SMALL**2
    printed, derived = (
        float(cf.second_harmonic(point, SMALL, form)) / scale for form in ("as_printed", "derived")
    )
    found = abs(model.orbit(model.operating_point(V), SMALL).c2) / scale
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"in units of V K eps^2/(w W0): {printed:.1f} as printed, {derived:.2f} with "
        f"mu (mu + 2A)/(8 A^2), {found:.2f} integrated",
    )


@check("mean-shift")
def _mean_shift(model: Model) -> CheckResult:
    formula = float(cf.mean_shift(model.small_modulation(_fast(model)), SMALL)) / SMALL**2
    found = _integrated(model).delta_mu / SMALL**2
    return CheckResult(
        {"printed": formula, "independent": found},
        f"{formula:.4f} eps^2 by the formula, {found:.4f} eps^2 integrated",
    )


@check("mean-decreases")
def _mean_decreases(model: Model) -> CheckResult:
    shift = _integrated(model).delta_mu
    return CheckResult(
        {
            "integrated": shift,
            "Eq. (22)": float(cf.mean_shift(model.small_modulation(_fast(model)), SMALL)),
        },
        f"{shift:.2e} at eps = 0.001",
    )


@check("age-over-velocity")
def _age_over_velocity(model: Model) -> CheckResult:
    point = model.small_modulation(_fast(model))
    printed, derived = (
        float(cf.age_to_velocity_ratio(point, form)) for form in ("as_printed", "derived")
    )
    found = _age_ratio(model, _integrated(model))
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"{printed:.4f} as printed, {derived:.4f} with V/(w D0), {found:.4f} integrated",
    )


def _age_ratio(model: Model, orbit: IntegratedOrbit) -> float:
    """|delta Phi/Phi_st| over |delta v/V|, with v/V = 1 - (W0/(K V)) df/dt."""
    p = model.numbers
    velocity = abs(orbit.c1) * 2 * np.pi * p.frequency * p.W0 / (p.K * _fast(model))
    return abs(orbit.log_age1) / velocity


@check("velocity-modulation")
def _velocity_modulation(model: Model) -> CheckResult:
    point = model.small_modulation(_fast(model))
    formula = float(cf.velocity_modulation(point, 1.0))
    found = abs(_integrated(model).c1) / SMALL / float(point.kappa)
    return CheckResult(
        {"printed": formula, "independent": found},
        f"{formula:.2f} eps by the formula, {found:.2f} eps integrated",
    )
