"""Claims of the appendix: the formulas of the air layer, Eqs. (35) to (40)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from asperity.air import NormalContact, bessel_ratio
from asperity.papers.bureau2000.checks.model import Model
from asperity.papers.ledger.checks import CheckResult, check


def _layer_by_differences(model: Model) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Radii and delta P/delta h of Eq. (35) at 120 Hz by finite volumes."""
    from scipy.linalg import solve_banded

    p, layer, cells = model.numbers, model.air_layer(), 1000
    omega = 2 * np.pi * p.frequency
    R, h0 = float(layer.R), float(layer.h0)
    dr = R / cells
    faces = dr * np.arange(cells + 1)
    radius = faces[:-1] + dr / 2
    conductance = h0**2 / (12 * p.eta_air) * faces / dr
    # The rim, where the pressure excess is zero, is half a cell from the last centre.
    conductance[-1] *= 2
    volume = radius * dr
    banded = np.zeros((3, cells), dtype=complex)
    banded[0, 1:] = banded[2, :-1] = conductance[1:-1]
    banded[1] = -conductance[:-1] - conductance[1:] - 1j * omega * volume / p.P0
    pressure = solve_banded((1, 1), banded, 1j * omega * volume / h0)
    return np.asarray(radius, dtype=float), np.asarray(pressure)


@check("pressure-profile")
def _pressure_profile(model: Model) -> CheckResult:
    radius, by_differences = _layer_by_differences(model)
    formula = model.air_layer().pressure(radius, 2 * np.pi * model.numbers.frequency)
    gap = float(np.abs(formula - by_differences).max() / np.abs(by_differences).max())
    return CheckResult({"difference": gap}, f"differs by {gap:.1e}")


@check("pressure-force")
def _pressure_force(model: Model) -> CheckResult:
    radius, by_differences = _layer_by_differences(model)
    layer = model.air_layer()
    dr = float(layer.R) / radius.size
    integral = complex(np.sum(by_differences * 2 * np.pi * radius) * dr)
    formula = complex(-layer.dynamic_stiffness(2 * np.pi * model.numbers.frequency))
    return CheckResult(
        {"difference": abs(formula / integral - 1)},
        f"({formula.real / 1e6:.3f} {formula.imag / 1e6:+.3f}i) N/um, integrated "
        f"({integral.real / 1e6:.3f} {integral.imag / 1e6:+.3f}i) N/um",
    )


@check("elastic-limit")
def _elastic_limit(model: Model) -> CheckResult:
    value = complex(bessel_ratio(1e6))
    return CheckResult(
        {"difference": abs(value + 1)}, f"{value.real:.7f} {value.imag:+.1e}i at |gamma R| = 1e6"
    )


@check("viscous-limit")
def _viscous_limit(model: Model) -> CheckResult:
    p, layer = model.numbers, model.air_layer(R=1e-4)
    omega = 2 * np.pi * p.frequency
    expected = -1j * omega * 3 * p.eta_air * float(layer.R) ** 2 / (2 * p.P0 * p.h0**2)
    value = complex(bessel_ratio(layer.squeeze(omega)))
    force = complex(layer.dynamic_stiffness(omega))
    incompressible = 1j * omega * 3 * np.pi * p.eta_air * float(layer.R) ** 4 / (2 * p.h0**3)
    return CheckResult(
        {
            "J2/J0": abs(value / expected - 1),
            "force of an incompressible squeeze film": abs(force / incompressible - 1),
        },
        f"ratio {abs(value / expected):.8f}; force over 3 pi eta R^4 w/(2 h0^3) "
        f"{abs(force / incompressible):.8f}",
    )


@check("spring-and-damper")
def _both_parts(model: Model) -> CheckResult:
    ratios = bessel_ratio(np.geomspace(0.1, 100, 61))
    stiffness = model.air_layer().dynamic_stiffness(2 * np.pi * model.numbers.frequency)
    return CheckResult(
        {"spring": float((-ratios.real).min()), "damper": float((-ratios.imag).min())},
        f"({stiffness.real / 1e6:.1f} {stiffness.imag / 1e6:+.1f}i) N/um at 120 Hz",
    )


@check("equation-of-motion-sign")
def _equation_of_motion_sign(model: Model) -> CheckResult:
    p, epsilon = model.numbers, 0.01
    contact = NormalContact(W0=p.W0, lambda_z=p.lambda_z)
    printed = epsilon * p.lambda_z
    found = -float(contact.closure(p.W0 * (1 + epsilon)))
    return CheckResult(
        {"printed": printed, "derived": -printed, "independent": found},
        f"dh under a load 1 % heavier: {1e9 * printed:+.2f} nm as printed, "
        f"{-1e9 * printed:+.2f} nm with -eps W0, {1e9 * found:+.2f} nm from the logarithmic law",
    )


@check("borne-fraction-formula")
def _borne_fraction(model: Model) -> CheckResult:
    p, omega = model.numbers, 2 * np.pi * model.numbers.frequency
    radius, by_differences = _layer_by_differences(model)
    force = np.sum(by_differences * 2 * np.pi * radius) * float(model.air_layer().R) / radius.size
    kappa = p.W0 / p.lambda_z
    independent = abs(kappa / (kappa - p.M * omega**2 - force))
    value = model.borne(p.frequency, model.air_layer())
    return CheckResult(
        {"printed": value, "independent": float(independent)},
        f"{value:.5f}; from the integrated pressure {independent:.5f}",
    )


@check("pressure-equation-gap")
def _gap_of_the_pressure_equation(model: Model) -> CheckResult:
    p = model.numbers
    narrowest = p.h0 - model.strongest * p.lambda_z
    printed, derived = (h**2 / (12 * p.eta_air) for h in (narrowest, p.h0))
    # Poiseuille's mass flow over rho0 h0, per pressure gradient, at vanishing amplitude.
    gap, pressure, gradient = p.h0 * (1 - 1e-9), p.P0 * (1 + 1e-9), 1e-3
    mass_flow = pressure / p.P0 * gap**3 / (12 * p.eta_air) * gradient
    found = mass_flow / (p.h0 * gradient)
    return CheckResult(
        {"printed": printed, "derived": derived, "independent": found},
        f"{printed / found:.3f} of the coefficient of the linearised equation with h at its "
        f"smallest for eps = 0.5, {derived / found:.3f} with h0",
    )
