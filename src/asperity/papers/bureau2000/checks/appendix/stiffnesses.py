"""Claims of the appendix: stiffnesses, the borne fraction at 120 Hz, the shear of the air."""

from __future__ import annotations

import numpy as np

from asperity.air import shear_viscosity_ratio
from asperity.papers.bureau2000.checks.model import RR, Model
from asperity.papers.ledger.checks import CheckResult, check


@check("air-stiffness")
def _air_stiffness(model: Model) -> CheckResult:
    value = float(model.air_layer(R=model.nominal_radius).stiffness)
    return CheckResult({"kappa_air": value}, f"{value:.3g} N/m")


@check("air-stiffer-than-contacts")
def _stiffer_than_contacts(model: Model) -> CheckResult:
    p = model.numbers
    ratio = float(model.air_layer(R=model.nominal_radius).stiffness) * p.lambda_z / p.W0
    return CheckResult({"kappa_air/kappa_z": ratio}, f"{ratio:.1f}")


def _normal_frequency(model: Model) -> float:
    p = model.numbers
    return float(np.sqrt(p.W0 / (p.lambda_z * p.M)) / (2 * np.pi))


@check("normal-resonance")
def _normal_resonance(model: Model) -> CheckResult:
    value = _normal_frequency(model)
    return CheckResult({"resonance": value}, f"{value:.1f} Hz")


@check("normal-inertia")
def _normal_inertia(model: Model) -> CheckResult:
    p = model.numbers
    value = (p.frequency / _normal_frequency(model)) ** 2
    return CheckResult({"120 Hz": value}, f"{value:.4f}")


@check("squeeze-number")
def _squeeze_number(model: Model) -> CheckResult:
    p, layer = model.numbers, model.air_layer()
    value = complex(layer.gamma(2 * np.pi * p.frequency) * layer.R)
    return CheckResult({"real": value.real, "imaginary": -value.imag}, f"{value.real:.3f} (1 - i)")


@check("borne-fraction-120")
def _computed_fraction(model: Model) -> CheckResult:
    p = model.numbers
    value, nominal = (
        model.borne(p.frequency, layer)
        for layer in (model.air_layer(), model.air_layer(R=model.nominal_radius))
    )
    return CheckResult({"120 Hz": value}, f"{value:.3f}; {nominal:.3f} with 49 cm^2")


@check("borne-fraction-order")
def _same_order(model: Model) -> CheckResult:
    p = model.numbers
    value = model.borne(p.frequency, model.air_layer())
    return CheckResult(
        {"120 Hz": value}, f"{value:.3f}, a factor {p.transmission / value:.2f} lower"
    )


@check("small-effective-amplitude")
def _small_effective_amplitude(model: Model) -> CheckResult:
    p = model.numbers
    _, epsilon = p["epsilon_range"].si_range or (np.nan, np.nan)
    amplitudes = {
        "air, 120 Hz": epsilon * p.transmission,
        "vacuum, 200 Hz": epsilon * model.borne(p.frequency_vacuum, None),
    }
    return CheckResult(amplitudes, "; ".join(f"{k}: {v:.2f}" for k, v in amplitudes.items()))


def _shear_ratio(model: Model, as_printed: bool) -> float:
    p = model.numbers
    return float(
        shear_viscosity_ratio(
            p.shear_viscosity_velocity,
            W0=p.W0,
            A=p.A,
            layer=model.air_layer(R=model.nominal_radius),
            as_printed=as_printed,
        )
    )


def _two_forces(model: Model) -> float:
    """Viscous over rate-dependent force of one oscillation, each from its own definition."""
    p, V = model.numbers, model.numbers.shear_viscosity_velocity
    law, omega, amplitude = model.slider(RR).law, 2 * np.pi * p.frequency, 1e-9
    velocity = omega * amplitude
    viscous = p.eta_air * velocity * p.Sigma0 / p.h0
    state, nudge = law.steady_state(V), 1e-4 * V
    slope = (law.friction(V + nudge, state, 1.0) - law.friction(V - nudge, state, 1.0)) / (
        2 * nudge
    )
    return viscous / (p.W0 * float(slope) * velocity)


@check("shear-viscosity-ratio")
def _shear_viscosity(model: Model) -> CheckResult:
    printed, derived, found = (
        _shear_ratio(model, True),
        _shear_ratio(model, False),
        _two_forces(model),
    )
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"{printed:.3g} as printed, {derived:.3g} with A, {found:.3g} from the two forces",
    )


@check("shear-negligible")
def _shear_negligible(model: Model) -> CheckResult:
    ratio = _two_forces(model)
    return CheckResult({"100 um/s": ratio}, f"{ratio:.1e}")
