"""Claims of the appendix: the contacts in the normal direction and the gap between them."""

from __future__ import annotations

import numpy as np

from asperity.air import NormalContact, mindlin_length_ratio
from asperity.air import normal_length as length_from_shear
from asperity.papers.bureau2000.checks.model import Model, percent
from asperity.papers.ledger.checks import CheckResult, check


@check("only-fitting-parameter")
def _only_fitting_parameter(model: Model) -> CheckResult:
    p = model.numbers
    fitted = [n for n in ("A", "B", "D0", "lambda", "transmission") if p[n].kind == "fitted"]
    return CheckResult({"fitted": len(fitted)}, f"{len(fitted)}: {' and '.join(fitted)}")


@check("normal-length-of-roughness")
def _length_of_roughness(model: Model) -> CheckResult:
    p = model.numbers
    # The unrounded length: the stated 0.4 um has one digit.
    length = float(length_from_shear(p.lambda_, p.lambda_over_lambda_z))
    return CheckResult(
        {"lambda_z": length}, f"{1e6 * length:.3f} um, {length / p.roughness:.3f} of the roughness"
    )


def _contact(model: Model) -> NormalContact:
    return NormalContact(W0=model.numbers.W0, lambda_z=model.numbers.lambda_z)


@check("normal-stiffness")
def _linear_stiffness(model: Model) -> CheckResult:
    contact, p = _contact(model), model.numbers
    step = 1e-6 * p.lambda_z
    slope = float(contact.load(step) - contact.load(-step)) / (2 * step)
    return CheckResult(
        {"printed": p.W0 / p.lambda_z, "independent": slope}, f"{slope:.4g} N/m at 7 N"
    )


@check("restoring-force-sign")
def _restoring_sign(model: Model) -> CheckResult:
    p, contact = model.numbers, _contact(model)
    closure = 0.01 * p.lambda_z
    printed = p.W0 * -closure / p.lambda_z
    downwards = p.W0 - float(contact.load(closure))
    return CheckResult(
        {"printed": printed, "independent": downwards},
        f"gap 0.01 lambda_z narrower: {printed:+.4f} N as printed, {downwards:+.4f} N towards the "
        "track from the logarithmic law",
    )


@check("length-ratio")
def _length_ratio(model: Model) -> CheckResult:
    p = model.numbers
    ratio = float(mindlin_length_ratio(p.poisson_ratio))
    return CheckResult(
        {"nu = 0.44": ratio},
        f"{ratio:.3f}; at most {float(mindlin_length_ratio(0.5)):g}, for nu = 1/2",
    )


@check("normal-length")
def _normal_length(model: Model) -> CheckResult:
    p = model.numbers
    value = float(length_from_shear(p.lambda_, p.lambda_over_lambda_z))
    return CheckResult({"lambda_z": value}, f"{1e6 * value:.3f} um")


@check("measured-lambda")
def _measured_length(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult(
        {"quasi-static": p.lambda_quasi_static},
        f"measured {p['lambda_quasi_static']}; fitted {p['lambda']}",
    )


@check("gap")
def _gap(model: Model) -> CheckResult:
    p = model.numbers
    return CheckResult(
        {"h0": p.gap_over_roughness * p.roughness},
        f"{1e6 * p.gap_over_roughness * p.roughness:.2f} um",
    )


@check("radius-of-area")
def _radius(model: Model) -> CheckResult:
    p, R = model.numbers, model.nominal_radius
    return CheckResult(
        {"R": R},
        f"49 cm^2 is a disc of {100 * R:.3f} cm; 3.9 cm gives {1e4 * np.pi * p.R**2:.1f} cm^2",
    )


@check("pressure-over-modulus")
def _pressure_over_modulus(model: Model) -> CheckResult:
    p = model.numbers
    modulus = p.W0 / p.Sigma0 / p.pressure_over_modulus
    return CheckResult(
        {"modulus": modulus}, f"{p.W0 / p.Sigma0 / 1e3:.2f} kPa is 1e-5 of {modulus / 1e9:.2f} GPa"
    )


@check("contact-pressure")
def _contact_pressure(model: Model) -> CheckResult:
    p = model.numbers
    pressure = p.W0 / p.Sigma0
    return CheckResult({"pressure": pressure}, f"{pressure / 100:.1f} mbar")


@check("small-pressure")
def _small_pressure(model: Model) -> CheckResult:
    p = model.numbers
    _, epsilon = p["epsilon_range"].si_range or (np.nan, np.nan)
    ratio = epsilon * p.W0 / p.Sigma0 / p.P0
    return CheckResult({"eps = 0.5": ratio}, percent(ratio))
