"""Claims of the appendix: the control experiment in vacuo, and the patch of contacts."""

from __future__ import annotations

import numpy as np

from asperity.papers.bureau2000.checks.model import Model
from asperity.papers.ledger.checks import CheckResult, check


@check("vacuum-stiffness")
def _vacuum_stiffness(model: Model) -> CheckResult:
    p = model.numbers
    layer = model.air_layer(P0=p.P_vacuum, R=model.nominal_radius)
    ratio = float(layer.stiffness) * p.lambda_z / p.W0
    return CheckResult({"1 mbar": ratio}, f"{ratio:.4f}")


@check("vacuum-mean-free-path")
def _vacuum_path(model: Model) -> CheckResult:
    p = model.numbers
    layer = model.air_layer(P0=p.P_vacuum, temperature=p.gas_temperature)
    path = float(layer.mean_free_path)
    return CheckResult(
        {"mean free path": path}, f"{1e6 * path:.0f} um, {float(layer.knudsen):.1f} times the gap"
    )


@check("vacuum-fraction")
def _vacuum_fraction(model: Model) -> CheckResult:
    p = model.numbers
    value = model.borne(p.frequency_vacuum, None)
    return CheckResult({"200 Hz": value}, f"{value:.3f}")


@check("air-fraction-200")
def _air_fraction(model: Model) -> CheckResult:
    p = model.numbers
    value = model.borne(p.frequency_vacuum, model.air_layer(R=model.nominal_radius))
    return CheckResult(
        {"200 Hz": value},
        f"{value:.3f}; {model.borne(p.frequency_vacuum, model.air_layer()):.3f} with R = 3.9 cm",
    )


@check("scaling-ratio")
def _scaling_ratio(model: Model) -> CheckResult:
    p = model.numbers
    vacuum = model.borne(p.frequency_vacuum, None)
    value, stated = (
        model.borne(p.frequency_vacuum, layer) / vacuum
        for layer in (model.air_layer(R=model.nominal_radius), model.air_layer())
    )
    return CheckResult({"200 Hz": value}, f"{value:.3f}; {stated:.3f} with R = 3.9 cm")


@check("same-amount")
def _same_amount(model: Model) -> CheckResult:
    p = model.numbers
    at_120 = p.transmission / model.borne(p.frequency, model.air_layer())
    ratio = model.borne(p.frequency_vacuum, model.air_layer()) / model.borne(
        p.frequency_vacuum, None
    )
    at_200 = p.transmission_air_over_vacuum / ratio
    return CheckResult(
        {"relative difference": at_200 / at_120 - 1},
        f"observed over estimated: {at_120:.2f} at 120 Hz, {at_200:.2f} at 200 Hz",
    )


@check("patch-radius")
def _patch(model: Model) -> CheckResult:
    p = model.numbers
    value = model.borne(p.frequency, model.air_layer(R=p.patch_radius))
    vacuum = model.borne(p.frequency_vacuum, None)
    other = model.borne(p.frequency_vacuum, model.air_layer(R=p.patch_radius)) / vacuum
    return CheckResult(
        {"R = 2.5 cm": value},
        f"{value:.3f}; air over vacuum at 200 Hz {other:.3f} with the same patch",
    )


@check("patch-area")
def _patch_area(model: Model) -> CheckResult:
    p = model.numbers
    value = np.pi * p.patch_radius**2 / p.Sigma0
    return CheckResult({"area fraction": value}, f"{value:.3f}")
